"""Limits of design outputs and parameters, and their comparison with values."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass, replace
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

    @property
    def ends(self) -> tuple[float, float]:
        """Both bounds, infinite if there is none."""
        return -math.inf if self.minimum is None else self.minimum, math.inf if self.maximum is None else self.maximum

    def drawn_in(self, margin: float) -> Limit:
        """Return the limit tightened by a margin; a band narrower than both margins becomes infeasible."""
        low, high = (None if x is None else x + d for x, d in ((self.minimum, margin), (self.maximum, -margin)))
        return replace(self, minimum=low, maximum=high)


def tightest(limits: Iterable[Limit], output: str) -> tuple[float, float]:
    """Return the largest minimum and the smallest maximum of an output under some limits, infinite without one."""
    lows, highs = zip((-math.inf, math.inf), *(x.ends for x in limits if x.output == output), strict=True)
    return max(lows), min(highs)


def compared(name: str, values: Number) -> Number:
    """Value that limits and objectives compare: the magnitude of a swing or stroke, any other output as it is."""
    return abs(values) if by_magnitude(name) else values


def meets(limit: Limit, values: NDArray[np.generic]) -> NDArray[np.bool_]:
    """Test which values keep the limit, (n,); nan fails, and a swing or stroke is compared by magnitude."""
    x = compared(limit.output, np.asarray(values, dtype=np.float64))
    low, high = limit.ends
    return np.isfinite(x) & (x >= low) & (x <= high)
