"""Outputs of a working point that moves in space, shared by the entries of the loopers, and blocks of outputs."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from itertools import pairwise

import numpy as np

from sweep.families.base import Angles, Array, Columns, Output

AXES = "xyz"
_KINDS = ("", "velocity analogue of the ", "acceleration analogue of the ", "jerk analogue of the ")
_ORDERS = ("", "d", "d2", "d3")


def point_outputs(equation: str) -> tuple[tuple[Output, ...], ...]:
    """Return the place, velocity, acceleration and jerk of the working point, three components each."""
    return tuple(
        tuple(Output(f"{order}{axis}_p", "length", f"{kind}working point along {axis}", equation) for axis in AXES)
        for order, kind in zip(_ORDERS, _KINDS, strict=True)
    )


def magnitude_outputs(equation: str) -> tuple[Output, ...]:
    """Return magnitudes of the working point's velocity, acceleration and jerk,
    per radian of the family's own crank.
    """
    return (
        Output("speed_p", "length", "magnitude of the working point's velocity analogue", equation),
        Output("acceleration_p", "length", "magnitude of the working point's acceleration analogue", equation),
        Output("jerk_p", "length", "magnitude of the working point's jerk analogue", equation),
    )


def joint_outputs(joints: Sequence[tuple[str, str]], equation: str) -> tuple[Output, ...]:
    """Return coordinates of joints, given as (suffix of the name, what it is)."""
    return tuple(
        Output(f"{axis}_{name}", "length", f"{text}, along {axis}", equation) for name, text in joints for axis in AXES
    )


def ladders(*names: str) -> dict[str, str]:
    """Map each name and its first two derivatives to the next derivative."""
    return {f"{low}{name}": f"{high}{name}" for name in names for low, high in pairwise(_ORDERS)}


def filled_blocks(
    kernel: Callable[..., None],
    designs: Array,
    angles: Angles,
    blocks: Sequence[Sequence[Output]],
    wanted: frozenset[str],
) -> Columns:
    """Call a kernel of poses whose outputs are arrays (k, n, m), one per block of outputs, or None.

    A block is computed when one of its outputs is wanted.
    """
    shape, dtype = (len(designs), angles.cos.shape[1]), np.result_type(designs, angles.cos)
    status = np.empty(shape, np.uint8)
    rooms = [
        None if wanted.isdisjoint(o.name for o in block) else np.empty((len(block), *shape), dtype) for block in blocks
    ]
    kernel(designs, angles.cos, angles.sin, status, *rooms)
    columns: Columns = {
        output.name: values
        for block, room in zip(blocks, rooms, strict=True)
        if room is not None
        for output, values in zip(block, room, strict=True)
        if output.name in wanted
    }
    return columns | {"status": status}
