"""Registry entry of the heddle drive: cam lever, rod, bell crank, link, shaft lever, heddle shaft."""

from __future__ import annotations

import numpy as np

from kernels.families import heddle
from sweep.families.base import Angles, Array, Columns, Family, Output, Parameter, filled_with_places
from sweep.families.capabilities import Assembly, Dimensions, Points
from sweep.families.skeletons import links

PARAMETERS = (
    Parameter("O2B", "length", "arm of the cam lever", positive=True),
    Parameter("BC", "length", "rod from the cam lever to the bell crank", positive=True),
    Parameter("O3C", "length", "upper arm of the bell crank", positive=True),
    Parameter("O2O3", "length", "frame, from the pivot of the cam lever to that of the bell crank", positive=True),
    Parameter("O4E", "length", "arm of the shaft lever to the heddle rod", positive=True),
    Parameter("chi_mid", "angle", "bell-crank angle at mid-stroke of the shaft"),
    Parameter("O3D", "length", "lower arm of the bell crank; 0 with the next three: parallel linkage, equal angles",
              default=0.0, not_negative=True),
    Parameter("O4F", "length", "arm of the shaft lever to the link", default=0.0, not_negative=True),
    Parameter("O3O4", "length", "frame, from the pivot of the bell crank to that of the shaft lever",
              default=0.0, not_negative=True),
    Parameter("DF", "length", "link from the bell crank to the shaft lever", default=0.0, not_negative=True),
    Parameter("EG", "length", "heddle rod; 0 if it is long", default=0.0, not_negative=True),
    Parameter("x_s", "length", "distance of the vertical slide from the pivot of the shaft lever", default=0.0),
    Parameter("side_F", "sign", "+1: the arms O3D, O4F point to the left of O3O4", default=1.0, choices=(-1.0, 1.0)),
    Parameter("side_C", "sign", "assembly mode: +1 if C lies to the left of the ray from B to O3",
              default=1.0, choices=(-1.0, 1.0)),
)  # fmt: skip

VALUE_OUTPUTS = (
    Output("chi", "rad", "bell-crank angle, direction of O3C from the line O2O3", "(4)", wraps=True),
    Output("dchi", "1", "dchi/dtheta", "(5)"),
    Output("d2chi", "1", "second derivative of chi", "(5)"),
    Output("d3chi", "1", "third derivative of chi", "(5)"),
    Output("y", "length", "lift of the shaft, zero at mid-stroke (with a heddle rod: height of its lower end)", "(7)"),
    Output("dy", "length", "velocity analogue dy/dtheta", "(9)"),
    Output("d2y", "length", "acceleration analogue", "(9)"),
    Output("d3y", "length", "jerk analogue", "(9)"),
    Output("discriminant", "length^2", "Delta; the rod reaches where it is not negative", "(3)"),
)

PLACE_OUTPUTS = (
    Output("sin_transmission", "1", "sine of the angle from the rod BC to the arm O3C", "(4)"),
    Output("pressure_angle", "rad", "between the rod's force and the velocity of C", "(4)"),
    Output("lam", "rad", "angle of the shaft lever from mid-stroke", "(6)", wraps=True),
    Output("x_b", "length", "end of the cam lever, along O2O3 from O2", "(3)"),
    Output("y_b", "length", "end of the cam lever, across O2O3", "(3)"),
    Output("x_c", "length", "upper end of the bell crank, along O2O3 from O2", "(4)"),
    Output("y_c", "length", "upper end of the bell crank, across O2O3", "(4)"),
)

_VALUES = tuple(o.name for o in VALUE_OUTPUTS)
_PLACES = tuple(o.name for o in PLACE_OUTPUTS)


def poses(designs: Array, angles: Angles, wanted: frozenset[str]) -> Columns:
    """Wanted pose outputs and status of every design at its cam-lever angles, each (n, m)."""
    return filled_with_places(heddle.poses, designs, angles, _VALUES, _PLACES, wanted)


def rod_square(designs: Array) -> Array:
    """BC^2 of every design: the discriminant over it is the squared cosine of the pressure angle."""
    square: Array = np.square(designs[:, 1])
    return square


EXAMPLE = {"O2B": 30.0, "BC": 150.0, "O3C": 70.0, "O2O3": 155.0, "O4E": 138.5, "chi_mid": 1.85}


FAMILY = Family(
    name="heddle",
    title="lever drive of a heddle shaft",
    parameters=PARAMETERS,
    position="y",
    pose_outputs=VALUE_OUTPUTS + PLACE_OUTPUTS,
    poses=poses,
    example=EXAMPLE,
    derivative_of={"chi": "dchi", "dchi": "d2chi", "d2chi": "d3chi", "y": "dy", "dy": "d2y", "d2y": "d3y"},
    uses_phi=False,
    capabilities=(
        Dimensions(links("O2B BC O3C O4E"), optional=("O3D", "O4F", "DF", "EG")),
        Assembly("discriminant", "pressure_angle", rod_square),
        Points({"b": ("x_b", "y_b", None), "c": ("x_c", "y_c", None)}),
    ),
)
