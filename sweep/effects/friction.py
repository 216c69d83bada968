"""D2: joint reactions and driving torque with friction."""

from __future__ import annotations

import numpy as np

from kernels.effects.friction import friction_loads
from sweep.effects import loads
from sweep.effects.base import Advice, Effect, Scene, Status
from sweep.effects.kinetostatics import FORCES, by_construction, force_outputs, needed_vectors, vector_columns
from sweep.families.base import Columns, Output, Parameter, optional_outputs

EQUATION = "D2 (1)-(3)"
FORMULAS = (
    "(1) ball joints: E = -mu r |R| w/|w|, w the speed of the coupler relative to crank or rocker",
    "(2) shafts: t = -sign(speed) mu [r (F1 + F2) + r_t |F_axial|], F1 and F2 the loads of the two supports",
    "(3) iterated until the couples change by less than 1e-14; L_ij = mu_i r_i |d R_i/d couple_j|,",
    "    rho(L) < 1 proves one solution",
)
SUFFIX = "_friction"

_JOINTS = {"a": "crank bearing", "b": "ball joint at B", "c": "ball joint at C", "d": "rocker bearing"}
# In the order of the columns that kernels.effects.friction takes.
DATA = (
    *(Parameter(f"mu_{j}", "ratio", f"coefficient of friction of the {text}") for j, text in _JOINTS.items()),
    *(Parameter(f"radius_{j}", "length", f"friction radius of the {text}") for j, text in _JOINTS.items()),
    Parameter("thrust_radius_a", "length", "mean thrust radius of the crank bearing", default=0.0),
    Parameter("thrust_radius_d", "length", "mean thrust radius of the rocker bearing", default=0.0),
    Parameter("support_a1", "length", "first support along the crank axis, from A"),
    Parameter("support_a2", "length", "second support along the crank axis, from A"),
    Parameter("support_d1", "length", "first support along the rocker axis, from D"),
    Parameter("support_d2", "length", "second support along the rocker axis, from D"),
)
DATA_NAMES = tuple(p.name for p in DATA)

_TEXT = ", friction included"
_SCALARS = {
    "finger_couple_friction": ("torque", "couple of the finger along n x w" + _TEXT),
    "drive_torque_friction": ("torque", "torque that drives the crank" + _TEXT),
    "shaft_torque_a": ("torque", "friction torque on the crank about its axis"),
    "shaft_torque_d": ("torque", "friction torque on the rocker about its axis"),
}
_COUPLES = {"ball_couple_b": "friction couple of the ball joint at B", "ball_couple_c": "the same at C"}
_SUPPORTS = ("load_support_a1", "load_support_a2", "load_support_d1", "load_support_d2")
OUTPUTS = (
    *force_outputs("rocker", SUFFIX, _TEXT, EQUATION),
    *(Output(name, unit, text, EQUATION) for name, (unit, text) in _SCALARS.items()),
    *(Output(name, "torque", f"magnitude: {text}", EQUATION) for name, text in _COUPLES.items()),
    *(Output(name, "force", f"radial load of the support {name[-2:]}" + _TEXT, EQUATION) for name in _SUPPORTS),
    Output("friction_passes", "1", "passes of the friction iteration", EQUATION),
    Output("friction_contraction", "1", "rho(L), bound of its rate; below 1 the solution is unique", EQUATION),
)


def compute(scene: Scene, wanted: frozenset[str]) -> Columns:
    """Wanted quantities with friction; status JAMMED where the iteration does not contract."""

    def run(part: Scene, finger: int) -> tuple[Columns, Status]:
        status = part.status()
        shape = status.shape
        vectors = {name: np.empty((*shape, 3)) for name in needed_vectors(wanted, SUFFIX)}
        scalars = {name: np.empty(shape) for name in _SCALARS if name in wanted}
        couples = {name: np.empty((*shape, 3)) for name in _COUPLES if name in wanted}
        supports = np.empty((*shape, 4)) if wanted & set(_SUPPORTS) else None
        passes, contraction = optional_outputs(("friction_passes", "friction_contraction"), wanted, shape)
        friction_loads(
            *part.records, part.table(loads.ROCKER.columns), part.table(DATA_NAMES), finger, status,
            *[
                *(vectors.get(name) for name in FORCES), *(scalars.get(name) for name in _SCALARS),
                *(couples.get(name) for name in _COUPLES), supports, passes, contraction,
            ],
        )  # fmt: skip
        columns = vector_columns(vectors, wanted, SUFFIX)
        columns |= scalars
        columns |= {name: np.sqrt(np.einsum("ijk,ijk->ij", x, x)) for name, x in couples.items()}
        if supports is not None:
            columns |= {name: supports[:, :, k] for k, name in enumerate(_SUPPORTS) if name in wanted}
        if passes is not None:
            columns["friction_passes"] = passes
        if contraction is not None:
            columns["friction_contraction"] = contraction
        return columns, status

    return by_construction(scene, run)


def advise(scene: Scene) -> Advice | None:
    """Largest bound of the contraction over the turn: it is the share by which friction changes the joint loads."""
    found = compute(scene, frozenset({"friction_contraction"}))
    turning = np.isfinite(found["friction_contraction"]).all(axis=1)
    if not turning.any():
        return None
    return Advice("largest contraction rho(L)", found["friction_contraction"][turning].max(axis=1), 0.01)


EFFECT = Effect(
    key="D2",
    name="friction",
    title="friction of ball joints and shafts by successive approximations",
    equation=EQUATION,
    formulas=FORMULAS,
    families=("rssr",),
    needs=("kinetostatics",),
    inputs=(*loads.ROCKER.parameters, *DATA),
    outputs=OUTPUTS,
    compute=compute,
    ns_per_pose=850.0,
    called_for="losses, drive sizing, a check against jamming; on samples, as it jumps where the rocker reverses",
    negligible="contraction rho(L) below 0.01: joint loads change by less than 1 %",
    advise=advise,
)
