"""Registry entry of the planar slider-crank, also offset: the spatial one with alpha = 0, turned by a quarter.

It has the kernels of the spatial slider-crank; x runs along the slide line and phi is counted from there.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from kernels.families.rssp import PLANAR_FORM
from sweep.families import rssp
from sweep.families.base import Accuracy, Angles, Array, Columns, Family, Output, Parameter, PoseFunction, Step
from sweep.families.capabilities import Assembly, InSeries, JointRecords, Points, Skeleton
from sweep.families.hardpoints import PLANAR_SLIDER_POINTS
from sweep.families.placing import move_records
from sweep.families.skeletons import ORIGIN, SLIDER_CRANK, SLIDER_CRANK_SIZES, X, standing

PARAMETERS = (
    Parameter("a", "length", "crank", positive=True),
    Parameter("b", "length", "connecting rod", positive=True),
    Parameter("e", "length", "offset of the slide line from the crank pivot, to its left", default=0.0),
    Parameter("branch", "sign", "assembly mode: sign of s - x_B", default=1.0, choices=(-1.0, 1.0)),
)

POSE_OUTPUTS = (
    Output("s", "length", "slider displacement from the foot of the crank pivot", "(1)"),
    Output("ds", "length", "velocity analogue ds/dphi", "(3)"),
    Output("d2s", "length", "acceleration analogue", "(3)"),
    Output("d3s", "length", "jerk analogue", "(3)"),
    Output("discriminant", "length^2", "Q; the links reach where it is not negative", "(1)"),
    Output("pressure_angle", "rad", "between the rod and the slide line", "(2)"),
    Output("x_b", "length", "crank pin, along the slide line", "(1)"),
    Output("y_b", "length", "crank pin, across the slide line", "(1)"),
    Output("x_c", "length", "slider pin, along the slide line", "(1)"),
    Output("y_c", "length", "slider pin, across the slide line", "(1)"),
)

# The spatial linkage has its slide line along y: its x is minus this y, and its crank angle a quarter turn more.
_THEIRS = {"x_b": "y_b", "y_b": "x_b", "x_c": "y_c", "y_c": "x_c"}
_ANGLES = ("phi_ext", "phi_fold")
_FROM_SPATIAL = np.array([[0.0, 1.0, 0.0], [-1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])


def as_spatial(designs: Array) -> Array:
    """Return the design matrix of the same linkage as a spatial slider-crank, (n, 6)."""
    matrix = np.zeros((len(designs), len(rssp.PARAMETERS)), designs.dtype)
    matrix[:, 0], matrix[:, 1], matrix[:, 2], matrix[:, 5] = designs[:, 0], designs[:, 1], -designs[:, 2], designs[:, 3]
    return matrix


def turned(angles: Angles) -> Angles:
    """Return the crank angles counted from the common perpendicular, with the same bits."""
    return Angles(angles.phi + 0.5 * np.pi, np.ascontiguousarray(-angles.sin), angles.cos)


def _poses(run: PoseFunction, designs: Array, angles: Angles, wanted: frozenset[str]) -> Columns:
    found = run(as_spatial(designs), turned(angles), frozenset(_THEIRS.get(name, name) for name in wanted))
    columns: Columns = {"status": found["status"]}
    for name in wanted - {"status"}:
        values: Array = np.asarray(found[_THEIRS.get(name, name)])
        columns[name] = 0.0 - values if name in ("y_b", "y_c") else values
    return columns


def poses(designs: Array, angles: Angles, wanted: frozenset[str]) -> Columns:
    """Return the wanted pose outputs and status of every design at its crank angles, each (n, m)."""
    return _poses(rssp.poses, designs, angles, wanted)


def precise_poses(designs: Array, angles: Angles, wanted: frozenset[str]) -> Columns:
    """Compute what :func:`poses` does, in twice the working precision; for float64 only."""
    return _poses(rssp.precise_poses, designs, angles, wanted)


def _as_ours(step: Step) -> Step:
    """Return a step of the spatial slider-crank with this family's crank angle."""

    def run(designs: Array, wanted: frozenset[str], accuracy: Accuracy) -> Columns:
        found = step.run(as_spatial(designs), wanted, accuracy)
        for name in _ANGLES:
            if name in found:
                found[name] = (np.asarray(found[name], np.float64) - 0.5 * np.pi) % (2.0 * np.pi)
        return found

    return replace(step, provides=tuple(replace(o, equation="") for o in step.provides), run=run)


def joint_records(designs: Array, angles: Angles, motion: Columns, per_pose: Array, per_design: Array) -> None:
    """Fill the joint records that effects work from."""
    names = ("s", "ds", "d2s", "discriminant")
    rssp.joint_records(as_spatial(designs), turned(angles), {n: motion[n] for n in names}, per_pose, per_design)
    move_records(_FROM_SPATIAL, np.zeros((len(designs), 3)), per_pose, per_design)


def opening(designs: Array, status: NDArray[np.uint8], distance: Array) -> None:
    """Tell whether the crank turns, and how near the motion's nearest singularity is."""
    rssp.opening(as_spatial(designs), status, distance)


FAMILY = Family(
    name="slider_crank",
    title="planar slider-crank",
    parameters=PARAMETERS,
    position="s",
    pose_outputs=POSE_OUTPUTS,
    poses=poses,
    example={"a": 1.0, "b": 3.0, "e": 0.4, "branch": -1.0},
    steps=tuple(_as_ours(step) for step in rssp.FAMILY.steps),
    derivative_of={"s": "ds", "ds": "d2s", "d2s": "d3s"},
    outward="branch",
    uses_phi=False,
    capabilities=(
        SLIDER_CRANK_SIZES,
        Assembly("discriminant", "pressure_angle", rssp.coupler_square),
        InSeries(PLANAR_FORM, rssp.CURVES, rssp.COMPONENTS, opening),
        JointRecords(joint_records, ("s", "ds", "d2s", "discriminant"), "slider"),
        Points({"b": ("x_b", "y_b", None), "c": ("x_c", "y_c", None)}),
        PLANAR_SLIDER_POINTS,
        Skeleton({"a": ORIGIN, "d": standing(PARAMETERS, None, "e", axis=X, kind="slide")}, SLIDER_CRANK),
    ),
    precise_poses=precise_poses,
)
