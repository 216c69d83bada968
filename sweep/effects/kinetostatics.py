"""D1, D3: joint reactions, driving torque, reduced inertia, for a rocker and for a slider."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial

import numpy as np

from kernels import status as st
from kernels.effects.kinetostatics import kinetostatics
from sweep.effects import loads
from sweep.effects.base import Advice, Effect, Scene, Status
from sweep.families.base import Array, Columns, Output

EQUATION = "D1 (1)-(4), D3 (5), (6)"
FORMULAS = (
    "(1) F_i = m_i (a_Gi - gravity), T_i = J_i eps_i + omega_i x J_i omega_i; Q = T2 + (d2 - b s) x F2; q = n x w",
    "(2) finger couple m = Q . s/(q . s); R_B = s x (Q - m q)/b + S s",
    "(3) S t_tau = K/c - (s x (Q - m q)/b - F2) . tau;",
    "    rocker: K = (T3 + d3 x F3) . k - load_torque (+ m q . k if driven);",
    "    slider: K/c becomes F3 . tau - load_force",
    "(4) R_C = R_B - F2; R_D = F3 - R_C; R_A = F1 + R_B; M_A = T1 + d1 x F1 + a rho_B x R_B (+ m q if driving);",
    "    drive_torque = M_A . u",
    "(5) J = J_A + m2 v2^2 + omega2 . J2 omega2 + J_D psi'^2 at unit crank speed (slider: m3 s'^2)",
    "(6) drive_torque = J eps + J' omega^2/2 - sum m_i gravity . v_Gi - load psi'",
)


def forces(follower: str) -> dict[str, str]:
    """The six vectors, in the order in which the kernel gives them."""
    about = "about D" if follower == "rocker" else "about C"
    return {
        "force_a": "force of the frame on the crank",
        "force_b": "force of the crank on the coupler",
        "force_c": f"force of the coupler on the {follower}",
        "force_d": f"force of the frame on the {follower}",
        "moment_a": "moment of the frame on the crank about A, drive torque included",
        "moment_d": f"moment of the frame on the {follower} {about}",
    }


FORCES = tuple(forces("rocker"))
SCALARS = {
    "finger_couple": ("torque", "couple of the finger along n x w"),
    "drive_torque": ("torque", "torque that drives the crank, about its axis"),
    "reduced_inertia": ("inertia", "inertia of all links reduced to the crank"),
    "dreduced_inertia": ("inertia", "derivative of the reduced inertia by the crank angle"),
}


def force_outputs(follower: str, suffix: str = "", text: str = "", equation: str = EQUATION) -> tuple[Output, ...]:
    """Magnitude and components of the six vectors, and the force on the frame."""
    found = []
    for name, meaning in forces(follower).items():
        unit = name.split("_")[0].replace("moment", "torque")
        found.append(Output(f"{name}{suffix}", unit, f"magnitude: {meaning}{text}", equation))
        found += [Output(f"{name}{suffix}_{axis}", unit, f"{axis}: {meaning}{text}", equation) for axis in "xyz"]
    shaking = Output(f"shaking_force{suffix}", "force", f"magnitude of the force on the frame{text}", equation)
    return (*found, shaking)


def _outputs(follower: str) -> tuple[Output, ...]:
    return (
        *force_outputs(follower),
        *(Output(name, unit, text, EQUATION) for name, (unit, text) in SCALARS.items()),
    )


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


def by_construction(scene: Scene, run: Callable[[Scene, int], tuple[Columns, Status]]) -> Columns:
    """Run ``run(scene, finger)`` for the designs of each finger construction and put the rows together."""
    columns: Columns = {}
    for finger in np.unique(scene.inputs["finger"]):
        rows = np.flatnonzero(scene.inputs["finger"] == finger)
        found, status = run(scene.only(rows), int(finger))
        found["status"] = status
        if rows.size == len(scene.designs):
            return found
        for name, values in found.items():
            columns.setdefault(name, np.empty((len(scene.designs), *values.shape[1:]), values.dtype))[rows] = values
    return columns


def compute(names: tuple[str, ...], scene: Scene, wanted: frozenset[str]) -> Columns:
    """Wanted reactions and inertias; a vector none of whose outputs is wanted is not compiled.

    ``names`` are the load inputs in the order of the kernel's columns.
    """

    def run(part: Scene, finger: int) -> tuple[Columns, Status]:
        status = part.status()
        vectors = {name: np.empty((*status.shape, 3)) for name in needed_vectors(wanted)}
        scalars = {name: np.empty(status.shape) for name in SCALARS if name in wanted}
        kinetostatics(
            *part.records, part.table(names), finger, status,
            *[vectors.get(name) for name in FORCES], *[scalars.get(name) for name in SCALARS],
        )  # fmt: skip
        return vector_columns(vectors, wanted) | dict(scalars), status

    return by_construction(scene, run)


def advise(names: tuple[str, ...], load: str, scene: Scene) -> Advice | None:
    """Share of the largest force at C that inertia and weight make; 1 where there is no useful load."""
    whole = compute(names, scene, frozenset({"force_c"}))
    still = {name: np.zeros_like(x) if name.startswith(("m_", "j_")) else x for name, x in scene.inputs.items()}
    useful = compute(names, Scene(scene.family, scene.designs, scene.angles, still), frozenset({"force_c"}))
    turning = (whole["status"] == st.OK).all(axis=1)
    if not turning.any():
        return None
    most, static = (np.asarray(c["force_c"], np.float64)[turning].max(axis=1) for c in (whole, useful))
    share = np.abs(most - static) / np.where(most > 0.0, most, 1.0)
    return Advice(f"share of the largest force at C that is not due to {load}", share, 0.1)


def _effect(name: str, follower: str, inputs: loads.LoadInputs) -> Effect:
    return Effect(
        key="D1, D3",
        name=name,
        title=f"joint reactions of crank, coupler and {follower}, finger couple, driving torque, reduced inertia",
        equation=EQUATION,
        formulas=FORMULAS,
        families=("rssr",) if follower == "rocker" else ("rssp",),
        needs=("coupler",),
        inputs=inputs.parameters,
        outputs=_outputs(follower),
        compute=partial(compute, inputs.columns),
        ns_per_pose=160.0,
        called_for="joint loads, drive torque, shaking force, balancing",
        negligible="inertia and weight make less than 10 % of the joint load (low speed): then statics, pressure",
        advise=partial(advise, inputs.columns, inputs.load),
    )


EFFECT = _effect("kinetostatics", "rocker", loads.ROCKER)
SLIDER = _effect("slider_kinetostatics", "slider", loads.SLIDER)
