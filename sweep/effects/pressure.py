"""P2, P3: radial, axial and crank-side pressure angles."""

from __future__ import annotations

from functools import partial

from kernels.effects.pressure import directions
from sweep.effects.base import Effect, Scene, Status, largest
from sweep.families.base import Array, Columns, Output, filled

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


def compute(scene: Scene, wanted: frozenset[str]) -> Columns:
    """Return the wanted directions and angles of every pose."""
    return filled(directions, scene.records, _NAMES, wanted, scene.status())


def components(scene: Scene) -> tuple[tuple[Array, ...], Status]:
    """Return t_tau, t_rho and t_k, which the bearing criteria take, and a fresh status."""
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
    needs=(),
    inputs=(),
    outputs=OUTPUTS,
    compute=compute,
    called_for="choice of the follower's and the crank's bearings",
    negligible="axial component of the coupler direction below 0.05 (planar linkage: theta2 = theta3 = 0)",
    advise=partial(
        largest,
        compute=compute,
        name="t_k",
        quantity="largest axial component of the coupler direction",
        threshold=0.05,
    ),
)
