"""`compare` between two datasets: finds what was changed on purpose, whatever the chunks, and nothing else."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from click.testing import CliRunner

import sweep
import sweep.chunks.plan
from sweep.chunks.chunk import ChunkResult
from sweep.chunks.plan import make_plan
from sweep.cli import main
from sweep.dataset import chunk_files, files
from sweep.errors import InputError, StoreError
from sweep.study import Study, load_study
from tests.support.engine_study import SMALL_CHUNKS, write_study


@pytest.fixture(scope="module")
def study(tmp_path_factory: pytest.TempPathFactory) -> Study:
    return load_study(write_study(tmp_path_factory.mktemp("study"), count=20))


@pytest.fixture(scope="module")
def dataset(study: Study, tmp_path_factory: pytest.TempPathFactory) -> Path:
    with pytest.MonkeyPatch.context() as patch:
        for name, value in SMALL_CHUNKS.items():
            patch.setattr(sweep.chunks.plan, name, value)
        return sweep.run(study, tmp_path_factory.mktemp("old") / "designs")


def written(study: Study, rows: pd.DataFrame, folder: Path, chunk_size: int = 3000) -> Path:
    """A dataset of these rows, cut differently."""
    plan = make_plan(study, chunk_size)
    folder.mkdir()
    for index in range(plan.chunks):
        start, stop = plan.bounds(index)
        part = rows[(rows["design"] >= start) & (rows["design"] < stop)]
        columns = {c.name: part[c.name].to_numpy().astype(c.dtype) for c in plan.columns}
        chunk_files.write_chunk(folder, plan, index, ChunkResult(columns, {0: len(part)}, {}))
    about = {"optimise": False, "complete": True}
    files.write_plan(folder, plan.as_dict() | about)
    return folder


def ended(folder: Path, seconds: float, outcome: str = "complete") -> None:
    files.append_run(folder, {"event": "end", "outcome": outcome, "seconds": seconds})


def shell(*arguments: object) -> tuple[int, str]:
    result = CliRunner().invoke(main, ["compare", *(str(a) for a in arguments)])
    return result.exit_code, result.output


def test_the_same_rows_in_other_chunks_are_the_same(study: Study, dataset: Path, tmp_path: Path) -> None:
    other = written(study, sweep.load(dataset), tmp_path / "new")
    found = sweep.compare(dataset, other)
    assert (found.rows, found.exit_code) == (study.space.count, 0)
    assert shell(dataset, other)[0] == 0 and "no value changed" in shell(dataset, other)[1]


def test_a_changed_value_is_found_with_its_size_and_design(study: Study, dataset: Path, tmp_path: Path) -> None:
    rows = sweep.load(dataset)
    chosen = rows.index[rows["status"] == 0][[5, 50]]
    before = rows.loc[chosen, "swing"].to_numpy()
    rows.loc[chosen, "swing"] = before * [1.0 + 1e-6, 1.0 - 1e-3]
    other = written(study, rows, tmp_path / "new")
    found = sweep.compare(dataset, other)
    assert found.exit_code == 10 and found.values_changed and not found.rows_changed
    assert [name for name, moved in found.moved.items() if moved.changed] == ["swing"]
    swing = found.moved["swing"]
    assert (swing.changed, swing.where) == (2, f"design {rows['design'][chosen[1]]}")
    assert swing.relative == pytest.approx(1e-3, rel=1e-6)
    assert swing.absolute == pytest.approx(1e-3 * abs(before[1]), rel=1e-6)
    assert sweep.compare(dataset, other, rtol=1e-5).moved["swing"].changed == 1
    assert sweep.compare(dataset, other, rtol=2e-3).exit_code == 0
    code, text = shell(dataset, other)
    assert code == 10 and "swing: 2 values changed, at most by" in text


@pytest.mark.parametrize("rtol", [0.0, 1e-6])
@pytest.mark.filterwarnings("error")
def test_a_value_that_became_infinite_is_found(study: Study, dataset: Path, tmp_path: Path, rtol: float) -> None:
    rows = sweep.load(dataset)
    row = rows.index[rows["status"] == 0][7]
    rows.loc[row, "swing"] = np.inf
    other = written(study, rows, tmp_path / "new")
    found = sweep.compare(dataset, other, rtol)
    swing = found.moved["swing"]
    assert (found.exit_code, swing.changed, swing.absolute, swing.relative) == (10, 1, np.inf, np.inf)
    assert swing.where == f"design {rows['design'][row]}"
    assert sweep.compare(other, other, rtol).exit_code == 0


@pytest.mark.parametrize("change", ["nan", "status", "old only", "new only"])
def test_changed_rows_are_found(study: Study, dataset: Path, tmp_path: Path, change: str) -> None:
    rows = sweep.load(dataset)
    row = rows.index[rows["status"] == 0][7]
    full, old = rows.copy(), dataset
    if change == "nan":
        rows.loc[row, "swing"] = np.nan
    elif change == "status":
        rows.loc[row, "status"] = 4
    else:
        rows = rows.drop(row)
    new = written(study, rows, tmp_path / "new")
    if change == "new only":
        old, new = new, written(study, full, tmp_path / "full")
    found = sweep.compare(old, new)
    assert found.exit_code == 11 and shell(old, new)[0] == 11
    counts = {
        "nan": found.moved["swing"].missing,
        "status": found.status_changed,
        "old only": found.only_old,
        "new only": found.only_new,
    }
    assert counts == dict.fromkeys(counts, 0) | {change: 1}


def test_a_slower_run_ends_with_12_a_short_or_unfinished_one_does_not(
    study: Study, dataset: Path, tmp_path: Path
) -> None:
    rows = sweep.load(dataset)
    old, new = written(study, rows, tmp_path / "old"), written(study, rows, tmp_path / "new")
    assert sweep.compare(old, new).seconds is None
    ended(old, 10.0)
    ended(new, 4.0, "Interrupted")
    assert sweep.compare(old, new).seconds is None
    ended(new, 12.0)
    found = sweep.compare(old, new)
    assert (found.seconds, found.exit_code) == ((10.0, 16.0), 12)
    assert shell(old, new)[0] == 12 and shell(old, new, "--slower", 2)[0] == 0
    short, long = written(study, rows, tmp_path / "short"), written(study, rows, tmp_path / "long")
    ended(short, 0.1)
    ended(long, 4.0)
    assert sweep.compare(short, long).exit_code == 0


def test_optima_are_compared(study: Study, dataset: Path, tmp_path: Path) -> None:
    rows = sweep.load(dataset)
    old, new = written(study, rows, tmp_path / "old"), written(study, rows, tmp_path / "new")
    optimum = pd.DataFrame({"role": ["optimum", "start", "reference"], "swing": [1.0, 2.0, 3.0], "x": [0.0, 0.0, 0.0]})
    optimum.to_parquet(files.beside(old) / files.OPTIMUM)
    optimum.assign(swing=[1.5, 9.0, 3.0]).to_parquet(files.beside(new) / files.OPTIMUM)
    found = sweep.compare(old, new)
    assert [name for name, moved in found.moved.items() if moved.changed] == ["swing of the optimum"]
    assert found.exit_code == 10 and found.moved["swing of the optimum"].absolute == 0.5


def test_an_optimum_that_no_longer_keeps_its_limits_is_found(study: Study, dataset: Path, tmp_path: Path) -> None:
    rows = sweep.load(dataset)
    old, new = (written(study, rows, tmp_path / name) for name in ("old", "new"))
    optimum = pd.DataFrame({"role": ["optimum", "reference"], "swing": [1.0, 3.0], "status": [0, 0]})
    optimum.to_parquet(files.beside(old) / files.OPTIMUM)
    optimum.assign(status=[5, 0]).to_parquet(files.beside(new) / files.OPTIMUM)
    found = sweep.compare(old, new)
    words = "status of the optimum: 0 (ok) before, 5 (a limit of the study is exceeded) now"
    assert found.exit_code == 11 and words in found.lines()


def test_other_code_another_study_and_an_unfinished_one_are_said(study: Study, dataset: Path, tmp_path: Path) -> None:
    other = written(study, sweep.load(dataset), tmp_path / "new")
    files.write_plan(other, (files.read_plan(other) or {}) | {"code": "x", "study": "y", "complete": False})
    text = "\n".join(sweep.compare(dataset, other).lines())
    assert f"{other}: not complete" in text and "the studies differ" in text and "different versions" in text


def test_rows_of_two_studies_that_are_other_designs_are_said(study: Study, dataset: Path, tmp_path: Path) -> None:
    rows = sweep.load(dataset)
    same, other = (written(study, rows.assign(a=rows["a"] * by), tmp_path / f"by{by}") for by in (1.0, 1.5))
    assert "designs differ" not in "\n".join(sweep.compare(dataset, other).lines())  # of one study: values changed
    for folder in (same, other):
        files.write_plan(folder, (files.read_plan(folder) or {}) | {"study": "y"})
    assert "designs differ" not in "\n".join(sweep.compare(dataset, same).lines())
    data = (files.read_plan(other) or {})["chunk_data"]
    longer = data | {"design": data["design"] | {"b": data["design"]["b"] | {"to": 160}}}
    files.write_plan(other, (files.read_plan(other) or {}) | {"study": "z", "chunk_data": longer})
    (said,) = [line for line in sweep.compare(dataset, other).lines() if line.startswith("the studies differ in what")]
    assert said.endswith(": design.b.to 150 -> 160 mm")
    assert any("the designs differ in a: rows are" in line for line in sweep.compare(dataset, other).lines())
    plan = files.read_plan(other) or {}
    files.write_plan(other, plan | {"data": {"mechanism": {"chain": ["rssr", "guide"]}}})
    lines = sweep.compare(dataset, other).lines()
    assert lines[0] == "two studies of different mechanisms, rssr and rssr+guide: no row is comparable"
    assert not any("designs differ" in line or "changed" in line or "in both" in line for line in lines)


def test_a_damaged_chunk_is_refused(study: Study, dataset: Path, tmp_path: Path) -> None:
    other = written(study, sweep.load(dataset), tmp_path / "new")
    part = sorted(other.glob("part-*"))[1]
    part.write_bytes(part.read_bytes().replace(b"swing", b"sving"))
    with pytest.raises(StoreError, match="damaged chunk"):
        sweep.compare(dataset, other)


def test_bad_arguments_are_refused(dataset: Path, tmp_path: Path) -> None:
    with pytest.raises(InputError, match="folder with part"):
        sweep.compare(dataset, tmp_path)
    for wrong in ({"rtol": -1.0}, {"slower": 0.5}, {"rtol": float("nan")}):
        with pytest.raises(InputError, match=next(iter(wrong))):
            sweep.compare(dataset, dataset, **wrong)


def test_it_needs_no_more_memory_for_more_chunks(study: Study, dataset: Path, tmp_path: Path) -> None:
    """A chunk at a time: what was read and compared is let go."""
    from sweep.dataset.comparison import _columns, _rows

    chunks = chunk_files.parts(dataset)
    stops = [chunk_files.about(part)["stop"] for part in chunks]
    sizes = [len(rows) for rows in _rows(chunks, _columns(chunks), stops)]
    assert sum(sizes) == study.space.count and max(sizes) == SMALL_CHUNKS["CHUNK_STEP"]
