"""``run``: computes a study's design space, chunk by chunk on all cores, into a dataset folder; resumable any time.

The log of a dataset records process, time, machine, command and versions of each run.
"""

from __future__ import annotations

import math
import os
import platform
import shlex
import socket
import subprocess
import time
import uuid
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from functools import partial
from importlib.metadata import version
from pathlib import Path
from typing import Any

from numba.core.event import install_listener

from sweep import optimise
from sweep.chunks.chunk import asked_outputs, warm, warm_step
from sweep.chunks.plan import Plan
from sweep.dataset import files, store
from sweep.dataset.lock import locked
from sweep.engine.estimate import Compiled, check_budget, estimate
from sweep.engine.opening import is_part, known_folder, open_plan, part_range, plan_note
from sweep.engine.searches import refuse_unprovable, search, stages_of
from sweep.engine.worker import ChunkTask, Done
from sweep.errors import StoreError, TimeUsedUp, WorkerDied, how_many
from sweep.jobs.executors import Executor, at_work, executor, for_tasks
from sweep.jobs.progress import Phases, Progress, stages
from sweep.jobs.signals import Stop, stop_on_signal
from sweep.study import Study
from sweep.study.load import load_study, with_accuracy

LIBRARIES = ("linksweep", "numpy", "numba", "llvmlite", "scipy", "pandas", "pyarrow", "joblib")


def command(study: Study, folder: Path, smoke: bool, accuracy: float | None, certify: bool | None) -> str:
    """Return the command that reproduces the dataset."""
    words = ["sweep", "run", str(study.path), "--out", str(folder), *(["--smoke"] if smoke else [])]
    words += [] if accuracy is None else ["--accuracy", repr(accuracy)]
    return shlex.join([*words, *(["--certify"] if certify else [])])


def circumstances(jobs: int, backend: str) -> dict[str, Any]:
    """Record the circumstances of a run, which do not affect its bytes."""
    return {
        "time": time.strftime("%Y-%m-%dT%H:%M:%SZ", time.gmtime()),
        "host": socket.gethostname(),
        "pid": os.getpid(),
        "machine": f"{platform.system()} {platform.machine()}, {os.cpu_count()} cores",
        "python": platform.python_version(),
        "versions": {name: version(name) for name in LIBRARIES},
        "commit": _commit(),
        "jobs": jobs,
        "backend": backend,
    }


def _commit() -> str | None:
    """Commit of the sources; None where they are not a git work tree or git is missing."""
    line = ["git", "-C", str(Path(__file__).resolve().parent), "rev-parse", "HEAD"]
    try:
        process = subprocess.run(line, capture_output=True, text=True, check=False, timeout=10)
    except (FileNotFoundError, subprocess.TimeoutExpired):
        return None
    return process.stdout.strip() or None if process.returncode == 0 else None


@contextmanager
def logged(folder: Path, command_line: str, jobs: int, backend: str) -> Iterator[list[str]]:
    """Log the start and the end of a run: the error that ended it, or the words that the caller appends to the list."""
    identity = {"run": uuid.uuid4().hex[:12]}
    begin = time.monotonic()
    files.append_run(folder, identity | {"event": "start", "command": command_line} | circumstances(jobs, backend))
    words: list[str] = []
    try:
        yield words
    except Exception as error:
        if not isinstance(error, StoreError):  # the log is on the disk that has just failed
            files.append_run(folder, identity | _end(begin, type(error).__name__, str(error)))
        raise
    files.append_run(folder, identity | _end(begin, "complete", "; ".join(words)))


def _end(begin: float, outcome: str, text: str) -> dict[str, Any]:
    return {"event": "end", "outcome": outcome, "seconds": round(time.monotonic() - begin, 3), "text": text}


# Up to this many steps of a sweep are compiled one after the other: a process costs 3 s of processor time to start.
ALIKE = 4

# Number of times that chunks removed or damaged during the run are computed again.
ROUNDS = 3


def run(
    study: str | Path | Study,
    out: str | Path | None = None,
    jobs: int = 2,
    backend: str = "threading",
    *,
    smoke: bool = False,
    force: bool = False,
    accuracy: float | None = None,
    certify: bool | None = None,
    progress: bool = False,
) -> Path:
    """Compute a study's designs into a folder, continuing an earlier run, then its optimum if the study asks for it.

    The bytes of the chunks do not depend on jobs, backend, or interruptions.

    Parameters
    ----------
    study : study file, its folder, or a loaded study
    out : folder of the chunks; default ``results/<name>/designs`` (``results/smoke/<name>/designs``).  All other files
        lie in the parent of a folder called ``designs``, in ``<out>.meta`` next to any other
    jobs : number of workers
    backend : "threading" (the kernels release the lock), "loky" (processes), "dask" (a cluster of processes on this
        machine), "dask=tcp://HOST:8786" (the Dask cluster at that address, docs/cluster.md), or another of
        ``sweep.jobs.executors.EXECUTORS``
    smoke : take the study's tiny version
    force : ignore the budget, and set data of another study or code in the folder aside into ``_old/``
    accuracy : relative accuracy of the extrema in place of the study's own
    certify : whether the wanted maxima are proven, in place of the study's own setting
    progress : bar on a terminal, lines in a log

    Returns
    -------
    Path
        the folder of the chunks: ``pandas.read_parquet(folder)`` reads it.

    Raises
    ------
    StudyError, InputError
        for a bad study, accuracy or argument, or a folder with data of another study (exit code 2)
    BudgetError
        if the estimate exceeds the study's budget (3)
    WorkerDied, StoreError, LockedError, TimeUsedUp, Interrupted
        worker killed (70), disk full or forbidden (74), folder in use (75), time of the budget or of the optimiser over
        (124), signal (130, 143); finished chunks and the optimum found so far stay.

    Examples
    --------
    >>> import sweep
    >>> folder = sweep.run("press", out="results/small/designs", smoke=True, jobs=1)
    >>> len(sweep.load(folder))
    4
    """
    place = executor(backend, jobs)  # raises for an unknown backend
    model = _model(study, smoke, accuracy, certify)
    refuse_unprovable(model)
    with stages(*stages_of(model)):
        with Phases(progress) as phases:
            _compile(model, jobs, phases)
            chunk_size = None if force else _within_budget(model, jobs, lambda k, of: phases.say("planning", k, of))
        folder = files.results_folder(model.name, smoke) if out is None else files.located(out)
        command_line = command(model, folder, smoke, accuracy, certify)
        with locked(folder), logged(folder, command_line, jobs, backend) as end, at_work(place):
            computed = _sweep(model, folder, jobs, place, force, chunk_size, progress)
            if not is_part(folder):
                search(model, folder, jobs, backend, progress)
            end.append(f"{how_many(computed, 'chunk')} computed")
    return folder


def _model(study: str | Path | Study, smoke: bool, accuracy: float | None, certify: bool | None) -> Study:
    model = load_study(study, smoke=smoke) if isinstance(study, (str, Path)) else study
    return model if accuracy is None and certify is None else with_accuracy(model, accuracy, certify)


@dataclass(frozen=True)
class KernelStep:
    """Compiles or loads a study's kernels by number: those of each step of its sweep, then of its descents."""

    study: Study

    @property
    def count(self) -> int:
        """Number of steps."""
        settings = self.study.optimise
        return len(asked_outputs(self.study)) + (settings is not None and settings.globally == "proportions")

    def __call__(self, number: int, should_stop: Callable[[], bool] = lambda: False) -> int:
        """Compile or load the kernels of a step, and return its number."""
        if number < len(asked_outputs(self.study)):
            warm_step(self.study, number)
        else:
            optimise.compile_descents(self.study)
        return number

    def words(self, number: int, functions: int) -> str:
        """Describe a step for progress: the functions compiled for it so far, and its outputs."""
        steps = asked_outputs(self.study)
        names = steps[number] if number < len(steps) else ["the search over proportions"]
        named = ", ".join(names[:3]) + (" ..." if len(names) > 3 else "")
        return f"steps, {how_many(functions, 'function')} compiled for {named}"


def _compile(study: Study, jobs: int, phases: Phases) -> None:
    """Load or compile every kernel the study needs; after the first that had to be compiled, in processes.

    The kernels of descents come last, take longest to compile and are begun first by the processes.  A few remaining
    steps of a sweep share most of their kernels, and are compiled in this process.
    """
    step = KernelStep(study)
    count = step.count
    few = ALIKE if count == len(asked_outputs(study)) else 1

    def tell(number: int, functions: int) -> None:
        phases.say("compiling", number, count, step.words(number, functions))

    for k in range(count):
        compiled = Compiled(partial(tell, k))
        with install_listener("numba:compile", compiled):
            step(k)
        if compiled.functions and min(jobs, os.cpu_count() or 1) > 1 and count - k - 1 > few:
            others = f"steps, the others in {how_many(jobs, 'process', 'es')}"
            phases.say("compiling", k + 1, count, others)
            with stop_on_signal() as stop:
                ready = executor("loky", jobs).outcomes(step, reversed(range(k + 1, count)), jobs, stop)
                for done, _ in enumerate(ready, k + 2):
                    phases.say("compiling", done, count, others)
            stop.raise_if_signalled("compiling", "what is compiled is")
            jobs = 1  # all later steps are loaded
    phases.say("compiling", count, count)


def _within_budget(study: Study, jobs: int, tell: Callable[[int, int], None]) -> int:
    """Check the study's estimate against its budget, and return the designs per chunk."""
    cost = estimate(study, jobs, tell)
    check_budget(study, cost)
    return cost.chunk_size


def _sweep(
    study: Study, folder: Path, jobs: int, place: Executor, force: bool, chunk_size: int | None, progress: bool
) -> int:
    """Compute the missing chunks and write the totals to the plan; returns the number of chunks computed."""
    computed = 0
    with stop_on_signal() as stop, Phases(progress) as phases:
        reading = "reading what is there"
        phases.say(reading, 0, 0, "chunks")
        files.remove_temporary(folder)
        plan: Plan | None = None
        with stop.raising():  # a pilot may have to compile
            plan = open_plan(study, folder, force, chunk_size)
        stop.raise_if_signalled(folder, "finished chunks are")
        assert plan is not None
        for _ in range(ROUNDS + 1):
            finished = store.finished_chunks(folder, plan, lambda done, of: phases.say(reading, done, of, "chunks"))
            missing = [index for index in part_range(folder, plan.chunks) if index not in finished]
            phases.end()
            if not missing:
                break
            task = ChunkTask(study, plan, folder.absolute(), known_folder(folder.absolute()))
            computed += _compute(task, missing, jobs, place, stop, force, progress)
        else:
            raise StoreError(f"{folder}: somebody removes or damages chunks while this run writes them; run again")
        stop.raise_if_signalled(folder, "finished chunks are")
    counts, missed = store.totals(folder)
    note = plan_note(study, folder, plan) | {"counts": counts, "missed": missed, "complete": not is_part(folder)}
    files.write_plan(folder, note)
    return computed


def _compute(
    task: ChunkTask, missing: list[int], jobs: int, place: Executor, stop: Stop, force: bool, progress: bool
) -> int:
    """Compute the missing chunks; returns their number."""
    study, plan, folder = task.study, task.plan, task.folder
    failure: Exception | None = None
    allowed = math.inf if force else study.budget.seconds
    done = plan.designs - sum(len(range(*plan.bounds(index))) for index in missing)
    with Progress(study.name, plan.designs, done, progress) as bar:
        results = 0
        for result in _results(task, missing, jobs, place, stop, allowed):
            results += not result.dropped
            if result.error is not None:
                failure = failure or result.error
                stop.set()
            bar.advance(result.designs)
    if failure is not None:
        raise failure
    stop.raise_if_signalled(folder, "finished chunks are")
    if results < len(missing):
        left = f"{len(missing) - results} of {how_many(plan.chunks, 'chunk')} to go"
        way_out = "finished chunks are kept, run again to continue, or force it to have no limit"
        raise TimeUsedUp(f"{folder}: the {study.budget.seconds:g} s of budget.time are used up, {left}; {way_out}")
    return results


def _results(
    task: ChunkTask, missing: list[int], jobs: int, place: Executor, stop: Stop, allowed: float
) -> Iterator[Done]:
    """Yield finished chunks in the order they become ready; none is begun after the allowed time [s]."""
    with stop.raising():
        warm(task.study)  # one process compiles, the others load the machine code
    deadline = time.monotonic() + allowed  # compiling does not count, so that every run makes progress
    pending = (index for index in missing if not stop and time.monotonic() < deadline)
    try:
        yield from for_tasks(place, len(missing)).outcomes(task, pending, jobs, stop)
    except WorkerDied as error:
        stop.raise_if_signalled(task.folder, "finished chunks are")
        raise WorkerDied(f"{task.folder}: {error}; finished chunks are kept, run again to continue") from error
