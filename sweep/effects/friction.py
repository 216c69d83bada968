"""D2: joint reactions and driving torque with friction."""

from __future__ import annotations

import numpy as np

from kernels.effects.friction import friction_loads
from sweep.effects import loads
from sweep.effects.base import Effect, Rows, Scene, Status
from sweep.effects.kinetostatics import FORCES, by_construction, force_outputs, needed_vectors, vector_columns
from sweep.families.base import Columns, Output, Parameter

EQUATION = "dynamics sheet 2.1"
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
    *force_outputs(SUFFIX, _TEXT),
    *(Output(name, unit, text, EQUATION) for name, (unit, text) in _SCALARS.items()),
    *(Output(name, "torque", f"magnitude: {text}", EQUATION) for name, text in _COUPLES.items()),
    *(Output(name, "force", f"radial load of the support {name[-2:]}" + _TEXT, EQUATION) for name in _SUPPORTS),
    Output("friction_passes", "1", "passes of the friction iteration", EQUATION),
)


def compute(scene: Scene, wanted: frozenset[str]) -> Columns:
    """Wanted quantities with friction; status JAMMED where the iteration does not contract."""

    def run(rows: Rows, finger: int) -> tuple[Columns, Status]:
        per_pose, per_design = (np.ascontiguousarray(record[rows]) for record in scene.records)
        status = np.ascontiguousarray(scene.status()[rows])
        shape = status.shape
        vectors = {name: np.empty((*shape, 3)) for name in needed_vectors(wanted, SUFFIX)}
        scalars = {name: np.empty(shape) for name in _SCALARS if name in wanted}
        couples = {name: np.empty((*shape, 3)) for name in _COUPLES if name in wanted}
        supports = np.empty((*shape, 4)) if wanted & set(_SUPPORTS) else None
        passes = np.empty(shape) if "friction_passes" in wanted else None
        friction_loads(
            per_pose, per_design, scene.table(loads.LOAD_NAMES)[rows], scene.table(DATA_NAMES)[rows], finger, status,
            *[
                *(vectors.get(name) for name in FORCES), *(scalars.get(name) for name in _SCALARS),
                *(couples.get(name) for name in _COUPLES), supports, passes,
            ],
        )  # fmt: skip
        columns = vector_columns(vectors, wanted, SUFFIX)
        columns |= scalars
        columns |= {name: np.sqrt(np.einsum("ijk,ijk->ij", x, x)) for name, x in couples.items()}
        if supports is not None:
            columns |= {name: supports[:, :, k] for k, name in enumerate(_SUPPORTS) if name in wanted}
        if passes is not None:
            columns["friction_passes"] = passes
        return columns, status

    return by_construction(scene, run)


EFFECT = Effect(
    key="D2",
    name="friction",
    title="friction of ball joints and shafts by successive approximations",
    equation=EQUATION,
    families=("rssr",),
    needs=("kinetostatics",),
    inputs=(*loads.INPUTS, *DATA),
    outputs=OUTPUTS,
    compute=compute,
    ns_per_pose=2500.0,
    called_for="losses, drive sizing, a check against jamming",
    negligible="couples below 1 % of the joint loads' moments (contraction below 0.01)",
)
