"""Parameters of the designs of a chunk: first the columns of the first outputs, later the others, for survivors only.

Of a chain only one design in about thirty survives the limits on its first stage, and generating parameters takes as
long as these limits; so parameters that the first stage does not need are generated later, by the indices of the
surviving designs.
"""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np
from numpy.typing import NDArray

from sweep.costs import nanoseconds
from sweep.errors import InputError
from sweep.evaluation.tables import design_matrix
from sweep.families.base import Array
from sweep.study import Study


def parameter_matrix(study: Study, start: int, stop: int) -> tuple[Array, NDArray[np.uint8]]:
    """Generate and check the designs start, ..., stop - 1 of the space: matrix (n, P) and status (n,).

    The status is OK unless [locus] found no mechanism for a design; its links are nan then.
    """
    return runs_matrix(study, [(start, stop)])


def runs_matrix(study: Study, runs: Iterable[tuple[int, int]]) -> tuple[Array, NDArray[np.uint8]]:
    """Generate and check several ranges of designs as `parameter_matrix` does, one below the other.

    Checking all ranges at once takes no longer than checking one.
    """
    pieces = [study.space.columns(start, stop) for start, stop in runs]
    columns = {name: np.concatenate([piece[name] for piece in pieces]) for name in pieces[0]}
    if study.locus is None:
        matrix, _ = design_matrix(study.family, columns)
        return matrix, np.zeros(len(matrix), np.uint8)
    links, status = study.locus.links(columns)
    # A design without a mechanism gets a status; it raises no error.
    parameters = {name: values for name, values in columns.items() if name in study.family.parameter_names}
    matrix, _ = design_matrix(study.family, parameters | {name: np.ones(status.size) for name in links})
    for name, values in links.items():
        matrix[:, study.family.parameter_names.index(name)] = values
    return matrix, status


def parameter_ns(study: Study) -> float:
    """Estimate the time for the parameters of a design [ns]."""
    cost = nanoseconds("work", "parameter") * len(study.family.parameters)
    cost += nanoseconds("work", "locus") if study.locus is not None else 0.0
    if study.space.kind == "product":
        return cost + nanoseconds("work", "axis of a lattice") * len(study.space.axes)
    plain, log = nanoseconds("work", "axis of a sample"), nanoseconds("work", "axis of a sample, log")
    return cost + sum(log if axis.scale == "log" else plain for axis in study.space.axes)


def leading_columns(study: Study, needed: int | None) -> int:
    """Choose how many columns of the design matrix are generated at first: ``needed``, or all if it is None.

    All are generated at first where rows are kept anyway, where [locus] computes some from others, and where a value
    may be invalid, so that the error names its place.
    """
    if needed is None or study.output.keep == "all" or study.locus is not None or not _is_valid(study):
        return len(study.family.parameters)
    return needed


def leading_matrix(study: Study, leading: int, start: int, stop: int) -> tuple[Array, NDArray[np.uint8]]:
    """Return the leading columns of the designs start, ..., stop - 1, (n, leading), and their status (n,).

    The bits of a parameter do not depend on when it is generated.
    """
    names = study.family.parameter_names
    if leading == len(names):
        return parameter_matrix(study, start, stop)
    return study.space.matrix(start, stop, names[:leading]), np.zeros(stop - start, np.uint8)


def completed(study: Study, index: NDArray[np.int64], designs: Array) -> Array:
    """Complete the leading columns of designs to all columns (k, P), by their indices (k,)."""
    names = study.family.parameter_names[designs.shape[1] :]
    if not names:
        return designs
    return np.column_stack([designs, *study.space.columns_at(index, names).values()])


def _is_valid(study: Study) -> bool:
    """Whether no design of the space can have an invalid value: values lie between the ends of their axes."""
    space, family = study.space, study.family
    if space.names != family.parameter_names:
        return False
    axes = {axis.name: axis for axis in space.axes}
    for axis, choices in ((axes[p.name], p.choices) for p in family.parameters if p.name in axes):
        if choices is not None and (axis.values is None or not np.isin(axis.values, choices).all()):
            return False
    try:
        design_matrix(family, {name: space.bounds.get(name, space.fixed.get(name)) for name in space.names})
    except InputError:
        return False
    return True
