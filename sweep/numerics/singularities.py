"""Near singularities of a motion: complex zeros of its discriminants, and crank angles clustered about them.

Near a change point the motion varies on the scale of the zero's distance from the real angles, so crank angles whose
spacing is a share of that distance resolve a curve however close to the change point it is.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import NamedTuple, TypeAlias

import numpy as np

from kernels.types import TWO_PI, Array
from sweep.numerics.records import Indices

Discriminant: TypeAlias = Callable[[Indices, Array], Array]
"""``f(rows, phi)``: values of a discriminant of the designs ``rows`` (k,) at crank angles (k, m), or (1, m) for all."""

SAMPLES = 64  # samples of a discriminant, which is smooth even where the motion is nearly singular
NEAREST = 3  # nearest dips of each discriminant that are used
PASSES = 10
CLOSER = 0.25
SHORTEST = 1e-8  # steps and distances [rad] below which the crank angle's rounding dominates
FAR = 10.0  # distance [rad] given to zeros that do not matter: the poses are then spread evenly


class Singularities(NamedTuple):
    """Nearest complex zeros of n designs, each (n, k) [rad]: real part, and distance from the real angles."""

    phi: Array
    rho: Array

    def distance(self, phi: Array) -> Array:
        """Distance of the nearest zero from crank angles (n,) or (n, m)."""
        one = phi[:, None] if phi.ndim == 1 else phi
        away = np.abs(one[:, :, None] - self.phi[:, None, :])
        away = np.abs(away - TWO_PI * np.round(away / TWO_PI))
        nearest: Array = np.hypot(self.rho[:, None, :], away).min(axis=2)
        return nearest.reshape(phi.shape)


def singularities(discriminants: Sequence[Discriminant], n: int) -> Singularities:
    """Find the nearest complex zeros of the discriminants of n designs from their dips over the turn.

    A dip D + D''/2 x^2 vanishes at x = +- i rho with rho^2 = D/(D''/2).  The parabola through three samples is repeated
    with smaller steps about the dip.  Where a discriminant is nan there is no pose, and a zero is placed there.
    """
    if not discriminants:
        return Singularities(np.ones((n, 1)), np.full((n, 1), FAR))
    return side_by_side([dips(curve, n, number, FAR) for number, curve in enumerate(discriminants)])


def side_by_side(found: Sequence[Singularities]) -> Singularities:
    """Join the zeros of several discriminants of the same designs."""
    return Singularities(*(np.concatenate(parts, axis=1) for parts in zip(*found, strict=True)))


def dips(curve: Discriminant, n: int, number: int, within: float) -> Singularities:
    """Find the nearest zeros of one discriminant, the ``number``-th of its kind, as `singularities` does.

    Where the first parabola puts a zero farther away than ``within`` [rad] the samples are accurate enough.
    """
    spacing = TWO_PI / SAMPLES
    turn = np.arange(SAMPLES, dtype=np.float64) * spacing
    # One row of angles for all designs: their cosines and sines are computed once.
    values = np.broadcast_to(curve(np.arange(n), turn[None]), (n, SAMPLES))
    before, after = np.roll(values, 1, axis=1), np.roll(values, -1, axis=1)
    half_bend = 0.5 * (before + after) - values
    dip = (values <= before) & (values <= after) & (half_bend > 0.0)
    nearness = np.where(dip, values / np.where(dip, half_bend, 1.0), np.inf)
    column = np.argsort(nearness, axis=1)[:, :NEAREST]
    row, which = np.nonzero(np.take_along_axis(dip, column, axis=1))
    phi = turn[column[row, which]]
    rho = np.minimum(spacing * np.sqrt(np.maximum(nearness[row, column[row, which]], 0.0)), FAR)
    # Missing dips are far away, each at another angle.
    places, distances = np.tile(np.arange(1.0, 1.0 + NEAREST) + 0.1 * number, (n, 1)), np.full((n, NEAREST), FAR)
    places[row, which], distances[row, which] = phi, rho
    close = np.flatnonzero(rho <= within)
    row, which = row[close], which[close]
    places[row, which], distances[row, which] = _closer(curve, row, phi[close])
    lost = np.isnan(values)
    none = np.flatnonzero(lost.any(axis=1))
    places[none, 0], distances[none, 0] = turn[lost[none].argmax(axis=1)], SHORTEST
    return Singularities(places, distances)


def _closer(curve: Discriminant, row: Indices, phi: Array) -> tuple[Array, Array]:
    """Refine places and distances (k,) of the zeros of designs ``row`` near dips at ``phi`` (k,)."""
    spacing = TWO_PI / SAMPLES
    every, rho, step = np.arange(phi.size), np.full(phi.size, FAR), np.full(phi.size, spacing)
    for _ in range(PASSES if phi.size else 0):
        angles = phi[:, None] + step[:, None] * np.arange(-1.0, 2.0)
        values = curve(row, angles)
        lost = np.isnan(values)
        left, here, right = np.where(lost.any(axis=1, keepdims=True), 0.0, values).T  # without a bend it is not refined
        none = lost.any(axis=1)
        phi, rho = np.where(none, angles[every, lost.argmax(axis=1)], phi), np.where(none, SHORTEST, rho)
        bend, slope = 0.5 * (left + right) - here, 0.5 * (right - left)
        usable = bend > 0.0
        per_bend = np.divide(1.0, bend, out=np.zeros(phi.size), where=usable)
        move = np.clip(-0.5 * slope * per_bend, -1.0, 1.0)
        lowest = np.maximum(here - 0.25 * slope * slope * per_bend, 0.0)
        rho = np.where(usable, np.maximum(step * np.sqrt(lowest * per_bend), SHORTEST), rho)
        phi = phi + step * move
        step = np.maximum(CLOSER * step, np.maximum(CLOSER * np.minimum(rho, spacing), SHORTEST))
    return phi, np.minimum(rho, FAR)


def crowded(near: Singularities, share: float) -> Array:
    """Crank angles (n, m) of a turn in rising order, spaced by at most a share of the nearest zero's distance.

    About each zero the angles are phi + rho sinh(t) for equidistant t, a spacing of hypot(rho, x) dt.  A design that
    needs fewer angles than others repeats some, so that its angles do not depend on the other designs.
    """
    n, k = near.phi.shape
    reach = np.arcsinh(np.pi / near.rho).max(axis=1, initial=1.0)
    own = np.ceil(reach / share).astype(np.int64)  # angles that each design needs on either side of its zeros
    half = int(own.max(initial=1))
    number = np.clip(np.arange(-half, half + 1), -own[:, None], own[:, None]) / own[:, None]
    t = np.arcsinh(np.pi / near.rho)[:, :, None] * number[:, None, :]
    angles = near.phi[:, :, None] + near.rho[:, :, None] * np.sinh(t)
    return np.sort(np.mod(angles.reshape(n, k * (2 * half + 1)), TWO_PI), axis=1)


def turn_edges(near: Singularities, share: float) -> Array:
    """Panel edges (n, p + 1) from 0 to 2 pi; no panel is longer than a share of the nearest zero's distance."""
    inner = crowded(near, share)
    ends = np.zeros((len(inner), 1))
    return np.concatenate([ends, inner, ends + TWO_PI], axis=1)
