"""Where tasks run: here, in threads, in processes, on a cluster, or wherever somebody has registered an executor for.

A task is called with a number and a function that says whether to stop; it must be fit to be pickled, and may rely on
neither its parent's process nor its signals.  How a worker learns that it is to stop, and what becomes of it when its
parent dies, is the affair of its executor.
"""

from __future__ import annotations

import os
import sys
import tempfile
from collections.abc import Callable, Iterator
from concurrent.futures import Future, ThreadPoolExecutor
from contextlib import AbstractContextManager, contextmanager
from contextvars import ContextVar
from pathlib import Path
from typing import Any, TypeVar

from sweep.errors import InputError, WorkerDied, nearest
from sweep.jobs.cluster import Dask
from sweep.jobs.flow import Executor, Task, flow
from sweep.jobs.signals import Stop, depend_on_parent, unheard

T = TypeVar("T")

GRACE = 1.0  # for processes to hand back what they have once they are to stop [s]
MOST_JOBS = 1024
UNTRACKED = "ignore:resource_tracker:UserWarning"


class Here:
    """Runs tasks one after the other in the thread that asks."""

    def outcomes(self, task: Task[T], numbers: Iterator[int], jobs: int, stop: Stop) -> Iterator[T]:
        """See `Executor`."""
        while not stop and (number := next(numbers, None)) is not None:
            yield task(number, stop.event.is_set)


class Threads:
    """Threads of this process; the kernels release the interpreter's lock."""

    def outcomes(self, task: Task[T], numbers: Iterator[int], jobs: int, stop: Stop) -> Iterator[T]:
        """See `Executor`."""
        pool = ThreadPoolExecutor(jobs, thread_name_prefix="linksweep")
        try:
            yield from flow(lambda number: pool.submit(task, number, stop.event.is_set), numbers, lambda: jobs, stop)
        finally:
            pool.shutdown(cancel_futures=True)


class Processes:
    """Processes of this machine.  They learn by a file that they are to stop, and end with their parent."""

    def outcomes(self, task: Task[T], numbers: Iterator[int], jobs: int, stop: Stop) -> Iterator[T]:
        """See `Executor`."""
        from concurrent.futures.process import BrokenProcessPool

        with tempfile.TemporaryDirectory(prefix="linksweep-", ignore_cleanup_errors=True) as folder:
            flag = Path(folder, "stop")
            stop.tell(flag.touch)
            pool = worker_processes(jobs)

            def submit(number: int) -> Future[T]:
                with unheard():
                    return pool.submit(_until_flag, task, number, flag)  # type: ignore[no-any-return]

            try:
                yield from flow(submit, numbers, lambda: jobs, stop, GRACE)
            except BrokenProcessPool as error:
                reason = str(error).partition("\n")[0]  # the rest is about the exit codes of all of them
                raise WorkerDied(f"a worker process died ({reason.rstrip('.')})") from error
            finally:
                if stop:  # whoever is still at work, or still starting up, does not listen
                    pool.shutdown(wait=False, kill_workers=True)


def worker_processes(jobs: int) -> Any:
    """Return the pool of worker processes; they hear no signals and end with this process."""
    from joblib.externals.loky import get_reusable_executor
    from joblib.externals.loky.backend import resource_tracker

    # A program that leaves at once leaves semaphores behind; the tracker removes them and need not warn of it.
    sys.warnoptions.append(UNTRACKED)
    try:
        resource_tracker.ensure_running()  # it would unblock signals in the middle
    finally:
        sys.warnoptions.remove(UNTRACKED)
    with unheard():
        return get_reusable_executor(max_workers=jobs, initializer=depend_on_parent, initargs=(os.getpid(),))


def _until_flag(task: Task[T], number: int, flag: Path) -> T:
    return task(number, flag.exists)


EXECUTORS: dict[str, Callable[..., Executor]] = {"threading": Threads, "loky": Processes, "dask": Dask}

# Those that can be told where: "dask=tcp://10.0.0.1:8786".
ADDRESSED = ("dask",)

# Where searches put the starts that are worth a process; set for the time of a run.
_searches: ContextVar[Executor | None] = ContextVar("linksweep_searches", default=None)


def executor(name: str, jobs: int) -> Executor:
    """Return the executor of that name in `EXECUTORS`, checked together with the number of its workers.

    Parameters
    ----------
    name : such as "loky"; "dask=tcp://10.0.0.1:8786" is the cluster at that address
    jobs : workers; a single one on this machine is this thread

    Raises
    ------
    InputError
        if there is none, or ``jobs`` is no whole number from 1 to 1024.
    """
    kind, equals, address = str(name).partition("=")
    if kind not in EXECUTORS:
        raise InputError("backend", name, f"{' or '.join(EXECUTORS)}{nearest(kind, EXECUTORS)}", "run")
    if equals and (kind not in ADDRESSED or not address):
        raise InputError("backend", name, f"an address after {' or '.join(f'{one}=' for one in ADDRESSED)} only", "run")
    if isinstance(jobs, bool) or not isinstance(jobs, int) or not 1 <= jobs <= MOST_JOBS:
        raise InputError("jobs", jobs, f"a whole number from 1 to {MOST_JOBS}", "run")
    if equals:
        return EXECUTORS[kind](address)
    return Here() if jobs == 1 else EXECUTORS[kind]()


def for_tasks(place: Executor, count: int) -> Executor:
    """Choose where so many tasks run: a single one is not worth a pool of this machine."""
    return Here() if count < 2 and isinstance(place, (Threads, Processes)) else place


@contextmanager
def at_work(place: Executor) -> Iterator[Executor]:
    """Let the searches within this context use this executor too, unless it shares the interpreter with them.

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
    """Choose where starts of the optimiser run that are worth a process: on the cluster of the run, if it has one."""
    return _searches.get() or Processes()
