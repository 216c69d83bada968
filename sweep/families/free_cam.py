"""Registry entries of the thread take-up by the bare edge of a turning cam, without friction and with it."""

from __future__ import annotations

from dataclasses import replace
from functools import partial

import numpy as np

from kernels.families import free_cam
from kernels.types import Array
from sweep.families.base import Angles, Columns, Family, March, Output, about, floats, parameters_of
from sweep.families.capabilities import Link, MovingPoint, Skeleton, ThreadPath
from sweep.families.curve_features import Bends
from sweep.families.outputs import kinked, ladders
from sweep.families.planar_trees import turning_cam
from sweep.families.poses import following, poses_of
from sweep.families.skeletons import ORIGIN, parameter, standing

PARAMETERS = parameters_of("free_cam")

POSE_OUTPUTS = (
    Output("P", "length", "thread taken up, L - P_h", "(6)"),
    Output("dP", "length", "thread taken up per radian, dP/dphi", "(22)"),
    Output("d2P", "length", "second derivative of the thread taken up", "(23)"),
    Output("L", "length", "length of thread between the guides", "(18)"),
    Output("wrap", "rad", "angle by which the thread turns at the edge, 0 without contact", "(1)"),
    Output("y_contact", "length", "place where the thread passes the plane of the cam, along the edge's y", "(19)"),
    Output("X", "length", "the same place, x in fixed axes", "(18)"),
    Output("Y", "length", "the same place, y in fixed axes", "(18)"),
    Output(
        "contact", "1", "1 where the thread lies on the edge, 0 where it runs straight beside it", "(18)", jumps=True
    ),
    Output("minima", "1", "number of minima of the length along the edge", "(19)", jumps=True),
)

# Wanted pose outputs and status of every design at its angles, each (n, m).
poses = poses_of(free_cam.poses, free_cam.Outputs)


EDGE = {"k1": -1.0, "k2": -0.5, "k3": 0.5, "k4": 1.0}


def edge_point(share: float) -> MovingPoint:
    """Make a point of the edge, at a share of the larger distance of a guide from the cam axis."""

    def at(designs: Array, angles: Angles, found: Columns) -> Array:
        x1, y1, x2, y2, a = (parameter(PARAMETERS, name, designs) for name in ("X1", "Y1", "X2", "Y2", "a"))
        y = share * np.maximum(np.hypot(x1, y1), np.hypot(x2, y2))
        return turned(a * y * y, y, angles)

    return MovingPoint((), at)


def turned(x: Array, y: Array, angles: Angles) -> Array:
    """Rotate points of the cam, (n,) or (n, m) each in its own axes, with the cam: (n, m, 3)."""
    x, y = (values if values.ndim == 2 else values[:, None] for values in (x, y))
    x, y = x * angles.cos - y * angles.sin, x * angles.sin + y * angles.cos
    return np.stack([x, y, 0.0 * x], axis=-1)


def straight(designs: Array) -> Array:
    """Intersect the straight line between the guides with the plane of the cam, (n, 3)."""
    guides = (np.stack([parameter(PARAMETERS, f"{axis}{k}", designs) for axis in "XYZ"], axis=1) for k in (1, 2))
    first, second = guides
    return first + (second - first) * (first[:, 2:] / (first[:, 2:] - second[:, 2:]))


def depth(designs: Array, angles: Angles) -> Array:
    """Depth of the point `straight` within the cam, (n, m, 1): at zeros the thread comes to lie on the edge."""
    place = straight(designs)[:, None, :]
    x = place[..., 0] * angles.cos + place[..., 1] * angles.sin
    y = place[..., 1] * angles.cos - place[..., 0] * angles.sin
    within: Array = x - parameter(PARAMETERS, "a", designs)[:, None] * y * y
    return within[..., None]


SKELETON_FIXED = {
    "a": ORIGIN,
    "n1": standing(PARAMETERS, "X1", "Y1", "Z1", axis=None, kind="point"),
    "n2": standing(PARAMETERS, "X2", "Y2", "Z2", axis=None, kind="point"),
}
LINKS = (
    Link("cam", ("k1", "k2", "a", "k3", "k4")),
    Link("thread 1", ("n1", "contact")),
    Link("thread 2", ("contact", "n2")),
)
EDGE_POINTS = {name: edge_point(share) for name, share in EDGE.items()}

FAMILY = Family(
    **about("free_cam"),
    parameters=PARAMETERS,
    position="P",
    pose_outputs=kinked(POSE_OUTPUTS),  # where the thread comes to lie and leaves
    poses=poses,
    derivative_of=ladders("P", orders=2) | {"L": "dP"},
    points={"contact": ("X", "Y", None)},
    capabilities=(
        turning_cam(("P",)),
        ThreadPath("wrap", "dP", "d2P"),
        Bends(frozenset(o.name for o in POSE_OUTPUTS), depth),
        Skeleton(SKELETON_FIXED, LINKS, EDGE_POINTS),
    ),
)


FRICTION_PARAMETERS = parameters_of("free_cam_friction")

_FREE = {o.name: o for o in POSE_OUTPUTS}
FRICTION_OUTPUTS = (
    *(_FREE[name] for name in ("P", "L", "wrap")),
    replace(_FREE["y_contact"], equation="(25)"),
    _FREE["contact"],
    Output("sticking", "1", "1 where it lies where it lay before, 0 where it slides or is off", "(25)", jumps=True),
)
_FRICTIONLESS = len(PARAMETERS)
DOMAIN = March(text="cam angle")


def _last_turn(designs: Array, angles: Angles, wanted: frozenset[str]) -> Columns:
    """Compute the outputs of the kernel and status, each (n, m), of the last turn of the march."""
    own = np.ascontiguousarray(designs[:, :_FRICTIONLESS])
    friction = np.ascontiguousarray(designs[:, [_FRICTIONLESS + 1, _FRICTIONLESS + 2, _FRICTIONLESS]])
    kernel = partial(free_cam.march, friction, DOMAIN.turns)
    return poses_of(kernel, free_cam.MarchOutputs)(own, angles, wanted)


def _taken(designs: Array, length: Array) -> Array:
    """Thread taken up, (6)."""
    return length - designs[:, _FRICTIONLESS - 1 : _FRICTIONLESS]


sliding_poses = following(_last_turn, {"P": (("L",), _taken)})


def contact_place(designs: Array, angles: Angles, found: Columns) -> Array:
    """Compute where the thread passes the cam's plane: on the edge, or on the line between the guides."""
    y, on = floats(found, "y_contact", "contact")
    at = turned(parameter(PARAMETERS, "a", designs)[:, None] * y * y, y, angles)
    return np.where(on[..., None] == 1.0, at, straight(designs)[:, None, :])


WITH_FRICTION = Family(
    **about("free_cam_friction"),
    parameters=FRICTION_PARAMETERS,
    position="P",
    pose_outputs=FRICTION_OUTPUTS,
    poses=sliding_poses,
    domain=DOMAIN,
    analytic=False,
    capabilities=(
        Skeleton(
            SKELETON_FIXED,
            LINKS,
            EDGE_POINTS | {"contact": MovingPoint(("y_contact", "contact"), contact_place)},
        ),
    ),
)
