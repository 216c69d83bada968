"""D1, D3: joint reactions, driving torque, reduced inertia, for a rocker and for a slider."""

from __future__ import annotations

import numpy as np

from kernels import status as st
from kernels.effects.kinetostatics import kinetostatics
from sweep.effects import loads
from sweep.effects.base import Advice, Effect, Scene, take_over
from sweep.effects.handed import LOADS, carried, on_output
from sweep.effects.handed import behind as handed_behind
from sweep.effects.tool import weighs
from sweep.families.base import Array, Columns, Output

KEY = LOADS
EQUATION = "D1 (1)-(4), D3 (5)-(7)"
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
    "(7) chain: the next stage turns by phi2 = kappa psi + offset, loads the rocker with -kappa drive_torque2 and adds",
    "    psi'^2 J2 to J",
)


def forces(follower: str) -> dict[str, str]:
    """Return the six vectors, in the order in which the kernel gives them."""
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
COUPLES = {
    "finger_couple": ("torque", "couple of the finger along n x w"),
    "drive_torque": ("torque", "torque that drives the crank, about its axis"),
}
INERTIAS = {
    "reduced_inertia": ("inertia", "inertia of all links, of later stages too, reduced to the crank"),
    "dreduced_inertia": ("inertia", "derivative of the reduced inertia by the crank angle"),
}


def force_outputs(follower: str, suffix: str = "", text: str = "", equation: str = EQUATION) -> tuple[Output, ...]:
    """Return the magnitude and components of the six vectors, and the force and the moment on the frame."""
    found = []
    for name, meaning in forces(follower).items():
        unit = name.split("_")[0].replace("moment", "torque")
        found.append(Output(f"{name}{suffix}", unit, f"magnitude: {meaning}{text}", equation))
        found += [Output(f"{name}{suffix}_{axis}", unit, f"{axis}: {meaning}{text}", equation) for axis in "xyz"]
    found.append(Output(f"shaking_force{suffix}", "force", f"magnitude of the force on the frame{text}", equation))
    about = f"moment on the frame about the origin of the family's frame, drive torque included{text}"
    found.append(Output(f"shaking_moment{suffix}", "torque", f"magnitude: {about}", equation))
    found += [Output(f"shaking_moment{suffix}_{axis}", "torque", f"{axis}: {about}", equation) for axis in "xyz"]
    return tuple(found)


def _outputs(follower: str) -> tuple[Output, ...]:
    return (
        *force_outputs(follower),
        *(Output(name, unit, text, EQUATION) for name, (unit, text) in (COUPLES | INERTIAS).items()),
    )


def wanted_groups(wanted: frozenset[str], suffix: str = "") -> tuple[bool, bool, bool]:
    """Return whether any force or moment, any couple, any inertia is wanted: what is not is not compiled."""
    vectors = (
        f"{name}{suffix}{tail}"
        for name in (*FORCES, "shaking_force", "shaking_moment")
        for tail in ("", "_x", "_y", "_z")
    )
    couples, inertias = ({f"{name}{suffix}" for name in names} for names in (COUPLES, INERTIAS))
    return not wanted.isdisjoint(vectors), not wanted.isdisjoint(couples), not wanted.isdisjoint(inertias)


def vector_columns(
    forces: Array | None, records: tuple[Array, Array], wanted: frozenset[str], suffix: str = ""
) -> Columns:
    """Return the wanted magnitudes and components of the six vectors, (n, m, 18),
    and of force and moment on the frame.
    """
    columns: Columns = {}
    if forces is None:
        return columns
    for k, name in enumerate(FORCES):
        values = forces[:, :, 3 * k : 3 * k + 3]
        if f"{name}{suffix}" in wanted:
            columns[f"{name}{suffix}"] = magnitude(values)
        for at, axis in enumerate("xyz"):
            if f"{name}{suffix}_{axis}" in wanted:
                columns[f"{name}{suffix}_{axis}"] = values[:, :, at]
    if f"shaking_force{suffix}" in wanted:
        columns[f"shaking_force{suffix}"] = magnitude(forces[:, :, 0:3] + forces[:, :, 9:12])
    moment = f"shaking_moment{suffix}"
    if not wanted.isdisjoint((moment, *(f"{moment}_{axis}" for axis in "xyz"))):
        found = frame_moment(forces, records)
        columns |= {moment: magnitude(found)} | {f"{moment}_{axis}": found[:, :, k] for k, axis in enumerate("xyz")}
    return {name: values for name, values in columns.items() if name in wanted}


def frame_moment(forces: Array, records: tuple[Array, Array]) -> Array:
    """Return the moment of crank and follower on the frame about the origin of the family's frame, (n, m, 3).

    The moments of the bearings are about A, and about D or, where a slider moves, about C; each force adds its arm.
    """
    poses, designs = (joints[..., None, :] if joints.ndim == 2 else joints for joints in records)
    turns = designs[..., 16:17] == 1.0
    follower = np.where(turns, designs[..., 9:12], poses[..., 3:6])
    on_links = forces[:, :, 12:15] + np.cross(designs[..., 6:9], forces[:, :, 0:3])
    on_links += forces[:, :, 15:18] + np.cross(follower, forces[:, :, 9:12])
    moment: Array = -on_links
    return moment


def magnitude(vectors: Array) -> Array:
    """Return the length of vectors (n, m, 3)."""
    x, y, z = vectors[:, :, 0], vectors[:, :, 1], vectors[:, :, 2]
    length: Array = np.sqrt(x * x + y * y + z * z)
    return length


def drive(scene: Scene, handed_back: Columns | None, name: str = "drive_torque") -> Array:
    """Load of the follower, speed of the crank and its rate, (n, m or 1, 3), as the kernels of loads take them.

    In a chain the crank turns as the stage before drives it, and the next stage's driving torque, column ``name`` of
    ``handed_back``, acts on the rocker besides its own load.
    """
    speed, change = scene.crank()
    load = on_output(scene, scene.load(loads.follower(scene).load.name), handed_back, name)
    return np.stack(np.broadcast_arrays(load, speed, change), axis=2)


def bodies(scene: Scene) -> Array:
    """Return masses, centres, inertias and gravity in the order of the kernels."""
    return scene.table(loads.follower(scene).bodies)


def behind(scene: Scene) -> Columns | None:
    """Return the driving torque, reduced inertia and status of the next stage; None at the end of the chain."""
    return handed_behind(scene, KEY, frozenset({"drive_torque", *INERTIAS}))


def compute(scene: Scene, wanted: frozenset[str]) -> Columns:
    """Return the wanted reactions and inertias; a group none of whose outputs is wanted is not compiled."""
    status, handed_back = scene.status(), behind(scene)
    sizes = zip((18, 2, 2), wanted_groups(wanted), strict=True)
    forces, couples, inertia = (np.empty((*scene.shape, size)) if asked else None for size, asked in sizes)
    load = drive(scene, handed_back)
    tool = weighs(scene, load, inertia is not None)
    kinetostatics(
        *scene.records, bodies(scene), load, scene.inputs["finger"], status, forces, couples, inertia, tool.coupler,
        tool.follower,
    )  # fmt: skip
    if inertia is not None and tool.inertia is not None:
        inertia += tool.inertia
    if handed_back is not None:
        take_over(status, handed_back["status"])
        if inertia is not None:
            inertia += carried(scene, handed_back)
    if forces is not None:
        scene.memo["forces"] = forces, status
    columns = vector_columns(forces, scene.records, wanted)
    for names, values in ((COUPLES, couples), (INERTIAS, inertia)):
        if values is not None:
            columns |= {name: values[:, :, k] for k, name in enumerate(names) if name in wanted}
    return columns | {"status": status}


def advise(scene: Scene) -> Advice | None:
    """Return the share of the largest force at C that inertia and weight make; 1 where there is no useful load."""
    load = loads.follower(scene).load.name
    whole = compute(scene, frozenset({"force_c"}))
    still = {name: np.zeros_like(x) if name.startswith(("m_", "j_")) else x for name, x in scene.inputs.items()}
    alone = Scene(scene.family, scene.designs, scene.angles, still, scene.after, scene.before, scene.curves)
    useful = compute(alone, frozenset({"force_c"}))
    turning = (whole["status"] == st.OK).all(axis=1)
    if not turning.any():
        return None
    most, static = (np.asarray(c["force_c"], np.float64)[turning].max(axis=1) for c in (whole, useful))
    share = np.abs(most - static) / np.where(most > 0.0, most, 1.0)
    return Advice(f"share of the largest force at C that is not due to {load}", share, 0.1)


def _effect(kind: loads.Follower) -> Effect:
    return Effect(
        key=KEY,
        name=f"{kind.prefix}kinetostatics",
        title=f"joint reactions of crank, coupler and {kind.name}, finger couple, driving torque, reduced inertia",
        equation=EQUATION,
        formulas=FORMULAS,
        followers=(kind.name,),
        needs=("coupler",),
        inputs=kind.parameters,
        tool_inputs=loads.TOOLS,
        outputs=_outputs(kind.name),
        compute=compute,
        called_for="joint loads, drive torque, shaking force, balancing",
        negligible="inertia and weight make less than 10 % of the joint load (low speed): then statics, pressure",
        takes_load=KEY,
        advise=advise,
    )


EFFECT = _effect(loads.ROCKER)
SLIDER = _effect(loads.SLIDER)
