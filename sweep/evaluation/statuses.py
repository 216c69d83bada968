"""Meanings of status codes, for tables and reports; every missing value gets a status."""

from __future__ import annotations

import math
from collections.abc import Iterable
from functools import reduce

import numpy as np

from kernels.status import INVALID_INPUT, MEANING, OK
from sweep.families.base import Columns
from sweep.families.names import error_of


def meaning(code: int) -> str:
    """Meaning of a status code in words, also of an unknown one."""
    return MEANING.get(int(code), f"status {int(code)}: unknown")


def meanings(codes: Iterable[int]) -> list[str]:
    """Meanings of many status codes, in order."""
    texts: dict[int, str] = {}
    return [texts.setdefault(int(code), meaning(code)) for code in codes]


def explained(columns: Columns, names: Iterable[str]) -> Columns:
    """Set a status wherever one of the named values is missing or infinite, and its error to nan there.

    A missing value without a status of a kernel gets INVALID_INPUT: the scale of its parameters is beyond float64.
    """
    status = np.array(columns["status"], np.uint8)
    changed: Columns = {}
    names = [name for name in names if columns[name].dtype.kind == "f"]
    # A missing value makes the sum of all missing; an overflow of the sum only leads to a closer check.
    if not names or math.isfinite(np.add.reduce(reduce(np.add, [columns[name] for name in names]), axis=None)):
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
