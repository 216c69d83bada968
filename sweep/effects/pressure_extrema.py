"""P1: every extremum of the pressure angle over the turn, in closed form."""

from __future__ import annotations

import numpy as np

from kernels.effects.pressure_extrema import pressure_extrema
from sweep.effects.base import DesignResult, Effect, Scene, no_poses
from sweep.effects.turn import chosen
from sweep.families.base import Accuracy, Columns, Output
from sweep.families.capabilities import PressureEllipse

EQUATION = "P1 (1)-(3)"
FORMULAS = (
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
OUTPUTS = (
    Output("pressure_extrema", "1", "number of extrema of the pressure angle, 0, 2 or 4", EQUATION, jumps=True),
    *(Output(name, "rad", text, EQUATION) for name, text in _ANGLES.items()),
)
# Accepted for pressure angles below 89 degrees: rounding of the components through the arcsine.
ERROR = 1e-14


def extrema(scene: Scene, wanted: frozenset[str], accuracy: Accuracy) -> Columns:
    """Return the wanted extrema and status, each (n,)."""
    ellipse = scene.family.find(PressureEllipse)
    if ellipse is None:
        raise TypeError(f"{scene.family.name} has no ellipse of the coupler direction")
    n = len(scene.designs)
    status, count = np.empty(n, np.uint8), np.empty(n)
    phi, theta, highest, lowest = (np.empty((n, 4)) for _ in range(4))
    pressure_extrema(ellipse.curve(scene.designs), status, count, phi, theta, highest, lowest)
    columns: Columns = {"pressure_extrema": count, "err_pressure_extrema": 0.0 * count}
    for name, values in zip(_ANGLES, np.hstack([highest, lowest]).T, strict=True):
        columns |= {name: values, f"err_{name}": ERROR / np.cos(highest[:, 0])}
    return chosen(columns, wanted, status)


EFFECT = Effect(
    key="P1",
    name="pressure_extrema",
    title="all extrema of the pressure angle over the turn, in closed form",
    equation=EQUATION,
    formulas=FORMULAS,
    needs=(),
    inputs=(),
    outputs=(),
    compute=no_poses,
    called_for="transmission constraints that need more than the largest pressure angle (margin, max_pressure_angle)",
    negligible="never as a guard near dead points; the largest angle alone is cheaper from the margin",
    even_crank=True,
    requires=PressureEllipse,
    design_result=DesignResult(OUTPUTS, extrema),
)
