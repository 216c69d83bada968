"""One shaft, one speed: torque, inertia and speed of a whole machine against the power and energy of its members."""

from __future__ import annotations

import numpy as np
import pytest

import sweep
from kernels import status as st
from sweep.effects import extended
from sweep.evaluation.tables import design_matrix
from sweep.families import family
from sweep.optimise.manufacture.tolerance import sensitivities
from tests.reference.momentum import derivative

N = 512
PHI = 2.0 * np.pi * np.arange(N) / N
OMEGA, FLYWHEEL, RATIO = 50.0, 0.9, 2
NEEDLE = {"a1": 1.0, "b1": 5.5, "c1": 4.0, "e1": 4.6, "f1": 0.4, "g1": -0.3, "alpha1": 0.5, "offset2": 0.4}
NEEDLE |= {"a2": 1.1, "b2": 3.0, "c2": 2.6, "e2": 2.9, "xi2": 4.0, "eta2": 0.5, "lam2": 0.3, "h2": 0.2}
NEEDLE |= {"m_crank1": 0.1, "com_crank_x1": 0.4, "j_crank_zz1": 0.2, "m_coupler1": 0.2, "com_coupler_x1": 2.0}
NEEDLE |= {"j_coupler_yy1": 0.3, "j_coupler_zz1": 0.3, "m_rocker1": 0.3, "com_rocker_x1": 2.0, "j_rocker_zz1": 0.5}
NEEDLE |= {"m_crank2": 0.0, "m_coupler2": 0.2, "com_coupler_x2": 1.5, "m_rocker2": 0.1, "m_tool2": 0.05}
LOOPER = {"a": 1.0, "e": 2.6, "f": 0.7, "g": -0.4, "alpha": 0.6, "s": 0.5, "m_link": 0.2, "com_link_x": 1.0}
LOOPER |= {"j_link_zz": 0.3, "m_crank": 0.2, "com_crank_x": 0.3, "j_crank_zz": 0.1}
MEMBERS = {"needle": ["rssr", "guide"], "looper": {"family": "slotted", "ratio": RATIO, "offset": 0.8}}
FRICTION = {"mu_a": 0.05, "mu_b": 0.06, "mu_c": 0.06, "mu_d": 0.05, "radius_a": 0.3, "radius_b": 0.2, "radius_c": 0.2}
FRICTION |= {"radius_d": 0.25, "support_a1": -1.0, "support_a2": -2.0, "support_d1": -1.0, "support_d2": 1.0}


def machine(**more):
    return sweep.machine(MEMBERS | more, {"shaft": {"torque": ["needle", "looper"]}})


def table(**more):
    found = {f"needle.{key}": x for key, x in NEEDLE.items()} | {f"looper.{key}": x for key, x in LOOPER.items()}
    return found | {"needle.speed1": OMEGA, "looper.speed": RATIO * OMEGA, "shaft_flywheel": FLYWHEEL} | more


def test_inertia_is_twice_the_energy_of_all_members_at_unit_speed():
    """The proof of the sum over members: each alone, at its own crank angle and its own speed, and the flywheel."""
    found = sweep.evaluate(machine(), table(), ["shaft_inertia", "shaft_dinertia"], phi=PHI)
    needle = sweep.evaluate(["rssr", "guide"], NEEDLE | {"speed1": 1.0}, ["reduced_inertia1"], phi=PHI)
    looper = sweep.evaluate("slotted", LOOPER | {"speed": 1.0}, ["reduced_inertia"], phi=RATIO * PHI + 0.8)
    whole = FLYWHEEL + needle["reduced_inertia1"] + RATIO**2 * looper["reduced_inertia"]
    np.testing.assert_allclose(found["shaft_inertia"], whole, rtol=1e-14)
    # 512 samples by the Fourier transform: measured 1e-11
    slope = derivative(found["shaft_inertia"].to_numpy())
    np.testing.assert_allclose(found["shaft_dinertia"], slope, atol=1e-9 * np.abs(slope).max())


@pytest.mark.parametrize("change", [0.0, 130.0])
def test_torque_is_the_power_over_the_speed_with_the_flywheel(change):
    """M omega = d(J omega^2/2)/dt: J eps + J' omega^2/2, sheet machine-and-stitch 2, last bullet."""
    more = {"needle.speed_change1": change, "looper.speed_change": RATIO * change}
    found = sweep.evaluate(machine(), table(**more), ["shaft", "shaft_inertia", "shaft_dinertia"], phi=PHI)
    asked = found["shaft_inertia"] * change + 0.5 * found["shaft_dinertia"] * OMEGA**2
    np.testing.assert_allclose(found["shaft"], asked, atol=1e-12 * np.abs(asked).max())


def test_speed_over_the_turn_keeps_energy_and_mean():
    """Without loads J omega^2 is constant, so omega = C/sqrt(J), with C from the mean in time."""
    (found,) = sweep.summarise(
        machine(), table(), ["shaft_unevenness", "shaft_fastest", "shaft_slowest"], accuracy=1e-9
    ).itertuples()
    inertia = sweep.evaluate(machine(), table(), ["shaft_inertia"], phi=PHI)["shaft_inertia"].to_numpy()
    speed = OMEGA * np.sqrt(inertia).mean() / np.sqrt(inertia)
    # extremes of 512 samples miss a peak by the square of their distance
    assert found.status == 0
    assert found.shaft_fastest == pytest.approx(speed.max(), rel=1e-4)
    assert found.shaft_slowest == pytest.approx(speed.min(), rel=1e-4)
    assert found.shaft_unevenness == pytest.approx((found.shaft_fastest - found.shaft_slowest) / OMEGA, rel=1e-12)
    dense = sweep.evaluate(machine(), table(), ["shaft_inertia"], phi=np.linspace(0.0, 2 * np.pi, 200_001))
    assert found.shaft_fastest == pytest.approx(
        OMEGA * np.sqrt(inertia).mean() / np.sqrt(dense["shaft_inertia"].min()), rel=1e-9
    )


def test_motor_line_that_is_too_steep_to_integrate_does_not_stop_the_shaft():
    """Its status said that the crank stops; at even speed less than 1e-3 of the speed gives the whole torque."""
    inertia = sweep.evaluate(machine(), table(), ["shaft_inertia"], phi=PHI)["shaft_inertia"].mean()
    steep = table(shaft_motor_slope=3000.0 * inertia * OMEGA)
    found = sweep.summarise(machine(), steep, ["shaft_unevenness"], accuracy=1e-8).iloc[0]
    assert found.status == st.NOT_CONVERGED and np.isnan(found.shaft_unevenness)
    torque = sweep.evaluate(machine(), steep, ["shaft"], phi=PHI)["shaft"]
    assert np.ptp(torque) < 1e-3 * steep["shaft_motor_slope"] * OMEGA


def test_a_machine_of_one_member_is_that_member():
    alone = sweep.machine({"needle": ["rssr", "guide"]}, {"shaft": {"torque": ["needle"]}})
    own = {key: x for key, x in table().items() if not key.startswith("looper")} | {"shaft_motor_slope": 0.3}
    ours = sweep.summarise(alone, own, ["shaft_unevenness", "shaft_fastest"], accuracy=1e-9)
    theirs = NEEDLE | {"speed1": OMEGA, "flywheel1": FLYWHEEL, "motor_slope1": 0.3}
    theirs = sweep.summarise(["rssr", "guide"], theirs, ["unevenness1", "fastest1"], accuracy=1e-9)
    assert ours["shaft_unevenness"][0] == pytest.approx(theirs["unevenness1"][0], rel=1e-12)
    assert ours["shaft_fastest"][0] == pytest.approx(theirs["fastest1"][0], rel=1e-14)


def test_phases_against_each_other_change_the_torque_and_the_speed():
    """The key of a member is a variable: torques of two equal members a quarter turn apart partly cancel."""
    two = sweep.machine({"x": "rssr", "y": "rssr"}, {"shaft": {"torque": ["x", "y"]}})
    one = {key.removesuffix("1"): x for key, x in NEEDLE.items() if key.endswith("1")} | {"speed": OMEGA}
    design = {f"{m}.{key}": x for m in "xy" for key, x in one.items()} | {"shaft_flywheel": 3.0}
    found = {
        phase: sweep.summarise(two, design | {"y.offset": phase}, ["max_abs_shaft", "shaft_unevenness"], accuracy=1e-8)
        for phase in (0.0, 0.5 * np.pi)
    }
    assert found[0.5 * np.pi]["max_abs_shaft"][0] < 0.8 * found[0.0]["max_abs_shaft"][0]
    assert found[0.5 * np.pi]["shaft_unevenness"][0] < 0.8 * found[0.0]["shaft_unevenness"][0]


def test_friction_on_the_main_shaft_is_that_of_all_members():
    more = {f"needle.{key}{k}": x for key, x in FRICTION.items() for k in (1, 2)}
    more |= {f"looper.{key}": x for key, x in FRICTION.items()} | {"looper.support_c1": -0.4, "looper.support_c2": 0.4}
    wanted = ["shaft_friction", "needle.drive_torque1", "needle.drive_torque_friction1", "looper.drive_torque"]
    found = sweep.evaluate(machine(), table(**more), [*wanted, "looper.drive_torque_friction"], phi=PHI[::16])
    lost = found["needle.drive_torque_friction1"] - found["needle.drive_torque1"]
    lost += RATIO * (found["looper.drive_torque_friction"] - found["looper.drive_torque"])
    np.testing.assert_allclose(found["shaft_friction"], lost, rtol=1e-12)
    assert (found["shaft_friction"] > 0.0).all()


@pytest.mark.parametrize("unfit", [{"looper.speed": 1.9 * OMEGA}, {"looper.speed_change": 1.0}])
def test_members_of_two_speeds_are_not_on_one_shaft(unfit):
    """Torque and shaking were sums of what each member has at its own speed, with status 0."""
    shaken = {"f": {"shaking": ["needle1", "needle2", "looper"]}}
    both = sweep.machine(MEMBERS, shaken | {"shaft": {"torque": ["needle", "looper"]}})
    wanted = ["max_shaft", "f_order1", *(["shaft_unevenness"] if "looper.speed" in unfit else [])]
    for name in wanted:
        found = sweep.summarise(both, table(**unfit), [name])
        assert found["status"][0] == st.INVALID_INPUT and np.isnan(found[name][0])
    posed = sweep.evaluate(both, table(**unfit), ["shaft", "f_x"], phi=[0.0, 1.0])
    assert (posed["status"] == st.INVALID_INPUT).all() and posed[["shaft", "f_x"]].isna().all(axis=None)


def test_a_later_stage_or_one_named_twice_is_refused():
    for listed in (["needle2"], ["needle", "needle1"]):
        with pytest.raises(sweep.InputError, match="members each once"):
            sweep.machine(MEMBERS, {"shaft": {"torque": listed}})


def test_phases_are_variables_and_torques_of_two_equal_members_cancel():
    """Equal members in step double the torque; turned against each other they take what its orders say."""
    one = {"family": "slotted", "shaft": "main"}
    pair = sweep.machine({"x": one, "y": one}, {"shaft": {"torque": ["x", "y"]}}, shafts={"main": {}})
    given = {f"{name}.{key}": x for name in "xy" for key, x in LOOPER.items()} | {"x.speed": OMEGA, "y.speed": OMEGA}
    given |= {"shaft_flywheel": FLYWHEEL}
    alone = sweep.evaluate("slotted", LOOPER | {"speed": OMEGA}, ["drive_torque"], phi=PHI)["drive_torque"].to_numpy()
    keys = np.linspace(0.0, 2.0 * np.pi, 13)[:-1]
    rms = sweep.summarise(pair, given | {"y.key": keys}, ["rms_shaft"], accuracy=1e-9)["rms_shaft"].to_numpy()
    orders = np.fft.rfft(alone) / N
    turned = [1.0 + np.exp(1j * np.arange(orders.size) * key) for key in keys]
    expected = [np.sqrt(abs(t[0] * orders[0]) ** 2 + 2.0 * (np.abs(t * orders)[1:] ** 2).sum()) for t in turned]
    np.testing.assert_allclose(rms, expected, rtol=1e-9)
    assert rms.min() < 0.5 * rms[0]
    # the optimiser has the slope of it
    whole = extended(family(pair), ["rms_shaft"])
    matrix = design_matrix(whole, given | {"y.key": 0.6})[0]
    found = sensitivities(whole, matrix[0], ["rms_shaft"])
    at = found["parameter"].index("y.key")
    step = 1e-4
    ends = sweep.summarise(pair, given | {"y.key": [0.6 - step, 0.6 + step]}, ["rms_shaft"], accuracy=1e-10)[
        "rms_shaft"
    ]
    assert found["growing"][at] == pytest.approx((ends[1] - ends[0]) / (2.0 * step), rel=1e-5)
