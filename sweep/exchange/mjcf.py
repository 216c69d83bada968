"""A simulation model for MuJoCo: the crank carries the coupler, a ``connect`` constraint closes the loop.

Joints are named as the links, so that a position of the hinge ``crank`` is phi, one of ``rocker`` psi, one of
``slider`` s.  Lengths are metres, masses kilograms.
"""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from xml.etree import ElementTree as Xml

import numpy as np

from sweep.errors import InputError
from sweep.evaluation.joints import Part
from sweep.exchange.scene import Placed, extent
from sweep.families.base import Array

FOLLOWERS = ("rocker", "slider")
KILOGRAMS = {"mm": 1e3, "m": 1.0}  # masses of designs in mm are tonnes, as N and s want
METRES = {"mm": 1e-3, "m": 1.0}
MOMENTS = ("xx", "yy", "zz", "xy", "xz", "yz")


def write_mjcf(name: str, placed: list[Placed], design: Mapping[str, float], path: Path, unit: str) -> None:
    """The model in its first pose.

    Bodies get the masses, centres and inertias (``m_crank``, ``com_crank_x``, ``j_crank_xx`` ...) of the design, else
    those of steel bars.  Stages of a chain are coupled at their common shaft.

    Raises
    ------
    InputError
        for a stage that has no crank, coupler and rocker or slider; for a mass without inertia.
    """
    root = Xml.Element("mujoco", model=name)
    Xml.SubElement(root, "compiler", angle="radian", inertiafromgeom="auto")
    Xml.SubElement(root, "option", gravity=_words(_vector(design, "gravity", "", METRES[unit])))
    world = Xml.SubElement(root, "worldbody")
    equality = Xml.SubElement(root, "equality")
    before: Part | None = None
    for one in placed:
        part = one.part
        names = [link.name for link in part.links]
        follower = next((link for link in part.links if link.name in FOLLOWERS), None)
        if follower is None or not {"crank", "coupler"} <= set(names) or part.member:
            allowed = "a family or chain of linkages with crank, coupler and rocker or slider"
            raise InputError("format", f"mjcf of {part.label}", allowed, "export")
        tag = f" {part.stage}" if part.stage else ""
        _stage(world, one, design, tag, follower.name, unit, 0.008 * extent([o.part for o in placed]))
        arm = np.linalg.norm(part.joints["c"][0] - part.joints["b"][0])
        Xml.SubElement(
            equality, "connect", name=f"C{tag}", body1=f"coupler{tag}", body2=f"{follower.name}{tag}",
            anchor=_words(np.array([arm * METRES[unit], 0.0, 0.0])),
        )  # fmt: skip
        if before is not None:
            sense = design.get(f"kappa{part.stage}", 1.0)
            Xml.SubElement(
                equality, "joint", name=f"shaft{tag}", joint1=f"crank{tag}", joint2=f"rocker {before.stage}",
                polycoef=_words(np.array([0.0, sense, 0.0, 0.0, 0.0])),
            )  # fmt: skip
        before = part
    actuators = Xml.SubElement(root, "actuator")
    first = f"crank {placed[0].part.stage}".strip()
    Xml.SubElement(actuators, "motor", name="drive", joint=first)
    Xml.indent(root)
    path.write_text(Xml.tostring(root, encoding="unicode") + "\n", encoding="utf-8")


def _stage(
    world: Xml.Element, one: Placed, design: Mapping[str, float], tag: str, follower: str, unit: str, thick: float
) -> None:
    """Crank with coupler, and the follower, in the first pose; x of a body along its link, z along its axis."""
    part, m = one.part, METRES[unit]
    a, b, c, d = (part.joints[name][0] + one.shift for name in "abcd")
    u, k = part.axes["a"], part.axes["d"]
    ends = {"crank": b - a, "coupler": c - b, follower: c - d}
    crank_frame = _frame(b - a, u)
    crank = _body(world, f"crank{tag}", a * m, crank_frame)
    Xml.SubElement(crank, "joint", name=f"crank{tag}", type="hinge", axis="0 0 1", ref=repr(float(part.crank[0])))
    side = u if np.linalg.norm(np.cross(u, c - b)) > 1e-6 * np.linalg.norm(c - b) else crank_frame[:, 1]
    coupler_frame = _frame(c - b, side)
    at = np.array([np.linalg.norm(b - a), 0.0, 0.0])
    coupler = _body(crank, f"coupler{tag}", at * m, crank_frame.T @ coupler_frame)
    Xml.SubElement(coupler, "joint", name=f"coupler{tag}", type="ball")
    position = float(part.position[0])
    if follower == "rocker" and not part.family.pose_output[part.family.position].wraps:
        position = float(np.arctan2(c[1] - d[1], c[0] - d[0]))  # the guide's position is that of its point
    if follower == "slider":
        x = _square(k)
        driven = _body(world, f"slider{tag}", c * m, np.column_stack([x, k, np.cross(x, k)]))
        Xml.SubElement(driven, "joint", name=f"slider{tag}", type="slide", axis="0 1 0", ref=repr(position * m))
    else:
        driven = _body(world, f"rocker{tag}", d * m, _frame(c - d, k))
        Xml.SubElement(driven, "joint", name=f"rocker{tag}", type="hinge", axis="0 0 1", ref=repr(position))
    for body, name in ((crank, "crank"), (coupler, "coupler"), (driven, follower)):
        given = f"m_{name}{part.stage}" in design
        if given:
            _inertial(body, design, name, part.stage, unit)
        length = float(np.linalg.norm(ends[name])) if name != "slider" else 4.0 * thick
        bar = np.array([0.0, 0.0, 0.0, length, 0.0, 0.0]) * m
        Xml.SubElement(
            body, "geom", name=f"{name}{tag}", type="capsule", fromto=_words(bar), size=repr(thick * m),
            density="7850", contype="0", conaffinity="0",
        )  # fmt: skip
    for body, site, end in ((crank, "B", float(at[0])), (coupler, "C", float(np.linalg.norm(c - b)))):
        Xml.SubElement(body, "site", name=f"{site}{tag}", pos=_words(np.array([end * m, 0.0, 0.0])))


def _body(parent: Xml.Element, name: str, at: Array, frame: Array) -> Xml.Element:
    axes = np.concatenate([frame[:, 0], frame[:, 1]])
    return Xml.SubElement(parent, "body", name=name, pos=_words(at), xyaxes=_words(axes))


def _frame(along: Array, axis: Array) -> Array:
    """Columns x, y, z: x along a link, less what it has along the axis, z the axis made square to it."""
    x = along / np.linalg.norm(along)
    z = axis - (axis @ x) * x
    z = z / np.linalg.norm(z)
    return np.column_stack([x, np.cross(z, x), z])


def _square(k: Array) -> Array:
    """A unit vector square to k."""
    trial = np.array([1.0, 0.0, 0.0]) if abs(k[0]) < 0.9 else np.array([0.0, 1.0, 0.0])
    rest = trial - (trial @ k) * k
    found: Array = rest / np.linalg.norm(rest)
    return found


def _inertial(body: Xml.Element, design: Mapping[str, float], name: str, stage: str, unit: str) -> None:
    mass, m = KILOGRAMS[unit], METRES[unit]
    moments = np.array([design.get(f"j_{name}_{entry}{stage}", 0.0) for entry in MOMENTS])
    xx, yy, zz, xy, xz, yz = moments
    least = np.linalg.eigvalsh(np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]]))[0]
    if not least > 0.0:
        allowed = "the inertias of a body: MuJoCo takes no mass without"
        raise InputError(f"j_{name}_xx{stage}", f"least moment {least:.3g}", allowed, "export")
    Xml.SubElement(
        body, "inertial", pos=_words(_vector(design, f"com_{name}", stage, m)),
        mass=repr(float(design[f"m_{name}{stage}"]) * mass), fullinertia=_words(moments * mass * m**2),
    )  # fmt: skip


def _vector(design: Mapping[str, float], stem: str, stage: str, factor: float) -> Array:
    return np.array([float(design.get(f"{stem}_{axis}{stage}", 0.0)) for axis in "xyz"]) * factor


def _words(values: Array) -> str:
    return " ".join(repr(float(x)) for x in values)
