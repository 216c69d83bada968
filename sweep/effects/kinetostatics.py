"""D1, D3: joint reactions, driving torque, reduced inertia."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from kernels.effects.kinetostatics import kinetostatics
from sweep.effects import loads
from sweep.effects.base import Effect, Rows, Scene, Status
from sweep.families.base import Array, Columns, Output

FORCES = {
    "force_a": "force of the frame on the crank",
    "force_b": "force of the crank on the coupler",
    "force_c": "force of the coupler on the rocker",
    "force_d": "force of the frame on the rocker",
    "moment_a": "moment of the frame on the crank about A, drive torque included",
    "moment_d": "moment of the frame on the rocker about D",
}
SCALARS = {
    "finger_couple": ("torque", "couple of the finger along n x w"),
    "drive_torque": ("torque", "torque that drives the crank, about its axis"),
    "reduced_inertia": ("inertia", "inertia of all links reduced to the crank"),
    "dreduced_inertia": ("inertia", "derivative of the reduced inertia by the crank angle"),
}
EQUATION = "dynamics sheet 2, 3"


def force_outputs(suffix: str = "", text: str = "") -> tuple[Output, ...]:
    """Magnitude and components of the six vectors."""
    found = []
    for name, meaning in FORCES.items():
        unit = name.split("_")[0].replace("moment", "torque")
        found.append(Output(f"{name}{suffix}", unit, f"magnitude: {meaning}{text}", EQUATION))
        found += [Output(f"{name}{suffix}_{axis}", unit, f"{axis}: {meaning}{text}", EQUATION) for axis in "xyz"]
    shaking = Output(f"shaking_force{suffix}", "force", f"magnitude of the force on the frame{text}", EQUATION)
    return (*found, shaking)


OUTPUTS = (*force_outputs(), *(Output(name, unit, text, EQUATION) for name, (unit, text) in SCALARS.items()))


def needed_vectors(wanted: frozenset[str], suffix: str = "") -> list[str]:
    """Which of the six vectors some wanted output is made of."""
    shaking = {"force_a", "force_d"} if f"shaking_force{suffix}" in wanted else set()
    return [
        name
        for name in FORCES
        if name in shaking or any(w in wanted for w in (f"{name}{suffix}", *(f"{name}{suffix}_{x}" for x in "xyz")))
    ]


def vector_columns(vectors: dict[str, Array], wanted: frozenset[str], suffix: str = "") -> Columns:
    """Wanted magnitudes and components of the computed vectors."""
    columns: Columns = {}
    for name, values in vectors.items():
        if f"{name}{suffix}" in wanted:
            columns[f"{name}{suffix}"] = np.sqrt(np.einsum("ijk,ijk->ij", values, values))
        for k, axis in enumerate("xyz"):
            if f"{name}{suffix}_{axis}" in wanted:
                columns[f"{name}{suffix}_{axis}"] = values[:, :, k]
    if f"shaking_force{suffix}" in wanted:
        total = vectors["force_a"] + vectors["force_d"]
        columns[f"shaking_force{suffix}"] = np.sqrt(np.einsum("ijk,ijk->ij", total, total))
    return columns


def by_construction(scene: Scene, run: Callable[[Rows, int], tuple[Columns, Status]]) -> Columns:
    """Run ``run(rows, finger)`` for the designs of each finger construction and put the rows together."""
    columns: Columns = {}
    for finger in np.unique(scene.inputs["finger"]):
        rows = np.flatnonzero(scene.inputs["finger"] == finger)
        found, status = run(rows, int(finger))
        for name, values in (found | {"status": status}).items():
            columns.setdefault(name, np.empty((len(scene.designs), *values.shape[1:]), values.dtype))[rows] = values
    return columns


def compute(scene: Scene, wanted: frozenset[str]) -> Columns:
    """Wanted reactions and inertias; a vector none of whose outputs is wanted is not compiled."""

    def run(rows: Rows, finger: int) -> tuple[Columns, Status]:
        per_pose, per_design = (np.ascontiguousarray(record[rows]) for record in scene.records)
        status = np.ascontiguousarray(scene.status()[rows])
        vectors = {name: np.empty((*status.shape, 3)) for name in needed_vectors(wanted)}
        scalars = {name: np.empty(status.shape) for name in SCALARS if name in wanted}
        kinetostatics(
            per_pose, per_design, scene.table(loads.LOAD_NAMES)[rows], finger, status,
            *[vectors.get(name) for name in FORCES], *[scalars.get(name) for name in SCALARS],
        )  # fmt: skip
        return vector_columns(vectors, wanted) | dict(scalars), status

    return by_construction(scene, run)


EFFECT = Effect(
    key="D1, D3",
    name="kinetostatics",
    title="joint reactions, finger couple, driving torque, reduced inertia",
    equation=EQUATION,
    families=("rssr",),
    needs=("coupler",),
    inputs=loads.INPUTS,
    outputs=OUTPUTS,
    compute=compute,
    ns_per_pose=250.0,
    called_for="joint loads, drive torque, shaking force, balancing",
    negligible="inertia loads much below the useful load (low speed): then statics, pressure angles",
)
