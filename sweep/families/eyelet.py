"""Registry entry of the thread take-up by an eyelet on a crank, or, as second stage of a chain, on a rocker."""

from __future__ import annotations

from functools import partial

import numpy as np

from kernels.families import eyelet
from kernels.types import Array
from sweep.families.base import Angles, Columns, Family, Output, about, parameters_of
from sweep.families.capabilities import Fixed, Link, Skeleton, ThreadPath
from sweep.families.curve_features import Singular
from sweep.families.outputs import ladders
from sweep.families.planar_trees import eyelet_crank
from sweep.families.poses import poses_of
from sweep.families.skeletons import crank_axis, parameter

PARAMETERS = parameters_of("eyelet")

POSE_OUTPUTS = (
    Output("P", "length", "thread taken up, L - P_h", "(6)"),
    Output("dP", "length", "thread taken up per radian, dP/dphi", "(3)"),
    Output("d2P", "length", "second derivative of the thread taken up", "(4)"),
    Output("L", "length", "length of thread between the guides, over the eyelet", "(2)"),
    Output("wrap", "rad", "angle by which the thread turns at the eyelet", "(1)"),
    Output("X_E", "length", "eyelet, along the common perpendicular of crank axis and line of the guides", "(5)"),
    Output("Y_E", "length", "eyelet, across that and the line of the guides", "(5)"),
    Output("Z_E", "length", "eyelet, along the line of the guides", "(5)"),
)

# Wanted pose outputs and status of every design at its angles, each (n, m).
poses = poses_of(eyelet.poses, eyelet.Outputs)


def guide(number: int) -> Fixed:
    """Make the fixed point of guide 1 or 2, at the ends of the thread."""

    def at(designs: Array) -> Array:
        e, x, y, z = (parameter(PARAMETERS, name.format(number), designs) for name in ("e", "dX{}", "dY{}", "Z{}"))
        return np.stack([e + x, y, z], axis=1)

    return Fixed(at, kind="point")


EYELET = ("X_E", "Y_E", "Z_E")


def thread_squared(number: int, designs: Array, angles: Angles, found: Columns) -> Array:
    """Squared length of thread from a guide to the eyelet, (n, m): where it is small the thread turns fast."""
    place = guide(number).at(designs)
    squares = [np.square(np.asarray(found[name], np.float64) - place[:, [k]]) for k, name in enumerate(EYELET)]
    return squares[0] + squares[1] + squares[2]


FAMILY = Family(
    **about("eyelet"),
    parameters=PARAMETERS,
    position="P",
    pose_outputs=POSE_OUTPUTS,
    poses=poses,
    derivative_of=ladders("P", orders=2) | {"L": "dP"},
    points={"eyelet": EYELET},
    capabilities=(
        *(Singular(partial(thread_squared, number), EYELET) for number in (1, 2)),
        eyelet_crank(PARAMETERS),
        ThreadPath("wrap", "dP", "d2P"),
        Skeleton(
            {"a": crank_axis(PARAMETERS, "f", "alpha"), "n1": guide(1), "n2": guide(2)},
            (Link("crank", ("a", "eyelet")), Link("thread 1", ("n1", "eyelet")), Link("thread 2", ("eyelet", "n2"))),
        ),
    ),
)
