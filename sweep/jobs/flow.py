"""What an executor is, and how those with a pool of workers keep them all at work."""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Iterator
from concurrent.futures import FIRST_COMPLETED, Future, wait
from typing import Protocol, TypeVar

from sweep.jobs.signals import Stop

T = TypeVar("T")
T_co = TypeVar("T_co", covariant=True)

POLL = 0.05  # between two looks at the flag [s]


class Task(Protocol[T_co]):
    """What a worker does with one number; ``should_stop`` is to be asked often."""

    def __call__(self, number: int, should_stop: Callable[[], bool]) -> T_co:
        """Do it."""
        ...


class Executor(Protocol):
    """Runs a task for many numbers."""

    def outcomes(self, task: Task[T], numbers: Iterator[int], jobs: int, stop: Stop) -> Iterator[T]:
        """Yield what the task returns, in the order in which it is ready.

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


def flow(
    submit: Callable[[int], Future[T]],
    numbers: Iterator[int],
    jobs: Callable[[], int],
    stop: Stop,
    grace: float = math.inf,
) -> Iterator[T]:
    """Yield outcomes as they come; one number more than there are workers is on its way, so that none of them waits.

    Parameters
    ----------
    submit : begin the task of a number
    numbers, stop : as for `Executor`
    jobs : how many workers there are now
    grace : how long tasks may take to hand back what they have once they are to stop [s]
    """
    waiting: set[Future[T]] = set()
    late = math.inf
    while True:
        while not stop and len(waiting) <= jobs() and (number := next(numbers, None)) is not None:
            waiting.add(submit(number))
        if not waiting or time.monotonic() > late:
            return
        done, waiting = wait(waiting, timeout=POLL, return_when=FIRST_COMPLETED)
        for future in done:
            yield future.result()
        if stop and late == math.inf:
            late = time.monotonic() + grace
