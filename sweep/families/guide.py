"""Registry entry of the planar four-bar with a guided coupler point."""

from __future__ import annotations

from functools import partial

import numpy as np
from numpy.typing import NDArray

from kernels import status as st
from kernels.families import guide
from kernels.families import rssr as rssr_kernels
from kernels.types import Array
from sweep.families import capabilities as can
from sweep.families import rssr as crank_rocker
from sweep.families.base import Angles, Columns, Family, Output, about, parameters_of
from sweep.families.hardpoints import GUIDE_POINTS
from sweep.families.outputs import ALONG_FRAME, coordinate_outputs, joint_outputs, joint_rate_outputs, ladders
from sweep.families.poses import following, poses_of, together
from sweep.families.skeletons import CRANK, ORIGIN, ROCKER, Z, line, links, parameter, standing

PARAMETERS = parameters_of("guide")

VALUE_OUTPUTS = (
    *coordinate_outputs("s", "length", "coupler point along the line, from the foot of the crank pivot", "(4)", "(5)"),
    Output("dev", "length", "deviation of the coupler point from the line, to its left", "(4)", windowed=True),
    Output("ddev", "length", "first derivative of the deviation with respect to phi", "(5)"),
    Output("d2dev", "length", "second derivative of the deviation", "(5)"),
    Output("discriminant", "length^4", "A1^2 + A2^2 - A3^2; the links reach where it is not negative", "(2)"),
    Output("pressure_angle", "rad", "between the coupler force and the velocity of the rocker pin", "(3)"),
)

JOINT_OUTPUTS = joint_outputs({"b": "crank pin", "c": "rocker pin", "m": "coupler point"}, "(6)", ALONG_FRAME)

POINT_OUTPUTS = joint_rate_outputs("m", "coupler point", "(6)", ALONG_FRAME)

_LAM = [p.name for p in PARAMETERS].index("lam")


_kernel_poses = poses_of(guide.poses, guide.Outputs, {"joints": JOINT_OUTPUTS})
_kernel_precise_poses = poses_of(guide.precise_poses, guide.Outputs, {"joints": JOINT_OUTPUTS})


@together(VALUE_OUTPUTS + JOINT_OUTPUTS)
def _motion(designs: Array, angles: Angles, wanted: frozenset[str]) -> Columns:
    return _kernel_poses(designs, angles, wanted)


@together(VALUE_OUTPUTS, JOINT_OUTPUTS)
def _precise_motion(designs: Array, angles: Angles, wanted: frozenset[str]) -> Columns:
    return _kernel_precise_poses(designs, angles, wanted)


def _rotated(axis: str, designs: Array, along: Array, across: Array) -> Array:
    """Transform a rate of the coupler point from the line to the frame."""
    cos, sin = np.cos(designs[:, [_LAM]]), np.sin(designs[:, [_LAM]])
    return along * cos - across * sin if axis == "x" else along * sin + across * cos


_RATES = {f"{order}{axis}_m": ((f"{order}s", f"{order}dev"), partial(_rotated, axis))
          for order in ("d", "d2") for axis in "xy"}  # fmt: skip
# Wanted pose outputs and status of every design at its crank angles, each (n, m); plain and in doubled precision.
poses, precise_poses = following(_motion, _RATES), following(_precise_motion, _RATES)


def as_crank_rocker(designs: Array) -> Array:
    """Design matrix of the four-bar as a crank-rocker with parallel axes and all links in one plane."""
    matrix = np.zeros((len(designs), len(crank_rocker.PARAMETERS)))
    matrix[:, :4], matrix[:, -1] = designs[:, :4], designs[:, len(PARAMETERS) - 1]
    return matrix


def point_shares(designs: Array) -> Array:
    """Factors of the links' directions in travel along the line and deviation across it, (n, 8)."""
    shares = np.empty((len(designs), 8))
    guide.point_shares(np.ascontiguousarray(designs), shares)
    return shares


def guiding_line(designs: Array) -> tuple[Array, Array]:
    """Point of the guiding line nearest to the crank pivot, and the line's direction, each (n, 3)."""
    lam, h = parameter(PARAMETERS, "lam", designs), parameter(PARAMETERS, "h", designs)
    along = np.stack([np.cos(lam), np.sin(lam), np.zeros(len(designs))], axis=1)
    return h[:, None] * np.cross(Z, along), along


def _of_point(axis: str, designs: Array) -> Array:
    """Coefficients of s, dev and 1 in a coordinate of the coupler point, (n, 3)."""
    lam, h = parameter(PARAMETERS, "lam", designs), parameter(PARAMETERS, "h", designs)
    along, across = (np.cos(lam), -np.sin(lam)) if axis == "x" else (np.sin(lam), np.cos(lam))
    return np.column_stack([along, across, across * h])


_ALONG, _ACROSS = can.constant(1.0, 0.0, 0.0), can.constant(0.0, 1.0, 0.0)
_TRAVEL = {name: can.FusedOutput(order, _ALONG) for order, name in enumerate(("s", "ds", "d2s", "d3s"))}
_DEVIATION = {name: can.FusedOutput(order, _ACROSS) for order, name in enumerate(("dev", "ddev", "d2dev"))}
_PLACE = {f"{axis}_m": can.FusedOutput(0, partial(_of_point, axis)) for axis in "xy"}


def opening(designs: Array, status: NDArray[np.uint8], distance: Array) -> None:
    """Write whether the crank turns, and the distance of the nearest singularity, as for the crank-rocker."""
    rssr_kernels.opening(as_crank_rocker(designs), status, distance)
    # The crank-rocker does not check the guided point and the line.
    known = np.isfinite(designs).all(axis=1) & (np.abs(parameter(PARAMETERS, "lam", designs)) < 1e5)
    status[~known] = st.INVALID_INPUT


IN_SERIES = can.InSeries(
    guide.FORM,
    _TRAVEL | _DEVIATION | _PLACE,
    {"ds": "x1", "d2s": "x2", "d3s": "x3", "dev": "y0", "ddev": "y1", "d2dev": "y2"},
    opening,
)

FAMILY = Family(
    **about("guide"),
    parameters=PARAMETERS,
    position="s",
    pose_outputs=VALUE_OUTPUTS + JOINT_OUTPUTS + POINT_OUTPUTS,
    poses=poses,
    derivative_of=ladders("s") | ladders("dev", "x_m", "y_m", orders=2),
    outward="branch",
    points={"b": ("x_b", "y_b", None), "c": ("x_c", "y_c", None), "point": ("x_m", "y_m", None)},
    capabilities=(
        can.Dimensions(links("a b c"), arms=(can.Arm(("xi", "eta"), ("b",)),)),
        can.Assembly("discriminant", "pressure_angle", crank_rocker.discriminant_scale),
        IN_SERIES,
        *crank_rocker.moving_alike(as_crank_rocker),
        can.GuidedPoint(
            point_shares,
            fitted=("xi", "eta", "lam", "h"),
            scaled=("a", "b", "c", "e", "xi", "eta", "h"),
            direction="lam",
            links=("a", "b", "c", "e"),
            arms=("xi", "eta"),
            offset="h",
            across={"s": "dev", "ds": "ddev", "d2s": "d2dev"},
        ),
        can.ToolPoint(standing(PARAMETERS, "xi", "eta").at, line(guiding_line).axis),
        GUIDE_POINTS,
        can.Skeleton(
            {"a": ORIGIN, "d": standing(PARAMETERS, "e"), "line": line(guiding_line)},
            (CRANK, can.Link("coupler", ("b", "c", "point")), ROCKER),
        ),
    ),
    precise_poses=precise_poses,
)  # fmt: skip
