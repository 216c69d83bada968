"""Closures and results of one stage of a chain, from which fused kernels are generated."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, NamedTuple, TypeAlias

Helper: TypeAlias = Callable[..., Any]

# The search keeps the constants of a stage for each local maximum, in rows of STRIDE numbers, 9 for each design of a
# block.  Rows are an odd number of cache lines long, so that they do not evict each other.
STRIDE = 616
BLOCK = 64  # designs side by side


class Turned(NamedTuple):
    """Output angle of a stage: cosine, sine, derivatives by the independent angle; the discriminant."""

    cos: Any
    sin: Any
    d1: Any
    d2: Any
    d3: Any
    d4: Any
    delta: Any


class Travel(NamedTuple):
    """Output of the last stage: two coordinates x and y with their derivatives, and the discriminant.

    A guided point has x along its line and y = dev across it [length].  A rocker has its angle psi as x, of which only
    the derivatives are given; its y is 0.
    """

    x0: Any
    x1: Any
    x2: Any
    x3: Any
    x4: Any
    y0: Any
    y1: Any
    y2: Any
    y3: Any
    y4: Any
    delta: Any


@dataclass(frozen=True)
class Form:
    """Inline closures of one stage; c stands for its constants, (u, v) for cosine and sine of its input angle.

    No closure has a branch, and results that a kernel does not use are not compiled, so loops over poses vectorise.
    The discriminant under a root is clamped to a tiny positive number: kernels look at ``delta`` itself.

    Parameters
    ----------
    name : of the family
    columns : of its design matrix
    angle : column of an angle whose cosine and sine the constants need, or None
    numbers : how many constants there are
    constants : (array, place, step, cos, sin) -> c, from the design's columns at place, place + step, ..., and cosine
        and sine of ``angle``; a tuple of floats with a field ``doubt``: a bound of the rounding error of ``delta`` at
        any pose, nan for an invalid design
    put, get : (array, place, c) and (array, place) -> c: constants in rows of `STRIDE` numbers
    turn : (c, kappa, u, v) -> `Turned`, of kappa times the output angle; None for a family that drives nothing
    travel : (c, u, v) -> `Travel`
    dip : (c, u, v) -> squared cosine of the pressure angle where the links reach, and its first two derivatives
    turn_blur : (c, u, v, d1, d2, d3) -> estimates of the rounding errors of the output angle and its first three
        derivatives
    travel_blur : (c, u, v, x1, x2, x3) -> estimates of the rounding errors of x, x', x'', x''', y, y', y'', y''', and
        of the squared cosine of ``dip``
    """

    name: str
    columns: int
    angle: int | None
    numbers: int
    constants: Helper
    put: Helper
    get: Helper
    turn: Helper | None
    travel: Helper
    dip: Helper
    turn_blur: Helper | None
    travel_blur: Helper
