"""Mechanisms as figures, from the joints and links of their stages: one picture each, or several to the same scale."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

import numpy as np

from sweep.report.figures import WIDTH, new_figure
from sweep.report.space import VIEWS, draw_frame, draw_links, is_spatial, projection

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from sweep.evaluation.joints import Part
    from sweep.families.base import Array

POSITIONS = 8
WORDS = {"space": "corner", "xy": "front", "zy": "side", "xz": "top"}


def frames_of(parts: Sequence[Part]) -> dict[str, list[Part]]:
    """Return parts by the frame that they stand in, in their order."""
    return {frame: [part for part in parts if part.frame == frame] for frame in dict.fromkeys(p.frame for p in parts)}


def mechanism_figure(
    designs: Mapping[str, Sequence[Part]], unit: str, views: Sequence[str] | None = None, positions: int = 1
) -> Figure:
    """Return a row for each design and a panel for each frame and view, to the same scale down a column.

    Parameters
    ----------
    designs : parts over one closed turn by the name of the design; at least one pose of each exists
    unit : of length, for the axes
    views : of every frame, "space" or those of :data:`sweep.report.space.VIEWS`; if left out "space" for what is
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
    """Return one small picture of every design, its frames side by side, all to the same scale."""
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
    """Return the first pose in which every joint exists; 0 where there is none."""
    whole = np.logical_and.reduce([np.isfinite(path).all(axis=1) for part in parts for path in part.joints.values()])
    return int(np.argmax(whole))


def exists(parts: Sequence[Part]) -> bool:
    """Return whether there are joints, and a pose in which all of them exist."""
    found: list[Array] = [path for part in parts for path in part.joints.values()]
    return bool(found) and bool(np.logical_and.reduce([np.isfinite(path).all(axis=1) for path in found]).any())


def mechanism_caption(designs: Mapping[str, Sequence[Part]]) -> str:
    """Return what the figure shows, of what there is to see."""
    every = [part for parts in designs.values() for part in parts]
    text = f"{POSITIONS} positions at equal steps, the first one in full; grey: paths of the joints."
    if any(part.kinds for part in every):
        text += " Triangles: fixed joints; dash-dotted: their axes, with the positive sense."
    if any(part.member for part in every):
        text += " Members stand in the machine's frame, earlier stages of a chain in frames of their own."
    elif len({part.frame for part in every}) > 1:
        text += (
            " Every stage is drawn in a frame of its own. The chain fixes the angle by which the shaft between two"
            " stages drives the next one (phi2 = kappa2 psi1 + offset2), but not where along the shaft that stage"
            " stands, nor how its frame is turned about it: both are left to the designer."
        )
    return text


def _columns(designs: Mapping[str, Sequence[Part]], views: Sequence[str] | None) -> list[tuple[str, str]]:
    """Return frames and views of the panels, the same for every design."""
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
