"""The accuracy study's own instruments: its references against the tables, its regions, its tables in words."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from mpmath import mp, mpf

from kernels.families import rssr
from kernels.families.rssr.single import dense_acceleration_single
from studies.accuracy import marks, oracle, reference, tables
from studies.accuracy.methods import acceleration_methods, swing_methods
from studies.accuracy.regions import margins, regions, rotatable
from sweep.sampling import turn

NAMES = ("a", "b", "c", "e", "f", "g", "alpha", "sigma")
ROWS = [r for r in oracle.read(Path(__file__).parent / "oracle", "rssr") if r["feasible"] and not r["alpha_exact"]]


@pytest.mark.parametrize("row", ROWS[::17], ids=lambda row: f"row {row['id']}")
def test_reference_agrees_with_all_digits_of_the_table(row):
    """Joint coordinates and Taylor arithmetic there, implicit differentiation here."""
    design = np.array([row[name] for name in NAMES], dtype=float)
    found = reference.transfer_functions(design, row["phi"])
    with mp.workdps(40):
        for got, key in zip(found, ("psi", "d1", "d2", "d3"), strict=True):
            assert abs(got - mpf(row[key])) <= mpf(10) ** -23 * abs(mpf(row[key])) * 10
    for got, key in zip(reference.condition(design, row["phi"]), ("psi", "d1", "d2", "d3"), strict=True):
        assert got == pytest.approx(float(row["cond"][key]), rel=2e-3)


@pytest.fixture(scope="module")
def areas():
    return regions(12, 5)


def test_regions_hold_what_they_say(areas):
    angles = {area.name: np.degrees(np.arccos(np.sqrt(margins(area.designs)))) for area in areas}
    assert all(np.isfinite(a).all() and a.size == 12 for a in angles.values())
    assert angles["ordinary"].max() < 60.0 <= angles["60-75"].min() <= angles["60-75"].max() < 75.0
    assert angles["beyond 84"].min() >= 84.0 and angles["change point"].min() > 89.0


def test_reference_of_extrema_is_above_every_sample_and_close(areas):
    for area in areas:
        exact, slower = reference.largest_acceleration(area.designs), reference.extremum(area.designs, "d2psi")
        np.testing.assert_allclose(slower, exact, rtol=1e-5 if area.name == "change point" else 1e-8)
        sampled = acceleration_methods((256,), ())[0].run(area.designs)
        assert (sampled <= exact * (1.0 + 1e-5)).all()


def test_swing_of_the_reference_is_that_of_a_central_four_bar():
    # a^2 + e^2 = b^2 + c^2: the limit positions are half a turn apart and the swing is 2 asin(a / c).
    a, c, e = 0.3, 1.1, 1.4
    design = np.array([[a, math.sqrt(a * a + e * e - c * c), c, e, 0.0, 0.0, 0.0, 1.0]])
    assert reference.swing(design)[0] == pytest.approx(2.0 * math.asin(a / c), abs=1e-14)


def test_every_method_approaches_the_reference(areas):
    ordinary = areas[0].designs
    exact, swing = reference.largest_acceleration(ordinary), reference.swing(ordinary)
    for method in acceleration_methods((512,), (1e-8,)):
        assert np.abs(method.run(ordinary) / exact - 1.0).max() < 1e-3, method.curve
    for method in swing_methods((512,), (1e-8,)):
        assert np.abs(method.run(ordinary) / swing - 1.0).max() < 1e-3, method.curve


def test_even_reference_equals_the_crowded_one_where_nothing_is_sharp():
    designs = rotatable(8, 3)
    designs = np.ascontiguousarray(designs[margins(designs) > 0.05])
    np.testing.assert_allclose(marks.even_reference(designs), reference.largest_acceleration(designs), rtol=1e-12)


def test_single_precision_grid_is_single_precision(areas):
    ordinary, angles = areas[0].designs, turn(360)
    single, least, double = np.empty(12, np.float32), np.empty(12), np.empty(12)
    cos, sin = angles.cos[0].astype(np.float32), angles.sin[0].astype(np.float32)
    dense_acceleration_single(ordinary, cos, sin, single)
    rssr.dense_maxima(ordinary, angles.cos[0], angles.sin[0], least, None, double, None)
    off = np.abs(single / double - 1.0)
    assert 1e-9 < off.max() < 1e-4
    bad = ordinary[:1].copy()
    bad[0, 0] = -1.0
    dense_acceleration_single(bad, cos, sin, single[:1])
    assert np.isnan(single[0])


def test_cheapest_setting_within_the_bound_is_named():
    rows = [
        ("here", "grid", 32, 1e-2, 10.0, 0),
        ("here", "grid", 64, 1e-4, 20.0, 0),
        ("here", "grid", 128, 1e-6, 40.0, 0),
    ]
    rows += [("here", "accuracy=", 1e-8, 1e-9, 5.0, 0), ("there", "grid", 128, 1e-6, 40.0, 3)]
    names = ("region", "method", "setting", "largest_error", "ns_per_design", "unanswered")
    lines = tables.reached_table(pd.DataFrame(rows, columns=list(names)), 1e-3)
    assert lines[2:] == ["| here | N 64: 20 ns, x4 | 1e-08: 5 ns |", "| there | - | - |"]


def test_page_becomes_html_with_tables_and_marks():
    page = "# Title\n\nText with `code` and **no**.\n\n| a | b |\n|---|---|\n| 1 \\| 2 | 3 < 4 |\n"
    body = tables.html_body(page, after="# Title", inserted="<img>")
    assert "<h1>Title</h1>\n<img>" in body
    assert "<td>1 | 2</td><td>3 &lt; 4</td>" in body
    assert "<code>code</code>" in body and "<strong>no</strong>" in body
