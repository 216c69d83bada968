"""Writing of optional outputs: single arrays (n, m), and the blocks (k, n, m) of a working point."""

from __future__ import annotations

from typing import Any

import numpy as np

from kernels.arithmetic.complex_step import arctan2
from kernels.arithmetic.vectors import Vector, add, dot
from kernels.jit import inline
from kernels.linkage.driven_ball import Path, Swung
from kernels.types import Numbers


@inline
def write(out: Numbers | None, i: int, j: int, value: Any) -> None:
    """Write a value if the output is wanted; through a function, since a field that is None cannot be written to."""
    if out is not None:
        out[i, j] = value


@inline
def write_number(out: Numbers | None, i: int, value: Any) -> None:
    """Write the value of a design if the output is wanted."""
    if out is not None:
        out[i] = value


@inline
def has_point(out: Any) -> bool:
    """Whether any output of the working point is wanted, which is known when the kernel is compiled."""
    return (
        out.point is not None or out.velocity is not None or out.acceleration is not None
        or out.jerk is not None or out.magnitudes is not None
    )  # fmt: skip


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
    """Write discriminant [length^2] and pressure angle [rad] of a loop; ``across``: square of the part without work."""
    if out is not None:
        # one factor after the other: the square of the unit leaves float64 before the discriminant does
        out[0, i, j] = (delta * unit) * unit + undefined
        # arctangent, not acos: acos loses half the digits near zero.
        out[1, i, j] = arctan2(np.sqrt(across) + undefined, along)


@inline
def put_block(out: Numbers | None, i: int, j: int, values: tuple[Any, ...], scale: Any) -> None:
    """Write numbers of one type and unit, such as x y z of a vector."""
    if out is not None:
        for k in range(len(values)):
            out[k, i, j] = values[k] * scale


@inline
def put_point(out: Any, i: int, j: int, origin: Vector, path: Path, scale: Any) -> None:
    """Write place, three derivatives and their magnitudes of a point whose path is given from ``origin`` [length].

    ``out`` has them as the fields point, velocity, acceleration, jerk and magnitudes.
    """
    p, p1, p2, p3 = path
    put_block(out.point, i, j, add(origin, p), scale)
    put_block(out.velocity, i, j, p1, scale)
    put_block(out.acceleration, i, j, p2, scale)
    put_block(out.jerk, i, j, p3, scale)
    # the unit comes last: squares of lengths in the design's own unit could leave float64
    put_block(out.magnitudes, i, j, (np.sqrt(dot(p1, p1)), np.sqrt(dot(p2, p2)), np.sqrt(dot(p3, p3))), scale)
