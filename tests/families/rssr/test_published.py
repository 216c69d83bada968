"""Crank-rocker against published numbers: hardpoints of uraeus_smbd, EXUDYN, Norton, pylinkage."""

import math

import numpy as np
import pytest

import sweep

HARDPOINTS = {
    "a": 200.0, "b": 1219.6310917650, "c": 738.2411530117, "e": 0.0, "f": 400.0, "g": -850.0,
    "alpha": -0.5 * math.pi, "branch": -1.0,
}  # fmt: skip

# Crank rotation and rocker rotation from the drawn position, velocity ratio: EXUDYN 1.13.6.
EXUDYN = [
    (0.000000000000, 0.000000000000, -0.515152),
    (-0.793926072096, 0.520208367994, -0.767352),
    (-1.453443638008, 1.002283272801, -0.593067),
    (-2.781809916675, 1.085158813165, 0.359890),
    (-3.677261189818, 0.594206611870, 0.721550),
    (-4.382519656885, 0.046689830200, 0.737130),
    (-5.812557495281, -0.198023416172, -0.321084),
    (-6.748583979778, 0.280161386665, -0.684444),
]


def drawn_psi():
    return sweep.evaluate("rssr", HARDPOINTS, ["psi"], phi=[math.pi])["psi"][0]


def test_drawn_position_of_the_hardpoints():
    assert math.degrees(drawn_psi()) == pytest.approx(151.69924423, abs=1e-7)


def test_rotations_of_a_multibody_solver():
    crank, rocker, ratio = np.array(EXUDYN).T
    found = sweep.evaluate("rssr", HARDPOINTS, ["psi", "dpsi"], phi=math.pi + crank)
    turned = np.angle(np.exp(1j * (found["psi"] - drawn_psi())))
    np.testing.assert_allclose(turned, rocker, atol=5e-13)
    np.testing.assert_allclose(found["dpsi"], ratio, atol=2e-5)  # the solver's velocities carry 1e-5


def test_swing_and_plotted_extrema_of_the_hardpoints():
    turn = sweep.summarise("rssr", HARDPOINTS, ["swing"])
    assert math.degrees(abs(turn["swing"][0])) == pytest.approx(86.05419, abs=5e-6)
    # One revolution per second; the plotted x of the rocker's midpoint is c/2 sin(psi) - 400 here, up to its sign.
    phi, omega = np.linspace(0.0, 2.0 * math.pi, 20001), 2.0 * math.pi
    motion = sweep.evaluate("rssr", HARDPOINTS, ["sin_psi", "cos_psi", "dpsi", "d2psi"], phi=phi)
    radius = 0.5 * HARDPOINTS["c"]
    x = radius * motion["sin_psi"]
    speed = radius * omega * motion["cos_psi"] * motion["dpsi"]
    acceleration = radius * omega**2 * (motion["cos_psi"] * motion["d2psi"] - motion["sin_psi"] * motion["dpsi"] ** 2)
    assert np.ptp(x) == pytest.approx(661.694 - 158.306, abs=1e-3)
    np.testing.assert_allclose(sorted([-speed.min(), speed.max()]), [1793.90, 1829.35], atol=0.01)
    np.testing.assert_allclose(sorted([-acceleration.min(), acceleration.max()]), [12341.0, 12865.0], atol=1.0)


def test_both_assemblies_of_a_four_bar_close_its_loop():
    # Ground 6, crank 2, coupler 7, rocker 9, crank at 30 degrees, Norton's row a: the coupler has its length, and the
    # two rockers are mirror images about the line from crank pin to rocker pivot.
    table = {"a": 2.0, "b": 7.0, "c": 9.0, "e": 6.0, "f": 0.0, "g": 0.0, "alpha": 0.0, "branch": [1.0, -1.0]}
    psi = sweep.evaluate("rssr", table, ["psi"], phi=[math.radians(30.0)])["psi"]
    line = 6.0 - 2.0 * np.exp(1j * math.radians(30.0))
    np.testing.assert_allclose(np.abs(line + 9.0 * np.exp(1j * psi)), 7.0, rtol=1e-15)
    assert math.cos(psi[0] + psi[1] - 2.0 * np.angle(line)) == pytest.approx(1.0, rel=1e-15)
    np.testing.assert_allclose(np.degrees(psi), [-143.66, 117.29], atol=0.005)


def test_transmission_angles_of_pylinkage():
    table = {"a": 1.0, "b": 2.5, "c": 2.0, "e": 3.0, "f": 0.0, "g": 0.0, "alpha": 0.0}
    phi = np.array([0.0, math.pi])
    pressure = np.degrees(sweep.evaluate("rssr", table, ["pressure_angle"], phi=phi)["pressure_angle"])
    # The pressure angle is 90 degrees less the transmission angle, or the other way round.
    np.testing.assert_allclose(pressure, [90.0 - 51.3178125465, 125.0996321954 - 90.0], atol=1e-9)
    worst = sweep.summarise("rssr", table, ["max_pressure_angle"])["max_pressure_angle"][0]
    assert math.degrees(worst) == pytest.approx(90.0 - 51.3178125465, abs=1e-9)
