"""Registry entry of the spatial slider-crank (RSSP)."""

from __future__ import annotations

import numpy as np

from kernels.families import rssp
from sweep.families.base import Angles, Array, Columns, Family, Output, Parameter, optional_outputs

PARAMETERS = (
    Parameter("a", "length", "crank", positive=True),
    Parameter("b", "length", "coupler", positive=True),
    Parameter("e", "length", "common perpendicular of crank axis and slide line, from the axis to the line"),
    Parameter("f", "length", "offset of the crank plane along the crank axis"),
    Parameter("alpha", "angle", "90 deg minus the angle between crank axis and slide direction; 0 if planar"),
    Parameter("branch", "sign", "assembly mode: sign of s - y_B", default=1.0, choices=(-1.0, 1.0)),
)

VALUE_OUTPUTS = (
    Output("s", "length", "slider displacement from the foot of the common perpendicular", "(2)"),
    Output("ds", "length", "velocity analogue ds/dphi", "(5)"),
    Output("d2s", "length", "acceleration analogue", "(5)"),
    Output("d3s", "length", "jerk analogue", "(5)"),
    Output("discriminant", "length^2", "Q; the links reach where it is not negative", "(1)"),
    Output("pressure_angle", "rad", "between the coupler force and the velocity of the slider", "(3)"),
)

JOINT_OUTPUTS = (
    Output("x_b", "length", "crank pin, along the common perpendicular", "(6)"),
    Output("y_b", "length", "crank pin, along the slide direction", "(6)"),
    Output("z_b", "length", "crank pin, normal to both", "(6)"),
    Output("x_c", "length", "slider ball, along the common perpendicular", "(6)"),
    Output("y_c", "length", "slider ball, along the slide direction", "(6)"),
    Output("z_c", "length", "slider ball, normal to both", "(6)"),
)

_VALUES = tuple(o.name for o in VALUE_OUTPUTS)
_JOINTS = tuple(o.name for o in JOINT_OUTPUTS)


def poses(designs: Array, angles: Angles, wanted: frozenset[str]) -> Columns:
    """Wanted pose outputs and status of every design at its crank angles, each (n, m)."""
    shape = (designs.shape[0], angles.cos.shape[1])
    dtype = np.result_type(designs, angles.cos)
    status = np.empty(shape, np.uint8)
    values = optional_outputs(_VALUES, wanted, shape, dtype)
    joints = None if wanted.isdisjoint(_JOINTS) else np.empty((len(_JOINTS), *shape), dtype)
    outputs = [*values, joints]
    rssp.poses(designs, angles.cos, angles.sin, status, *outputs)
    columns: Columns = {name: out for name, out in zip(_VALUES, values, strict=True) if out is not None}
    if joints is not None:
        columns |= {name: out for name, out in zip(_JOINTS, joints, strict=True) if name in wanted}
    return columns | {"status": status}


FAMILY = Family(
    name="rssp",
    title="spatial slider-crank",
    parameters=PARAMETERS,
    position="s",
    pose_outputs=VALUE_OUTPUTS + JOINT_OUTPUTS,
    poses=poses,
    derivative_of={"s": "ds", "ds": "d2s", "d2s": "d3s"},
    uses_phi=False,
)
