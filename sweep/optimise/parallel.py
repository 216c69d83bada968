"""Starts spread over processes (the search is Python at heart, threads would wait for each other)."""

from __future__ import annotations

import math
import os
import tempfile
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Protocol, TypeVar

from sweep.errors import WorkerDied
from sweep.families.base import Array
from sweep.jobs.executors import worker_processes
from sweep.jobs.signals import depend_on_parent, unheard
from sweep.optimise.certificate import Result
from sweep.optimise.problem import Problem
from sweep.optimise.search import search

T = TypeVar("T")
T_co = TypeVar("T_co", covariant=True)
POLL = 0.05  # between two looks at whether to stop [s]
GRACE = 1.0  # for workers to hand back what they have once they are to stop [s]


class Task(Protocol[T_co]):
    """Something to be done for a number, that asks often whether it is to stop; pickled for a worker."""

    def __call__(self, number: int, asked: Callable[[], bool]) -> T_co:
        """Do it; what is known so far if ``asked`` becomes true."""


@dataclass(frozen=True)
class _Search:
    problem: Problem
    starts: Array
    allowed: float

    def __call__(self, number: int, asked: Callable[[], bool]) -> Result:
        return search(number, self.problem, self.starts[number], asked, self.allowed)


def in_processes(
    problem: Problem,
    starts: Array,
    numbers: list[int],
    asked: Callable[[], bool],
    jobs: int,
    allowed: float = math.inf,
) -> list[Result]:
    """Results of the starts ``numbers`` that were begun before ``asked`` became true, in their order.

    Each is what a serial search finds, to the bit.

    Parameters
    ----------
    problem, starts : as for ``minimise``
    numbers : which of the starts
    asked, jobs : see :func:`spread_over`
    allowed : looks at designs that each start may take
    """
    return over_processes(_Search(problem, starts, allowed), numbers, asked, jobs)


def spread_over(task: Task[T], numbers: list[int], asked: Callable[[], bool], jobs: int) -> list[T]:
    """What a task gives for each number, in their order, here or in processes; those not begun are left out."""
    if jobs == 1 or len(numbers) == 1:
        out = []
        for number in numbers:
            if asked():
                break
            out.append(task(number, asked))
        return out
    return over_processes(task, numbers, asked, jobs)


def over_processes(task: Task[T], numbers: list[int], asked: Callable[[], bool], jobs: int) -> list[T]:
    """What a task gives for each number that was begun before ``asked`` became true, in their order.

    Parameters
    ----------
    task : pickled
    numbers : what it is called with
    asked : looked at in this process; workers learn of it by a file, and those that do not answer soon are ended
    jobs : how many workers

    Raises
    ------
    WorkerDied
        if a worker process was killed.
    """
    from concurrent.futures import FIRST_COMPLETED, wait
    from concurrent.futures.process import BrokenProcessPool

    workers = min(jobs, len(numbers))
    with tempfile.TemporaryDirectory(prefix="linksweep-") as folder:
        flag = Path(folder, "stop")
        executor = worker_processes(workers)
        todo, begun, late = list(reversed(numbers)), list[Any](), math.inf
        waiting: set[Any] = set()
        try:
            while (todo or waiting) and time.monotonic() < late:
                # One more than there are workers, so that none of them waits for its next start.
                while todo and len(waiting) <= workers:
                    number = todo.pop()
                    with unheard():
                        begun.append(executor.submit(_done, task, number, flag, os.getpid()))
                    waiting.add(begun[-1])
                waiting = wait(waiting, timeout=POLL, return_when=FIRST_COMPLETED).not_done
                if not flag.exists() and asked():
                    flag.touch()
                    todo, late = [], time.monotonic() + GRACE
            if waiting:  # still starting up, or busy with something that does not ask
                executor.shutdown(kill_workers=True)
            found = [future.result() for future in begun if future not in waiting]
        except BrokenProcessPool as error:
            if asked():  # the signal that stops us may have hit them too
                done = [future for future in begun if future.done() and future.exception() is None]
                return [result for result in (future.result() for future in done) if result is not None]
            raise WorkerDied(f"optimiser: a worker process died ({error}); run again") from error
    return [result for result in found if result is not None]


def _done(task: Task[T], number: int, flag: Path, parent: int) -> T | None:
    if os.getpid() != parent:
        depend_on_parent(parent)
    # A parent that was killed leaves no folder to look into, but then this process ends as well.
    return None if flag.exists() else task(number, flag.exists)
