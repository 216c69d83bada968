"""Mechanisms as figures: one picture each, or several to the same scale, from a corner or square to a plane."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from sweep.errors import InputError
from sweep.exchange.scene import over
from sweep.families.base import Array
from sweep.report.dataset import Dataset, marked
from sweep.report.figures import OPTIMUM, QUIET, WIDTH, new_figure

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from sweep.evaluation.joints import Part
    from sweep.families.base import Array
    from sweep.study import Study


POSITIONS = 8
JOINT_POSES = 180  # of paths in a drawing
WORDS = {"space": "corner", "xy": "front", "zy": "side", "xz": "top"}


def frames_of(parts: Sequence[Part]) -> dict[str, list[Part]]:
    """Parts by the frame that they stand in, in their order."""
    return {frame: [part for part in parts if part.frame == frame] for frame in dict.fromkeys(p.frame for p in parts)}


def mechanism_figure(
    designs: Mapping[str, Sequence[Part]], unit: str, views: Sequence[str] | None = None, positions: int = 1
) -> Figure:
    """Return a row for each design and a panel for each frame and view, to the same scale down a column.

    Parameters
    ----------
    designs : parts over one closed turn by the name of the design; at least one pose of each exists
    unit : of length, for the axes
    views : of every frame, "space" or those of :data:`sweep.report.mechanisms.VIEWS`; if left out "space" for what is
        spatial, "xy" for what is plane
    positions : that are drawn at equal steps, the first in full
    """
    columns = _columns(designs, views)
    width = WIDTH if len(columns) > 1 or len(designs) > 1 else 5.4
    beside = len(columns) == 1  # the designs, else their frames
    across, down = (len(designs), 1) if beside else (len(columns), len(designs))
    figure = new_figure(width, min(4.6, 0.25 + 0.95 * width / across) * down)
    panels = figure.subplots(down, across, squeeze=False)
    panels = panels.T if beside else panels
    for row, (name, parts) in zip(panels, designs.items(), strict=True):
        for axes, (frame, view) in zip(row, columns, strict=True):
            draw(axes, frames_of(parts)[frame], view, unit, positions)
            several = sum(frame == other for other, _ in columns) > 1
            words = ", ".join(part.label for part in frames_of(parts)[frame])
            axes.set_title("\n".join(filter(None, [name, f"{words}, {WORDS[view]}" if several else words])))
    for column in panels.T:
        _same_scale(column)
        handles, labels = column[0].get_legend_handles_labels()
        if handles:  # members of a machine have links of the same name
            once = dict(zip(labels, handles, strict=True))
            column[0].legend(once.values(), once.keys(), fontsize="small")
    return figure


def small_figures(designs: Mapping[str, Sequence[Part]], unit: str) -> dict[str, Figure]:
    """One small picture of every design, its frames side by side, all to the same scale."""
    columns = _columns(designs, None)
    figures, panels = {}, []
    for name, parts in designs.items():
        figures[name] = new_figure(0.5 * WIDTH, min(0.5 * WIDTH / len(columns), 3.0) + 0.3)
        panels.append(figures[name].subplots(1, len(columns), squeeze=False)[0])
        for axes, (frame, view) in zip(panels[-1], columns, strict=True):
            draw(axes, frames_of(parts)[frame], view, unit, POSITIONS, labels=False)
            axes.set_title(", ".join(part.label for part in frames_of(parts)[frame]))
    for column in zip(*panels, strict=True):
        _same_scale(column)
    return figures


def draw(axes: Axes, parts: Sequence[Part], view: str, unit: str, positions: int, *, labels: bool = True) -> None:
    """Draw parts of one frame in several positions over their turn, the first that exists in full."""
    seen = projection(view)
    first = first_pose(parts)
    steps = parts[0].phi.size - 1  # the last pose is the first one again
    for k in range(1, positions):
        for part in parts:
            draw_links(axes, part, seen, (first + round(k * steps / positions)) % steps, faint=True)
    draw_frame(axes, parts, seen, pose=first, labels=labels)
    if view in VIEWS:
        axes.set_xlabel(f"{view[0]} [{unit}]")
        axes.set_ylabel(f"{view[1]} [{unit}]")
    else:
        axes.set_axis_off()


def first_pose(parts: Sequence[Part]) -> int:
    """First pose in which every joint exists; 0 where there is none."""
    whole = np.logical_and.reduce([np.isfinite(path).all(axis=1) for part in parts for path in part.joints.values()])
    return int(np.argmax(whole))


def exists(parts: Sequence[Part]) -> bool:
    """Whether there are joints, and a pose in which all of them exist."""
    found: list[Array] = [path for part in parts for path in part.joints.values()]
    return bool(found) and bool(np.logical_and.reduce([np.isfinite(path).all(axis=1) for path in found]).any())


def mechanism_caption(designs: Mapping[str, Sequence[Part]]) -> str:
    """Return what the figure shows, of what there is to see."""
    every = [part for parts in designs.values() for part in parts]
    text = f"{POSITIONS} positions at equal steps, the first one in full; grey: paths of the joints."
    if any(part.kinds for part in every):
        text += " Triangles: fixed joints; dash-dotted: their axes, with the positive sense."
    if any(part.member for part in every):
        text += " Members stand in the machine's frame."
    elif len({part.frame for part in every}) > 1:
        text += (
            " Every stage is drawn in a frame of its own: one of these families names no axis that the next stage"
            " could turn on."
        )
    return text


def _columns(designs: Mapping[str, Sequence[Part]], views: Sequence[str] | None) -> list[tuple[str, str]]:
    """Frames and views of the panels, the same for every design."""
    by_frame: dict[str, list[Part]] = {}
    for parts in designs.values():
        for frame, same in frames_of(parts).items():
            by_frame.setdefault(frame, []).extend(same)
    own = {frame: ("space",) if is_spatial(parts) else ("xy",) for frame, parts in by_frame.items()}
    return [(frame, view) for frame in by_frame for view in (own[frame] if views is None else views)]


def _same_scale(column: Sequence[Axes]) -> None:
    if len(column) == 1:
        return
    limits = np.array([[axes.get_xlim(), axes.get_ylim()] for axes in column])
    (left, bottom), (right, top) = limits[:, :, 0].min(axis=0), limits[:, :, 1].max(axis=0)
    for axes in column:
        axes.set(xlim=(left, right), ylim=(bottom, top))
        axes.set_aspect("equal", adjustable="box")


COLOURS = (OPTIMUM, "#2f8f5b", "#c8551b", "#7a4fa3", "#14808f", "#8c6d1f")
FRAME = "#14181f"
CLOSE = 0.04  # of the mechanism's size: joints so near to each other share a line of names
VIEWS = {"xy": (0, 1), "zy": (2, 1), "xz": (0, 2)}
ELEVATION, AZIMUTH = math.radians(24.0), math.radians(-55.0)
TURN = np.linspace(-0.75 * np.pi, 0.75 * np.pi, 25)


def projection(view: str) -> Array:
    """Return the (2, 3) matrix of a view: "xy", "zy", "xz" square to a plane, "space" from a corner with z upwards."""
    if view in VIEWS:
        return np.eye(3)[list(VIEWS[view])]
    (se, ce), (sa, ca) = ((math.sin(x), math.cos(x)) for x in (ELEVATION, AZIMUTH))
    return np.array([[-sa, ca, 0.0], [-se * ca, -se * sa, ce]])


def is_spatial(parts: Sequence[Part]) -> bool:
    """Whether joints leave the plane z = 0, or an axis is not square to it."""
    points = np.vstack([path for part in parts for path in part.joints.values()])
    turned = [axis for part in parts for name, axis in part.axes.items() if part.kinds[name] == "axis"]
    lean = any(abs(axis[0]) + abs(axis[1]) > 1e-9 for axis in turned)
    return lean or float(np.nanmax(np.abs(points[:, 2]))) > 1e-9 * float(np.nanmax(np.abs(points)))


def draw_frame(axes: Axes, parts: Sequence[Part], seen: Array, *, pose: int = 0, labels: bool = True) -> None:
    """Draw parts in one pose with paths, joints, axes and the coordinate arrows of their common frame."""
    size = _size(parts)
    for letter, tip in zip("xyz", 0.3 * size * np.eye(3), strict=True):
        end = seen @ tip
        if np.linalg.norm(end) > 1e-9 * size:
            arrow = {"arrowstyle": "-|>", "color": FRAME, "linewidth": 1.2, "shrinkA": 0, "shrinkB": 0}
            axes.scatter(1.15 * end[0], 1.15 * end[1], s=0)  # arrows alone do not widen the limits
            axes.annotate("", end, (0.0, 0.0), arrowprops=arrow, zorder=7)
            axes.annotate(letter, end * 1.12, ha="center", va="center", color=FRAME, style="italic", zorder=7)
    names: list[tuple[Array, str]] = []
    for part in parts:
        for name, axis in part.axes.items():
            _axis(axes, part.joints[name][0], axis, part.kinds[name], seen, 0.22 * size)
        draw_links(axes, part, seen, pose)
        for name, path in part.joints.items():
            _joint(axes, path, seen, pose, fixed=name in part.kinds)
            names.append((seen @ path[pose], name.upper() if len(name) < 3 else name))
    for at, words in _joined(names, CLOSE * size) if labels else ():
        axes.annotate(words, (float(at[0]), float(at[1])), (6, 5), textcoords="offset points", zorder=8)
    axes.set_aspect("equal", adjustable="datalim")
    axes.grid(False)


def _joined(names: Sequence[tuple[Array, str]], near: float) -> list[tuple[Array, str]]:
    """Write the names of what lies in one place behind each other, not above each other."""
    found: list[tuple[Array, list[str]]] = []
    for at, name in names:
        same = next((words for place, words in found if np.linalg.norm(at - place) <= near), None)
        if same is None:
            found.append((at, [name]))
        elif name not in same:
            same.append(name)
    return [(at, ", ".join(words)) for at, words in found]


def draw_links(axes: Axes, part: Part, seen: Array, pose: int, *, faint: bool = False) -> None:
    """Draw the links of a part in one pose; a link of more than two joints as the polygon that it is.

    ``faint`` is for the further positions of a picture that has one in full.
    """
    width, alpha, layer = (0.9, 0.35, 3) if faint else (2.2, 1.0, 4)
    for k, link in enumerate(part.links):
        corners = np.array([part.joints[name][pose] for name in link.joints]) @ seen.T
        if len(corners) < 2 or not np.isfinite(corners).all():
            continue
        closed = np.vstack([corners, corners[:1]]) if len(corners) > 2 else corners
        label = None if faint else link.name
        axes.plot(*closed.T, color=COLOURS[k % len(COLOURS)], linewidth=width, alpha=alpha, zorder=layer, label=label)


def _size(parts: Sequence[Part]) -> float:
    points = np.vstack([path for part in parts for path in part.joints.values()])
    return float(np.nanmax(np.ptp(points[np.isfinite(points).all(axis=1)], axis=0)))


def _joint(axes: Axes, path: Array, seen: Array, pose: int, *, fixed: bool) -> None:
    flat = path @ seen.T
    if not fixed:
        axes.plot(*np.vstack([flat, flat[:1]]).T, color=QUIET, linewidth=0.7, zorder=2)
    axes.scatter(
        flat[pose, 0], flat[pose, 1], marker="^" if fixed else "o", s=52 if fixed else 24, zorder=6, linewidths=1.2,
        facecolors=FRAME if fixed else "white", edgecolors=FRAME,
    )  # fmt: skip


def _axis(axes: Axes, at: Array, axis: Array, kind: str, seen: Array, reach: float) -> None:
    """Draw an axis as a dash-dotted line with the arc of its positive sense, a slide as a line with an arrow."""
    ends = np.array([at - 1.6 * reach * axis, at + 1.6 * reach * axis]) @ seen.T
    axes.plot(*ends.T, color=FRAME, linewidth=0.8, linestyle=(0, (9, 3, 2, 3)), zorder=1)
    arrow = {"arrowstyle": "-|>", "color": FRAME, "linewidth": 1.0, "shrinkA": 0, "shrinkB": 0}
    if kind == "slide":
        axes.annotate("", ends[1], 0.5 * (ends[0] + ends[1]), arrowprops=arrow, zorder=3)
        return
    across = np.cross(axis, [1.0, 0.0, 0.0] if abs(axis[0]) < 0.9 else [0.0, 1.0, 0.0])
    across /= np.linalg.norm(across)
    other = np.cross(axis, across)
    around = np.outer(np.cos(TURN), across) + np.outer(np.sin(TURN), other)
    arc = (at + 0.9 * reach * axis * (abs(seen @ axis).max() > 0.05) + 0.35 * reach * around) @ seen.T
    axes.plot(*arc.T, color=FRAME, linewidth=0.9, zorder=3)
    axes.annotate("", arc[-1], arc[-3], arrowprops=arrow, zorder=3)


def parts_over_turn(study: Study, rows: Mapping[str, Mapping[str, Any]]) -> dict[str, list[Part]]:
    """Joints and links over one closed turn, for every role whose design has a pose."""
    found = {}
    for role, row in rows.items():
        design = {name: float(row[name]) for name in study.family.parameter_names}
        try:
            parts = over(study.family, design, 0.0, JOINT_POSES)
        except InputError:  # a mechanism without joints has curves only
            return {}
        if exists(parts):
            found[role] = parts
    return found


def mechanism(parts: Mapping[str, Sequence[Part]]) -> Figure | None:
    """Return the designs of :func:`drawn_parts` in several positions, the result above or beside the reference."""
    return mechanism_figure(parts, "mm", positions=POSITIONS) if parts else None


def drawn_parts(data: Dataset) -> dict[str, list[Part]]:
    """Draw result and reference with their joints over a turn; empty where the study wants none, or they have none."""
    if data.study.output.curves == "none":
        return {}
    rows = {role: row for role, row in marked(data).items() if row is not None}
    return parts_over_turn(data.study, rows)
