"""Sketch of the mechanism with its dimensions, and data of bodies that are bars between their joints.

One position is drawn in full, others faintly, with paths and joints.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace
from itertools import combinations

import numpy as np
from markupsafe import Markup

from sweep.errors import InputError
from sweep.evaluation.joints import Part
from sweep.exchange import scene
from sweep.families.base import Array, Family
from sweep.pages import rendered
from sweep.report.dataset import Dataset
from sweep.report.quantities import quantity
from sweep.report.tables import value_of

POSES, FAINT = 180, 7  # poses of the paths; number of faint positions
WIDE, ROOM = 540.0, 36.0  # width of the picture and of its border, in pixels
LETTER, LINE = 8.2, 12.0  # largest width of a letter, and height of a line
AROUND = [(9, -8), (9, 14), (-9, -8), (-9, 14), (0, -16), (0, 24), (22, 3), (-22, 3), (30, -22), (-30, -22), (30, 30)]
FEW = 2  # members up to which joints are named; with more only the members are
NEAR = 1e-7  # share of the mechanism's size below which a distance equals a dimension
TELLING = 1e-3  # relative change of dimensions that distinguishes equal ones


def drawn_parts(family: Family, design: Mapping[str, float]) -> list[Part]:
    """Return joints and links of a design over one turn, frames side by side; empty without joints or poses."""
    try:
        parts = scene.over(family, {name: float(design[name]) for name in family.parameter_names}, 0.0, POSES)
    except InputError:  # a mechanism without joints has curves only
        return []
    return scene.side_by_side(parts) if scene.exists(parts) else []


def dimensioned(family: Family, design: Mapping[str, float], placed: Sequence[Part]) -> dict[str, Array]:
    """Return the ends, (2, 3), of the lengths that appear in a position as the distance of two points.

    A length is identified by a distance that follows it, when all lengths are changed slightly by different shares.
    """
    pose = scene.first_pose(placed)
    lengths = [p.name for p in family.parameters if p.unit == "length" and abs(float(design[p.name])) > 0.0]
    changed = {name: float(design[name]) * (1.0 + TELLING * (k + 1) / len(lengths)) for k, name in enumerate(lengths)}
    other = drawn_parts(family, {**design, **changed})
    if len(other) != len(placed):
        return {}
    tolerance = NEAR * scene.extent(placed)
    ends: dict[str, Array] = {}
    for stage, changed_stage in zip(placed, other, strict=True):
        points, moved = _points(stage, pose), _points(changed_stage, pose)
        # The links first: a length of the frame may equal that of a link in some position.
        linked = [pair for link in stage.links for pair in combinations(link.joints, 2)]
        for p, q in [*linked, *combinations(points, 2)]:
            if p not in moved or q not in moved:
                continue
            size, after = (float(np.linalg.norm(at[p] - at[q])) for at in (points, moved))
            for name in lengths:
                same = abs(size - abs(float(design[name]))) < tolerance and abs(after - abs(changed[name])) < tolerance
                if same and name not in ends:
                    ends[name] = np.array([points[p], points[q]]) + stage.shift
    return ends


def _points(part: Part, pose: int) -> dict[str, Array]:
    """Return joints in a pose, feet of the common perpendicular of two axes, and the foot of a plate's third point."""
    points = {name: path[pose] for name, path in part.joints.items()}
    for p, q in combinations(part.axes, 2):
        u, v, across = part.axes[p], part.axes[q], points[q] - points[p]
        slopes, *_ = np.linalg.lstsq(np.column_stack([u, -v]), across, rcond=1e-9)
        points |= {f"{p} on {q}": points[p] + slopes[0] * u, f"{q} on {p}": points[q] + slopes[1] * v}
    for link in (link for link in part.links if len(link.joints) == 3):
        a, b, c = (points[name] for name in link.joints)
        points[f"foot of {link.name}"] = a + (c - a) @ (b - a) / max((b - a) @ (b - a), 1e-300) * (b - a)
    return points


def sketch(
    placed: Sequence[Part], title: str, dimensions: Mapping[str, Array] | None = None, *,
    names: bool = True, span: float = 0.0,
) -> Markup:  # fmt: skip
    """Draw a mechanism as SVG in the colours of the page, from a corner if it is spatial, otherwise from the front.

    ``dimensions`` are the ends of lengths by label, (2, 3) each; ``span`` is the least width of the picture in length.
    """
    parts = [replace(part, joints={name: path + part.shift for name, path in part.joints.items()}) for part in placed]
    flat = np.vstack([path for part in parts for path in part.joints.values()])
    view = scene.projection("space" if scene.is_spatial(placed) else "xy")
    flat = flat[np.isfinite(flat).all(axis=1)] @ view.T
    low, wide = flat.min(axis=0), np.ptp(flat, axis=0)
    scale = (WIDE - 2.0 * ROOM) / max(float(wide[0]), float(wide[1]) / 0.8, span, 1e-300)

    def at(points: Array) -> Array:
        x, y = ((points @ view.T - low) * scale).T
        return np.column_stack([x + ROOM, float(wide[1]) * scale + ROOM - y])

    pose, steps = scene.first_pose(parts), parts[0].phi.size - 1
    turned = [(pose + round(k * steps / (FAINT + 1))) % steps for k in range(FAINT, -1, -1)]
    lines: list[tuple[str, str]] = []
    marks: list[tuple[str, float, float]] = []
    labels: list[tuple[float, float, str, str]] = []
    for part in parts:
        for name, path in part.joints.items():
            if name not in part.kinds:
                lines.append(("path", _line(at(path))))
        reach = 0.12 * scene.extent(parts)
        for name, axis in part.axes.items():
            lines.append(("axis", _line(at(part.joints[name][pose] + np.outer([-reach, reach], axis)))))
    for k in turned:
        for part in parts:
            for n, link in enumerate(part.links):
                corners = at(np.array([part.joints[name][k] for name in link.joints]))
                if np.isfinite(corners).all() and len(corners) > 1:
                    closed = np.vstack([corners, corners[:1]]) if len(corners) > 2 else corners
                    lines.append((f"{'' if k == pose else 'faint '}link link-{n % 6}", _line(closed)))
    for words, ends in (dimensions or {}).items():
        first, second = at(ends).tolist()
        lines.append(("measure", _line(at(ends))))
        _write(labels, 0.5 * (first[0] + second[0]), 0.5 * (first[1] + second[1]), words, "dimension")
    members = {part.member: part for part in reversed(parts)}
    if names and len(members) > FEW:  # letters of this many joints would overlap
        for member, part in members.items():
            ((x, y),) = at(next(iter(part.joints.values()))[[pose]]).tolist()
            _write(labels, x, y, member, "name")
    for part in parts:
        for name, path in part.joints.items():
            ((x, y),) = at(path[[pose]]).tolist()
            marks.append(("pivot" if name in part.kinds else "joint", x, y))
            if names and len(members) <= FEW:
                _write(labels, x, y, f"{scene.shown_name(name)}{part.stage}", "name")
    size = (WIDE, float(wide[1]) * scale + 2.0 * ROOM)
    return rendered("sketch.svg", title=title, size=size, lines=lines, marks=marks, labels=labels)


def _line(points: Array) -> str:
    finite = points[np.isfinite(points).all(axis=1)]
    return " ".join(f"{x:.1f},{y:.1f}" for x, y in finite.tolist())


def _write(taken: list[tuple[float, float, str, str]], x: float, y: float, words: str, kind: str) -> None:
    """Place words near a point without covering others; omit words without a free place, and repeated ones."""
    half = 0.5 * LETTER * len(words)
    if any(math.hypot(x - a, y - b) < 3 * LINE and words == other for a, b, other, _ in taken):
        return
    for dx, dy in AROUND:
        at = min(max(x + dx + math.copysign(half, dx) * (dx != 0), half), WIDE - half), y + dy
        if all(abs(at[0] - a) > half + 0.5 * LETTER * len(other) or abs(at[1] - b) > LINE for a, b, other, _ in taken):
            taken.append((*at, words, kind))
            return


def bars(data: Dataset) -> list[tuple[str, str, list[str]]]:
    """Return the bars with a mass, in the order of the mechanism.

    Returns
    -------
    name, kind, and in words mass, centre from its first joint, inertia across and along it
    """
    family, row = data.study.family, data.result
    rods = [name for name in family.parameter_names if f".{name}".rpartition(".")[2].startswith("rod_")]
    rods = [name for name in rods if row is not None and value_of(row, name) == 1.0]
    if row is None or not rods:
        return []
    placed = drawn_parts(family, {name: value_of(row, name) for name in family.parameter_names})
    pose, lengths = scene.first_pose(placed) if placed else 0, {}
    for part in placed:
        for link in (link for link in part.links if len(link.joints) > 1):
            first, second = (part.joints[name][pose] for name in link.joints[:2])
            lengths[(part.member, f"{link.name.replace(' ', '_')}{part.stage}")] = float(np.linalg.norm(second - first))
    result = []
    for name in rods:
        member, dot, parameter = name.rpartition(".")
        body = parameter.removeprefix("rod_")
        given = {word: value_of(row, f"{member}{dot}{word}_{body}") for word in ("m", "line_mass", "gyration")}
        length = lengths.get((member, body), np.nan)
        mass, thick = given["m"] + given["line_mass"] * length, given["gyration"] ** 2
        if mass > 0.0:
            values = (("m", "t", mass), ("com", "mm", 0.5 * length), ("j", "t*mm^2", mass * (length**2 / 12.0 + thick)),
                      ("j", "t*mm^2", 2.0 * mass * thick))  # fmt: skip
            words = [quantity(word, unit).show(value) for word, unit, value in values]
            result.append((f"{member}{dot}{body}", "exact" if thick else "slender", words))
    return result
