"""Limits of design outputs and parameters, and how they compare."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from sweep.families.base import Array
from sweep.families.names import by_magnitude

Number = TypeVar("Number", float, Array)


@dataclass(frozen=True)
class Limit:
    """Bounds of a design output or of a parameter; equal ones ask for a value, ``rotatable = true`` is a minimum of 1.

    A parameter needs bounds of its own where [fit] sets or scales it.
    """

    output: str
    minimum: float | None = None
    maximum: float | None = None


def compared(name: str, values: Number) -> Number:
    """Give what limits and objectives compare: the magnitude of a swing or stroke, the value of any other output."""
    return abs(values) if by_magnitude(name) else values


def refusals(limits: Iterable[Limit], values: Mapping[str, float]) -> list[str]:
    """Say in words which limits a design breaks, each with its value and bound; a missing value breaks any."""
    found = []
    for limit in limits:
        value = values[limit.output]
        if meets(limit, np.array([value]))[0]:
            continue
        bounds = (("at least", limit.minimum), ("at most", limit.maximum))
        words = " and ".join(f"{word} {bound:g}" for word, bound in bounds if bound is not None)
        found.append(f"{limit.output} = {compared(limit.output, value):.4g}, {words} is asked")
    return found


def meets(limit: Limit, values: NDArray[np.generic]) -> NDArray[np.bool_]:
    """Tell whether each value keeps the limit; nan does not, and a swing or stroke is compared by magnitude."""
    x = compared(limit.output, np.asarray(values, dtype=np.float64))
    good = np.isfinite(x)
    if limit.minimum is not None:
        good &= x >= limit.minimum
    if limit.maximum is not None:
        good &= x <= limit.maximum
    return good
