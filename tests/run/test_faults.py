"""What can go wrong while a sweep runs: signals, kills, a full disk, damaged and foreign chunks, a second run."""

from __future__ import annotations

import os
import random
import signal
import subprocess
import sys
import time
import tracemalloc
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import pandas as pd
import pytest

import sweep.chunks.plan
import sweep.engine.run
from sweep.chunks.chunk import ChunkResult, compute_chunk
from sweep.dataset.chunk_files import parts
from sweep.dataset.files import BAD, LOCK, OLD, PLAN, beside, read_runs
from sweep.dataset.lock import locked
from sweep.dataset.store import is_complete, load
from sweep.engine.run import run
from sweep.errors import (
    IncompleteWarning,
    InputError,
    LockedError,
    ProgramFault,
    StoreError,
    TimeUsedUp,
    WorkerDied,
)
from sweep.study import Study, load_study
from sweep.study.study import Budget
from tests.support.engine_study import CHUNK, ROOT, SMALL, SMALL_CHUNKS, chunk_bytes, write_study
from tests.support.selection import mostly_long

PAUSE = 0.05


@pytest.fixture(autouse=True)
def small_chunks(monkeypatch: pytest.MonkeyPatch) -> None:
    for name, value in SMALL_CHUNKS.items():
        monkeypatch.setattr(sweep.chunks.plan, name, value)


@pytest.fixture(scope="module")
def path(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return write_study(tmp_path_factory.mktemp("study"))


@pytest.fixture(scope="module")
def whole(path: Path, tmp_path_factory: pytest.TempPathFactory) -> dict[str, bytes]:
    """Chunks of an uninterrupted run."""
    with pytest.MonkeyPatch.context() as patch:
        for name, value in SMALL_CHUNKS.items():
            patch.setattr(sweep.chunks.plan, name, value)
        return chunk_bytes(run(path, tmp_path_factory.mktemp("whole")))


@pytest.fixture
def study(path: Path) -> Study:
    return load_study(path)


def start(study: Path, out: Path, *, backend: str = "threading", pause: float = PAUSE) -> subprocess.Popen[str]:
    command = [sys.executable, "-m", "tests.support.engine_study", str(study), str(out), "2", backend, str(pause)]
    return subprocess.Popen(command, cwd=ROOT, stderr=subprocess.PIPE, text=True, start_new_session=True)


def wait_for_chunks(out: Path, count: int, process: subprocess.Popen[str]) -> None:
    deadline = time.monotonic() + 60.0
    while len(list(out.glob("part-*"))) < count:
        assert process.poll() is None, f"ended early with {process.returncode}: {process.communicate()[1]}"
        assert time.monotonic() < deadline, "no chunk after a minute"
        time.sleep(0.005)


def wait_for_write(out: Path, process: subprocess.Popen[str]) -> None:
    """Wait until a chunk is being written, which takes at least the pause of the process."""
    deadline = time.monotonic() + 60.0
    while not list(beside(out).glob("_tmp-*part*")):
        assert process.poll() is None and time.monotonic() < deadline
        time.sleep(0.001)


def only_parts(folder: Path) -> bool:
    return all(p.name.startswith("part-") for p in folder.iterdir())


BY_SIGNAL = [(signal.SIGINT, 130, "threading"), (signal.SIGTERM, 143, "threading"), (signal.SIGINT, 130, "loky")]


@pytest.mark.parametrize("by", mostly_long(BY_SIGNAL, BY_SIGNAL[1:]))
def test_signal_ends_run_with_its_code_and_next_run_ends_with_same_bytes(
    path: Path, whole: dict[str, bytes], tmp_path: Path, by: tuple[int, int, str]
) -> None:
    number, code, backend = by
    out = tmp_path / "out"
    process = start(path, out, backend=backend)
    wait_for_chunks(out, 2, process)
    os.killpg(process.pid, number)  # as a terminal does: the whole group
    _, errors = process.communicate(timeout=30)
    assert process.returncode == code, errors
    assert "finished chunks are kept" in errors
    assert 2 <= len(parts(out)) < len(whole)
    assert read_runs(out)[-1]["outcome"] == "Interrupted"
    assert not is_complete(out) and only_parts(out)
    run(path, out)
    assert chunk_bytes(out) == whole and is_complete(out)


def test_second_signal_stops_at_once(path: Path, tmp_path: Path) -> None:
    out = tmp_path / "out"
    process = start(path, out, pause=3.0)
    wait_for_write(out, process)
    process.send_signal(signal.SIGINT)
    time.sleep(0.3)
    process.send_signal(signal.SIGINT)
    begin = time.monotonic()
    process.communicate(timeout=30)
    assert process.returncode == -signal.SIGINT
    assert time.monotonic() - begin < 1.5, "waited for the slow disk"


def test_kill_at_random_moments_leaves_a_readable_folder_and_same_bytes_in_the_end(
    path: Path, whole: dict[str, bytes], tmp_path: Path
) -> None:
    out, moments, torn = tmp_path / "out", random.Random(7), 0
    for target in (1, 3, 6):
        process = start(path, out)
        wait_for_chunks(out, target, process)
        time.sleep(moments.uniform(0.0, 2.0 * PAUSE))
        if target == 3:  # chance alone may miss every write on a machine whose disk is quick
            wait_for_write(out, process)
        process.kill()
        process.communicate(timeout=30)
        torn += len(list(beside(out).glob("_tmp-*")))
        with pytest.warns(IncompleteWarning, match="incomplete"):
            assert pd.read_parquet(out).equals(load(out))
        assert chunk_bytes(out).items() <= whole.items()
        assert only_parts(out)
    assert torn > 0, "no kill fell into a write: the test does not test what it says"
    run(path, out)
    assert chunk_bytes(out) == whole and is_complete(out)
    assert not list(beside(out).glob("_tmp-*"))


def worker_processes(parent: int) -> list[int]:
    found = []
    for entry in Path("/proc").glob("[0-9]*"):
        try:
            command, about = (entry / "cmdline").read_bytes(), (entry / "stat").read_text()
        except (FileNotFoundError, ProcessLookupError):  # ended while we looked
            continue
        if b"popen_loky" in command and about.rpartition(")")[2].split()[1] == str(parent):
            found.append(int(entry.name))
    return found


def is_running(pid: int) -> bool:
    try:
        return Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[0] != "Z"
    except (FileNotFoundError, ProcessLookupError):
        return False


def test_killed_worker_process_is_reported_and_finished_chunks_are_kept(
    path: Path, whole: dict[str, bytes], tmp_path: Path
) -> None:
    out = tmp_path / "out"
    process = start(path, out, backend="loky")
    wait_for_chunks(out, 1, process)
    os.kill(worker_processes(process.pid)[0], signal.SIGKILL)
    _, errors = process.communicate(timeout=60)
    assert process.returncode == WorkerDied.exit_code == 70, errors
    assert "finished chunks are kept" in errors
    run(path, out)
    assert chunk_bytes(out) == whole


def test_worker_processes_end_with_their_killed_parent(path: Path, whole: dict[str, bytes], tmp_path: Path) -> None:
    out = tmp_path / "out"
    process = start(path, out, backend="loky")
    wait_for_chunks(out, 1, process)
    workers = worker_processes(process.pid)
    assert len(workers) == 2 and all(is_running(pid) for pid in workers)
    process.kill()
    process.communicate(timeout=30)
    deadline = time.monotonic() + 20.0
    while any(is_running(pid) for pid in workers):
        assert time.monotonic() < deadline, "a worker outlives its parent"
        time.sleep(0.05)
    run(path, out)
    assert chunk_bytes(out) == whole


@pytest.mark.parametrize("damage", ["cut", "flip", "empty"])
def test_damaged_chunk_is_set_aside_and_computed_anew(
    study: Study, whole: dict[str, bytes], tmp_path: Path, damage: str
) -> None:
    out = run(study, tmp_path / "out")
    victim = parts(out)[3].path
    data = bytearray(victim.read_bytes())
    data[len(data) // 2] ^= 1
    bad = {"cut": bytes(data[: len(data) // 2]), "flip": bytes(data), "empty": b""}[damage]
    victim.write_bytes(bad)
    assert not is_complete(out)
    with pytest.raises(StoreError, match=victim.name):
        load(out)
    run(study, out)
    assert chunk_bytes(out) == whole
    assert (beside(out) / BAD / victim.name).read_bytes() == bad
    assert read_runs(out)[-1]["text"] == "1 chunk computed"


def test_lost_or_damaged_plan_is_made_again(study: Study, whole: dict[str, bytes], tmp_path: Path) -> None:
    out = run(study, tmp_path / "out")
    plan = (beside(out) / PLAN).read_bytes()
    for text in (None, b"{ torn", b"[]"):
        (beside(out) / PLAN).unlink()
        if text is not None:
            (beside(out) / PLAN).write_bytes(text)
        assert not is_complete(out)
        run(study, out)
        assert chunk_bytes(out) == whole and (beside(out) / PLAN).read_bytes() == plan


def test_other_study_in_the_folder_is_refused_and_set_aside_only_by_force(
    study: Study, whole: dict[str, bytes], tmp_path: Path
) -> None:
    out = run(study, tmp_path / "out")
    other = load_study(write_study(tmp_path / "other", limits='margin = { min = 0.01, unit = "1" }'))
    with pytest.raises(InputError, match="another folder") as caught:
        run(other, out)
    assert caught.value.exit_code == 2
    assert chunk_bytes(out) == whole
    run(other, out, force=True)
    assert is_complete(out) and not chunk_bytes(out).keys() & whole.keys()
    (old,) = (beside(out) / OLD).iterdir()
    assert chunk_bytes(old) == whole


def test_foreign_chunk_without_plan_is_refused(study: Study, whole: dict[str, bytes], tmp_path: Path) -> None:
    out = tmp_path / "out"
    out.mkdir()
    name = min(whole)
    (out / name.replace(name.split("-")[2], "0" * 12)).write_bytes(whole[name])
    with pytest.raises(InputError, match="part-000000-000000000000"):
        run(study, out)
    assert not (beside(out) / PLAN).exists()


def test_change_of_code_is_foreign_too(study: Study, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    out = run(study, tmp_path / "out")
    monkeypatch.setattr(sweep.chunks.plan, "code_hash", lambda: "0123456789abcdef")
    with pytest.raises(InputError, match="other sources or libraries"):
        run(study, out)


def test_code_is_what_was_imported_whatever_its_files_have_become(monkeypatch: pytest.MonkeyPatch) -> None:
    imported = sweep.chunks.plan.code_hash(), sweep.chunks.plan.optimiser_hash()
    sweep.chunks.plan.code_hash.cache_clear()
    sweep.chunks.plan.optimiser_hash.cache_clear()
    monkeypatch.setattr(Path, "read_bytes", lambda path: b"edited")
    assert (sweep.chunks.plan.code_hash(), sweep.chunks.plan.optimiser_hash()) == imported


def test_held_lock_is_refused_with_its_holder(study: Study, whole: dict[str, bytes], tmp_path: Path) -> None:
    out = run(study, tmp_path / "out")
    with locked(out), pytest.raises(LockedError, match=f"process {os.getpid()}") as caught:
        run(study, out)
    assert caught.value.exit_code == 75
    assert (beside(out) / LOCK).exists()
    run(study, out)
    assert chunk_bytes(out) == whole


def test_folder_that_cannot_be_made_is_a_store_error(study: Study, tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    with pytest.raises(StoreError) as caught:
        run(study, tmp_path / "file" / "out")
    assert caught.value.exit_code == 74


@pytest.mark.parametrize("backend", mostly_long(["threading", "loky"], ["threading"]))
def test_full_disk_ends_with_74_and_nothing_half_written(
    path: Path, whole: dict[str, bytes], tmp_path: Path, backend: str
) -> None:
    """The system itself refuses to write a file larger than plan and log."""
    assert min(len(data) for data in whole.values()) > SMALL
    out = tmp_path / "out"
    limited = f"import resource, sys; resource.setrlimit(resource.RLIMIT_FSIZE, ({SMALL}, {SMALL})); "
    limited += "from tests.support.engine_study import main; main(*sys.argv[1:])"
    command = [sys.executable, "-B", "-c", limited, str(path), str(out), "2", backend, "0"]
    done = subprocess.run(command, cwd=ROOT, stderr=subprocess.PIPE, text=True, timeout=60)
    assert done.returncode == 74, done.stderr
    assert "File too large" in done.stderr and "part-" in done.stderr and "Traceback" not in done.stderr
    assert not list(out.glob("part-*")) and not list(beside(out).glob("_tmp-*"))
    run(path, out)
    assert chunk_bytes(out) == whole


def test_bug_in_a_worker_surfaces_with_its_chunk(study: Study, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def broken(study: Study, start: int, stop: int, *_: object) -> ChunkResult:
        raise ZeroDivisionError("broken")

    monkeypatch.setattr("sweep.engine.worker.compute_chunk", broken)
    with pytest.raises(ProgramFault, match=f"ZeroDivisionError: broken, in chunk 0, designs 0:{CHUNK}") as caught:
        run(study, tmp_path / "out", jobs=1)
    assert read_runs(tmp_path / "out")[-1]["outcome"] == "ProgramFault"
    assert 'raise ZeroDivisionError("broken")' in caught.value.trace


def test_memory_of_a_chunk_is_its_rows_not_its_designs(tmp_path: Path) -> None:
    study = load_study(write_study(tmp_path, keep="feasible", count=2000, limits='swing = { min = 359, unit = "deg" }'))
    compute_chunk(study, 0, 8192)
    peaks = []
    for designs in (200_000, 1_000_000):
        tracemalloc.start()
        assert compute_chunk(study, 0, designs).columns["design"].size == 0
        peaks.append(tracemalloc.get_traced_memory()[1])
        tracemalloc.stop()
    assert peaks[1] < 1.2 * peaks[0] < 10e6, f"{peaks}: five times the designs"


def test_a_sweep_that_outlasts_its_budget_stops_with_124_and_continues(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    study = load_study(write_study(tmp_path / "study", count=40))
    expected = chunk_bytes(run(study, tmp_path / "whole", jobs=1))
    clock = iter(float(second) for second in range(10**6))
    short = replace(study, budget=Budget(disk_bytes=1e9, seconds=4.0))
    with monkeypatch.context() as patch:
        ticking = SimpleNamespace(monotonic=lambda: next(clock), strftime=time.strftime, gmtime=time.gmtime)
        patch.setattr(sweep.engine.run, "time", ticking)
        with pytest.raises(TimeUsedUp, match=r"the 4 s of budget.time are used up, \d of 5 chunks to go") as caught:
            run(short, tmp_path / "out", jobs=1)
    assert caught.value.exit_code == 124
    some = chunk_bytes(tmp_path / "out")
    assert 0 < len(some) < len(expected)
    assert read_runs(tmp_path / "out")[-1]["outcome"] == "TimeUsedUp"
    assert not is_complete(tmp_path / "out")
    assert chunk_bytes(run(short, tmp_path / "out", jobs=1)) == expected
