"""P2, P3: radial, axial and crank-side pressure angles."""

from __future__ import annotations

import numpy as np

from kernels import status as st
from kernels.effects.pressure import directions
from sweep.effects.base import Advice, Effect, Scene
from sweep.families.base import Columns, Output, optional_outputs

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
    Output("theta2", "rad", "axial pressure angle at the follower, tan = axial/radial", EQUATION),
    Output("theta3", "rad", "axial pressure angle at the crank", EQUATION),
)
_NAMES = tuple(o.name for o in OUTPUTS)


def advise(scene: Scene) -> Advice | None:
    """Largest axial share of the coupler direction."""
    found = compute(scene, frozenset({"t_k"}))
    turning = (found["status"] == st.OK).all(axis=1)
    if not turning.any():
        return None
    return Advice("largest axial component of the coupler direction", np.abs(found["t_k"][turning]).max(axis=1), 0.05)


def compute(scene: Scene, wanted: frozenset[str]) -> Columns:
    """Wanted directions and angles of every pose."""
    status = scene.status()
    outputs = optional_outputs(_NAMES, wanted, scene.shape)
    per_pose, per_design = scene.records
    directions(per_pose, per_design, status, *[*outputs, None, None, None])
    found: Columns = {name: out for name, out in zip(_NAMES, outputs, strict=True) if out is not None}
    return found | {"status": status}


def bearing_directions(scene: Scene) -> tuple[np.ndarray, ...]:
    """cos(theta1), sin(theta1), sin(theta1) tan(theta2) and status: what the bearing criteria take."""
    status = scene.status()
    cos1, sin1, axial = (np.empty(scene.shape) for _ in range(3))
    per_pose, per_design = scene.records
    directions(per_pose, per_design, status, None, None, None, None, None, None, cos1, sin1, axial)
    return cos1, sin1, axial, status


EFFECT = Effect(
    key="P2, P3",
    name="pressure",
    title="direction of the coupler force: radial, axial and crank-side pressure angles",
    equation=EQUATION,
    formulas=FORMULAS,
    families=("rssr", "rssp"),
    needs=(),
    inputs=(),
    outputs=OUTPUTS,
    compute=compute,
    ns_per_pose=40.0,
    called_for="choice of the follower's and the crank's bearings",
    negligible="axial component of the coupler direction below 0.05 (planar linkage: theta2 = theta3 = 0)",
    advise=advise,
)
