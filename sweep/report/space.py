"""A mechanism seen from a corner or square to a plane: links, joints, axes with their senses, the frame's origin."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from sweep.families.base import Array
from sweep.report.figures import OPTIMUM, QUIET

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from sweep.evaluation.joints import Part

COLOURS = (OPTIMUM, "#2f8f5b", "#c8551b", "#7a4fa3", "#14808f", "#8c6d1f")
FRAME = "#14181f"
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
    """Return whether joints leave the plane z = 0, or an axis is not square to it."""
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
    for part in parts:
        for name, axis in part.axes.items():
            _axis(axes, part.joints[name][0], axis, part.kinds[name], seen, 0.22 * size)
        draw_links(axes, part, seen, pose)
        for name, path in part.joints.items():
            _joint(axes, path, seen, pose, fixed=name in part.kinds)
            if labels:
                at = seen @ path[pose]
                axes.annotate(name.upper() if len(name) < 3 else name, at, (6, 5), textcoords="offset points", zorder=8)
    axes.set_aspect("equal", adjustable="datalim")
    axes.grid(False)


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
