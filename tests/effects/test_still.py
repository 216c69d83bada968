"""Small corners of the effects: joints at rest, strong friction, steady states of stiff couplers near a dead point."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import sweep
from kernels import status as st

PLANAR = {"a": 20.0, "b": 95.0, "c": 60.0, "e": 70.0, "f": 0.0, "g": 0.0, "alpha": 0.0}
MACHINE = {"m_crank": 2e-4, "m_coupler": 1e-4, "m_rocker": 3e-4, "j_rocker_zz": 0.3, "speed": 500.0,
           "load_torque": -900.0, "support_a1": -30.0, "support_a2": -60.0, "support_d1": -20.0,
           "support_d2": 30.0}  # fmt: skip
RUBBING = {f"mu_{k}": 0.1 for k in "abcd"} | {f"radius_{k}": 5.0 for k in "abcd"}
# Its approximations spiral: the error shrinks to 0.6 of itself per pass, and each step turns from the last.
SPIRALLING = {
    "a": 11.45, "b": 47.0, "e": 5.9, "branch": -1.0, "m_crank": 6e-5, "m_coupler": 1.93e-4, "com_coupler_y": 16.0,
    "com_coupler_z": 3.9, "j_coupler_xz": -0.01, "j_coupler_yz": -0.001, "j_coupler_zz": 0.05, "m_slider": 1.98e-4,
    "com_slider_x": -8.541, "com_slider_y": 10.0, "com_slider_z": 0.7, "gravity_x": 5000.0, "gravity_y": 1600.0,
    "gravity_z": 3000.0, "load_force": -33.1, "mu_a": 1.0, "radius_a": 2.0, "mu_b": 0.1, "radius_b": 0.0,
    "mu_c": 2.116, "radius_c": 5.75, "mu_d": 1.095, "support_a1": -20.0, "support_a2": 40.0, "support_d1": -25.0,
    "support_d2": 40.0, "speed": 221.0, "phi": 2.981,
}  # fmt: skip
# Margin 0.008 to 0.03.
NEAR_DEAD = {"a": 14.0, "b": 37.7, "c": 20.0, "e": 32.0, "f": 2.0, "g": -1.0, "alpha": 0.3}


def test_ball_joint_whose_links_turn_together_has_no_friction():
    # With the crank along the frame coupler and rocker of a planar linkage turn alike.
    phi = np.array([0.0, np.pi, -np.pi])
    wanted = ["ball_couple_c", "ball_couple_b", "force_c_friction", "drive_torque_friction", "friction_contraction"]
    poses = sweep.evaluate("rssr", PLANAR | MACHINE | RUBBING, wanted, phi=phi)
    assert (poses.status == st.OK).all()
    np.testing.assert_array_equal(poses.ball_couple_c, 0.0)
    assert (poses.ball_couple_b > 1.0).all()
    without = sweep.evaluate("rssr", PLANAR | MACHINE | RUBBING | {"mu_c": 0.0}, wanted, phi=phi)
    np.testing.assert_array_equal(poses[wanted], without[wanted])


def test_friction_that_contracts_is_not_called_jammed_where_its_steps_turn():
    """Steps that turn are no geometric series: every tenth pass was thrown a thousand steps too far."""
    wanted = ["friction_contraction", "ball_couple_c", "force_c_friction", "slide_friction", "load_support_d1",
              "load_support_d2"]  # fmt: skip
    (row,) = sweep.evaluate("slider_crank", SPIRALLING, wanted).itertuples()
    assert row.status == st.OK and row.friction_contraction < 1.0
    assert row.ball_couple_c == pytest.approx(2.116 * 5.75 * row.force_c_friction, rel=1e-12)
    assert abs(row.slide_friction) == pytest.approx(1.095 * (row.load_support_d1 + row.load_support_d2), rel=1e-12)


def test_friction_has_both_of_its_limits_beside_a_joint_at_rest():
    step = 1e-6
    poses = sweep.evaluate(
        "rssr", PLANAR | MACHINE | RUBBING, ["ball_couple_c", "drive_torque_friction"], phi=[-step, 0.0, step]
    )
    before, rest, after = poses.drive_torque_friction
    assert poses.ball_couple_c[0] > 1.0 and poses.ball_couple_c[2] > 1.0
    # Coulomb friction jumps; at rest it is neither of the two, but their mean to first order.
    assert abs(after - before) > 1.0
    assert rest == pytest.approx(0.5 * (before + after), abs=0.1 * abs(after - before))


def elastic(nu_min, damping):
    margin = sweep.summarise("rssr", NEAR_DEAD, ["margin"], accuracy=1e-8).margin[0]
    assert 0.008 < margin < 0.03
    stiffness = 0.6 * (nu_min * 500.0 / (NEAR_DEAD["c"] * np.sqrt(margin))) ** 2
    return NEAR_DEAD | {"driven_inertia": 0.6, "speed": 500.0, "stiffness": stiffness, "damping": damping}


@pytest.mark.parametrize("nu_min", [40.0, 60.0, 80.0])
@pytest.mark.parametrize("damping", [0.0, 1.0])
def test_stiff_coupler_near_a_dead_point_has_its_steady_state(nu_min, damping):
    got = sweep.summarise("rssr", elastic(nu_min, damping), ["max_abs_lag_dynamic", "floquet"], accuracy=1e-6)
    assert got.status[0] == st.OK
    assert 0.0 < got.max_abs_lag_dynamic[0] < 1.0
    assert got.floquet[0] <= 1.0
    # Stiff: the quasi-static lag is near.
    static = sweep.summarise("rssr", elastic(nu_min, damping), ["max_abs_lag"], accuracy=1e-6).max_abs_lag[0]
    assert got.max_abs_lag_dynamic[0] == pytest.approx(static, rel=0.5)


def test_steady_state_near_a_dead_point_is_that_of_periodic_shooting():
    design = elastic(50.0, 20.0)
    phi = 2.0 * np.pi * np.arange(4001) / 4001
    motion = sweep.evaluate("rssr", NEAR_DEAD, ["discriminant", "d2psi"], phi=phi)
    square = motion.discriminant.to_numpy() / (2.0 * NEAR_DEAD["b"]) ** 2  # p^2 = (c cos(pressure angle))^2
    right = np.fft.rfft(-motion.d2psi.to_numpy())
    order = np.arange(right.size)
    q = np.fft.rfft(square)
    mass = 0.6 * 500.0**2
    k, h = design["stiffness"] / mass, 20.0 * 500.0 / mass
    few = 4  # p^2 has two harmonics

    def series(c, x, upto):
        wave = np.exp(1j * order[:upto] * x) * c[:upto]
        return (2.0 * wave.sum() - wave[0]).real / 4001, (2.0 * (1j * order[:upto] * wave).sum()).real / 4001

    def rates(x, y):
        p2, slope = series(q, x, few)
        stiff = k * p2 + 0.5 * h * slope
        pull = series(right, x, 1500)[0]
        return [y[1], pull - h * p2 * y[1] - stiff * y[0], y[3], -h * p2 * y[3] - stiff * y[2], y[5],
                -h * p2 * y[5] - stiff * y[4]]  # fmt: skip

    run = solve_ivp(rates, (0.0, 2.0 * np.pi), [0.0, 0.0, 1.0, 0.0, 0.0, 1.0], method="DOP853", rtol=1e-9, atol=1e-12)
    end = run.y[:, -1]
    start = np.linalg.solve(np.eye(2) - np.array([[end[2], end[4]], [end[3], end[5]]]), end[:2])
    got = sweep.evaluate("rssr", design, ["lag_dynamic"], phi=[0.0])
    assert got.status[0] == st.OK
    # Shooting over a turn of some 200 oscillations to 1e-9 a step.
    assert got.lag_dynamic[0] == pytest.approx(start[0], rel=1e-5)
