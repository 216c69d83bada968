"""Writing of the blocks of outputs that the kernels of both loopers share; a block is an array (k, n, m) or None."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from kernels._jit import inline
from kernels.complex_step import arctan2
from kernels.driven_ball import Path, Swung
from kernels.vectors import Vector, dot

Numbers = NDArray[Any]  # float64, or complex128 for exact gradients by the complex step


@inline
def put_angle(out: Numbers | None, i: int, j: int, link: Swung, undefined: float) -> None:
    """Write the angle of a rocker [rad] and its three derivatives; ``undefined`` is 0, or nan for an invalid design."""
    if out is not None:
        out[0, i, j] = arctan2(link.sin + undefined, link.cos)
        out[1, i, j] = link.first + undefined
        out[2, i, j] = link.second + undefined
        out[3, i, j] = link.third + undefined


@inline
def put_loop(
    out: Numbers | None, i: int, j: int, delta: Any, along: Any, across: Any, unit: Any, undefined: float
) -> None:
    """Write discriminant [length^2] and pressure angle [rad] of a loop; ``across`` is the square of the idle part."""
    if out is not None:
        # one factor after the other: the square of the unit leaves float64 before the discriminant does
        out[0, i, j] = (delta * unit) * unit + undefined
        # arctangent, not acos: acos loses half the digits near zero.
        out[1, i, j] = arctan2(np.sqrt(across) + undefined, along)


@inline
def put_point(
    point: Numbers | None,
    velocity: Numbers | None,
    acceleration: Numbers | None,
    jerk: Numbers | None,
    magnitudes: Numbers | None,
    i: int,
    j: int,
    origin: Vector,
    path: Path,
    scale: Any,
) -> None:
    """Write place, three derivatives and their magnitudes of a point whose path is given from ``origin`` [length]."""
    p, p1, p2, p3 = path
    for k in range(3):
        if point is not None:
            point[k, i, j] = (origin[k] + p[k]) * scale
        if velocity is not None:
            velocity[k, i, j] = p1[k] * scale
        if acceleration is not None:
            acceleration[k, i, j] = p2[k] * scale
        if jerk is not None:
            jerk[k, i, j] = p3[k] * scale
    if magnitudes is not None:
        # the unit comes last: squares of lengths in the design's own unit could leave float64
        magnitudes[0, i, j] = np.sqrt(dot(p1, p1)) * scale
        magnitudes[1, i, j] = np.sqrt(dot(p2, p2)) * scale
        magnitudes[2, i, j] = np.sqrt(dot(p3, p3)) * scale
