"""Proven maxima of a guided point, alone and behind crank-rockers: enclosures, hard designs, the public functions."""

from __future__ import annotations

import numpy as np
import pytest
from mpmath import mp

import sweep
from kernels import status as st
from kernels.certified import cells
from kernels.certified import jets as en
from kernels.certified.jets import LANES
from kernels.families.rssr import driven
from kernels.jit import kernel
from sweep.evaluation.summaries import design_outputs
from sweep.families.base import Accuracy
from sweep.quantities.kinds import Request
from sweep.reductions.extrema import true_extrema
from tests.support.guided_proofs import CURVES, MAKERS, certify, exact_point, parts, rotating
from tests.support.selection import mostly_long
from tests.support.turn_designs import NEEDLE, needle_drives

USED = 5  # lanes; the design that is looked at has others beside it


@kernel
def enclose(stages, couplings, shares, i, lane, walk, numbers, jets, good):
    for k in range(USED):
        driven.load(k, numbers, stages, couplings, shares, (i + k - lane) % shares.shape[0])
    driven.enclose_motion(USED, stages.shape[0], numbers, jets, walk, False, True, True, good)


def misses(name, narrow=1.0):
    """How many derivatives at points of random cells lie outside of their enclosure, and how many were looked at."""
    _, _, rockers, couplings, last = MAKERS[name]
    designs, *_ = rotating(name, {"guide": 40, "rssr+guide": 120, "rssr+rssr+guide": 600}[name], 5)
    stages, joined, shares = parts(designs, rockers, couplings, last)
    numbers = np.empty(len(stages) * driven.STAGE + driven.SHARES * LANES)
    jets, walk, good, y = np.empty(driven.JETS), np.zeros(cells.WALK), np.empty(LANES), np.empty(cells.CURVE)
    walk[cells.REACH : cells.REACH + LANES] = 0.3
    generator = np.random.default_rng(3)
    wrong = total = 0
    with mp.workdps(50):
        for i in range(min(20, len(designs))):
            lane, phi, reach = i % USED, generator.uniform(0.0, 2.0 * np.pi), generator.choice([1.0, 0.4, 0.05])
            good[lane] = 0.0
            while not good[lane]:
                walk[cells.CENTRE + lane], walk[cells.REACH + lane] = phi, reach
                enclose(stages, joined, shares, i, lane, walk, numbers, jets, good)
                reach *= 0.5
            reach = walk[cells.REACH + lane]
            x = mp.mpf(float(generator.uniform(-cells.SHARE_MOST, cells.SHARE_MOST)))
            ends = exact_point(designs[i], rockers, couplings, last)
            for end, order in CURVES.values():
                y[:] = 0.0
                cells.weigh(USED, walk, y, jets[(driven.ALONG, driven.ACROSS)[end] :], order)
                exact = mp.diff(ends[end], mp.mpf(phi) + x * reach, order, h=mp.mpf(10) ** -12 * reach)
                powers = range(en.ORDER + 1 - order)
                close = sum(mp.mpf(float(y[cells.Y0 + k * LANES + lane])) * x**k for k in powers)
                noise, tail, bound = (float(y[k + lane]) for k in (cells.OF_NOISE, cells.OF_TAIL, cells.WHOLE))
                wrong += abs(exact - close) > narrow * (noise + tail)
                # The walk is in no march, so the bound is that of the whole cell.
                assert abs(exact) <= bound + noise
                total += 1
    return wrong, total


@pytest.mark.parametrize("name", MAKERS)
def test_travel_and_deviation_are_enclosed(name):
    wrong, total = misses(name)
    assert wrong == 0
    assert total >= 30


def test_enclosures_a_thousand_times_narrower_are_found_out():
    wrong, _ = misses("rssr+guide", narrow=1e-3)
    assert wrong > 3


def nearly_stuck(n):
    """The needle drives of 6000 that turn with the least margins, 1e-7 at most."""
    designs = needle_drives(6000, 71)
    found = design_outputs(NEEDLE, designs, ["margin"], Accuracy(target=1e-8))
    margin = np.where((found["status"] == st.OK) & (found["margin"] > 1e-7), found["margin"], np.inf)
    return designs[np.argsort(margin)[:n]]


@pytest.mark.parametrize("curve", ["d2s", "dev"])
def test_high_precision_finds_no_more_than_is_proven_close_to_a_dead_point(curve):
    designs = nearly_stuck(8)
    found, status = true_extrema(NEEDLE, designs, [Request(curve, 0)], 1e-8)
    peak, (end, order) = found[Request(curve, 0)], CURVES[curve]
    assert (status == st.OK).all()
    proven = certify("rssr+guide", designs, (curve,), peak.value[None], peak.phi[None])
    assert (proven["status"] == st.OK).all()
    most, error, generator = proven["max"][0], proven["error"][0], np.random.default_rng(5)
    with mp.workdps(40):
        for design, phi, value, err in zip(designs, proven["phi"][0], most, error, strict=True):
            exact = exact_point(design, (0,), (17,), 8)[end]
            # The place is not quite that of the maximum, which lowers the value by far less than the target.
            assert value - err - 2e-8 * value <= abs(mp.diff(exact, mp.mpf(phi), order, h=mp.mpf(10) ** -14))
            for x in (phi, *(phi + generator.normal(size=3) * 0.01), *generator.uniform(0.0, 6.28, 6)):
                assert abs(mp.diff(exact, mp.mpf(x), order, h=mp.mpf(10) ** -14)) <= value + err


@pytest.mark.parametrize("name", ["guide", "rssr+guide"])
def test_summarise_proves_the_travel(name):
    mechanism, make, *_ = MAKERS[name]
    table = dict(zip(mechanism.parameter_names, make(60, 13).T, strict=True))
    wanted = ["max_abs_ds", "max_abs_d2s", "phi_max_abs_d2s", "max_abs_d3s", "stroke"]
    proven = sweep.summarise(name.split("+"), table, wanted, certify=True)
    searched = sweep.summarise(name.split("+"), table, wanted)
    assert (proven["status"] == searched["status"]).all()
    good = proven["status"] == st.OK
    assert good.sum() > 5
    for pose in ("max_abs_ds", "max_abs_d2s", "max_abs_d3s"):
        np.testing.assert_allclose(proven[pose][good], searched[pose][good], rtol=1e-8)
        assert (proven[f"err_{pose}"][good] > 0.0).all()
    np.testing.assert_array_equal(proven["stroke"], searched["stroke"])


@pytest.mark.parametrize("name", mostly_long(["guide", "rssr+guide"], ["rssr+guide"]))
def test_summarise_proves_several_curves_together_as_each_alone(name):
    mechanism, make, *_ = MAKERS[name]
    table = dict(zip(mechanism.parameter_names, make(150, 17).T, strict=True))
    wanted = [f"max_abs_{curve}" for curve in CURVES]
    together = sweep.summarise(name.split("+"), table, wanted, certify=True)
    good = together["status"] == st.OK
    assert good.sum() > 5
    for output in wanted:
        alone = sweep.summarise(name.split("+"), table, output, certify=True)
        assert (alone["status"] == together["status"]).all()
        np.testing.assert_array_equal(alone[output][good], together[output][good])
        # Cells differ with what is proven beside, and with them what rounding adds.
        assert (together[f"err_{output}"][good] < 1e-5 * together[output][good]).all()


def test_no_design_that_turns_leaves_nothing_to_prove():
    table = dict(zip(NEEDLE.parameter_names, needle_drives(3, 1).T, strict=True))
    found = sweep.summarise(["rssr", "guide"], table, "max_abs_d2s", certify=True)
    assert (found["status"] != st.OK).all()
    assert found["max_abs_d2s"].isna().all()


def test_deviation_in_a_window_has_no_proof():
    table = dict(zip(NEEDLE.parameter_names, needle_drives(3, 1).T, strict=True))
    with pytest.raises(sweep.errors.InputError, match="not of max_abs_dev in a window"):
        sweep.summarise(["rssr", "guide"], table, "max_abs_d2s, max_abs_dev", certify=True, window=(0.0, 0.6))
    found = sweep.summarise(
        ["rssr", "guide"], table, "max_abs_d2s, max_abs_dev", certify="max_abs_d2s", window=(0.0, 0.6)
    )
    assert list(found.columns[:2]) == ["max_abs_d2s", "max_abs_dev"]


def test_place_across_a_line_has_no_proof():
    with pytest.raises(sweep.errors.InputError, match="max_abs_d2dev, max_abs_d3s; not of max_abs_x_m"):
        sweep.summarise("guide", {}, ["max_abs_d2s", "max_abs_x_m"], certify=True)
