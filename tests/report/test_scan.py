"""One pass over the parts against plain pandas over everything at once."""

from __future__ import annotations

import math
from itertools import pairwise
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from hypothesis import given, settings
from hypothesis import strategies as some

from sweep.dataset import chunk_files
from sweep.dataset.reading import non_dominated
from sweep.report import scan as module
from sweep.report.scan import Cells, most_telling, scan

X = np.linspace(0.0, 1.0, 11)
Y = np.geomspace(1.0, 100.0, 9)


@pytest.fixture
def parts(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> tuple[list[Path], pd.DataFrame]:
    """A lattice of three axes in three files of unequal length, read in batches that end inside a file."""
    monkeypatch.setattr(chunk_files, "ROWS_PER_BATCH", 700)
    rng = np.random.default_rng(5)
    lattice = np.stack(np.meshgrid(X, Y, np.arange(40.0), indexing="ij"), axis=-1).reshape(-1, 3)
    table = pd.DataFrame(lattice, columns=["x", "y", "z"])
    table["stroke"] = -(1.0 + (table.x - 0.3) ** 2 + np.log(table.y) ** 2 + 0.01 * rng.random(len(table)))
    table["err_stroke"] = 1e-9 * rng.random(len(table))
    table["other"] = rng.random(len(table)).astype(np.float32)
    table["status"] = rng.choice(np.array([0, 0, 0, 3, 5], np.uint8), len(table))
    table.loc[table.status != 0, ["stroke", "other"]] = np.nan
    files = []
    for k, (start, stop) in enumerate(pairwise([0, 1500, 1600, len(table)])):
        files.append(tmp_path / f"part-{k}.parquet")
        table.iloc[start:stop].to_parquet(files[-1], index=False)
    return files, table


def test_cells_counts_and_best_agree_with_pandas(parts: tuple[list[Path], pd.DataFrame]) -> None:
    files, table = parts
    cells = [Cells.of_values("x", X, 99), Cells.of_values("y", Y, 4)]
    found = scan(files, cells, "stroke", "other")
    good = table[table.status == 0]
    assert found.rows == len(table)
    assert found.feasible == len(good)
    # nine values in four cells: 2, 2, 2, 3
    group = np.searchsorted([2, 4, 6], np.searchsorted(Y, good.y), side="right")
    groups = good.stroke.abs().groupby([group, good.x])
    np.testing.assert_array_equal(found.grids["x", "y"].best, groups.min().unstack().to_numpy())
    np.testing.assert_array_equal(found.grids["x", "y"].count, groups.size().unstack().to_numpy())
    np.testing.assert_array_equal(found.lines["x"].best, good.stroke.abs().groupby(good.x).min())
    best = good.loc[good.stroke.abs().idxmin()]
    assert found.best_row == {name: float(best[name]) for name in table.columns}
    relative = (good.err_stroke / good.stroke.abs()).max()
    assert found.errors["err_stroke"] == (good.err_stroke.max(), relative)


def test_front_and_scatter_come_from_all_parts(parts: tuple[list[Path], pd.DataFrame]) -> None:
    files, table = parts
    found = scan(files, [Cells.of_values("x", X, 99)], "stroke", "other")
    points = table.loc[table.status == 0, ["stroke", "other"]].abs().to_numpy(float)
    np.testing.assert_array_equal(found.front, naive_front(points))
    np.testing.assert_array_equal(found.scatter, points)


def test_scatter_is_thinned_evenly(parts: tuple[list[Path], pd.DataFrame], monkeypatch: pytest.MonkeyPatch) -> None:
    files, table = parts
    monkeypatch.setattr(module, "SCATTER_POINTS", 400)
    found = scan(files, [], "stroke", "other", total=len(table))
    taken = table.iloc[:: len(table) // 400]
    expected = taken.loc[taken.status == 0, ["stroke", "other"]].abs().to_numpy(float)
    np.testing.assert_array_equal(found.scatter, expected)


def test_without_objective_the_feasible_are_counted(parts: tuple[list[Path], pd.DataFrame]) -> None:
    files, table = parts
    found = scan(files, [Cells.of_values("x", X, 99)], None, None)
    assert found.feasible == found.lines["x"].count.sum() == (table.status == 0).sum()
    assert not len(found.front)


def test_most_telling_axes_are_those_the_objective_depends_on(parts: tuple[list[Path], pd.DataFrame]) -> None:
    files, _ = parts
    cells = [Cells.of_values("z", np.arange(40.0), 8), Cells.of_values("x", X, 99), Cells.of_values("y", Y, 99)]
    assert most_telling(scan(files, cells, "stroke", "other")) == ("x", "y")


@settings(deadline=None, max_examples=50)
@given(some.lists(some.tuples(some.integers(0, 8), some.integers(0, 8)), max_size=40))
def test_front_is_what_no_point_beats(points: list[tuple[int, int]]) -> None:
    array = np.array(points, dtype=float).reshape(-1, 2)
    np.testing.assert_array_equal(array[non_dominated(*array.T)], naive_front(array))


@settings(deadline=None, max_examples=50)
@given(some.lists(some.floats(-1e6, 1e6), min_size=2, max_size=30, unique=True), some.integers(1, 40))
def test_every_value_of_a_lattice_axis_lies_in_one_cell(values: list[float], most: int) -> None:
    axis = np.array(values)
    if np.diff(np.unique(axis)).min() < 1e-9 * np.abs(axis).max():
        return
    cells = Cells.of_values("x", axis, most)
    counts = np.bincount(cells.index(axis), minlength=cells.weights.size)
    assert len(cells.weights) == min(most, axis.size)
    np.testing.assert_allclose(cells.weights * axis.size, counts, rtol=1e-12)


def naive_front(points: np.ndarray) -> np.ndarray:
    """Points that none other equals or beats in both coordinates; one of equal ones."""
    unique = np.unique(points, axis=0)
    kept = [p for p in unique if not any((q <= p).all() and (q != p).any() for q in unique)]
    return np.array(kept).reshape(-1, 2)


def test_an_angle_comes_back_into_a_whole_turn_only() -> None:
    whole = Cells.of_range("offset2", -math.pi, math.pi, 8)
    assert whole.placed(math.radians(318.9)) == pytest.approx(math.radians(-41.1))
    assert Cells.of_range("alpha", 0.0, 1.5, 8).placed(5.0) == 5.0
