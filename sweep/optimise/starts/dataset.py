"""Starts of a study: the best designs of its sweep, supplemented by samples if they are too few or too similar."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, fields
from pathlib import Path

import numpy as np

from kernels import status as st
from sweep.chunks.parameters import runs_matrix
from sweep.dataset.chunk_files import batches, parts
from sweep.families.base import Array, Family
from sweep.optimise.multistart.survey import GROUP_SIZE, StartGroup, distinct, in_groups
from sweep.optimise.problem.statement import Problem
from sweep.optimise.starts.populations import diverse
from sweep.optimise.starts.ranked import ALIKE, RANKED, ranking, samples
from sweep.quantities.limits import Limit, compared, meets
from sweep.study import Study
from sweep.synthesis.fit import fit_line
from sweep.synthesis.tasks import solve

KEPT = 100_000  # best rows of a dataset that are candidates
SCREENED = 256  # designs of a study's space drawn per start if its dataset has no feasible row
TASK_SAMPLES = 4  # samples for a [task], whose mechanisms serve as starts only


def best_rows(
    family: Family, objective: str, folder: Path, limits: Sequence[Limit | None] = (None,), most: int = KEPT
) -> list[tuple[Array, Array]]:
    """Return the best feasible designs (k, P) of a dataset within each limit, with their compared objective.

    There are at most ``most`` for each, in the order of the dataset.  Only the parameters, the objective, the limited
    outputs and the status are read, batch by batch; for None no further limit holds.
    """
    names = family.parameter_names
    columns = dict.fromkeys([*names, objective, "status", *(limit.output for limit in limits if limit is not None)])
    best = [(np.empty((0, len(names))), np.empty(0)) for _ in limits]
    for batch in batches((part.path for part in parts(folder)), list(columns)):
        values = {name: np.asarray(batch[name], np.float64) for name in columns}
        new, merit = np.column_stack([values[name] for name in names]), compared(objective, values[objective])
        feasible = (values["status"] == st.OK) & np.isfinite(merit)
        for k, limit in enumerate(limits):
            rows = feasible if limit is None else feasible & meets(limit, values[limit.output])
            designs, ranks = (np.concatenate(pair) for pair in zip(best[k], (new[rows], merit[rows]), strict=True))
            kept = np.sort(np.argsort(ranks, kind="stable")[:most]) if len(ranks) > most else slice(None)
            best[k] = designs[kept], ranks[kept]
    return best


def task_designs(study: Study, count: int, seed: int) -> Array:
    """Return the study's designs that solve its [task], the best first, (k, P).

    There are at most ``count``, and none without a task.  A parameter that the study fixes keeps its value.
    """
    names = study.family.parameter_names
    if study.task is None:
        return np.empty((0, len(names)))

    solutions = solve(study.task, starts=count, samples=TASK_SAMPLES, seed=seed)
    default = {p.name: p.default for p in study.family.parameters}
    rows = [default | {n: x for n, x in s.mechanism.items() if n in names} | dict(study.space.fixed) for s in solutions]
    rows = [row for row in rows if None not in (row[name] for name in names)]
    return np.array([[row[name] for name in names] for row in rows], np.float64).reshape(-1, len(names))[:count]


def random_designs(study: Study, count: int, seed: int) -> Array:
    """Return random designs of a study's space, completed by its [locus] and [fit].

    They replace the rows of a dataset without feasible ones.
    """
    length = min(64, study.space.count)
    blocks = max(1, SCREENED * count // length)
    firsts = np.random.default_rng(seed).integers(0, study.space.count - length + 1, blocks)
    matrix, made = runs_matrix(study, [(int(k), int(k) + length) for k in firsts])
    designs: Array = matrix[made == st.OK]
    if study.fit is None or not len(designs):
        return designs
    fitted, status = fit_line(study.family, designs, study.fit, study.window)
    return np.asarray(fitted[status == st.OK], np.float64)


BLOCKS_SEEN = 4  # blocks of 256 designs of a space that show its combinations of signs
TIMED, TIMED_SECONDS = (64, 256, 8192), 0.05  # designs timed for the price of a sample, until they take TIMED_SECONDS
SAMPLES = 2  # factor on the samples, since starts near another one are dropped
MOST_KINDS = 64  # combinations of signs among which a sample is divided


def kinds(study: Study, problem: Problem, known: Array) -> list[dict[str, float]]:
    """Return the combinations of signs and listed values in the designs of a study.

    Parameters
    ----------
    study, problem : combinations are those of the parameters that the problem does not vary
    known : (k, P) designs whose combinations come first
    """
    names = problem.family.parameter_names
    designs = np.concatenate([known, random_designs(study, BLOCKS_SEEN, study.optimise.seed if study.optimise else 0)])
    _, first = np.unique(designs[:, problem.others], axis=0, return_index=True)
    chosen = designs[np.sort(first)][:MOST_KINDS]
    return [{names[c]: float(design[c]) for c in problem.others} for design in chosen]


@dataclass(frozen=True)
class Catalogued(Problem):
    """A problem whose listed parameters vary too, among their values, for the choice by samples."""

    values: Mapping[str, Array] = field(default_factory=dict)

    @classmethod
    def of(cls, problem: Problem, values: Mapping[str, Array]) -> Catalogued:
        """Return the problem with the listed parameters, and their values in order, as further variables."""
        values_of = {item.name: getattr(problem, item.name) for item in fields(problem)}
        values_of["variables"] = (*problem.variables, *values)
        values_of["lower"] = np.append(problem.lower, [listed[0] for listed in values.values()])
        values_of["upper"] = np.append(problem.upper, [listed[-1] for listed in values.values()])
        return cls(**values_of, values=values)

    def placed(self, base: Array, fractions: Array) -> Array:
        """Return designs as in :class:`Problem`, each listed parameter at the nearest of its values."""
        designs = super().placed(base, fractions)
        for name, listed in self.values.items():
            column = self.family.parameter_names.index(name)
            distance = np.abs(designs[..., column, None] - listed)
            designs[..., column] = listed[distance.argmin(axis=-1)]
        return designs


def swept_and_sampled(
    study: Study,
    problem: Problem,
    designs: Array,
    merit: Array,
    catalogue: Mapping[str, Array],
    stop: Callable[[], bool],
) -> Iterator[StartGroup]:
    """Yield groups of starts: mechanisms of the study's [task], diverse best designs of the sweep, best of samples.

    On the locus half of the starts come from samples in any case: they cost next to nothing there, and reach the
    bounds, where a sweep may have no design at all.  If no row of the dataset is feasible, the first half are the best
    of random designs.  The same applies with a catalogue, since each start keeps its listed values: a sweep has few of
    their combinations, a sample seeks good ones.

    Parameters
    ----------
    study, problem : study and problem of the search
    designs, merit : (k, P) of the sweep, and their compared objective (k,), empty if none is feasible
    catalogue : values of the listed parameters
    stop : true ends the iteration
    """
    assert study.optimise is not None
    count, seed = study.optimise.starts, study.optimise.seed
    sampled = not len(merit) or (study.fit is None and (problem.coordinates is not None or len(catalogue) > 0))
    ranks = merit if len(merit) else ranking(problem, designs)
    swept = diverse(problem, designs, ranks, count - count // 2 if sampled else count, ALIKE)
    starts = np.concatenate([task_designs(study, count, seed), swept])[:count]
    yield from in_groups(starts)
    sampled_problem = Catalogued.of(problem, catalogue) if catalogue else problem
    further = _further_groups(study, sampled_problem, designs, ranks, starts, stop)
    while len(starts) < count and not stop() and (group := next(further, None)) is not None:
        extended = with_distinct(problem, starts, group.designs, count)
        if len(extended) > len(starts):
            yield group._replace(designs=extended[len(starts) :])
        starts = extended


def _further_groups(
    study: Study, problem: Problem, designs: Array, ranks: Array, starts: Array, stop: Callable[[], bool]
) -> Iterator[StartGroup]:
    """Yield further groups of starts.

    A sample of the problem's own variables finds more than the space of the study, unless [fit] has to complete every
    design; then designs of the space are drawn.  Finally the sweep's designs follow, at any distance of at least ALIKE.
    """
    assert study.optimise is not None
    count, seed = study.optimise.starts, study.optimise.seed
    if study.fit is None:
        yield from samples(problem, kinds(study, problem, starts), SAMPLES * count, seed, stop)
    else:
        drawn = random_designs(study, count, seed)
        yield StartGroup(diverse(problem, drawn, ranking(problem, drawn), count) if len(drawn) else drawn)
    yield StartGroup(diverse(problem, designs, ranks, count, ALIKE))


def sample_seconds(problem: Problem, base: Array, count: int) -> float:
    """Return the time of a sample for ``count`` starts [s], measured on some of its designs.

    The designs have the signs of ``base`` (P,); fewer are measured if they are slow.
    """
    rng, number, seconds = np.random.default_rng(0), 0, 0.0
    ranking(problem, base[None])  # compiles
    for number in TIMED:
        designs = problem.placed(base, rng.random((number, len(problem.variables))))
        start = time.process_time()
        ranking(problem, designs)
        seconds = time.process_time() - start
        if seconds > TIMED_SECONDS:
            break
    return seconds / number * RANKED * min(count, GROUP_SIZE)


def with_distinct(problem: Problem, starts: Array, more: Array, count: int) -> Array:
    """Return the starts and those of ``more`` designs that are not near any of them, at most ``count`` in all."""
    designs, present = np.concatenate([starts, more]), len(starts)
    signs = designs[:, problem.others]
    rows = distinct(problem, designs, signs, range(present, len(designs)), ALIKE, range(present))
    return np.asarray(designs[rows[:count]], np.float64)
