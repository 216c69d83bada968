"""Balancing: harmonics of a shaking force, and optimal counterweights (machine-and-stitch, 3).

A counterweight is a mass times the vector from a shaft's axis to it, U = (along, across) the mark of the shaft.  Forces
are linear in U, so optimal counterweights solve a linear least-squares problem; the inertia that they add is not
linear.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from kernels.types import Array


class Orders(NamedTuple):
    """Fourier coefficients over a turn: mean, and cosine and sine amplitudes (n, ...) of orders 1 to n."""

    mean: Array
    cos: Array
    sin: Array


@dataclass(frozen=True)
class CorrectionPlane:
    """Plane of a counterweight.

    Parameters
    ----------
    at : centre of the counterweight's circle
    mark, across : unit vectors square to the axis: the shaft's mark at angle 0, and a quarter of a turn later
    ratio, phase : the shaft turns by ratio phi + phase
    """

    at: tuple[float, float, float]
    mark: tuple[float, float, float]
    across: tuple[float, float, float]
    ratio: float = 1.0
    phase: float = 0.0

    def forces(self, phi: Array, speed: float) -> Array:
        """Return the forces on the frame of U = (1, 0) and of (0, 1), (m, 3, 2), at constant speed."""
        angle = self.ratio * phi[:, None] + self.phase
        mark, across = np.array([self.mark]), np.array([self.across])
        along = np.cos(angle) * mark + np.sin(angle) * across
        square = -np.sin(angle) * mark + np.cos(angle) * across
        return (self.ratio * speed) ** 2 * np.stack([along, square], axis=2)


class Balanced(NamedTuple):
    """Counterweights U (k, 2), and the remaining force and moment, each (m, 3)."""

    weights: Array
    force: Array
    moment: Array


def orders(values: Array, most: int) -> Orders:
    """Return the Fourier coefficients of samples (m, ...) at equal steps of a turn from 0; exact up to aliasing."""
    m = len(values)
    coefficients = np.fft.rfft(values, axis=0) / m
    coefficients[1 : (m + 1) // 2] *= 2.0  # order m/2 has one cosine and no pair
    return Orders(coefficients[0].real, coefficients[1 : most + 1].real, -coefficients[1 : most + 1].imag)


def rms(values: Array) -> float:
    """Return the root mean square of a vector's magnitude (m, 3) over the turn."""
    return float(np.sqrt((values**2).sum(axis=1).mean()))


def best_counterweights(
    phi: Array,
    force: Array,
    moment: Array,
    speed: float,
    places: Sequence[CorrectionPlane],
    length: float | None = None,
) -> Balanced:
    """Find the counterweights that minimise the rms force, or force and moment, by linear least squares.

    Parameters
    ----------
    phi : equal steps of a turn, (m,)
    force, moment : on the frame, about the origin, (m, 3)
    speed : of the main shaft, constant
    places : correction planes of the counterweights
    length : divides a moment so that it counts as a force; None ignores moments
    """
    forces = [place.forces(phi, speed) for place in places]
    moments = [np.cross(np.array(place.at), f, axisb=1, axisc=1) for place, f in zip(places, forces, strict=True)]
    of_force, of_moment = (np.concatenate(parts, axis=2) for parts in (forces, moments))
    rows, right = [of_force.reshape(-1, 2 * len(places))], [force.reshape(-1)]
    if length is not None:
        rows.append(of_moment.reshape(-1, 2 * len(places)) / length)
        right.append(moment.reshape(-1) / length)
    weights = np.linalg.lstsq(np.concatenate(rows), -np.concatenate(right), rcond=None)[0]
    return Balanced(weights.reshape(-1, 2), force + of_force @ weights, moment + of_moment @ weights)


def force_balance(lengths: tuple[float, float, float], masses: Array, centres: Array) -> tuple[complex, complex]:
    """Return U of crank and rocker that remove the shaking force of a four-bar, Berkof and Lowen (8).

    ``lengths`` are those of crank, coupler and rocker; ``masses`` (3,) and ``centres`` (3,), complex along and across
    each link from its first joint, are those of the same links.  The result also holds for a crank-rocker in space
    whose coupler has its centre on the line of its joints; otherwise a force remains that no counterweight on the
    shafts removes.
    """
    a, b, c = lengths
    crank = -(masses[0] * centres[0] + masses[1] * a * (1.0 - centres[1] / b))
    rocker = -(masses[2] * centres[2] + masses[1] * (c / b) * centres[1])
    return complex(crank), complex(rocker)
