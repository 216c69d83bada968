"""Starts spread over processes (the search is Python at heart, threads would wait for each other)."""

from __future__ import annotations

import os
import tempfile
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

from sweep.errors import WorkerDied
from sweep.families.base import Array
from sweep.optimise.certificate import Result
from sweep.optimise.problem import Problem
from sweep.optimise.search import search
from sweep.signals import depend_on_parent

POLL = 0.05  # between two looks at whether to stop [s]


def in_processes(
    problem: Problem, starts: Array, numbers: list[int], asked: Callable[[], bool], jobs: int, answered: bool
) -> list[Result]:
    """Results of the starts ``numbers`` that were begun before ``asked`` became true, in the order they ended.

    Each is what a serial search finds, to the bit.

    Parameters
    ----------
    problem, starts : as for ``minimise``
    numbers : which of the starts
    asked : looked at in a thread of this process; workers learn of it by a file
    jobs : how many workers
    answered : whether there is a result already; if not, the first start gets to its first design in any case

    Raises
    ------
    WorkerDied
        if a worker process was killed.
    """
    from concurrent.futures.process import BrokenProcessPool

    from joblib import Parallel, delayed

    with tempfile.TemporaryDirectory(prefix="linksweep-") as folder:
        flag = Path(folder, "stop")
        parallel = Parallel(n_jobs=min(jobs, len(numbers)), backend="loky", batch_size=1, pre_dispatch="all")
        firsts = [not answered and number == numbers[0] for number in numbers]
        tasks = [
            delayed(_task)(number, problem, starts[number], flag, os.getpid(), first)
            for number, first in zip(numbers, firsts, strict=True)
        ]
        try:
            with _watched(asked, flag):
                found = parallel(tasks)
        except BrokenProcessPool as error:
            raise WorkerDied(f"optimiser: a worker process died ({error}); run again") from error
    return [result for result in found if result is not None]


def _task(number: int, problem: Problem, start: Array, flag: Path, parent: int, first: bool) -> Result | None:
    if os.getpid() != parent:
        depend_on_parent(parent)
    # A parent that was killed leaves no folder to look into, but then this process ends as well.
    if flag.exists() and not first:
        return None
    return search(number, problem, start, flag.exists)


@contextmanager
def _watched(asked: Callable[[], bool], flag: Path) -> Iterator[None]:
    """While this lasts, a thread asks and leaves the flag when the answer is yes."""
    done = threading.Event()

    def watch() -> None:
        while not done.wait(POLL):
            if asked():
                flag.touch()
                return

    thread = threading.Thread(target=watch, name="linksweep: whether to stop", daemon=True)
    thread.start()
    try:
        yield
    finally:
        done.set()
        thread.join()
