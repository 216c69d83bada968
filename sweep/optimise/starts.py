"""Where searches begin: good designs of a sweep, or of a sample, that are not all alike."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from kernels import status as st
from sweep.families.base import Accuracy, Array, Family
from sweep.optimise.measures import ROTATABLE_MARGIN, margins
from sweep.optimise.problem import Problem

if TYPE_CHECKING:
    from sweep.study import Study

KEPT = 100_000  # best rows of a dataset that are looked at
SCREENED = 256  # designs of a study's space per start where a dataset gives none
SAMPLED = 4096  # designs between plain bounds per start: these cost a microsecond each
NEARLY = 0.03  # a search mends so small a violation in passing: the objective tells more


def diverse(problem: Problem, designs: Array, merit: Array, count: int) -> Array:
    """The best designs that keep a distance from each other, best first.

    The best one is taken, its neighbourhood left out, and so on; the distance (in variables scaled to their bounds) is
    halved until there are enough.  Designs of different signs are never neighbours.  Ties go to the earlier row.

    Parameters
    ----------
    problem : whose variables count
    designs : (k, P)
    merit : (k,) the smaller the better; rows that are not finite are never taken
    count : how many at most
    """
    order = np.argsort(merit, kind="stable")
    order = order[np.isfinite(merit[order])]
    ranked = designs[order]
    place = problem.scaled(ranked)
    others = [c for c in range(designs.shape[1]) if c not in problem.columns]
    distance = 0.5 * np.sqrt(len(problem.columns) / 6.0)  # half of what two random designs keep on average
    taken: list[int] = []
    for _ in range(12):
        taken, free = [], np.ones(len(ranked), dtype=np.bool_)
        while len(taken) < count and free.any():
            best = int(np.argmax(free))
            taken.append(best)
            near = np.linalg.norm(place - place[best], axis=1) < distance
            free &= ~(near & (ranked[:, others] == ranked[best, others]).all(axis=1))
            free[best] = False
        if len(taken) == count:
            break
        distance *= 0.5
    return ranked[taken]


def best_rows(family: Family, objective: str, folder: Path) -> tuple[Array, Array]:
    """The best feasible designs of a dataset (k, P), k up to 10^5, and their objective.

    Only the parameters, the objective and the status are read, batch by batch.
    """
    import pyarrow.parquet as pq

    from sweep.store import parts

    names = family.parameter_names
    designs, merit = np.empty((0, len(names))), np.empty(0)
    for part in parts(folder):
        with pq.ParquetFile(part.path) as file:
            for batch in file.iter_batches(batch_size=KEPT, columns=[*names, objective, "status"]):
                good = np.asarray(batch["status"]) == st.OK
                more = np.column_stack([np.asarray(batch[name], np.float64) for name in names])[good]
                designs = np.concatenate([designs, more])
                merit = np.concatenate([merit, np.asarray(batch[objective], np.float64)[good]])
                if len(merit) > KEPT:
                    best = np.sort(np.argsort(merit, kind="stable")[:KEPT])
                    designs, merit = designs[best], merit[best]
    return designs, merit


def drawn(study: Study, count: int, seed: int) -> Array:
    """Designs of a study's space at random, finished by its [locus] and [fit]: for datasets without feasible rows."""
    from sweep.chunk import parameter_matrix
    from sweep.fit import fit_line

    length = min(64, study.space.count)
    blocks = max(1, SCREENED * count // length)
    begins = np.random.default_rng(seed).integers(0, study.space.count - length + 1, blocks)
    drawn_blocks = [parameter_matrix(study, int(k), int(k) + length) for k in begins]
    designs = np.concatenate([matrix[made == st.OK] for matrix, made in drawn_blocks])
    if study.fit is None or not len(designs):
        return designs
    fitted, status = fit_line(study.family, designs, study.fit, study.window)
    return np.asarray(fitted[status == st.OK], np.float64)


def from_sample(problem: Problem, signs: list[dict[str, float]], count: int, seed: int) -> Array:
    """Diverse best designs of a Sobol sample between the bounds; the signs take turns.

    Ranked by :func:`ranking`.

    Parameters
    ----------
    problem : what is to be minimised
    signs : combinations of the parameters that are not varied (branches)
    count : how many at most
    seed : of the sample
    """
    from scipy.stats import qmc

    size = 1 << int(np.ceil(np.log2(SAMPLED * count)))
    sample = qmc.Sobol(len(problem.variables), seed=seed).random(size)
    values = problem.lower + sample * problem.span
    blocks = [problem.rows(values[k :: len(signs)], **choice) for k, choice in enumerate(signs)]
    designs = np.concatenate(blocks)
    return diverse(problem, designs, ranking(problem, designs), count)


def ranking(problem: Problem, designs: Array) -> Array:
    """Objective where all limits are nearly kept; far above it the largest violation; then what does not turn."""
    from sweep.summaries import design_outputs

    turning = ["margin"] if margins(problem.family) else []
    limits = [limit for limit in problem.limits if not limit.output.startswith("rotatable")]
    wanted = list(dict.fromkeys([*turning, *(limit.output for limit in limits), problem.objective]))
    columns: dict[str, Any] = design_outputs(problem.family, designs, wanted, Accuracy(samples=64), problem.window)
    violation = np.zeros(len(designs))
    for limit in limits:
        value = np.asarray(columns[limit.output], np.float64)
        if limit.output.rstrip("0123456789") in ("swing", "stroke"):
            value = np.abs(value)
        for bound, sense in ((limit.minimum, 1.0), (limit.maximum, -1.0)):
            if bound is not None:
                violation = np.fmax(violation, sense * (bound - value) / (abs(bound) or 1.0))
    objective = np.asarray(columns[problem.objective], np.float64)
    spread = 1.0 + np.abs(objective[np.isfinite(objective)]).max(initial=0.0)
    merit = np.where(violation > NEARLY, spread * (1.0 + violation), objective)
    for name in turning:
        margin = np.asarray(columns[name], np.float64)
        merit = np.where(margin < ROTATABLE_MARGIN, spread * 1e6 - margin, merit)
    return merit
