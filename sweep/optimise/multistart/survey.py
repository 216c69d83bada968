"""When a search ends and how far it can be relied upon: basins its starts ended in, estimated share of unseen ones."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from sweep.errors import how_many
from sweep.families.base import Array
from sweep.optimise.local.kkt import AGREE, Result
from sweep.optimise.problem.statement import Problem

if TYPE_CHECKING:
    from sweep.study import OptimiseSettings

TOGETHER = 6  # starts between two looks at whether more are needed
MET = 3  # distinct starts that have to end in the best basin
UNSEEN = 0.02  # share of basins that starts may leave unseen, unless a study asks for another; of populations all
DISTINCT = 0.05  # of the average distance of two random designs: nearer starts are not distinct
CUT = ("time", "interrupted")  # how a start ends that was not searched to its end


class Group(NamedTuple):
    """Starts that are searched from together.

    Parameters
    ----------
    designs : (k, P), the best first
    source : the sample or population that they come from, -1 for all others.  Starts of different sources are distinct
        wherever they stand, since these know nothing of each other; those of one source where they stand apart.
    counted : the first so many tell which basins there are; the others are searched from and do not count.  A
        population has chosen its ends itself, so its best one counts alone.  None counts all.
    problem : with bounds that hold the designs, where they are not those of the search
    """

    designs: Array
    source: int = -1
    counted: int | None = None
    problem: Problem | None = None


def in_groups(starts: Array) -> Iterator[Group]:
    """Yield starts (k, P) in groups of at most six, which are the same for any number of jobs."""
    for first in range(0, len(starts), TOGETHER):
        yield Group(starts[first : first + TOGETHER])


def counted(groups: Sequence[Group]) -> list[bool]:
    """Return for each start of some groups whether it counts."""
    return [group.counted is None or k < group.counted for group in groups for k in range(len(group.designs))]


@dataclass(frozen=True)
class Survey:
    """What the starts of a search tell of it.

    Parameters
    ----------
    starts : starts that were searched to their end
    asked : the most starts, or populations, that the study allows
    basins : different values the feasible ones ended at; values within 1e-4 count as one basin
    best : distinct starts that ended in the best basin
    unseen : estimated share of basins, by their volume, that no start has met; 1 where no start became feasible
    wanted : what ``unseen`` should fall below
    ended : "enough" where the rule was fulfilled, "starts" where none was left, "time" or "interrupted"
    kinds : starts and basins for each combination of signs, as ``(("branch = 1", 7, 3), ...)``
    late : whether all starts were searched, and time ran out over what follows them
    populations : those that were counted, each with its best end; 0 where starts were counted
    """

    starts: int
    asked: int
    basins: int
    best: int
    unseen: float
    wanted: float
    ended: str
    kinds: tuple[tuple[str, int, int], ...] = ()
    late: bool = False
    populations: int = 0

    @property
    def enough(self) -> bool:
        """Whether the best basin was met often enough and few basins are likely to be unseen."""
        return self.best >= MET and self.unseen <= self.wanted

    @property
    def words(self) -> str:
        """``14 basins met, the best 5 times, estimated unseen 1 %``."""
        if self.basins == 0:
            return f"none of {how_many(self.starts, 'start')} became feasible"
        basins = f"{how_many(self.basins, 'basin')} met"
        times = {1: "once", 2: "twice"}.get(self.best, f"{self.best} times")
        by = f" by {how_many(self.populations, 'population')}" if self.populations else ""
        return f"{basins}{by}, the best {times}, estimated unseen {_percent(self.unseen)}"

    @property
    def warnings(self) -> tuple[str, ...]:
        """The warnings that a reader has to know before trusting the result."""
        return (*self.shortcomings, *self.doubts)

    @property
    def shortcomings(self) -> tuple[str, ...]:
        """The parts of the search that were asked for and not done."""
        found = []
        if self.ended in CUT:
            why = "time ran out" if self.ended == "time" else "interrupted"
            asked = how_many(self.asked, "start")
            of = how_many(self.starts, "start") if self.populations else f"{self.starts} of {asked}"
            after = "; not all that follows them, neighbouring values and robust designs, was" if self.late else ""
            found.append(f"{why}: {of}{after}")
        elif not self.populations and self.starts < self.asked and not self.enough:
            some = how_many(self.starts, "start")
            found.append(f"only {some} of the {self.asked} asked: no more were found in the design space")
        return tuple(found)

    @property
    def doubts(self) -> tuple[str, ...]:
        """Why there may be something better than what the search found."""
        found = []
        if self.ended == "starts" and self.basins and not self.enough:
            of = "populations" if self.populations else "distinct valleys"
            rare = f"the best basin was met from {self.best} of the {MET} {of} wanted"
            parts = [rare] if self.best < MET else []
            if self.unseen > self.wanted:
                parts.append(f"the share of unseen basins is estimated at {_percent(self.unseen)}, not the "
                             f"{_percent(self.wanted)} asked")  # fmt: skip
            more = "populations" if self.populations else "starts"
            found.append(f"{' and '.join(parts)}: more {more} may find a better one")
        return tuple(found)


def survey(
    problem: Problem, groups: Sequence[Group], results: Sequence[Result], settings: OptimiseSettings, ended: str
) -> Survey:
    """Return what the results of a search tell of it.

    Parameters
    ----------
    problem : whose variables tell how far two starts are apart
    groups : the starts, which are numbered one group after the other
    results : of those that were begun, in any order
    settings : the number of starts asked, and the share of unseen basins that is allowed
    ended : how the search ended

    Notes
    -----
    The unseen share is the larger of two estimates for n starts that met w basins, s of them once: s / n (Good and
    Turing) and w (w + 1) / (n (n - 1)) (Boender and Rinnooy Kan 1987, for unknown volumes).  Both suppose that starts
    are drawn at random; these are the best of samples, so the estimate is about further starts of the same kind.
    Populations are drawn at random: they differ by their seeds alone.
    """
    whole = [r for r in results if r.ended not in CUT]
    none = np.empty((0, len(problem.family.parameters)))
    numbered, starts = with_basins(whole), np.concatenate([none, *(group.designs for group in groups)])
    source = [group.source for group in groups for _ in group.designs]
    counts = counted(groups)
    known = [r for r in numbered if r.basin and counts[r.start]]
    met = Counter(r.basin for r in known)
    best = _distinct(problem, starts, [r.start for r in known if r.basin == 1], source)
    populations = met.total() if settings.by_populations else 0
    return Survey(
        len(whole), most_counted(settings), len(met), best, _unseen(met), wanted(settings), ended,
        _kinds(problem, starts, numbered), populations=populations,
    )  # fmt: skip


def most_counted(settings: OptimiseSettings) -> int:
    """Return how many starts, or populations, are counted at most."""
    return settings.populations if settings.by_populations else settings.starts


def wanted(settings: OptimiseSettings) -> float:
    """Share of unseen basins below which a search ends: of populations the best basin alone decides unless asked."""
    if settings.unseen is not None:
        return settings.unseen
    return 1.0 if settings.by_populations else UNSEEN


def basins(values: Sequence[float]) -> list[int]:
    """Return the number of the basin of each value, 1 for the least; 0 for what is no number."""
    numbers, number, first = [0] * len(values), 0, 0.0
    for k in sorted((k for k, x in enumerate(values) if math.isfinite(x)), key=lambda k: values[k]):
        if not number or not values[k] - first <= AGREE * max(abs(first), 1e-300):
            number, first = number + 1, values[k]
        numbers[k] = number
    return numbers


def later(found: Survey) -> Survey:
    """Return the survey of a search whose time ran out when its starts had been searched."""
    return replace(found, ended="time", late=True)


def with_basins(results: Sequence[Result]) -> list[Result]:
    """Return results with their basin, in its order: 1 for the best; infeasible ones have 0 and come last."""
    numbers = basins([r.objective if r.feasible else math.inf for r in results])
    found = [replace(r, basin=number) for r, number in zip(results, numbers, strict=True)]
    return sorted(found, key=lambda r: (*r.rank, r.start))


def _unseen(met: Counter[int]) -> float:
    """Return the larger of both estimates of the share of unseen basins; 1 where they say nothing."""
    n, w = met.total(), len(met)
    once = sum(1 for count in met.values() if count == 1)
    return min(1.0, max(once / n, w * (w + 1) / (n * (n - 1)))) if n > 1 else 1.0


def _distinct(problem: Problem, starts: Array, numbers: list[int], source: Sequence[int]) -> int:
    """Return how many of some starts stand in distinct valleys, or come from distinct sources."""
    place = problem.scaled(starts)
    others = [c for c in range(starts.shape[1]) if c not in problem.columns]
    least = DISTINCT * math.sqrt(place.shape[1] / 6.0)
    taken: list[int] = []
    for k in sorted(numbers):
        near = (
            np.linalg.norm(place[k] - place[j]) < least
            and source[k] == source[j]
            and np.array_equal(starts[k, others], starts[j, others])
            for j in taken
        )
        if not any(near):
            taken.append(k)
    return len(taken)


def _kinds(problem: Problem, starts: Array, results: Sequence[Result]) -> tuple[tuple[str, int, int], ...]:
    """Return starts and basins for each combination of the parameters that are chosen, not varied."""
    others = [c for c in range(starts.shape[1]) if c not in problem.columns]
    differ = [c for c in others if len(np.unique(starts[:, c])) > 1]
    names = problem.family.parameter_names
    count: Counter[str] = Counter()
    basins: dict[str, set[int]] = {}
    for r in results:
        words = ", ".join(f"{names[c]} = {starts[r.start, c]:.6g}" for c in differ)
        count[words] += 1
        basins.setdefault(words, set()).update({r.basin} - {0})
    return tuple((words, count[words], len(basins[words])) for words in sorted(count)) if differ else ()


def _percent(share: float) -> str:
    value = 100.0 * share
    return f"{value:.0f} %" if value >= 9.95 or value == round(value) else f"{value:.2g} %"
