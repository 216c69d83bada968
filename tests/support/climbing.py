"""Exact heights and places of extrema near given ones, from poses in twice the working precision alone."""

from __future__ import annotations

import numpy as np

from kernels import status as st
from sweep.evaluation.summaries import design_outputs
from sweep.families.base import Accuracy, Angles
from sweep.families.capabilities import Assembly
from sweep.quantities.kinds import Request
from sweep.reductions import extrema, fused

EPS = 2.0**-53
OFFSETS = np.arange(-4.0, 5.0) / 4.0
HALVINGS = 60


def values(family, designs, pose, phi):
    """Return a pose output at angles (n, m)."""
    return family.precise().poses(designs, Angles.of(phi), frozenset([pose]))[pose]


def climbed(family, designs, pose, mode, phi, width=1e-3):
    """Return the largest measured value (n,) within about ``width`` of ``phi`` (n,), by repeatedly refined nine poses.

    It is a value at a pose, hence never above the maximum; values with rounding errors are not interpolated.
    """
    at, best = phi.copy(), np.full(phi.size, -np.inf)
    rows = np.arange(phi.size)
    while width > 1e-11:
        angles = at[:, None] + width * OFFSETS
        found = values(family, designs, pose, angles)
        found = np.abs(found) if mode == 0 else mode * found
        which = found.argmax(axis=1)
        better = found[rows, which] >= best
        best, at = np.where(better, found[rows, which], best), np.where(better, angles[rows, which], at)
        width *= 0.5
    return best if mode >= 0 else -best


def turning_points(family, designs, slope, phi, width=1e-5):
    """Return zeros (n,) of a derivative within ``width`` of ``phi`` (n,) by bisection; nan without a change of sign."""
    low, high = phi - width, phi + width
    at_low, at_high = (np.sign(values(family, designs, slope, x[:, None])[:, 0]) for x in (low, high))
    bracketed = at_low * at_high < 0.0
    for _ in range(HALVINGS):
        middle = 0.5 * (low + high)
        left = np.sign(values(family, designs, slope, middle[:, None])[:, 0]) == at_low
        low, high = np.where(left, middle, low), np.where(left, high, middle)
    return np.where(bracketed, 0.5 * (low + high), np.nan)


def amplified(family, designs):
    """Return the amplification of a rounding error by a stage's dead point: the inverse of the least margin."""
    return 1.0 + 1.0 / design_outputs(family, designs, ["margin"], Accuracy(target=1e-6))["margin"]


def assert_fused_extrema_lie_within_their_errors(family, designs, request):
    """Compare fused extrema with precise poses, climbed from the extrema of the search on poses with places."""
    assert fused.curve_of(family, request, False) is not None
    found, status = extrema.true_extrema(family, designs, [request], 1e-8)
    slow, _ = extrema.true_extrema(family, designs, [request], 1e-10, locate=True)
    exact = climbed(family, designs, request.pose, request.mode, slow[request].phi)
    assert (status == st.OK).all()
    off = np.abs(found[request].value - exact)
    # The chain's precise poses pass a rounded angle from stage to stage.
    assert (off <= found[request].err + 8.0 * EPS * amplified(family, designs) * np.abs(exact)).all()
    assert np.quantile(off / np.abs(exact), 0.9) < 1e-13


def assert_fused_margins_are_those_of_poses(family, designs, number):
    """Compare fused least discriminants of a later stage with the search on poses, within the errors of both."""
    request = Request(f"discriminant{number}", -1)
    loop = next(loop for loop in family.every(Assembly) if loop.stage == str(number))
    found, _, undecided = fused.extrema((fused.curve_of(family, request, True),), designs, 1e-10)[0]
    slow, _ = extrema._searched(family, designs, [request], 1e-10, False, True, None)
    known, scale = ~undecided, loop.scale(designs)
    assert known.mean() > 0.98
    off = np.abs(found.value - slow[request].value)[known] / scale[known]
    assert (off <= ((found.err + slow[request].err) / scale)[known] + 4.0 * EPS).all()
