"""Starts spread over processes, since most of a search runs in Python, where threads would block each other."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Generic, TypeVar

from sweep.chunks.plan import optimiser_hash
from sweep.errors import InputError, WorkerDied
from sweep.families.base import Array
from sweep.jobs.executors import Executor, Here, Task, place_of_searches
from sweep.jobs.signals import Stop
from sweep.optimise.local.kkt import Result
from sweep.optimise.local.start import search
from sweep.optimise.problem.statement import Problem

T = TypeVar("T")


class _PolledStop(Stop):
    """A stop flag that is set when a reader finds that ``asked`` returns true."""

    def __init__(self, should_stop: Callable[[], bool]) -> None:
        self._should_stop = should_stop
        super().__init__()

    def __bool__(self) -> bool:
        if not super().__bool__() and self._should_stop():
            self.set()
        return super().__bool__()


@dataclass(frozen=True)
class _SameSources(Generic[T]):
    """A task for workers, refused by a worker with sources other than those of the calling process."""

    task: Task[T]
    code: str

    def __call__(self, number: int, should_stop: Callable[[], bool]) -> tuple[int, T] | None:
        """Return the number with the result of the task, or None if the search is to stop."""
        sources = optimiser_hash()
        if sources != self.code:
            allowed = f"{self.code}, the sources and libraries of the process that searches"
            raise InputError("code", sources, allowed, "worker")
        return None if should_stop() else (number, self.task(number, should_stop))


@dataclass(frozen=True)
class SearchTask:
    """Search from one of the starts, which are numbered from ``first``."""

    problem: Problem
    starts: Array
    budget: float
    first: int = 0

    def __call__(self, number: int, should_stop: Callable[[], bool]) -> Result:
        """Return the result of the start with this number."""
        return search(number, self.problem, self.starts[number - self.first], should_stop, self.budget)


def spread_over(
    task: Task[T],
    numbers: list[int],
    should_stop: Callable[[], bool],
    jobs: int,
    tell: Callable[[int, T], None] = lambda _, __: None,
) -> list[T]:
    """Return the results of a task for the numbers begun before ``should_stop`` became true, in their order.

    A single number, or the work of a single worker, runs in this process; otherwise processes or the cluster of the run
    are used.  Each result is the same as in this process, to the bit.

    Parameters
    ----------
    task : task that can be pickled
    numbers : arguments of its calls
    should_stop : called in this process; workers are told to stop, and one that does not answer soon is abandoned
    jobs : number of workers
    tell : called with each number and its result

    Raises
    ------
    WorkerDied
        if a worker process was killed.
    """
    stop, checked_task = _PolledStop(should_stop), _SameSources(task, optimiser_hash())
    executor: Executor = Here() if jobs == 1 or len(numbers) == 1 else place_of_searches()
    results: dict[int, T] = {}
    try:
        for outcome in executor.outcomes(checked_task, iter(numbers), min(jobs, len(numbers)), stop):
            if outcome is not None:
                results[outcome[0]] = outcome[1]
                tell(*outcome)
    except WorkerDied as error:
        if not stop:  # the signal that stops this process may have reached the workers too
            raise WorkerDied(f"optimiser: {error}; run again") from error
    return [results[number] for number in numbers if number in results]
