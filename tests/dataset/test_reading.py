"""Reading many rows in bounded memory gives what pandas gives on all of them at once."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pandas as pd
import pyarrow.compute as pc
import pytest

import sweep
import sweep.chunks.plan
from sweep.dataset import reading
from sweep.errors import InputError, StoreError
from tests.support.engine_study import SMALL_CHUNKS, write_study


@pytest.fixture(scope="module")
def dataset(tmp_path_factory: pytest.TempPathFactory) -> Path:
    with pytest.MonkeyPatch.context() as patch:
        for name, value in SMALL_CHUNKS.items():
            patch.setattr(sweep.chunks.plan, name, value)
        return sweep.run(
            write_study(tmp_path_factory.mktemp("study"), count=20), tmp_path_factory.mktemp("a") / "designs"
        )


@pytest.fixture(autouse=True)
def small_batches(monkeypatch: pytest.MonkeyPatch) -> None:
    """Several batches in every chunk."""
    monkeypatch.setattr(reading, "BATCH_ROWS", 700)


@pytest.fixture(scope="module")
def rows(dataset: Path) -> pd.DataFrame:
    frame = sweep.load(dataset)
    return frame[frame["status"] == 0].reset_index(drop=True)


def test_scan_reads_the_columns_and_rows_asked_for(dataset: Path, rows: pd.DataFrame) -> None:
    table = sweep.scan(dataset.parent).to_table(columns=["design", "swing"], filter=pc.field("status") == 0)
    pd.testing.assert_frame_equal(table.to_pandas(), rows[["design", "swing"]])


@pytest.mark.parametrize("count", [1, 40, 100_000])
def test_the_best_designs_are_those_of_a_sort_of_all_rows(dataset: Path, rows: pd.DataFrame, count: int) -> None:
    wanted = rows.iloc[np.argsort(rows["max_abs_d2psi"], kind="stable")[:count]].reset_index(drop=True)
    pd.testing.assert_frame_equal(reading.best(dataset, "max_abs_d2psi", count), wanted)
    by_size = rows.iloc[np.argsort(np.abs(rows["swing"]), kind="stable")[:count]].reset_index(drop=True)
    pd.testing.assert_frame_equal(reading.best(dataset, "swing", count), by_size)


def test_no_pareto_row_is_beaten_and_every_other_row_is(dataset: Path, rows: pd.DataFrame) -> None:
    found = reading.pareto(dataset, "max_abs_d2psi", "max_pressure_angle")
    x, y = rows["max_abs_d2psi"].to_numpy(), rows["max_pressure_angle"].to_numpy()
    beaten = [np.any((x <= a) & (y <= b) & ((x < a) | (y < b))) for a, b in zip(x, y, strict=True)]
    wanted = rows[~np.array(beaten)].drop_duplicates(["max_abs_d2psi", "max_pressure_angle"])
    assert len(wanted) > 3
    assert found["design"].tolist() == wanted.sort_values("max_abs_d2psi")["design"].tolist()


def test_histograms_count_every_row_once(dataset: Path, rows: pd.DataFrame) -> None:
    counts, edges = reading.histogram(dataset, "max_abs_d2psi", 37)
    wanted = np.histogram(rows["max_abs_d2psi"], 37)
    np.testing.assert_array_equal(counts, wanted[0])
    np.testing.assert_array_equal(edges, wanted[1])
    counts, _ = reading.histogram(dataset, "swing", 5, ends=(0.1, 0.3))
    np.testing.assert_array_equal(counts, np.histogram(rows["swing"], 5, (0.1, 0.3))[0])


def test_what_cannot_be_read_is_refused_by_name(dataset: Path, tmp_path: Path) -> None:
    with pytest.raises(InputError, match="did you mean 'swing'"):
        reading.best(dataset, "swng")
    with pytest.raises(InputError, match="count = 0"):
        reading.best(dataset, "swing", 0)
    with pytest.raises(InputError, match="bins"):
        reading.histogram(dataset, "swing", 0)
    with pytest.raises(InputError, match="ends"):
        reading.histogram(dataset, "swing", 5, ends=(2.0, 1.0))
    with pytest.raises(InputError, match="folder with part"):
        sweep.scan(tmp_path)
    path = next(dataset.glob("part-000001-*"))
    index = path.name.replace("part-000001", "part-000000")
    (tmp_path / "x").mkdir()
    for part in dataset.glob("part-*"):
        (tmp_path / "x" / part.name).hardlink_to(part)
    (tmp_path / "x" / path.name).rename(tmp_path / "x" / index)
    with pytest.raises(StoreError, match="part-000000"):
        sweep.scan(tmp_path / "x")
