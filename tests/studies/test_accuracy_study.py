"""The accuracy study's own instruments: its references against the tables, its regions, its marks."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest
from mpmath import mp, mpf

from studies.accuracy import marks
from studies.accuracy.regions import margins, regions, rotatable
from sweep.evaluation.summaries import design_outputs
from sweep.families.base import Accuracy
from tests.support import oracle_factors as oracle
from tests.support import sixty_digits
from tests.support.sixty_digits import RSSR

NAMES = ("a", "b", "c", "e", "f", "g", "alpha", "sigma")
ROOT = Path(__file__).parents[2]
ROWS = [r for r in oracle.read(Path(__file__).parents[1] / "oracle", "rssr") if r["feasible"] and not r["alpha_exact"]]


@pytest.mark.parametrize("row", ROWS[::17], ids=lambda row: f"row {row['id']}")
def test_reference_agrees_with_all_digits_of_the_table(row):
    """Joint coordinates and Taylor arithmetic there, implicit differentiation here."""
    design = np.array([row[name] for name in NAMES], dtype=float)
    found = sixty_digits.transfer_functions(design, row["phi"])
    with mp.workdps(40):
        for got, key in zip(found, ("psi", "d1", "d2", "d3"), strict=True):
            assert abs(got - mpf(row[key])) <= mpf(10) ** -23 * abs(mpf(row[key])) * 10
    for got, key in zip(sixty_digits.condition(design, row["phi"]), ("psi", "d1", "d2", "d3"), strict=True):
        assert got == pytest.approx(float(row["cond"][key]), rel=2e-3)


def summary(designs, name, accuracy):
    return np.asarray(design_outputs(RSSR, designs, [name], accuracy)[name], np.float64)


@pytest.fixture(scope="module")
def areas():
    return regions(12, 5)


def test_regions_hold_what_they_say(areas):
    angles = {area.name: np.degrees(np.arccos(np.sqrt(margins(area.designs)))) for area in areas}
    assert all(np.isfinite(a).all() and a.size == 12 for a in angles.values())
    assert angles["ordinary"].max() < 60.0 <= angles["pressure angle 60-75"].min()
    assert angles["pressure angle 60-75"].max() < 75.0
    assert angles["pressure angle beyond 84"].min() >= 84.0 and angles["change point"].min() > 89.0


def test_reference_of_extrema_is_above_every_sample_and_close(areas):
    for area in areas:
        exact, slower = sixty_digits.largest_acceleration(area.designs), sixty_digits.extremum(area.designs, "d2psi")
        np.testing.assert_allclose(slower, exact, rtol=1e-5 if area.name == "change point" else 1e-8)
        sampled = summary(area.designs, "max_abs_d2psi", Accuracy(samples=256))
        assert (sampled <= exact * (1.0 + 1e-5)).all()


def test_swing_of_the_reference_is_that_of_a_central_four_bar():
    # a^2 + e^2 = b^2 + c^2: the limit positions are half a turn apart and the swing is 2 asin(a / c).
    a, c, e = 0.3, 1.1, 1.4
    design = np.array([[a, math.sqrt(a * a + e * e - c * c), c, e, 0.0, 0.0, 0.0, 1.0]])
    assert sixty_digits.swing(design)[0] == pytest.approx(2.0 * math.asin(a / c), abs=1e-14)


@pytest.mark.parametrize("accuracy", [Accuracy(samples=512), Accuracy(target=1e-8)], ids=["grid", "accuracy="])
def test_every_method_approaches_the_reference(areas, accuracy):
    ordinary = areas[0].designs
    exact, swing = sixty_digits.largest_acceleration(ordinary), sixty_digits.swing(ordinary)
    assert np.abs(summary(ordinary, "max_abs_d2psi", accuracy) / exact - 1.0).max() < 1e-3
    assert np.abs(np.abs(summary(ordinary, "swing", accuracy)) / swing - 1.0).max() < 1e-3


def test_even_reference_equals_the_crowded_one_where_nothing_is_sharp():
    designs = rotatable(8, 3)
    designs = np.ascontiguousarray(designs[margins(designs) > 0.05])
    np.testing.assert_allclose(marks.even_reference(designs), sixty_digits.largest_acceleration(designs), rtol=1e-12)


def test_marks_stand_in_the_page():
    assert "| mark | asked | measured | met |" in (ROOT / "docs" / "accuracy" / "marks.md").read_text()
