"""Inputs that the load effects share: bodies, weight, speed, load torque."""

from __future__ import annotations

from sweep.effects.coupler import CONSTRUCTION
from sweep.families.base import Parameter

_FRAMES = {
    "crank": "along the crank, tangential, along its axis, from A",
    "coupler": "along the coupler, n x s, n, from B",
    "rocker": "along the rocker, tangential, along its axis, from D",
}


def _body(body: str) -> tuple[Parameter, ...]:
    frame = _FRAMES[body]
    centre = (
        Parameter(f"com_{body}_{axis}", "length", f"centre of mass of the {body} ({frame})", default=0.0)
        for axis in "xyz"
    )
    moments = (
        Parameter(f"j_{body}_{axes}", "inertia", f"inertia of the {body} about its centre of mass", default=0.0)
        for axes in ("xx", "xy", "xz", "yy", "yz", "zz")
    )
    return Parameter(f"m_{body}", "mass", f"mass of the {body}"), *centre, *moments


GRAVITY = tuple(
    Parameter(f"gravity_{axis}", "acceleration", f"gravity along {axis} of the fixed axes", default=0.0)
    for axis in "xyz"
)
SPEED = Parameter("speed", "speed", "speed of the crank")
LOAD_TORQUE = Parameter(
    "load_torque", "torque", "torque on the rocker about its axis; a resisting one opposes dpsi", default=0.0
)
ACCELERATION = Parameter("speed_change", "angular_acceleration", "angular acceleration of the crank", default=0.0)

# In the order of the columns that kernels.effects.kinetostatics takes.
LOADS = (*_body("crank"), *_body("coupler"), *_body("rocker"), *GRAVITY, LOAD_TORQUE, SPEED, ACCELERATION)
LOAD_NAMES = tuple(p.name for p in LOADS)
INPUTS = (*LOADS, CONSTRUCTION)
