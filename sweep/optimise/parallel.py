"""Starts spread over processes: most of a search runs in Python, where threads would wait for each other."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

from sweep.chunks.plan import optimiser_hash
from sweep.errors import InputError, WorkerDied
from sweep.families.base import Array
from sweep.jobs.executors import place_of_searches
from sweep.jobs.signals import Stop
from sweep.optimise.certificate import Result
from sweep.optimise.problem import Problem
from sweep.optimise.search import search


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
class SearchTask:
    """Search from one of the starts; a worker whose sources are not those of the process that asks does nothing."""

    problem: Problem
    starts: Array
    allowed: float
    code: str

    def __call__(self, number: int, should_stop: Callable[[], bool]) -> Result | None:
        """The result from that start, None if it is not to be begun any more."""
        own = optimiser_hash()
        if own != self.code:
            allowed = f"{self.code}, the sources and libraries of the process that searches"
            raise InputError("code", own, allowed, "worker")
        return None if should_stop() else search(number, self.problem, self.starts[number], should_stop, self.allowed)


def in_processes(
    problem: Problem,
    starts: Array,
    numbers: list[int],
    asked: Callable[[], bool],
    jobs: int,
    allowed: float = math.inf,
) -> list[Result]:
    """Results of the starts ``numbers`` that were begun before ``asked`` became true, in their order.

    Each is what a serial search finds, to the bit.  They run on the cluster of the run, if it has one.

    Parameters
    ----------
    problem, starts : as for ``minimise``
    numbers : which of the starts
    asked : looked at in this process; workers learn of it, and what does not answer soon is given up
    jobs : how many workers
    allowed : looks at designs that each start may take

    Raises
    ------
    WorkerDied
        if a worker process was killed.
    """
    stop = _Asked(asked)
    task = SearchTask(problem, starts, allowed, optimiser_hash())
    found: dict[int, Result] = {}
    try:
        for result in place_of_searches().outcomes(task, iter(numbers), min(jobs, len(numbers)), stop):
            if result is not None:
                found[result.start] = result
    except WorkerDied as error:
        if not stop:  # the signal that stops us may have hit them too
            raise WorkerDied(f"optimiser: {error}; run again") from error
    return [found[number] for number in numbers if number in found]
