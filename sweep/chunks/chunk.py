"""One chunk of a sweep: consecutive designs of the space, their parameters and their computed rows."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from kernels.status import OK
from sweep.chunks.cascade import BLOCK, Batch, Cascade, Recalled, levels
from sweep.chunks.parameters import leading_columns, leading_matrix, runs_matrix
from sweep.errors import InputError
from sweep.evaluation.summaries import design_outputs
from sweep.families.base import Array, Columns
from sweep.families.names import error_of, is_flag
from sweep.reductions.steps import is_proven
from sweep.study import Study
from sweep.synthesis.fit import fit_line


@dataclass(frozen=True)
class ChunkResult:
    """Rows of a chunk, and the numbers of all its designs by status and by missed limit, with or without a row.

    A design is counted under the first limit that it misses, in the order in which limits are tested.
    """

    columns: Columns
    counts_by_status: dict[int, int]
    missed_by_limit: dict[str, int]


def output_columns(study: Study) -> dict[str, str]:
    """Names and types of the result columns: the wanted outputs, each followed by its error column, if any.

    An error estimate is stored in float32, a proven bound in float64; the flag ``rotatable`` has no error column.
    """
    columns: dict[str, str] = {}
    for name in study.want:
        columns[name] = study.output.dtype
        if study.accuracy.target is not None and not is_flag(name):
            columns[error_of(name)] = "float64" if is_proven(study.family, name, study.accuracy) else "float32"
    return columns


def warm(study: Study) -> None:
    """Compile or load the kernels of the sweep by computing a few designs spread over the space."""
    for number in range(len(asked_outputs(study))):
        warm_step(study, number)


def warm_step(study: Study, number: int) -> None:
    """Compile or load the kernels of one step of the sweep."""
    design_outputs(study.family, few_designs(study), asked_outputs(study)[number], study.accuracy, study.window)


def asked_outputs(study: Study) -> list[Sequence[str]]:
    """List the outputs of each step of the sweep, in the order of computation."""
    return [level.route.outputs for level in levels(study) if level.route is not None]


def few_designs(study: Study) -> Array:
    """Choose a few designs (n, P) spread over the space of a study."""
    count = study.space.count
    starts = sorted({k * (count - 1) // 7 for k in range(8)})
    matrix, _ = runs_matrix(study, [(start, start + 1) for start in starts])
    # Any numbers will do for compiling, also for a design that [locus] cannot make.
    designs = np.nan_to_num(matrix, nan=1.0)
    if study.fit is not None:
        designs, _ = fit_line(study.family, designs, study.fit, study.window)
    return np.asarray(designs, np.float64)


def compute_chunk(
    study: Study,
    start: int,
    stop: int,
    should_stop: Callable[[], bool] = lambda: False,
    known: Columns | None = None,
) -> ChunkResult:
    """Compute the rows of the designs start, ..., stop - 1: index, parameters, wanted outputs, status.

    Designs are generated and computed in blocks, so memory holds a few blocks and the rows that are kept.

    Parameters
    ----------
    study : the study
    start, stop : range of design indices in the study's space
    should_stop : called before every batch of designs
    known : rows of the same chunk of a study that differs in its limits only; outputs of designs that met all of
        these limits are taken from the rows, not computed again

    Returns
    -------
    ChunkResult
        columns ``design`` int64, parameters float64 [mm, rad], outputs in the study's dtype, ``status`` uint8; with
        ``keep = "feasible"`` only the rows with status 0; all designs are counted either way.

    Raises
    ------
    InputError
        if the range is not inside the space, or a design of the space has a bad value.
    Dropped
        if ``should_stop`` returned true.
    """
    if not 0 <= start <= stop <= study.space.count:
        raise InputError("designs", f"{start}:{stop}", f"a range inside 0:{study.space.count}", f"study {study.name}")
    keep = study.output.keep == "all"
    cascades = [Cascade(study, keep, should_stop)]
    leading = leading_columns(study, cascades[0].levels[0].columns)
    designs_known = np.empty(0, np.int64)
    if known is not None:
        feasible = known["status"] == OK
        designs_known = known["design"][feasible]
        recalled = {name: values[feasible] for name, values in known.items()}
        cascades.append(Recalled(study, keep, should_stop, recalled))
    for low in range(start, stop, BLOCK):
        index = np.arange(low, min(low + BLOCK, stop))
        matrix, status = leading_matrix(study, leading, low, low + index.size)
        if known is None:
            cascades[0].feed(index, matrix, status)
            continue
        is_known = np.isin(index, designs_known)
        for cascade, mask in zip(cascades, (~is_known, is_known), strict=True):
            if mask.any():
                cascade.feed(index[mask], matrix[mask], status[mask])
    return _result(study, cascades)


def _result(study: Study, cascades: Sequence[Cascade]) -> ChunkResult:
    """Join rows and counts of cascades that have been fed all designs of a chunk."""
    types = output_columns(study)
    batch = Batch.joined([cascade.end(tuple(types)) for cascade in cascades]).ordered()
    columns: Columns = {"design": batch.index}
    columns |= {name: batch.designs[:, k] for k, name in enumerate(study.family.parameter_names)}
    columns |= {name: batch.outputs[name].astype(dtype, copy=False) for name, dtype in types.items()}
    columns |= {"status": batch.status}
    total = np.sum([cascade.counts for cascade in cascades], axis=0)
    counts = {code: int(total[code]) for code in np.flatnonzero(total).tolist()}
    missed = sum((cascade.missed for cascade in cascades), Counter[str]())
    return ChunkResult(columns, counts, {name: count for name, count in missed.items() if count})
