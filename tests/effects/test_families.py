"""Effects beyond the crank-rocker: slider-cranks, the four-bar of a guide, chains; against laws and special cases."""

from __future__ import annotations

import itertools

import numpy as np
import pytest

import sweep
from kernels import status as st
from sweep.effects import applicable
from sweep.errors import InputError
from sweep.families import family
from tests.effects.test_balance import FRICTION, OMEGA, PHI, RSSP, RSSR, loads, vector
from tests.reference.momentum import derivative

SLIDER = RSSP | loads(("crank", "coupler", "slider")) | {"load_force": -150.0}
SLIDE = {name: x for name, x in FRICTION.items() if name not in ("radius_d", "thrust_radius_d")}
GUIDE = {"a": 20.0, "b": 50.0, "c": 45.0, "e": 40.0, "xi": 100.0, "eta": 3.0, "lam": 0.3, "h": 2.0}
GUIDE_LOADS = loads(("crank", "coupler", "rocker"))


def numbered(number, *tables):
    return {f"{name}{number}": x for table in tables for name, x in table.items()}


def test_friction_of_a_slider_balances_its_power():
    """Drive + load = rate of energy of the frictionless linkage + what balls, crank shaft and slide lose."""
    wanted = [
        "drive_torque", "drive_torque_friction", "shaft_torque_a", "slide_friction", "ball_couple_b", "ball_couple_c",
        "ds", *(f"omega_{x}" for x in "xyz"),
    ]  # fmt: skip
    poses = sweep.evaluate("rssp", SLIDER | SLIDE | {"x_point": 0.0}, wanted, phi=PHI)
    assert (poses["status"] == st.OK).all()
    rod = vector(poses, "omega")
    crank = np.array([0.0, np.sin(RSSP["alpha"]), np.cos(RSSP["alpha"])])
    lost = poses["ball_couple_b"] * np.linalg.norm(rod - crank, axis=1)
    lost += poses["ball_couple_c"] * np.linalg.norm(rod, axis=1)
    lost -= poses["shaft_torque_a"] + poses["slide_friction"] * poses["ds"]
    extra = poses["drive_torque_friction"] - poses["drive_torque"]
    np.testing.assert_allclose(extra, lost, atol=1e-10 * lost.max())
    assert lost.min() > 0.0
    assert (poses["slide_friction"] * poses["ds"] < 0.0).all()


def test_a_slide_without_friction_adds_none_and_steep_coefficients_jam():
    smooth = SLIDE | {name: 0.0 for name in SLIDE if name.startswith("mu_")}
    both = ["drive_torque", "drive_torque_friction", "force_d", "force_d_friction", "friction_contraction"]
    poses = sweep.evaluate("rssp", SLIDER | smooth, both, phi=PHI)
    np.testing.assert_allclose(poses["drive_torque_friction"], poses["drive_torque"], rtol=1e-13, atol=1e-9)
    assert (poses["friction_contraction"] == 0.0).all()
    rough = sweep.evaluate("rssp", SLIDER | SLIDE | {"mu_d": 8.0}, both, phi=PHI)
    assert st.JAMMED in set(rough["status"])
    assert rough["drive_torque_friction"].isna().equals(rough["status"] != st.OK)


def test_speed_of_a_slider_crank_keeps_energy_and_mean():
    """Constant drive: J omega^2/2 changes by the work of the excess, and one turn takes 2 pi/omega_mean."""
    table = SLIDER | {"flywheel": 20.0}
    wanted = ["crank_speed", "crank_acceleration", "reduced_inertia", "dreduced_inertia"]
    poses = sweep.evaluate("rssp", table, wanted, phi=PHI)
    assert (1.0 / poses["crank_speed"]).mean() == pytest.approx(1.0 / OMEGA, rel=1e-9)
    slope = derivative(0.5 * poses["crank_speed"].to_numpy() ** 2)
    np.testing.assert_allclose(poses["crank_acceleration"], slope, atol=1e-8 * np.abs(slope).max())
    # Newton's law with the drive torque that kinetostatics gives at the true speed and acceleration is constant.
    true = {name: x for name, x in table.items() if name not in ("speed", "flywheel")} | {"phi": PHI}
    true |= {"speed": poses["crank_speed"].to_numpy(), "speed_change": poses["crank_acceleration"].to_numpy()}
    true = {name: np.broadcast_to(x, PHI.shape) for name, x in true.items()}
    torque = sweep.evaluate("rssp", true, ["drive_torque"])["drive_torque"] + 20.0 * poses["crank_acceleration"]
    assert np.ptp(torque) < 1e-7 * np.abs(20.0 * poses["crank_acceleration"]).max()


def test_an_elastic_slider_follows_its_equation():
    """The steady state put into m w^2 eta'' + h w p^2 eta' + (k p^2 + h w p p') eta = F - m w^2 s''."""
    given = {"driven_mass": 3e-4, "stiffness": 2e3, "damping": 0.4, "speed": OMEGA, "load_force": -40.0}
    wanted = ["lag", "lag_dynamic", "elongation_dynamic", "t_tau", "d2s", "frequency_ratio"]
    poses = sweep.evaluate("rssp", RSSP | given, wanted, phi=PHI)
    assert (poses["status"] == st.OK).all()
    eta, p = poses["lag_dynamic"].to_numpy(), poses["t_tau"].to_numpy()
    mass, h = given["driven_mass"] * OMEGA**2, given["damping"] * OMEGA
    terms = [
        mass * derivative(derivative(eta)), h * p**2 * derivative(eta),
        (given["stiffness"] * p**2 + h * p * derivative(p)) * eta,
    ]  # fmt: skip
    right = given["load_force"] - mass * poses["d2s"].to_numpy()
    assert np.abs(sum(terms) - right).max() < 1e-7 * np.abs(right).max()
    assert np.abs(terms[0]).max() > 1e-3 * np.abs(right).max()
    np.testing.assert_allclose(poses["elongation_dynamic"], p * eta, rtol=1e-9, atol=1e-12)
    np.testing.assert_allclose(poses["lag"], right / (given["stiffness"] * p**2), rtol=1e-9)


def test_the_four_bar_of_a_guide_is_a_plane_crank_rocker():
    wanted = [
        "force_c",
        "moment_d",
        "drive_torque",
        "drive_torque_friction",
        "theta1",
        "theta2",
        "reduced_inertia",
        "lag",
    ]
    more = GUIDE_LOADS | FRICTION | {"stiffness": 2e4, "driven_inertia": 0.5, "load_torque": -400.0}
    plane = {name: GUIDE[name] for name in "abce"} | {"f": 0.0, "g": 0.0, "alpha": 0.0}
    of_guide = sweep.evaluate("guide", GUIDE | more, wanted, phi=PHI)
    of_rocker = sweep.evaluate("rssr", plane | more, wanted, phi=PHI)
    for name in wanted:
        size = np.abs(of_rocker[name]).max()
        np.testing.assert_allclose(of_guide[name], of_rocker[name], atol=1e-13 * size, err_msg=name)
    assert (of_guide["theta2"] == 0.0).all()


CHAIN = numbered(1, RSSR, loads(("crank", "coupler", "rocker")), {"load_torque": -700.0}) | numbered(
    2, GUIDE, {name: x for name, x in GUIDE_LOADS.items() if name != "speed"}, {"load_torque": -300.0}
)  # fmt: skip


@pytest.mark.parametrize("kappa", [1.0, -1.0])
def test_the_drive_of_a_chain_does_the_work_of_all_its_stages(kappa):
    """Torque from the dyads handed back = rate of the kinetic energy of both stages less loads and weights."""
    weights = {f"gravity_{x}{k}": 0.0 for x in "xyz" for k in (1, 2)}
    table = CHAIN | weights | {"kappa2": kappa, "offset2": 0.4}
    wanted = ["drive_torque1", "drive_torque2", "reduced_inertia1", "dreduced_inertia1", "reduced_inertia2", "dpsi1"]
    poses = sweep.evaluate(["rssr", "guide"], table, [*wanted, "psi1"], phi=PHI)
    assert (poses["status"] == st.OK).all()
    inertia = poses["reduced_inertia1"].to_numpy()
    slope = derivative(inertia)
    np.testing.assert_allclose(poses["dreduced_inertia1"], slope, atol=1e-8 * np.abs(slope).max())
    alone = sweep.evaluate("rssr", RSSR | loads(("crank", "coupler", "rocker")), ["reduced_inertia", "dpsi"], phi=PHI)
    carried = alone["dpsi"] ** 2 * poses["reduced_inertia2"]
    np.testing.assert_allclose(inertia, alone["reduced_inertia"] + carried, rtol=1e-13)
    assert carried.max() > 0.01 * inertia.max()
    # The angle of the second stage's own rocker, from a four-bar that turns as the first stage's rocker does.
    second = {name: GUIDE[name] for name in "abce"} | {
        "f": 0.0,
        "g": 0.0,
        "alpha": 0.0,
        "phi": kappa * poses["psi1"] + 0.4,
    }
    second = {name: np.broadcast_to(x, PHI.shape) for name, x in second.items()}
    dpsi2 = sweep.evaluate("rssr", second, ["dpsi"])["dpsi"].to_numpy() * kappa * poses["dpsi1"]
    power = 0.5 * OMEGA**2 * slope + 700.0 * poses["dpsi1"] + 300.0 * dpsi2
    np.testing.assert_allclose(poses["drive_torque1"], power, atol=1e-8 * np.abs(power).max())


def test_a_chain_that_drives_nothing_heavy_is_its_first_stage_alone():
    light = {name: 0.0 for name in CHAIN if name[:2] in ("m_", "j_") and name.endswith("2")} | {"load_torque2": 0.0}
    names = ["force_c", "drive_torque", "reduced_inertia"]
    single = {name.removesuffix("1"): x for name, x in CHAIN.items() if name.endswith("1")}
    alone = sweep.evaluate("rssr", single, names, phi=PHI)
    chained = sweep.evaluate(["rssr", "guide"], CHAIN | light, [f"{name}1" for name in names], phi=PHI)
    for name in names:
        np.testing.assert_allclose(chained[f"{name}1"], alone[name], rtol=1e-13, err_msg=name)
    whole = sweep.evaluate(["rssr", "guide"], CHAIN, ["force_c1"], phi=PHI)
    assert np.abs(whole["force_c1"] - alone["force_c"]).max() > 0.01 * alone["force_c"].max()


def test_friction_and_speed_of_a_chain():
    """Friction of both stages asks for more than the first alone; the speed fluctuates with the inertia of both."""
    rough = CHAIN | numbered(1, FRICTION) | numbered(2, FRICTION)
    names = ["drive_torque1", "drive_torque_friction1", "drive_torque2", "drive_torque_friction2"]
    poses = sweep.evaluate(["rssr", "guide"], rough, names, phi=PHI)
    assert (poses["status"] == st.OK).all()
    still = sweep.evaluate(["rssr", "guide"], rough | {f"mu_{j}2": 0.0 for j in "abcd"}, names, phi=PHI)
    work = [(p["drive_torque_friction1"] - p["drive_torque1"]).mean() for p in (poses, still)]
    assert work[0] > 1.05 * work[1] > 0.0
    uneven = sweep.summarise(["rssr", "guide"], CHAIN | {"flywheel1": 30.0}, ["unevenness1", "max_crank_speed1"])
    single = {name.removesuffix("1"): x for name, x in CHAIN.items() if name.endswith("1")} | {"flywheel": 30.0}
    alone = sweep.summarise("rssr", single, ["unevenness"])
    assert uneven["status"][0] == st.OK
    assert uneven["unevenness1"][0] != pytest.approx(alone["unevenness"][0], rel=0.01)


POINT = {"x_point": 30.0, "y_point": 7.0}
TWO = numbered(1, RSSR) | numbered(2, GUIDE, POINT)
DRIVEN = sweep.machine({"n": {"family": "rssr"}, "m": {"family": "guide", "driver": "n.psi"}})
BEHIND = {
    "two stages": (["rssr", "guide"], TWO, ""),
    "three stages": (["rssr", "rssr", "guide"], numbered(1, RSSR) | numbered(2, RSSR) | numbered(3, GUIDE, POINT), ""),
    "ratio": (sweep.machine({"m": {"family": "guide", "ratio": -2}}), GUIDE | POINT, "m."),
    "two stages with a ratio": (sweep.machine({"m": {"family": ["rssr", "guide"], "ratio": 3}}), TWO, "m."),
    "driven": (DRIVEN, GUIDE | POINT, "m."),
}


@pytest.mark.parametrize("case", BEHIND)
def test_rates_of_a_coupler_are_with_respect_to_the_first_crank_or_the_main_shaft(case):
    mechanism, own, dot = BEHIND[case]
    table = {f"{dot}{name}": x for name, x in own.items()}
    table |= {f"n.{name}": x for name, x in RSSR.items()} if mechanism is DRIVEN else {}
    ladder = ("x_p", "dx_p", "d2x_p"), ("y_p", "dy_p", "d2y_p"), ("omega_z", "eps_z")
    names = [f"{dot}{name}" for steps in ladder for name in steps]
    poses = sweep.evaluate(mechanism, table, names, phi=PHI)
    assert (poses["status"] == st.OK).all()
    for low, high in itertools.chain.from_iterable(map(itertools.pairwise, ladder)):
        slope = derivative(poses[f"{dot}{low}"].to_numpy())
        np.testing.assert_allclose(poses[f"{dot}{high}"], slope, atol=1e-9 * np.abs(slope).max(), err_msg=high)
    for name in names:
        np.testing.assert_array_equal(sweep.evaluate(mechanism, table, [name], phi=PHI)[name], poses[name])


def test_a_chain_asks_for_the_bodies_of_the_later_stages():
    table = {name: x for name, x in CHAIN.items() if name != "m_coupler2"}
    with pytest.raises(InputError, match=r"m_coupler2.*kinetostatics1"):
        sweep.evaluate(["rssr", "guide"], table, ["force_c1"], phi=0.3)
    # Loads of the last stage ask nothing of the first but its motion and its speed.
    last = {name: x for name, x in CHAIN.items() if name.endswith("2") or name[:-1] in (*RSSR, "speed")}
    assert sweep.evaluate(["rssr", "guide"], last, ["force_c2"], phi=PHI)["force_c2"].min() > 0.0


def test_an_effect_that_a_family_lacks_names_the_families_that_have_it():
    with pytest.raises(InputError, match=r"speed_fluctuation \(rssr, guide.*\), slider_speed_fluctuation \(rssp.*\)"):
        sweep.summarise("backrest", {"k": 2.0, "a": 0.2}, ["unevenness"])
    with pytest.raises(InputError, match=r"journal_load1.*sliding_bearings \(rssr, guide.*\)"):
        sweep.evaluate("rssp", RSSP, ["journal_load1"], phi=0.3)
    with pytest.raises(InputError, match=r"lag2.*first stage.*elasticity \(rssr, guide.*\)"):
        sweep.evaluate(["rssr", "guide"], CHAIN, ["lag2"], phi=0.3)


def test_a_later_stage_has_no_effect_that_presumes_an_even_crank():
    placed = applicable(family(["rssr", "guide"]))
    later = {p.entry.name for p in placed if p.stage == 1}
    assert {"kinetostatics", "friction", "pressure", "coupler", "sliding_limits"} <= later
    assert not later & {"speed_fluctuation", "elasticity", "dynamic_elasticity", "bearing_life", "rolling_limits"}


HAIR = {
    "guide": {"a": 0.8509678590883607, "b": 1.1532450556674578, "c": 2.554389923782584, "e": -2.85666711612713},
    "kim_dison": {"a": 0.8668281274052625, "b": 1.286063656625761, "c": 1.3895069454107167, "e": -0.6370909584595257,
                  "f": -2.184882172876774, "alpha": 0.5 * np.pi},
}  # fmt: skip


@pytest.mark.parametrize("name", HAIR)
def test_mean_loads_a_hair_from_a_change_point_are_those_of_the_crank_rocker(name):
    """The margin is 1e-8: loads were made of plain poses there, and off by 100 times their error."""
    plain = {"f": 0.0, "g": 0.0, "alpha": 0.0} | HAIR[name]
    own = {"r": "a", "l": "b", "h": "c", "a": "e", "b": "f"} if name == "kim_dison" else {x: x for x in "abce"}
    row = {ours: plain[theirs] for ours, theirs in own.items()} | {"branch": -1.0 if name == "kim_dison" else 1.0}
    row |= {"xi": 1.0, "eta": 0.3, "lam": 0.4, "h": 0.0} if name == "guide" else {}
    bodies = {"m_crank": 0.3, "m_coupler": 0.5, "m_rocker": 0.7, "load_torque": 3.0, "speed": OMEGA}
    wanted = ["rms_force_c", "rms_drive_torque"]
    found, known = (
        sweep.summarise(family, table | bodies, wanted, accuracy=1e-8).iloc[0]
        for family, table in ((name, row), ("rssr", plain | {"branch": 1.0}))
    )
    assert found["status"] == known["status"] == st.OK
    for output in wanted:
        assert abs(found[output] - known[output]) <= found[f"err_{output}"] + known[f"err_{output}"], output
