"""Where tasks run: threads, processes, and a third way that the engine does not know of."""

from __future__ import annotations

import os
import pickle
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path

import pytest

import sweep
import sweep.chunks.plan
from sweep.chunks.plan import make_plan
from sweep.dataset import chunk_files
from sweep.engine.worker import ChunkTask
from sweep.errors import InputError
from sweep.jobs.executors import EXECUTORS, Here, Task, Threads, at_work, executor
from sweep.jobs.signals import Stop
from sweep.study import load_study
from tests.support.engine_study import ROOT, SMALL_CHUNKS, chunk_bytes, write_study


@pytest.fixture(autouse=True)
def small_chunks(monkeypatch: pytest.MonkeyPatch) -> None:
    for name, value in SMALL_CHUNKS.items():
        monkeypatch.setattr(sweep.chunks.plan, name, value)


class Strangers:
    """Each task in a program of its own: nothing is shared with it but files, not even the parent."""

    PROGRAM = """
import pickle, sys
task, number = pickle.load(sys.stdin.buffer)
sys.stdout.buffer.write(pickle.dumps(task(number, lambda: False)))
"""

    def outcomes(self, task: Task[object], numbers: Iterator[int], jobs: int, stop: Stop) -> Iterator[object]:
        for number in numbers:
            done = subprocess.run(
                [sys.executable, "-c", self.PROGRAM], input=pickle.dumps((task, number)), stdout=subprocess.PIPE,
                cwd=ROOT, start_new_session=True, check=True,
            )  # fmt: skip
            yield pickle.loads(done.stdout)


def test_a_third_executor_is_a_line_in_the_register(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    study = load_study(write_study(tmp_path / "study", count=10))
    monkeypatch.setitem(EXECUTORS, "strangers", Strangers)
    out = sweep.run(study, tmp_path / "strangers", jobs=2, backend="strangers")
    assert sweep.is_complete(out) and len(chunk_bytes(out)) == 2
    assert chunk_bytes(out) == chunk_bytes(sweep.run(study, tmp_path / "here", jobs=1))


def test_a_worker_with_other_sources_computes_nothing(tmp_path: Path) -> None:
    study = load_study(write_study(tmp_path / "study", count=10))
    task = ChunkTask(study, replace(make_plan(study), code="0" * 16), tmp_path / "out")
    done = task(0, lambda: False)
    assert isinstance(done.error, InputError) and "the sources and libraries of the process that plans" in str(
        done.error
    )
    assert not (tmp_path / "out").exists()


def test_a_worker_asks_nothing_of_its_parent(tmp_path: Path) -> None:
    """It computes in a thread of a process without signal handlers, and in a pickled copy."""
    study = load_study(write_study(tmp_path / "study", count=10))
    plan = make_plan(study)
    for name, make in (("one", lambda task: task), ("two", lambda task: pickle.loads(pickle.dumps(task)))):
        folder = tmp_path / name
        folder.mkdir()
        task = make(ChunkTask(study, plan, folder))
        worker = threading.Thread(target=task, args=(0, lambda: False))
        worker.start()
        worker.join()
        assert [part.index for part in chunk_files.parts(folder)] == [0]
    assert chunk_bytes(tmp_path / "one") == chunk_bytes(tmp_path / "two")


def slow(number: int, should_stop: Callable[[], bool]) -> tuple[int, int]:
    deadline = time.monotonic() + (20.0 if number == 3 else 0.3)
    while time.monotonic() < deadline and not should_stop():
        time.sleep(0.005)
    return number, os.getpid()


@pytest.mark.parametrize("name", sorted(EXECUTORS))
def test_tasks_stop_when_they_are_asked_to(name: str) -> None:
    stop = Stop()
    found = []
    begin = time.monotonic()
    with at_work(EXECUTORS[name]()) as place:
        for number, process in place.outcomes(slow, iter(range(100)), 2, stop):
            found.append(number)
            assert (process == os.getpid()) == (name == "threading")
            if len(found) == 3:
                stop.set()
                begin = time.monotonic()
    assert time.monotonic() - begin < 5.0 and len(found) <= 6, found


def test_numbers_are_taken_as_workers_become_free() -> None:
    """A generator that ends because time is up ends the run: no number is taken long before its turn."""
    for place in (Here(), Threads()):
        taken = []

        def numbers(taken: list[int] = taken) -> Iterator[int]:
            for number in range(10, 20):
                taken.append(number)
                yield number

        outcomes = place.outcomes(slow, numbers(), 2, Stop())
        next(outcomes)
        assert len(taken) <= 5
        assert len(list(outcomes)) == 9


@pytest.mark.parametrize("jobs", [0, -1, 1.5, True, 1025, 100_000_000, 10**30])
def test_a_number_of_workers_that_makes_no_sense_is_refused(jobs: int) -> None:
    with pytest.raises(InputError, match="a whole number from 1 to 1024"):
        executor("loky", jobs)
    with pytest.raises(InputError, match="did you mean 'threading'"):
        executor("thread", 2)


@pytest.mark.parametrize("name", ["threading=tcp://10.0.0.1:8786", "dask="])
def test_an_address_where_none_belongs_is_refused(name: str) -> None:
    with pytest.raises(InputError, match="an address after dask= only"):
        executor(name, 2)


def test_a_program_that_leaves_at_once_has_the_last_word() -> None:
    """What clears away after it says nothing of what it finds."""
    program = (
        "import os\n"
        "from sweep.jobs.executors import _begin_tracker\n"
        "_begin_tracker()\n"
        "from joblib.externals.loky.backend.synchronize import Lock\n"
        "lock = Lock()\n"
        "os.write(2, b'run again')\n"
        "os._exit(143)\n"
    )
    ended = subprocess.run([sys.executable, "-c", program], cwd=ROOT, capture_output=True, timeout=120, check=False)
    assert (ended.returncode, ended.stderr) == (143, b"run again")
