"""What lies in a dataset and is not what a run wrote: plans that were changed, strangers, pipes, links, full disks."""

from __future__ import annotations

import ctypes
import errno
import io
import json
import os
import shutil
import subprocess
import sys
import warnings
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pyarrow as pa
import pyarrow.parquet as pq
import pytest
from click.testing import CliRunner

import sweep
import sweep.chunks.plan
import sweep.engine.worker
from sweep.cli import main
from sweep.dataset import chunk_files, files
from sweep.dataset.chunk_files import content_hash
from sweep.dataset.lock import locked
from sweep.errors import InputError, LinksweepError, LinksweepWarning, LockedError, StoreError
from sweep.report.dataset import gather
from sweep.report.page import write_report
from tests.support.engine_study import ROOT, SMALL_CHUNKS, chunk_bytes, write_study


@pytest.fixture(autouse=True)
def small_chunks(monkeypatch: pytest.MonkeyPatch) -> None:
    for name, value in SMALL_CHUNKS.items():
        monkeypatch.setattr(sweep.chunks.plan, name, value)


@pytest.fixture(scope="module")
def whole(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Path]:
    """A study of three chunks and its dataset."""
    place = tmp_path_factory.mktemp("whole")
    path = write_study(place / "study", count=20)
    with pytest.MonkeyPatch.context() as patch:
        for name, value in SMALL_CHUNKS.items():
            patch.setattr(sweep.chunks.plan, name, value)
        return path, sweep.run(path, place / "data" / "designs")


@pytest.fixture
def dataset(whole: tuple[Path, Path], tmp_path: Path) -> Path:
    shutil.copytree(whole[1].parent, tmp_path / "data")
    return tmp_path / "data" / "designs"


def family_five(plan: dict[str, Any]) -> None:
    plan["data"]["mechanism"]["family"] = 5


def other_limit(plan: dict[str, Any]) -> None:
    plan["data"]["limits"]["max_pressure_angle"]["max"] = 60


CHANGES: dict[str, Callable[[dict[str, Any]], object]] = {
    "family": family_five,
    "limit": other_limit,
    "data": lambda plan: plan.update(data=[]),
    "chunks": lambda plan: plan.update(chunks="1"),
    "columns": lambda plan: plan.update(columns=5),
    "designs": lambda plan: plan.update(designs="x"),
    "code": lambda plan: plan.update(code="0" * 16),
    "format": lambda plan: plan.update(format=1),
    "study": lambda plan: plan.update(study="y"),
    "pareto": lambda plan: plan.pop("pareto"),
}


@pytest.mark.parametrize("change", CHANGES)
def test_a_plan_that_was_changed_is_no_plan(whole: tuple[Path, Path], dataset: Path, change: str) -> None:
    path = files.beside(dataset) / files.PLAN
    plan = json.loads(path.read_text())
    CHANGES[change](plan)
    path.write_text(json.dumps(plan))
    assert sweep.verify(dataset, designs=0).exit_code == 74
    with pytest.raises(StoreError, match="not as a run has written it"):
        sweep.compare(whole[1], dataset)
    done = CliRunner().invoke(main, ["export", str(dataset.parent), "--format", "csv"])
    assert done.exit_code == 74, done.output


def test_the_next_run_writes_a_changed_plan_anew(whole: tuple[Path, Path], dataset: Path) -> None:
    path = files.beside(dataset) / files.PLAN
    before = path.read_bytes()
    path.write_bytes(before.replace(b'"chunks": 3', b'"chunks": "3"'))
    sweep.run(whole[0], dataset)
    assert path.read_bytes() == before and chunk_bytes(dataset) == chunk_bytes(whole[1])


def folder_with_chunk(path: Path, chunk: Path) -> None:
    path.mkdir()
    shutil.copy(chunk, path / chunk.name)


STRANGERS: dict[str, Callable[[Path, Path], object]] = {
    "part-X.parquet.bak": lambda path, chunk: shutil.copy(chunk, path),
    "PART-X.PARQUET": lambda path, chunk: shutil.copy(chunk, path),
    "_copy.parquet": lambda path, chunk: shutil.copy(chunk, path),
    "more": folder_with_chunk,
}


@pytest.mark.parametrize("name", STRANGERS)
def test_what_is_no_chunk_is_named_by_all(whole: tuple[Path, Path], dataset: Path, name: str) -> None:
    STRANGERS[name](dataset / name, chunk_files.parts(dataset)[0].path)
    found = sweep.verify(dataset, designs=0)
    assert found.exit_code == 74 and [finding.path.name for finding in found.findings] == [name]
    if name.startswith("_"):  # pandas and pyarrow pass it over
        assert len(sweep.load(dataset)) == 10240
        return
    for action in (lambda: sweep.load(dataset), lambda: sweep.run(whole[0], dataset)):
        with pytest.raises(InputError, match=name):
            action()


def test_a_hidden_file_is_nobodys_data(dataset: Path) -> None:
    (dataset / ".nfs0001").write_bytes(b"x")
    assert sweep.verify(dataset, designs=0).exit_code == 0 and len(sweep.load(dataset)) == 10240


IN_PLACE: dict[str, Callable[[Path], object]] = {
    "pipe": os.mkfifo,
    "folder": Path.mkdir,
    "dangling": lambda path: path.symlink_to("nowhere"),
    "loop": lambda path: path.symlink_to(path.name),
    "sparse": lambda path: os.truncate(os.open(path, os.O_CREAT | os.O_WRONLY), 20 * 2**30),
}


@pytest.mark.parametrize("kind", IN_PLACE)
def test_what_stands_in_place_of_a_chunk_is_damage_and_computed_anew(
    whole: tuple[Path, Path], dataset: Path, kind: str
) -> None:
    path = chunk_files.parts(dataset)[1].path
    path.unlink()
    IN_PLACE[kind](path)
    found = sweep.verify(dataset, designs=0)
    assert found.exit_code == 74 and [finding.path for finding in found.findings] == [path]
    with pytest.raises(StoreError, match="damaged chunk"):
        sweep.load(dataset)
    with pytest.raises(StoreError, match="damaged chunk"):
        sweep.scan(dataset)
    sweep.run(whole[0], dataset)
    assert chunk_bytes(dataset) == chunk_bytes(whole[1])


@pytest.mark.parametrize("kind", ["text", "folder", "pipe"])
def test_one_chunk_more_that_is_none_is_damage_for_the_report_too(dataset: Path, kind: str) -> None:
    first = chunk_files.parts(dataset)[0].path
    path = dataset / first.name.replace("part-000000", "part-000099")
    {"text": lambda path: path.write_text("{}"), **IN_PLACE}[kind](path)
    with pytest.raises(StoreError, match=f"{path.name}: damaged chunk"):
        write_report(dataset)


def test_rows_of_a_report_open_a_chunk_three_times(dataset: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Once to see that it is whole, once for its columns, once for its rows."""
    opened, begin = [], pq.ParquetFile.__init__

    def counted(self: pq.ParquetFile, source: object, *more: Any, **named: Any) -> None:
        opened.append(source)
        begin(self, source, *more, **named)

    monkeypatch.setattr(pq.ParquetFile, "__init__", counted)
    gather(dataset)
    chunks = len(chunk_files.parts(dataset))
    assert chunks > 1 and len(opened) == 3 * chunks + 1  # units and definitions stand in the first


def test_a_name_that_is_no_text_is_shown(dataset: Path) -> None:
    with open(os.fsencode(dataset) + b"/\xff.parquet", "wb"):  # noqa: PTH123 - a path of bytes
        pass
    done = subprocess.run(
        [sys.executable, "-m", "sweep", "verify", str(dataset), "--designs", "0"],
        capture_output=True, cwd=ROOT, timeout=120, check=False,
    )  # fmt: skip
    assert done.returncode == 74 and b"Traceback" not in done.stderr and b"\\udcff.parquet" in done.stdout


def test_a_nested_line_in_the_log_and_wrong_times_are_left_out(whole: tuple[Path, Path], dataset: Path) -> None:
    with (files.beside(dataset) / files.RUNS).open("a") as file:
        file.write("[" * 100_000 + "\n" + json.dumps({"event": "end", "outcome": "complete", "seconds": "x"}) + "\n")
    assert sweep.compare(whole[1], dataset).exit_code == 0


def test_a_chunk_that_lacks_a_column_under_a_right_hash_is_found(whole: tuple[Path, Path], dataset: Path) -> None:
    part = chunk_files.parts(dataset)[1]
    table = pq.read_table(part.path)
    buffer = io.BytesIO()
    pq.write_table(table.drop_columns(["swing"]), buffer)
    part.path.unlink()
    name = part.path.name.rpartition("-")[0] + f"-{content_hash(buffer.getvalue())}.parquet"
    (dataset / name).write_bytes(buffer.getvalue())
    found = sweep.verify(dataset, designs=10)
    assert found.exit_code == 74 and any(finding.path.name == name for finding in found.findings)
    for read in (sweep.load, write_report, lambda folder: sweep.compare(whole[1], folder)):
        with pytest.raises(
            LinksweepError, match=r"part-000001-.*: other columns than part-000000-.* \(swing\); move it away"
        ):
            read(dataset)


@pytest.mark.parametrize("name", [files.OPTIMUM, files.PARETO])
def test_a_table_beside_the_chunks_that_was_changed_is_refused(tmp_path: Path, name: str) -> None:
    """Its columns are not looked for: the plan knows the bytes that its search has written."""
    path = write_study(tmp_path / "study", count=4)
    with path.open("a") as file:
        file.write('[objective]\nminimise = "max_abs_d2psi"\n[optimise]\nstarts = 2\nseed = 1\n')
        file.write(
            '[pareto]\noutput = "swing"\nat_least = { values = [0.3, 0.4], unit = "rad" }\nstarts = 1\n'
            if name == files.PARETO
            else ""
        )
    folder = sweep.run(path, tmp_path / "data" / "designs", jobs=1)
    before = shutil.copytree(folder.parent, tmp_path / "before") / "designs"
    table = files.beside(folder) / name
    pq.write_table(pq.read_table(table).drop_columns(["role" if name == files.OPTIMUM else "swing"]), table)
    readers = [write_report, lambda folder: sweep.compare(before, folder)]
    for read in readers if name == files.OPTIMUM else readers[:1]:  # no front is compared
        with pytest.raises(StoreError, match=rf"{name}: not as its search has written it; run the study again"):
            read(folder)
    if name == files.OPTIMUM:  # a folder in place of what the search has written beside it
        table.write_bytes((before.parent / name).read_bytes())
        (files.beside(folder) / files.SENSITIVITY).unlink(missing_ok=True)
        (files.beside(folder) / files.SENSITIVITY).mkdir()
        with pytest.raises(StoreError, match=f"{files.SENSITIVITY}: not as its search has written it"):
            write_report(folder)


def test_a_link_in_place_of_the_folder_that_leads_nowhere_is_said(whole: tuple[Path, Path], dataset: Path) -> None:
    shutil.rmtree(dataset)
    dataset.symlink_to("designs")
    with pytest.raises(StoreError, match=r"designs: a link that leads to no folder; remove it, or take another folder"):
        sweep.run(whole[0], dataset)


def test_the_parent_folder_may_be_exported(dataset: Path) -> None:
    (dataset.parent / "tolerance.parquet").write_bytes(b"")
    done = CliRunner().invoke(main, ["export", str(dataset.parent), "--format", "csv"])
    assert done.exit_code == 0, done.output
    done = CliRunner().invoke(main, ["draw", "map", str(dataset.parent), "--out", str(dataset.parent / "map.svg")])
    assert "chunks named part" not in done.output


def test_full_standard_output_ends_with_74(dataset: Path) -> None:
    with Path("/dev/full").open("w") as full:
        done = subprocess.run(
            [sys.executable, "-m", "sweep", "verify", str(dataset), "--designs", "0"],
            stdout=full, stderr=subprocess.PIPE, text=True, cwd=ROOT, timeout=120, check=False,
        )  # fmt: skip
    assert done.returncode == 74 and "Traceback" not in done.stderr, done.stderr


@pytest.mark.parametrize("number", [errno.ENOLCK, errno.ENOSYS])
def test_a_file_system_without_locks_is_said_and_used(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, number: int
) -> None:
    def refuse(*_: object) -> None:
        raise OSError(number, os.strerror(number))

    monkeypatch.setattr("fcntl.flock", refuse)
    place = tmp_path / "out" / "designs"
    for _ in range(2):
        with pytest.warns(LinksweepWarning, match="no locks"), locked(place), warnings.catch_warnings():
            warnings.simplefilter("ignore")
            with pytest.raises(LockedError), locked(place):
                pass


def test_a_row_that_is_there_twice_under_a_right_hash_is_found(whole: tuple[Path, Path], dataset: Path) -> None:
    part = chunk_files.parts(dataset)[1]
    table, buffer = pq.read_table(part.path), io.BytesIO()
    pq.write_table(pa.concat_tables([table, table.slice(0, 1)]), buffer)
    part.path.unlink()
    name = part.path.name.rpartition("-")[0] + f"-{content_hash(buffer.getvalue())}.parquet"
    (dataset / name).write_bytes(buffer.getvalue())
    assert sweep.verify(dataset, designs=0).exit_code == 74
    with pytest.raises(StoreError, match="not in their order, or there twice"):
        sweep.compare(whole[1], dataset)


def without_rights() -> None:
    """Take from a superuser what opens closed folders to it, by Linux's capabilities."""
    for capability in (1, 2):  # CAP_DAC_OVERRIDE, CAP_DAC_READ_SEARCH
        ctypes.CDLL(None).prctl(24, capability, 0, 0, 0)  # PR_CAPBSET_DROP


@pytest.mark.parametrize("verb", ["verify", "report", "run"])
def test_a_folder_closed_to_the_user_is_said(whole: tuple[Path, Path], dataset: Path, verb: str) -> None:
    place = ("run", str(whole[0]), "--out", str(dataset)) if verb == "run" else (verb, str(dataset))
    dataset.chmod(0)
    try:
        done = subprocess.run(
            [sys.executable, "-m", "sweep", *place], capture_output=True, text=True, cwd=ROOT, timeout=120,
            check=False, preexec_fn=without_rights if os.getuid() == 0 else None,
        )  # fmt: skip
    finally:
        dataset.chmod(0o755)
    assert done.returncode == 2 and "Traceback" not in done.stderr and "not readable" in done.stderr


def test_the_folder_of_a_study_is_no_dataset_and_is_called_so(tmp_path: Path) -> None:
    (tmp_path / "study.toml").write_text("")
    with pytest.raises(InputError, match="this is the folder of a study"):
        sweep.compare(tmp_path, tmp_path)
