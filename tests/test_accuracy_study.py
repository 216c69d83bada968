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
from studies.accuracy import answer, digits, lookup, marks, oracle, reference, tables
from studies.accuracy.methods import acceleration_methods, swing_methods
from studies.accuracy.regions import margins, regions, rotatable
from sweep.reductions.sampling import turn

NAMES = ("a", "b", "c", "e", "f", "g", "alpha", "sigma")
ROOT = Path(__file__).parents[1]
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
    assert angles["ordinary"].max() < 60.0 <= angles["pressure angle 60-75"].min()
    assert angles["pressure angle 60-75"].max() < 75.0
    assert angles["pressure angle beyond 84"].min() >= 84.0 and angles["change point"].min() > 89.0


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


COLUMNS = ("quantity", "region", "method", "setting", "largest_error", "ns_per_design", "unanswered")


def made_up(
    region, grid=((32, 1e-2, 10.0), (64, 1e-4, 20.0), (128, 1e-6, 40.0)), own=((1e-3, 1e-9, 5.0), (1e-8, 1e-9, 5.0))
):
    """Two curves of a quantity: a grid and the house's own method."""
    rows = [("max_abs_d2psi", region, "grid, float64", *point, 0) for point in grid]
    rows += [("max_abs_d2psi", region, "accuracy=", *point, 0) for point in own]
    return rows + [("max_abs_d2psi", region, "certified, accuracy=", at, error, 20.0 * ns, 0) for at, error, ns in own]


def test_coarsest_setting_within_the_bound_is_named():
    work = pd.DataFrame(
        [*made_up("here"), ("max_abs_d2psi", "there", "grid, float64", 128, 1e-6, 40.0, 3)], columns=COLUMNS
    )
    lines = tables.reached_table(work, 1e-3)
    assert lines[2:] == ["| here | N 64: 20 ns, x 4 | 1e-3: 5 ns | 1e-3: 100 ns, x 20 |", "| there | - | - | - |"]


def test_advice_names_the_cheapest_method_that_keeps_the_bound_everywhere():
    rows = made_up("ordinary") + made_up("long coupler", own=((1e-3, 2e-4, 7.0), (1e-8, 1e-9, 9.0)))
    rows += made_up("change point", grid=((32, 1.0, 10.0),), own=((1e-3, 1e-5, 900.0), (1e-8, 1e-6, 1000.0)))
    work = pd.DataFrame(rows, columns=COLUMNS)
    storage = pd.DataFrame(
        {"dtype": ["float64", "float32"], "bytes_per_row": [80.0, 60.0], "margin": [0.0, 6e-8]}
        | {key: [0.0, 5e-8] for key in ("max_pressure_angle", "max_abs_d2psi")}
    )
    coarse, fine, *_, proof, edge, disk = answer.advice(work.assign(designs=10), storage)
    assert "use `accuracy = 1e-3`. 6 ns a design on average, 7 ns in the dearest region (long coupler)" in coarse
    assert "Next best: grid, float64, N 64, 3.3 times as long." in coarse
    assert "use `accuracy = 1e-8`" in fine and "Nothing else measured" in fine
    assert (
        "140 ns a design on average at `accuracy = 1e-8`, 20 times as long" in proof
        and "0 of 20 proofs failed" in proof
    )
    assert "A grid of 32 is off by 100 %" in edge
    assert "saves 25 % of the bytes and adds 6.0e-08" in disk


def test_one_digit_more_multiplies_the_time_of_a_grid_by_what_was_measured():
    rows = made_up("ordinary", grid=((32, 1e-3, 10.0), (1000, 1e-6, 270.0)))
    lines = answer.answer(pd.DataFrame(rows + made_up("pressure angle beyond 84"), columns=COLUMNS))
    (grid,) = (line for line in lines if "| grid, float64 |" in line)
    assert grid.endswith("| x 3.00 |")
    (own,) = (line for line in lines if "**`accuracy=`**" in line)
    assert own.endswith("| x 1.00 |")
    told = answer.in_short(pd.DataFrame(rows, columns=COLUMNS))
    assert (
        "a plain grid gives 1e-3 for 10 ns, 1e-6 for 270 ns; `accuracy=` gives 1e-3 for 5 ns, 1e-6 for 5 ns a" in told
    )


def test_marks_stand_in_the_page():
    assert "| mark | asked | measured | met |" in (ROOT / "docs" / "accuracy" / "marks.md").read_text()


def test_tables_of_the_turn_give_angles_between_their_samples(areas):
    """Halving the step divides the error of straight lines by 4 and of cubics by 16, through the jump at pi too."""
    designs = areas[0].designs
    phi = np.random.default_rng(2).uniform(0.0, 2.0 * np.pi, (len(designs), 60))
    methods = {(m.curve, m.setting): m.run(designs) for m in lookup.position_methods((128, 256), phi)}
    exact = methods["direct, float64", 1]
    for curve, rate in (("table, straight lines", 4.0), ("table, cubics", 16.0)):
        coarse, fine = (np.sqrt((np.sin(methods[curve, n] - exact) ** 2).mean()) for n in (128, 256))
        assert coarse / fine == pytest.approx(rate, rel=0.15)
    assert np.abs(np.sin(methods["direct, twice float64", 1] - exact)).max() < 1e-14
    assert 1e-8 < np.abs(np.sin(methods["direct, float32", 1] - exact)).max() < 1e-5
    first = [
        reference.angle_error(got, reference.position(d, p))
        for got, d, p in zip(exact[:, 0], designs, phi[:, 0], strict=True)
    ]
    assert max(first) < 1e-14


def test_a_digit_more_costs_the_optimiser_looks_that_can_be_counted():
    history = digits.optimiser_digits(1, 20)
    assert (history["looks"].diff().dropna() >= 0).all() and history["looks"].min() >= 20
    assert history["converged"].iloc[0] == 1
    targets = digits.optimiser_targets(1)
    assert targets["difference_from_finest"].max() < 1e-6


def test_page_becomes_html_with_tables_lists_and_pictures():
    page = "# Title\n\n![what it shows](figures/a.svg)\n\nText with `code` and **no**.\n\n* one\n* two\n\n"
    page += "| a | b |\n|---|---|\n| 1 \\| 2 | 3 < 4 |\n"
    body = tables.html_body(page, {"a.svg": "data:image/svg+xml;base64,AA"})
    assert '<h1>Title</h1>\n<img alt="what it shows" src="data:image/svg+xml;base64,AA">' in body
    assert "<ul><li>one</li><li>two</li></ul>" in body
    assert "<td>1 | 2</td><td>3 &lt; 4</td>" in body
    assert "<code>code</code>" in body and "<strong>no</strong>" in body
