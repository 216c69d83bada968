"""Common parts of the load effects: inputs of bodies, weight, speed and load; vector outputs and their columns."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import replace
from typing import NamedTuple, TypeAlias

import numpy as np

from sweep.effects.motion import CONSTRUCTION
from sweep.effects.scene import Scene
from sweep.families.base import Array, Columns, Family, Output, Parameter
from sweep.families.capabilities import JointRecords
from sweep.families.sites import AXES
from sweep.numerics.records import Mask

FRICTION_SUFFIX, FRICTION_TEXT = "_friction", ", friction included"
GRAM = "; a gram is 1e-6"  # users tend to type kilograms

Named: TypeAlias = dict[str, tuple[str, str]]
"""Unit and meaning by name."""
PASSES: Named = {"friction_passes": ("1", "passes of the friction iteration")}

_FRAMES = {
    "crank": "along the crank, tangential, along its axis, from A",
    "coupler": "along the coupler, n x s, n, from B",
    "rocker": "along the rocker, tangential, along its axis, from D",
    "slider": "along the common perpendicular, the slide, normal to both, from C",
}


def body_inputs(body: str, frame: str, default: float | None = None) -> tuple[Parameter, ...]:
    """Mass, centre of mass and inertia of a body whose axes ``frame`` describes; ``default`` is that of the mass."""
    centre = (
        Parameter(f"com_{body}_{axis}", "length", f"centre of mass of the {body} ({frame})", default=0.0)
        for axis in "xyz"
    )
    text = f"inertia of the {body} about its centre of mass"
    moments = (
        Parameter(f"j_{body}_{x}{x}", "inertia", text, default=0.0, not_negative=True)
        if x == y
        else Parameter(
            f"j_{body}_{x}{y}", "inertia", f"{text}: entry of the tensor, - integral {x} {y} dm", default=0.0
        )
        for x, y in ("xx", "xy", "xz", "yy", "yz", "zz")
    )
    mass = Parameter(f"m_{body}", "mass", f"mass of the {body}{GRAM}", default=default, not_negative=True)
    return mass, *centre, *moments


def _body(body: str) -> tuple[Parameter, ...]:
    return body_inputs(body, _FRAMES[body])


def as_rod(body: str, own: tuple[Parameter, ...]) -> tuple[Parameter, ...]:
    """List the inputs that make a body a rod, unless its centre or inertia is given: switch, line mass, gyration.

    ``own`` are its mass, centre and inertia.
    """
    name = f"rod_{body}"
    others = tuple((name, p.name) for p in own if not p.name.startswith("m_"))
    text = f"1: the mass of the {body} is that of a slender rod between its joints, centre halfway, inertia m l^2/12"
    words = f"{text}; left out, it is 0 where its centre or inertia is given, else 1"
    line = f"mass per length of the {body} between its joints, beside m_{body}; counts where rod_{body} is 1"
    thick = f"radius of gyration of the section of the {body} about a line across it; 0: slender, no inertia along it"
    return (
        Parameter(name, "choice", words, default=1.0, choices=(0.0, 1.0), unless=others),
        Parameter(f"line_mass_{body}", "line_mass", line, default=0.0, not_negative=True),
        Parameter(f"gyration_{body}", "length", thick, default=0.0, not_negative=True),
    )


ROD = ("rod", "line_mass", "gyration")  # prefixes of the names of these inputs


POINT = "in its joint where its centre and inertia are left out"


def as_point(mass: Parameter) -> Parameter:
    """Mass of a body without a second joint, which cannot be a rod."""
    return replace(mass, text=f"{mass.text}; {POINT}")


# Indices of a tensor's entries in the order of its inputs.
_FIRST, _SECOND = np.array([0, 0, 0, 1, 1, 2]), np.array([0, 1, 2, 1, 2, 2])
_UNIT = np.array([1.0, 0.0, 0.0, 1.0, 0.0, 1.0])


def put_rod(columns: Array, rod: Array, line_mass: Array, gyration: Array, start: Array, end: Array) -> None:
    """Make bodies rods where ``rod`` is 1: masses, centres and moments of inertia (n, BODY), in place.

    The inertia across the rod is m l^2/12 plus m k^2, with the radius of gyration k of a section that is the same about
    all lines across the rod; along the rod it is 2 m k^2.

    Parameters
    ----------
    rod, line_mass, gyration : (n,)
    start, end : (n, 3) joints of the rod in the axes of the body
    """
    along = end - start
    lengths = along * along
    square = lengths[:, 0] + lengths[:, 1] + lengths[:, 2]
    columns[:, 0] += rod * line_mass * np.sqrt(square)
    columns[:, 1:4] += (0.5 * rod)[:, None] * (start + end)
    mass, across = rod * columns[:, 0] / 12.0, along[:, _FIRST] * along[:, _SECOND]
    columns[:, 4:10] += mass[:, None] * (square[:, None] * _UNIT - across)
    if gyration.any():
        per = np.divide(1.0, square, out=np.zeros_like(square), where=square > 0.0)
        columns[:, 4:10] += (12.0 * mass * gyration**2)[:, None] * (_UNIT + per[:, None] * across)


def rod_inputs(body: str, frame: str) -> tuple[Parameter, ...]:
    """Mass, centre of mass and inertia of a slender rod."""
    return (
        Parameter(f"m_{body}", "mass", f"mass of {body}{GRAM}", default=0.0, not_negative=True),
        Parameter(f"com_{body}_x", "length", f"centre of mass of {body} ({frame})", default=0.0),
        Parameter(f"j_{body}", "inertia", f"inertia of {body} across it about its centre of mass", default=0.0,
                  not_negative=True),
    )  # fmt: skip


GRAVITY = tuple(
    Parameter(f"gravity_{axis}", "acceleration", f"gravity along {axis} of the fixed axes", default=0.0)
    for axis in "xyz"
)
SPEED = Parameter("speed", "speed", "speed of the crank (scene.speed of a study); negative: it turns backwards",
                  not_zero=True)  # fmt: skip
CHANGE = Parameter("speed_change", "angular_acceleration", "angular acceleration of the crank", default=0.0)
# Inputs of a tool that moves along a line; without mass and force it is not computed.
_MASS = Parameter("m_tool", "mass", "mass of the tool, such as a needle bar", default=0.0, not_negative=True)
TOOL = (
    _MASS,
    Parameter("tool_force", "force", "force on the tool along its way; a resisting one opposes ds", default=0.0),
    Parameter("pierce_force", "force", "force that resists the tool on its way into the fabric", default=0.0,
              not_negative=True),
    Parameter("pierce_at", "length", "place s at which the tool meets the fabric", default=0.0),
    Parameter("pierce_sense", "sign", "side of pierce_at on which the fabric lies: towards growing or falling s",
              default=1.0, choices=(-1.0, 1.0)),
)  # fmt: skip
# Inputs of a tool at a point that moves freely in space.
FREE_TOOL = (
    _MASS,
    *(
        Parameter(f"tool_force_{axis}", "force", f"force on the tool along {axis} of the fixed axes", default=0.0)
        for axis in "xyz"
    ),
)
_ALONG = {"x": "the output link", "y": "its tangent", "z": "its axis, from z = 0 of the frame"}
TIP = tuple(
    Parameter(f"tool_{axis}", "length", f"place of the tool along {way}", default=0.0) for axis, way in _ALONG.items()
)
# Tool inputs of families with a coupler point that moves along a line, with one that moves freely, and of families
# whose rocker can carry a tool at its tip.
TOOLS = (TOOL, FREE_TOOL, (*FREE_TOOL, *TIP))
_TORQUE = Parameter(
    "load_torque", "torque", "torque on the rocker about its axis; a resisting one opposes dpsi", default=0.0
)
_FORCE = Parameter(
    "load_force", "force", "force on the slider along the slide; a resisting one opposes ds", default=0.0
)


class Follower(NamedTuple):
    """Inputs of the load effects for a kind of follower: name, useful load, bodies, and all inputs."""

    name: str
    prefix: str  # of the names of its effects
    load: Parameter
    bodies: tuple[str, ...]  # columns of kernels.effects.kinetostatics in order
    rods: tuple[str, ...]  # bodies that may be slender rods, in order
    parameters: tuple[Parameter, ...]


def _follower(name: str, prefix: str, load: Parameter) -> Follower:
    bodies = (*_body("crank"), *_body("coupler"), *_body(name), *GRAVITY)
    rods = tuple(body for body in ("crank", "coupler", name) if body != "slider")
    made = (p for body in rods for p in as_rod(body, _body(body)))
    parameters = (*bodies, *made, load, SPEED, CHANGE, CONSTRUCTION)
    return Follower(name, prefix, load, tuple(p.name for p in bodies), rods, parameters)


# Useful loads of a tree of links whose output link turns, or slides.
LINK_TORQUE = replace(_TORQUE, text="torque on the output link about its axis; a resisting one opposes dpsi")
LINK_FORCE = replace(_FORCE, text="force on the output link along its guide; a resisting one opposes its derivative")
ROCKER = _follower("rocker", "", _TORQUE)
SLIDER = _follower("slider", "slider_", _FORCE)


def follower_of(family: Family) -> Follower:
    """Kind of follower of a family."""
    joints = family.find(JointRecords)
    return SLIDER if joints is not None and joints.follower == SLIDER.name else ROCKER


def vector_outputs(named: Named) -> tuple[Output, ...]:
    """Magnitude and components of vectors as outputs."""
    found = []
    for name, (unit, text) in named.items():
        found.append(Output(name, unit, f"magnitude: {text}"))
        found += [Output(f"{name}_{axis}", unit, f"{axis}: {text}") for axis in AXES]
    return tuple(found)


def scalar_outputs(named: Named, jumps: str = "") -> tuple[Output, ...]:
    """List scalar outputs; the output named ``jumps`` has jumps."""
    return tuple(Output(name, unit, text, jumps=name == jumps) for name, (unit, text) in named.items())


def frame(suffix: str = "", text: str = "") -> Named:
    """Force and moment of the bearings on the frame."""
    moment = "moment on the frame about the origin of the family's frame, drive torque included"
    return {
        f"shaking_force{suffix}": ("force", f"force on the frame{text}"),
        f"shaking_moment{suffix}": ("torque", f"{moment}{text}"),
    }


def frame_room(shape: tuple[int, int], wanted: frozenset[str], suffix: str = "") -> tuple[Array | None, Array | None]:
    """Allocate force and moment on the frame, (n, 3, m) each; None if not wanted."""
    force, moment = (np.empty((shape[0], 3, shape[1])) if asked((name,), wanted) else None for name in frame(suffix))
    return force, moment


def frame_columns(on_frame: tuple[Array | None, Array | None], wanted: frozenset[str], suffix: str = "") -> Columns:
    """Extract the wanted magnitudes and components of force and moment on the frame, (n, 3, m) or None each."""
    named = zip(frame(suffix), on_frame, strict=True)
    return vector_columns({name: np.moveaxis(x, 1, 2) for name, x in named if x is not None}, wanted)


def asked(names: Collection[str], wanted: frozenset[str]) -> bool:
    """Whether a vector or one of its components is wanted."""
    return any(f"{name}{tail}" in wanted for name in names for tail in ("", "_x", "_y", "_z"))


def vector_columns(found: Mapping[str, Array], wanted: frozenset[str]) -> Columns:
    """Extract the wanted magnitudes and components of vectors, (n, m, 3) each."""
    columns: Columns = {}
    for name, values in found.items():
        if name in wanted:
            columns[name] = magnitude(values)
        columns |= {f"{name}_{a}": values[:, :, k] for k, a in enumerate(AXES) if f"{name}_{a}" in wanted}
    return columns


def scalar_columns(names: Collection[str], values: Array | None, wanted: frozenset[str]) -> Columns:
    """Extract the wanted columns of an array (n, m, len(names)); none if it is None."""
    return {} if values is None else {name: values[:, :, k] for k, name in enumerate(names) if name in wanted}


def magnitude(vectors: Array) -> Array:
    """Length of vectors (n, m, 3)."""
    x, y, z = vectors[:, :, 0], vectors[:, :, 1], vectors[:, :, 2]
    return np.sqrt(x * x + y * y + z * z)


def tip_from(scene: Scene, heights: Array) -> Array:
    """Place of a tool at the tip of the output link, (n, 3), relative to the point of its axis at ``heights`` (n,).

    Inputs count from the point with z = 0, as tips of a machine do; bodies and loads count from D.
    """
    place = scene.table(tuple(p.name for p in TIP))
    place[:, 2] -= heights
    return place


def together(scene: Scene, shaft: str) -> Mask:
    """Whether both supports of a shaft coincide, (n,)."""
    same: Mask = scene.inputs[f"support_{shaft}1"] == scene.inputs[f"support_{shaft}2"]
    return same
