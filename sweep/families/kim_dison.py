"""Registry entry of the spatial crank-rocker of Kim and Dison: the crank-rocker with perpendicular axes and g = 0.

It has its own symbols and frame, and uses the kernels of the crank-rocker: a = r, b = l, c = h, e = a, f = b, g = 0,
alpha = 90 deg, branch = -branch; psi is its alpha.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from kernels import status as st
from kernels.families import rssr
from kernels.types import Array, Status
from sweep.families import capabilities as can
from sweep.families import rssr as crank_rocker
from sweep.families.base import Accuracy, Columns, Family, Output, Step, about, parameters_of
from sweep.families.outputs import coordinate_outputs, joint_outputs, ladders
from sweep.families.poses import Made, chosen, following, on_matrix, step_of
from sweep.families.skeletons import CRANK_ROCKER, Y, links, standing

PARAMETERS = parameters_of("kim_dison")

_ANGLE = 0.5 * np.pi  # between the axes
# The crank-rocker's x runs from axis to axis, its z along the rocker's axis, its origin is b above this one.
_FROM_CRANK_ROCKER = np.array([[0.0, 0.0, -1.0], [1.0, 0.0, 0.0], [0.0, -1.0, 0.0]])

MOTION_OUTPUTS = (
    *coordinate_outputs("alpha", "rad", "rocker angle in (-pi, pi]", "(4)", "(5)", circle="the rocker angle"),
    Output("discriminant", "length^4", "4 h^2 times the square of the ball's distance from a dead point; negative out "
           "of reach", "(3)"),
    Output("pressure_angle", "rad", "between the coupler force and the velocity of the rocker ball", "(6)"),
)  # fmt: skip

OWN_OUTPUTS = (
    Output("omega3", "rad/s", "angular velocity of the rocker", "(7)"),
    Output("epsilon3", "rad/s^2", "angular acceleration of the rocker", "(7)"),
    Output("sin_transmission", "1", "coupler direction along the velocity of the rocker ball, signed", "(6)"),
    *joint_outputs(
        {"b": "crank pin", "c": "rocker ball"},
        "(1)",
        ("normal to the plane of the rocker", "from the crank axis towards the rocker axis", "along the crank axis"),
    ),
)

SWING_OUTPUTS = (
    Output("alpha_at_phi0", "rad", "rocker angle in the limit position at phi = 0, in (-pi, pi]", "(8)"),
    Output("alpha_at_phipi", "rad", "rocker angle in the limit position at phi = pi, in (-pi, pi]", "(8)"),
    Output("swing", "rad", "angle between the two limit positions, not negative", "(8)"),
)


def _theirs(name: str) -> str:
    """Return the crank-rocker's name of a quantity."""
    return name.replace("alpha", "psi")


def _ours(name: str) -> str:
    return name.replace("psi", "alpha")


def as_crank_rocker(designs: Array) -> Array:
    """Design matrix of the same linkage as a crank-rocker, (n, 8); nan if the crank's motion is invalid."""
    matrix = np.zeros((len(designs), len(crank_rocker.PARAMETERS)), designs.dtype)
    matrix[:, :5] = designs[:, :5]
    with np.errstate(invalid="ignore"):
        matrix[:, 0] += 0.0 * designs[:, 5] + 0.0 * designs[:, 6]
    matrix[:, 6] = _ANGLE
    matrix[:, 7] = -designs[:, 7]
    return matrix


def _sine(designs: Array, discriminant: Array, status: Status) -> Array:
    """T/b of the crank-rocker; nan where the links do not reach."""
    square = np.where(np.isin(status, (st.OK, st.DEAD_POINT)), discriminant, np.nan)
    return -designs[:, [7]] * np.sqrt(square) / (2.0 * designs[:, [1]] * designs[:, [2]])


_MADE: Made = {
    "omega3": (("dpsi",), lambda designs, rate: rate * designs[:, [5]]),
    "epsilon3": (("dpsi", "d2psi"), lambda designs, rate, bend: bend * designs[:, [5]] ** 2 + rate * designs[:, [6]]),
    "sin_transmission": (("discriminant", "status"), _sine),
    # without b cos(alpha), which the crank-rocker's rounded right angle leaves
    "x_b": (("z_b",), lambda designs, z: designs[:, [4]] * np.cos(_ANGLE) - z),
    "y_b": (("x_b",), lambda designs, x: x),
    "z_b": (("y_b",), lambda designs, y: y - y),  # the pin stays in the crank plane; a difference to b leaves rounding
    "x_c": (("z_c",), lambda designs, z: -z),
    "y_c": (("x_c",), lambda designs, x: x),
    "z_c": (("y_c",), lambda designs, y: designs[:, [4]] - y),
}
poses, precise_poses = (
    following(on_matrix(run, as_crank_rocker), _MADE, _theirs)
    for run in (crank_rocker.poses, crank_rocker.precise_poses)
)


def swing(designs: Array, wanted: frozenset[str], accuracy: Accuracy) -> Columns:
    """Compute both limit positions, with the crank in the plane of the rocker, and their angle, to rounding."""
    found = crank_rocker.limits(as_crank_rocker(designs), frozenset(rssr.LIMIT_NAMES), accuracy)
    # The extended position is phi = 0 or pi, where the ball is beyond the crank pin: y_C > 0 or < 0.
    first = np.cos(np.asarray(found["phi_ext"])) > 0.0
    columns: Columns = {}
    for err in ("", "err_") if accuracy.target is not None else ("",):
        ext, fold, whole = (found[f"{err}{name}"] for name in ("psi_ext", "psi_fold", "swing"))
        columns |= {f"{err}alpha_at_phi0": np.where(first, ext, fold), f"{err}swing": np.abs(np.asarray(whole))}
        columns[f"{err}alpha_at_phipi"] = np.where(first, fold, ext)
    return chosen(columns, wanted, np.asarray(found["status"], np.uint8))


FAMILY = Family(
    **about("kim_dison"),
    parameters=PARAMETERS,
    position="alpha",
    pose_outputs=MOTION_OUTPUTS + OWN_OUTPUTS,
    poses=poses,
    steps=(
        Step("swing", SWING_OUTPUTS, swing),
        *(
            step_of(step, as_crank_rocker, _ours, _theirs)
            for step in crank_rocker.FAMILY.steps
            if step.name != "limit positions"
        ),
    ),
    derivative_of=ladders("alpha"),
    points={"b": ("x_b", "y_b", "z_b"), "c": ("x_c", "y_c", "z_c")},
    capabilities=(
        can.Dimensions(links("r l h")),
        can.Assembly("discriminant", "pressure_angle", crank_rocker.discriminant_scale),
        *crank_rocker.moving_alike(as_crank_rocker, (_FROM_CRANK_ROCKER, standing(PARAMETERS, z="b").at)),
        replace(
            crank_rocker.SERIES,
            curves={_ours(name): known for name, known in crank_rocker.CURVES.items()},
            matrix=as_crank_rocker,
        ),
        can.Skeleton(
            {
                "a": standing(PARAMETERS, axis=(0.0, 0.0, -1.0), zero=Y),
                "d": standing(PARAMETERS, None, "a", "b", axis=(-1.0, 0.0, 0.0)),
            },
            CRANK_ROCKER,
        ),
    ),
    precise_poses=precise_poses,
)
