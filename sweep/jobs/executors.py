"""Executors: run tasks in this thread, in threads, in processes, on a cluster, or by a registered executor.

A task is called with a number and a function that says whether to stop; it must be picklable, and may rely on neither
its parent's process nor its signals.  Each executor decides how its workers learn that they have to stop, and what
happens to them when their parent dies.
"""

from __future__ import annotations

import os
import sys
import tempfile
import threading
from collections.abc import Callable, Iterator
from concurrent.futures.process import BrokenProcessPool
from contextlib import AbstractContextManager, contextmanager
from contextvars import ContextVar
from pathlib import Path
from typing import Any, Protocol, TypeVar

from sweep.errors import InputError, WorkerDied, nearest, whole
from sweep.jobs.cluster import Dask
from sweep.jobs.signals import Stop, depend_on_parent, unheard

T = TypeVar("T")
T_co = TypeVar("T_co", covariant=True)

GRACE = 1.0  # for processes to return their results after a stop [s]
POLL = 0.05  # between two checks of the flag [s]
MOST_JOBS = 1024


class Task(Protocol[T_co]):
    """Work of a worker on one number; it should call ``should_stop`` often."""

    def __call__(self, number: int, should_stop: Callable[[], bool]) -> T_co:
        """Run the task for one number."""
        ...


class Executor(Protocol):
    """Runs a task for many numbers, in this thread, in threads or in processes."""

    def outcomes(self, task: Task[T], numbers: Iterator[int], jobs: int, stop: Stop) -> Iterator[T]:
        """Yield the results of the task in the order in which they become ready.

        Parameters
        ----------
        task : called once for every number
        numbers : the next one is taken when a worker is about to be free
        jobs : number of workers
        stop : once it is true, no further number is taken, and tasks may be dropped

        Raises
        ------
        WorkerDied
            if a worker was lost.
        """
        ...


class Here:
    """Runs tasks one after the other in this thread."""

    def outcomes(self, task: Task[T], numbers: Iterator[int], jobs: int, stop: Stop) -> Iterator[T]:
        """Yield results as `Executor.outcomes` does."""
        return (task(number, stop.event.is_set) for number in _until(stop, numbers))


class Threads:
    """Threads of this process; the kernels release the GIL."""

    def outcomes(self, task: Task[T], numbers: Iterator[int], jobs: int, stop: Stop) -> Iterator[T]:
        """Yield results as `Executor.outcomes` does."""
        from joblib import delayed

        with _watched(stop):
            calls = (delayed(task)(number, stop.event.is_set) for number in _until(stop, numbers))
            yield from _pool(jobs, backend="threading")(calls)


class Processes:
    """Worker processes of this machine.

    Joblib cannot signal busy workers, so a file tells them to stop; a worker that does not react (a compiler) is killed
    soon after; and they exit with their parent, in whose folder they would otherwise go on writing.
    """

    def outcomes(self, task: Task[T], numbers: Iterator[int], jobs: int, stop: Stop) -> Iterator[T]:
        """Yield results as `Executor.outcomes` does."""
        from joblib import delayed
        from joblib.externals.loky import get_reusable_executor

        _begin_tracker()
        with tempfile.TemporaryDirectory(prefix="linksweep-", ignore_cleanup_errors=True) as folder:
            flag = Path(folder, "stop")
            calls = (delayed(task)(number, flag.exists) for number in _until(stop, numbers))
            killed = threading.Event()
            pool = _pool(jobs, backend="loky", initializer=depend_on_parent, initargs=(os.getpid(),))

            def kill() -> None:
                killed.set()
                get_reusable_executor(reuse=True).shutdown(wait=False, kill_workers=True)

            stop.tell(flag.touch)
            with _watched(stop, kill):
                try:
                    with unheard():
                        results = pool(calls)
                    yield from results
                except (BrokenProcessPool, RuntimeError) as error:
                    if killed.is_set():
                        return
                    if not isinstance(error, BrokenProcessPool):
                        raise
                    reason = str(error).partition("\n")[0]  # the rest lists the exit codes of all workers
                    raise WorkerDied(f"a worker process died ({reason.rstrip('.')})") from error


def _pool(jobs: int, **settings: Any) -> Callable[..., Iterator[Any]]:
    """Prepare a call of joblib that takes the next number when a worker becomes free."""
    from joblib import Parallel

    return Parallel(
        n_jobs=jobs,
        batch_size=1,
        pre_dispatch="n_jobs",
        return_as="generator_unordered",
        max_nbytes=None,
        **settings,
    )


def _until(stop: Stop, numbers: Iterator[int]) -> Iterator[int]:
    while not stop and (number := next(numbers, None)) is not None:
        yield number


@contextmanager
def _watched(stop: Stop, give_up: Callable[[], None] | None = None) -> Iterator[None]:
    """Watch the flag while this thread waits for results, and call ``give_up`` a second after it is set."""
    over = threading.Event()

    def watch() -> None:
        while not stop:
            if over.wait(POLL):
                return
        if give_up is not None and not over.wait(GRACE):
            give_up()

    watcher = threading.Thread(target=watch, name="linksweep: stop", daemon=True)
    watcher.start()
    try:
        yield
    finally:
        over.set()
        watcher.join()


def _begin_tracker() -> None:
    """Start joblib's resource tracker, which cleans up after its workers; started later it would unblock signals.

    Its warning about leaked semaphores is silenced, which it would print after a program has left at once.
    """
    from joblib.externals.loky.backend import resource_tracker

    before = sys.warnoptions[:]
    sys.warnoptions.append("ignore:resource_tracker:UserWarning")  # the tracker inherits these options
    try:
        resource_tracker.ensure_running()
    finally:
        sys.warnoptions[:] = before


EXECUTORS: dict[str, Callable[..., Executor]] = {"threading": Threads, "loky": Processes, "dask": Dask}

# Executors that accept an address: "dask=tcp://10.0.0.1:8786".
ADDRESSED = ("dask",)

# Executor on which searches run their expensive starts; set for the time of a run.
_searches: ContextVar[Executor | None] = ContextVar("linksweep_searches", default=None)


def executor(name: str, jobs: int) -> Executor:
    """Make the executor of a name in `EXECUTORS`; name and number of workers are checked.

    Parameters
    ----------
    name : such as "loky"; "dask=tcp://10.0.0.1:8786" is the cluster at that address
    jobs : number of workers; with 1 on this machine tasks run in this thread

    Raises
    ------
    InputError
        for an unknown name, or if ``jobs`` is no whole number from 1 to 1024.
    """
    kind, equals, address = str(name).partition("=")
    if kind not in EXECUTORS:
        raise InputError("backend", name, f"{' or '.join(EXECUTORS)}{nearest(kind, EXECUTORS)}", "run")
    if equals and (kind not in ADDRESSED or not address):
        raise InputError("backend", name, f"an address after {' or '.join(f'{one}=' for one in ADDRESSED)} only", "run")
    whole("jobs", jobs, "run", 1, MOST_JOBS)
    if equals:
        return EXECUTORS[kind](address)
    return Here() if jobs == 1 else EXECUTORS[kind]()


def for_tasks(place: Executor, count: int) -> Executor:
    """Choose where ``count`` tasks run: a single task is not worth a pool on this machine."""
    return Here() if count < 2 and isinstance(place, (Threads, Processes)) else place


@contextmanager
def at_work(place: Executor) -> Iterator[Executor]:
    """Let searches within this context use this executor too, unless it runs in their own process.

    An executor that is a context manager keeps its workers until the context ends.
    """
    token = _searches.set(None if isinstance(place, (Here, Threads)) else place)
    try:
        if isinstance(place, AbstractContextManager):
            with place:
                yield place
        else:
            yield place
    finally:
        _searches.reset(token)


def place_of_searches() -> Executor:
    """Executor for expensive starts of the optimiser: that of the running run, otherwise processes."""
    return _searches.get() or Processes()
