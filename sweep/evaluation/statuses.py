"""What status codes say, in words: for tables that people read, and for the report; no value is missing without one."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from kernels.status import INVALID_INPUT, MEANING, OK
from sweep.families.base import Columns
from sweep.families.names import error_of


def meaning(code: int) -> str:
    """Return what one status code says; a number that is none of ours says so."""
    return MEANING.get(int(code), f"status {int(code)}: unknown")


def meanings(codes: Iterable[int]) -> list[str]:
    """Return what each of many status codes says, in their order."""
    known: dict[int, str] = {}
    return [known.setdefault(int(code), meaning(code)) for code in codes]


def explained(columns: Columns, names: Iterable[str]) -> Columns:
    """Return the columns with a status wherever one of these values is missing or has left float64,
    and no error of it.

    The status of what no kernel has explained is INVALID_INPUT: the scale of its parameters is beyond float64.
    """
    status = np.array(columns["status"], np.uint8)
    changed: Columns = {}
    for name in names:
        if columns[name].dtype.kind != "f":
            continue
        missing = ~np.isfinite(columns[name])
        if not missing.any():
            continue
        np.copyto(status, INVALID_INPUT, where=missing & (status == OK))
        for key in (name, error_of(name)):
            if key in columns and not (np.isnan(columns[key]) | ~missing).all():
                changed[key] = np.where(missing, np.nan, columns[key])
    return columns | changed | {"status": status}
