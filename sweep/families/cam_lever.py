"""Registry entry of the cam with a roller on a swinging lever."""

from __future__ import annotations

import numpy as np

from kernels.families.cam import swinging
from sweep.families.base import Angles, Array, Columns, Family, Output, Parameter
from sweep.families.cam import PHASES, TABLE, cam_poses, phase_ends, with_kinks
from sweep.families.capabilities import Dimensions, Link, Made, OutputLink, Skeleton
from sweep.families.pace import Switches
from sweep.families.skeletons import ORIGIN, links, parameter, standing

PARAMETERS = (
    Parameter("lift", "angle", "swing of the lever", positive=True),
    *PHASES,
    Parameter("r0", "length", "radius of the prime circle, on which the roller's centre rests", positive=True),
    Parameter("c", "length", "lever, from its axis to the roller's centre", positive=True),
    Parameter("e", "length", "distance of the lever's axis from the cam's along x", positive=True),
    Parameter(
        "branch",
        "sign",
        "sign of psi: the side of the line of axes on which the roller is",
        default=1.0,
        choices=(-1.0, 1.0),
    ),
    *TABLE,
)

POSE_OUTPUTS = (
    Output("psi", "rad", "lever angle in (-pi, pi), 0 away from the cam", "(9)", wraps=True),
    Output("dpsi", "1", "velocity analogue dpsi/dphi", "(9)"),
    Output("d2psi", "1", "acceleration analogue", "(9)"),
    Output("d3psi", "1", "jerk analogue", "(9)"),
    Output("pressure_angle", "rad", "between the normal of the cam and the velocity of the roller's centre", "(10)"),
    Output("x_p", "length", "pitch curve in the frame of the cam, towards the lever's axis at phi = 0", "(11)"),
    Output("y_p", "length", "pitch curve in the frame of the cam, to the left of it", "(11)"),
)


def poses(designs: Array, angles: Angles, wanted: frozenset[str]) -> Columns:
    """Return the wanted pose outputs and status of every design at its cam angles, each (n, m)."""
    return cam_poses(swinging.poses, tuple(o.name for o in POSE_OUTPUTS), designs, angles, wanted)


def lever_origin(designs: Array) -> Array:
    """Return the axis of the lever, (n, 3)."""
    origin = np.zeros((len(designs), 3), designs.dtype)
    origin[:, 0] = parameter(PARAMETERS, "e", designs)
    return origin


def roller(designs: Array, angles: Angles, motion: Columns) -> Array:
    """Return the roller's centre in the fixed frame, (n, m, 3)."""
    psi = np.asarray(motion["psi"], np.float64)
    e, c = (parameter(PARAMETERS, name, designs)[:, None] for name in ("e", "c"))
    return np.stack([e + c * np.cos(psi), c * np.sin(psi), np.zeros_like(psi)], axis=-1)


FAMILY = Family(
    name="cam_lever",
    title="cam with a roller on a swinging lever",
    parameters=PARAMETERS,
    position="psi",
    pose_outputs=with_kinks(POSE_OUTPUTS),
    poses=poses,
    example={"lift": 0.4, "r0": 3.0, "c": 5.0, "e": 6.0, "branch": -1.0},
    derivative_of={"psi": "dpsi", "dpsi": "d2psi", "d2psi": "d3psi"},
    capabilities=(
        Switches(phase_ends),
        Dimensions(links("c")),
        OutputLink(lever_origin),
        Skeleton(
            {"a": ORIGIN, "d": standing(PARAMETERS, "e")},
            (Link("cam", ("a",)), Link("lever", ("d", "r"))),
            {"r": Made(("psi",), roller)},
        ),
    ),
)
