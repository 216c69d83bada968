"""Hoeken's straight line from the straight-line problem: the optimiser against a closed form and the printed table.

Crank 1, frame L1, coupler = rocker = tracer arm = L3; the crank swings over a range beta about the far dead centre.
A height of the tracer is a cubic in cos phi (docs/guide.md, Straightest lines), whose Chebyshev alternation gives

    L1 + 1/L1 = (8 + 2 cos(beta/2))/3,   L3 = (3 L1 - 1)/2.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from kernels import status as st
from sweep.families.base import Angles, Family, Output, Parameter
from sweep.families.guide import FAMILY as GUIDE
from sweep.optimise import Problem, minimise
from sweep.study import OptimiseSettings

# Norton, Design of Machinery: range of the crank [deg], L1, deviation in % of the travel (theirs from peak to peak).
PRINTED = ((60.0, 2.900, 0.00027), (120.0, 2.625, 0.010), (180.0, 2.200, 0.096))
STEP = 0.025  # between the printed values of L1
# Least singular value of the four heights' derivatives by the dimensions and the half width, at the optimum.
CORNER = {60.0: 7.47e-5, 120.0: 1.404e-3, 180.0: 9.41e-3}


def hoeken(beta: float) -> Family:
    """The guide with equal coupler, rocker and arm, its crank swinging over ``beta`` about 180 deg."""

    def poses(designs: Any, angles: Angles, wanted: frozenset[str]) -> dict[str, Any]:
        frame, link, h = designs.T
        one, none = np.ones_like(frame), np.zeros_like(frame)
        full = np.column_stack([one, link, link, frame, 2.0 * link, none, none, h, -one])
        return GUIDE.poses(full, Angles.of(math.pi + 0.5 * beta * angles.sin), wanted)

    return Family(
        name="hoeken",
        title="Hoeken's straight line",
        parameters=(
            Parameter("frame", "length", "L1"),
            Parameter("link", "length", "L3"),
            Parameter("h", "length", "height of the line"),
        ),
        position="s",
        pose_outputs=(Output("s", "length", "along the line"), Output("dev", "length", "across it", windowed=True)),
        poses=poses,
    )


def closed_form(beta: float) -> tuple[float, float, float, float]:
    """L1, L3, height of the line, and half the width of the band."""
    end = -math.cos(0.5 * beta)
    half = (4.0 - end) / 3.0
    frame = half + math.sqrt(half * half - 1.0)
    inner = 0.5 * (3.0 - 2.0 * frame - end)
    low = 8.0 * frame * (frame - 1.0)
    high = inner * inner + 2.0 * inner * end + 7.0 * frame * frame - 6.0 * frame
    width = (high - low) / (math.sqrt(high) + math.sqrt(low))
    return frame, 0.5 * (3.0 * frame - 1.0), 0.5 * (math.sqrt(high) + math.sqrt(low)), 0.5 * abs(width)


def percent_of_travel(frame: float, link: float, beta: float) -> float:
    """Deviation from peak to peak in percent of the travel, on a dense grid."""
    phi = math.pi + 0.5 * beta * np.linspace(-1.0, 1.0, 20001)
    design = np.array([[1.0, link, link, frame, 2.0 * link, 0.0, 0.0, 0.0, -1.0]])
    columns = GUIDE.poses(design, Angles.of(phi[None, :]), frozenset(["s", "dev"]))
    assert not columns["status"].any()
    return float(100.0 * np.ptp(columns["dev"]) / np.ptp(columns["s"]))


@pytest.mark.parametrize(("degrees", "printed", "percent"), PRINTED)
def test_the_straightest_line_is_hoekens(degrees: float, printed: float, percent: float) -> None:
    beta = math.radians(degrees)
    frame, link, height, half = closed_form(beta)
    low, high = np.array([1.5, 2.0, 2.0]), np.array([3.5, 5.0, 9.0])
    problem = Problem(hoeken(beta), ("frame", "link", "h"), low, high, {}, "max_abs_dev")
    starts = problem.rows(np.array([[2.0, 2.5, 4.0], [3.0, 4.0, 7.0]]))
    for found in minimise(problem, starts, OptimiseSettings()):
        assert found.status == st.OK and found.kkt_residual <= 1e-12
        # Four extrema of one size hold three dimensions: a corner, found to some roundings of the heights (the line is
        # the largest of them) over its least singular value.
        corner = 4.0 * 2.0**-53 * height / CORNER[degrees]
        np.testing.assert_allclose(found.design, [frame, link, height], rtol=0.0, atol=corner)
        assert found.objective == pytest.approx(half, rel=1e-8)
    # The printed frame is this one, rounded; so is its deviation, which is a little larger for it.
    assert abs(frame - printed) < STEP
    least, theirs = (percent_of_travel(x, 0.5 * (3.0 * x - 1.0), beta) for x in (frame, printed))
    assert least < theirs < 1.13 * least
    assert theirs == pytest.approx(percent, rel=0.04)


@pytest.mark.parametrize("degrees", [60.0, 120.0, 180.0])
def test_no_other_proportions_near_by_are_straighter(degrees: float) -> None:
    beta = math.radians(degrees)
    frame, link, _, _ = closed_form(beta)
    least = percent_of_travel(frame, link, beta)
    for step in (1e-3, 1e-5):
        for angle in np.linspace(0.0, 2.0 * math.pi, 24, endpoint=False):
            moved = frame + step * math.cos(angle), link + step * math.sin(angle)
            assert percent_of_travel(*moved, beta) > least


def test_ends_of_the_closed_form() -> None:
    # Hoeken's 1 : 3 : 4 for ever smaller ranges, Chebyshev's 1 : 2 : 2.5 for one of 209 deg.
    assert closed_form(1e-6)[:2] == pytest.approx((3.0, 4.0), rel=1e-12)
    assert closed_form(2.0 * math.acos(-0.25))[:2] == pytest.approx((2.0, 2.5), rel=1e-12)
