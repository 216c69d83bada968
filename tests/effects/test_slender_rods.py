"""Bodies of which only the mass is given: slender rods between their joints; an explicit zero stays one."""

from __future__ import annotations

import numpy as np
import pytest

import sweep
from sweep.effects import extended, offered
from sweep.effects.link_loads import rods_of
from sweep.effects.loads import POINT
from sweep.families import NAMES, family
from sweep.families.link_tree import LinkTree

LINKS = {"a": 30.0, "b": 90.0, "c": 60.0, "e": 85.0, "f": 5.0, "g": -4.0, "alpha": 0.4}
MASSES = {"m_crank": 2e-4, "m_coupler": 1e-4, "m_rocker": 3e-4}
LENGTHS = {"crank": 30.0, "coupler": 90.0, "rocker": 60.0}
PHI = np.linspace(0.0, 6.0, 13)
WANT = ["drive_torque", "reduced_inertia", "force_b", "shaking_moment"]


def loads(family, links, **given):
    return sweep.evaluate(family, links | {"speed": 500.0, **given}, WANT, phi=PHI)[WANT]


def rod(body, mass):
    length = LENGTHS[body]
    moments = {f"j_{body}_{axis}": mass * length**2 / 12.0 for axis in ("yy", "zz")}
    return {f"m_{body}": mass, f"com_{body}_x": 0.5 * length} | moments


def rods():
    return {name: value for body, mass in MASSES.items() for name, value in rod(body[2:], mass).items()}


def test_masses_alone_are_slender_rods():
    found = loads("rssr", LINKS, **MASSES)
    # the same operations but for the order of two products
    np.testing.assert_allclose(found, loads("rssr", LINKS, **rods()), rtol=1e-12, atol=1e-9)
    assert found.drive_torque.abs().max() > 1000.0  # N mm; it was 2e-13


def thick(body, mass, radius):
    """Explicit centre and inertia of a round bar: m (l^2/12 + r^2/4) across it, m r^2/2 along it."""
    across, along = mass * (LENGTHS[body] ** 2 / 12.0 + radius**2 / 4.0), mass * radius**2 / 2.0
    given = {f"j_{body}_xx": along, f"j_{body}_yy": across, f"j_{body}_zz": across}
    return {f"m_{body}": mass, f"com_{body}_x": 0.5 * LENGTHS[body]} | given


def test_an_exact_bar_of_a_material_and_a_section_is_its_cylinder():
    bars, given = {}, {}
    for body, length in LENGTHS.items():
        bars |= sweep.rod(body, "steel", "12 mm round", "exact")
        given |= thick(body, 7.85e-9 * np.pi * 36.0 * length, 6.0)
    found = loads("rssr", LINKS, **bars)
    np.testing.assert_allclose(found, loads("rssr", LINKS, **given), rtol=1e-12, atol=1e-9)
    slender = bars | {name: 0.0 for name in bars if name.startswith("gyration")}
    assert not np.allclose(found, loads("rssr", LINKS, **slender), rtol=1e-3)


def test_exact_inertia_needs_a_section_that_is_alike_all_round():
    assert sweep.rod("crank", "steel", "6 mm square", "exact")["gyration_crank"] == pytest.approx(np.sqrt(3.0))
    assert sweep.rod("crank", "steel", "8 x 1 mm tube", "exact")["gyration_crank"] == pytest.approx(2.5)
    for section, inertia in (("6 x 4 mm rectangular", "exact"), ("6 mm round", "thick")):
        with pytest.raises(sweep.InputError, match="slender"):
            sweep.rod("crank", "steel", section, inertia)


def test_a_wall_of_more_than_half_the_diameter_is_refused():
    solid = sweep.rod("crank", "steel", "6 mm round")["line_mass_crank"]
    assert sweep.rod("crank", "steel", "6 x 3 mm tube")["line_mass_crank"] == pytest.approx(solid, rel=1e-15)
    with pytest.raises(sweep.InputError, match="at most half the diameter"):
        sweep.rod("crank", "steel", "6 x 4 mm tube")
    with pytest.raises(sweep.InputError, match="section = 6; allowed: a section"):
        sweep.rod("crank", "steel", 6)


def test_an_explicit_zero_is_a_mass_in_its_pivot():
    zeros = {f"com_{body}_x": 0.0 for body in LENGTHS}
    assert loads("rssr", LINKS, **MASSES, **zeros).drive_torque.abs().max() > 0.0
    in_pivots = {"m_crank": 2e-4, "m_rocker": 3e-4, "m_coupler": 0.0, "com_crank_z": 0.0, "j_rocker_xy": 0.0}
    assert loads("rssr", LINKS, **in_pivots).drive_torque.abs().max() < 1e-9
    both = [loads("rssr", LINKS, **MASSES, **zeros, **{f"rod_{body}": one for body in LENGTHS}) for one in (0.0, 1.0)]
    np.testing.assert_array_equal(both[0], loads("rssr", LINKS, **MASSES, **zeros))
    np.testing.assert_array_equal(both[1], loads("rssr", LINKS, **MASSES))


def test_each_body_is_judged_by_itself_and_a_slider_stays_a_point():
    mixed = rods() | {"m_crank": 2e-4}
    for name in ("com_crank_x", "j_crank_yy", "j_crank_zz"):
        del mixed[name]
    np.testing.assert_allclose(loads("rssr", LINKS, **mixed), loads("rssr", LINKS, **rods()), rtol=1e-12, atol=1e-9)
    crank = {"a": 30.0, "b": 90.0, "e": 5.0, "f": 2.0, "alpha": 1.2, "m_slider": 3e-4}
    alone = loads("rssp", crank, m_crank=2e-4, m_coupler=1e-4)
    np.testing.assert_allclose(
        alone, loads("rssp", crank, **rod("crank", 2e-4), **rod("coupler", 1e-4)), rtol=1e-12, atol=1e-9
    )


def test_stages_of_a_chain_and_a_bound_design_have_their_own_rods():
    chain = {f"{name}1": value for name, value in LINKS.items()} | {
        "a2": 20.0, "b2": 80.0, "c2": 50.0, "e2": 75.0, "f2": 3.0, "g2": 2.0, "alpha2": 0.2,
    }  # fmt: skip
    table = chain | {f"{name}{k}": x for name, x in MASSES.items() for k in (1, 2)} | {"speed1": 300.0}
    first = sweep.evaluate(["rssr", "rssr"], table, ["drive_torque1"], phi=PHI)
    given = {f"com_rocker_x{2}": 25.0, "j_rocker_yy2": 3e-4 * 2500.0 / 12.0, "j_rocker_zz2": 3e-4 * 2500.0 / 12.0}
    second = sweep.evaluate(["rssr", "rssr"], table | given, ["drive_torque1"], phi=PHI)
    np.testing.assert_allclose(first.drive_torque1, second.drive_torque1, rtol=1e-11)
    bound = sweep.mechanism("rssr", **LINKS, **MASSES, speed=500.0)
    one = bound.poses(PHI, ["drive_torque"])
    np.testing.assert_allclose(one["drive_torque"], loads("rssr", LINKS, **MASSES).drive_torque, rtol=1e-12)


def test_bodies_of_trees_of_links_are_rods_between_their_joints_too():
    """A lever drive: lengths of its parameters in place of its poses; explicit rods in place of the default."""
    design = dict(family("heddle").example)
    own = {p.name: p.default for p in family("heddle").parameters if p.default is not None} | design
    lengths = {"lever": own["O2B"], "rod": own["BC"], "bell": own["O3C"]}
    want, speed = ["drive_torque", "reduced_inertia", "shaking_moment"], {"speed": 60.0}
    masses = {f"m_{body}": 1e-3 for body in lengths}
    alone = sweep.evaluate("heddle", design | masses | speed, want, phi=PHI)[want]
    given = masses | {f"com_{body}_x": 0.5 * length for body, length in lengths.items()}
    given |= {f"j_{body}_{x}": 1e-3 * length**2 / 12.0 for body, length in lengths.items() for x in ("yy", "zz")}
    explicit = sweep.evaluate("heddle", design | given | speed, want, phi=PHI)[want]
    np.testing.assert_allclose(alone, explicit, rtol=1e-12, atol=1e-12 * explicit.abs().max().max())
    assert explicit.drive_torque.abs().max() > 1.0


def test_rods_that_hang_between_balls_have_their_centre_halfway():
    design = dict(family("five_link").example)
    bodies = {family("five_link").find(LinkTree).bodies[k].name for k in rods_of(family("five_link").find(LinkTree))}
    assert bodies == {body.name for body in family("five_link").find(LinkTree).bodies}
    loads = {f"m_{body}": 1e-4 for body in bodies} | {"speed": 100.0}
    found = sweep.evaluate("five_link", design | loads, ["reduced_inertia"], phi=PHI)["reduced_inertia"]
    points = sweep.evaluate(
        "five_link", design | loads | {f"rod_{b}": 0.0 for b in bodies}, ["reduced_inertia"], phi=PHI
    )
    assert (found > 0.0).all() and not np.allclose(found, points["reduced_inertia"])


@pytest.mark.parametrize(
    ("name", "body", "length"),
    [
        ("swivel", "rod", "Lw"), ("eyelet", "crank", "a"), ("cam_lever", "lever", "c"), ("heddle", "back", "O4E"),
        ("cylindrical_looper", "rocker", "c1"), ("cylindrical_looper", "coupler2", "b2"),
        ("geared_dwell", "carrier", None),
    ],
)  # fmt: skip
def test_a_body_that_slides_or_touches_is_a_rod_to_its_end_too(name, body, length):
    """To the working point, the roller, the end that bears another rod, the ball."""
    design, mass = dict(family(name).example) | {"speed": 60.0}, {f"m_{body}": 1e-3}
    reach = design[length] if length else 2.0
    want = ["drive_torque", "reduced_inertia", "shaking_force", "shaking_moment"]
    parameters = extended(family(name), want).parameter_names
    inertia = 1e-3 * reach**2 / 12.0
    given = {n: inertia for n in (f"j_{body}", f"j_{body}_yy", f"j_{body}_zz") if n in parameters}
    phi = np.linspace(0.1, 6.1, 13)
    alone = sweep.evaluate(name, design | mass, want, phi=phi)[want]
    explicit = sweep.evaluate(name, design | mass | given | {f"com_{body}_x": 0.5 * reach}, want, phi=phi)[want]
    np.testing.assert_allclose(alone, explicit, rtol=1e-11, atol=1e-12 * explicit.abs().max().max())
    assert explicit.reduced_inertia.max() > 0.0 and explicit.shaking_moment.abs().max() > 0.0


@pytest.mark.parametrize("name", NAMES)
def test_of_every_mass_it_is_said_what_it_is_without_centre_and_inertia(name):
    """A rod where the body has a length among its dimensions; else it lies in its joint, and the register says so."""
    if "drive_torque" not in {output.name for output in offered(family(name))}:
        return
    parameters = {p.name: p for p in extended(family(name), ["drive_torque"]).parameters}
    masses = [p for p in parameters if p.startswith("m_") and p not in ("m_tool", "m_slider")]
    assert masses or name == "free_cam_friction"
    for mass in masses:
        assert (mass.replace("m_", "rod_") in parameters) != (POINT in parameters[mass].text), mass


def test_a_body_has_the_mass_of_its_material_and_section():
    bars = sweep.rod("crank", "steel", "6 mm round") | sweep.rod("coupler", "aluminium", "0.8 x 0.4 cm rectangular")
    bars |= sweep.rod("rocker", "titanium", "8 x 1 mm tube")
    areas = {"crank": 9.0 * np.pi, "coupler": 32.0, "rocker": 7.0 * np.pi}
    densities = {"crank": 7.85e-9, "coupler": 2.75e-9, "rocker": 4.506e-9}
    masses = {f"m_{body}": densities[body] * areas[body] * LENGTHS[body] for body in LENGTHS}
    np.testing.assert_allclose(loads("rssr", LINKS, **bars), loads("rssr", LINKS, **masses), rtol=1e-12, atol=1e-9)


@pytest.mark.parametrize(
    ("material", "section", "words"),
    [
        ("stell", "6 mm round", "steel"),
        ("steel", "6 round", "a section, as"),
        ("steel", "6 x 4 mm round", "a section, as"),
        ("steel", "6 kg round", "a section, as"),
        ("steel", "6 x 7 mm tube", "positive sizes"),
    ],
)
def test_what_is_no_material_and_no_section_is_refused(material, section, words):
    with pytest.raises(sweep.InputError, match=words):
        sweep.rod("crank", material, section)


def test_grams_given_as_tonnes_are_refused_with_value_and_unit():
    with pytest.raises(sweep.InputError, match=r"m_crank = 20.*below 10 t.*20 g"):
        loads("rssr", LINKS, **MASSES | {"m_crank": 20.0})
