"""A simulation model for MuJoCo: crank, coupler and follower, with a ``connect`` constraint that closes the loop.

The coupler is attached to the link that carries its finger by the two axes of that universal joint, so that its spin is
that of the kernels; at the other end a ball, the constraint, holds it.  Hinges are named like the links, so that a
position of ``crank`` is phi, one of ``rocker`` psi, one of ``slider`` s.  Lengths are metres, masses kilograms.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from xml.etree import ElementTree as Xml

import numpy as np

from sweep.effects.loads import body_inputs, put_rod
from sweep.effects.scene import Scene
from sweep.errors import InputError
from sweep.evaluation.joints import Part
from sweep.evaluation.poses import evaluate
from sweep.exchange.scene import PlacedPart, extent, shown_name
from sweep.families import names
from sweep.families.base import Angles, Array, Family
from sweep.families.capabilities import JointRecords
from sweep.families.machines.machine import Machine
from sweep.families.sites import TIP

METRES = {"mm": 1e-3, "m": 1.0}
LEAST = "2e-15"  # kg, kg m^2: MuJoCo refuses 1e-15 or less, as bars of a mechanism below some 10 mm have
THICK = 0.008  # thickness of a bar, relative to the extent of all joints
DRIVING = 1.0  # the finger is at the crank's end of the coupler


@dataclass(frozen=True)
class Loop:
    """One stage in its first pose: joints, and the bodies' axes as columns x, y, z, all in metres.

    Parameters
    ----------
    tag : suffix of names: member and number of the stage
    follower : "rocker" or "slider"
    A, B, C, D : joints; D is C on a slider
    crank, coupler, driven : axes of the bodies, (3, 3); x along the link, z along its axis
    finger : DRIVING or not
    turn : rotation from the frame of the family's forces and gravity to that of its joints
    shift : displacement of the stage beside others
    """

    tag: str
    follower: str
    A: Array
    B: Array
    C: Array
    D: Array
    crank: Array
    coupler: Array
    driven: Array
    finger: float
    turn: Array
    shift: Array


def write_mjcf(family: Family, placed: list[PlacedPart], design: Mapping[str, float], path: Path, unit: str) -> None:
    """Write the model in its first pose.

    Bodies get the masses, centres and inertias (``m_crank``, ``com_crank_x``, ``j_crank_xx`` ...) of the design,
    otherwise those of steel bars.  Stages of a chain are coupled at their common shaft, members of a machine to the
    first one.

    Raises
    ------
    InputError
        for a stage without crank, coupler and rocker or slider, or a mass without inertia.
    """
    root = Xml.Element("mujoco", model=family.name)
    Xml.SubElement(root, "compiler", angle="radian", inertiafromgeom="auto", boundmass=LEAST, boundinertia=LEAST)
    option = Xml.SubElement(root, "option")
    world, equality = Xml.SubElement(root, "worldbody"), Xml.SubElement(root, "equality")
    thick = THICK * extent([stage.part for stage in placed]) * METRES[unit]
    for k, stage in enumerate(placed):
        part, before = stage.part, placed[k - 1].part if k else None
        columns = _of_member(design, part.member)
        loop = _loop(stage, columns.get(f"finger{part.stage}", 0.0), METRES[unit])
        _stage(world, equality, loop, part, columns, unit, thick)
        if before is None:
            gravity = np.array([columns.get(f"gravity_{axis}{part.stage}", 0.0) for axis in "xyz"])
            option.set("gravity", words(loop.turn @ gravity * METRES[unit]))
        elif before.member == part.member:
            _geared(equality, f"crank{loop.tag}", f"rocker{_tag(before)}", columns.get(f"kappa{part.stage}", 1.0))
        elif isinstance(family, Machine):
            _geared(equality, f"crank{loop.tag}", *_driver(family, part.member, f"crank{_tag(placed[0].part)}"))
    actuators = Xml.SubElement(root, "actuator")
    Xml.SubElement(actuators, "motor", name="drive", joint=f"crank{_tag(placed[0].part)}")
    Xml.indent(root)
    path.write_text(Xml.tostring(root, encoding="unicode") + "\n", encoding="utf-8")


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


def _geared(equality: Xml.Element, joint: str, other: str, ratio: float) -> None:
    """Couple two joints from their positions in the first pose."""
    Xml.SubElement(
        equality, "joint", name=f"shaft of {joint}", joint1=joint, joint2=other,
        polycoef=words(np.array([0.0, ratio, 0.0, 0.0, 0.0])),
    )  # fmt: skip


def _loop(placed: PlacedPart, finger: float, metres: float) -> Loop:
    """Return the stage's joints and directions, from its joint records."""
    part = placed.part
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
    slider = records.follower == "slider"
    a, b, c, d = (
        (turn @ (point - center) + part.joints["a"][0] + placed.shift) * metres
        for point in (center, pose[0:3], pose[3:6], pose[3:6] if slider else d)
    )
    coupler, driven = np.column_stack([s, np.cross(n, s), n]), np.column_stack([rho, tau, k])
    return Loop(
        _tag(part), records.follower, a, b, c, d,
        turn @ crank, turn @ coupler, turn @ driven, finger, turn, placed.shift * metres,
    )  # fmt: skip


def _triad(along: Array, axis: Array) -> Array:
    """Return the columns x along a link, y across it, z its axis."""
    x = along / np.linalg.norm(along)
    return np.column_stack([x, np.cross(axis, x), axis])


def _stage(
    world: Xml.Element, equality: Xml.Element, loop: Loop, part: Part, design: Mapping[str, float], unit: str,
    thick: float,
) -> None:  # fmt: skip
    """Add crank, follower, and the coupler on one of them; x of a body is along its link, z along its axis."""
    tag, follower = loop.tag, loop.follower
    a, b, c = (float(np.linalg.norm(end)) for end in (loop.B - loop.A, loop.C - loop.B, loop.C - loop.D))
    crank = _body(world, f"crank{tag}", loop.A, loop.crank)
    Xml.SubElement(crank, "joint", name=f"crank{tag}", type="hinge", axis="0 0 1", ref=repr(float(part.crank[0])))
    driven = _body(world, f"{follower}{tag}", loop.D, loop.driven)
    position = float(part.position[0])
    if follower == "slider":
        ref = repr(position * METRES[unit])
        Xml.SubElement(driven, "joint", name=f"slider{tag}", type="slide", axis="0 1 0", ref=ref)
    else:
        if not part.family.pose_output[part.family.position].wraps:
            position = float(np.arctan2(*(loop.C - loop.D)[[1, 0]]))  # the guide's position is that of its point
        Xml.SubElement(driven, "joint", name=f"rocker{tag}", type="hinge", axis="0 0 1", ref=repr(position))
    carries = crank if loop.finger == DRIVING else driven
    origin, axes = (loop.A, loop.crank) if loop.finger == DRIVING else (loop.D, loop.driven)
    cross = loop.coupler.T @ (loop.crank[:, 2] if loop.finger == DRIVING else loop.driven[:, 0])
    coupler = _body(carries, f"coupler{tag}", axes.T @ (loop.B - origin), axes.T @ loop.coupler)
    hinge = words(np.array([0.0 if loop.finger == DRIVING else b, 0.0, 0.0]))
    Xml.SubElement(coupler, "joint", name=f"finger{tag}", type="hinge", pos=hinge, axis=words(cross))
    Xml.SubElement(coupler, "joint", name=f"coupler{tag}", type="hinge", pos=hinge, axis="0 0 1")
    first, second, anchor, joint = (
        (f"coupler{tag}", f"{follower}{tag}", b, "C")
        if loop.finger == DRIVING
        else (f"crank{tag}", f"coupler{tag}", a, "B")
    )
    Xml.SubElement(
        equality, "connect", name=f"{joint}{tag}", body1=first, body2=second,
        anchor=words(np.array([anchor, 0.0, 0.0])),
    )  # fmt: skip
    lengths = {"crank": a, "coupler": b, follower: c if follower == "rocker" else 4.0 * thick}
    for body, name in ((crank, "crank"), (coupler, "coupler"), (driven, follower)):
        if f"m_{name}{part.stage}" in design:
            body.append(inertial(design, name, part.stage, unit, lengths[name]))
        Xml.SubElement(
            body, "geom", name=f"{name}{tag}", type="capsule", size=repr(thick), density="7850", contype="0",
            conaffinity="0", fromto=words(np.array([0.0, 0.0, 0.0, lengths[name], 0.0, 0.0])),
        )  # fmt: skip
    frames = {
        "crank": (crank, loop.A, loop.crank), "coupler": (coupler, loop.B, loop.coupler),
        follower: (driven, loop.D, loop.driven),
    }  # fmt: skip
    for joint, path in part.joints.items():
        links = (link.name for link in part.links if joint in link.joints)
        link = next(links, follower if joint == TIP else "")
        body, origin, axes = frames.get(link, (world, np.zeros(3), np.eye(3)))
        at = axes.T @ (path[0] * METRES[unit] + loop.shift - origin)
        Xml.SubElement(body, "site", name=f"{shown_name(joint)}{tag}", pos=words(at))


def _body(parent: Xml.Element, name: str, at: Array, frame: Array) -> Xml.Element:
    axes = np.concatenate([frame[:, 0], frame[:, 1]])
    return Xml.SubElement(parent, "body", name=name, pos=words(at), xyaxes=words(axes))


def words(values: Array) -> str:
    """Return numbers in MuJoCo's format, to the last bit."""
    return " ".join(repr(float(x)) for x in values)


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


def inertial(design: Mapping[str, float], name: str, stage: str, unit: str, length: float) -> Xml.Element:
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
        raise InputError(
            f"j_{name}_xx{stage}", f"principal moments {low:.3g}, {middle:.3g}, {high:.3g}", allowed, "export"
        )
    scale = kilograms * metres**2
    return Xml.Element(
        "inertial", pos=words(centre * metres), mass=repr(mass * kilograms),
        fullinertia=words(np.array([xx, yy, zz, xy, xz, yz]) * scale),
    )  # fmt: skip
