"""D1-D3 in closed form: reactions, driving torque and friction of crank, coupler and a rocker or a slider.

A family needs :class:`sweep.families.capabilities.JointRecords` for this.  :mod:`sweep.effects.link_loads` computes the
same for any number of links, in three times the time without friction and 4.6 times with it.
"""

from __future__ import annotations

import numpy as np

from kernels.effects.friction import friction_loads
from kernels.effects.kinetostatics import BODY, Loading, kinetostatics
from kernels.types import Status
from sweep.effects import loads
from sweep.effects.loads import FRICTION_SUFFIX, FRICTION_TEXT, Named, together
from sweep.effects.scene import Scene, refuse
from sweep.effects.tool import weighs
from sweep.families.base import Array, Columns, Parameter
from sweep.families.poses import optional_outputs

COUPLES = {
    "finger_couple": ("torque", "couple of the finger along n x w"),
    "drive_torque": ("torque", "torque that drives the crank, about its axis"),
}
INERTIAS = {
    "reduced_inertia": ("inertia", "inertia of all links, of later stages too, reduced to the crank"),
    "dreduced_inertia": ("inertia", "derivative of the reduced inertia by the crank angle"),
}
COUPLES_WITH_FRICTION = {
    f"finger_couple{FRICTION_SUFFIX}": ("torque", "couple of the finger along n x w" + FRICTION_TEXT),
    f"drive_torque{FRICTION_SUFFIX}": ("torque", "torque that drives the crank" + FRICTION_TEXT),
}
CONTRACTION = "friction_contraction"


def joint_forces(follower: str, suffix: str = "", text: str = "") -> Named:
    """Six joint vectors in the order of the kernel, with unit and meaning."""
    about = "about D" if follower == "rocker" else "about C"
    found = {
        "force_a": ("force", "force of the frame on the crank"),
        "force_b": ("force", "force of the crank on the coupler"),
        "force_c": ("force", f"force of the coupler on the {follower}"),
        "force_d": ("force", f"force of the frame on the {follower}"),
        "moment_a": ("torque", "moment of the frame on the crank about A, drive torque included"),
        "moment_d": ("torque", f"moment of the frame on the {follower} {about}"),
    }
    return {f"{name}{suffix}": (unit, f"{words}{text}") for name, (unit, words) in found.items()}


FORCES = tuple(joint_forces("rocker"))


def vectors(follower: str, suffix: str = "", text: str = "") -> Named:
    """Vector outputs: the six of the joints, and force and moment on the frame."""
    return joint_forces(follower, suffix, text) | loads.frame(suffix, text)


_JOINTS = {"a": "crank bearing", "b": "ball joint at B", "c": "ball joint at C"}


def friction_inputs(kind: loads.Follower) -> tuple[Parameter, ...]:
    """Coefficients, radii and support positions of the four joints."""
    rocker = kind is loads.ROCKER
    joints = _JOINTS | {"d": f"{kind.name} bearing" if rocker else "slide"}
    along, place = ("rocker axis", "D") if rocker else ("slide, moving with the slider", "C")
    thrust = tuple(
        Parameter(
            f"thrust_radius_{j}", "length", f"mean thrust radius of the {joints[j]}", default=0.0, not_negative=True
        )
        for j in ("ad" if rocker else "a")
    )
    return (
        *(
            Parameter(f"mu_{j}", "ratio", f"coefficient of friction of the {text}", not_negative=True)
            for j, text in joints.items()
        ),
        *(
            Parameter(f"radius_{j}", "length", f"friction radius of the {text}", not_negative=True)
            for j, text in joints.items()
            if rocker or j != "d"
        ),
        *thrust,
        Parameter("support_a1", "length", "first support along the crank axis, from A"),
        Parameter("support_a2", "length", "second support along the crank axis, from A"),
        Parameter("support_d1", "length", f"first support along the {along}, from {place}"),
        Parameter("support_d2", "length", f"second support along the {along}, from {place}"),
    )


# In the order of the columns of kernels.effects.friction.Friction; a slide has an arm of 1 and no thrust.
_FRICTION_COLUMNS = tuple(p.name for p in friction_inputs(loads.ROCKER))
_OF_A_SLIDE = {"radius_d": 1.0, "thrust_radius_d": 0.0}


def losses(kind: loads.Follower) -> Named:
    """Losses in the order of the kernel, with unit and meaning."""
    follower = ("torque", "friction torque on the rocker about its axis")
    of_slide = {"slide_friction": ("force", "friction force on the slider")}
    found = {
        "shaft_torque_a": ("torque", "friction torque on the crank about its axis"),
        **({"shaft_torque_d": follower} if kind is loads.ROCKER else of_slide),
        "ball_couple_b": ("torque", "magnitude: friction couple of the ball joint at B"),
        "ball_couple_c": ("torque", "magnitude: friction couple of the ball joint at C"),
    }
    supports = ("load_support_a1", "load_support_a2", "load_support_d1", "load_support_d2")
    found |= {name: ("force", f"load across the axis of the support {name[-2:]}{FRICTION_TEXT}") for name in supports}
    return found | loads.PASSES


def load_name(scene: Scene) -> str:
    """Name of the useful load on the follower."""
    return loads.follower_of(scene.family).load.name


def force_name(scene: Scene) -> str:
    """Name of a force whose computation stores all reactions in the scene."""
    return "force_d"


def _loading(scene: Scene, load: Array, reduced: bool) -> tuple[Loading, Array | None]:
    """Bodies, loads, speed and tool for the kernels, and the reduced inertia of the tool if that is asked for."""
    drive = np.stack(np.broadcast_arrays(load, *scene.crank()), axis=2)
    tool = weighs(scene, drive, reduced)
    return Loading(_bodies(scene), drive, tool.coupler, tool.follower), tool.inertia


def _bodies(scene: Scene) -> Array:
    """Masses, centres, inertias and gravity in the order of the kernels."""
    follower = loads.follower_of(scene.family)
    found, ends = scene.table(follower.bodies), np.zeros((len(scene.designs), 3, 3))
    ends[:, :, 0] = scene.records[1][:, 12:15]
    for k, body in enumerate(follower.rods):
        is_rod, line_mass, gyration = (scene.inputs[f"{name}_{body}"] for name in loads.ROD)
        if is_rod.any():
            own = found[:, BODY * k : BODY * (k + 1)]
            loads.put_rod(own, is_rod, line_mass, gyration, np.zeros_like(ends[:, k]), ends[:, k])
    return found


def frictionless(scene: Scene, load: Array, wanted: frozenset[str], status: Status) -> Columns:
    """Compute the wanted reactions and inertias; a group without a wanted output is not compiled."""
    groups = loads.asked(FORCES, wanted), not wanted.isdisjoint(COUPLES), not wanted.isdisjoint(INERTIAS)
    sizes = zip((18, 2, 2), groups, strict=True)
    forces, couples, inertia = (np.empty((*scene.shape, size)) if asked else None for size, asked in sizes)
    on_frame = loads.frame_room(scene.shape, wanted)
    given, of_tool = _loading(scene, load, inertia is not None)
    kinetostatics(*scene.records, scene.inputs["finger"], given, status, forces, couples, inertia, *on_frame)
    if inertia is not None and of_tool is not None:
        inertia += of_tool
    if forces is not None:
        scene.memo["reactions"] = forces, status
    columns = _vector_columns(forces, wanted) | loads.frame_columns(on_frame, wanted)
    for names, values in ((COUPLES, couples), (INERTIAS, inertia)):
        columns |= loads.scalar_columns(names, values, wanted)
    return columns


def with_friction(scene: Scene, load: Array, wanted: frozenset[str], status: Status) -> Columns:
    """Compute the wanted quantities with friction; status JAMMED where the iteration does not contract."""
    refuse(status, together(scene, "a") | together(scene, "d"))
    lost = tuple(losses(loads.follower_of(scene.family)))
    sizes = (
        (18, loads.asked(joint_forces("", FRICTION_SUFFIX), wanted)),
        (2, not wanted.isdisjoint(COUPLES_WITH_FRICTION)),
        (len(lost), not wanted.isdisjoint(lost)),
    )
    forces, couples, lossy = (np.empty((*scene.shape, size)) if asked else None for size, asked in sizes)
    (contraction,) = optional_outputs((CONTRACTION,), wanted, scene.shape)
    data = np.column_stack(
        [
            scene.inputs.get(name, np.full(len(scene.designs), _OF_A_SLIDE.get(name, np.nan)))
            for name in _FRICTION_COLUMNS
        ]
    )
    given, _ = _loading(scene, load, False)
    friction_loads(*scene.records, scene.inputs["finger"], given, data, status, forces, couples, lossy, contraction)
    columns = _vector_columns(forces, wanted, FRICTION_SUFFIX)
    on_frame = loads.frame_room(scene.shape, wanted, FRICTION_SUFFIX)
    if any(part is not None for part in on_frame):  # friction does not change them
        kinetostatics(*scene.records, scene.inputs["finger"], given, status, None, None, None, *on_frame)
    columns |= loads.frame_columns(on_frame, wanted, FRICTION_SUFFIX)
    for names, values in ((tuple(COUPLES_WITH_FRICTION), couples), (lost, lossy)):
        columns |= loads.scalar_columns(names, values, wanted)
    return columns if contraction is None else columns | {CONTRACTION: contraction}


def _vector_columns(forces: Array | None, wanted: frozenset[str], suffix: str = "") -> Columns:
    """Extract the wanted magnitudes and components of the six vectors, (n, m, 18)."""
    if forces is None:
        return {}
    found = {f"{name}{suffix}": forces[:, :, 3 * k : 3 * k + 3] for k, name in enumerate(FORCES)}
    return loads.vector_columns(found, wanted)
