"""Limits of design outputs and parameters, and their comparison with values."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from sweep.families.base import Array
from sweep.families.names import by_magnitude

Number = TypeVar("Number", float, Array)


@dataclass(frozen=True)
class Limit:
    """Bounds of a design output or of a parameter; equal bounds prescribe a value.

    ``rotatable = true`` is a minimum of 1.  A parameter needs bounds of its own where [fit] sets or scales it.
    """

    output: str
    minimum: float | None = None
    maximum: float | None = None

    @property
    def is_equation(self) -> bool:
        """Whether the bounds are equal and prescribe a value, which no toleranced design can keep."""
        return self.minimum is not None and self.minimum == self.maximum


def compared(name: str, values: Number) -> Number:
    """Value that limits and objectives compare: the magnitude of a swing or stroke, any other output as it is."""
    return abs(values) if by_magnitude(name) else values


def meets(limit: Limit, values: NDArray[np.generic]) -> NDArray[np.bool_]:
    """Test which values keep the limit, (n,); nan fails, and a swing or stroke is compared by magnitude."""
    x = compared(limit.output, np.asarray(values, dtype=np.float64))
    good = np.isfinite(x)
    if limit.minimum is not None:
        good &= x >= limit.minimum
    if limit.maximum is not None:
        good &= x <= limit.maximum
    return good
