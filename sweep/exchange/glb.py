"""An animated model: glTF 2.0 in one binary file, which browsers and viewers open without a plug-in.

Every link is a node of its name with a bar for each pair of its joints, every joint a ball, every fixed axis a thin
cylinder.  The format requires metres and y upwards; the root node converts to both.
"""

from __future__ import annotations

import json
import math
import struct
from itertools import pairwise
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from sweep.evaluation.joints import Part
from sweep.exchange.scene import extent, shown_name
from sweep.families.base import Array
from sweep.families.capabilities import Link

if TYPE_CHECKING:
    from scipy.spatial.transform import Rotation

COLOURS = {
    "frame": (0.08, 0.09, 0.12), "joint": (0.92, 0.93, 0.95),
    "link 0": (0.12, 0.35, 0.65), "link 1": (0.18, 0.56, 0.36),
    "link 2": (0.78, 0.33, 0.11), "link 3": (0.48, 0.31, 0.64), "link 4": (0.08, 0.5, 0.56),
}  # fmt: skip
FLOAT, UINT16 = 5126, 5123
ARRAY_BUFFER, ELEMENT_BUFFER = 34962, 34963
SIDES, RINGS = 24, 12
Z = np.array([0.0, 0.0, 1.0])


class GltfModel:
    """Nodes, meshes and accessors of a model, and their binary data."""

    def __init__(self) -> None:
        self.data = bytearray()
        self.views: list[dict[str, Any]] = []
        self.accessors: list[dict[str, Any]] = []
        self.nodes: list[dict[str, Any]] = []
        self.channels: list[dict[str, Any]] = []
        self.samplers: list[dict[str, Any]] = []
        self.meshes: list[dict[str, Any]] = []
        self.mesh_of: dict[tuple[str, str], int] = {}
        self.shapes = {"bar": self._shape(*_cylinder()), "ball": self._shape(*_ball())}
        self.materials = list(COLOURS)

    def accessor(self, values: NDArray[Any], kind: str, target: int | None = None) -> int:
        """Store an array and return the number of its accessor; integers are indices."""
        is_index = values.dtype.kind in "iu"
        stored = np.ascontiguousarray(values, np.uint16 if is_index else np.float32)
        self.data += b"\0" * (-len(self.data) % 4)
        view: dict[str, Any] = {"buffer": 0, "byteOffset": len(self.data), "byteLength": stored.nbytes}
        self.views.append(view | ({"target": target} if target else {}))
        self.data += stored.tobytes()
        flat = stored.reshape(len(stored), -1)
        self.accessors.append(
            {
                "bufferView": len(self.views) - 1,
                "componentType": UINT16 if is_index else FLOAT,
                "count": len(stored),
                "type": kind,
                "min": flat.min(axis=0).tolist(),
                "max": flat.max(axis=0).tolist(),
            }
        )
        return len(self.accessors) - 1

    def mesh(self, shape: str, colour: str) -> int:
        """Return the mesh of a shape in a colour, created at its first use."""
        if (shape, colour) not in self.mesh_of:
            self.mesh_of[shape, colour] = len(self.meshes)
            primitive = self.shapes[shape] | {"material": self.materials.index(colour)}
            self.meshes.append({"name": f"{shape} {colour}", "primitives": [primitive]})
        return self.mesh_of[shape, colour]

    def node(self, **what: Any) -> int:
        """Add a node and return its number."""
        self.nodes.append(what)
        return len(self.nodes) - 1

    def animate(self, node: int, times: int, path: str, values: Array) -> None:
        """Let a node's translation, rotation or scale follow values over the times."""
        output = self.accessor(values, "VEC4" if path == "rotation" else "VEC3")
        self.samplers.append({"input": times, "output": output, "interpolation": "LINEAR"})
        self.channels.append({"sampler": len(self.samplers) - 1, "target": {"node": node, "path": path}})

    def _shape(self, points: Array, normals: Array, faces: NDArray[np.int64]) -> dict[str, Any]:
        attributes = {
            "POSITION": self.accessor(points, "VEC3", ARRAY_BUFFER),
            "NORMAL": self.accessor(normals, "VEC3", ARRAY_BUFFER),
        }
        return {"attributes": attributes, "indices": self.accessor(faces.reshape(-1), "SCALAR", ELEMENT_BUFFER)}


def write_glb(name: str, placed: list[Part], path: Path, metres: float, seconds: float) -> None:
    """Write an animation of one turn in ``seconds``; ``metres`` is the length unit of the joints."""
    model = GltfModel()
    times = model.accessor(np.linspace(0.0, seconds, placed[0].phi.size), "SCALAR")
    size = extent(placed)
    groups = [_group(model, part, times, size) for part in placed]
    half = math.sqrt(0.5)
    root = model.node(name=f"mechanism {name}", rotation=[-half, 0.0, 0.0, half], scale=[metres] * 3, children=groups)
    data = bytes(model.data) + b"\0" * (-len(model.data) % 4)
    document = {
        "asset": {"version": "2.0", "generator": "linksweep"},
        "scene": 0,
        "scenes": [{"nodes": [root]}],
        "nodes": model.nodes,
        "meshes": model.meshes,
        "materials": [_material(colour, rgb) for colour, rgb in COLOURS.items()],
        "animations": [{"name": "one turn", "channels": model.channels, "samplers": model.samplers}],
        "accessors": model.accessors,
        "bufferViews": model.views,
        "buffers": [{"byteLength": len(data)}],
    }
    text = json.dumps(document, separators=(",", ":")).encode()
    text += b" " * (-len(text) % 4)
    with path.open("wb") as file:
        file.write(struct.pack("<4sII", b"glTF", 2, 12 + 8 + len(text) + 8 + len(data)))
        file.write(struct.pack("<I4s", len(text), b"JSON") + text)
        file.write(struct.pack("<I4s", len(data), b"BIN\0") + data)


def _material(name: str, rgb: tuple[float, float, float]) -> dict[str, Any]:
    surface = {"baseColorFactor": [*rgb, 1.0], "metallicFactor": 0.3, "roughnessFactor": 0.6}
    return {"name": name, "pbrMetallicRoughness": surface}


def _group(model: GltfModel, part: Part, times: int, size: float) -> int:
    """Return the node of a part with those of its links, joints and axes."""
    children, thick = [], 0.008 * size
    for k, link in enumerate(part.links):
        pairs = list(pairwise(link.joints))
        pairs += [(link.joints[-1], link.joints[0])] if len(link.joints) > 2 else []
        colour = f"link {k % 5}"
        bars = []
        for a, b in pairs:
            start, end = part.joints[a], part.joints[b]
            if np.abs(end - start).max() > 1e-9 * size:  # the fork slot has an arm of no length
                name = f"{link.name} {shown_name(a)}-{shown_name(b)}"
                bars.append(_bar(model, name, colour, start, end, times, thick))
        if len(link.joints) == 1 and link.joints[0] not in part.kinds:  # a slider, known by one joint
            bars.append(_block(model, part, link, colour, times, thick))
        if bars:
            children.append(model.node(name=link.name, children=bars))
    for joint, path in part.joints.items():
        fixed = joint in part.kinds
        mesh = model.mesh("ball", "frame" if fixed else "joint")
        node = model.node(
            name=shown_name(joint), mesh=mesh, scale=[1.8 * thick] * 3, translation=path[0].astype(np.float32).tolist()
        )
        if not fixed:
            model.animate(node, times, "translation", path)
        children.append(node)
    for joint, axis in part.axes.items():
        reach = 0.12 * size
        at = part.joints[joint][0] - reach * axis
        children.append(_rod(model, f"axis_{shown_name(joint)}", "frame", at, axis, 0.4 * thick, 2.0 * reach))
    name = part.label if part.member or part.stage else "stage"
    return model.node(name=name, translation=part.shift.tolist(), children=children)


def _block(model: GltfModel, part: Part, link: Link, colour: str, times: int, thick: float) -> int:
    """Return a block at the joint of a slider, along its line of motion."""
    slides = [part.axes[name] for name, kind in part.kinds.items() if kind == "slide"]
    axis, reach = slides[0] if slides else Z, 4.0 * thick
    path = part.joints[link.joints[0]] - reach * axis
    node = _rod(model, f"{link.name} block", colour, path[0], axis, 2.2 * thick, 2.0 * reach)
    model.animate(node, times, "translation", path)
    return node


def _rod(model: GltfModel, name: str, colour: str, at: Array, axis: Array, radius: float, length: float) -> int:
    """Return a bar from a point along an axis."""
    return model.node(
        name=name, mesh=model.mesh("bar", colour), translation=at.tolist(),
        rotation=_shortest(Z, axis).as_quat().tolist(), scale=[radius, radius, length],
    )  # fmt: skip


def _bar(model: GltfModel, name: str, colour: str, start: Array, end: Array, times: int, thick: float) -> int:
    """Return a bar between two paths, turned with its direction, and stretched if a joint slides along it."""
    along = end - start
    length = np.linalg.norm(along, axis=1)
    rotation = _following(along / np.maximum(length, 1e-300)[:, None])
    scale = np.stack([np.full_like(length, thick), np.full_like(length, thick), length], axis=1)
    node = model.node(
        name=name, mesh=model.mesh("bar", colour), translation=start[0].tolist(), rotation=rotation[0].tolist(),
        scale=scale[0].tolist(),
    )  # fmt: skip
    model.animate(node, times, "rotation", rotation)
    if np.ptp(start, axis=0).max() > 0.0:
        model.animate(node, times, "translation", start)
    if np.ptp(length) > 1e-6 * length.max():
        model.animate(node, times, "scale", scale)
    return node


def _following(directions: Array) -> Array:
    """Return quaternions (x, y, z, w) that turn z into each direction, each from the one before by the shortest way."""
    turns = [_shortest(Z, directions[0])]
    for before, after in pairwise(directions):
        turns.append(_shortest(before, after) * turns[-1])
    return np.array([turn.as_quat() for turn in turns])


def _shortest(first: Array, second: Array) -> Rotation:
    """Return the least rotation that turns the first direction into the second."""
    from scipy.spatial.transform import Rotation

    return Rotation.align_vectors(second, first)[0]


def _cylinder() -> tuple[Array, Array, NDArray[np.int64]]:
    """Return a cylinder of radius 1 from z = 0 to 1 with open ends, which the joints' balls cover."""
    angle = np.linspace(0.0, 2.0 * math.pi, SIDES, endpoint=False)
    ring = np.stack([np.cos(angle), np.sin(angle), np.zeros(SIDES)], axis=1)
    k = np.arange(SIDES)
    after = (k + 1) % SIDES
    faces = np.concatenate(
        [np.stack([k, after, after + SIDES], axis=1), np.stack([k, after + SIDES, k + SIDES], axis=1)]
    )
    return np.vstack([ring, ring + Z]), np.vstack([ring, ring]), faces


def _ball() -> tuple[Array, Array, NDArray[np.int64]]:
    """Return a ball of radius 1."""
    polar = np.linspace(0.0, math.pi, RINGS + 1)[:, None]
    angle = np.linspace(0.0, 2.0 * math.pi, SIDES, endpoint=False)
    parts = np.sin(polar) * np.cos(angle), np.sin(polar) * np.sin(angle), np.cos(polar)
    points = np.stack(np.broadcast_arrays(*parts), axis=-1).reshape(-1, 3)
    here = np.arange(len(points)).reshape(RINGS + 1, SIDES)
    beside = np.roll(here, -1, axis=1)
    # Two triangles between two rings; one at either pole, where a ring is a point.
    lower = np.stack([here[:-2], here[1:-1], beside[1:-1]], axis=-1)
    upper = np.stack([here[1:-1], beside[2:], beside[1:-1]], axis=-1)
    return points, points, np.concatenate([lower, upper]).reshape(-1, 3)
