"""A rocker that drives both cranks of a looper: nested positions, slopes, names, margins, friction handed back.

Force and moment on the frame, and the torque of the first crank, are held to momentum and power in
tests/effects/test_momentum.py.
"""

from __future__ import annotations

import numpy as np
import pandas as pd
import pytest
from mpmath import mp

import sweep
from kernels import status as st
from sweep import InputError
from sweep.effects import all_inputs
from sweep.families import family
from sweep.families.link_tree import LinkTree
from sweep.families.sites import links_of
from tests.reference import chain as naive
from tests.reference import cylindrical_looper, spherical_looper
from tests.reference.space import derivatives, exact
from tests.support.family_checks import assert_gradients_are_those_of_the_reference, factors

FIRST = {"a": 1.0, "b": 4.1, "c": 3.2, "e": 2.9, "f": 0.6, "g": -0.4, "alpha": 0.7, "branch": -1.0}


def on_cylinder(numbers, phi, near):
    """The looper with its second ball wherever it is, found from where it is on the axis."""
    return cylindrical_looper.coupled(numbers, phi, near or cylindrical_looper.position(numbers, phi))


REFERENCES = {"spherical_looper": spherical_looper.position, "cylindrical_looper": on_cylinder}
LOOPERS = list(REFERENCES)
COUPLING = {"kappa2": -1.0, "offset2": 0.6, "shift2": 0.0, "turn2": 0.0}
PHI = np.linspace(0.1, 6.2, 9)
OMEGA = 7.0
NEAR = 1e-12  # of the largest
RATES = ("d", "d2", "d3")
MAGNITUDES = ("speed_p", "acceleration_p", "jerk_p")


def table(name):
    second = {p.name: p.default for p in family(name).parameters if p.default is not None} | dict(family(name).example)
    own = {f"{key}1": x for key, x in FIRST.items()} | {f"{key}2": x for key, x in second.items()}
    return own | COUPLING


def design(name):
    own = table(name)
    return [own[key] for key in family(["rssr", name]).parameter_names]


def nested(name):
    """Pose outputs of the looper where the rocker's angle turns its cranks; ``near`` are those of a pose close by."""
    last = 8 + len(family(name).parameters)

    def position(numbers, phi, near=None):
        kappa, offset = numbers[last], numbers[last + 1]
        return REFERENCES[name](numbers[8:last], kappa * naive.rocker_angle(numbers[:8], phi) + offset, near)

    return position


@pytest.mark.parametrize("name", LOOPERS)
def test_a_driven_looper_equals_nested_joint_geometry(name):
    numbers = design(name)
    for phi in (0.3, 2.1, 4.4):
        row = sweep.evaluate(["rssr", name], table(name), wanted(name), [phi])
        assert row.status[0] == st.OK
        with mp.workdps(100):
            given = exact(numbers)
            expected = derivatives(lambda x, near, given=given: nested(name)(given, x, near), mp.mpf(phi))
        found = factors(["rssr", name], numbers, phi, expected, row.iloc[0])
        # three closures in series add a few roundings each to those of the inputs
        assert max(found.values()) <= 16.0, (phi, found)
        for order, size in zip(RATES, MAGNITUDES, strict=True):
            parts = [f"{order}{x}_p" for x in "xyz"]
            of = mp.sqrt(sum(expected[part] ** 2 for part in parts))
            off = mp.sqrt(sum((row[part][0] - expected[part]) ** 2 for part in parts))
            # the magnitude of a vector is off by that of its error, and by the roundings of a sum and a root
            assert abs(row[size][0] - of) <= off + 4.0 * 2.0**-53 * of, size


def wanted(name):
    mechanism = family(name)
    return [*mechanism.derivative_of, *(x for x in mechanism.derivative_of.values()), *MAGNITUDES]


@pytest.mark.parametrize("name", LOOPERS)
def test_slopes_of_a_driven_looper_are_those_of_the_reference(name):
    phi, numbers = 2.1, design(name)
    with mp.workdps(100):
        there = nested(name)(exact(numbers), mp.mpf(phi))
    assert_gradients_are_those_of_the_reference(
        ["rssr", name], numbers, phi, lambda given, x: nested(name)(given, x, there), list(there)
    )


def of_looper(name):
    """The looper's own dimensions."""
    return {key.removesuffix("2"): x for key, x in table(name).items() if key.endswith("2") and key not in COUPLING}


@pytest.mark.parametrize("name", LOOPERS)
def test_a_looper_that_a_member_drives_is_that_of_the_chain_and_a_geared_one_has_its_rates_by_the_main_shaft(name):
    names = wanted(name)
    dotted, own = [f"x.{one}" for one in names], {f"x.{key}": x for key, x in of_looper(name).items()}
    driven = sweep.machine({"first": "rssr", "x": {"family": name, "driver": "first.psi", "ratio": -1, "offset": 0.6}})
    geared = sweep.machine({"x": {"family": name, "ratio": -2, "offset": 0.6}})
    chain = sweep.evaluate(["rssr", name], table(name), names, phi=PHI)
    behind = sweep.evaluate(driven, own | {f"first.{key}": x for key, x in FIRST.items()}, dotted, phi=PHI)
    twice = sweep.evaluate(geared, own, dotted, phi=PHI)
    alone = sweep.evaluate(name, of_looper(name), names, phi=0.6 - 2.0 * PHI)
    for one in names:
        turns = 2.0 ** (1 + MAGNITUDES.index(one)) if one in MAGNITUDES else (-2.0) ** len(family(name).orders(one))
        # the chain hands on cosine and sine, the machine the angle: a rounding of the angle more
        size = chain[one].abs().max()
        np.testing.assert_allclose(behind[f"x.{one}"], chain[one], rtol=0.0, atol=1e-13 * size, err_msg=one)
        np.testing.assert_allclose(twice[f"x.{one}"], turns * alone[one], rtol=1e-14, err_msg=one)


@pytest.mark.parametrize("tail", ["", "_friction"])
@pytest.mark.parametrize("name", LOOPERS)
def test_a_massless_rocker_passes_on_what_the_looper_takes_at_its_speed_and_acceleration(name, tail):
    """The reference is the looper alone, pose by pose, at the angle, speed and acceleration that its cranks have."""
    bodies = bodies_of(name) | (rubbing(name, 0.1) if tail else {})
    rocker = {f"m_{body}": 0.0 for body in ("crank", "coupler", "rocker")} | (rubbing("rssr", 0.0) if tail else {})
    given = {f"{key}2": x for key, x in bodies.items()} | {f"{key}1": x for key, x in rocker.items()}
    forces = [f"force_{joint.name}{tail}_{x}" for joint in family(name).find(LinkTree).joints for x in "xyz"]
    torque = f"drive_torque{tail}"
    names = [*(f"{one}2" for one in (*forces, torque)), f"{torque}1", "psi1", "dpsi1", "d2psi1"]
    chain = sweep.evaluate(["rssr", name], table(name) | given | {"speed1": OMEGA}, names, phi=PHI)
    assert (chain["status"] == st.OK).all()
    turning = {
        "phi": COUPLING["offset2"] - chain["psi1"],
        "speed": -OMEGA * chain["dpsi1"],
        "speed_change": -(OMEGA**2) * chain["d2psi1"],
    }
    alone = sweep.evaluate(name, pd.DataFrame(turning).assign(**of_looper(name), **bodies), [*forces, torque])
    assert (alone["status"] == st.OK).all()
    passed = -chain["dpsi1"] * chain[f"{torque}2"]
    # the angle is rounded once more than in the chain; what rubs settles to 1e-14 of the largest
    for one in forces:
        assert largest(chain[f"{one}2"] - alone[one]) <= NEAR * largest(alone[forces]), one
    assert largest(chain[f"{torque}2"] - alone[torque]) <= NEAR * largest(alone[torque])
    assert largest(chain[f"{torque}1"] - passed) <= NEAR * largest(passed)


def largest(values):
    return np.abs(values.to_numpy()).max()


def bodies_of(name):
    found = {}
    for k, body in enumerate(family(name).find(LinkTree).bodies):
        found |= {f"m_{body.name}": 1.0 + 0.3 * k, f"com_{body.name}_x": 0.4 - 0.1 * k}
        found |= {f"j_{body.name}": 0.2} if body.slender else {f"j_{body.name}_zz": 0.3, f"com_{body.name}_z": 0.2}
    return found


def rubbing(name, coefficient):
    """Coefficients of friction, radii and supports of all joints of a family."""
    kinds = {"mu": coefficient, "radius": 0.2, "thrust": 0.3}
    sizes = {p: kinds[kind] for p in all_inputs(family(name)) if (kind := p.partition("_")[0]) in kinds}
    return sizes | {p: -1.0 if p.endswith("1") else 2.0 for p in all_inputs(family(name)) if p.startswith("support_")}


@pytest.mark.parametrize("name", LOOPERS)
def test_both_loops_of_a_driven_looper_have_their_margins_under_the_number_of_their_stage(name):
    loops = ["1", "12", "22"]
    outputs = [f"{what}{loop}" for loop in ("", *loops) for what in ("margin", "max_pressure_angle", "rotatable")]
    found = sweep.summarise(["rssr", name], table(name), outputs, accuracy=1e-10).iloc[0]
    phi = np.linspace(0.0, 2.0 * np.pi, 2881)
    poses = sweep.evaluate(["rssr", name], table(name), [f"pressure_angle{loop}" for loop in loops], phi=phi)
    for loop in loops:
        worst = poses[f"pressure_angle{loop}"].max()
        assert found[f"rotatable{loop}"]
        # a smooth maximum between samples of a turn: the square of half their distance
        assert worst - 1e-12 <= found[f"max_pressure_angle{loop}"] <= worst + 2e-5
        assert found[f"margin{loop}"] == pytest.approx(np.cos(found[f"max_pressure_angle{loop}"]) ** 2, rel=1e-9)
    assert found["margin"] == min(found[f"margin{loop}"] for loop in loops)
    assert found["max_pressure_angle"] == max(found[f"max_pressure_angle{loop}"] for loop in loops)


def test_what_ends_in_a_digit_always_carries_the_number_of_its_stage():
    mechanism = family(["rssr", "spherical_looper"])
    assert {"x_b1", "x_b12", "x_b22", "discriminant1", "discriminant12", "discriminant22"} <= set(mechanism.pose_names)
    assert not {"x_b2", "x_c2", "discriminant2", "pressure_angle2", "speed_p2", "dchi2"} & set(mechanism.pose_names)
    phi = [0.3, 2.0]
    first = sweep.evaluate("rssr", FIRST, ["x_b", "discriminant"], phi=phi)
    found = sweep.evaluate(["rssr", "spherical_looper"], table("spherical_looper"), ["x_b1", "discriminant1"], phi=phi)
    np.testing.assert_array_equal(found[["x_b1", "discriminant1"]], first[["x_b", "discriminant"]])
    placed = {"chain": ["rssr", "spherical_looper"], "place": {"stage": 1}}
    member = family(sweep.machine({"x": placed})).member("x")
    links = links_of(member)
    assert links["coupler1"] == ("b1", "c1")
    assert links["coupler_12"] == ("b12", "c12")
    assert "coupler_1" not in links
    assert member.sites["b1"].stage == 0
    assert member.sites["p"].stage == member.sites["b12"].stage == 1
    with pytest.raises(InputError, match="did you mean 'margin22'"):
        sweep.summarise(["rssr", "spherical_looper"], table("spherical_looper"), ["margin2"], accuracy=1e-6)


@pytest.mark.parametrize("name", LOOPERS)
def test_a_looper_drives_no_further_stage(name):
    with pytest.raises(InputError, match=f"{name} moves one link by two cranks, so put it last"):
        family([name, "rssr"])
