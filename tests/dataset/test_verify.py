"""`verify`: names what was damaged on purpose, says what a run does about it, and a run then does that."""

from __future__ import annotations

import json
import shutil
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner

import sweep
import sweep.chunks.plan
from sweep.chunks.chunk import ChunkResult
from sweep.chunks.plan import make_plan
from sweep.cli import main
from sweep.dataset import chunk_files, files
from sweep.dataset.verification import DAMAGED, INCOMPLETE, spread
from sweep.errors import InputError
from sweep.study import load_study
from tests.support.engine_study import SMALL_CHUNKS, chunk_bytes, write_study
from tests.support.selection import mostly_long


@pytest.fixture(autouse=True)
def small_chunks(monkeypatch: pytest.MonkeyPatch) -> None:
    for name, value in SMALL_CHUNKS.items():
        monkeypatch.setattr(sweep.chunks.plan, name, value)


@pytest.fixture(scope="module", params=mostly_long(["all", "feasible"], ["feasible"]))
def whole(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Path]:
    """A study of 10240 designs in three chunks, and its dataset."""
    place = tmp_path_factory.mktemp(request.param)
    path = write_study(place / "study", keep=request.param, count=20)
    with pytest.MonkeyPatch.context() as patch:
        for name, value in SMALL_CHUNKS.items():
            patch.setattr(sweep.chunks.plan, name, value)
        return path, sweep.run(path, place / "data" / "designs")


@pytest.fixture
def dataset(whole: tuple[Path, Path], tmp_path: Path) -> Path:
    shutil.copytree(whole[1].parent, tmp_path / "data")
    return tmp_path / "data" / "designs"


def chunk(folder: Path, index: int) -> Path:
    return next(folder.glob(f"part-{index:06d}-*"))


def rewritten(study: Path, folder: Path, index: int, column: str, row: int, value: float) -> None:
    """Change one number of a chunk and give the file the hash of its new content."""
    model = load_study(study)
    plan = make_plan(model, (files.read_plan(folder) or {})["chunk_size"])
    part = chunk_files.parts(folder)[index]
    rows, about = part.rows(), chunk_files.about(part)
    columns = {name: rows[name].to_numpy().copy() for name in rows.columns}
    columns[column][row] = value
    codes = {name: code for code, name in chunk_files.STATUS_NAMES.items()}
    counts = {codes[name]: number for name, number in about["counts"].items()}
    part.path.unlink()
    chunk_files.write_chunk(folder, plan, index, ChunkResult(columns, counts, about["missed"]))


def test_a_sound_dataset_has_no_finding_and_designs_are_computed_again(dataset: Path) -> None:
    found = sweep.verify(dataset.parent, designs=40)
    assert (found.exit_code, found.findings, found.notes) == (0, [], [])
    assert (found.chunks, found.recomputed) == (3, 40)
    assert found.rows == len(sweep.load(dataset))
    assert found.size == sum(map(len, chunk_bytes(dataset).values()))


@pytest.mark.parametrize("kind", ["flipped", "truncated", "emptied"])
def test_a_damaged_chunk_is_named_and_the_next_run_restores_it(
    whole: tuple[Path, Path], dataset: Path, kind: str
) -> None:
    path = chunk(dataset, 1)
    data = bytearray(path.read_bytes())
    data[len(data) // 2] ^= 1
    path.write_bytes({"flipped": bytes(data), "truncated": bytes(data[:-9]), "emptied": b""}[kind])
    found = sweep.verify(dataset)
    assert found.exit_code == DAMAGED
    assert [finding.path for finding in found.findings] == [path]
    assert "_bad/" in found.findings[0].remedy
    sweep.run(whole[0], dataset)
    assert sweep.verify(dataset).exit_code == 0
    assert chunk_bytes(dataset) == chunk_bytes(whole[1])
    assert (dataset.parent / "_bad" / path.name).is_file()


def test_swapped_names_are_both_found(dataset: Path) -> None:
    one, other = chunk(dataset, 0), chunk(dataset, 1)
    first, second = one.read_bytes(), other.read_bytes()
    one.write_bytes(second)
    other.write_bytes(first)
    assert {finding.path for finding in sweep.verify(dataset).findings} == {one, other}


def test_a_chunk_under_another_ones_name_is_found(dataset: Path) -> None:
    path = chunk(dataset, 2)
    index, identity, digest = path.stem.split("-")[1:]
    false = path.rename(path.with_name(f"part-000001-{identity}-{digest}.parquet"))
    found = sweep.verify(dataset)
    assert any(finding.path == false and index.lstrip("0") in finding.words for finding in found.findings)
    assert found.exit_code == DAMAGED


def test_missing_chunks_of_a_complete_dataset_are_damage_of_an_unfinished_one_they_are_not(dataset: Path) -> None:
    chunk(dataset, 1).unlink()
    assert sweep.verify(dataset).exit_code == DAMAGED
    files.write_plan(dataset, (files.read_plan(dataset) or {}) | {"complete": False})
    found = sweep.verify(dataset)
    assert found.exit_code == INCOMPLETE
    assert "1 of 3 chunks are missing, the first is 1" in found.findings[0].words


def test_a_duplicate_and_a_foreign_file_are_found_and_a_run_refuses_them(
    whole: tuple[Path, Path], dataset: Path
) -> None:
    rewritten(whole[0], dataset, 0, "swing", 0, 1.0)
    shutil.copy(chunk(whole[1], 0), dataset)
    foreign = dataset / "mine.parquet"
    foreign.write_bytes(b"x")
    words = [str(finding) for finding in sweep.verify(dataset, designs=0).findings]
    assert len(words) == 2
    assert sum("a second chunk 0" in line for line in words) == 1
    assert sum("mine.parquet: no chunk" in line for line in words) == 1
    with pytest.raises(InputError, match=r"mine\.parquet"):
        sweep.run(whole[0], dataset)


@pytest.mark.parametrize(
    ("column", "value", "words"),
    [
        ("design", 9000, "design numbers"),
        ("status", 3, "rows by status"),
        ("a", 11.5, "not those of the design space"),
        ("swing", float("nan"), "missing values"),
    ],
)
def test_a_wrong_row_under_a_right_hash_is_found(
    whole: tuple[Path, Path], dataset: Path, column: str, value: float, words: str
) -> None:
    ok = chunk_files.parts(dataset)[1].rows()["status"].to_numpy() == 0
    rewritten(whole[0], dataset, 1, column, int(ok.argmax()), value)
    found = sweep.verify(dataset, designs=0)
    assert found.exit_code == DAMAGED
    assert any(words in finding.words and "move it away" in finding.remedy for finding in found.findings)


def test_a_wrong_value_is_found_by_computing_its_design_again(whole: tuple[Path, Path], dataset: Path) -> None:
    part = chunk_files.parts(dataset)[1]
    rows, about = part.rows(), chunk_files.about(part)
    tried = spread({k: (4096 * k, min(4096 * (k + 1), 10240)) for k in range(3)}, 512)
    row = int(((rows["status"].to_numpy() == 0) & np.isin(rows["design"], tried[1])).argmax())
    assert (about["start"], about["stop"]) == (4096, 8192) and rows["design"][row] in tried[1]
    bits = rows["swing"].to_numpy()[row] * (1.0 + 2.0**-52)
    rewritten(whole[0], dataset, 1, "swing", row, bits)
    assert sweep.verify(dataset, designs=0).exit_code == 0
    found = sweep.verify(dataset, designs=512)
    assert [f"design {rows['design'][row]}: swing" in finding.words for finding in found.findings] == [True]


def test_designs_of_other_sources_are_not_computed_again_and_that_is_said(
    dataset: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(sweep.chunks.plan, "code_hash", lambda: "other")
    found = sweep.verify(dataset)
    assert (found.exit_code, found.recomputed) == (0, 0)
    assert "other sources" in found.notes[0]


def test_a_damaged_plan_is_found_and_the_next_run_keeps_the_chunks(whole: tuple[Path, Path], dataset: Path) -> None:
    (dataset.parent / "_plan.json").write_text("{")
    found = sweep.verify(dataset)
    assert [finding.path.name for finding in found.findings] == ["_plan.json"]
    sweep.run(whole[0], dataset)
    assert sweep.verify(dataset).exit_code == 0
    assert files.read_runs(dataset)[-1]["text"] == "0 chunks computed"


def test_wrong_totals_and_a_damaged_table_beside_the_chunks_are_found(dataset: Path) -> None:
    plan = files.read_plan(dataset) or {}
    files.write_plan(dataset, plan | {"counts": {"OK": 1}})
    (dataset.parent / "_optimum.parquet").write_bytes(b"no table")
    found = sweep.verify(dataset, designs=0)
    assert [finding.path.name for finding in found.findings] == ["_plan.json", "_optimum.parquet"]


def test_the_command_line_says_the_verdict_and_ends_with_its_code(dataset: Path, tmp_path: Path) -> None:
    result = CliRunner().invoke(main, ["verify", str(dataset.parent), "--designs", "4"])
    assert result.exit_code == 0
    assert result.output.splitlines()[-1].endswith("complete and undamaged")
    chunk(dataset, 0).write_bytes(b"")
    result = CliRunner().invoke(main, ["verify", str(dataset.parent)])
    assert result.exit_code == DAMAGED
    assert "1 damaged or lost, 0 not computed yet" in result.output
    # The folder of a study, and the one that holds results, are no datasets.
    (tmp_path / "press").mkdir()
    for folder in (tmp_path / "press", dataset.parent.parent):
        (folder / "study.toml").write_text("")
        result = CliRunner().invoke(main, ["verify", str(folder)])
        assert result.exit_code == 2 and "a dataset that sweep run wrote" in result.output
    assert json.loads((dataset.parent / "_plan.json").read_text())["complete"]
