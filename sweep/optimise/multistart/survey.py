"""Stopping rule and reliability of a search: basins in which its starts ended, estimated share of unseen ones."""

from __future__ import annotations

import json
import math
from collections import Counter
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from sweep.dataset.files import metadata
from sweep.errors import how_many
from sweep.families.base import Array
from sweep.optimise.local.kkt import AGREE, Result
from sweep.optimise.problem.statement import Problem
from sweep.study import OptimiseSettings

GROUP_SIZE = 6  # starts searched between two checks of the stopping rule
CONFIRMATIONS = 3  # distinct starts that have to end in the best basin
UNSEEN = 0.02  # default of the estimated share of unseen basins below which a search ends; populations need no estimate
DISTINCT = 0.05  # share of the average distance of two random designs below which starts are not distinct
CUT = ("time", "interrupted")  # endings of a start whose search was cut short


class StartGroup(NamedTuple):
    """Starts that are searched as one group.

    Parameters
    ----------
    designs : (k, P), the best first
    source : number of the sample or population of the starts, -1 for all others.  Starts of different sources are
        independent and always distinct; those of one source are distinct if they are far apart.
    counted : number of leading starts that count in the survey of basins; the others are searched without counting.  Of
        a population, which has selected its ends itself, only the best counts.  None counts all.
    problem : problem with bounds that contain the designs, if it differs from that of the search
    """

    designs: Array
    source: int = -1
    counted: int | None = None
    problem: Problem | None = None


def in_groups(starts: Array) -> Iterator[StartGroup]:
    """Yield starts (k, P) in groups of at most six, independent of the number of jobs."""
    for first in range(0, len(starts), GROUP_SIZE):
        yield StartGroup(starts[first : first + GROUP_SIZE])


def counted(groups: Sequence[StartGroup]) -> list[bool]:
    """Tell for each start of some groups whether it counts."""
    return [group.counted is None or k < group.counted for group in groups for k in range(len(group.designs))]


@dataclass(frozen=True)
class Survey:
    """Survey of the starts of a search.

    Parameters
    ----------
    starts : number of starts whose search was not cut short
    asked : largest number of starts, or populations, that the study allows
    basins : number of different values of feasible ends; values within 1e-4 count as one basin
    best : number of distinct starts that ended in the best basin
    unseen : estimated share of unseen basins, by their volume; 1 if no start became feasible
    wanted : share that ``unseen`` should fall below
    ended : "enough" if the stopping rule holds, "starts" if none was left, "time" or "interrupted"
    kinds : numbers of starts and basins for each combination of signs, as ``(("branch = 1", 7, 3), ...)``
    late : whether time ran out after all starts, during the steps that follow them
    populations : number of counted populations, each with its best end; 0 if starts were counted
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
        """Whether the best basin was met often enough and the estimated share of unseen basins is small enough."""
        return self.best >= CONFIRMATIONS and self.unseen <= self.wanted

    @property
    def words(self) -> str:
        """Summary: local optima found, starts that ended in the best, chance that another start finds a new one."""
        if self.basins == 0:
            return "none led to a design within all limits"
        optima = optima_words(self.basins)
        if self.populations:
            populations = how_many(self.populations, "population")
            return f"{populations} ended best in {optima}, {self.best} of them in the best one; {self._chance}"
        return f"{optima} found, the best from {how_many(self.best, 'distinct start')}; {self._chance}"

    @property
    def _chance(self) -> str:
        another = "population" if self.populations else "start"
        known = self.unseen < 1.0 or self.basins > 1
        chance = f"an estimated chance of {_percent(self.unseen)}" if known else "an unknown chance"
        return f"another {another} finds a new one with {chance}"

    @property
    def _too_few(self) -> str:
        """Say how many starts the wanted share takes if so few can never show it: w = 1 in the note of `survey`."""
        least = math.ceil(0.5 + math.sqrt(0.25 + 2.0 / self.wanted)) if self.wanted else 0
        what = "populations" if self.populations else "starts"
        return f", which takes at least {least} {what}" if self.asked < least else ""

    @property
    def warnings(self) -> tuple[str, ...]:
        """Warnings that a reader needs before trusting the result."""
        return (*self.shortcomings, *self.doubts)

    @property
    def shortcomings(self) -> tuple[str, ...]:
        """Parts of the search that were requested and not done."""
        messages = []
        if self.ended in CUT:
            why = "time ran out" if self.ended == "time" else "interrupted"
            limit = how_many(self.asked, "start")
            of = how_many(self.starts, "start") if self.populations else f"{self.starts} of {limit}"
            after = "; not all that follows them, neighbouring values and robust designs, was" if self.late else ""
            messages.append(f"{why}: {of}{after}")
        elif not self.populations and self.starts < self.asked and not self.enough:
            starts = how_many(self.starts, "start")
            messages.append(f"only {starts} of the {self.asked} asked: no more were found in the design space")
        return tuple(messages)

    @property
    def doubts(self) -> tuple[str, ...]:
        """Reasons why a better result than that of the search may exist."""
        messages = []
        if self.ended == "starts" and self.basins and not self.enough:
            of = "populations" if self.populations else "distinct starts"
            confirmed = f"the best local optimum was found from {self.best} of the {CONFIRMATIONS} {of} wanted"
            parts = [confirmed] if self.best < CONFIRMATIONS else []
            if self.unseen > self.wanted:
                parts.append(f"{self._chance}, not the {_percent(self.wanted)} wanted{self._too_few}")
            more = "populations" if self.populations else "starts"
            messages.append(f"{' and '.join(parts)}: more {more} may find a better one")
        return tuple(messages)


def survey(
    problem: Problem, groups: Sequence[StartGroup], results: Sequence[Result], settings: OptimiseSettings, ended: str
) -> Survey:
    """Return the survey of the results of a search.

    Parameters
    ----------
    problem : its variables define the distance of two starts
    groups : groups of starts, numbered one group after the other
    results : results of the begun starts, in any order
    settings : wanted number of starts, and allowed share of unseen basins
    ended : ending of the search

    Notes
    -----
    The unseen share is the larger of two estimates for n starts that met w basins, s of them once: s / n (Good and
    Turing) and w (w + 1) / (n (n - 1)) (Boender and Rinnooy Kan 1987, for unknown volumes).  Both assume random starts;
    these are the best of samples, so the estimate refers to further starts of the same kind.  Populations are random:
    they differ by their seeds alone.
    """
    finished = [r for r in results if r.ended not in CUT]
    empty = np.empty((0, len(problem.family.parameters)))
    numbered, starts = with_basins(finished), np.concatenate([empty, *(group.designs for group in groups)])
    source = [group.source for group in groups for _ in group.designs]
    counts = counted(groups)
    counted_results = [r for r in numbered if r.basin and counts[r.start]]
    hits = Counter(r.basin for r in counted_results)
    in_best = sorted(r.start for r in counted_results if r.basin == 1)
    best = len(distinct(problem, starts, np.column_stack([starts[:, problem.others], source]), in_best, DISTINCT))
    populations = hits.total() if settings.by_populations else 0
    return Survey(
        len(finished), most_counted(settings), len(hits), best, _unseen(hits), wanted(settings), ended,
        _kinds(problem, starts, numbered), populations=populations,
    )  # fmt: skip


def optima_words(count: int) -> str:
    """Write a number of basins as ``1 local optimum`` or ``3 local optima``, as users read it."""
    return "1 local optimum" if count == 1 else f"{count} local optima"


def most_counted(settings: OptimiseSettings) -> int:
    """Return the largest number of starts, or populations, that are counted."""
    return settings.populations if settings.by_populations else settings.starts


def wanted(settings: OptimiseSettings) -> float:
    """Return the share of unseen basins below which a search ends; 1 by default for populations."""
    if settings.unseen is not None:
        return settings.unseen
    return 1.0 if settings.by_populations else UNSEEN


def basins(values: Sequence[float]) -> list[int]:
    """Return the number of each value's basin, 1 for the smallest; 0 for values that are not finite."""
    numbers, number, first = [0] * len(values), 0, 0.0
    for k in sorted((k for k, x in enumerate(values) if math.isfinite(x)), key=lambda k: values[k]):
        if not number or not values[k] - first <= AGREE * max(abs(first), 1e-300):
            number, first = number + 1, values[k]
        numbers[k] = number
    return numbers


def with_basins(results: Sequence[Result]) -> list[Result]:
    """Return results with their basin, ordered by rank: 1 for the best; infeasible ones have 0 and come last."""
    numbers = basins([r.objective if r.feasible else math.inf for r in results])
    numbered = [replace(r, basin=number) for r, number in zip(results, numbers, strict=True)]
    return sorted(numbered, key=lambda r: (*r.rank, r.start))


def _unseen(hits: Counter[int]) -> float:
    """Return the larger of both estimates of the share of unseen basins; 1 for fewer than two starts."""
    n, w = hits.total(), len(hits)
    singletons = sum(1 for count in hits.values() if count == 1)
    return min(1.0, max(singletons / n, w * (w + 1) / (n * (n - 1)))) if n > 1 else 1.0


def distinct(
    problem: Problem, designs: Array, kinds: Array, rows: Iterable[int], share: float, first: Iterable[int] = ()
) -> list[int]:
    """Return the ``first`` rows of designs (k, P), and those of ``rows`` that are not near an earlier one.

    Two designs are near each other if their ``kinds`` (k, n) are equal and their distance is below a ``share`` of the
    average distance of two random designs.
    """
    x, taken = problem.scaled(designs), list(first)
    distance = share * math.sqrt(x.shape[1] / 6.0)
    for k in rows:
        far = np.linalg.norm(x[taken] - x[k], axis=1) >= distance
        if (far | (kinds[taken] != kinds[k]).any(axis=1)).all():
            taken.append(k)
    return taken


def _kinds(problem: Problem, starts: Array, results: Sequence[Result]) -> tuple[tuple[str, int, int], ...]:
    """Return numbers of starts and basins for each combination of the parameters that are not varied."""
    columns = [c for c in problem.others if len(np.unique(starts[:, c])) > 1]
    own = problem.family.parameters
    count: Counter[str] = Counter()
    basins: dict[str, set[int]] = {}
    for r in results:
        words = ", ".join(f"{own[c].name} = {_written(starts[r.start, c], own[c].unit)}" for c in columns)
        count[words] += 1
        basins.setdefault(words, set()).update({r.basin} - {0})
    return tuple((words, count[words], len(basins[words])) for words in sorted(count)) if columns else ()


def _written(value: float, unit: str) -> str:
    return f"{math.degrees(value):.6g} deg" if unit == "angle" else f"{value:.6g}"


def _percent(share: float) -> str:
    value = 100.0 * share
    return f"{value:.0f} %" if value >= 9.95 or value == round(value) else f"{value:.2g} %"


def survey_of(content: dict[str, Any]) -> Survey:
    """Return the survey stored as a dict."""
    return Survey(**content | {"kinds": tuple(tuple(kind) for kind in content["kinds"])})


def read_survey(path: Path) -> Survey | None:
    """Return the survey of a search from its ``_optimum.parquet``, or None without one."""
    content = metadata(path).get(b"search")
    return None if content is None else survey_of(json.loads(content))
