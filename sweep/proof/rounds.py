"""Distribution of boxes of designs over the cores, in rounds of work units, independent of the number of cores.

A round deals the open boxes, worst bounds first, to UNITS units in turn, and lets each unit evaluate the same number of
boxes.  Boxes that remain open go into the next round.  Finished units are kept in a folder, from which a stopped run
resumes.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import NamedTuple, TypeAlias

import numpy as np

from kernels.boxes.branching import COMBINED, OPEN
from kernels.types import Numbers
from sweep.dataset import files
from sweep.families.base import Array
from sweep.jobs.executors import Executor
from sweep.jobs.signals import Stop
from sweep.numerics.records import joined, only
from sweep.proof.question import Question
from sweep.study import ProveSettings

UNITS = 64
SHARES = (0.1, 0.15, 0.25, 0.5)  # shares of all boxes by round: later rounds have better bounds for choosing boxes
OUTCOMES = ("open", "too small", "bound", "empty")  # indexed by the numbers of kernels.boxes.branching
TellBoxes: TypeAlias = Callable[[int, int], None]


class Leaves(NamedTuple):
    """Boxes that were not halved: their bounds, outcome and proving rows."""

    low: Array  # (m, n)
    high: Array
    outcome: Numbers  # (m,) of OUTCOMES
    bound: Array  # (m,)
    kinds: Numbers  # (m, COMBINED), -1 for unused entries
    theta: Array
    factors: Array


def empty(rows: int, free: int) -> Leaves:
    """Return arrays for ``rows`` leaves over ``free`` coordinates."""
    return Leaves(
        np.zeros((rows, free)), np.zeros((rows, free)), np.zeros(rows, np.uint8), np.zeros(rows),
        np.full((rows, COMBINED), -1, np.int64), np.zeros((rows, COMBINED)), np.zeros((rows, COMBINED)),
    )  # fmt: skip


class Explored(NamedTuple):
    """Leaves of a search, number of evaluated boxes, whether time or a signal cut it short, and processor time.

    ``seconds`` is processor time of the boxes, over all runs of a search that was stopped.
    """

    leaves: Leaves
    judged: int
    cut_short: bool
    seconds: float


@dataclass(frozen=True)
class Cores:
    """Executor of the work units, its number of workers, and the flag that stops them."""

    place: Executor
    jobs: int
    stop: Stop


@dataclass(frozen=True)
class RoundUnit:
    """Evaluate the boxes of one unit of a round and write its leaves."""

    question: Question
    target: float  # in the unit of the proof's rows
    boxes: Leaves
    most: int
    smallest: float
    folder: Path
    round: int

    def path(self, number: int) -> Path:
        """Return the path of a unit's result."""
        return self.folder / f"round-{self.round}-unit-{number:02d}.npz"

    def __call__(self, number: int, should_stop: Callable[[], bool]) -> tuple[int, int]:
        """Return the number of the unit and of the boxes it evaluated."""
        mine = only(self.boxes, np.arange(number, len(self.boxes.bound), UNITS))
        if should_stop() or not len(mine.bound):
            return number, 0
        space, provable = self.question, self.question.provable
        leaves = empty(len(mine.bound) + self.most, mine.low.shape[1])
        fixed = (space.branch, provable.objectives[space.objective], space.cos2, space.links, self.target)
        for_kernel, starts = (*fixed, space.tube(self.target)), (mine.low, mine.high, mine.bound)
        search = (starts, space.high - space.low, space.free, space.given, self.smallest)
        provable.explore(for_kernel, (*search, 0), tuple(leaves))  # evaluates no box, but compiles the kernels
        begin = time.thread_time()
        filled, judged = provable.explore(for_kernel, (*search, self.most), tuple(leaves))
        _write(self.path(number), only(leaves, np.arange(filled)), judged, time.thread_time() - begin)
        return number, judged


def _write(path: Path, leaves: Leaves, judged: int, seconds: float) -> None:
    import io

    buffer = io.BytesIO()
    np.savez_compressed(buffer, judged=judged, seconds=seconds, **leaves._asdict())
    files.write_atomically(path, buffer.getvalue())


def _read(path: Path) -> Explored:
    with np.load(path) as data:
        leaves = Leaves(*(data[name] for name in Leaves._fields))
        return Explored(leaves, int(data["judged"]), False, float(data["seconds"]))


def explored(
    question: Question, target: float, settings: ProveSettings, folder: Path, cores: Cores, tell: TellBoxes
) -> Explored:
    """Halve boxes until every box is proven or the allowed number of boxes was evaluated.

    Parameters
    ----------
    question : the space, objective and limits
    target : in the unit of the proof's rows
    settings : largest number of boxes to evaluate, and their smallest size
    folder : folder of finished units; the same question must have the same folder
    cores : executor of the units, and its stop flag
    tell : called with the numbers of boxes evaluated so far and expected in all: a round ends early if units prove all
        of their boxes

    Returns
    -------
    All leaves, the evaluated boxes and processor time, and whether time or a signal cut the search short.
    """
    done: list[Leaves] = []
    start = empty(1, len(question.names))
    start.low[0], start.high[0] = question.low, question.high
    start.bound[0] = question.floor
    todo, judged, seconds, begin = start, 0, 0.0, time.monotonic()
    for number, share in enumerate(SHARES):
        if not len(todo.bound):
            break
        if cores.stop or (settings.seconds is not None and time.monotonic() - begin > settings.seconds):
            return Explored(joined(*done, todo), judged, True, seconds)
        most = max(int(settings.boxes * share) // UNITS, 1)
        unit = RoundUnit(question, target, _split(todo, question), most, settings.smallest, folder, number)
        counts = [_read(path).judged for path in _finished(unit)]  # of a stopped run
        missing = (k for k in range(UNITS) if not unit.path(k).is_file())
        for _, count in cores.place.outcomes(unit, missing, cores.jobs, cores.stop):
            counts.append(count)
            step = sum(counts)
            # A unit that used its whole share has boxes left.
            further = int(settings.boxes * sum(SHARES[number + 1 :])) if max(counts) == most else 0
            tell(judged + step, judged + step * UNITS // len(counts) + further)
        if cores.stop:
            return Explored(joined(*done, todo), judged, True, seconds)
        results = [_read(path) for path in _finished(unit)]
        judged += sum(result.judged for result in results)
        seconds += sum(result.seconds for result in results)
        leaves = joined(*(result.leaves for result in results))
        done.append(only(leaves, leaves.outcome != OPEN))
        todo = only(leaves, leaves.outcome == OPEN)
        todo = only(todo, np.lexsort((*todo.low.T, todo.bound)))
    return Explored(joined(*done, todo), judged, False, seconds)


def _split(boxes: Leaves, question: Question) -> Leaves:
    """Halve the widest side of every box until there are at least as many boxes as units."""
    sides = question.high - question.low
    while len(boxes.bound) < UNITS:
        low, high = boxes.low, boxes.high
        widest = np.argmax((high - low) / sides, axis=1)
        rows = np.arange(len(low))
        middle = 0.5 * (low[rows, widest] + high[rows, widest])
        first, second = only(boxes, rows), only(boxes, rows)
        first.high[rows, widest] = middle
        second.low[rows, widest] = middle
        boxes = joined(first, second)
    return boxes


def _finished(unit: RoundUnit) -> list[Path]:
    return [path for path in map(unit.path, range(UNITS)) if path.is_file()]
