"""What rounding may have changed at a pose near a dead point, alike at its neighbours, so that it leaves no ripple."""

from __future__ import annotations

import numpy as np

from kernels import status as st
from sweep.families.base import Array, Family
from sweep.families.capabilities import Assembly
from sweep.numerics.singularities import Singularities
from sweep.reductions.refine import EPS
from sweep.reductions.sampling import TWO_PI, Index, Mask, pose_columns

TRIES = 3
CONSTANT = 64.0 * EPS  # of its size: a curve that varies by no more tells nothing but rounding


def measure_constants(values: Array, scale: Array, rough: Array) -> None:
    """Make the size of a curve that is constant but for rounding the scale of its signed extrema, in place.

    The range of such a curve is noise, which no target relative to it can be met by, and no denser samples resolve.

    Parameters
    ----------
    values : (n, m) samples of one turn
    scale, rough : (n,) range of each curve, and what share of that the samples do not resolve
    """
    size = np.abs(values).max(axis=1)
    constant = np.ptp(values, axis=1) <= CONSTANT * size
    scale[constant], rough[constant] = size[constant], 0.0


def rounding_share(
    family: Family, designs: Array, columns: dict[str, Array], row: Index, column: Index, guards: list[str],
    order: Index,
) -> Array:  # fmt: skip
    """Return the share of values that rounding may have changed (docs/extrema.md, section 3).

    Parameters
    ----------
    family, designs : the (n, P) design matrix
    columns : the discriminants ``guards`` over one turn, (n, m) each
    row, column : (k,) design and sample of each value
    order : (k,) of the derivative that each value is, as of :func:`order_of`

    Notes
    -----
    A pose near a dead point amplifies the rounding of its discriminant.  What is rounded are terms of the size that
    the discriminant has where the links meet at a right angle: a tiny crank may keep it far below that over the whole
    turn.
    """
    amplified = np.ones(row.size)
    sizes = {loop.discriminant: loop.scale for loop in family.every(Assembly)}
    for name in guards:
        here, largest = columns[name][row, column], columns[name].max(axis=1)[row]
        if name in sizes:
            largest = np.maximum(largest, sizes[name](designs)[row])
        amplified += np.divide(largest, here, out=np.ones(row.size), where=tells(largest) & (here > 0.0))
    return _of_order(order, amplified)


def singular_share(near: Singularities, phi: Array, order: Index) -> Array:
    """Return what rounding may have changed near a singularity that no discriminant of an assembly tells of.

    What is rounded there falls with the square of the distance of its complex zero.

    Parameters
    ----------
    near : the singularities of the design of each value
    phi, order : (k,) crank angle [rad] of each value, and of which derivative it is
    """
    return _of_order(order, np.maximum(near.distance(phi) ** -2.0 - 1.0, 0.0))


def _of_order(order: Index, amplified: Array) -> Array:
    """Return the share of rounding: a derivative of order n grows like the power 1/2 - n of what vanishes."""
    found: Array = 4.0 * EPS * np.where(order == 0, np.sqrt(amplified), np.where(order < 3, amplified, 2.0 * amplified))
    return found


def shaken(family: Family, designs: Array, phi: Array, name: str) -> Array:
    """Return by how much a pose output changes where the inputs of a design are rounded otherwise, (n,).

    A kernel that is as exact as its inputs errs by as much again.  It is the largest change of TRIES poses, at one
    crank angle of each design; a pose that is lost by that tells nothing.
    """
    free = np.array([p.choices is None and p.unit != "count" for p in family.parameters])
    signs = np.where(free, np.random.default_rng(0).choice([-1.0, 1.0], (TRIES, free.size)), 0.0)
    every = np.concatenate([designs, *(designs * (1.0 + 2.0 * EPS * sign) for sign in signs)])
    columns, status = pose_columns(family, every, np.tile(phi, TRIES + 1)[:, None], [name])
    values, known = (x.reshape(TRIES + 1, len(designs)) for x in (columns[name], status == st.OK))
    off = values[1:] - values[0]
    if family.pose_output[name].wraps:
        off -= TWO_PI * np.rint(off / TWO_PI)
    found: Array = np.where(known[1:], np.abs(off), 0.0).max(axis=0)
    return found


def order_of(family: Family, pose: str) -> int:
    """Return the order of the derivative that a pose output is; 3 for what may be made of any: a magnitude, a force."""
    lower = {derivative: of for of, derivative in family.derivative_of.items()}
    if pose not in lower:
        return 0 if pose in family.derivative_of else 3
    return 1 + order_of(family, lower[pose])


def tells(discriminant: Array) -> Mask:
    """Return whether a discriminant is a number to rely on: at scales such as 1e100 or 1e-80 it leaves float64."""
    usable: Mask = (discriminant > 1e-280) & (discriminant < 1e280)
    return usable
