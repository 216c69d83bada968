"""Fits: constants of the thread from measured tensions, an eyelet for a wanted P(phi).

Data made by the law itself must give the constants back to rounding; noise of known size must be covered by the
intervals as often as they promise.
"""

from __future__ import annotations

import numpy as np
import pytest

import sweep
from sweep.synthesis.take_up import fit_eyelet
from sweep.synthesis.thread_constants import fit_contour, fit_speed

RADII, WRAPS = np.repeat([0.125, 0.25, 0.5, 1.0, 2.0, 4.0, 7.5], 3), np.tile([45.0, 90.0, 180.0], 7)
TRUE = {"alpha": 8e-3, "beta": 0.9e-2, "B": 1.1}
EYELET = {"a": 20.0, "e": 30.0, "f": 10.0, "alpha": 0.5, "Z1": -30.0, "Z2": 40.0, "phi_h": 0.4}
PHI = np.linspace(0.0, 2.0 * np.pi, 40, endpoint=False)


def measured(**changed):
    table = {"T1": np.full(21, 5.0), "R": RADII, "theta_deg": WRAPS}
    return table | {"T2": sweep.thread.contour(table | TRUE)["T2"].to_numpy()} | changed


def wanted(**changed):
    return sweep.evaluate("eyelet", EYELET | changed, ["P"], phi=PHI).P.to_numpy()


def test_constants_of_the_contour_come_back_from_the_law():
    fit = fit_contour(measured())
    for name, value in TRUE.items():
        assert fit.values[name] == pytest.approx(value, rel=1e-10)
    assert fit.residual < 1e-14
    assert fit.undetermined == ()


def test_intervals_cover_the_true_constants_as_often_as_they_promise():
    rng, inside = np.random.default_rng(5), np.zeros(3)
    exact = measured()
    for _ in range(200):
        noisy = exact | {"T2": exact["T2"] * (1.0 + 0.01 * rng.standard_normal(21))}
        found = fit_contour(noisy, confidence=0.9).constants
        inside += (found.low < list(TRUE.values())) & (found.high > list(TRUE.values()))
    # 180 expected of 200; four standard deviations of a binomial are 17.
    assert (np.abs(inside - 180.0) <= 17.0).all()


def test_constants_that_the_measurements_do_not_tell_apart_are_named():
    # At one radius bending and adhesion enter alike.
    table = {name: x[6:12] for name, x in measured().items()} | {"R": 1.0, "T1": np.linspace(2.0, 9.0, 6)}
    table["T2"] = sweep.thread.contour({**table, **TRUE})["T2"].to_numpy()
    fit = fit_contour(table)
    assert fit.undetermined == ("alpha", "B")
    assert np.isinf(fit.constants.loc["B", "high"])
    assert fit.values["beta"] == pytest.approx(TRUE["beta"], rel=1e-6)


def test_law_of_speed_through_the_reported_points_has_the_default_constants():
    fit = fit_speed({"v": [0.08, 1.23, 7.4], "ratio_to_ref": [1.0 / 1.19, 1.0, 1.16]})
    assert fit.values["K"] == pytest.approx(0.394948588495272, rel=1e-12)
    assert fit.values["n"] == pytest.approx(0.189538228897548, rel=1e-12)


def test_too_few_measurements_are_refused():
    with pytest.raises(sweep.InputError, match="at least 3, one per constant"):
        fit_contour({"T1": [1.0, 2.0], "T2": 3.0, "R": 1.0, "theta_deg": 90.0})
    with pytest.raises(sweep.InputError, match="between 0 and 1"):
        fit_contour(measured(), confidence=95.0)


def test_eyelet_comes_back_from_its_own_thread_when_one_length_is_given():
    starts = {name: [1.1 * value, 0.9 * value] for name, value in EYELET.items()} | {"e": 30.0}
    fit = fit_eyelet(PHI, wanted(), starts, fixed=("e",))
    assert fit.designs.rms[0] < 1e-11
    assert fit.designs.undetermined[0] == ""
    for name, value in EYELET.items():
        assert fit.best[name] == pytest.approx(value, rel=1e-8)
    # P_h is what makes the constant of the wanted P vanish.
    again = sweep.evaluate("eyelet", fit.best, ["P"], phi=PHI).P
    np.testing.assert_allclose(again, wanted(), atol=1e-10)


def test_seven_parameters_of_the_eyelet_stand_in_six_combinations():
    starts = {name: [1.1 * value + 0.05, value] for name, value in EYELET.items()}
    fit = fit_eyelet(PHI, wanted(), starts)
    assert (fit.designs.rms < 1e-11).all()
    assert list(fit.designs.undetermined) == ["a,e,alpha,Z1,Z2"] * 2
    first, second = fit.designs.iloc[0], fit.designs.iloc[1]
    assert abs(first.a - second.a) > 1.0  # another eyelet for the same thread
    for one in (first, second):
        # a e, a sin(alpha) Z1, a sin(alpha) Z2 and both constants are equal.
        assert one.a * one.e == pytest.approx(600.0, rel=1e-9)
        assert one.a * np.sin(one.alpha) * one.Z1 == pytest.approx(-600.0 * np.sin(0.5), rel=1e-9)
        for z in ("Z1", "Z2"):
            constant = one.a**2 + one.e**2 + one.f**2 + one[z] ** 2 - 2.0 * one.f * one[z] * np.cos(one.alpha)
            true = 400.0 + 900.0 + 100.0 + EYELET[z] ** 2 - 20.0 * EYELET[z] * np.cos(0.5)
            assert constant == pytest.approx(true, rel=1e-9)


def test_place_along_parallel_axes_is_named_as_undetermined():
    starts = {name: [1.05 * value] for name, value in EYELET.items()} | {"alpha": 0.0, "e": 30.0}
    fit = fit_eyelet(PHI, wanted(alpha=0.0), starts, fixed=("alpha", "e"))
    assert fit.designs.rms[0] < 1e-11
    assert fit.designs.undetermined[0] == "f,Z1,Z2"
    settled = fit_eyelet(PHI, wanted(alpha=0.0), starts | {"f": 10.0}, fixed=("alpha", "e", "f"))
    assert settled.designs.undetermined[0] == ""
    assert settled.best["Z1"] == pytest.approx(-30.0, rel=1e-7) or settled.best["Z1"] == pytest.approx(50.0, rel=1e-7)


def test_best_fit_of_a_thread_no_eyelet_takes_up_has_no_better_neighbour():
    target = 8.0 * np.cos(PHI) + 3.0 * np.sin(PHI) + 2.0 * np.cos(3.0 * PHI)
    fit = fit_eyelet(PHI, target, {name: [value] for name, value in EYELET.items()}, fixed=("e",))
    rms = fit.designs.rms[0]
    assert rms > 0.1

    def error(design):
        left = sweep.evaluate("eyelet", design, ["P"], phi=PHI).P - target
        return float(np.sqrt(np.mean((left - left.mean()) ** 2)))

    assert error(fit.best) == pytest.approx(rms, rel=1e-12)
    for name in ("a", "f", "alpha", "Z1", "Z2", "phi_h"):
        for step in (1e-3, -1e-3):
            assert error(fit.best | {name: fit.best[name] + step}) >= rms * (1.0 - 1e-9)


@pytest.mark.parametrize(
    ("changed", "message"),
    [
        ({"fixed": ("b",)}, "fixed = 'b'"),
        ({"fixed": ("a", "e", "f", "alpha", "Z1", "Z2", "phi_h")}, "not all of a, e"),
        ({"weights": -np.ones(40)}, "weights"),
        ({"P": np.where(PHI > 1.0, np.nan, 0.0)}, "P = nan"),
        ({"phi": np.where(PHI > 1.0, np.inf, PHI)}, "phi = inf"),
        ({"P": np.zeros(3)}, "as many values as phi, 40"),
        ({"phi": PHI[:5], "P": np.zeros(5)}, "more than the 7 unknowns"),
    ],
)
def test_unusable_wanted_points_are_refused(changed, message):
    given = {"phi": PHI, "P": wanted(), "starts": EYELET} | changed
    with pytest.raises(sweep.InputError, match=message):
        fit_eyelet(**given)
