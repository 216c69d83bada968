"""``run``: a study's design space over the cores, chunk by chunk, into a dataset folder; resumable at any moment."""

from __future__ import annotations

import math
import os
import platform
import shlex
import signal
import socket
import subprocess
import time
import uuid
from collections.abc import Iterator
from dataclasses import replace
from importlib.metadata import version
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

from sweep.dataset import store
from sweep.errors import InputError, Interrupted, SearchCutShort, StoreError, TimeUsedUp, WorkerDied, nearest
from sweep.jobs.signals import Stop, stop_on_signal

if TYPE_CHECKING:
    from sweep.chunks.plan import Plan
    from sweep.engine.worker import Done
    from sweep.study import Study

BACKENDS = ("threading", "loky")
LIBRARIES = ("linksweep", "numpy", "numba", "llvmlite", "scipy", "pandas", "pyarrow", "joblib")


def run(
    study: str | Path | Study,
    out: str | Path | None = None,
    jobs: int = 2,
    backend: Literal["threading", "loky"] = "threading",
    *,
    smoke: bool = False,
    force: bool = False,
    accuracy: float | None = None,
    certify: bool | None = None,
    progress: bool = False,
) -> Path:
    """Compute a study's designs into a folder, continuing where an earlier run stopped; then its optimum if it asks.

    The bytes of the chunks do not depend on jobs, backend, or interruptions.

    Parameters
    ----------
    study : study file, its folder, or a loaded study
    out : dataset folder; default ``results/<name>/designs`` (``results/smoke/<name>/designs``)
    jobs : workers
    backend : "threading" (the kernels release the lock) or "loky" (processes)
    smoke : take the study's tiny version
    force : run whatever the budget says, and set data of another study or code in the folder aside into ``_old/``
    accuracy : relative accuracy of the extrema in place of the study's own
    certify : whether the wanted maxima are proven, in place of the study's own word
    progress : bar on a terminal, lines in a log

    Returns
    -------
    Path
        the folder: ``pandas.read_parquet(folder)`` reads it.

    Raises
    ------
    StudyError, InputError
        for a bad study, accuracy or argument, or a folder with data of another study (exit code 2)
    BudgetError
        if the estimate exceeds the study's budget (3)
    WorkerDied, StoreError, LockedError, TimeUsedUp, Interrupted
        worker killed (70), disk full or forbidden (74), folder in use (75), the budget's time or that of the optimiser
        over (124), signal (130, 143); finished chunks and what was found of the optimum stay.
    """
    if backend not in BACKENDS:
        raise InputError("backend", backend, f"{' or '.join(BACKENDS)}{nearest(str(backend), BACKENDS)}", "run")
    if isinstance(jobs, bool) or not isinstance(jobs, int) or jobs < 1:
        raise InputError("jobs", jobs, "a whole number from 1", "run")
    model = _model(study, smoke, accuracy, certify)
    _check_budget(model, jobs, force)
    folder = Path(out) if out is not None else Path("results", *(["smoke"] if smoke else []), model.name, "designs")
    with store.locked(folder):
        head = {"run": uuid.uuid4().hex[:12]}
        begin = time.monotonic()
        command = _command(model, folder, smoke, accuracy, certify)
        store.append_run(folder, head | {"event": "start", "command": command} | _circumstances(jobs, backend))
        try:
            computed = _sweep(model, folder, jobs, backend, force, progress)
            if model.optimise is not None:
                _optimise(replace(model, pareto=None), folder, jobs, progress)
            _front(model, folder, jobs)
            _raise_if_cut_short(folder)
        except Exception as error:
            if not isinstance(error, StoreError):  # the log stands on the disk that has just refused
                store.append_run(folder, head | _end(begin, type(error).__name__, str(error)))
            raise
        store.append_run(folder, head | _end(begin, "complete", f"{computed} chunks computed"))
    return folder


def _model(study: str | Path | Study, smoke: bool, accuracy: float | None, certify: bool | None) -> Study:
    from sweep.study.load import load_study, with_accuracy

    model = load_study(study, smoke=smoke) if isinstance(study, (str, Path)) else study
    return model if accuracy is None and certify is None else with_accuracy(model, accuracy, certify)


def _check_budget(study: Study, jobs: int, force: bool) -> None:
    from sweep.engine.estimate import check_budget, estimate

    if not force:
        check_budget(study, estimate(study, jobs))


def _sweep(study: Study, folder: Path, jobs: int, backend: str, force: bool, progress: bool) -> int:
    """Compute the missing chunks and note the totals; returns the number of chunks computed."""
    from sweep.jobs.progress import Progress

    failure: Exception | None = None
    allowed = math.inf if force else study.budget.seconds
    with stop_on_signal() as stop:
        store.remove_temporary(folder)
        plan = _open_plan(study, folder, force)
        finished = store.finished_chunks(folder, plan)
        missing = [index for index in range(plan.chunks) if index not in finished]
        done = plan.designs - sum(len(range(*plan.bounds(index))) for index in missing)
        with Progress(study.name, plan.designs, done, progress) as shown:
            results = 0
            for result in _results(study, plan, folder, missing, jobs, backend, stop, allowed):
                results += 1
                if result.error is not None:
                    failure = failure or result.error
                    stop.event.set()
                shown.advance(result.designs)
    if failure is not None:
        raise failure
    _raise_if_signalled(stop, folder)
    if results < len(missing):
        left = f"{len(missing) - results} of {plan.chunks} chunks to go"
        way_out = "finished chunks are kept, run again to continue, or force it to have no limit"
        raise TimeUsedUp(f"{folder}: the {study.budget.seconds:g} s of budget.time are used up, {left}; {way_out}")
    counts, missed = store.totals(folder)
    note = _plan_note(study, folder, plan) | {"counts": counts, "missed": missed, "complete": True}
    store.write_plan(folder, note)
    return len(missing)


def _open_plan(study: Study, folder: Path, force: bool) -> Plan:
    """The plan in the folder if it is this study's, otherwise a new one; foreign data only go with ``force``."""
    from sweep.chunks.plan import make_plan

    noted = store.read_plan(folder)
    if noted is not None:
        plan = make_plan(study, noted["chunk_size"])
        if plan.identity == noted["identity"]:
            # What the chunks say of the study stays as the first run said it, whatever units it is now written in.
            plan = replace(plan, name=noted["name"], chunk_data=noted["chunk_data"])
            if force:
                _set_foreign_aside(folder, plan, ())
            return plan
        if not force:
            known = ", ".join(f"{key} {noted.get(key)}" for key in ("name", "study", "code", "identity"))
            raise store.foreign(folder, known, plan)
    plan = make_plan(study)
    if force:
        _set_foreign_aside(
            folder, plan, (store.PLAN, store.OPTIMUM, store.CURVES, store.SENSITIVITY, store.TOLERANCE, store.PARETO)
        )
    store.finished_chunks(folder, plan)  # refuses foreign chunks before the plan is written
    store.write_plan(folder, _plan_note(study, folder, plan))
    return plan


def _set_foreign_aside(folder: Path, plan: Plan, others: tuple[str, ...]) -> None:
    old = [part.path for part in store.parts(folder) if part.identity != plan.identity]
    old += [folder / name for name in others if (folder / name).is_file()]
    if old:
        store.set_aside(folder, old, f"{store.OLD}/{time.strftime('%Y%m%d-%H%M%S')}")


def _plan_note(study: Study, folder: Path, plan: Plan) -> dict[str, Any]:
    """Content of ``_plan.json``, with what an earlier run noted of the optimum."""
    noted = store.read_plan(folder) or {}
    return plan.as_dict() | {
        "about": {"name": study.name, "title": study.title, "question": study.question},
        "data": study.data,
        "optimise": study.optimise is not None,
        "optimised": noted.get("optimised"),
        "pareto": study.pareto is not None,
        "counts": noted.get("counts"),
        "missed": noted.get("missed"),
        "complete": False,
    }


def _results(
    study: Study,
    plan: Plan,
    folder: Path,
    missing: list[int],
    jobs: int,
    backend: str,
    stop: Stop,
    allowed: float,
) -> Iterator[Done]:
    """Finished chunks in the order they become ready; no new one is begun when the allowed time [s] is over."""
    from sweep.chunks.chunk import warm
    from sweep.engine.worker import work

    if missing:
        warm(study)  # one process compiles, the others load the machine code
    deadline = time.monotonic() + allowed  # compiling does not count, so that every run gets on
    todo = (index for index in missing if not stop and time.monotonic() < deadline)
    if jobs == 1 or len(missing) < 2:
        for index in todo:
            yield work(study, plan, folder, index, os.getpid(), stop.event)
        return

    from concurrent.futures.process import BrokenProcessPool

    from joblib import Parallel, delayed

    shared = stop.event if backend == "threading" else None
    parallel = Parallel(
        n_jobs=jobs, backend=backend, return_as="generator_unordered", batch_size=1, pre_dispatch=f"{jobs} + 1"
    )
    try:
        yield from parallel(delayed(work)(study, plan, folder, index, os.getpid(), shared) for index in todo)
    except BrokenProcessPool as error:
        _raise_if_signalled(stop, folder)
        text = f"{folder}: a worker process died ({error}); finished chunks are kept, run again to continue"
        raise WorkerDied(text) from error


def _raise_if_signalled(stop: Stop, folder: Path) -> None:
    if stop.signal_number is not None:
        text = f"{folder}: stopped by signal {stop.signal_number}; finished chunks are kept, run again to continue"
        raise Interrupted(stop.signal_number, text)


def _optimise(study: Study, folder: Path, jobs: int, progress: bool) -> None:
    """Run the optimiser unless its result for these very sources is there already, whole."""
    from sweep.chunks.plan import optimiser_hash
    from sweep.jobs.progress import Progress
    from sweep.optimise import optimise_study, read_survey

    note = store.read_plan(folder) or {}
    key = f"{note['identity']}-{study.fingerprint[:12]}-{optimiser_hash()}"
    found = read_survey(folder / store.OPTIMUM)
    if note.get("optimised") == key and (folder / store.OPTIMUM).is_file() and (found is None or found.ended != "time"):
        return
    assert study.optimise is not None
    store.write_plan(folder, note | {"optimised": None})
    with stop_on_signal() as stop, Progress("optimum", study.optimise.starts, 0, progress, unit="starts") as shown:
        try:
            optimise_study(study, folder, lambda: bool(stop), jobs, lambda done, _: shown.advance(done - shown.done))
        except KeyboardInterrupt:
            number = stop.signal_number or signal.SIGINT
            text = f"{folder}: stopped by signal {number} while optimising; run again for the whole search"
            raise Interrupted(number, text) from None
    store.write_plan(folder, note | {"optimised": key})


def _raise_if_cut_short(folder: Path) -> None:
    """The optimum stands there, but the emergency brake has kept some starts from being searched."""
    from sweep.optimise import read_survey

    found = read_survey(folder / store.OPTIMUM)
    if found is not None and found.ended == "time":
        text = f"{folder}: {found.warnings[0]} searched; run again with a greater optimise.time_budget for all of them"
        raise SearchCutShort(folder, text)


def _front(study: Study, folder: Path, jobs: int) -> None:
    """Search the study's front, from where an earlier run of these very sources left it."""
    if study.pareto is None:
        (folder / store.PARETO).unlink(missing_ok=True)
        return
    from sweep.chunks.plan import optimiser_hash
    from sweep.optimise import front_study

    note = store.read_plan(folder) or {}
    key = f"{note['identity']}-{study.fingerprint[:12]}-{optimiser_hash()}"
    with stop_on_signal() as stop:
        try:
            front_study(study, folder, key, lambda: bool(stop), jobs)
        except KeyboardInterrupt:
            number = stop.signal_number or signal.SIGINT
            text = f"{folder}: stopped by signal {number} while searching the front; run again to continue"
            raise Interrupted(number, text) from None


def _command(study: Study, folder: Path, smoke: bool, accuracy: float | None, certify: bool | None) -> str:
    """The command that makes the dataset again."""
    words = ["sweep", "run", str(study.path), "--out", str(folder), *(["--smoke"] if smoke else [])]
    words += [] if accuracy is None else ["--accuracy", repr(accuracy)]
    return shlex.join([*words, *(["--certify"] if certify else [])])


def _circumstances(jobs: int, backend: str) -> dict[str, Any]:
    """What may differ between runs that give the same bytes."""
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


def _end(begin: float, outcome: str, text: str) -> dict[str, Any]:
    return {"event": "end", "outcome": outcome, "seconds": round(time.monotonic() - begin, 3), "text": text}


def _commit() -> str | None:
    """Commit of the sources, None where they are not a git work tree or there is no git."""
    command = ["git", "-C", str(Path(__file__).resolve().parent), "rev-parse", "HEAD"]
    try:
        done = subprocess.run(command, capture_output=True, text=True, check=False, timeout=10)
    except (FileNotFoundError, subprocess.TimeoutExpired):
        return None
    return done.stdout.strip() or None if done.returncode == 0 else None
