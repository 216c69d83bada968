"""Starts without a dataset: the best of large samples, improved by successively smaller samples around them.

Every six starts come from a separate sample, since one sample may hit a region that another one misses.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sweep.evaluation.summaries import design_outputs
from sweep.families.base import Accuracy, Array
from sweep.families.names import is_flag, stem
from sweep.optimise.multistart.survey import GROUP_SIZE, StartGroup
from sweep.optimise.problem.program import violation_scale
from sweep.optimise.problem.statement import Problem
from sweep.quantities.limits import compared
from sweep.quantities.measures import ROTATABLE_MARGIN, margins

SAMPLED = 1 << 15  # designs per start; on a locus they cost a third of a microsecond each
BLOCK, LEAST_BLOCK = 1 << 15, 1 << 12  # designs ranked together; smallest such number, with many signs
WIDENING = 0.35  # share of the bounds' width added on either side: two coordinates in five are clipped to a bound
KEPT = 512  # best designs of the sample per start, and as many of the infeasible ones
PARENTS, CHILDREN, ROUNDS = 16, 24, 12  # designs improved per start; samples around each design per round; rounds
RANKED = SAMPLED + PARENTS * CHILDREN * ROUNDS  # designs per start in all
FARTHEST = 1e100
RADIUS = 0.06  # radius of the first of these samples, in variables scaled to their bounds
ACCURACY = Accuracy(samples=64)  # misses a peak by less than the local search gains ...
TURNING = Accuracy(samples=16)  # the same for margins, which rank designs that do not turn; other margins are exact
VERIFIED, HIDDEN = Accuracy(target=1e-3), 2.0  # ... except near a pole, where a true extremum is larger by this factor
NEARLY = 0.03  # violation that a search corrects in passing, so that the objective ranks the design
PRICE = 3.0  # price of such a violation, in objectives
ABSENT = 100.0  # violation of a limit on an output that a design does not have, as the swing of a rocker that turns
ALIKE = 0.02  # share of the average distance of two random designs: nearer designs of a sweep give one start
OUTSIDE, NOT_TURNING = 1e100, 1e200  # above every objective: violates its limits, does not turn


def samples(
    problem: Problem, signs: Sequence[dict[str, float]], count: int, seed: int, stop: Callable[[], bool] = lambda: False
) -> Iterator[StartGroup]:
    """Yield at most ``count`` good designs, sample by sample; the same arguments give the same designs.

    Parameters
    ----------
    problem : problem to be minimised
    signs : combinations of the parameters that are not varied (branches), among which each sample is divided
    count : largest number of designs, equally many of each sample, up to six
    seed : seed of the samples
    stop : true ends the present sample with the best designs so far, and the iteration
    """
    sample_count = -(-count // GROUP_SIZE)
    size = -(-count // sample_count)
    for k in range(sample_count):
        if k and stop():
            return
        designs = sample(problem, signs, size, seed, k, stop)[: count - k * size]
        if len(designs):
            yield StartGroup(designs, k)


def sample(
    problem: Problem, signs: Sequence[dict[str, float]], count: int, seed: int, number: int,
    stop: Callable[[], bool] = lambda: False,
) -> Array:  # fmt: skip
    """Return diverse good designs of one Sobol sample and of samples around its best ones, the best first.

    Each sample has its own scrambling, and so its own points.  Half of them are drawn from a range wider than the
    bounds and clipped to them.

    Parameters
    ----------
    problem, signs, seed : see :func:`samples`
    count : largest number of designs
    number : number of the sample
    stop : called several times a second; true ends the search with the best designs so far
    """
    from scipy.stats import qmc

    centre = problem.lower + 0.5 * problem.span
    bases = [problem.rows(centre, **choice)[0] for choice in signs]
    block = BLOCK
    while block > LEAST_BLOCK and block * len(bases) > SAMPLED * count:
        block //= 2
    blocks = max(-(-SAMPLED * count // block), len(bases))
    rng = np.random.default_rng((seed, number))
    sobol = qmc.Sobol(len(problem.variables), seed=rng)
    points, kind, merit = np.empty((0, len(problem.variables))), np.empty(0, np.intp), np.empty(0)
    for k in range(blocks):
        if k and stop():
            break
        fractions, index = _drawn_within(problem, sobol.random(block)), k % len(bases)
        ranks = ranking(problem, problem.placed(bases[index], fractions))
        points = np.concatenate([points, fractions])
        kind = np.concatenate([kind, np.full(block, index)])
        merit = np.concatenate([merit, ranks])
        order = np.argsort(merit, kind="stable")
        feasible = merit[order] < OUTSIDE
        best = np.sort(np.concatenate([order[feasible][: KEPT * count], order[~feasible][: KEPT * count]]))
        points, kind, merit = points[best], kind[best], merit[best]
    merit = _verified(problem, bases, points, kind, merit)
    chosen, feasible_count = _parents(points, kind, merit, PARENTS * count)
    points, merit = _improved(problem, bases, points[chosen], kind[chosen], merit[chosen], rng, stop)
    ranked = np.argsort(merit, kind="stable")
    if feasible_count >= count:  # designs moved within the limits have to be as good as those that were there
        ranked = ranked[merit[ranked] <= merit[:feasible_count].max()]
    points, kind = points[ranked], kind[chosen][ranked]
    designs = [problem.placed(bases[kind[k]], points[k]) for k in spread(points, kind, count)]
    return np.array(designs).reshape(-1, len(problem.family.parameters))


def _drawn_within(problem: Problem, fractions: Array) -> Array:
    """Return points of a block of a sample within the bounds, half of them drawn from a wider range and clipped.

    Optima lie on bounds, often on several at once, and the feasible designs near them may fill less than a millionth of
    the space between the bounds.
    """
    low, high = _drawing_range(problem)
    bounded = high - low == 1.0  # an angle of a whole turn has no ends
    half = len(fractions) // 2
    out = fractions.copy()
    widened = np.clip((1.0 + 2.0 * WIDENING) * fractions[:half] - WIDENING, 0.0, 1.0)
    out[:half] = np.where(bounded, widened, fractions[:half])
    return np.asarray(low + out * (high - low), np.float64)


def _parents(points: Array, kind: NDArray[np.intp], merit: Array, count: int) -> tuple[NDArray[np.intp], int]:
    """Return the row numbers of diverse designs to be improved, feasible ones first, and how many are feasible.

    Feasible ones are up to half; the others violate the limits and keep a distance from them.

    A limit may leave several separate regions.  A sample can miss the smallest, which is then reached from infeasible
    designs beside it.
    """
    order = np.argsort(merit, kind="stable")
    order = order[np.isfinite(merit[order])]
    feasible, turning = merit[order] < OUTSIDE, merit[order] < NOT_TURNING
    taken = order[feasible][spread(points[order[feasible]], kind[order[feasible]], count // 2)]
    feasible_count = len(taken)
    for candidates in (order[turning & ~feasible], order):
        rows = np.concatenate([taken, candidates[~np.isin(candidates, taken)]])
        taken = rows[spread(points[rows], kind[rows], count, first=len(taken))]
    return np.asarray(taken, np.intp), feasible_count


def _drawing_range(problem: Problem) -> tuple[Array, Array]:
    """Return the bounds in which samples are drawn, as fractions.

    A variable with the period of a turn is drawn from the middle turn of its bounds only.
    """
    periodic = () if problem.coordinates is None else problem.coordinates.periodic
    share = np.array(
        [
            min(1.0, 2.0 * np.pi / width) if name in periodic else 1.0
            for name, width in zip(problem.variables, problem.span, strict=True)
        ]
    )
    return 0.5 - 0.5 * share, 0.5 + 0.5 * share


def _verified(problem: Problem, bases: list[Array], points: Array, kind: NDArray[np.intp], merit: Array) -> Array:
    """Return the ranks of designs, from true extrema if the poses hid most of a peak."""
    out = merit.copy()
    for index, base in enumerate(bases):
        rows = np.flatnonzero((kind == index) & (merit < OUTSIDE))
        ranks = ranking(problem, problem.placed(base, points[rows]), VERIFIED)
        hidden = ranks > HIDDEN * merit[rows]
        out[rows[hidden]] = ranks[hidden]
    return out


def _improved(
    problem: Problem, bases: list[Array], points: Array, kind: NDArray[np.intp], merit: Array, rng: np.random.Generator,
    stop: Callable[[], bool],
) -> tuple[Array, Array]:  # fmt: skip
    """Replace each design repeatedly by the best of a sample around it; without a better one the radius is halved."""
    points, merit = points.copy(), merit.copy()
    radius = np.full(len(points), RADIUS)
    for _ in range(ROUNDS):
        if stop():
            break
        steps = radius[:, None, None] * rng.standard_normal((len(points), CHILDREN, points.shape[1]))
        children = np.clip(points[:, None, :] + steps, 0.0, 1.0)
        values = np.empty((len(points), CHILDREN))
        for index, base in enumerate(bases):
            rows = np.flatnonzero(kind == index)
            designs = problem.placed(base, children[rows].reshape(-1, points.shape[1]))
            values[rows] = ranking(problem, designs).reshape(-1, CHILDREN)
        chosen = np.arange(len(points)), np.argmin(values, axis=1)
        best = children[chosen]
        ranks = _verified(problem, bases, best, kind, values[chosen])
        better = ranks < merit
        points[better], merit[better] = best[better], ranks[better]
        radius[~better] *= 0.5
    return points, merit


def ranking(problem: Problem, designs: Array, accuracy: Accuracy = ACCURACY) -> Array:
    """Return the rank of each design; smaller is better.

    It is the objective if all limits are nearly kept, otherwise a larger number that grows with the violation, and
    above all for designs that do not turn.

    Cheap limits come first: parameters, then margins and pressure angles, then the others; only designs that nearly
    keep them are evaluated further.  Infinite if there is no design or no objective.

    Parameters
    ----------
    problem : problem of the objective and the limits
    designs : (n, P)
    accuracy : accuracy of the extrema over the turn
    """
    limits = [limit for limit in problem.limits if not is_flag(limit.output)]
    names = problem.family.parameter_names
    turning = ["margin"] if margins(problem.family) else []
    groups: list[list[Any]] = [[], [], []]
    for limit in limits:
        groups[
            0 if limit.output in names else 1 if stem(limit.output) in ("margin", "max_pressure_angle") else 2
        ].append(limit)
    merit = np.full(len(designs), np.inf)
    alive = np.flatnonzero(np.isfinite(designs).all(axis=1))
    violation = np.zeros(len(designs))
    for level, group in zip((3.0, 2.0, 1.0), groups, strict=True):
        wanted = list(dict.fromkeys(limit.output for limit in group)) + (turning if level == 2.0 else [])
        used = TURNING if level == 2.0 and accuracy.samples else accuracy
        columns = _values(problem, designs[alive], wanted, used)
        for limit in group:
            violation[alive] = np.maximum(violation[alive], _relative_violation(limit, columns[limit.output]))
        rejected = violation[alive] > NEARLY
        merit[alive[rejected]] = OUTSIDE * (level + violation[alive[rejected]])
        if level == 2.0 and turning:
            stuck = ~(columns["margin"] >= ROTATABLE_MARGIN)
            # The distance of a crank from turning is a rank only; larger numbers count as equal, and would overflow.
            margin = np.maximum(np.nan_to_num(columns["margin"][stuck]), -FARTHEST)
            merit[alive[stuck]] = NOT_TURNING * (1.0 - margin)
            rejected |= stuck
        alive = alive[~rejected]
    values = _values(problem, designs[alive], [problem.objective], accuracy)[problem.objective]
    objective = compared(problem.objective, values)
    merit[alive] = np.nan_to_num(objective + PRICE * np.abs(objective) * violation[alive], nan=np.inf, posinf=np.inf)
    return merit


def _values(problem: Problem, designs: Array, wanted: list[str], accuracy: Accuracy) -> dict[str, Array]:
    """Return outputs and parameters of designs, (n,) each."""
    names = problem.family.parameter_names
    columns: dict[str, Any] = {name: designs[:, names.index(name)] for name in wanted if name in names}
    outputs = [name for name in wanted if name not in names]
    if outputs and len(designs):
        columns |= design_outputs(problem.family, designs, outputs, accuracy, problem.window)
    return {name: np.asarray(columns.get(name, np.empty(0)), np.float64) for name in wanted}


def _relative_violation(limit: Any, value: Array) -> Array:
    """Return the violation of a limit relative to its bound, (n,).

    A missing output has a large violation.
    """
    value = compared(limit.output, value)
    out = np.zeros(len(value))
    for bound, sense in ((limit.minimum, 1.0), (limit.maximum, -1.0)):
        if bound is not None:
            size = violation_scale(max(abs(limit.minimum or 0.0), abs(limit.maximum or 0.0)))
            out = np.maximum(out, sense * (bound - value) / size)
    return np.nan_to_num(out, nan=ABSENT)


def diverse(problem: Problem, designs: Array, merit: Array, count: int, least: float = 0.0) -> Array:
    """Return the best designs that keep a distance from each other, best first.

    The best one is taken, its neighbourhood excluded, and so on; the distance (in variables scaled to their bounds) is
    halved until there are enough.  Designs of different signs are never neighbours.  Ties go to the earlier row.

    Parameters
    ----------
    problem : its variables define the distance
    designs : (k, P)
    merit : (k,) the smaller the better; rows that are not finite are never taken
    count : largest number of designs
    least : distance kept in any case, as a share of the average distance of two random designs
    """
    order = np.argsort(merit, kind="stable")
    ranked = designs[order[np.isfinite(merit[order])]]
    _, kind = np.unique(ranked[:, problem.others], axis=0, return_inverse=True)
    return ranked[spread(problem.scaled(ranked), kind.reshape(-1), count, least)]


def spread(points: Array, kind: NDArray[np.intp], count: int, least_share: float = 0.0, first: int = 0) -> list[int]:
    """Return the numbers of the best rows that keep a distance from each other.

    At most ``count`` rows of ``points`` (k, n), which is ranked with the best first, are taken.

    ``kind`` (k,): rows of different kinds are never neighbours.  The distance is at least ``least_share`` of the
    average distance of two random designs.  The ``first`` rows are taken in any case.
    """
    distance = 0.5 * np.sqrt(points.shape[1] / 6.0)  # half of the average distance of two random designs
    taken: list[int] = []
    for _ in range(12):
        taken, available = [], np.ones(len(points), dtype=np.bool_)
        while len(taken) < first or (len(taken) < count and available.any()):
            row = len(taken) if len(taken) < first else int(np.argmax(available))
            taken.append(row)
            available &= ~((np.linalg.norm(points - points[row], axis=1) < distance) & (kind == kind[row]))
            available[row] = False
        if len(taken) == count or 0.5 * distance < least_share * np.sqrt(points.shape[1] / 6.0):
            break
        distance *= 0.5
    return taken
