"""One chunk of a sweep: a run of consecutive designs taken through the cascade of limits, cheapest first."""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING, TypeAlias

import numpy as np
from numpy.typing import NDArray

from kernels import status as codes
from sweep.errors import InputError
from sweep.families.base import Array, Columns
from sweep.fit import fit_line
from sweep.summaries import Route, design_outputs, routes
from sweep.tables import design_matrix

if TYPE_CHECKING:
    from sweep.study import Limit, Study

# Designs computed together: the tables of a block stay in the second-level cache, and a stop is noticed after a block.
BLOCK = 4096

# A clockwise and an anticlockwise follower of the same amplitude meet the same requirement.
MAGNITUDES = ("swing", "stroke")

# With these one output is missing or rough, the others are worth having where all rows are kept.
PARTIAL = (codes.NOT_OSCILLATING, codes.NOT_CONVERGED)


Rows: TypeAlias = NDArray[np.intp]


class Dropped(Exception):
    """The chunk was given up half way because the run was asked to stop."""


@dataclass(frozen=True)
class ChunkResult:
    """Rows of a chunk, and how many of its designs ended with which status (dropped rows included)."""

    columns: Columns
    counts_by_status: dict[int, int]


@dataclass(frozen=True)
class Cascade:
    """Finished designs (n, P), their outputs and status, each (n,), and how many designs each route was run on."""

    designs: Array
    outputs: dict[str, Array]
    status: NDArray[np.uint8]
    reached: tuple[int, ...]


def output_columns(study: Study) -> dict[str, str]:
    """Names and types of the result columns: what the study wants, each number with its error estimate if there is one.

    An estimate is stored in float32 always; whether a crank turns is not a number and has none.
    """
    columns: dict[str, str] = {}
    for name in study.want:
        columns[name] = study.output.dtype
        if study.accuracy.target is not None and not name.startswith("rotatable"):
            columns[f"err_{name}"] = "float32"
    return columns


def parameter_matrix(study: Study, start: int, stop: int) -> tuple[Array, NDArray[np.uint8]]:
    """Checked (n, P) design matrix of the designs start, ..., stop - 1 of the study's space, and their status (n,).

    The status is OK unless [locus] found no mechanism for a design; its links are nan then.
    """
    columns = study.space.columns(start, stop)
    if study.locus is None:
        matrix, _ = design_matrix(study.family, columns)
        return matrix, np.zeros(len(matrix), np.uint8)
    made, status = study.locus.links(columns)
    # What has no mechanism is marked, not refused.
    given = {name: values for name, values in columns.items() if name in study.family.parameter_names}
    matrix, _ = design_matrix(study.family, given | {name: np.ones(stop - start) for name in made})
    for name, values in made.items():
        matrix[:, study.family.parameter_names.index(name)] = values
    return matrix, status


def cascade(study: Study, designs: Array, status: NDArray[np.uint8]) -> Cascade:
    """Compute the wanted outputs route by route; only designs that meet all limits known so far go on.

    Parameters
    ----------
    study : whose family, wanted outputs, limits and accuracy apply
    designs : (n, P) design matrix [mm, rad]
    status : (n,) only designs that are OK are looked at, the others keep theirs

    Returns
    -------
    Cascade
        outputs (n,), nan where not computed; status 0 for designs that meet every limit, LIMIT_EXCEEDED for those that
        miss one, otherwise the status of the kernel that could not answer.
    """
    n = len(designs)
    designs = designs.copy()
    outputs = {name: np.full(n, np.nan) for name in output_columns(study)}
    status = status.copy()
    alive = np.flatnonzero(status == codes.OK)
    finished = False
    go_on = (codes.OK,) if study.output.keep == "feasible" else (codes.OK, *PARTIAL)
    reached = []
    for route in ordered_routes(study):
        if not finished and not _before_fit(study, route):
            alive, finished = _finish(study, designs, status, alive), True
        reached.append(alive.size)
        if alive.size == 0:
            continue
        found = design_outputs(study.family, designs[alive], route.outputs, study.accuracy, study.window)
        for name in outputs.keys() & found.keys():
            outputs[name][alive] = found[name]
        fate = np.where(status[alive] == codes.OK, found["status"], status[alive])
        for limit in study.tested_limits:
            if limit.output in found:
                fate[(fate == codes.OK) & ~meets(limit, found[limit.output])] = codes.LIMIT_EXCEEDED
        status[alive] = fate
        alive = alive[np.isin(fate, go_on)]
    if not finished:
        _finish(study, designs, status, alive)
    return Cascade(designs, outputs, status, tuple(reached))


def ordered_routes(study: Study) -> tuple[Route, ...]:
    """The routes of a study, cheapest first, those that must wait for [fit] behind the others."""
    found = routes(study.family, study.want, study.accuracy)
    return tuple(sorted(found, key=lambda route: not _before_fit(study, route)))


def _before_fit(study: Study, route: Route) -> bool:
    """Whether the route concerns only stages before the one that [fit] finishes."""
    if study.fit is None:
        return False
    last = len(study.families)
    numbers = [re.search(r"(\d+)$", name) for name in route.outputs]
    return all(number is not None and int(number[1]) < last for number in numbers)


def _finish(study: Study, designs: Array, status: NDArray[np.uint8], alive: Rows) -> Rows:
    """Fit the designs that are left, in place, drop those whose parameters exceed their limits; the rows that go on."""
    if study.fit is not None and alive.size:
        designs[alive], fate = fit_line(study.family, designs[alive], study.fit, study.window)
        status[alive] = fate
        alive = alive[fate == codes.OK]
    for limit in study.parameter_limits:
        kept = meets(limit, designs[alive, study.family.parameter_names.index(limit.output)])
        status[alive[~kept]] = codes.LIMIT_EXCEEDED
        alive = alive[kept]
    return alive


def warm(study: Study) -> None:
    """Compile or load every kernel the study needs, on a few designs spread over its space."""
    count = study.space.count
    starts = sorted({k * (count - 1) // 7 for k in range(8)})
    blocks = [parameter_matrix(study, start, start + 1) for start in starts]
    # Any numbers will do, also for a design that [locus] cannot make: it compiles the same.
    designs = np.nan_to_num(np.concatenate([matrix for matrix, _ in blocks]), nan=1.0)
    if study.fit is not None:
        designs, _ = fit_line(study.family, designs, study.fit, study.window)
    for route in ordered_routes(study):
        design_outputs(study.family, designs, route.outputs, study.accuracy, study.window)


def meets(limit: Limit, values: NDArray[np.generic]) -> NDArray[np.bool_]:
    """Whether each value keeps the limit; nan does not.  Swing and stroke are compared by magnitude."""
    x = np.asarray(values, dtype=np.float64)
    if limit.output.rstrip("0123456789") in MAGNITUDES:
        x = np.abs(x)
    good = np.isfinite(x)
    if limit.minimum is not None:
        good &= x >= limit.minimum
    if limit.maximum is not None:
        good &= x <= limit.maximum
    return good


def compute_chunk(study: Study, start: int, stop: int, should_stop: Callable[[], bool] = lambda: False) -> ChunkResult:
    """Rows of the designs start, ..., stop - 1: index, parameters, wanted outputs, status.

    The work goes block by block, so memory is one block and the rows that are kept.

    Parameters
    ----------
    study : the question
    start, stop : range of design indices in the study's space
    should_stop : asked before every block

    Returns
    -------
    ChunkResult
        columns ``design`` int64, parameters float64 [mm, rad], outputs in the study's dtype, ``status`` uint8; with
        ``keep = "feasible"`` only the rows with status 0, all designs are counted either way.

    Raises
    ------
    InputError
        if the range is not inside the space, or a design of the space has a bad value.
    Dropped
        if ``should_stop`` answered true.
    """
    if not 0 <= start <= stop <= study.space.count:
        raise InputError("designs", f"{start}:{stop}", f"a range inside 0:{study.space.count}", f"study {study.name}")
    counts = np.zeros(256, np.int64)
    blocks: list[Columns] = []
    for low in range(start, stop, BLOCK):
        if should_stop():
            raise Dropped
        block = _block(study, low, min(low + BLOCK, stop), counts)
        if len(block["design"]):
            blocks.append(block)
    if not blocks:
        blocks.append(_block(study, stop, stop, counts))
    columns = {name: np.concatenate([block[name] for block in blocks]) for name in blocks[0]}
    return ChunkResult(columns, {code: int(counts[code]) for code in np.flatnonzero(counts).tolist()})


def _block(study: Study, start: int, stop: int, counts: NDArray[np.int64]) -> Columns:
    matrix, status = parameter_matrix(study, start, stop)
    result = cascade(study, matrix, status)
    counts += np.bincount(result.status, minlength=counts.size)
    rows = np.arange(len(matrix))
    if study.output.keep == "feasible":
        rows = np.flatnonzero(result.status == codes.OK)
    columns: Columns = {"design": start + rows.astype(np.int64)}
    columns |= {name: result.designs[rows, k] for k, name in enumerate(study.family.parameter_names)}
    columns |= {name: result.outputs[name][rows].astype(dtype) for name, dtype in output_columns(study).items()}
    return columns | {"status": result.status[rows]}
