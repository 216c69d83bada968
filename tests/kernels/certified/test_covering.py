"""The walk that proves several curves at once: bounds of cells, false beginnings and claims, what is given up."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.special import perm

from kernels import status as st
from kernels.certified import cells
from kernels.certified import jets as en
from kernels.certified.jets import LANES
from kernels.families.rssr.certify import certify_maxima
from kernels.types import EPS
from sweep.families.base import Angles
from sweep.quantities.kinds import Request
from sweep.reductions.extrema import true_extrema
from tests.support.guided_proofs import CURVES, MAKERS, certify, parts, rotating
from tests.support.turn_designs import GUIDE, NEEDLE


@pytest.mark.parametrize("name", ["guide", "rssr+guide"])
@pytest.mark.parametrize("curves", [("d2s",), ("dev",), ("d2s", "dev", "ds")])
def test_any_beginning_ends_at_the_searched_maximum(name, curves):
    """From a place that has nothing to do with the maximum the proof must find it by itself."""
    designs, value, phi, err = rotating(name, 400, 9, curves)
    place = np.broadcast_to(np.linspace(0.0, 6.0, len(designs)), value.shape)
    found = certify(name, designs, curves, np.full(value.shape, 1e-3), place)
    assert (found["status"] == st.OK).all()
    assert (np.abs(found["max"] - value) <= err + found["error"]).all()
    assert (found["error"] < 1e-5 * found["max"]).all()
    assert (np.abs(np.angle(np.exp(1j * (place - phi)))) > 0.6).mean() > 0.5


@pytest.mark.parametrize("place", [np.nan, np.inf, -np.inf, 1e300, -7.0, 1e4])
def test_any_place_is_a_beginning(place):
    designs, value, _, err = rotating("rssr+guide", 120, 43, ("d2s", "dev"))
    found = certify("rssr+guide", designs, ("d2s", "dev"), value, np.full(value.shape, place))
    assert (found["status"] == st.OK).all()
    assert (np.abs(found["max"] - value) <= err + found["error"]).all()


def second_peaks(name, curve, n, seed):
    """Designs with the second-highest of their peaks on 720 poses, its place, and what the search finds."""
    designs, value, *_ = rotating(name, n, seed, (curve,))
    phi = np.arange(720) * (2.0 * np.pi / 720)
    size = np.abs(MAKERS[name][0].poses(designs, Angles.of(phi[None, :]), frozenset((curve,)))[curve])
    peak = (size > np.roll(size, 1, axis=1)) & (size >= np.roll(size, -1, axis=1))
    ranked = np.sort(np.where(peak, size, 0.0), axis=1)
    rows = np.flatnonzero((ranked[:, -2] > 0.5 * ranked[:, -1]) & (ranked[:, -2] < 0.999 * ranked[:, -1]))
    second = ranked[rows, -2]
    return designs[rows], second[None], phi[np.argmax(size[rows] == second[:, None], axis=1)][None], value[:, rows]


@pytest.mark.parametrize("curve", ["d2s", "dev", "d2dev"])
def test_second_peak_is_not_proven_to_be_the_highest(curve):
    designs, second, place, right = second_peaks("rssr+guide", curve, 1500, 23)
    assert len(designs) > 25
    found = certify("rssr+guide", designs, (curve,), second, place)
    assert (found["status"] == st.OK).all()
    assert (found["max"] > second).all()
    np.testing.assert_allclose(found["max"], right, rtol=1e-7)


@pytest.mark.parametrize("curve", ["ds", "d2s", "dev"])
def test_no_grid_finds_more_than_is_proven(curve):
    designs, value, phi, _ = rotating("rssr+guide", 1000, 31, (curve,))
    found = certify("rssr+guide", designs, (curve,), value, phi)
    grid = Angles.of(np.arange(4096)[None, :] * (2.0 * np.pi / 4096))
    sampled = np.abs(NEEDLE.poses(designs, grid, frozenset((curve,)))[curve]).max(axis=1)
    assert (found["status"] == st.OK).all()
    # Plain poses at margins down to 1e-5 are off by 1e-11 themselves.
    assert (sampled <= found["max"] + found["error"] + 1e-10 * found["max"]).all()
    assert np.median(found["cells"]) < 16


@pytest.mark.parametrize("factor", [0.0, 0.9, 1.0 + 1e-4, 10.0, np.inf])
def test_false_claim_at_the_right_place_is_replaced(factor):
    designs, value, phi, err = rotating("rssr+guide", 200, 29, ("d2s", "dev"))
    found = certify("rssr+guide", designs, ("d2s", "dev"), factor * value, phi)
    assert (found["status"] == st.OK).all()
    assert (np.abs(found["max"] - value) <= err + found["error"]).all()
    assert (found["error"] < 1e-6 * value).all()


def test_true_claim_is_kept_bit_for_bit():
    designs, value, phi, _ = rotating("rssr+guide", 300, 37, tuple(CURVES))
    found = certify("rssr+guide", designs, tuple(CURVES), value, phi)
    assert (found["max"] == value).all()
    assert (found["phi"] == phi).all()


@pytest.mark.parametrize("most", [0, 1, 4])
def test_too_few_cells_prove_nothing(most):
    designs, value, phi, _ = rotating("rssr+guide", 200, 41, ("d2s", "dev"))
    found = certify("rssr+guide", designs, ("d2s", "dev"), value, phi, most=most)
    assert (found["status"] == st.NOT_CONVERGED).all()
    assert (found["max"] == value).all()
    assert np.isnan(found["error"]).all()


def test_a_curve_that_is_given_up_leaves_the_others_their_proof():
    """Few enclosures are enough for the deviation, but not for the jerk of the same designs."""
    designs, value, phi, _ = rotating("rssr+guide", 400, 61, ("d3s", "dev"))
    alone = certify("rssr+guide", designs, ("dev",), value[1:], phi[1:], most=12)
    found = certify("rssr+guide", designs, ("d3s", "dev"), value, phi, most=12)
    lost = (found["status"][0] == st.NOT_CONVERGED) & (alone["status"][0] == st.OK)
    assert lost.sum() > 20
    assert (found["status"][1, lost] == st.OK).mean() > 0.9
    proven = found["status"][1] == st.OK
    assert (found["error"][1, proven] < 1e-6 * value[1, proven]).all()


def test_equal_peaks_are_proven():
    """A point on the coupler's line over the base line runs symmetrically: its peaks come in mirrored pairs."""
    designs = np.zeros((12, 9))
    designs[:, 0], designs[:, 1], designs[:, 2] = np.linspace(0.3, 0.8, 12), 2.5, 2.5
    designs[:, 3], designs[:, 4], designs[:, 8] = 2.0, 5.0, 1.0
    designs[:, 6] = 0.5 * np.pi  # b = c and xi = 2 b: the curve is symmetrical about the normal of the base line
    for curve in ("d2s", "dev", "d2dev"):
        found, status = true_extrema(GUIDE, designs, [Request(curve, 0)], 1e-12, locate=True)
        assert (status == st.OK).all()
        peak = found[Request(curve, 0)]
        proven = certify("guide", designs, (curve,), peak.value[None], peak.phi[None], target=1e-12)
        assert (proven["status"] == st.OK).all()
        assert proven["cells"].max() < 60


def test_a_proof_does_not_depend_on_the_designs_beside_it():
    curves = ("d2s", "dev")
    designs, value, phi, _ = rotating("rssr+guide", 300, 21, curves)
    _, _, rockers, couplings, last = MAKERS["rssr+guide"]
    n, which = len(designs), np.array([CURVES[curve] for curve in curves], np.int64)
    assert n > LANES  # so that lanes change hands
    together = [np.zeros((2, n), np.uint8), value.copy(), phi.copy(), np.full((2, n), np.nan), np.empty(n)]
    together[0][:, ::7] = st.NOT_ROTATABLE
    alone = [column.copy() for column in together]
    certify_maxima(parts(designs, rockers, couplings, last), which, 1e-8, 1000, *together)
    for i in range(n):
        one = [np.ascontiguousarray(column[..., i : i + 1]) for column in alone]
        certify_maxima(parts(designs[i : i + 1], rockers, couplings, last), which, 1e-8, 1000, *one)
        for whole, part in zip(alone, one, strict=True):
            whole[..., i : i + 1] = part
    for beside, single in zip(together, alone, strict=True):
        np.testing.assert_array_equal(beside, single)
    assert (together[4][::7] == 0.0).all() and np.isnan(together[3][:, ::7]).all()
    assert (np.delete(together[4], np.s_[::7]) > 3).all()


def row(at, which):
    """One row of lanes, to be read or written."""
    return at[which : which + LANES]


def of_one(jet, order, reach, share):
    """Coefficients of a derivative of one jet, and bounds of its noise and tail on |x| <= share."""
    k = np.arange(order, 2 * en.ORDER)
    factors = perm(k, order) * share ** (k - order) / reach**order
    derivative = np.polynomial.polynomial.polyder(jet[: en.ORDER + 1], order) / reach**order
    return derivative, jet[en.NOISE] * factors.max(), jet[en.TAIL] * factors[k > en.ORDER].max()


@pytest.mark.parametrize("order", [0, 1, 2, 3])
def test_derivatives_abreast_are_those_of_a_jet_alone(order):
    generator = np.random.default_rng(order)
    jets, walk, y = generator.uniform(-1.0, 1.0, (en.WIDTH, LANES)), np.zeros(cells.WALK), np.zeros(cells.CURVE)
    jets[en.NOISE :] = np.abs(jets[en.NOISE :])
    reach = row(walk, cells.REACH)
    reach[:] = generator.uniform(0.01, 1.0, LANES)
    cells.weigh(LANES, walk, y, jets.reshape(-1), order)
    for lane in range(LANES):
        expected, noise, tail = of_one(jets[:, lane], order, reach[lane], cells.SHARE_MOST)
        count = en.ORDER + 1 - order
        found = y[cells.Y0 + lane : cells.Y0 + (en.ORDER + 1) * LANES : LANES]
        # A dozen roundings lie between the two ways to multiply.
        np.testing.assert_allclose(found[:count], expected, rtol=16 * EPS)
        assert (found[count:] == 0.0).all()
        bounds = [row(y, cells.OF_NOISE)[lane], row(y, cells.OF_TAIL)[lane]]
        np.testing.assert_allclose(bounds, [noise, tail], rtol=2.0**-40)  # GUARD enters once more


def bounds_exceeded(lower=0.0):
    """How often a polynomial with its tail exceeds the bound of a part of its cell, and the part's slackest bound."""
    generator = np.random.default_rng(7)
    over, slack = 0, []
    for _ in range(200):
        walk, curve, jets = np.zeros(cells.WALK), np.zeros(cells.CURVE), np.zeros(en.WIDTH * LANES)
        row(walk, cells.MODE)[:], row(walk, cells.REACH)[:] = cells.MARCH, 1.0
        row(curve, cells.EDGE)[:] = generator.uniform(-1.0, 0.15, LANES)
        row(curve, cells.TOP)[:], row(curve, cells.TOP2)[:] = generator.uniform(0.2, 1.5, LANES), np.inf
        decay = generator.uniform(0.1, 1.0, LANES)
        for k in range(en.ORDER + 1):
            row(jets, k * LANES)[:] = generator.normal(size=LANES) * decay**k
        row(jets, en.TAIL * LANES)[:] = 10.0 ** generator.uniform(-9.0, -2.0, LANES)
        cells.weigh(LANES, walk, curve, jets, 0)
        first = np.maximum(row(curve, cells.EDGE), -cells.SHARE)
        last = np.minimum(row(curve, cells.TOP), cells.SHARE)
        for end, which in ((last, cells.WHOLE), (row(curve, cells.MIDDLE), cells.PART)):
            x = first + np.linspace(0.0, 1.0, 201)[:, None] * (end - first)
            y = np.abs(sum(row(jets, k * LANES) * x**k for k in range(en.ORDER + 1)))
            y += row(jets, en.TAIL * LANES) * np.abs(x) ** (en.ORDER + 1)
            most, bound = y.max(axis=0), row(curve, which) * (1.0 - lower)
            over += (most > bound).sum()
            slack.append((bound - most) / np.abs(jets.reshape(en.WIDTH, LANES)[: en.ORDER + 1]).sum(axis=0))
    return over, np.concatenate(slack)


def test_parts_of_a_cell_are_bounded():
    over, slack = bounds_exceeded()
    assert over == 0
    assert np.median(slack) < 0.2


def test_bounds_a_tenth_lower_are_found_out():
    over, _ = bounds_exceeded(0.1)
    assert over > 100


def test_compiled_equals_plain():
    curves = ("d2s", "dev")
    designs, value, phi, _ = rotating("rssr+guide", 30, 9, curves)
    compiled = certify("rssr+guide", designs, curves, value, phi)
    plain = certify("rssr+guide", designs, curves, value, phi, function=certify_maxima.py_func)
    for name, values in compiled.items():
        np.testing.assert_array_equal(plain[name], values)
