"""What status codes say, in words: for tables that people read, and for the report; no value is missing without one."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from functools import reduce

import numpy as np
from numpy.typing import NDArray

from kernels.status import INVALID_INPUT, MEANING, OK
from sweep.families.base import Columns
from sweep.families.names import error_of


def meaning(code: int) -> str:
    """Return the meaning of a status code in words, also of an unknown one."""
    return MEANING.get(int(code), f"status {int(code)}: unknown")


def meanings(codes: Iterable[int]) -> list[str]:
    """Return what each of many status codes says, in their order."""
    known: dict[int, str] = {}
    return [known.setdefault(int(code), meaning(code)) for code in codes]


def explained(columns: Columns, names: Iterable[str]) -> Columns:
    """Return columns with a status wherever one of these values is missing or infinite; its error is nan there.

    The status of what no kernel has explained is INVALID_INPUT: the scale of its parameters is beyond float64.
    """
    status = np.array(columns["status"], np.uint8)
    changed: Columns = {}
    names = [name for name in names if columns[name].dtype.kind == "f"]
    if _all_finite([columns[name] for name in names]):
        return columns | {"status": status}
    for name in names:
        missing = ~np.isfinite(columns[name])
        if not missing.any():
            continue
        np.copyto(status, INVALID_INPUT, where=missing & (status == OK))
        for key in (name, error_of(name)):
            if key in columns and not (np.isnan(columns[key]) | ~missing).all():
                changed[key] = np.where(missing, np.nan, columns[key])
    return columns | changed | {"status": status}


def _all_finite(values: Sequence[NDArray[np.generic]]) -> bool:
    """Tell whether equally shaped columns surely hold finite values alone.

    A value that is missing stays so in a sum; a sum that overflows is no more than a reason to look closer.
    """
    if not values:
        return True
    return math.isfinite(np.add.reduce(reduce(np.add, values), axis=None))
