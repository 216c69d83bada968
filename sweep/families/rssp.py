"""Registry entries of the slider-cranks: the spatial one (RSSP), and the planar one, also offset.

The planar one is the spatial one with alpha = 0, rotated by a quarter turn, and has its kernels; its x runs along the
slide line and its phi is measured from there.
"""

from __future__ import annotations

from dataclasses import replace
from functools import partial

import numpy as np
from numpy.typing import NDArray

from kernels.families import rssp
from kernels.types import EPS, Array
from sweep.families import capabilities as can
from sweep.families.base import Accuracy, Angles, Columns, Family, Output, PoseFunction, Step, about, parameters_of
from sweep.families.hardpoints import PLANAR_SLIDER_POINTS, SLIDER_CRANK_POINTS
from sweep.families.outputs import coordinate_outputs, joint_outputs, ladders
from sweep.families.poses import Made, chosen, filled_by, following, move_records, poses_of, step_of
from sweep.families.skeletons import ORIGIN, SLIDER_CRANK, SLIDER_CRANK_SIZES, X, Y, crank_axis, squared, standing

PARAMETERS = parameters_of("rssp")

VALUE_OUTPUTS = (
    *coordinate_outputs("s", "length", "slider displacement from the foot of the common perpendicular", "(2)", "(5)"),
    Output("discriminant", "length^2", "Q; the links reach where it is not negative", "(1)"),
    Output("pressure_angle", "rad", "between the coupler force and the velocity of the slider", "(3)"),
)

JOINT_OUTPUTS = joint_outputs(
    {"b": "crank pin", "c": "slider ball"},
    "(6)",
    ("along the common perpendicular", "along the slide direction", "normal to both"),
)

MARGIN_OUTPUTS = (
    Output("rotatable", "1", "whether the links reach over the whole turn", "(4)"),
    Output("margin", "1", "cos^2 of the worst pressure angle over the turn; below 0 the linkage jams", "(4)"),
    Output("max_pressure_angle", "rad", "largest pressure angle over one turn", "(3)"),
)

LIMIT_OUTPUTS = (
    Output("s_ext", "length", "s in the extended position: largest, smallest if branch = -1", "(7)"),
    Output("s_fold", "length", "s in the folded position: smallest, largest if branch = -1", "(7)"),
    Output("phi_ext", "rad", "crank angle of the extended position, in [0, 2 pi)", "(8)"),
    Output("phi_fold", "rad", "crank angle of the folded position, in [0, 2 pi)", "(8)"),
    Output("phi0", "rad", "crank angle from the extended to the folded position, in [0, 2 pi)", "(9)"),
    Output("stroke_ratio", "1", "phi0/(2 pi - phi0)", "(9)"),
    Output("stroke", "length", "largest minus smallest s over one turn", "(10)"),
)

poses = poses_of(rssp.poses, rssp.Outputs, {"joints": JOINT_OUTPUTS})


precise_poses = poses_of(rssp.precise_poses, rssp.Outputs, {"joints": JOINT_OUTPUTS})


def margins(designs: Array, wanted: frozenset[str], accuracy: Accuracy) -> Columns:
    """Compute rotatability, margin and largest pressure angle, exact."""
    n = len(designs)
    status = np.empty(n, np.uint8)
    least, turns, angle = np.empty(n), np.empty(n), np.empty(n)
    rssp.margin(designs, status, least, turns, angle)
    with np.errstate(all="ignore"):  # lengths that overflow have a status
        scale = designs[:, 1] ** 2
        # Rounding errors of sin^2 = (m^2 + n^2)/b^2, taken where m and n are largest; cos^2 has that of b^2 as well.
        size = (np.abs(designs[:, 2]) + designs[:, 0]) ** 2 + (np.abs(designs[:, 3]) + designs[:, 0]) ** 2
        err_square = 18.0 * EPS * size / scale
        # d(angle) = d(sin^2)/sin(2 angle), and sqrt(d(sin^2)) where that is too steep to be linear.
        err_angle = np.minimum(err_square / np.abs(np.sin(2.0 * angle)), np.sqrt(err_square))
        err_angle += 4.0 * EPS * (angle + np.tan(angle))
    columns: Columns = {
        "rotatable": turns == 1.0,
        "margin": least,
        "max_pressure_angle": angle,
        "err_rotatable": np.zeros(n),
        "err_margin": err_square + 8.0 * EPS,
        "err_max_pressure_angle": err_angle,
    }
    return chosen(columns, wanted, status)


def limit_positions(designs: Array, wanted: frozenset[str], accuracy: Accuracy) -> Columns:
    """Compute both limit positions of the slider to rounding; errors are bounds of the rounding errors."""
    n = len(designs)
    status = np.empty(n, np.uint8)
    outputs = np.empty((len(LIMIT_OUTPUTS) + 2, n))
    rssp.limits(designs, status, outputs)
    values = {o.name: row for o, row in zip(LIMIT_OUTPUTS, outputs, strict=False)}
    err_ext, err_fold = outputs[-2:]
    stroke, ratio = np.abs(values["stroke"]), values["stroke_ratio"]
    ca, e = np.abs(np.cos(designs[:, 4])), np.abs(designs[:, 2])
    rho2 = [np.hypot(e, values[f"s_{end}"] * ca) ** 2 for end in ("ext", "fold")]
    err_phi = [e * ca * err / square + 16.0 * EPS for err, square in zip((err_ext, err_fold), rho2, strict=True)]
    # Half-stroke identity: both distances from the crank axis, over |s_ext + s_fold - 2 f sin(alpha)|
    distances = sum(np.sqrt(square) for square in rho2)
    between = 2.0 * designs[:, 0] * distances / stroke
    err_phi0 = err_phi[0] + err_phi[1]
    columns: Columns = values | {
        "stroke": stroke,
        "err_s_ext": err_ext,
        "err_s_fold": err_fold,
        "err_phi_ext": err_phi[0],
        "err_phi_fold": err_phi[1],
        "err_phi0": err_phi0,
        "err_stroke_ratio": err_phi0 * (1.0 + ratio) ** 2 / (2.0 * np.pi),
        "err_stroke": stroke * ((err_ext + err_fold) * (2.0 / between + ca / distances) + 16.0 * EPS),
    }
    return chosen(columns, wanted, status)


_JOINT_NEEDS = ("s", "ds", "d2s", "discriminant")
joint_records = filled_by(rssp.joints, _JOINT_NEEDS)  # of the effects


def ellipse(designs: Array) -> Array:
    """Curve of the coupler direction across the slide, (n, 7)."""
    out = np.empty((len(designs), 7))
    rssp.pressure_ellipse(designs, out)
    return out


_NAMES = ("s", "ds", "d2s", "d3s")
CURVES = {name: can.FusedOutput(order, can.constant(1.0, 0.0, 0.0)) for order, name in enumerate(_NAMES)}
COMPONENTS = {"ds": "x1", "d2s": "x2", "d3s": "x3"}


FAMILY = Family(
    **about("rssp"),
    parameters=PARAMETERS,
    position="s",
    pose_outputs=VALUE_OUTPUTS + JOINT_OUTPUTS,
    poses=poses,
    steps=(
        Step("margin", MARGIN_OUTPUTS, margins),
        Step("limit positions", LIMIT_OUTPUTS, limit_positions),
    ),
    derivative_of=ladders("s"),
    outward="branch",
    points={"b": ("x_b", "y_b", "z_b"), "c": ("x_c", "y_c", "z_c")},
    capabilities=(
        SLIDER_CRANK_SIZES,
        can.Assembly("discriminant", "pressure_angle", squared(PARAMETERS, "b")),
        can.InSeries(rssp.FORM, CURVES, COMPONENTS, rssp.opening),
        can.JointRecords(joint_records, _JOINT_NEEDS, "slider"),
        can.PressureEllipse(ellipse),
        can.LimitLocus("stroke"),
        SLIDER_CRANK_POINTS,
        can.Skeleton(
            {"a": crank_axis(PARAMETERS, "f", "alpha"), "d": standing(PARAMETERS, "e", axis=Y, kind="slide")},
            SLIDER_CRANK,
        ),
    ),
    precise_poses=precise_poses,
)


PLANAR_PARAMETERS = parameters_of("slider_crank")

PLANAR_OUTPUTS = (
    *coordinate_outputs("s", "length", "slider displacement from the foot of the crank pivot", "(1)", "(3)"),
    Output("discriminant", "length^2", "Q; the links reach where it is not negative", "(1)"),
    Output("pressure_angle", "rad", "between the rod and the slide line", "(2)"),
    *joint_outputs({"b": "crank pin", "c": "slider pin"}, "(1)", ("along the slide line", "across the slide line")),
)

# The spatial linkage has its slide line along y: its x is minus this y, and its crank angle a quarter turn more.
_MADE: Made = {
    "x_b": (("y_b",), lambda designs, y: y), "y_b": (("x_b",), lambda designs, x: 0.0 - x),
    "x_c": (("y_c",), lambda designs, y: y), "y_c": (("x_c",), lambda designs, x: 0.0 - x),
}  # fmt: skip
_ANGLES = ("phi_ext", "phi_fold")
_FROM_SPATIAL = np.array([[0.0, 1.0, 0.0], [-1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])


def as_spatial(designs: Array) -> Array:
    """Design matrix of the same linkage as a spatial slider-crank, (n, 6)."""
    matrix = np.zeros((len(designs), len(PARAMETERS)), designs.dtype)
    matrix[:, 0], matrix[:, 1], matrix[:, 2], matrix[:, 5] = designs[:, 0], designs[:, 1], -designs[:, 2], designs[:, 3]
    return matrix


def turned(angles: Angles) -> Angles:
    """Crank angles measured from the common perpendicular, with the same bits."""
    return Angles(angles.phi + 0.5 * np.pi, np.ascontiguousarray(-angles.sin), angles.cos)


def _on_spatial(run: PoseFunction, designs: Array, angles: Angles, wanted: frozenset[str]) -> Columns:
    return run(as_spatial(designs), turned(angles), wanted)


def _planar_step(step: Step) -> Step:
    """Convert a step of the spatial slider-crank to the planar one's crank angle."""
    spatial = step_of(step, as_spatial)

    def run(designs: Array, wanted: frozenset[str], accuracy: Accuracy) -> Columns:
        found = spatial.run(designs, wanted, accuracy)
        for name in _ANGLES:
            if name in found:
                found[name] = (np.asarray(found[name], np.float64) - 0.5 * np.pi) % (2.0 * np.pi)
        return found

    return replace(spatial, run=run)


def planar_joint_records(designs: Array, angles: Angles, motion: Columns, per_pose: Array, per_design: Array) -> None:
    """Fill the joint records of the effects."""
    joint_records(as_spatial(designs), turned(angles), motion, per_pose, per_design)
    move_records(_FROM_SPATIAL, np.zeros((len(designs), 3)), per_pose, per_design)


def planar_opening(designs: Array, status: NDArray[np.uint8], distance: Array) -> None:
    """Write status and distance [rad] of the nearest complex singularity, for every design."""
    rssp.opening(as_spatial(designs), status, distance)


PLANAR = Family(
    **about("slider_crank"),
    parameters=PLANAR_PARAMETERS,
    position="s",
    pose_outputs=PLANAR_OUTPUTS,
    poses=following(partial(_on_spatial, poses), _MADE),
    steps=tuple(_planar_step(step) for step in FAMILY.steps),
    derivative_of=ladders("s"),
    outward="branch",
    points={"b": ("x_b", "y_b", None), "c": ("x_c", "y_c", None)},
    capabilities=(
        SLIDER_CRANK_SIZES,
        can.Assembly("discriminant", "pressure_angle", squared(PLANAR_PARAMETERS, "b")),
        can.InSeries(rssp.PLANAR_FORM, CURVES, COMPONENTS, planar_opening),
        can.JointRecords(planar_joint_records, _JOINT_NEEDS, "slider"),
        PLANAR_SLIDER_POINTS,
        can.Skeleton({"a": ORIGIN, "d": standing(PLANAR_PARAMETERS, None, "e", axis=X, kind="slide")}, SLIDER_CRANK),
    ),
    precise_poses=following(partial(_on_spatial, precise_poses), _MADE),
)
