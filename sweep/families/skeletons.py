"""Parts of which the skeletons of families are made: fixed axes and points out of parameters, common sets of links."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import Literal

import numpy as np

from kernels.types import Array
from sweep.families.base import Parameter
from sweep.families.capabilities import DesignMap, Dimensions, Fixed, Link, constant

X, Y, Z = (1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0)
CRANK, COUPLER, ROCKER = Link("crank", ("a", "b")), Link("coupler", ("b", "c")), Link("rocker", ("d", "c"))
CRANK_ROCKER = (CRANK, COUPLER, ROCKER)
SLIDER_CRANK = (CRANK, COUPLER, Link("slider", ("c",)))


def links(names: str) -> tuple[tuple[str, ...], ...]:
    """Links that are each given by one length, the names with blanks between."""
    return tuple((name,) for name in names.split())


CRANK_ROCKER_SIZES = Dimensions(links("a b c"))
SLIDER_CRANK_SIZES = Dimensions(links("a b"))


def parameter(parameters: tuple[Parameter, ...], name: str | None, designs: Array) -> Array:
    """Column of a parameter, (n,); zeros where there is none."""
    if name is None:
        return np.zeros(len(designs))
    return designs[:, [p.name for p in parameters].index(name)]


def dimensions(parameters: tuple[Parameter, ...], designs: Array, *names: str) -> list[Array]:
    """Values of some parameters, (n, 1) each, beside poses (n, m)."""
    return [parameter(parameters, name, designs)[:, None] for name in names]


def squared(parameters: tuple[Parameter, ...], name: str) -> DesignMap:
    """Square of a parameter, (n,), such as the coupler's that makes a discriminant a squared cosine."""
    return lambda designs: np.square(parameter(parameters, name, designs))


def crank_axis(parameters: tuple[Parameter, ...], f: str, alpha: str) -> Fixed:
    """Return the crank's centre, ``f`` along the axis (0, sin alpha, cos alpha) from the origin."""
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
    """Fix a point whose coordinates are parameters, or 0 where none is named, and a constant direction."""

    def at(designs: Array) -> Array:
        return np.stack([parameter(parameters, name, designs) for name in (x, y, z)], axis=1)

    return Fixed(at, None if axis is None else constant(*axis), kind, zero=constant(*zero))


def line(of: Callable[[Array], tuple[Array, Array]]) -> Fixed:
    """Return a line along which something moves: ``of`` gives a point of it and its direction, each (n, 3)."""
    return Fixed(lambda designs: of(designs)[0], lambda designs: of(designs)[1], "slide")


ORIGIN = Fixed(constant(0.0, 0.0, 0.0), constant(*Z))
