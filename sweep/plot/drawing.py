"""Drawing of a mechanism as a figure, from a corner or along an axis."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np
from matplotlib.text import Annotation
from matplotlib.transforms import Bbox

from sweep.evaluation.joints import Part
from sweep.exchange.scene import VIEWS, extent, first_pose, frames_of, is_spatial, projection, shown_name
from sweep.families.base import Array
from sweep.report.figures import OPTIMUM, QUIET, WIDTH, new_figure

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure


def mechanism_figure(parts: Sequence[Part], unit: str, view: str | None = None, positions: int = 1) -> Figure:
    """Return a figure with a panel for each frame.

    Parameters
    ----------
    parts : parts over one closed turn, with at least one existing pose
    unit : unit of length, for the axes
    view : "space" or one of :data:`sweep.exchange.scene.VIEWS`; by default "space" for a spatial mechanism, else "xy"
    positions : number of positions drawn at equal steps, the first in full
    """
    frames = frames_of(parts)
    width = WIDTH if len(frames) > 1 else 5.4
    figure = new_figure(width, min(4.6, 0.25 + 0.95 * width / len(frames)))
    for axes, same in zip(figure.subplots(1, len(frames), squeeze=False)[0], frames.values(), strict=True):
        draw(axes, same, view or ("space" if is_spatial(same) else "xy"), unit, positions)
        axes.set_title(", ".join(part.label for part in same))
        handles, labels = axes.get_legend_handles_labels()
        once = dict(zip(labels, handles, strict=True))  # members of a machine have links of the same name
        axes.legend(once.values(), once.keys(), fontsize="small")
    separate_names(figure)
    return figure


def draw(axes: Axes, parts: Sequence[Part], view: str, unit: str, positions: int) -> None:
    """Draw parts of one frame in several positions over their turn, the first existing one in full."""
    seen = projection(view)
    first = first_pose(parts)
    steps = parts[0].phi.size - 1  # the last pose equals the first
    for k in range(1, positions):
        for part in parts:
            draw_links(axes, part, seen, (first + round(k * steps / positions)) % steps, faint=True)
    draw_frame(axes, parts, seen, pose=first)
    if view in VIEWS:
        axes.set_xlabel(f"{view[0]} [{unit}]")
        axes.set_ylabel(f"{view[1]} [{unit}]")
        axes.yaxis.set_inverted(view == "xz")  # seen from above z points down, otherwise the view is a mirror image
    else:
        axes.set_axis_off()


COLOURS = (OPTIMUM, "#2f8f5b", "#c8551b", "#7a4fa3", "#14808f", "#8c6d1f")
FRAME = "#14181f"
CLOSE = 0.01  # share of the mechanism's size: joints closer than this share a line of names
NAME = "_name of a joint"  # legends omit labels with a leading underscore
TURN = np.linspace(-0.75 * np.pi, 0.75 * np.pi, 25)


def draw_frame(axes: Axes, parts: Sequence[Part], seen: Array, *, pose: int = 0) -> None:
    """Draw parts in one pose with paths, joints, axes and the coordinate arrows of their common frame."""
    size = extent(parts)
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
            names.append((seen @ path[pose], f"{shown_name(name)}{part.stage}"))
    for at, words in _joined(names, CLOSE * size):
        axes.annotate(words, (float(at[0]), float(at[1])), (6, 5), textcoords="offset points", zorder=8, label=NAME)
    axes.set_aspect("equal", adjustable="datalim")
    axes.grid(False)


def separate_names(figure: Figure) -> None:
    """Move the names of joints so that they cover neither each other nor another joint, once all places are known."""
    figure.draw_without_rendering()
    point = figure.dpi / 72.0
    for axes in figure.axes:
        names = [text for text in axes.texts if isinstance(text, Annotation) and text.get_label() == NAME]
        joints = {name: axes.transData.transform(name.xy) for name in names}
        taken = [Bbox([at - 5.0 * point, at + 5.0 * point]) for at in joints.values()]
        taken += [text.get_window_extent() for text in axes.texts if text not in names and text.get_text()]
        for name, at in joints.items():
            box = name.get_window_extent()
            size = np.array([box.width, box.height])
            wide, high = size / point
            rises = [y + k * high for k in (0, 1, -1, 2, -2) for y in (5.0, -5.0 - high)]
            corners = {(x, y): at + point * np.array([x, y]) for y in rises for x in (6.0, -6.0 - wide)}
            boxes = {way: Bbox([corner, corner + size + [3.0 * point, 0.0]]) for way, corner in corners.items()}
            best = min(boxes, key=lambda way: boxes[way].count_overlaps(taken))
            name.set_position(best)
            taken.append(boxes[best])


def _joined(names: Sequence[tuple[Array, str]], near: float) -> list[tuple[Array, str]]:
    """Join the names of joints in the same place, instead of drawing them over each other."""
    groups: list[tuple[Array, list[str]]] = []
    for at, name in names:
        same = next((words for place, words in groups if np.linalg.norm(at - place) <= near), None)
        if same is None:
            groups.append((at, [name]))
        elif name not in same:
            same.append(name)
    return [(at, ", ".join(words)) for at, words in groups]


def draw_links(axes: Axes, part: Part, seen: Array, pose: int, *, faint: bool = False) -> None:
    """Draw the links of a part in one pose; a link of more than two joints as a polygon.

    ``faint`` is for the further positions of a figure that shows one in full.
    """
    width, alpha, layer = (0.9, 0.35, 3) if faint else (2.2, 1.0, 4)
    for k, link in enumerate(part.links):
        corners = np.array([part.joints[name][pose] for name in link.joints]) @ seen.T
        if len(corners) < 2 or not np.isfinite(corners).all():
            continue
        closed = np.vstack([corners, corners[:1]]) if len(corners) > 2 else corners
        label = None if faint else link.name
        axes.plot(*closed.T, color=COLOURS[k % len(COLOURS)], linewidth=width, alpha=alpha, zorder=layer, label=label)


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
