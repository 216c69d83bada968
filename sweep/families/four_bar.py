"""Registry entry of the planar four-bar with a coupler point: the crank-rocker's kernels and the guide's point.

The rocker is the crank-rocker's with alpha = f = g = 0; the coupler point is the guide's without a line.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from kernels import status as st
from kernels.types import Array
from sweep.families import guide
from sweep.families import rssr as crank_rocker
from sweep.families.base import Angles, Columns, Family, Output, Parameter, PoseFunction
from sweep.families.capabilities import (
    Arm,
    Assembly,
    CrankRockerLoop,
    Dimensions,
    JointRecords,
    Link,
    OutputLink,
    Points,
    PressureEllipse,
    Skeleton,
    ToolPoint,
)
from sweep.families.hardpoints import FOUR_BAR_POINTS
from sweep.families.outputs import angle_outputs, ladders
from sweep.families.poses import of_matrix, step_of
from sweep.families.skeletons import CRANK, ORIGIN, ROCKER, links, standing

PARAMETERS = (
    Parameter("a", "length", "crank", positive=True),
    Parameter("b", "length", "coupler", positive=True),
    Parameter("c", "length", "rocker", positive=True),
    Parameter("e", "length", "frame, from crank pivot to rocker pivot along x"),
    Parameter("xi", "length", "coupler point along the coupler, from the crank pin", default=0.0),
    Parameter("eta", "length", "coupler point across the coupler, 90 deg counter-clockwise", default=0.0),
    Parameter("branch", "sign", "assembly mode: sign of dF/dpsi", default=1.0, choices=(-1.0, 1.0)),
)

ROCKER_OUTPUTS = (
    *angle_outputs("psi", "rocker angle in (-pi, pi]", "(1)", "(1)"),
    Output("sin_psi", "1", "sine of the rocker angle", "(1)"),
    Output("cos_psi", "1", "cosine of the rocker angle", "(1)"),
    Output("discriminant", "length^4", "A1^2 + A2^2 - A3^2; the links reach where it is not negative", "(1)"),
    Output("pressure_angle", "rad", "between the coupler force and the velocity of the rocker pin", "(1)"),
    Output("x_b", "length", "crank pin, along the frame", "(1)"),
    Output("y_b", "length", "crank pin, across the frame", "(1)"),
    Output("x_c", "length", "rocker pin, along the frame", "(1)"),
    Output("y_c", "length", "rocker pin, across the frame", "(1)"),
)

POINT_OUTPUTS = (
    Output("x_m", "length", "coupler point, along the frame", "(2)"),
    Output("y_m", "length", "coupler point, across the frame", "(2)"),
    Output("dx_m", "length", "first derivative of x_m with respect to phi", "(2)"),
    Output("dy_m", "length", "first derivative of y_m", "(2)"),
    Output("d2x_m", "length", "second derivative of x_m", "(2)"),
    Output("d2y_m", "length", "second derivative of y_m", "(2)"),
)

# The guide's names of the coupler point's motion, for a line along the frame through the crank pivot.
_POINT = {"x_m": "s", "y_m": "dev", "dx_m": "ds", "dy_m": "ddev", "d2x_m": "d2s", "d2y_m": "d2dev"}


def as_crank_rocker(designs: Array) -> Array:
    """Design matrix of the same linkage as a crank-rocker, (n, 8); nan where the coupler point is no number."""
    matrix = np.zeros((len(designs), len(crank_rocker.PARAMETERS)), designs.dtype)
    matrix[:, :4], matrix[:, 7] = designs[:, :4], designs[:, 6]
    with np.errstate(invalid="ignore"):
        matrix[:, 0] += 0.0 * designs[:, 4] + 0.0 * designs[:, 5]
    return matrix


def as_guide(designs: Array) -> Array:
    """Design matrix of the same linkage as a guide whose line is the frame's, (n, 9)."""
    matrix = np.zeros((len(designs), len(guide.PARAMETERS)), designs.dtype)
    matrix[:, :6], matrix[:, 8] = designs[:, :6], designs[:, 6]
    return matrix


def _poses(
    rocker: PoseFunction, point: PoseFunction, designs: Array, angles: Angles, wanted: frozenset[str]
) -> Columns:
    asked = frozenset(_POINT[name] for name in wanted if name in _POINT)
    rest = frozenset(name for name in wanted if name not in _POINT)
    columns: Columns = {}
    if asked:
        found = point(as_guide(designs), angles, asked)
        columns = {name: found[_POINT[name]] for name in wanted if name in _POINT} | {"status": found["status"]}
    if rest or not asked:
        turned = rocker(as_crank_rocker(designs), angles, rest)
        if asked:  # the status of the point where the rocker has nothing to say
            turned["status"] = np.where(turned["status"] == st.OK, columns["status"], turned["status"])
        columns |= turned
    return columns


def poses(designs: Array, angles: Angles, wanted: frozenset[str]) -> Columns:
    """Compute the wanted pose outputs and status of every design at its crank angles, each (n, m)."""
    return _poses(crank_rocker.poses, guide.poses, designs, angles, wanted)


def precise_poses(designs: Array, angles: Angles, wanted: frozenset[str]) -> Columns:
    """Compute what :func:`poses` does, in twice the working precision; for float64 only."""
    return _poses(crank_rocker.precise_poses, guide.precise_poses, designs, angles, wanted)


def joint_records(designs: Array, angles: Angles, motion: Columns, per_pose: Array, per_design: Array) -> None:
    """Fill the joint records that effects work from."""
    crank_rocker.joint_records(as_crank_rocker(designs), angles, motion, per_pose, per_design)


FAMILY = Family(
    name="four_bar",
    title="planar four-bar with a coupler point",
    parameters=PARAMETERS,
    position="psi",
    pose_outputs=ROCKER_OUTPUTS + POINT_OUTPUTS,
    poses=poses,
    example={"a": 1.0, "b": 3.3, "c": 3.1, "e": 3.0, "xi": 4.2, "eta": 0.8, "branch": 1.0},
    steps=tuple(step_of(step, as_crank_rocker) for step in crank_rocker.FAMILY.steps),
    derivative_of=ladders("psi") | {"x_m": "dx_m", "dx_m": "d2x_m", "y_m": "dy_m", "dy_m": "d2y_m"},
    outward="branch",
    uses_phi=False,
    capabilities=(
        Dimensions(links("a b c"), arms=(Arm(("xi", "eta"), ("b",)),)),
        Assembly("discriminant", "pressure_angle", crank_rocker.discriminant_scale),
        JointRecords(joint_records, crank_rocker.JOINT_NEEDS, "rocker"),
        PressureEllipse(of_matrix(crank_rocker.ellipse, as_crank_rocker)),
        CrankRockerLoop(as_crank_rocker),
        replace(crank_rocker.SERIES, matrix=as_crank_rocker),
        Points({name: (f"x_{name}", f"y_{name}", None) for name in ("b", "c", "m")}),
        OutputLink(crank_rocker.rocker_origin),
        ToolPoint(guide.tool_point),
        FOUR_BAR_POINTS,
        Skeleton(
            {"a": ORIGIN, "d": standing(PARAMETERS, "e")}, (CRANK, Link("coupler", ("b", "c", "m")), ROCKER)
        ),
    ),
    precise_poses=precise_poses,
)  # fmt: skip
