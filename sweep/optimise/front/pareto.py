"""Fronts: the objective minimised for each of several bounds on a second output (epsilon constraint)."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from kernels import status as st
from sweep.errors import InputError
from sweep.evaluation.summaries import design_outputs
from sweep.families.base import Array
from sweep.jobs.signals import Deadline
from sweep.optimise.local.kkt import Result
from sweep.optimise.multistart.multistart import minimise
from sweep.optimise.multistart.survey import CUT
from sweep.optimise.problem.statement import PLACE, Problem
from sweep.quantities.limits import compared
from sweep.study import Limit, OptimiseSettings, ParetoSettings

LEAST_WIDTH = 1.0 / 256.0  # share of the range of bounds: a narrower gap is a jump of the front, which no point fills
LEAST_AREA = 1e-4  # share of the square around the front: a smaller triangle is no gap
SHOWN = 0.02  # share of that square above which a gap is reported


@dataclass(frozen=True)
class FrontSearch:
    """Bounds on a second output, the loosest first, with the best result known for each.

    ``results`` holds None for a bound not yet searched; ``found`` is the step that found each result; ``taken`` counts
    the finished steps.  The first ``given`` bounds are those of the study; further ones are placed until there are
    ``points``, or until the front is ``filled``, without a gap that a point could fill.  A front is the whole state of
    a search, which can be interrupted between two steps.
    """

    bounds: tuple[float, ...]
    results: tuple[Result | None, ...]
    found: tuple[int, ...]
    taken: int = 0
    given: int = 0
    points: int = 0
    filled: bool = False

    @classmethod
    def of(cls, settings: ParetoSettings) -> FrontSearch:
        """Return a front without results."""
        bounds = tuple(sorted(set(settings.bounds), reverse=not settings.at_least))
        none, never = (None,) * len(bounds), (-1,) * len(bounds)
        return cls(bounds, none, never, given=len(bounds), points=settings.points or len(bounds))

    @property
    def steps(self) -> int:
        """Number of steps: those of the given bounds, and one for each further point."""
        return len(steps(self.given)) + max(self.points - self.given, 0)

    @property
    def complete(self) -> bool:
        """Whether every step is finished."""
        return self.taken == self.steps or self.filled

    def known(self) -> list[tuple[float, Result]]:
        """Return the searched bounds with their results."""
        return [(b, r) for b, r in zip(self.bounds, self.results, strict=True) if r is not None]


@dataclass(frozen=True)
class FrontStep:
    """Search of bound ``target`` from the result of its neighbour, in the first pass from all starts as well."""

    target: int
    neighbour: int
    first: bool


def steps(count: int) -> tuple[FrontStep, ...]:
    """List the steps of a front: from the loosest bound to the tightest, back, and to the tightest again.

    Each search starts from its neighbour's result, so a good design reaches every bound that it satisfies.
    """
    tighten = [FrontStep(k, k - 1, first=True) for k in range(count)]
    loosen = [FrontStep(k, k + 1, first=False) for k in range(count - 2, -1, -1)]
    tighten_again = [FrontStep(k, k - 1, first=False) for k in range(1, count)]
    return (*tighten, *loosen, *tighten_again)


def searches(settings: ParetoSettings) -> int:
    """Return the largest number of local searches of a front, from the settings alone."""
    count = len(FrontSearch.of(settings).bounds)
    placed = max((settings.points or count) - count, 0)
    # Each bound adds the optimum as a start, from the second bound on also the previous result.  A placed bound starts
    # from both neighbours as well, and its result is tried for them.
    return count * (settings.starts + 1) + max(0, 3 * (count - 1)) + placed * (settings.starts + 5)


def bounded(problem: Problem, settings: ParetoSettings, bound: float) -> Problem:
    """Return the problem with the bound replacing its own limit on that side of the second output."""
    name = settings.output
    others = tuple(limit for limit in problem.limits if limit.output != name)
    same_output = [limit for limit in problem.limits if limit.output == name]
    if settings.at_least:
        highest = min((x.maximum for x in same_output if x.maximum is not None), default=None)
        return replace(problem, limits=(*others, Limit(name, float(bound), highest)))
    lowest = max((x.minimum for x in same_output if x.minimum is not None), default=None)
    return replace(problem, limits=(*others, Limit(name, lowest, float(bound))))


def pareto(
    problem: Problem,
    settings: ParetoSettings,
    starts: Array | Sequence[Array],
    stop: Callable[[], bool] | None = None,
    jobs: int = 1,
) -> list[Result]:
    """Return the minimised objective for each bound on the second output, the loosest bound first.

    With ``settings.points`` further bounds are placed, one after the other in the middle of the largest gap.  Every
    bound is searched from its starts and from the result of the next looser one.  Then the results are passed from the
    tighter to the looser bounds, which they satisfy too, and forth again, so a bound never has a worse design than a
    tighter one.  A bound that is not active repeats the design.

    Parameters
    ----------
    problem : objective and limits; the bound replaces a limit on its side of the second output, the other side stays
    settings : second output and bounds; ``time_budget`` is an emergency deadline for the whole front
    starts : (k, P) designs for all bounds, or one such array for each bound, the loosest first
    stop : as for :func:`sweep.optimise.minimise`; the bounds reached until then are returned
    jobs : processes

    Returns
    -------
    One result per searched bound; an infeasible one says so in its ``status``.  The same starts give the same
    results, unless the search was stopped.

    Raises
    ------
    InputError
        if the second output is no design output of the family, or the objective itself, or there is no start.
    """
    front = FrontSearch.of(settings)
    for advanced in advance(problem, settings, front, starts, stop, jobs):
        front = advanced
    return [result for _, result in front.known()]


def advance(
    problem: Problem,
    settings: ParetoSettings,
    front: FrontSearch,
    starts: Array | Sequence[Array],
    stop: Callable[[], bool] | None = None,
    jobs: int = 1,
) -> Iterator[FrontSearch]:
    """Yield the front after each further step; parameters as for :func:`pareto`.

    A resumed front takes the same steps as an uninterrupted one, to the bit.  A step cut short by ``stop`` keeps its
    best result but does not count as taken, and the search ends.
    """
    if settings.output == problem.objective:
        raise InputError("second output", settings.output, "another output than the objective", PLACE)
    starts_of = [np.atleast_2d(s) for s in ([starts] * len(front.bounds) if isinstance(starts, np.ndarray) else starts)]
    should_stop, plan = Deadline(settings.time_budget, stop), steps(front.given)
    for number in range(front.taken, len(plan)):
        step = plan[number]
        designs = _step_starts(front, step, starts_of[step.target])
        if designs is not None:
            result = _search(problem, settings, front.bounds[step.target], designs, should_stop, jobs)
            front = _with_result(front, step, number, result)
            if result.ended in CUT or should_stop():
                yield front
                return
        front = replace(front, taken=number + 1)
        yield front
    while not front.complete:
        front, cut = _with_new_point(problem, settings, front, starts_of, should_stop, jobs)
        yield front
        if cut:
            return


def _with_new_point(
    problem: Problem,
    settings: ParetoSettings,
    front: FrontSearch,
    starts: Sequence[Array],
    should_stop: Callable[[], bool],
    jobs: int,
) -> tuple[FrontSearch, bool]:
    """Return the front with one more bound, in the middle of its largest gap, and whether the search was cut short.

    The bound is searched from the results of both neighbours and from the starts of the next tighter given bound.  Its
    result is then a start for the tighter neighbour, and for looser bounds as long as it is better there.
    """
    open_gaps = gaps(np.array(front.bounds), *front_points(problem, settings, front))
    if not open_gaps:
        return replace(front, filled=True), False
    index, bound, number = open_gaps[0].number + 1, open_gaps[0].middle, front.taken
    given = FrontSearch.of(settings).bounds
    tighter = next(k for k, b in enumerate(given) if (b >= bound if settings.at_least else b <= bound))
    neighbours = [r.design[None, :] for r in (front.results[index - 1], front.results[index]) if r is not None]
    designs = np.concatenate([*neighbours, starts[tighter]])
    _, first = np.unique(designs, axis=0, return_index=True)
    front = replace(
        front,
        bounds=(*front.bounds[:index], bound, *front.bounds[index:]),
        results=(*front.results[:index], None, *front.results[index:]),
        found=(*front.found[:index], -1, *front.found[index:]),
    )
    result = _search(problem, settings, bound, designs[np.sort(first)], should_stop, jobs)
    front = _with_result(front, FrontStep(index, index - 1, first=True), number, result)
    for step in (
        FrontStep(index + 1, index, first=False),
        *(FrontStep(k, k + 1, first=False) for k in range(index, -1, -1)),
    ):
        neighbour, present = front.results[step.neighbour], front.results[step.target]
        if neighbour is None or present is None or not neighbour.feasible or should_stop():
            continue
        if step.target < step.neighbour and not neighbour.rank < present.rank:
            continue
        improved = _search(problem, settings, front.bounds[step.target], neighbour.design[None, :], should_stop, jobs)
        front = _with_result(front, step, number, improved)
    cut = should_stop()
    return replace(front, taken=number + (not cut)), cut


def front_points(problem: Problem, settings: ParetoSettings, front: FrontSearch) -> tuple[Array, Array]:
    """Return second output and objective of each result; the bound and nan for a bound without a feasible one."""
    reached, values = np.array(front.bounds, np.float64), np.full(len(front.bounds), np.nan)
    feasible = {k: r for k, r in enumerate(front.results) if r is not None and r.feasible}
    if feasible:
        numbers, designs = list(feasible), np.array([r.design for r in feasible.values()])
        outputs = design_outputs(problem.family, designs, [settings.output], problem.accuracy, problem.window)
        measured = compared(settings.output, np.asarray(outputs[settings.output], np.float64))
        reached[numbers] = np.where(np.isfinite(measured), measured, reached[numbers])
        values[numbers] = [r.objective for r in feasible.values()]
    return reached, values


@dataclass(frozen=True)
class FrontGap:
    """Two neighbouring points of a front: number of the looser one, and size of the gap.

    The objective can only grow as the bound tightens, so between two points the front lies in the rectangle they span,
    and a convex front in its lower triangle.  ``area`` is that of the triangle, with both axes scaled to 1.  ``middle``
    is the bound in the middle of the gap.
    """

    number: int
    area: float
    middle: float


def gaps(bounds: Array, reached: Array, values: Array) -> list[FrontGap]:
    """Return the gaps of a front that a point could fill, the largest first.

    Of equal gaps the looser comes first.  Between the bound of a point and its second output the front is flat, so a
    gap extends from the second output of the looser point to the bound of the tighter one.

    Parameters
    ----------
    bounds : bounds on the second output, the loosest first
    reached : second output of the points; the bound if nothing was found
    values : minimised objective, nan if no design keeps the bound: the front ends before it, at unknown height
    """
    solved = np.isfinite(values)
    if bounds.size < 2 or not solved.any():
        return []
    sense = np.sign(bounds[-1] - bounds[0])
    width = float(sense * (bounds[-1] - reached[0]))
    height = float(np.ptp(values[solved]))
    fillable = []
    for k in range(bounds.size - 1):
        step = float(sense * (bounds[k + 1] - reached[k])) / width if width > 0.0 else 0.0
        rise = 0.0
        if solved[k] and solved[k + 1]:
            rise = abs(values[k + 1] - values[k]) / height if height > 0.0 else 0.0
        elif solved[k] or solved[k + 1]:
            rise = 1.0
        if step >= LEAST_WIDTH and 0.5 * step * rise >= LEAST_AREA:
            fillable.append(FrontGap(k, 0.5 * step * rise, 0.5 * float(reached[k] + bounds[k + 1])))
    return sorted(fillable, key=lambda gap: (-gap.area, gap.number))


def _step_starts(front: FrontSearch, step: FrontStep, starts: Array) -> Array | None:
    """Return the starting designs of a step, or None if the neighbour offers nothing new."""
    neighbour = front.results[step.neighbour] if 0 <= step.neighbour < len(front.bounds) else None
    if step.first:
        designs = starts if neighbour is None else np.concatenate([neighbour.design[None, :], starts])
        _, first_rows = np.unique(designs, axis=0, return_index=True)
        return np.asarray(designs[np.sort(first_rows)], np.float64)
    present = front.results[step.target]
    if neighbour is None or present is None:
        return None
    passed_before = step.neighbour < step.target and front.found[step.neighbour] < front.given
    infeasible = present.feasible and not neighbour.feasible
    offers = not (passed_before or infeasible or np.array_equal(neighbour.design, present.design))
    # A search that has not converged is continued from its end.
    unfinished = present.status == st.NOT_CONVERGED
    chosen = [neighbour.design] * offers + [present.design] * unfinished
    return np.array(chosen) if chosen else None


def _search(
    problem: Problem,
    settings: ParetoSettings,
    bound: float,
    starts: Array,
    should_stop: Callable[[], bool],
    jobs: int,
) -> Result:
    # All starts of a bound are searched: the stopping rule of the survey is switched off.
    search = OptimiseSettings(len(starts), unseen=0.0, looks=settings.looks)
    results = minimise(bounded(problem, settings, bound), starts, search, should_stop, jobs)
    cut = any(r.ended in CUT for r in results) or len(results) < len(starts)
    return replace(results[0], ended="time") if cut and results[0].ended not in CUT else results[0]


def _with_result(front: FrontSearch, step: FrontStep, number: int, result: Result) -> FrontSearch:
    """Return the front with this result if it is better than the known one."""
    present = front.results[step.target]
    if present is not None and not result.rank < present.rank:
        return front
    results, found = list(front.results), list(front.found)
    results[step.target], found[step.target] = result, number
    return replace(front, results=tuple(results), found=tuple(found))
