"""Where tasks run: here, in threads, in processes, or wherever somebody has registered an executor for.

A task is called with a number and a function that says whether to stop; it must be fit to be pickled, and may rely on
neither its parent's process nor its signals.  How a worker learns that it is to stop, and what becomes of it when its
parent dies, is the affair of its executor.
"""

from __future__ import annotations

import math
import os
import tempfile
import time
from collections.abc import Callable, Iterator
from concurrent.futures import FIRST_COMPLETED, Future, ThreadPoolExecutor, wait
from pathlib import Path
from typing import Any, Protocol, TypeVar

from sweep.errors import InputError, WorkerDied, nearest
from sweep.jobs.signals import Stop, depend_on_parent, unheard

T = TypeVar("T")
T_co = TypeVar("T_co", covariant=True)

POLL = 0.05  # between two looks at the flag [s]
GRACE = 1.0  # for processes to hand back what they have once they are to stop [s]
MOST_JOBS = 1024


class Task(Protocol[T_co]):
    """What a worker does with one number; ``should_stop`` is to be asked often."""

    def __call__(self, number: int, should_stop: Callable[[], bool]) -> T_co:
        """Do it."""
        ...


class Executor(Protocol):
    """Runs a task for many numbers."""

    def outcomes(self, task: Task[T], numbers: Iterator[int], jobs: int, stop: Stop) -> Iterator[T]:
        """What the task returns, in the order in which it is ready.

        Parameters
        ----------
        task : called once for every number
        numbers : the next one is taken when a worker is about to be free
        jobs : how many workers
        stop : once it is true, no number is taken any more, and tasks may be dropped

        Raises
        ------
        WorkerDied
            if a worker was lost.
        """
        ...


class Here:
    """One after the other in the thread that asks."""

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
            yield from _flow(lambda number: pool.submit(task, number, stop.event.is_set), numbers, jobs, stop)
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
                yield from _flow(submit, numbers, jobs, stop, GRACE)
            except BrokenProcessPool as error:
                raise WorkerDied(f"a worker process died ({error})") from error
            finally:
                if stop:  # whoever is still at work, or still starting up, does not listen
                    pool.shutdown(wait=False, kill_workers=True)


def worker_processes(jobs: int) -> Any:
    """The pool of worker processes; they hear no signals and end with this process."""
    from joblib.externals.loky import get_reusable_executor
    from joblib.externals.loky.backend import resource_tracker

    resource_tracker.ensure_running()  # it would unblock signals in the middle
    with unheard():
        return get_reusable_executor(max_workers=jobs, initializer=depend_on_parent, initargs=(os.getpid(),))


def _until_flag(task: Task[T], number: int, flag: Path) -> T:
    return task(number, flag.exists)


def _flow(
    submit: Callable[[int], Future[T]], numbers: Iterator[int], jobs: int, stop: Stop, grace: float = math.inf
) -> Iterator[T]:
    """Outcomes as they come; one number more than there are workers is on its way, so that none of them waits."""
    waiting: set[Future[T]] = set()
    late = math.inf
    while True:
        while not stop and len(waiting) <= jobs and (number := next(numbers, None)) is not None:
            waiting.add(submit(number))
        if not waiting or time.monotonic() > late:
            return
        done, waiting = wait(waiting, timeout=POLL, return_when=FIRST_COMPLETED)
        for future in done:
            yield future.result()
        if stop and late == math.inf:
            late = time.monotonic() + grace


EXECUTORS: dict[str, Executor] = {"threading": Threads(), "loky": Processes()}


def executor(name: str, jobs: int) -> Executor:
    """The executor of that name in `EXECUTORS`, checked together with the number of its workers.

    Raises
    ------
    InputError
        if there is none, or ``jobs`` is no whole number from 1 to 1024.
    """
    if name not in EXECUTORS:
        raise InputError("backend", name, f"{' or '.join(EXECUTORS)}{nearest(str(name), EXECUTORS)}", "run")
    if isinstance(jobs, bool) or not isinstance(jobs, int) or not 1 <= jobs <= MOST_JOBS:
        raise InputError("jobs", jobs, f"a whole number from 1 to {MOST_JOBS}", "run")
    return EXECUTORS[name]
