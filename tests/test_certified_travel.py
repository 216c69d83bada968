"""Proven maxima of a guided point's travel, alone and behind crank-rockers: enclosures, corrections, API."""

from __future__ import annotations

import numpy as np
import pytest
from mpmath import mp

import sweep
from kernels import enclosure as en
from kernels import status as st
from kernels._jit import kernel
from kernels.families import guide, rssr
from kernels.families.rssr import driven
from sweep.families import family
from sweep.families.guide import as_crank_rocker
from sweep.reductions.extrema import Request, true_extrema
from tests.reference.chain import rocker_angle, series
from tests.reference.guide import coupler_point
from tests.turn_designs import GUIDE, NEEDLE, guided_four_bars, needle_drives

DOUBLE = family(["rssr", "rssr", "guide"])


@kernel
def enclose(stages, couplings, shares, i, phi, reach, at):
    return driven.enclose_travel(at, stages, couplings, shares, i, phi, reach)


@kernel
def derivative(at, order, reach, share, y):
    en.derivative(at, driven.X, order, reach, y)
    return en.remainders(at, driven.X, order, reach, share)


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
    at, y, generator = np.empty(driven.SIZE), np.empty(en.ORDER + 1), np.random.default_rng(3)
    wrong = total = 0
    with mp.workdps(50):
        for i in range(min(20, len(designs))):
            phi, reach, share = generator.uniform(0.0, 2.0 * np.pi), generator.choice([1.0, 0.4, 0.05]), 0.67
            while not enclose(stages, joined, shares, i, phi, reach, at):
                reach *= 0.5
            x = mp.mpf(float(generator.uniform(-share, share)))
            travel = exact_travel(designs[i], rockers, couplings, last)
            for order in (1, 2, 3):
                noise, tail = derivative(at, order, reach, share, y)
                exact = mp.diff(travel, mp.mpf(phi) + x * reach, order, h=mp.mpf(10) ** -12 * reach)
                close = sum(mp.mpf(float(c)) * x**k for k, c in enumerate(y[: en.ORDER + 1 - order]))
                wrong += abs(exact - close) > narrow * (noise + tail)
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
