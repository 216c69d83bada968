"""Where searches begin: good designs of a sweep that are not all alike."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from kernels import status as st
from sweep.families.base import Array, Family
from sweep.optimise.problem import Problem

if TYPE_CHECKING:
    from sweep.study import Study

KEPT = 100_000  # best rows of a dataset that are looked at
SCREENED = 256  # designs of a study's space per start where a dataset gives none
ALIKE = 0.02  # of the average distance of two random designs: nearer designs of a sweep are one start


def diverse(problem: Problem, designs: Array, merit: Array, count: int, least: float = 0.0) -> Array:
    """Return the best designs that keep a distance from each other, best first.

    The best one is taken, its neighbourhood left out, and so on; the distance (in variables scaled to their bounds) is
    halved until there are enough.  Designs of different signs are never neighbours.  Ties go to the earlier row.

    Parameters
    ----------
    problem : whose variables count
    designs : (k, P)
    merit : (k,) the smaller the better; rows that are not finite are never taken
    count : how many at most
    least : distance that is kept in any case, as a share of the average one of two random designs
    """
    order = np.argsort(merit, kind="stable")
    ranked = designs[order[np.isfinite(merit[order])]]
    others = [c for c in range(designs.shape[1]) if c not in problem.columns]
    _, kind = np.unique(ranked[:, others], axis=0, return_inverse=True)
    return ranked[spread(problem.scaled(ranked), kind.reshape(-1), count, least)]


def spread(place: Array, kind: NDArray[np.intp], count: int, least: float = 0.0, first: int = 0) -> list[int]:
    """Return numbers of at most ``count`` rows of ``place`` (k, n), ranked best first,
    that keep a distance from each other.

    ``kind`` (k,): rows of different kinds are never neighbours.  The distance is never less than ``least``, a share of
    the average one of two random designs.  The ``first`` rows are taken in any case.
    """
    distance = 0.5 * np.sqrt(place.shape[1] / 6.0)  # half of what two random designs keep on average
    taken: list[int] = []
    for _ in range(12):
        taken, free = list(range(first)), np.ones(len(place), dtype=np.bool_)
        for row in taken:
            free &= ~((np.linalg.norm(place - place[row], axis=1) < distance) & (kind == kind[row]))
        free[:first] = False
        while len(taken) < count and free.any():
            best = int(np.argmax(free))
            taken.append(best)
            free &= ~((np.linalg.norm(place - place[best], axis=1) < distance) & (kind == kind[best]))
            free[best] = False
        if len(taken) == count or 0.5 * distance < least * np.sqrt(place.shape[1] / 6.0):
            break
        distance *= 0.5
    return taken


def best_rows(family: Family, objective: str, folder: Path) -> tuple[Array, Array]:
    """Return the best feasible designs of a dataset (k, P), k up to 10^5, and their objective as it is compared.

    Only the parameters, the objective and the status are read, batch by batch.
    """
    import pyarrow.parquet as pq

    from sweep.chunks.cascade import compared
    from sweep.dataset.store import parts

    names = family.parameter_names
    designs, merit = np.empty((0, len(names))), np.empty(0)
    for part in parts(folder):
        with pq.ParquetFile(part.path) as file:
            for batch in file.iter_batches(batch_size=KEPT, columns=[*names, objective, "status"]):
                good = np.asarray(batch["status"]) == st.OK
                more = np.column_stack([np.asarray(batch[name], np.float64) for name in names])[good]
                designs = np.concatenate([designs, more])
                merit = np.concatenate([merit, compared(objective, np.asarray(batch[objective], np.float64)[good])])
                if len(merit) > KEPT:
                    best = np.sort(np.argsort(merit, kind="stable")[:KEPT])
                    designs, merit = designs[best], merit[best]
    return designs, merit


def of_task(study: Study, count: int, seed: int) -> Array:
    """Return designs of the study that do its [task], the best first, (k, P), at most ``count``;
    none without a task.

    A parameter that the study gives as a number keeps it.
    """
    names = study.family.parameter_names
    if study.task is None:
        return np.empty((0, len(names)))
    from sweep.synthesis.tasks import solve

    found = solve(study.task, starts=count, seed=seed)
    default = {p.name: p.default for p in study.family.parameters}
    rows = [default | {n: x for n, x in s.mechanism.items() if n in names} | dict(study.space.fixed) for s in found]
    rows = [row for row in rows if None not in (row[name] for name in names)]
    return np.array([[row[name] for name in names] for row in rows], np.float64).reshape(-1, len(names))[:count]


def drawn(study: Study, count: int, seed: int) -> Array:
    """Return designs of a study's space at random, finished by its [locus] and [fit]:
    for datasets without feasible rows.
    """
    from sweep.chunks.parameters import parameter_matrix
    from sweep.synthesis.fit import fit_line

    length = min(64, study.space.count)
    blocks = max(1, SCREENED * count // length)
    begins = np.random.default_rng(seed).integers(0, study.space.count - length + 1, blocks)
    drawn_blocks = [parameter_matrix(study, int(k), int(k) + length) for k in begins]
    designs = np.concatenate([matrix[made == st.OK] for matrix, made in drawn_blocks])
    if study.fit is None or not len(designs):
        return designs
    fitted, status = fit_line(study.family, designs, study.fit, study.window)
    return np.asarray(fitted[status == st.OK], np.float64)
