"""Registry entry of the spatial crank-rocker (RSSR)."""

from __future__ import annotations

from functools import lru_cache
from typing import Any

import numpy as np

from kernels import status as st
from kernels.families import rssr
from kernels.types import TWO_PI, Array
from sweep.families import capabilities as can
from sweep.families.base import Accuracy, Angles, Columns, Family, Output, Step, Work, about, parameters_of
from sweep.families.hardpoints import CRANK_ROCKER_POINTS
from sweep.families.outputs import coordinate_outputs, joint_outputs, ladders
from sweep.families.poses import chosen, filled_by, move_records, on_matrix, optional_outputs, poses_of, together
from sweep.families.provable import CRANK_ROCKER_BY_AXES, CRANK_ROCKER_BY_ROCKER
from sweep.families.skeletons import CRANK_ROCKER, CRANK_ROCKER_SIZES, crank_axis, standing

PARAMETERS = parameters_of("rssr")

# Axes of joint coordinates in the frame of the rocker.
WAYS = ("along the common perpendicular of the axes", "across it and the rocker axis", "along the rocker axis")
VALUE_OUTPUTS = (
    *coordinate_outputs(
        "psi", "rad", "rocker angle in (-pi, pi]", "(2*)", "(3)", "(4)", "(5)", circle="the rocker angle"
    ),
    Output("discriminant", "length^4", "A1^2 + A2^2 - A3^2; the links reach where it is not negative", "(2)"),
    Output("pressure_angle", "rad", "between the coupler force and the velocity of its joint on the rocker", "(13)"),
)
JOINT_OUTPUTS = joint_outputs({"b": "crank pin", "c": "rocker ball"}, "section 1", WAYS)
POSE_OUTPUTS = VALUE_OUTPUTS + JOINT_OUTPUTS

MARGIN_OUTPUTS = (
    Output("rotatable", "1", "whether the crank turns fully; exact", "(14)"),
    Output("margin", "1", "cos^2 of the worst pressure angle over the turn; below 0 the linkage jams", "(14)"),
    Output("max_pressure_angle", "rad", "largest pressure angle over the turn", "(13), (14)"),
)

LIMIT_OUTPUTS = (
    Output("psi_ext", "rad", "rocker angle in the extended limit position, in (-pi, pi]", "(8)"),
    Output("psi_fold", "rad", "rocker angle in the folded limit position, in (-pi, pi]", "(8)"),
    Output("phi_ext", "rad", "crank angle of the extended limit position, in [0, 2 pi)", "(8)"),
    Output("phi_fold", "rad", "crank angle of the folded limit position, in [0, 2 pi)", "(8)"),
    Output("swing", "rad", "psi_fold - psi_ext, signed and unwrapped; its sign is that of -branch", "(16)"),
    Output("phi0", "rad", "phi_fold - phi_ext modulo 2 pi", "(15)"),
    Output("stroke_ratio", "1", "phi0/(2 pi - phi0)", "(15)"),
)

MAXIMA_OUTPUTS = tuple(
    output
    for name, text, equation in (
        ("dpsi", "velocity analogue", "(3)"),
        ("d2psi", "acceleration analogue", "(4)"),
        ("d3psi", "jerk analogue", "(5)"),
    )
    for output in (
        Output(f"max_abs_{name}", "1", f"largest magnitude of the {text} over the turn", equation),
        Output(f"phi_max_abs_{name}", "rad", f"crank angle of the largest magnitude of the {text}", equation),
    )
)

RATES = ("dpsi", "d2psi", "d3psi")
MOST_CELLS = 1000  # enclosures of one design before its proof is given up; 100 suffice within 1e-9 of a change point
_poses = poses_of(rssr.poses, rssr.Outputs)


def _precise(designs: Array, *given: Any) -> None:
    constants = np.empty((len(designs), rssr.PRECISE_COLUMNS))
    rssr.precise_constants(designs, constants)
    rssr.precise_poses(constants, designs, *given)


_precise_poses = poses_of(_precise, rssr.Outputs)


@together(POSE_OUTPUTS)
def poses(designs: Array, angles: Angles, wanted: frozenset[str]) -> Columns:
    """Wanted pose outputs and status of every design at its crank angles, each (n, m)."""
    return _poses(designs, angles, wanted)


@together(VALUE_OUTPUTS, JOINT_OUTPUTS)
def precise_poses(designs: Array, angles: Angles, wanted: frozenset[str]) -> Columns:
    """Pose outputs of :func:`poses`, with the closure in twice the working precision; for float64 only."""
    return _precise_poses(designs, angles, wanted)


JOINT_NEEDS = ("cos_psi", "sin_psi", "dpsi", "d2psi", "discriminant")
joint_records = filled_by(rssr.joints, JOINT_NEEDS)  # of the effects


def ellipse(designs: Array) -> Array:
    """Curve of the coupler direction across the rocker's motion, (n, 7)."""
    out = np.empty((len(designs), 7))
    rssr.pressure_ellipse(designs, out)
    return out


def moving_alike(
    matrix: can.DesignMap, place: tuple[Array, can.DesignMap] | None = None, itself: bool = False
) -> tuple[object, ...]:
    """Return the capabilities of a family with a crank-rocker's motion: joint records, pressure ellipse, proofs.

    Parameters
    ----------
    matrix : the crank-rocker's designs from those of the family
    place : rotation (3, 3) and origin (n, 3) of the crank-rocker's frame in that of the family; None if it is the same
    itself : whether the family has the pose outputs of joint records, under the crank-rocker's names
    """

    def fill(designs: Array, angles: Angles, motion: Columns, per_pose: Array, per_design: Array) -> None:
        joint_records(matrix(designs), angles, motion, per_pose, per_design)
        if place is not None:
            move_records(place[0], place[1](designs), per_pose, per_design)

    moved = None if itself else (on_matrix(poses, matrix), on_matrix(precise_poses, matrix))
    records = can.JointRecords(fill, JOINT_NEEDS, "rocker", moved)
    return records, can.PressureEllipse(lambda designs: ellipse(matrix(designs))), can.CrankRockerLoop(matrix)


def discriminant_scale(designs: Array) -> Array:
    """(2 b c)^2 of every design: the discriminant divided by it is the squared cosine of the pressure angle."""
    return (2.0 * designs[:, 1] * designs[:, 2]) ** 2


def margin(designs: Array, wanted: frozenset[str], accuracy: Accuracy) -> Columns:
    """Compute rotatability, margin and largest pressure angle from the exact minimum of the discriminant.

    The errors are bounds: of the least discriminant, and of its effect on the angle.
    """
    n = len(designs)
    status = np.empty(n, np.uint8)
    with_error = accuracy.target is not None and not wanted <= {"rotatable"}
    names = ("margin", "rotatable", "max_pressure_angle", "error", "angle_error")
    needed = set(wanted)
    if with_error:
        needed |= {"error", "angle_error"} if "max_pressure_angle" in wanted else {"error"}
    if "max_pressure_angle" in wanted:
        # They cost little beside the arctangent, but each set of outputs takes half a second to compile.
        needed |= {"margin", "rotatable"}
    least, turns, angle, error, angle_error = optional_outputs(names, frozenset(needed), (n,))
    rssr.margin(designs, status, least, turns, angle, None, error, angle_error)
    columns = {"rotatable": None if turns is None else turns == 1.0, "margin": least, "max_pressure_angle": angle}
    if accuracy.target is not None:
        columns |= {"err_rotatable": np.zeros(n), "err_margin": error, "err_max_pressure_angle": angle_error}
    return chosen({name: x for name, x in columns.items() if x is not None}, wanted, status)


def limits(designs: Array, wanted: frozenset[str], accuracy: Accuracy) -> Columns:
    """Compute limit positions, swing and stroke ratio to rounding, for any accuracy; errors estimate the rounding."""
    n = len(designs)
    status, values = np.empty(n, np.uint8), np.empty((n, len(rssr.LIMIT_NAMES)))
    errors = np.empty_like(values) if accuracy.target is not None else None
    rssr.limits(designs, status, values, errors)
    columns: Columns = {"status": status}
    for k, name in enumerate(rssr.LIMIT_NAMES):
        if name in wanted:
            columns[name] = np.ascontiguousarray(values[:, k])
            if errors is not None:
                columns[f"err_{name}"] = np.ascontiguousarray(errors[:, k])
    return columns


def true_maxima(designs: Array, wanted: frozenset[str], accuracy: Accuracy) -> Columns:
    """Compute maxima over the turn refined between samples to ``accuracy.target``, with error estimates."""
    assert accuracy.target is not None
    n = len(designs)
    status, error = np.empty(n, np.uint8), np.empty((3, n))
    placed = not wanted.isdisjoint(f"phi_max_abs_{x}" for x in RATES)
    phi, phi_error = (np.empty((3, n)), np.empty((3, n))) if placed else (None, None)
    most = [np.empty(n) if wanted & {f"max_abs_{x}", f"phi_max_abs_{x}"} else None for x in RATES]
    rssr.true_maxima(designs, sampling_tables(), accuracy.target, status, phi, error, phi_error, *most)
    if phi is not None:
        # Perpendicular axes and g = 0: return and forward stroke are alike; of two maxima the first of the turn counts.
        even = (designs[:, 5] == 0.0) & (np.abs(np.cos(designs[:, 6])) < 1e-15)
        phi[:, even] = np.minimum(phi, TWO_PI - phi)[:, even]
    columns: Columns = {"status": status}
    for order, name in enumerate(RATES):
        for key, values, err in ((f"max_abs_{name}", most, error), (f"phi_max_abs_{name}", phi, phi_error)):
            column = None if values is None else values[order]
            if key in wanted and column is not None and err is not None:
                columns |= {key: column, f"err_{key}": err[order]}
    return columns


def certified_maxima(designs: Array, wanted: frozenset[str], accuracy: Accuracy) -> Columns:
    """Find true maxima with the proof that no peak was missed: their errors are bounds, not estimates.

    The angle of a maximum is one at which its value is taken; its distance from the exact angle is an estimate.
    """
    from kernels.families.rssr.certify import InSeries, certify_maxima  # here: only proofs wait for its import

    assert accuracy.target is not None
    n = len(designs)
    columns: Columns = {"status": np.zeros(n, np.uint8)}
    for order, name in enumerate(RATES):  # of the velocity
        most, phi = f"max_abs_{name}", f"phi_max_abs_{name}"
        if not wanted & {most, phi}:
            continue
        searched = true_maxima(designs, frozenset((most, phi)), accuracy)
        status = searched["status"].astype(np.uint8)
        value, place = (np.array(searched[key], np.float64) for key in (most, phi))
        error, far = np.full(n, np.nan), np.asarray(searched[f"err_{phi}"], np.float64)
        alone = InSeries(np.ascontiguousarray(designs)[None], np.empty((0, n, 2)), np.zeros((n, 8)))
        certify_maxima(
            alone, np.array([(2, order)]), accuracy.target, MOST_CELLS, status[None], value[None], place[None],
            error[None], np.empty(n),
        )  # fmt: skip
        known = (np.asarray(searched[phi], np.float64), far)
        columns |= proven_columns(name, wanted, accuracy.target, (value, error), place, known)
        columns["status"] = np.where(columns["status"] == st.OK, status, columns["status"])
    return columns


def proven_columns(
    name: str, wanted: frozenset[str], target: float, height: tuple[Array, Array], place: Array,
    searched: tuple[Array, Array],
) -> Columns:  # fmt: skip
    """Return wanted columns of a proven maximum, from height and its bound, its angle, and the searched angle.

    A higher peak found by the proof was refined to a thousandth of the target.
    """
    before, far = searched
    far = np.where(np.abs(place - before) > far, np.maximum(far, np.sqrt(target)), far)
    pairs = ((f"max_abs_{name}", height), (f"phi_max_abs_{name}", (place, far)))
    return {key: x for own, found in pairs if own in wanted for key, x in zip((own, f"err_{own}"), found, strict=True)}


sampling_tables = lru_cache(rssr.sampling_tables)


def sampled_maxima(designs: Array, wanted: frozenset[str], accuracy: Accuracy) -> Columns:
    """Compute maxima over ``accuracy.samples`` equidistant crank angles, the first at phi = 0.

    Whether the crank turns between the samples too is decided by the exact margin, not by the grid.
    """
    assert accuracy.samples is not None
    n = len(designs)
    status = np.empty(n, np.uint8)
    rssr.margin(designs, status, None, None, None, None, None)
    turns, step = status == st.OK, 2.0 * np.pi / accuracy.samples
    cos, sin = _grid(accuracy.samples)
    columns: Columns = {}
    least, values = np.empty(n), np.empty(accuracy.samples)
    # Without a place all orders are computed together, a place by itself.
    plain = [f"max_abs_{name}" in wanted and f"phi_max_abs_{name}" not in wanted for name in RATES]
    highest = [np.empty(n) if one else None for one in plain]
    if any(plain):
        rssr.dense_maxima(designs, cos, sin, least, highest[0], highest[1], highest[2])
    for order, name in enumerate(RATES):
        most = highest[order]
        if f"phi_max_abs_{name}" in wanted:
            most, at = np.empty(n), np.empty(n, np.int64)
            alone = [most if k == order else None for k in range(3)]
            rssr.dense_maxima(designs, cos, sin, least, alone[0], alone[1], alone[2], at, values)
            columns[f"phi_max_abs_{name}"] = np.where(turns, at * step, np.nan)
        if most is not None and f"max_abs_{name}" in wanted:
            columns[f"max_abs_{name}"] = np.where(turns, most, np.nan)
    return columns | {"status": status}


@lru_cache(maxsize=32)
def _grid(samples: int) -> tuple[Array, Array]:
    phi = np.arange(samples) * (2.0 * np.pi / samples)
    return np.cos(phi), np.sin(phi)


CURVES = {name: can.FusedOutput(order, can.constant(1.0, 0.0, 0.0)) for order, name in enumerate(RATES, start=1)}
SERIES = can.InSeries(rssr.FORM, CURVES, {"dpsi": "x1", "d2psi": "x2", "d3psi": "x3"}, rssr.opening)

FAMILY = Family(
    **about("rssr"),
    parameters=PARAMETERS,
    position="psi",
    pose_outputs=POSE_OUTPUTS,
    poses=poses,
    steps=(
        Step("margin", MARGIN_OUTPUTS, margin),
        Step("true maxima", MAXIMA_OUTPUTS, true_maxima, lambda a: a.target is not None and not a.certify),
        Step("limit positions", LIMIT_OUTPUTS, limits),
        Step("grid", MAXIMA_OUTPUTS, sampled_maxima, lambda a: a.samples is not None),
        Step("certified maxima", MAXIMA_OUTPUTS, certified_maxima, lambda a: a.certify, Work.PROOF, certifies=True),
    ),
    derivative_of=ladders("psi"),
    outward="branch",
    points={"b": ("x_b", "y_b", "z_b"), "c": ("x_c", "y_c", "z_c")},
    capabilities=(
        CRANK_ROCKER_SIZES,
        can.Assembly("discriminant", "pressure_angle", discriminant_scale),
        SERIES,
        can.JointRecords(joint_records, JOINT_NEEDS, "rocker"),
        can.PressureEllipse(ellipse),
        can.CrankRockerLoop(np.ascontiguousarray),
        can.LimitLocus("swing", sized=("c", "e", "g")),
        CRANK_ROCKER_BY_AXES,
        CRANK_ROCKER_BY_ROCKER,
        can.OutputLink(standing(PARAMETERS, "e").at),
        CRANK_ROCKER_POINTS,
        can.Skeleton(
            {"a": crank_axis(PARAMETERS, "f", "alpha"), "d": standing(PARAMETERS, "e", None, "g")}, CRANK_ROCKER
        ),
    ),
    precise_poses=precise_poses,
)
