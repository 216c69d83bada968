"""Parts of which the skeletons of families are made: fixed axes and points out of parameters, common sets of links."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import Literal

import numpy as np

from kernels.types import Array
from sweep.families.base import Parameter
from sweep.families.capabilities import DesignMap, Dimensions, Fixed, Link

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
    return Fixed(at, axis, foot=partial(_same, (0.0, 0.0, 0.0)))


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
    along = None if axis is None else partial(_same, axis)
    return Fixed(partial(_coordinates, parameters, (x, y, z)), along, kind, zero=partial(_same, zero))


def _coordinates(parameters: tuple[Parameter, ...], names: tuple[str | None, ...], designs: Array) -> Array:
    return np.stack([parameter(parameters, name, designs) for name in names], axis=1)


def _same(vector: tuple[float, float, float], designs: Array) -> Array:
    return np.tile(np.array(vector), (len(designs), 1))


def line(of: Callable[[Array], tuple[Array, Array]]) -> Fixed:
    """Return a line along which something moves: ``of`` gives a point of it and its direction, each (n, 3)."""
    return Fixed(partial(_one_of, of, 0), partial(_one_of, of, 1), "slide")


def _one_of(of: Callable[[Array], tuple[Array, Array]], which: int, designs: Array) -> Array:
    return of(designs)[which]


ORIGIN = Fixed(partial(_same, (0.0, 0.0, 0.0)), partial(_same, Z))
