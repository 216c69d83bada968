"""A simulation model for MuJoCo: crank, coupler and follower, with a ``connect`` constraint that closes the loop.

The coupler is attached to the link that carries its finger by the two axes of that universal joint, so that its spin is
that of the kernels; at the other end a ball, the constraint, holds it.  Hinges are named like the links, so that a
position of ``crank`` is phi, one of ``rocker`` psi, one of ``slider`` s.  Lengths are metres, masses kilograms.
"""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from sweep.effects.loads import body_inputs, put_rod
from sweep.effects.scene import Scene
from sweep.errors import InputError
from sweep.evaluation.joints import Part
from sweep.evaluation.poses import evaluate
from sweep.exchange.scene import extent, shown_name
from sweep.families import names
from sweep.families.base import Angles, Array, Family
from sweep.families.capabilities import JointRecords
from sweep.families.machines.machine import Machine
from sweep.families.sites import TIP
from sweep.pages import rendered

METRES = {"mm": 1e-3, "m": 1.0}
LEAST = "2e-15"  # kg, kg m^2: MuJoCo refuses 1e-15 or less, as bars of a mechanism below some 10 mm have
THICK = 0.008  # thickness of a bar, relative to the extent of all joints
DRIVING = 1.0  # the finger is at the crank's end of the coupler


def write_mjcf(family: Family, placed: list[Part], design: Mapping[str, float], path: Path, unit: str) -> None:
    """Write the model in its first pose; templates/mjcf.xml is its text.

    Bodies get the masses, centres and inertias (``m_crank``, ``com_crank_x``, ``j_crank_xx`` ...) of the design,
    otherwise those of steel bars.  Stages of a chain are coupled at their common shaft, members of a machine to the
    first one.

    Raises
    ------
    InputError
        for a stage without crank, coupler and rocker or slider, or a mass without inertia.
    """
    thick = THICK * extent(placed) * METRES[unit]
    stages = []
    for k, part in enumerate(placed):
        before = placed[k - 1] if k else None
        columns = _of_member(design, part.member)
        shaft: tuple[str, float] | None = None  # the joint that turns this stage's crank, and their ratio
        if before is not None and before.member == part.member:
            shaft = f"rocker{_tag(before)}", columns.get(f"kappa{part.stage}", 1.0)
        elif before is not None and isinstance(family, Machine):
            shaft = _driver(family, part.member, f"crank{_tag(placed[0])}")
        stages.append(_stage(part, columns, unit, 4.0 * thick) | {"shaft": shaft})
    text = rendered("mjcf.xml", name=family.name, stages=stages, thick=thick, least=LEAST, words=words)
    path.write_text(text, encoding="utf-8")


def _tag(part: Part) -> str:
    """Return the suffix of a stage's names: member and number, each after a space."""
    return "".join(f" {word}" for word in (part.member, part.stage) if word)


def _of_member(design: Mapping[str, float], member: str) -> dict[str, float]:
    """Return the columns of one member without its name, or for a family all columns."""
    head = f"{member}." if member else ""
    return {name.removeprefix(head): float(value) for name, value in design.items() if name.startswith(head)}


def _driver(machine: Machine, name: str, first: str) -> tuple[str, float]:
    """Return the joint that drives a member's crank, and their ratio; ``first`` is the crank of the first member."""
    members = {member.name: member for member in machine.members}
    member = members[name]
    if member.driver is None:
        return first, member.ratio / machine.members[0].ratio
    # In the supported families the angle that drives another member is that of a rocker.
    other, output = member.driver
    return " ".join(word for word in ("rocker", other, names.parts(output).stage) if word), float(member.ratio)


def _loop(part: Part, finger: float, metres: float) -> tuple[list[Array], list[Array], Array, str]:
    """Return a stage in its first pose, from its joint records.

    Returns
    -------
    joints A, B, C, D [m], D is C on a slider; axes of crank, coupler and follower, (3, 3) each, x along the link and z
    along its axis; rotation from the frame of the family's forces to that of its joints; "rocker" or "slider"
    """
    records = part.family.find(JointRecords)
    if records is None:
        allowed = "a family or chain of linkages with crank, coupler and rocker or slider"
        raise InputError("format", f"mjcf of {part.label}", allowed, "export")
    matrix, angles = part.design[None, :], Angles.of(part.crank[None, :1])
    poses, designs = Scene(part.family, matrix, angles, {}).records
    pose, record = poses[0, 0], designs[0]
    # as kernels/linkage/joints.py writes them: B C s rho_b tau_b rho tau per pose, u k A D per design
    s, rho_b, tau_b, rho, tau = (pose[k : k + 3] for k in (6, 9, 12, 15, 18))
    u, k, center, d = (record[n : n + 3] for n in (0, 3, 6, 9))
    finger_axes = evaluate(
        part.family, part.parameters | {"finger": finger}, ["n_x", "n_y", "n_z"], phi=part.crank[:1], angles="rad"
    )
    n = finger_axes[["n_x", "n_y", "n_z"]].to_numpy(np.float64)[0]
    # The records start at the crank's axis, the joints in the frame of the family.
    crank = np.column_stack([rho_b, tau_b, u])
    turn = _triad(part.joints["b"][0] - part.joints["a"][0], part.axes["a"]) @ crank.T
    points = (center, pose[0:3], pose[3:6], pose[3:6] if records.follower == "slider" else d)
    joints = [(turn @ (point - center) + part.joints["a"][0] + part.shift) * metres for point in points]
    coupler, driven = np.column_stack([s, np.cross(n, s), n]), np.column_stack([rho, tau, k])
    return joints, [turn @ crank, turn @ coupler, turn @ driven], turn, records.follower


def _triad(along: Array, axis: Array) -> Array:
    """Return the columns x along a link, y across it, z its axis."""
    x = along / np.linalg.norm(along)
    return np.column_stack([x, np.cross(axis, x), axis])


def _stage(part: Part, design: Mapping[str, float], unit: str, slider: float) -> dict[str, Any]:
    """Return a stage as the template writes it: crank, coupler and follower, each a body with its sites.

    The coupler is on the body that carries its finger; ``slider`` is the length of one that is drawn [m].
    """
    metres, finger = METRES[unit], design.get(f"finger{part.stage}", 0.0)
    (a, b, c, d), (crank, coupler, driven), turn, follower = _loop(part, finger, metres)
    driving = finger == DRIVING
    origin, axes = (a, crank) if driving else (d, driven)
    position = float(part.position[0])
    if follower == "slider":
        position *= metres
    elif not part.family.pose_output[part.family.position].wraps:
        position = float(np.arctan2(*(c - d)[[1, 0]]))  # the guide's position is that of its point
    frames = {"crank": (a, crank), "coupler": (b, coupler), follower: (d, driven)}
    sites: dict[str, dict[str, Array]] = {name: {} for name in (*frames, "")}
    for joint, path in part.joints.items():
        link = next((link.name for link in part.links if joint in link.joints), follower if joint == TIP else "")
        body = link if link in frames else ""
        at, frame = frames.get(body, (np.zeros(3), np.eye(3)))
        sites[body][shown_name(joint)] = frame.T @ ((path[0] + part.shift) * metres - at)
    lengths = [float(np.linalg.norm(end)) for end in (b - a, c - b, c - d)]
    frames["coupler"] = axes.T @ (b - origin), axes.T @ coupler
    bodies = {}
    for (name, (at, frame)), size in zip(frames.items(), lengths, strict=True):
        length = slider if name == "slider" else size
        masses = inertial(design, name, part.stage, unit, length) if f"m_{name}{part.stage}" in design else None
        bodies[name] = {
            "name": name,
            "at": at,
            "axes": frame,
            "length": length,
            "inertial": masses,
            "sites": sites[name],
        }
    return {
        "tag": _tag(part), "driving": driving, "phi": float(part.crank[0]), "position": position, "sites": sites[""],
        "crank": bodies["crank"], "coupler": bodies["coupler"], "driven": bodies[follower],
        "hinge": 0.0 if driving else lengths[1], "cross": coupler.T @ (crank[:, 2] if driving else driven[:, 0]),
        "gravity": turn @ np.array([design.get(f"gravity_{axis}{part.stage}", 0.0) for axis in "xyz"]) * metres,
    }  # fmt: skip


def words(values: Array) -> str:
    """Return numbers in MuJoCo's format, to the last bit."""
    return " ".join(repr(float(x)) for x in np.ravel(values))


KILOGRAMS = {"mm": 1e3, "m": 1.0}  # masses of designs in mm are tonnes, as N and s want
SPARE = 2.0  # factor on the least possible value of moments that do not matter
THIN = 1e-6  # moment of a slender coupler along itself, relative to that across: MuJoCo takes no zero


def _own(design: Mapping[str, float], name: str, stage: str, length: float) -> tuple[float, Array, Array]:
    """Return mass, centre and moments of a body in the design's units; a rod's follow from its length, as in loads."""
    mass, *others = (p.name for p in body_inputs(name, ""))
    columns = np.array([[float(design.get(f"{key}{stage}", 0.0)) for key in (mass, *others)]])
    is_rod = design.get(f"rod_{name}{stage}", not any(f"{key}{stage}" in design for key in others))
    if name != "slider" and is_rod:
        switch, line_mass, gyration = (
            np.array([x])
            for x in (1.0, *(float(design.get(f"{key}_{name}{stage}", 0.0)) for key in ("line_mass", "gyration")))
        )
        put_rod(columns, switch, line_mass, gyration, np.zeros((1, 3)), np.array([[length, 0.0, 0.0]]))
        columns[0, 4] = max(columns[0, 4], THIN * columns[0, 7])
    return float(columns[0, 0]), columns[0, 1:4], columns[0, 4:]


def inertial(design: Mapping[str, float], name: str, stage: str, unit: str, length: float) -> dict[str, Any]:
    """Return mass, centre and inertia of a body; ``length`` [m] is that between its joints.

    A body about a fixed axis rotates by its moment about that axis and its products with it alone, a slider does not
    rotate: entries that do not matter are chosen such that the tensor is physical.

    Raises
    ------
    InputError
        for a mass without the inertia that matters, or with an unphysical one.
    """
    kilograms, metres = KILOGRAMS[unit], METRES[unit]
    mass, centre, (xx, xy, xz, yy, yz, zz) = _own(design, name, stage, length / metres)
    if not mass > 0.0:
        raise InputError(f"m_{name}{stage}", mass, "a positive mass: MuJoCo moves none", "export")
    if name == "slider":
        xx = yy = zz = mass
        xy = xz = yz = 0.0
    elif name != "coupler" and zz > 0.0:
        xx = yy = SPARE * (zz + (xz * xz + yz * yz) / zz)
        xy = 0.0
    tensor = np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
    low, middle, high = np.linalg.eigvalsh(tensor)
    if not low > 0.0:
        allowed = "the inertias of a body: MuJoCo takes no mass without"
        raise InputError(f"j_{name}_xx{stage}", f"least moment {low:.3g}", allowed, "export")
    if high > (low + middle) * (1.0 + 1e-9):
        allowed = "moments of which none exceeds the sum of the others, as of any body"
        moments = f"principal moments {low:.3g}, {middle:.3g}, {high:.3g}"
        raise InputError(f"j_{name}_xx{stage}", moments, allowed, "export")
    scale = kilograms * metres**2
    tensor = np.array([xx, yy, zz, xy, xz, yz]) * scale
    return {"mass": mass * kilograms, "centre": centre * metres, "tensor": tensor}
