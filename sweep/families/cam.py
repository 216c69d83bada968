"""Registry entries of the cams with a roller: on a follower that slides along a line, or on a swinging lever."""

from __future__ import annotations

import numpy as np

from kernels.families import cam
from kernels.types import Array
from sweep.families.base import Angles, Family, Output, Parameter, about, parameters_of
from sweep.families.capabilities import Dimensions, Link, OutputLink, Skeleton
from sweep.families.curve_features import Switches
from sweep.families.outputs import coordinate_outputs, kinked, ladders
from sweep.families.planar_trees import sliding_follower, swinging_follower
from sweep.families.poses import following, poses_of
from sweep.families.skeletons import ORIGIN, X, dimensions, line, links, moving, parameter, standing

TABLE = tuple(
    Parameter(f"{letter}{k}", "ratio", f"{function}({k} phi) of the Fourier table, in lifts", default=0.0)
    for letter, function in (("c", "cos"), ("s", "sin"))
    for k in range(1, cam.HARMONICS + 1)
)

PARAMETERS = (*parameters_of("cam"), *TABLE)

PROFILE_OUTPUTS = (
    *coordinate_outputs("s", "length", "displacement of the follower from its rest", "(1)", "(1)"),
    Output("pressure_angle", "rad", "between the normal of the cam and the direction of the follower", "(7)"),
    Output("x_p", "length", "pitch curve in the frame of the cam, along the direction of lift at phi = 0", "(8)"),
    Output("y_p", "length", "pitch curve in the frame of the cam, to the left of it", "(8)"),
)
ROLLER_OUTPUTS = (
    Output("x_r", "length", "roller's centre in the fixed frame, along the direction of lift", "(6)"),
    Output("y_r", "length", "roller's centre in the fixed frame, to the left of it", "(6)"),
)
_LAW = ("rise", "dwell", "fall", "start", "law")


def phase_ends(designs: Array) -> Array:
    """Cam angles at which a phase, or a piece of the modified sine, begins or ends, (n, 8); 0 for a Fourier table."""
    rise, dwell, fall, start, kind = dimensions(PARAMETERS, designs, *_LAW)
    shares = np.array([0.0, 0.125, 0.875, 1.0])
    ends = np.concatenate([start + rise * shares, start + rise + dwell + fall * shares], axis=1)
    return np.where(kind == cam.FOURIER, 0.0, ends)


def _height(designs: Array, s: Array) -> Array:
    """Roller's centre along the direction of lift, (6)."""
    r0, e = dimensions(PARAMETERS, designs, "r0", "e")
    with np.errstate(invalid="ignore"):  # an offset beyond the prime circle is reported by the status
        return np.sqrt((r0 - e) * (r0 + e)) + s


def _aside(designs: Array, s: Array) -> Array:
    """Roller's centre to the left of the direction of lift, (6)."""
    (e,) = dimensions(PARAMETERS, designs, "e")
    return -e + 0.0 * s


# Wanted pose outputs and status of every design at its cam angles, each (n, m).
poses = following(poses_of(cam.poses, cam.Outputs, angles="phi"), {"x_r": (("s",), _height), "y_r": (("s",), _aside)})


def follower_line(designs: Array) -> tuple[Array, Array]:
    """Point of the follower's line nearest to the cam's axis, and the direction of lift, each (n, 3)."""
    zero = np.zeros(len(designs))
    at = np.stack([zero, -parameter(PARAMETERS, "e", designs), zero], axis=1)
    return at, np.tile(X, (len(designs), 1))


FAMILY = Family(
    **about("cam"),
    parameters=PARAMETERS,
    position="s",
    pose_outputs=kinked(PROFILE_OUTPUTS + ROLLER_OUTPUTS),  # the phases of a cam meet in kinks or jumps
    poses=poses,
    uses_phi=True,
    derivative_of=ladders("s"),
    points={"r": ("x_r", "y_r", None)},
    capabilities=(
        Switches(phase_ends),
        sliding_follower(PARAMETERS),
        Skeleton({"a": ORIGIN, "d": line(follower_line)}, (Link("cam", ("a",)), Link("follower", ("r",)))),
    ),
)


LEVER_PARAMETERS = (*parameters_of("cam_lever"), *TABLE)

LEVER_OUTPUTS = (
    *coordinate_outputs("psi", "rad", "lever angle in (-pi, pi), 0 away from the cam", "(9)", "(9)"),
    Output("pressure_angle", "rad", "between the normal of the cam and the velocity of the roller's centre", "(10)"),
    Output("x_p", "length", "pitch curve in the frame of the cam, towards the lever's axis at phi = 0", "(11)"),
    Output("y_p", "length", "pitch curve in the frame of the cam, to the left of it", "(11)"),
)


lever_poses = poses_of(cam.lever_poses, cam.LeverOutputs, angles="phi")


def roller(angles: Angles, e: Array, c: Array, psi: Array) -> tuple[Array, Array]:
    """Roller's centre in the fixed frame."""
    return e + c * np.cos(psi), c * np.sin(psi)


LEVER = Family(
    **about("cam_lever"),
    parameters=LEVER_PARAMETERS,
    position="psi",
    pose_outputs=kinked(LEVER_OUTPUTS),
    poses=lever_poses,
    uses_phi=True,
    derivative_of=ladders("psi"),
    capabilities=(
        Switches(phase_ends),
        Dimensions(links("c")),
        OutputLink(standing(LEVER_PARAMETERS, "e").at),
        swinging_follower(LEVER_PARAMETERS),
        Skeleton(
            {"a": ORIGIN, "d": standing(LEVER_PARAMETERS, "e")},
            (Link("cam", ("a",)), Link("lever", ("d", "r"))),
            {"r": moving(LEVER_PARAMETERS, "e c", ("psi",), roller)},
        ),
    ),
)
