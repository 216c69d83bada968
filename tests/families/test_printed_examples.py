"""Worked examples of the sources that do not come out as printed, with what comes out instead (docs/sources.md)."""

from __future__ import annotations

import math

import numpy as np
import pytest

import sweep

DEG = math.pi / 180.0


def slider_cranks(e: float, f: np.ndarray, root: float = 0.0) -> object:
    """Slider-cranks of the example of 3.6: stroke 1, sin alpha = 0.6, S1 = -1.5, phi0 from these."""
    table = {"stroke": 1.0, "s1": -1.5, "e": e, "f": f, "alpha": math.asin(0.6)}
    return sweep.synthesise("rssp", table)


def test_example_3_6_has_other_thresholds_than_printed() -> None:
    # Printed: at most 60 deg down to f = -0.75, at most 30 deg down to f = -0.98.
    f = np.round(np.arange(-2.5, 3.5 + 1e-9, 0.01), 2)
    for e, low, high, least in ((0.4, -0.25, 2.80, 52.8), (1.2, 1.11, 3.5, 57.9)):
        found = slider_cranks(e, f)
        assert math.tan(found["phi0"].dropna().iloc[0]) == pytest.approx(0.5, rel=1e-12)
        good = found[found["status"] == 0]
        angle = np.degrees(good["max_pressure_angle"].to_numpy())
        within = good["f"].to_numpy()[angle <= 60.0]
        # To one step of the grid of 0.01, and the two digits in which the thresholds are stated.
        assert within.min() == pytest.approx(low, abs=0.011) and within.max() == pytest.approx(high, abs=0.011)
        assert angle.min() > 30.0
        assert angle.min() == pytest.approx(least, abs=0.3)
        for printed in (-0.75, -0.98):
            assert printed not in within


def test_geared_dwell_printed_angle_solves_nothing() -> None:
    for k, angle in ((1.41, 25.00), (math.sqrt(2.0), 25.09)):
        cosine = (1.0 / (2.0 * k) + math.sqrt(1.0 / (4.0 * k * k) + 2.0)) / 2.0
        assert cosine * cosine - cosine / (2.0 * k) - 0.5 == pytest.approx(0.0, abs=1e-15)
        assert math.degrees(math.acos(cosine)) == pytest.approx(angle, abs=0.006)
        printed = math.cos(13.5 * DEG)
        assert abs(printed * printed - printed / (2.0 * k) - 0.5) > 0.05


def test_geared_dwell_printed_deviations_are_those_of_the_wrong_angle() -> None:
    table = {"k": [1.41, 1.41], "a": [0.0, 1.5], "phi": [13.5 * DEG, 13.5 * DEG]}
    at_wrong = np.degrees(np.abs(sweep.evaluate("geared_dwell", table, ["psi"])["psi"].to_numpy()))
    np.testing.assert_allclose(at_wrong, [14.12, 4.53], atol=0.006)
    np.testing.assert_allclose(at_wrong, [14.2, 4.5], atol=0.1)  # as printed
    extreme = sweep.summarise("geared_dwell", {"k": table["k"], "a": table["a"]}, ["dwell_deviation"], accuracy=1e-10)
    np.testing.assert_allclose(np.degrees(extreme["dwell_deviation"]), [15.55, 5.63], atol=0.006)
