"""Rows of named tuples of columns, and their selection by index or mask."""

from __future__ import annotations

from typing import Any, TypeAlias, TypeVar

import numpy as np
from numpy.typing import NDArray

Indices: TypeAlias = NDArray[np.intp]
Mask: TypeAlias = NDArray[np.bool_]

Record = TypeVar("Record", bound=tuple[Any, ...])


def only(record: Record, which: Indices | Mask | list[int] | slice) -> Record:
    """Select rows of a named tuple of columns by index, mask or slice."""
    return type(record)(*(column[which] for column in record))


def joined(*records: Record) -> Record:
    """Concatenate the rows of named tuples of columns."""
    return type(records[0])(*(np.concatenate(columns) for columns in zip(*records, strict=True)))


def put(record: tuple[Any, ...], rows: Indices | Mask, values: tuple[Any, ...]) -> None:
    """Write rows of a named tuple of columns, in place."""
    for column, part in zip(record, values, strict=True):
        column[rows] = part
