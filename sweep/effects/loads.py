"""Inputs that the load effects share: bodies, weight, speed, load."""

from __future__ import annotations

from typing import NamedTuple

from sweep.effects.coupler import CONSTRUCTION
from sweep.families.base import Parameter

_FRAMES = {
    "crank": "along the crank, tangential, along its axis, from A",
    "coupler": "along the coupler, n x s, n, from B",
    "rocker": "along the rocker, tangential, along its axis, from D",
    "slider": "along the common perpendicular, the slide, normal to both, from C",
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
SPEED = Parameter("speed", "speed", "speed of the crank (scene.speed of a study)", positive=True)
LOAD_TORQUE = Parameter(
    "load_torque", "torque", "torque on the rocker about its axis; a resisting one opposes dpsi", default=0.0
)
LOAD_FORCE = Parameter(
    "load_force", "force", "force on the slider along the slide; a resisting one opposes ds", default=0.0
)
ACCELERATION = Parameter("speed_change", "angular_acceleration", "angular acceleration of the crank", default=0.0)


class LoadInputs(NamedTuple):
    """Inputs of kinetostatics: all of them, those that are columns of its kernel in order, the useful load."""

    parameters: tuple[Parameter, ...]
    columns: tuple[str, ...]
    load: str


def _inputs(follower: str, load: Parameter) -> LoadInputs:
    bodies = (*_body("crank"), *_body("coupler"), *_body(follower))
    columns = (*bodies, *GRAVITY, load, SPEED, ACCELERATION)
    return LoadInputs((*columns, CONSTRUCTION), tuple(p.name for p in columns), load.name)


ROCKER = _inputs("rocker", LOAD_TORQUE)
SLIDER = _inputs("slider", LOAD_FORCE)
