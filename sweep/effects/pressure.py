"""P1 to P3: radial, axial and crank-side pressure angles; all extrema of the pressure angle in closed form."""

from __future__ import annotations

import numpy as np

from kernels.effects.pressure import directions, pressure_extrema
from kernels.types import Status
from sweep.effects.base import DesignResult, Effect, largest, no_poses
from sweep.effects.scene import Scene
from sweep.families.base import Accuracy, Array, Columns, Output
from sweep.families.capabilities import PressureEllipse
from sweep.families.poses import chosen, filled_each

EQUATION = "P2, P3 (1)-(3)"
FORMULAS = (
    "(1) s = (C - B)/b; t_tau = s . tau = branch cos(pressure angle), t_rho = s . rho, t_k = s . k",
    "(2) tan theta1 = |t_rho/t_tau|, tan theta2 = t_k/t_rho",
    "(3) tan theta3 = (s . u)/(s . rho_B)",
)

OUTPUTS = (
    Output(
        "t_tau", "1", "component of the coupler direction along the follower's motion, signed by the branch", EQUATION
    ),
    Output("t_rho", "1", "component of the coupler direction along the follower", EQUATION),
    Output("t_k", "1", "component of the coupler direction along the follower's axis", EQUATION),
    Output(
        "theta1", "rad", "radial pressure angle at the follower, tan = radial/tangential; across the slide", EQUATION
    ),
    Output("theta2", "rad", "axial pressure angle at the follower, tan = axial/radial", EQUATION, kinks=True),
    Output("theta3", "rad", "axial pressure angle at the crank", EQUATION, kinks=True),
)
_NAMES = tuple(o.name for o in OUTPUTS)


def compute(scene: Scene, wanted: frozenset[str]) -> Columns:
    """Compute the wanted directions and angles of every pose."""
    return filled_each(directions, scene.records, _NAMES, wanted, scene.status())


def components(scene: Scene) -> tuple[tuple[Array, ...], Status]:
    """Components t_tau, t_rho and t_k for the bearing criteria, and a copy of the status."""
    if "direction" not in scene.memo:
        scene.memo["direction"] = compute(scene, frozenset({"t_tau", "t_rho", "t_k"}))
    found = scene.memo["direction"]
    return tuple(found[name] for name in ("t_tau", "t_rho", "t_k")), found["status"].copy()


EFFECT = Effect(
    key="P2, P3",
    name="pressure",
    title="direction of the coupler force: radial, axial and crank-side pressure angles",
    equation=EQUATION,
    formulas=FORMULAS,
    outputs=OUTPUTS,
    compute=compute,
    called_for="choice of the follower's and the crank's bearings",
    negligible="axial component of the coupler direction below 0.05 (planar linkage: theta2 = theta3 = 0)",
    advise=largest(compute, "t_k", "axial force", 0.05, "of the coupler force"),
)


EXTREMA_EQUATION = "P1 (1)-(3)"
EXTREMA_FORMULAS = (
    "(1) sin^2(pressure angle) = t_rho^2 + t_k^2, both of first degree in cos phi,",
    "    sin phi: r0 + rc cos + rs sin, k0 + kc cos + ks sin",
    "(2) half its derivative a1 cos phi + b1 sin phi + a2 cos 2phi + b2 sin 2phi = 0, a1 = r0 rs + k0 ks,",
    "    b1 = -(r0 rc + k0 kc), a2 = rc rs + kc ks, b2 = (rs^2 - rc^2 + ks^2 - kc^2)/2",
    "(3) four zeros if |u|^(2/3) + |v|^(2/3) < (2W)^(2/3), W = hypot(a2, b2), d = atan2(-a2, b2)/2,",
    "    u = a1 cos d + b1 sin d, v = b1 cos d - a1 sin d; else two",
)

_ANGLES = {
    "pressure_max": "largest pressure angle over the turn",
    "phi_pressure_max": "crank angle of the largest pressure angle",
    "pressure_max2": "pressure angle at the other maximum; the largest again where there is one",
    "phi_pressure_max2": "crank angle of the other maximum",
    "pressure_min": "smallest pressure angle over the turn",
    "phi_pressure_min": "crank angle of the smallest pressure angle",
    "pressure_min2": "pressure angle at the other minimum; the smallest again where there is one",
    "phi_pressure_min2": "crank angle of the other minimum",
}
EXTREMA = (
    Output("pressure_extrema", "1", "number of extrema of the pressure angle, 0, 2 or 4", EXTREMA_EQUATION, jumps=True),
    *(Output(name, "rad", text, EXTREMA_EQUATION) for name, text in _ANGLES.items()),
)
# Accepted error for pressure angles below 89 degrees: rounding of the components through the arcsine.
EXTREMA_ERROR = 1e-14


def extrema(scene: Scene, wanted: frozenset[str], accuracy: Accuracy) -> Columns:
    """Compute the wanted extrema and the status, each (n,)."""
    ellipse, n = scene.family.the(PressureEllipse), len(scene.designs)
    status, count = np.empty(n, np.uint8), np.empty(n)
    phi, theta, highest, lowest = (np.empty((n, 4)) for _ in range(4))
    pressure_extrema(ellipse.curve(scene.designs), status, count, phi, theta, highest, lowest)
    columns: Columns = {"pressure_extrema": count, "err_pressure_extrema": 0.0 * count}
    for name, values in zip(_ANGLES, np.hstack([highest, lowest]).T, strict=True):
        columns |= {name: values, f"err_{name}": EXTREMA_ERROR / np.cos(highest[:, 0])}
    return chosen(columns, wanted, status)


EXTREMA_EFFECT = Effect(
    key="P1",
    name="pressure_extrema",
    title="all extrema of the pressure angle over the turn, in closed form",
    equation=EXTREMA_EQUATION,
    formulas=EXTREMA_FORMULAS,
    outputs=(),
    compute=no_poses,
    called_for="transmission constraints that need more than the largest pressure angle (margin, max_pressure_angle)",
    negligible="never as a guard near dead points; the largest angle alone is cheaper from the margin",
    even_crank=True,
    requires=PressureEllipse,
    design_result=DesignResult(EXTREMA, extrema),
)
