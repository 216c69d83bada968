"""Registry entry of the inverted slider-crank: a crank pin in the slot of a rocker."""

from __future__ import annotations

import numpy as np

from kernels.families import inverted_slider_crank
from sweep.families.base import Angles, Array, Columns, Family, Output, Parameter, filled_with_places
from sweep.families.capabilities import Assembly, Dimensions, Link, Made, OutputLink, Points, Skeleton
from sweep.families.pace import Singular
from sweep.families.skeletons import CRANK, ORIGIN, links, parameter, standing

PARAMETERS = (
    Parameter("a", "length", "crank", positive=True),
    Parameter("e", "length", "frame, from crank pivot to rocker pivot along x"),
    Parameter("h", "length", "offset of the slot from the rocker pivot, to its left", default=0.0),
    Parameter(
        "branch", "sign", "assembly mode: side of the rocker on which the pin is", default=1.0, choices=(-1.0, 1.0)
    ),
)

VALUE_OUTPUTS = (
    Output("psi", "rad", "rocker angle in (-pi, pi]", "(2)", wraps=True),
    Output("dpsi", "1", "velocity analogue dpsi/dphi", "(4)"),
    Output("d2psi", "1", "acceleration analogue", "(4)"),
    Output("d3psi", "1", "jerk analogue", "(4)"),
    Output("s", "length", "place of the crank pin along the slot, from the foot of the rocker pivot", "(2)"),
    Output("ds", "length", "sliding velocity analogue ds/dphi", "(5)"),
    Output("d2s", "length", "sliding acceleration analogue", "(5)"),
    Output(
        "discriminant", "1", "1 - h^2/r^2, r from pin to rocker pivot; the slot reaches where it is not negative", "(1)"
    ),
    Output("pressure_angle", "rad", "between the force of the slot and the velocity of the rocker there", "(3)"),
)

JOINT_OUTPUTS = (
    Output("x_b", "length", "crank pin, along the frame", "(1)"),
    Output("y_b", "length", "crank pin, across the frame", "(1)"),
)

_VALUES = tuple(o.name for o in VALUE_OUTPUTS)
_JOINTS = tuple(o.name for o in JOINT_OUTPUTS)


def poses(designs: Array, angles: Angles, wanted: frozenset[str]) -> Columns:
    """Return the wanted pose outputs and status of every design at its crank angles, each (n, m)."""
    return filled_with_places(inverted_slider_crank.poses, designs, angles, _VALUES, _JOINTS, wanted)


def slot_squared(designs: Array, angles: Angles, found: Columns) -> Array:
    """Return the square of the pin's place in the slot, (n, m): where it nearly vanishes the rocker turns at once."""
    return np.square(np.asarray(found["s"], np.float64))


def _one(designs: Array) -> Array:
    """Return 1 for every design: the discriminant is the squared cosine of the pressure angle as it stands."""
    return np.ones(len(designs))


def rocker_origin(designs: Array) -> Array:
    """Return the rocker pivot, (n, 3)."""
    origin = np.zeros((len(designs), 3))
    origin[:, 0] = designs[:, 1]
    return origin


def slot_foot(designs: Array, angles: Angles, motion: Columns) -> Array:
    """Return the foot of the rocker pivot on the slot, (n, m, 3): ``h`` from the pivot, square to the slot."""
    psi = np.asarray(motion["psi"], np.float64)
    h, e = (parameter(PARAMETERS, name, designs)[:, None] for name in ("h", "e"))
    return np.stack([e - h * np.sin(psi), h * np.cos(psi), np.zeros_like(psi)], axis=-1)


FAMILY = Family(
    name="inverted_slider_crank",
    title="inverted slider-crank",
    parameters=PARAMETERS,
    position="psi",
    pose_outputs=VALUE_OUTPUTS + JOINT_OUTPUTS,
    poses=poses,
    example={"a": 1.0, "e": 2.2, "h": 0.3, "branch": -1.0},
    derivative_of={"psi": "dpsi", "dpsi": "d2psi", "d2psi": "d3psi", "s": "ds", "ds": "d2s"},
    uses_phi=False,
    capabilities=(
        Singular(slot_squared, ("s",)),
        Dimensions(links("a")),
        Assembly("discriminant", "pressure_angle", _one),
        Points({"b": ("x_b", "y_b", None)}),
        OutputLink(rocker_origin),
        Skeleton(
            {"a": ORIGIN, "d": standing(PARAMETERS, "e")},
            (CRANK, Link("rocker", ("d", "c", "b"))),
            {"c": Made(("psi",), slot_foot)},
        ),
    ),
)
