"""The minimax line fit against a linear programme, and its limits.

Tolerance: the linear programme's own feasibility and optimality tolerances are 1e-7, which its solution's size
multiplies; the exchange must agree to that.
"""

from __future__ import annotations

import numpy as np
import pytest

from kernels import status as st
from kernels.linear.line_fit import Straightest, line_fit
from tests.reference.line_fit import fourbar, straightest

LP_TOLERANCE = 1e-7


def fit(pins, pins2, lam, window=(0.0, 1.0), free=False, function=line_fit):
    n = len(pins)
    out = [np.empty(n) for _ in range(5)]
    status = np.empty(n, np.uint8)
    lam = np.array(np.broadcast_to(lam, n), dtype=float)
    parts = [np.ascontiguousarray(part) for part in (pins.real, pins.imag, pins2.real, pins2.imag)]
    function(*parts, np.array(window, dtype=float), lam, free, Straightest(*out, status))
    return dict(zip(("xi", "eta", "h", "deviation", "travel"), out, strict=True)) | {"lam": lam, "status": status}


def random_fourbars(count, samples=48, turn=50.0, seed=1):
    rng = np.random.default_rng(seed)
    pins, pins2 = [], []
    while len(pins) < count:
        a, b, c, e = 1.0, *rng.uniform(1, 4, 3)
        angles = rng.uniform(0, 2 * np.pi) + np.radians(np.linspace(0, turn, samples))
        crank, rocker = fourbar(a, b, c, e, rng.choice([-1, 1]), angles)
        if np.isfinite(rocker).all():
            pins.append(crank)
            pins2.append(rocker)
    return np.array(pins), np.array(pins2)


def deviation(pin, pin2, xi, eta, lam, h):
    point = pin + (xi + 1j * eta) * (pin2 - pin) / abs(pin2 - pin)
    return (point * np.exp(-1j * lam)).imag - h, (point * np.exp(-1j * lam)).real


def test_deviation_equals_linear_programme_for_given_direction():
    pins, pins2 = random_fourbars(60)
    lam = np.random.default_rng(2).uniform(0, 2 * np.pi, 60)
    got = fit(pins, pins2, lam)
    best = np.array([straightest(pins[i], pins2[i], lam[i]) for i in range(60)])
    assert np.all(got["status"] == st.OK)
    tolerance = LP_TOLERANCE * (1.0 + abs(got["xi"]) + abs(got["eta"]) + abs(got["h"]))
    assert np.all(got["deviation"] <= best + tolerance)
    assert np.all(got["deviation"] >= best - tolerance)


@pytest.mark.parametrize("turn", [5.0, 15.0, 30.0])
def test_points_that_run_straight_to_rounding_are_found(turn):
    """The residuals of the best point are all rounding then; the exchange took that for points left to be exchanged."""
    pins, pins2 = random_fourbars(400, turn=turn, seed=5)
    got = fit(pins, pins2, 0.3, free=True)
    assert np.all(got["status"] == st.OK)
    for i in range(400):
        across, _ = deviation(pins[i], pins2[i], *(got[k][i] for k in ("xi", "eta", "lam", "h")))
        rounding = 1e-14 * (1.0 + abs(got["xi"][i]) + abs(got["eta"][i]) + abs(got["h"][i]))
        # a best point of three unknowns is as far off at four places
        assert np.count_nonzero(abs(across) >= got["deviation"][i] * (1.0 - 2e-9) - rounding) >= 4


def test_neighbours_among_the_four_extreme_points_do_not_exchange_themselves():
    """Neighbouring samples decide some lines; the exchange put one of two in place of itself until it gave up.

    Rounding decided that, and so the size of the same linkages did.
    """
    pins, pins2 = random_fourbars(400, turn=30.0, seed=5)
    got, large = fit(pins, pins2, 0.3), fit(1e3 * pins, 1e3 * pins2, 0.3)
    assert np.all(got["status"] == st.OK) and np.all(large["status"] == st.OK)
    size = 1.0 + abs(got["xi"]) + abs(got["eta"]) + abs(got["h"])
    # The exchange stops within 1e-9 of the least deviation, and neighbours lose seven digits of the point's equations.
    assert np.all(abs(1e-3 * large["deviation"] - got["deviation"]) <= 3e-9 * got["deviation"] + 1e-14 * size)
    for i in range(400):
        across, _ = deviation(pins[i], pins2[i], *(got[k][i] for k in ("xi", "eta", "lam", "h")))
        assert np.count_nonzero(abs(across) >= got["deviation"][i] * (1.0 - 3e-9) - 1e-14 * size[i]) >= 4


def test_returned_point_has_the_returned_deviation_and_travel():
    pins, pins2 = random_fourbars(40)
    got = fit(pins, pins2, 0.3, free=True)
    for i in range(40):
        across, along = deviation(pins[i], pins2[i], *(got[k][i] for k in ("xi", "eta", "lam", "h")))
        # Both sides are sums of a few products of numbers up to a few hundred.
        assert abs(across).max() == pytest.approx(got["deviation"][i], abs=1e-12)
        assert np.ptp(along) == pytest.approx(got["travel"][i], rel=1e-12)


def test_free_direction_is_near_the_given_one_and_not_worse_than_neighbours_in_least_squares():
    pins, pins2 = random_fourbars(40, seed=3)
    free = fit(pins, pins2, 2.0, free=True)
    assert np.all(np.cos(free["lam"] - 2.0) >= 0.0)
    for turn in (-0.02, 0.02):
        turned = fit(pins, pins2, free["lam"] + turn)
        # The direction is the least-squares one, the deviation is minimax: allow the factor between the two norms.
        assert np.median(turned["deviation"] / free["deviation"]) > 1.0


def test_window_keeps_only_the_lower_part_and_is_straighter():
    pins, pins2 = random_fourbars(40, seed=4)
    whole = fit(pins, pins2, 1.0, free=True)
    lower = fit(pins, pins2, whole["lam"], window=(0.0, 0.6))
    assert np.mean(lower["deviation"] <= whole["deviation"] + LP_TOLERANCE) > 0.9


def test_chebyshev_lambda_tracer_is_found():
    """Coupler = rocker = 2.5 of the lambda linkage 1 : 2 : 2.5 : 2.5; its tracer sits at twice the coupler."""
    angles = np.pi + np.linspace(-np.pi / 2, np.pi / 2, 721)
    pin, pin2 = fourbar(1.0, 2.5, 2.5, 2.0, 1, angles)
    got = fit(pin[None], pin2[None], 0.0, free=False)
    # Half of the published band 0.009753733 of the classic tracer; the best point must not be worse.
    assert got["deviation"][0] <= 0.5 * 0.009753734
    assert got["xi"][0] == pytest.approx(5.0, rel=0.02)
    assert got["eta"][0] == pytest.approx(0.0, abs=0.05)


def test_compiled_equals_plain():
    pins, pins2 = random_fourbars(5, samples=24, seed=5)
    compiled = fit(pins, pins2, 0.5, window=(0.0, 0.7), free=True)
    plain = fit(pins, pins2, 0.5, window=(0.0, 0.7), free=True, function=line_fit.py_func)
    for name in compiled:
        np.testing.assert_allclose(compiled[name], plain[name], rtol=1e-9, atol=1e-12)


def test_unassembled_position_is_reported_not_fitted():
    pins, pins2 = random_fourbars(3)
    pins2[1, 7] = np.nan
    got = fit(pins, pins2, 0.0)
    assert got["status"].tolist()[1] == st.NOT_ASSEMBLED
    assert np.isnan(got["deviation"][1])
    assert np.isfinite(got["deviation"][[0, 2]]).all()


@pytest.mark.parametrize("window", [(0.0, 0.6), (0.2, 0.8)])
def test_free_line_of_a_window_is_nearly_as_straight_as_the_best_of_many_directions(window):
    """Against 180 prescribed directions; the direction of the whole travel gave 1.26 and more in the median."""
    pins, pins2 = random_fourbars(200, seed=6)
    free = fit(pins, pins2, 0.3, window, free=True)
    assert np.all(np.cos(free["lam"] - 0.3) >= 0.0)
    best = np.full(len(pins), np.inf)
    for lam in np.linspace(0.0, np.pi, 180, endpoint=False):
        some = fit(pins, pins2, lam, window)
        best = np.fmin(best, np.where(some["status"] == st.OK, some["deviation"] / some["travel"], np.inf))
    ratio = (free["deviation"] / free["travel"] / best)[free["status"] == st.OK]
    assert len(ratio) > 190
    assert np.median(ratio) < 1.1
