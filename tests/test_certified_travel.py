"""Proven maxima of a guided point's travel, alone and behind crank-rockers: enclosures, corrections, API."""

from __future__ import annotations

import numpy as np
import pytest
from mpmath import mp

import sweep
from kernels import enclosure as en
from kernels import status as st
from kernels._jit import kernel
from kernels.abreast import LANES, differentiate
from kernels.families import guide, rssr
from kernels.families.rssr import driven
from sweep.families import family
from sweep.families.guide import as_crank_rocker
from sweep.reductions.extrema import Request, true_extrema
from tests.reference.chain import rocker_angle, series
from tests.reference.guide import coupler_point
from tests.turn_designs import GUIDE, NEEDLE, guided_four_bars, needle_drives

DOUBLE = family(["rssr", "rssr", "guide"])


USED = 5  # lanes; the design that is looked at has others beside it


@kernel
def enclose(stages, couplings, shares, i, lane, phi, reach, numbers, jets, travel, good):
    for k in range(USED):
        driven.load(k, numbers, stages, couplings, shares, (i + k - lane) % shares.shape[0])
    driven.enclose_travel(USED, stages.shape[0], numbers, jets, phi, reach, travel, good)


@kernel
def of_one(jet, order, reach, share, y):
    en.derivative(jet, 0, order, reach, y)
    return en.remainders(jet, 0, order, reach, share)


def double_drives(n, seed):
    first, r = needle_drives(n, seed), np.random.default_rng(seed + 5)
    coupling = np.column_stack([r.choice([-1.0, 1.0], n), r.uniform(-3.0, 3.0, n)])
    return np.column_stack([needle_drives(n, seed + 50)[:, :8], first[:, :8], coupling, first[:, 8:]])


# Family, designs, columns in which its crank-rockers and couplings begin, column of the guide.
MAKERS = {
    "guide": (GUIDE, guided_four_bars, (), (), 0),
    "rssr+guide": (NEEDLE, needle_drives, (0,), (17,), 8),
    "rssr+rssr+guide": (DOUBLE, double_drives, (0, 8), (16, 27), 18),
}


def parts(designs, rockers, couplings, last):
    """Arguments of the kernel out of a design matrix."""
    driven_by = np.ascontiguousarray(designs[:, last : last + 9])
    stages = np.stack([*(designs[:, k : k + 8] for k in rockers), as_crank_rocker(driven_by)])
    joined = np.reshape([designs[:, k : k + 2] for k in couplings], (len(couplings), len(designs), 2))
    shares = np.empty((len(designs), 6))
    guide.travel_shares(driven_by, shares)
    return stages, joined, shares


def rotating(name, n, seed):
    """Designs that turn fully, with their searched maxima of the acceleration."""
    mechanism, make, *_ = MAKERS[name]
    designs = make(n, seed)
    found, status = true_extrema(mechanism, designs, [Request("d2s", 0)], 1e-8, locate=True)
    good = status == st.OK
    peak = found[Request("d2s", 0)]
    return designs[good], peak.value[good], peak.phi[good], peak.err[good]


def exact_travel(design, rockers, couplings, last):
    """phi -> travel in 50 digits."""
    numbers = [mp.mpf(float(x)) for x in design]
    stages = [lambda phi, k=k: rocker_angle(tuple(numbers[k : k + 8]), phi) for k in rockers]
    stages.append(lambda phi: coupler_point(tuple(numbers[last : last + 9]), phi)[0])
    return series(stages, [(numbers[k], numbers[k + 1]) for k in couplings])


def misses(name, narrow=1.0):
    """How many derivatives at points of random cells lie outside of their enclosure, and how many were looked at."""
    _, _, rockers, couplings, last = MAKERS[name]
    designs, *_ = rotating(name, {"guide": 40, "rssr+guide": 120, "rssr+rssr+guide": 600}[name], 5)
    stages, joined, shares = parts(designs, rockers, couplings, last)
    numbers = np.empty(len(stages) * driven.STAGE + driven.SHARES * LANES)
    jets, travel, y = np.empty((10, en.WIDTH * LANES)), np.empty(en.WIDTH * LANES), np.empty((en.ORDER + 1, LANES))
    phis, reaches, good, bounds, share = (
        np.zeros(LANES),
        np.full(LANES, 0.3),
        np.empty(LANES),
        np.empty((4, LANES)),
        0.67,
    )
    shares_of_reach = np.full(LANES, share)
    generator = np.random.default_rng(3)
    wrong = total = 0
    with mp.workdps(50):
        for i in range(min(20, len(designs))):
            lane, phi, reach = i % USED, generator.uniform(0.0, 2.0 * np.pi), generator.choice([1.0, 0.4, 0.05])
            good[lane] = 0.0
            while not good[lane]:
                phis[lane], reaches[lane] = phi, reach
                enclose(stages, joined, shares, i, lane, phis, reaches, numbers, jets, travel, good)
                reach *= 0.5
            reach = reaches[lane]
            x = mp.mpf(float(generator.uniform(-share, share)))
            exact_curve = exact_travel(designs[i], rockers, couplings, last)
            for order in (1, 2, 3):
                differentiate(USED, travel, order, reaches, shares_of_reach, y.reshape(-1), bounds.reshape(-1))
                exact = mp.diff(exact_curve, mp.mpf(phi) + x * reach, order, h=mp.mpf(10) ** -12 * reach)
                close = sum(mp.mpf(float(c)) * x**k for k, c in enumerate(y[: en.ORDER + 1 - order, lane]))
                wrong += abs(exact - close) > narrow * (bounds[0, lane] + bounds[1, lane])
                total += 1
    return wrong, total


@pytest.mark.parametrize("name", MAKERS)
def test_travel_is_enclosed(name):
    wrong, total = misses(name)
    assert wrong == 0
    assert total >= 15


def test_enclosures_a_thousand_times_narrower_are_found_out():
    wrong, _ = misses("rssr+guide", narrow=1e-3)
    assert wrong > 3


@pytest.mark.parametrize("name", ["guide", "rssr+guide"])
def test_any_beginning_ends_at_the_searched_maximum(name):
    """From a place that has nothing to do with the maximum the proof must find it by itself."""
    designs, value, _, err = rotating(name, 400, 9)
    n, (_, _, rockers, couplings, last) = len(designs), MAKERS[name]
    status, place, claim = np.zeros(n, np.uint8), np.linspace(0.0, 6.0, n), np.full(n, 1e-3)
    error, cells = np.full(n, np.nan), np.empty(n)
    rssr.certify_travel(*parts(designs, rockers, couplings, last), 2, 1e-8, 1000, status, claim, place, error, cells)
    assert (status == st.OK).all()
    assert (np.abs(claim - value) <= err + error).all()
    assert (error < 1e-5 * claim).all()


def test_a_proof_does_not_depend_on_the_designs_beside_it():
    designs, value, phi, _ = rotating("rssr+guide", 300, 21)
    _, _, rockers, couplings, last = MAKERS["rssr+guide"]
    n = len(designs)
    assert n > LANES  # so that lanes change hands
    together = [np.zeros(n, np.uint8), value.copy(), phi.copy(), np.full(n, np.nan), np.empty(n)]
    together[0][::7] = st.NOT_ROTATABLE
    alone = [column.copy() for column in together]
    rssr.certify_travel(*parts(designs, rockers, couplings, last), 2, 1e-8, 1000, *together)
    for i in range(n):
        one = [column[i : i + 1] for column in alone]
        rssr.certify_travel(*parts(designs[i : i + 1], rockers, couplings, last), 2, 1e-8, 1000, *one)
    for beside, single in zip(together, alone, strict=True):
        np.testing.assert_array_equal(beside, single)
    assert (together[4][::7] == 0.0).all() and np.isnan(together[3][::7]).all()
    assert (np.delete(together[4], np.s_[::7]) > 3).all()


@pytest.mark.parametrize("order", [0, 1, 2, 3])
def test_derivatives_abreast_are_those_of_a_jet_alone(order):
    generator = np.random.default_rng(order)
    jets, reach = generator.uniform(-1.0, 1.0, (en.WIDTH, LANES)), generator.uniform(0.01, 1.0, LANES)
    jets[en.NOISE :] = np.abs(jets[en.NOISE :])
    share, y, bounds = generator.uniform(0.1, 0.75, LANES), np.empty((en.ORDER + 1, LANES)), np.empty((4, LANES))
    differentiate(LANES, jets.reshape(-1), order, reach, share, y.reshape(-1), bounds.reshape(-1))
    for lane in range(LANES):
        expected = np.empty(en.ORDER + 1)
        noise, tail = of_one(jets[:, lane].copy(), order, reach[lane], share[lane], expected)
        count = en.ORDER + 1 - order
        # A dozen roundings lie between the two ways to multiply.
        np.testing.assert_allclose(y[:count, lane], expected[:count], rtol=16 * en.EPS)
        np.testing.assert_allclose(bounds[:2, lane], [noise, tail], rtol=64 * en.EPS)


def test_compiled_equals_plain():
    designs, value, phi, _ = rotating("rssr+guide", 30, 9)
    _, _, rockers, couplings, last = MAKERS["rssr+guide"]
    results = []
    for function in (rssr.certify_travel, rssr.certify_travel.py_func):
        n = len(designs)
        out = [np.zeros(n, np.uint8), value.copy(), phi.copy(), np.full(n, np.nan), np.empty(n)]
        function(*parts(designs, rockers, couplings, last), 2, 1e-8, 1000, *out)
        results.append(out)
    for compiled, plain in zip(*results, strict=True):
        np.testing.assert_array_equal(compiled, plain)


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


def test_deviation_has_no_proof():
    with pytest.raises(sweep.errors.InputError, match="max_abs_d2s, max_abs_d3s; not of max_abs_dev"):
        sweep.summarise("guide", {}, ["max_abs_d2s", "max_abs_dev"], certify=True)
