"""Periodic functions of one angle given by the user: a table, or a Fourier series."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, TypeAlias

import numpy as np

from kernels.types import TWO_PI, Array

if TYPE_CHECKING:
    from scipy.interpolate import PchipInterpolator

    from sweep.numerics.records import Mask

PER_GAP = 4.0  # samples between two points of a table, or per period of a harmonic
FINEST = 2049  # even samples of a turn, for curves that jump
AROUND = 3  # points repeated from the next and the last turn: a slope depends on the two neighbours alone


@dataclass(frozen=True)
class TableCurve:
    """A table over one turn, joined by monotone cubics (Fritsch and Carlson 1980, Fritsch and Butland 1984).

    Between two points the curve stays between their values: a table of forces that are never negative gives no
    negative force.  Value and slope are continuous, over the seam of the turn too.

    Parameters
    ----------
    phi : two or more rising angles within one turn, the seam once [rad]
    values : the values there
    """

    phi: tuple[float, ...]
    values: tuple[float, ...]

    def __call__(self, phi: Array) -> Array:
        """Values at angles of any shape."""
        start = self.phi[0]
        return self._cubics(start + np.mod(phi - start, TWO_PI))

    @property
    def samples(self) -> float:
        """Number of even samples of a turn that places several between any two points of the table."""
        return PER_GAP * TWO_PI / float(np.diff([*self.phi, self.phi[0] + TWO_PI]).min())

    def slope(self, phi: Array) -> Array:
        """Return the derivative at angles of any shape."""
        start = self.phi[0]
        return self._cubics(start + np.mod(phi - start, TWO_PI), 1)

    @cached_property
    def _cubics(self) -> PchipInterpolator:
        from scipy.interpolate import PchipInterpolator

        rounds = -(-AROUND // len(self.phi))
        phi = np.concatenate([np.array(self.phi) + k * TWO_PI for k in range(-rounds, rounds + 2)])
        # Next to a level piece a reciprocal slope may be infinite: the slope is 0 then.
        with np.errstate(over="ignore"):
            return PchipInterpolator(phi, np.tile(self.values, 2 * rounds + 2), extrapolate=False)


@dataclass(frozen=True)
class SeriesCurve:
    """A Fourier series: mean + sum of cos[k - 1] cos(k phi) + sin[k - 1] sin(k phi)."""

    mean: float = 0.0
    cos: tuple[float, ...] = ()
    sin: tuple[float, ...] = ()

    @property
    def samples(self) -> float:
        """Number of even samples of a turn that places several on each period of its highest harmonic."""
        return PER_GAP * max(len(self.cos), len(self.sin))

    def __call__(self, phi: Array) -> Array:
        """Values at angles of any shape."""
        total = np.full_like(phi, self.mean)
        for factors, function in ((self.cos, np.cos), (self.sin, np.sin)):
            for order, factor in enumerate(factors, start=1):
                total += factor * function(order * phi)
        return total


Curve: TypeAlias = TableCurve | SeriesCurve

SEAM = 1e-9  # tolerance at the seam of the turn: of angles [rad], and of values relative to the largest


def table_curve(phi: Array, values: Array) -> TableCurve:
    """Build the curve of a table; its first point may lie anywhere in the turn.

    Parameters
    ----------
    phi : (n,) angles [rad]; the point of the seam may stand twice, at both ends
    values : (n,); at the seam those of a sine differ by their rounding

    Raises
    ------
    ValueError
        for fewer than two points, values that are not finite, angles that do not rise or cover more than a turn, or
        two different values at the seam.
    """
    if phi.ndim != 1 or phi.shape != values.shape:
        raise ValueError("as many angles as values")
    if not (np.isfinite(phi).all() and np.isfinite(values).all()):
        raise ValueError("finite numbers")
    whole = phi.size > 1 and abs(phi[-1] - phi[0] - TWO_PI) < SEAM
    if whole and abs(values[-1] - values[0]) > SEAM * np.abs(values).max():
        raise ValueError("the same value at both ends of the turn")
    if whole:
        phi, values = phi[:-1], values[:-1]
    if phi.size < 2 or not (np.diff(phi) > 0.0).all() or not phi[-1] - phi[0] < TWO_PI:
        raise ValueError("two or more rising angles within one turn")
    return TableCurve(tuple(map(float, phi)), tuple(map(float, values)))


def with_jumps(least: Array, jumps: Mask) -> Array:
    """Return the least number of even samples, (n,), as inf where a curve jumps: that asks for the finest grid.

    More than that grid has is kept: the gap that needs it would not be seen beside the jump.
    """
    return np.where(jumps & (least <= FINEST), np.inf, least)
