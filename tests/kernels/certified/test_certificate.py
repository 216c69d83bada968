"""Proven maxima: no grid and no high precision finds more, a wrong peak is corrected, what is not proven says so."""

from __future__ import annotations

import mpmath as mp
import numpy as np
import pytest

from kernels import status as st
from kernels.families.rssr.certify import InSeries, certify_maxima
from studies.accuracy.regions import regions
from tests.kernels.certified.test_enclosure import exact_velocity
from tests.reference.rssr import Linkage
from tests.support.rssr_designs import dense, maxima, poses, random_designs

CELLS = 1000


def alone(designs):
    """Crank-rockers that nothing drives and that guide no point, as the kernel takes them."""
    n = len(designs)
    return InSeries(np.ascontiguousarray(designs)[None], np.empty((0, n, 2)), np.zeros((n, 8)))


def certify(designs, order, place, value, target=1e-8, most=CELLS, function=certify_maxima):
    """Maximum, place, error, status and number of enclosures, from a claimed maximum."""
    n = len(designs)
    out = {"status": np.zeros(n, np.uint8), "max": np.array(value, float), "phi": np.array(place, float)}
    out |= {"error": np.full(n, np.nan), "cells": np.full(n, np.nan)}
    shared = {name: column[None] for name, column in out.items() if name != "cells"} | {"cells": out["cells"]}
    function(alone(designs), np.array([(2, order - 1)]), target, most, *shared.values())
    return out


def certified(designs, order, target=1e-8, most=CELLS):
    found = maxima(designs, order, target)
    assert (found["status"] == st.OK).all()
    return certify(designs, order, found["phi"], found["max"], target, most)


@pytest.mark.parametrize("order", [1, 2, 3])
def test_no_grid_finds_more_than_is_proven(order):
    designs = random_designs(400, 31 + order, rotatable=True)
    found, (sampled, _, _) = certified(designs, order), dense(designs, order, 16384)
    assert (found["status"] == st.OK).all()
    assert (found["error"] < 1e-8 * found["max"]).all()
    assert (sampled <= found["max"] + found["error"] + 1e-13 * found["max"]).all()
    assert np.median(found["cells"]) < 20


@pytest.mark.parametrize("order", [1, 2, 3])
def test_high_precision_at_the_place_lies_within_the_bound(order):
    designs = np.concatenate([region.designs for region in regions(6, 5)])
    found = certified(designs, order)
    assert (found["status"] == st.OK).all()
    with mp.workdps(40):
        for design, phi, most, error in zip(designs, found["phi"], found["max"], found["error"], strict=True):
            linkage, h = Linkage(*design), mp.mpf(10) ** -14
            exact = mp.diff(lambda x, k=linkage: exact_velocity(k, x), mp.mpf(phi), order - 1, h=h)
            # The place is not quite that of the maximum, which lowers the value by far less than the target.
            assert most - error - 2e-8 * most <= abs(exact) <= most + error


@pytest.mark.parametrize("order", [1, 2, 3])
def test_careless_search_is_corrected(order):
    """The best of 12 samples stands on the wrong peak for many of these designs; the proof climbs the right one."""
    designs = random_designs(4000, 17, rotatable=True)
    value, place, _ = dense(designs, order, 12)
    right, corrected = maxima(designs, order), certify(designs, order, place, value)
    beside = np.abs(np.angle(np.exp(1j * (place - right["phi"])))) > 0.6
    assert beside.sum() > 50
    assert (corrected["status"] == st.OK).all()
    bound = corrected["error"] + right["error"] + 1e-13 * right["max"]
    assert (np.abs(corrected["max"] - right["max"]) <= bound).all()
    assert (corrected["error"] <= 2e-8 * corrected["max"]).all()
    there = poses(designs, corrected["phi"][:, None])[("dpsi", "d2psi", "d3psi")[order - 1]][:, 0]
    np.testing.assert_allclose(np.abs(there), corrected["max"], rtol=1e-8)


def test_second_peak_is_not_proven_to_be_the_highest():
    designs = random_designs(3000, 23, rotatable=True)
    phi = np.arange(720) * (2.0 * np.pi / 720)
    size = np.abs(poses(designs, phi[None, :])["d2psi"])
    peak = (size > np.roll(size, 1, axis=1)) & (size >= np.roll(size, -1, axis=1))
    ranked = np.sort(np.where(peak, size, 0.0), axis=1)
    rows = np.flatnonzero((ranked[:, -2] > 0.5 * ranked[:, -1]) & (ranked[:, -2] < 0.999 * ranked[:, -1]))
    assert rows.size > 100
    second = ranked[rows, -2]
    place = phi[np.argmax(size[rows] == second[:, None], axis=1)]
    found, right = certify(designs[rows], 2, place, second), maxima(designs[rows], 2)
    assert (found["status"] == st.OK).all()
    assert (found["max"] > second).all()
    np.testing.assert_allclose(found["max"], right["max"], rtol=1e-8)


@pytest.mark.parametrize("factor", [0.0, 0.9, 1.0 + 1e-6, 10.0, np.inf])
def test_false_claim_at_the_right_place_is_replaced(factor):
    designs = random_designs(50, 29, rotatable=True)
    right = maxima(designs, 2)
    found = certify(designs, 2, right["phi"], factor * right["max"])
    assert (found["status"] == st.OK).all()
    np.testing.assert_allclose(found["max"], right["max"], rtol=1e-10)


def test_true_claim_is_kept_bit_for_bit():
    designs = random_designs(500, 37, rotatable=True)
    right = maxima(designs, 2, 1e-12)
    found = certify(designs, 2, right["phi"], right["max"], 1e-12)
    assert (found["max"] == right["max"]).all()
    assert (found["phi"] == right["phi"]).all()


@pytest.mark.parametrize("most", [0, 1, 4])
def test_too_few_cells_prove_nothing(most):
    designs = random_designs(20, 41, rotatable=True)
    right = maxima(designs, 2)
    found = certify(designs, 2, right["phi"], right["max"], most=most)
    assert (found["status"] == st.NOT_CONVERGED).all()
    assert (found["max"] == right["max"]).all()
    assert np.isnan(found["error"]).all()


@pytest.mark.parametrize("place", [np.nan, np.inf, -np.inf, 1e300, -7.0, 1e4])
def test_any_place_is_a_beginning(place):
    designs = random_designs(20, 43, rotatable=True)
    right = maxima(designs, 2)
    found = certify(designs, 2, np.full(20, place), right["max"])
    np.testing.assert_allclose(found["max"], right["max"], rtol=1e-8)
    assert (found["status"] == st.OK).all()


def test_designs_that_are_not_ok_are_left_alone():
    designs = random_designs(3, 47, rotatable=True)
    status = np.array([[st.NOT_ROTATABLE, st.UNDECIDABLE, st.INVALID_INPUT]], np.uint8)
    before, value = status.copy(), np.full((1, 3), np.nan)
    certify_maxima(alone(designs), np.array([(2, 1)]), 1e-8, CELLS, status, value, value, value, np.empty(3))
    assert (status == before).all()
    assert np.isnan(value).all()


@pytest.mark.parametrize("order", [1, 2, 3])
def test_hard_regions_are_proven(order):
    for region in regions(40, 13):
        found = certified(region.designs, order)
        assert (found["status"] == st.OK).all(), region.name
        right = maxima(region.designs, order, 1e-10)
        assert (np.abs(found["max"] - right["max"]) <= found["error"] + right["error"]).all(), region.name
        assert found["cells"].max() < 200, region.name


def test_equal_peaks_are_proven():
    """In-line four-bars have two mirrored peaks of |psi'| or |psi''|, equal but for rounding."""
    designs = np.zeros((20, 8))
    designs[:, 7], ratio = 1.0, np.linspace(0.1, 0.7, 20)
    designs[:, 0], designs[:, 2], designs[:, 3] = ratio, 1.0, 1.5
    designs[:, 1] = np.sqrt(1.0 + 1.5**2 - ratio**2)
    for order in (1, 2, 3):
        found = certified(designs, order, 1e-12)
        assert (found["status"] == st.OK).all()
        assert found["cells"].max() < 200


def test_power_of_two_changes_no_bit():
    designs = random_designs(60, 53, rotatable=True)
    larger = designs.copy()
    larger[:, :6] *= 2.0**60
    for order in (1, 2, 3):
        first, second = certified(designs, order), certified(larger, order)
        for name in ("max", "phi", "error", "cells"):
            assert (first[name] == second[name]).all()


def test_compiled_equals_plain():
    designs = random_designs(5, 59, rotatable=True)
    right = maxima(designs, 2)
    compiled = certify(designs, 2, right["phi"], right["max"])
    plain = certify(designs, 2, right["phi"], right["max"], function=certify_maxima.py_func)
    for name, values in compiled.items():
        np.testing.assert_array_equal(plain[name], values)
