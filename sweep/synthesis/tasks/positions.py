"""Crank-rockers through given positions: the difference form of the closure, linear in the offset f."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from sweep.families.base import Array
from sweep.synthesis.tasks.crank_rocker import LocusPoint, designs_on_locus
from sweep.synthesis.tasks.problem import stacked

PLANAR = 1e-12  # |sin(alpha)| below which f has no influence


class Position(NamedTuple):
    """An intermediate position: crank and rocker angle from the extended position on [rad]."""

    dphi: float
    dpsi: float


def equation_names(alpha: float, count: int) -> tuple[str, ...]:
    """Return which positions remain as equations: f takes the first one, unless sin(alpha) = 0."""
    first = 2 if abs(np.sin(alpha)) > PLANAR else 1
    return tuple(f"position {k}" for k in range(first, count + 1))


class Through(NamedTuple):
    """Crank-rockers (n, 8) through positions: residuals (n, k) of their closure and slacks (n, k) of their branch."""

    designs: Array
    residuals: Array
    slacks: Array


def through_positions(
    swing: Array,
    phi0: Array,
    phi1: Array,
    e: float,
    g: float | Array,
    alpha: float | Array,
    positions: tuple[Position, ...],
    f: float,
) -> Through:
    """Return crank-rockers on the locus whose f makes them pass the first position exactly,
    and how they miss the others.

    Equation (15) of docs/synthesis.md.  With sin(alpha) = 0 the closure does not contain f: the given f is taken and
    the first position is a residual like the others.  Residuals are in squared mean distances of the rocker ball from
    the crank axis.
    """
    point = LocusPoint.of(swing, phi0, phi1, e, g, alpha)
    sa, ca = np.sin(alpha), np.cos(alpha)
    h = g * sa
    x2, y2 = point.turned(swing)
    both = point.rho1 + point.rho2
    a0, a1 = e * (point.x - x2) / both, -sa * (point.y - y2) / both
    moved = []
    for position in positions:
        x, y = point.turned(np.full(len(phi1), position.dpsi))
        angle = phi1 + position.dphi
        ahead = np.cos(angle) * (e + x) + np.sin(angle) * (ca * y - h) - point.rho1
        moved.append((e * (x - point.x) - a0 * ahead, sa * (y - point.y) + a1 * ahead))
    free = bool((np.abs(sa) > PLANAR).all())
    with np.errstate(divide="ignore", invalid="ignore"):
        offset = moved[0][0] / moved[0][1] if free else np.full(len(phi1), f)
    offset = np.where(np.abs(offset) < 1e100, offset, np.nan)
    ones = np.ones(len(phi1))
    designs, psi1 = designs_on_locus(swing, phi0, phi1, e * ones, offset, g * ones, alpha * ones)
    scale = (0.5 * both) ** 2
    residuals = stacked(len(phi1), [(p - offset * q) / scale for p, q in moved[1 if free else 0 :]])
    slacks = np.column_stack([_branch_slack(designs, psi1 + p.dpsi, phi1 + p.dphi) for p in positions])
    return Through(designs, residuals, slacks)


def _branch_slack(designs: Array, psi: Array, phi: Array) -> Array:
    """Return the cosine of the pressure angle at a position, positive if it lies on the design's own branch."""
    a, b, _, e, f, _, alpha, branch = designs.T
    x, y = e - a * np.cos(phi), f * np.sin(alpha) + a * np.cos(alpha) * np.sin(phi)
    slack: Array = -branch * (x * np.sin(psi) + y * np.cos(psi)) / b
    return slack
