"""P1 to P3: radial, axial and crank-side pressure angles; all extrema of the pressure angle in closed form."""

from __future__ import annotations

import numpy as np

from kernels.effects.pressure import directions, pressure_extrema
from kernels.types import Status
from sweep.effects.base import DesignResult, Effect, about, largest, no_poses
from sweep.effects.scene import Scene
from sweep.families.base import Accuracy, Array, Columns, Output
from sweep.families.capabilities import PressureEllipse
from sweep.families.poses import chosen, filled_each

OUTPUTS = (
    Output("t_tau", "1", "component of the coupler direction along the follower's motion, signed by the branch"),
    Output("t_rho", "1", "component of the coupler direction along the follower"),
    Output("t_k", "1", "component of the coupler direction along the follower's axis"),
    Output("theta1", "rad", "radial pressure angle at the follower, tan = radial/tangential; across the slide"),
    Output("theta2", "rad", "axial pressure angle at the follower, tan = axial/radial", kinks=True),
    Output("theta3", "rad", "axial pressure angle at the crank", kinks=True),
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
    **about("pressure"),
    outputs=OUTPUTS,
    compute=compute,
    advise=largest(compute, "t_k", "axial force", 0.05, "of the coupler force"),
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
    Output("pressure_extrema", "1", "number of extrema of the pressure angle, 0, 2 or 4", jumps=True),
    *(Output(name, "rad", text) for name, text in _ANGLES.items()),
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
    **about("pressure_extrema"),
    outputs=(),
    compute=no_poses,
    even_crank=True,
    requires=PressureEllipse,
    design_result=DesignResult(EXTREMA, extrema),
)
