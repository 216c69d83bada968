"""Guided four-bar against textbook linkages: position problem, transmission angles, straight-line mechanisms."""

from __future__ import annotations

import math

import numpy as np
import pytest

import sweep

LINE = {"eta": 0.0, "lam": 0.0, "h": 0.0}


def test_guide_norton_position_problem():
    # Norton, Design of Machinery: ground 6, crank 2, coupler 7, rocker 9, theta2 = 30 deg; open, then crossed
    links = {"a": 2.0, "b": 7.0, "c": 9.0, "e": 6.0, "branch": [-1.0, 1.0], "phi": np.radians(30.0)}
    j = sweep.evaluate("guide", links | LINE | {"xi": 0.0}, ["x_b", "y_b", "x_c", "y_c"])
    theta3 = np.degrees(np.arctan2(j.y_c - j.y_b, j.x_c - j.x_b))
    theta4 = np.degrees(np.arctan2(j.y_c, j.x_c - 6.0))
    np.testing.assert_allclose(theta3, [88.84, -115.21], atol=5e-3)
    np.testing.assert_allclose(theta4, [117.29, -143.66], atol=5e-3)
    # Crank and coupler end where frame and rocker end; some roundings of 9.
    ends = [
        2.0 * np.exp(1j * np.radians(30.0)) + 7.0 * np.exp(1j * np.radians(theta3)),
        6.0 + 9.0 * np.exp(1j * np.radians(theta4)),
    ]
    np.testing.assert_allclose(ends[0], ends[1], rtol=1e-14)


def test_guide_transmission_angle_extremes():
    # package pylinkage: crank 1, coupler 2.5, rocker 2, ground 3; extremes where crank and frame are in line
    links = {"a": 1.0, "b": 2.5, "c": 2.0, "e": 3.0}
    pressure = sweep.evaluate("guide", links | LINE | {"xi": 0.0}, "pressure_angle", [0.0, np.pi]).pressure_angle
    np.testing.assert_allclose(90.0 - np.degrees(pressure[0]), 51.3178125465, atol=1e-9)
    np.testing.assert_allclose(90.0 + np.degrees(pressure[1]), 125.0996321954, atol=1e-9)


@pytest.mark.parametrize("branch", [-1.0, 1.0])
@pytest.mark.parametrize(
    ("degrees", "ground", "speed", "unevenness", "deviation", "stroke"),
    [
        (60.0, 2.900, 1.70238, 3.479, 0.000265, 1.76294),
        (120.0, 2.625, 1.61149, 14.658, 0.01031, 3.23796),
        (180.0, 2.200, 1.43614, 35.197, 0.09631, 4.18084),
    ],
)
def test_guide_hoeken_linkage(branch, degrees, ground, speed, unevenness, deviation, stroke):
    arm = 0.5 * (3.0 * ground - 1.0)
    links = {"a": 1.0, "b": arm, "c": arm, "e": ground, "xi": 2.0 * arm, "branch": branch}
    phi = np.pi + np.radians(np.linspace(-0.5 * degrees, 0.5 * degrees, 2001))
    frame = sweep.evaluate("guide", links | LINE, ["s", "ds", "dev"], phi)
    # The rocker pin is as far from crank pin, rocker pivot and point: the point is square to the line of both (Thales).
    line = np.exp(1j * phi) - ground
    point = ground + branch * 1j * line * np.sqrt((2.0 * arm / np.abs(line)) ** 2 - 1.0)
    np.testing.assert_allclose(frame.s + 1j * frame.dev, point, rtol=1e-14)
    velocity = frame.ds.abs()
    # In the middle of the range that line has its greatest length and only turns.
    assert velocity[1000] == pytest.approx(math.sqrt(4.0 * arm**2 - (1.0 + ground) ** 2) / (1.0 + ground), rel=1e-14)
    assert velocity[1000] == pytest.approx(speed, abs=6e-6)
    assert np.ptp(frame.s) == pytest.approx(stroke, abs=6e-6)
    # the recomputed percentages carry three or four digits and come from a grid of their own
    mean = stroke / np.radians(degrees)
    assert 100.0 * np.ptp(velocity) / mean == pytest.approx(unevenness, rel=2e-4)
    assert 100.0 * np.ptp(frame.dev) / np.ptp(frame.s) == pytest.approx(deviation, rel=2e-3)


def test_guide_chebyshev_lambda_linkage():
    links = {"a": 1.0, "b": 2.5, "c": 2.5, "e": 2.0, "xi": 5.0, "branch": -1.0}
    frame = sweep.evaluate("guide", links | LINE | {"h": 4.0}, ["s", "dev"], np.radians(np.linspace(90.0, 270.0, 2001)))
    np.testing.assert_allclose(frame.dev[[0, 1000, 2000]], 0.0, atol=2e-15)
    assert np.ptp(frame.s) == pytest.approx(4.0, abs=4e-15)
    assert np.ptp(frame.dev) == pytest.approx(0.009753733, abs=1e-8)


def test_guide_chebyshev_linkage():
    # Cranks 5 on a frame of 4, crossed, coupler 2: its middle is exactly on the line at both ends and in the middle.
    links = {"a": 5.0, "b": 2.0, "c": 5.0, "e": 4.0, "xi": 1.0, "branch": 1.0}
    phi = np.array([np.arctan2(3.0, 4.0), np.arctan2(4.0, 3.0), 0.5 * np.pi])
    frame = sweep.evaluate("guide", links | LINE | {"h": 4.0}, ["s", "dev"], phi)
    np.testing.assert_allclose(frame.s, [4.0, 2.0, 0.0], atol=4e-15)
    np.testing.assert_allclose(frame.dev, 0.0, atol=2e-15)
