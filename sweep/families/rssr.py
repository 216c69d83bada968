"""Registry entry of the spatial crank-rocker (RSSR)."""

from __future__ import annotations

import numpy as np

from kernels.families import rssr
from sweep.families.base import Angles, Array, Columns, Family, Output, Parameter, optional_outputs

PARAMETERS = (
    Parameter("a", "length", "crank", positive=True),
    Parameter("b", "length", "coupler", positive=True),
    Parameter("c", "length", "rocker", positive=True),
    Parameter("e", "length", "common perpendicular of the two axes, from crank axis to rocker axis"),
    Parameter("f", "length", "offset of the crank plane along the crank axis"),
    Parameter("g", "length", "offset of the rocker plane along the rocker axis"),
    Parameter("alpha", "angle", "angle between the axes"),
    Parameter("branch", "sign", "assembly mode: sign of dF/dpsi", default=1.0, choices=(-1.0, 1.0)),
)

POSE_OUTPUTS = (
    Output("psi", "rad", "rocker angle in (-pi, pi]", "(2*)"),
    Output("dpsi", "1", "velocity analogue dpsi/dphi", "(3)"),
    Output("d2psi", "1", "acceleration analogue", "(4)"),
    Output("d3psi", "1", "jerk analogue", "(5)"),
    Output("sin_psi", "1", "sine of the rocker angle", "(2*)"),
    Output("cos_psi", "1", "cosine of the rocker angle", "(2*)"),
    Output("discriminant", "length^4", "A1^2 + A2^2 - A3^2; the links reach where it is not negative", "(2)"),
    Output("pressure_angle", "rad", "between the coupler force and the velocity of its joint on the rocker", "(13)"),
    Output("x_b", "length", "crank pin, along the common perpendicular of the axes", "section 1"),
    Output("y_b", "length", "crank pin, across it and the rocker axis", "section 1"),
    Output("z_b", "length", "crank pin, along the rocker axis", "section 1"),
    Output("x_c", "length", "rocker ball, along the common perpendicular of the axes", "section 1"),
    Output("y_c", "length", "rocker ball, across it and the rocker axis", "section 1"),
    Output("z_c", "length", "rocker ball, along the rocker axis", "section 1"),
)

_POSE_NAMES = tuple(o.name for o in POSE_OUTPUTS)


def poses(designs: Array, angles: Angles, wanted: frozenset[str]) -> Columns:
    """Wanted pose outputs and status of every design at its crank angles, each (n, m)."""
    shape = (designs.shape[0], angles.cos.shape[1])
    status = np.empty(shape, np.uint8)
    outputs = optional_outputs(_POSE_NAMES, wanted, shape, np.result_type(designs, angles.cos))
    rssr.poses(designs, angles.cos, angles.sin, status, *outputs)
    columns: Columns = {name: out for name, out in zip(_POSE_NAMES, outputs, strict=True) if out is not None}
    return columns | {"status": status}


_JOINT_NEEDS = ("cos_psi", "sin_psi", "dpsi", "d2psi", "discriminant")


def joint_records(designs: Array, angles: Angles, motion: Columns, per_pose: Array, per_design: Array) -> None:
    """Fill the joint records that effects work from; ``motion`` holds the pose outputs they are made of."""
    cos_psi, sin_psi, dpsi, d2psi, discriminant = (np.asarray(motion[name], dtype=np.float64) for name in _JOINT_NEEDS)
    rssr.joints(designs, angles.cos, angles.sin, cos_psi, sin_psi, dpsi, d2psi, discriminant, per_pose, per_design)


def ellipse(designs: Array) -> Array:
    """The curve of the coupler direction across the rocker's motion, (n, 7)."""
    out = np.empty((len(designs), 7))
    rssr.pressure_ellipse(designs, out)
    return out


FAMILY = Family(
    name="rssr",
    title="spatial crank-rocker",
    parameters=PARAMETERS,
    position="psi",
    pose_outputs=POSE_OUTPUTS,
    poses=poses,
    derivative_of={"psi": "dpsi", "dpsi": "d2psi", "d2psi": "d3psi"},
    uses_phi=False,
    joints=joint_records,
    joint_needs=_JOINT_NEEDS,
    ellipse=ellipse,
)
