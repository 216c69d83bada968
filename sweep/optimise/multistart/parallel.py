"""Starts spread over processes: most of a search runs in Python, where threads would wait for each other."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Generic, TypeVar

from sweep.chunks.plan import optimiser_hash
from sweep.errors import InputError, WorkerDied
from sweep.families.base import Array
from sweep.jobs.executors import Task, place_of_searches
from sweep.jobs.signals import Stop
from sweep.optimise.local.kkt import Result
from sweep.optimise.local.start import search
from sweep.optimise.problem.statement import Problem

T = TypeVar("T")


class _Asked(Stop):
    """A flag that is set as soon as somebody who looks at it finds that a function answers true."""

    def __init__(self, asked: Callable[[], bool]) -> None:
        self._asked = asked
        super().__init__()

    def __bool__(self) -> bool:
        if not super().__bool__() and self._asked():
            self.set()
        return super().__bool__()


@dataclass(frozen=True)
class _Checked(Generic[T]):
    """A task for workers; one whose sources are not those of the process that asks does nothing."""

    task: Task[T]
    code: str

    def __call__(self, number: int, should_stop: Callable[[], bool]) -> tuple[int, T] | None:
        """Return the number with what the task gives for it, None if it is not to be begun any more."""
        own = optimiser_hash()
        if own != self.code:
            allowed = f"{self.code}, the sources and libraries of the process that searches"
            raise InputError("code", own, allowed, "worker")
        return None if should_stop() else (number, self.task(number, should_stop))


@dataclass(frozen=True)
class SearchTask:
    """Search from one of the starts."""

    problem: Problem
    starts: Array
    allowed: float

    def __call__(self, number: int, should_stop: Callable[[], bool]) -> Result:
        """Return the result from that start."""
        return search(number, self.problem, self.starts[number], should_stop, self.allowed)


def in_processes(
    problem: Problem,
    starts: Array,
    numbers: list[int],
    asked: Callable[[], bool],
    jobs: int,
    allowed: float = math.inf,
) -> list[Result]:
    """Return results of the starts ``numbers`` that were begun before ``asked`` became true, in their order.

    Each is what a serial search finds, to the bit.

    Parameters
    ----------
    problem, starts : as for ``minimise``
    numbers : which of the starts
    asked, jobs : see :func:`over_processes`
    allowed : looks at designs that each start may take
    """
    return over_processes(SearchTask(problem, starts, allowed), numbers, asked, jobs)


def spread_over(
    task: Task[T], numbers: list[int], asked: Callable[[], bool], jobs: int, tell: Callable[[], None] = lambda: None
) -> list[T]:
    """Return what a task gives for each number, in their order, here or in processes; those not begun are left out.

    ``tell`` is called after each of them.
    """
    if jobs == 1 or len(numbers) == 1:
        out = []
        for number in numbers:
            if asked():
                break
            out.append(task(number, asked))
            tell()
        return out
    return over_processes(task, numbers, asked, jobs, tell)


def over_processes(
    task: Task[T], numbers: list[int], asked: Callable[[], bool], jobs: int, tell: Callable[[], None] = lambda: None
) -> list[T]:
    """Return what a task gives for each number that was begun before ``asked`` became true, in their order.

    They run on the cluster of the run, if it has one.

    Parameters
    ----------
    task : fit to be pickled
    numbers : what it is called with
    asked : looked at in this process; workers learn of it, and what does not answer soon is given up
    jobs : how many workers
    tell : called after each of them

    Raises
    ------
    WorkerDied
        if a worker process was killed.
    """
    stop = _Asked(asked)
    found: dict[int, T] = {}
    try:
        checked = _Checked(task, optimiser_hash())
        for outcome in place_of_searches().outcomes(checked, iter(numbers), min(jobs, len(numbers)), stop):
            if outcome is not None:
                found[outcome[0]] = outcome[1]
                tell()
    except WorkerDied as error:
        if not stop:  # the signal that stops us may have hit them too
            raise WorkerDied(f"optimiser: {error}; run again") from error
    return [found[number] for number in numbers if number in found]
