"""Parts of the skeletons of families: fixed axes and points from parameters, common sets of links."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import Any, Literal

import numpy as np

from kernels.types import Array
from sweep.families.base import Angles, Columns, Parameter, floats
from sweep.families.capabilities import DesignMap, Dimensions, Fixed, Link, MovingPoint, constant

X, Y, Z = (1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0)
CRANK, COUPLER, ROCKER = Link("crank", ("a", "b")), Link("coupler", ("b", "c")), Link("rocker", ("d", "c"))
CRANK_ROCKER = (CRANK, COUPLER, ROCKER)
SLIDER_CRANK = (CRANK, COUPLER, Link("slider", ("c",)))


def links(names: str) -> tuple[tuple[str, ...], ...]:
    """Links with one length each, from the names separated by blanks."""
    return tuple((name,) for name in names.split())


CRANK_ROCKER_SIZES = Dimensions(links("a b c"))
SLIDER_CRANK_SIZES = Dimensions(links("a b"))


def parameter(parameters: tuple[Parameter, ...], name: str | None, designs: Array) -> Array:
    """Column of a parameter, (n,); zeros for None."""
    if name is None:
        return np.zeros(len(designs))
    return designs[:, [p.name for p in parameters].index(name)]


def dimensions(parameters: tuple[Parameter, ...], designs: Array, *names: str) -> list[Array]:
    """Values of some parameters, each (n, 1) to combine with poses (n, m)."""
    return [parameter(parameters, name, designs)[:, None] for name in names]


def squared(parameters: tuple[Parameter, ...], name: str) -> DesignMap:
    """Square of a parameter, (n,), such as the coupler length that scales a discriminant to a squared cosine."""
    return lambda designs: np.square(parameter(parameters, name, designs))


def crank_axis(parameters: tuple[Parameter, ...], f: str, alpha: str) -> Fixed:
    """Return the crank axis: its centre is ``f`` along (0, sin alpha, cos alpha) from the origin."""
    at, axis = partial(_along, parameters, f, alpha), partial(_along, parameters, None, alpha)
    return Fixed(at, axis, foot=constant(0.0, 0.0, 0.0))


def _along(parameters: tuple[Parameter, ...], f: str | None, alpha: str, designs: Array) -> Array:
    angle = parameter(parameters, alpha, designs)
    axis = np.stack([np.zeros(len(designs)), np.sin(angle), np.cos(angle)], axis=1)
    return axis if f is None else axis * parameter(parameters, f, designs)[:, None]


def standing(
    parameters: tuple[Parameter, ...],
    x: str | None = None,
    y: str | None = None,
    z: str | None = None,
    *,
    axis: tuple[float, float, float] | None = Z,
    kind: Literal["axis", "slide", "point"] = "axis",
    zero: tuple[float, float, float] = X,
) -> Fixed:
    """Return a fixed point with parameters as coordinates, 0 for None, and a constant direction."""

    def at(designs: Array) -> Array:
        return np.stack([parameter(parameters, name, designs) for name in (x, y, z)], axis=1)

    return Fixed(at, None if axis is None else constant(*axis), kind, zero=constant(*zero))


def moving(
    parameters: tuple[Parameter, ...], sizes: str, needs: tuple[str, ...], place: Callable[..., tuple[Any, Any]]
) -> MovingPoint:
    """Return a moving point of the plane z = 0.

    ``place(angles, *sizes, *needs)`` returns x and y, (n, m), from the angles, the parameters ``sizes``, separated by
    blanks, and the pose outputs ``needs``.
    """

    def at(designs: Array, angles: Angles, found: Columns) -> Array:
        given = dimensions(parameters, designs, *sizes.split()), floats(found, *needs)
        x, y = np.broadcast_arrays(*place(angles, *given[0], *given[1]))
        return np.stack([x, y, np.zeros_like(x)], axis=-1)

    return MovingPoint(needs, at)


def line(of: Callable[[Array], tuple[Array, Array]]) -> Fixed:
    """Return a fixed line of motion: ``of`` gives a point and the direction, each (n, 3)."""
    return Fixed(lambda designs: of(designs)[0], lambda designs: of(designs)[1], "slide")


ORIGIN = Fixed(constant(0.0, 0.0, 0.0), constant(*Z))
