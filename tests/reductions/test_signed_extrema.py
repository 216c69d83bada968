"""Largest and least values of a crank-rocker's derivatives, which its fused kernel searches, and of equal tops.

The reference are precise poses: 2048 of a turn, and those about each extremum that was found.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from kernels import status as st
from sweep.evaluation.summaries import design_outputs
from sweep.families.base import Accuracy, Angles
from sweep.quantities.kinds import Request
from sweep.reductions import fused
from sweep.reductions.extrema import true_extrema
from tests.support.climbing import climbed
from tests.support.near_change_points import RSSR, near_change_points, placed
from tests.support.rssr_designs import margins, random_designs
from tests.support.turn_designs import NEEDLE, needle_drives

TURN = np.arange(4096) * (2.0 * np.pi / 4096)


def long_couplers(n, seed, longest):
    """(n, 8) designs that turn, of which one offset is up to so many cranks long, and the coupler with it."""
    designs = placed(16 * n, np.random.default_rng(seed), longest)
    return np.ascontiguousarray(designs[margins(designs)["margin"] > 1e-6][:n])


CASES = {
    "general": lambda: random_designs(200, 31, rotatable=True),
    "one offset of 1e3 cranks": lambda: long_couplers(200, 1, 1e3),
    "one offset of 1e6 cranks": lambda: long_couplers(200, 2, 1e6),
    "near change points": lambda: near_change_points(100, 5, 1.0, lowest=1e-7),
    "both": lambda: near_change_points(100, 6, 1e5, lowest=1e-7),
}


@pytest.mark.parametrize("target", [1e-3, 1e-8, 1e-12])
@pytest.mark.parametrize("pose", ["dpsi", "d2psi", "d3psi"])
@pytest.mark.parametrize("case", CASES)
def test_signed_extrema_are_those_of_precise_poses_within_their_errors(case, pose, target):
    designs = CASES[case]()
    requests = {Request(pose, mode): mode for mode in (1, -1)}
    assert all(fused.curve_of(RSSR, request, False) is not None for request in requests)
    found, status = true_extrema(RSSR, designs, list(requests), target)
    good = status == st.OK
    assert good.mean() > 0.8  # the others are within 1e-7 of a change point, where samples do not resolve the motion
    turn = RSSR.precise().poses(designs, Angles.of(TURN[None, ::2]), frozenset([pose]))[pose]
    for request, mode in requests.items():
        value, err = found[request].value[good], found[request].err[good]
        top = climbed(RSSR, designs[good], pose, mode, found[request].phi[good])
        rounding = 2.0**-52 * np.abs(top)  # of the reference
        assert (np.abs(value - top) <= err + rounding).all()
        highest = turn[good].max(axis=1) if mode > 0 else turn[good].min(axis=1)
        assert (mode * (highest - value) <= err + rounding).all()  # no other peak is higher


def test_without_precise_poses_the_errors_of_long_couplers_are_those_of_poses():
    """Where rounding counts the fused search asks precise poses, so it does not serve a family that has none."""
    designs = long_couplers(200, 3, 1e5)
    request = Request("d2psi", 1)
    plain = replace(RSSR, precise_poses=None)
    assert fused.curve_of(plain, request, False) is None
    found, _ = true_extrema(plain, designs, [request], 1e-12)
    top = climbed(RSSR, designs, "d2psi", 1, found[request].phi)
    assert (np.abs(found[request].value - top) <= found[request].err).all()


def test_needles_that_stand_twice_at_one_end_are_left_to_no_slower_search():
    designs = needle_drives(4096, 1)
    designs = designs[design_outputs(NEEDLE, designs, ["margin"], Accuracy(target=1e-6))["status"] == st.OK][:1500]
    twice = 0
    for mode in (1, -1):
        curve = fused.curve_of(NEEDLE, Request("s", mode), False)
        found, status, undecided = fused.extrema((curve,), designs, 1e-8)[0]
        assert (status == st.OK).all() and undecided.mean() < 2e-3
        s = NEEDLE.poses(designs, Angles.of(TURN[None, ::8]), frozenset(["s"]))["s"]
        top = climbed(NEEDLE, designs, "s", mode, found.phi)
        assert (np.abs(found.value - top) <= found.err + 2.0**-52 * np.abs(top)).all()
        assert (found.err <= 1e-8 * np.ptp(s, axis=1)).all()
        higher = mode * s
        tops = (higher > np.roll(higher, 1, axis=1)) & (higher >= np.roll(higher, -1, axis=1))
        tops &= higher >= higher.max(axis=1)[:, None] - 1e-4 * np.ptp(s, axis=1)[:, None]
        twice += int((tops.sum(axis=1) > 1).sum())
    assert twice > 10  # so the case is met


@pytest.mark.parametrize(("of", "pose", "place"), [(RSSR, "d2psi", False), (NEEDLE, "s", False), (NEEDLE, "ds", True)])
def test_a_largest_and_a_least_value_share_samples_and_keep_their_bits(of, pose, place):
    """Among the designs are those that do not turn, that need more samples, and that precise poses confirm."""
    designs = random_designs(2000, 7) if of is RSSR else needle_drives(3000, 7)
    both = (Request(pose, 1, place=place), Request(pose, -1, place=place))
    curves = fused.together(fused.curve_of(of, both[0], False), both)
    assert {curve.request for curve in curves} == set(both)
    found_together = fused.extrema(curves, designs, 1e-10)
    for request, (found, status, undecided) in zip([c.request for c in curves], found_together, strict=True):
        alone, status_alone, undecided_alone = fused.extrema((fused.curve_of(of, request, False),), designs, 1e-10)[0]
        assert {st.OK, st.NOT_ROTATABLE} <= set(status) and np.isfinite(found.value).sum() > 100
        np.testing.assert_array_equal(status, status_alone)
        np.testing.assert_array_equal(undecided, undecided_alone)
        for column, expected in zip(found, alone, strict=True):
            np.testing.assert_array_equal(column, expected)
