"""Registry entry of the planar four-bar with a coupler point: the crank-rocker's kernels and the guide's point.

The rocker is the crank-rocker's with alpha = f = g = 0; the coupler point is the guide's without a line.
"""

from __future__ import annotations

from dataclasses import replace
from functools import partial

import numpy as np

from kernels import status as st
from kernels.types import Array
from sweep.families import capabilities as can
from sweep.families import guide
from sweep.families import rssr as crank_rocker
from sweep.families.base import Angles, Columns, Family, Output, PoseFunction, about, parameters_of
from sweep.families.hardpoints import FOUR_BAR_POINTS
from sweep.families.outputs import ALONG_FRAME, coordinate_outputs, joint_outputs, joint_rate_outputs, ladders
from sweep.families.poses import following, on_matrix, step_of
from sweep.families.skeletons import CRANK, ORIGIN, ROCKER, links, standing

PARAMETERS = parameters_of("four_bar")

ROCKER_OUTPUTS = (
    *coordinate_outputs("psi", "rad", "rocker angle in (-pi, pi]", "(1)", "(1)", circle="the rocker angle"),
    Output("discriminant", "length^4", "A1^2 + A2^2 - A3^2; the links reach where it is not negative", "(1)"),
    Output("pressure_angle", "rad", "between the coupler force and the velocity of the rocker pin", "(1)"),
    *joint_outputs({"b": "crank pin", "c": "rocker pin"}, "(1)", ALONG_FRAME),
)

POINT_OUTPUTS = (
    *joint_outputs({"m": "coupler point"}, "(2)", ALONG_FRAME),
    *joint_rate_outputs("m", "coupler point", "(2)", ALONG_FRAME),
)

# The guide's names of the coupler point's motion, for a line along the frame through the crank pivot.
_POINT = {"x_m": "s", "y_m": "dev", "dx_m": "ds", "dy_m": "ddev", "d2x_m": "d2s", "d2y_m": "d2dev"}


def as_crank_rocker(designs: Array) -> Array:
    """Design matrix of the same linkage as a crank-rocker, (n, 8); nan if the coupler point is invalid."""
    matrix = np.zeros((len(designs), len(crank_rocker.PARAMETERS)), designs.dtype)
    matrix[:, :4], matrix[:, 7] = designs[:, :4], designs[:, 6]
    matrix[~np.isfinite(designs[:, 4:6]).all(axis=1), 0] = np.nan
    return matrix


def as_guide(designs: Array) -> Array:
    """Design matrix of the same linkage as a guide whose line is the frame's, (n, 9)."""
    matrix = np.zeros((len(designs), len(guide.PARAMETERS)), designs.dtype)
    matrix[:, :6], matrix[:, 8] = designs[:, :6], designs[:, 6]
    return matrix


def _poses(
    rocker: PoseFunction, point: PoseFunction, designs: Array, angles: Angles, wanted: frozenset[str]
) -> Columns:
    of_point = wanted & _POINT.keys()
    columns = point(designs, angles, of_point) if of_point else {}
    if wanted - of_point or not of_point:
        turned = rocker(designs, angles, wanted - of_point)
        if of_point:  # the status of the rocker has precedence over that of the point
            turned["status"] = np.where(turned["status"] == st.OK, columns["status"], turned["status"])
        columns |= turned
    return columns


def _both(rocker: PoseFunction, point: PoseFunction) -> PoseFunction:
    """Make poses from those of the crank-rocker and of the guide."""
    of_point = following(on_matrix(point, as_guide), {}, _POINT.__getitem__)
    return partial(_poses, on_matrix(rocker, as_crank_rocker), of_point)


FAMILY = Family(
    **about("four_bar"),
    parameters=PARAMETERS,
    position="psi",
    pose_outputs=ROCKER_OUTPUTS + POINT_OUTPUTS,
    poses=_both(crank_rocker.poses, guide.poses),
    steps=tuple(step_of(step, as_crank_rocker) for step in crank_rocker.FAMILY.steps),
    derivative_of=ladders("psi") | ladders("x_m", "y_m", orders=2),
    outward="branch",
    points={name: (f"x_{name}", f"y_{name}", None) for name in ("b", "c", "m")},
    capabilities=(
        can.Dimensions(links("a b c"), arms=(can.Arm(("xi", "eta"), ("b",)),)),
        can.Assembly("discriminant", "pressure_angle", crank_rocker.discriminant_scale),
        *crank_rocker.moving_alike(as_crank_rocker, itself=True),
        replace(crank_rocker.SERIES, matrix=as_crank_rocker),
        can.OutputLink(standing(PARAMETERS, "e").at),
        can.ToolPoint(standing(PARAMETERS, "xi", "eta").at),
        FOUR_BAR_POINTS,
        can.Skeleton(
            {"a": ORIGIN, "d": standing(PARAMETERS, "e")}, (CRANK, can.Link("coupler", ("b", "c", "m")), ROCKER)
        ),
    ),
    precise_poses=_both(crank_rocker.precise_poses, guide.precise_poses),
)  # fmt: skip
