"""C0, M1: motion of the coupler and its point, and acceleration of the common centre of mass of uniform links."""

from __future__ import annotations

import numpy as np

from kernels.effects.coupler import CouplerMotion, centre_acceleration, coupler_point
from sweep.effects.base import Advice, Effect, about
from sweep.effects.scene import Scene
from sweep.families.base import Columns, Output, Parameter
from sweep.families.poses import filled_each

CONSTRUCTION = Parameter(
    "finger", "choice",
    "The coupler cannot spin freely: a finger holds it in a joint, 0 the driven one (at C), 1 the driving one (at B)",
    default=0.0, choices=(0.0, 1.0),
)  # fmt: skip

INPUTS = (
    Parameter("x_point", "length", "coupler point from B along the coupler", default=0.0),
    Parameter("y_point", "length", "coupler point along n x s, in the coupler's plane", default=0.0),
    Parameter("z_point", "length", "coupler point along n, normal to the coupler's plane", default=0.0),
    CONSTRUCTION,
)

_GROUPS = {
    "": ("{axis}_p", "length", "{axis} of the coupler point, fixed axes"),
    "d": ("d{axis}_p", "length", "velocity analogue of the coupler point along {axis}"),
    "d2": ("d2{axis}_p", "length", "acceleration analogue of the coupler point along {axis}"),
    "n": ("n_{axis}", "1", "{axis} of the unit vector n of the coupler"),
    "omega": ("omega_{axis}", "1", "angular velocity of the coupler along {axis} per unit crank speed"),
    "eps": ("eps_{axis}", "1", "angular acceleration of the coupler along {axis} per unit crank speed squared"),
}
_EULER = (
    Output("euler_theta", "rad", "nutation of the coupler: about the node line, after the precession", wraps=True),
    Output("euler_phi", "rad", "rotation of the coupler about its own third axis", wraps=True),
)
OUTPUTS = _EULER + tuple(
    Output(name.format(axis=axis), unit, text.format(axis=axis))
    for name, unit, text in _GROUPS.values()
    for axis in "xyz"
)

# Derivative of each quantity by the crank angle; no output is the turn about an axis.
RATES = {
    low.format(axis=axis): high.format(axis=axis)
    for low, high in (("{axis}_p", "d{axis}_p"), ("d{axis}_p", "d2{axis}_p"), ("turn_{axis}", "omega_{axis}"),
                      ("omega_{axis}", "eps_{axis}"))
    for axis in "xyz"
}  # fmt: skip
_POINT = ("x_point", "y_point", "z_point")


def compute(scene: Scene, wanted: frozenset[str]) -> Columns:
    """Compute the wanted components, in a chain with respect to stage 1; three take as long as one."""
    status = scene.status()
    groups = [[name.format(axis=axis) for axis in "xyz"] for name, _, _ in _GROUPS.values()]
    needed = wanted if scene.rates is None else wanted | {low for low, high in RATES.items() if high in wanted}
    out = [None if needed.isdisjoint(names) else np.empty((*scene.shape, 3)) for names in groups]
    angles = None if wanted.isdisjoint(o.name for o in _EULER) else np.empty((*scene.shape, 2))
    motion = CouplerMotion(*(*out, angles))
    coupler_point(*scene.records, scene.table(_POINT), scene.inputs["finger"], status, motion)
    if scene.rates is not None:
        first, second = (rate[:, :, None] for rate in scene.rates)
        for once, twice in ((motion.velocity, motion.acceleration), (motion.omega, motion.eps)):
            if twice is not None and once is not None:
                twice[:] = twice * first**2 + once * second
            if once is not None:
                once *= first
    columns: Columns = {
        name: values[:, :, k]
        for names, values in zip(groups, out, strict=True)
        for k, name in enumerate(names)
        if values is not None and name in wanted
    }
    if angles is not None:
        columns |= {o.name: angles[:, :, k] for k, o in enumerate(_EULER) if o.name in wanted}
    return columns | {"status": status}


def advise(scene: Scene) -> Advice | None:
    """Compare the coupler's mass with the follower's inertia at C, and its centre of mass with the line B-C."""
    given, slider = scene.inputs, "m_slider" in scene.inputs
    follower = "slider" if slider else "rocker"
    if not {"m_coupler", f"m_{follower}"} <= set(given):
        return None
    b, c = scene.records[1][:, 13], scene.records[1][:, 14]
    inertia = given[f"m_{follower}"]
    if not slider:
        square = given["com_rocker_x"] ** 2 + given["com_rocker_y"] ** 2
        rod = given["rod_rocker"] * (inertia + given["line_mass_rocker"] * c) / 3.0
        inertia = (given["j_rocker_zz"] + inertia * square) / c**2 + rod
    off = np.hypot(given["com_coupler_y"], given["com_coupler_z"]) / b
    coupler = given["m_coupler"] + given["rod_coupler"] * given["line_mass_coupler"] * b
    with np.errstate(divide="ignore", invalid="ignore"):  # without a mass the quotient is not used
        share = np.where(coupler > 0.0, coupler / inertia, 0.0)
    return Advice("coupler's mass over the follower's, brought to C, plus its eccentricity", share + off, 0.05)


EFFECT = Effect(
    **about("coupler"),
    inputs=INPUTS,
    outputs=OUTPUTS,
    rates=RATES,
    compute=compute,
    advise=advise,
)


SHAKING = "shaking_estimate"

SHAKING_OUTPUTS = (
    Output(
        SHAKING, "length",
        "acceleration analogue of the links' common centre of mass: shaking force over moving mass and square of the "
        "crank speed, if the links are slender rods of one mass per length",
    ),
    *(
        Output(f"{SHAKING}_{axis}", "length", f"{axis} of the shaking estimate, fixed axes")
        for axis in "xyz"
    ),
)  # fmt: skip
_SHAKING_NAMES = tuple(o.name for o in SHAKING_OUTPUTS)


def compute_shaking(scene: Scene, wanted: frozenset[str]) -> Columns:
    """Compute magnitude and components at every pose; in a chain with respect to the crank angle of stage 1."""
    first, second = scene.rates or (np.ones(scene.shape), np.zeros(scene.shape))
    rates = np.ascontiguousarray(first), np.ascontiguousarray(second)
    return filled_each(centre_acceleration, (*scene.records, *rates), _SHAKING_NAMES, wanted, scene.status())


SHAKING_EFFECT = Effect(
    **about("shaking"),
    outputs=SHAKING_OUTPUTS,
    compute=compute_shaking,
)
