"""Sweeps and searches on a Dask cluster of two worker processes: the same bytes, lost workers, other sources, stops."""

from __future__ import annotations

import os
import shutil
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import dask
import pytest
from distributed import Client, LocalCluster

import sweep
import sweep.chunks.plan
import sweep.optimise.multistart.multistart
from sweep.chunks.plan import make_plan
from sweep.dataset.chunk_files import parts
from sweep.dataset.files import OPTIMUM, PARETO, beside
from sweep.engine.worker import ChunkTask, Done
from sweep.errors import InputError, WorkerDied
from sweep.jobs.cluster import Dask
from sweep.jobs.signals import Stop
from sweep.study import Study, load_study
from tests.optimise.test_front import TABLE, written
from tests.support.engine_study import ROOT, SMALL_CHUNKS, chunk_bytes, write_study


def few_failures() -> Any:
    """A worker that dies over a task twice ends it."""
    return dask.config.set({"distributed.scheduler.allowed-failures": 1})


@pytest.fixture(autouse=True)
def small_chunks(monkeypatch: pytest.MonkeyPatch) -> None:
    for name, value in SMALL_CHUNKS.items():
        monkeypatch.setattr(sweep.chunks.plan, name, value)


@pytest.fixture(scope="module")
def address() -> Iterator[str]:
    """A cluster that outlives its users, as one of many machines does."""
    with few_failures(), LocalCluster(n_workers=2, threads_per_worker=1, dashboard_address="127.0.0.1:0") as cluster:
        yield cluster.scheduler_address


@pytest.fixture(scope="module")
def study(tmp_path_factory: pytest.TempPathFactory) -> Study:
    return load_study(write_study(tmp_path_factory.mktemp("study"), count=40))


@pytest.fixture(scope="module")
def whole(study: Study, tmp_path_factory: pytest.TempPathFactory) -> dict[str, bytes]:
    """Chunks of a run in one thread."""
    with pytest.MonkeyPatch.context() as patch:
        for name, value in SMALL_CHUNKS.items():
            patch.setattr(sweep.chunks.plan, name, value)
        return chunk_bytes(sweep.run(study, tmp_path_factory.mktemp("whole"), jobs=1))


def test_chunks_have_the_bytes_of_one_thread_and_the_dashboard_is_named(
    study: Study, whole: dict[str, bytes], address: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out = sweep.run(study, tmp_path / "out", jobs=1, backend=f"dask={address}")
    assert chunk_bytes(out) == whole and len(whole) == 5 and sweep.is_complete(out)
    assert "Dask dashboard at http://127.0.0.1:" in capsys.readouterr().err
    with Client(address) as client:
        assert len(client.scheduler_info()["workers"]) == 2, "a run ends no workers that are not its own"


def test_a_local_cluster_is_ended_with_the_run(study: Study, whole: dict[str, bytes], tmp_path: Path) -> None:
    place = Dask()
    with place:
        done = list(place.outcomes(_pid, iter(range(4)), 2, Stop()))
    assert os.getpid() not in done and len(set(done)) <= 2
    assert not any(Path(f"/proc/{pid}").exists() for pid in done)


def _pid(number: int, should_stop: Callable[[], bool]) -> int:
    return os.getpid()


@dataclass(frozen=True)
class Fatal:
    """A task whose worker is killed when it first comes to a chunk: before it is written, or after."""

    task: ChunkTask
    mark: Path
    before: bool
    always: bool = False

    def __call__(self, number: int, should_stop: Callable[[], bool]) -> Done:
        last = number == 2 and (self.always or not self.mark.exists())
        if last:
            self.mark.touch()
        if last and self.before:
            os.kill(os.getpid(), signal.SIGKILL)
        done = self.task(number, should_stop)
        if last:
            os.kill(os.getpid(), signal.SIGKILL)
        return done


@pytest.mark.parametrize("before", [True, False])
def test_a_killed_worker_is_survived(
    study: Study, whole: dict[str, bytes], address: str, tmp_path: Path, before: bool
) -> None:
    out = tmp_path / "out"
    out.mkdir()
    task = Fatal(ChunkTask(study, make_plan(study), out), tmp_path / "mark", before)
    with Dask(address) as place:
        done = list(place.outcomes(task, iter(range(len(whole))), 2, Stop()))
    assert (tmp_path / "mark").exists() and sorted(one.index for one in done) == [0, 1, 2, 3, 4]
    assert chunk_bytes(out) == whole


def test_a_task_that_kills_every_worker_ends_the_run(study: Study, tmp_path: Path) -> None:
    """It has a cluster of its own, so that no other test waits for the workers that it kills."""
    task = Fatal(ChunkTask(study, make_plan(study), tmp_path), tmp_path / "mark", before=True, always=True)
    with few_failures(), Dask() as place, pytest.raises(WorkerDied, match="several workers died over one task"):
        list(place.outcomes(task, iter([2]), 2, Stop()))
    assert not list(tmp_path.glob("part-*"))


def test_a_worker_with_other_sources_computes_nothing(study: Study, tmp_path: Path) -> None:
    """Its copy of the package differs in one comment."""
    for name in ("sweep", "kernels"):
        shutil.copytree(ROOT / name, tmp_path / "copy" / name, ignore=shutil.ignore_patterns("__pycache__"))
    with (tmp_path / "copy" / "sweep" / "numerics" / "events.py").open("a") as file:
        file.write("# edited\n")
    with LocalCluster(n_workers=0, dashboard_address="127.0.0.1:0") as cluster:
        command = [sys.executable, "-m", "distributed.cli.dask_worker", cluster.scheduler_address, "--no-nanny"]
        worker = subprocess.Popen(
            [*command, "--nthreads", "1", "--no-dashboard", "--local-directory", str(tmp_path / "space")],
            cwd=tmp_path, env=os.environ | {"PYTHONPATH": str(tmp_path / "copy")}, stderr=subprocess.DEVNULL,
        )  # fmt: skip
        try:
            with pytest.raises(InputError, match="the sources and libraries of the process that plans"):
                sweep.run(study, tmp_path / "out", backend=f"dask={cluster.scheduler_address}")
        finally:
            worker.terminate()
            worker.wait(timeout=30)
    assert not list((tmp_path / "out").glob("part-*"))


def test_optimum_and_front_have_the_bytes_of_one_process(
    address: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(sweep.optimise.multistart.multistart, "SERIAL_EVALUATIONS", 0)  # every start is worth a process
    study = written(tmp_path / "study", TABLE)
    here = sweep.run(study, tmp_path / "here" / "designs", jobs=1)
    taken: list[int] = []
    search = Dask.outcomes

    def noted(place: Dask, task: Any, numbers: Iterator[int], jobs: int, stop: Stop) -> Iterator[Any]:
        for result in search(place, task, numbers, jobs, stop):
            taken.append(result[0] if isinstance(result, tuple) else -1)
            yield result

    monkeypatch.setattr(Dask, "outcomes", noted)
    there = sweep.run(study, tmp_path / "there" / "designs", jobs=2, backend=f"dask={address}")
    assert sum(start >= 0 for start in taken) >= 2, "no start was searched on the cluster"
    assert chunk_bytes(here) == chunk_bytes(there)
    for name in (OPTIMUM, PARETO):
        assert (beside(here) / name).read_bytes() == (beside(there) / name).read_bytes(), name


def begun(out: Path, study: Study, backend: str) -> subprocess.Popen[str]:
    command = [sys.executable, "-m", "tests.support.engine_study", str(study.path), str(out), "2", backend, "0.3"]
    process = subprocess.Popen(command, cwd=ROOT, stderr=subprocess.PIPE, text=True, start_new_session=True)
    deadline = time.monotonic() + 60.0
    while not list(out.glob("part-*")):
        assert process.poll() is None and time.monotonic() < deadline
        time.sleep(0.01)
    return process


def test_workers_drop_what_a_killed_program_has_asked_for(
    study: Study, whole: dict[str, bytes], address: str, tmp_path: Path
) -> None:
    out = tmp_path / "out"
    process = begun(out, study, f"dask={address}")
    process.kill()
    process.communicate(timeout=30)
    assert chunk_bytes(out).items() <= whole.items()
    assert chunk_bytes(sweep.run(study, out, backend=f"dask={address}")) == whole


def test_interruption_of_a_local_cluster_ends_with_130_and_one_line(
    study: Study, whole: dict[str, bytes], tmp_path: Path
) -> None:
    out = tmp_path / "out"
    process = begun(out, study, "dask")
    os.killpg(process.pid, signal.SIGINT)  # as a terminal does: the whole group
    _, errors = process.communicate(timeout=30)
    assert process.returncode == 130, errors
    dashboard, *rest = errors.splitlines()
    # On a busy machine Dask says how late its workers ended.
    ours = [line for line in rest if " - distributed." not in line]
    assert "dashboard" in dashboard and len(ours) == 1 and "finished chunks are kept" in ours[0], errors
    assert parts(out) and chunk_bytes(out).items() <= whole.items()
    assert chunk_bytes(sweep.run(study, out)) == whole


def test_without_the_package_the_message_says_what_to_install(
    study: Study, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(sys.modules, "distributed", None)
    with pytest.raises(InputError, match=r"pip install 'linksweep\[dask\]'"):
        sweep.run(study, tmp_path / "out", backend="dask")


def test_an_address_where_nobody_answers_is_named(
    study: Study, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("sweep.jobs.cluster.CONNECT_SECONDS", 1)
    with pytest.raises(InputError, match=r"dask=tcp://127.0.0.1:9.*a scheduler with workers"):
        sweep.run(replace(study), tmp_path / "out", backend="dask=tcp://127.0.0.1:9")
