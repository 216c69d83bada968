"""A drawing of the mechanism out of its joint coordinates alone, so that a new family needs nothing here.

A stage's joints are the columns ``x_b y_b z_b``, ``x_c ...`` of the curves.  A joint whose path is an arc of a circle
is held by a link that turns about the circle's centre; one whose path is a straight segment is a slider; any other
moves with the coupler.  Held joints in the order of their letters are the ends of the coupler.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np

from sweep.evaluation.curves import coordinate
from sweep.report.figures import OPTIMUM, QUIET, REFERENCE, WIDTH, new_figure

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from sweep.families.base import Array

POSITIONS = 8
PATH = "#2f8f5b"
ON_PATH = 1e-6  # a path is taken for a circle or a line if it departs from it by less than this part of its size


@dataclass(frozen=True)
class Joint:
    """Path of one joint, (m, 3), and the point its link turns about, if there is one."""

    letter: str
    path: Array
    pivot: Array | None
    straight: bool


@dataclass(frozen=True)
class Stage:
    """Joints of one stage in the stage's own frame."""

    number: str
    held: list[Joint] = field(default_factory=list)
    free: list[Joint] = field(default_factory=list)

    @property
    def spatial(self) -> bool:
        """Whether the joints leave one plane."""
        points = np.vstack([j.path for j in (*self.held, *self.free)])
        return float(np.ptp(points[:, 2])) > 1e-9 * max(float(np.ptp(points)), 1e-300)


def stages(curve: pd.DataFrame) -> list[Stage]:
    """The stages whose joints stand in the columns, ordered by number."""
    found: dict[str, Stage] = {}
    for name in sorted(map(str, curve.columns)):
        at = coordinate(name)
        if at is None or at.axis != "x":
            continue
        joint = _joint(at.joint, _path(curve, name))
        stage = found.setdefault(at.part, Stage(at.part))
        (stage.held if joint.pivot is not None or joint.straight else stage.free).append(joint)
    # A chain offers its last stage's joints twice, numbered and not.
    return [found[number] for number in sorted(found) if number or len(found) == 1]


def _path(curve: pd.DataFrame, name: str) -> Array:
    """Path of the joint whose x stands in the column ``name``; a coordinate that is not there is 0."""
    beside = {at: str(column) for column in curve.columns if (at := coordinate(str(column)))}
    own = coordinate(name)
    assert own is not None
    columns = [beside.get(own._replace(axis=axis), "") for axis in "xyz"]
    return np.column_stack([curve[c].to_numpy(float) if c in curve else np.zeros(len(curve)) for c in columns])


def _joint(letter: str, path: Array) -> Joint:
    known = path[np.isfinite(path).all(axis=1)]
    if len(known) < 3:
        return Joint(letter, path, None, straight=False)
    middle = known.mean(axis=0)
    _, sizes, directions = np.linalg.svd(known - middle, full_matrices=False)
    if sizes[1] <= ON_PATH * sizes[0]:
        return Joint(letter, path, None, straight=True)
    if sizes[2] > ON_PATH * sizes[0]:
        return Joint(letter, path, None, straight=False)
    # Circle in the plane of the path: |p|^2 = 2 p.centre + const is linear in the unknowns.
    flat = (known - middle) @ directions[:2].T
    matrix = np.column_stack([2.0 * flat, np.ones(len(flat))])
    (x, y, _), *_ = np.linalg.lstsq(matrix, (flat**2).sum(axis=1), rcond=None)
    radii = np.hypot(flat[:, 0] - x, flat[:, 1] - y)
    if np.ptp(radii) > ON_PATH * radii.mean():
        return Joint(letter, path, None, straight=False)
    return Joint(letter, path, middle + np.array([x, y]) @ directions[:2], straight=False)


def mechanism_caption(curves: pd.DataFrame) -> str:
    """What the figure shows, of what there is to see."""
    drawn = [stages(turn) for _, turn in curves.groupby("role", sort=False)]
    every = [stage for found in drawn for stage in found]
    text = f"{POSITIONS} positions of the crank at equal steps, the first one bold."
    if any(joint.pivot is not None for stage in every for joint in stage.held):
        text += " Triangles: fixed pivots."
    if any(stage.held for stage in every):
        text += " Grey: paths of joints on a link that turns; green: paths of the others."
    if any(stage.spatial for stage in every):
        text += " Front: seen along z, the output axis of the stage; side: seen along x."
    if any(len(found) > 1 for found in drawn):
        text += (
            " Every stage is drawn in a frame of its own; equal numbers at the pivots are the same shaft. The chain"
            " fixes the angle by which that shaft drives the next stage (phi2 = kappa2 psi1 + offset2), but not where"
            " along the shaft that stage stands, nor how its frame is turned about it: both are left to the designer."
        )
    return text


def mechanism_figure(curves: pd.DataFrame, unit: str) -> Figure | None:
    """Every stage in several positions, result beside or above reference; a spatial stage in two projections."""
    drawn = [(str(role), stages(turn)) for role, turn in curves.groupby("role", sort=False)]
    drawn = [(role, found) for role, found in drawn if found]
    if not drawn:
        return None
    views = [
        (k, plane)
        for k in range(len(drawn[0][1]))
        for plane in (("xy", "zy") if any(found[k].spatial for _, found in drawn) else ("xy",))
    ]
    frames = [_frame([found[k] for _, found in drawn], plane) for k, plane in views]
    shapes = [min(max((right - left) / (top - bottom), 0.35), 3.0) for (left, right), (bottom, top) in frames]
    if len(views) == 1:  # one panel for each mechanism: side by side
        figure = new_figure(WIDTH, min((WIDTH / len(drawn) - 0.9) / shapes[0], 3.4) + 1.0)
        panels = figure.subplots(1, len(drawn), squeeze=False).T
    else:
        figure = new_figure(WIDTH, (min((WIDTH - 0.9 * len(views)) / sum(shapes), 3.4) + 1.25) * len(drawn))
        panels = figure.subplots(len(drawn), len(views), squeeze=False, width_ratios=shapes)
    for row, (role, found) in zip(panels, drawn, strict=True):
        for axes, (k, plane), frame in zip(row, views, frames, strict=True):
            shaft = k + 1 if len(found) > 1 else None
            _draw(axes, found[k], plane, REFERENCE if role == "reference" else OPTIMUM, unit, shaft)
            axes.set_xlim(frame[0])
            axes.set_ylim(frame[1])
            side = "" if len(views) == len(found) else {"xy": ", front", "zy": ", side"}[plane]
            axes.set_title(f"{role}\nstage {found[k].number}{side}" if found[k].number else f"{role}{side}")
    return figure


def small_figures(curves: pd.DataFrame, unit: str = "mm") -> dict[str, Figure]:
    """One small picture of every mechanism, its stages side by side as seen along z, all to the same scale."""
    drawn = [(str(role), stages(turn)) for role, turn in curves.groupby("role", sort=False)]
    drawn = [(role, found) for role, found in drawn if found]
    if not drawn:
        return {}
    count = len(drawn[0][1])
    frames = [_frame([found[k] for _, found in drawn], "xy") for k in range(count)]
    shapes = [min(max((right - left) / (top - bottom), 0.35), 3.0) for (left, right), (bottom, top) in frames]
    pictures = {}
    for role, found in drawn:
        figure = new_figure(0.5 * WIDTH, min((0.5 * WIDTH - 0.6 * count) / sum(shapes), 2.8) + 0.7)
        panels = figure.subplots(1, count, squeeze=False, width_ratios=shapes)[0]
        for k, (axes, frame) in enumerate(zip(panels, frames, strict=True)):
            _draw(axes, found[k], "xy", OPTIMUM, unit, k + 1 if count > 1 else None)
            axes.set_xlim(frame[0])
            axes.set_ylim(frame[1])
        pictures[role] = figure
    return pictures


def _frame(same: list[Stage], plane: str) -> tuple[tuple[float, float], tuple[float, float]]:
    """Limits of both axes that hold a stage of every mechanism drawn, so that their sizes can be compared."""
    columns = ["xyz".index(letter) for letter in plane]
    points = [j.path[:, columns] for stage in same for j in (*stage.held, *stage.free)]
    points += [j.pivot[None, columns] for stage in same for j in stage.held if j.pivot is not None]
    every = np.vstack(points)
    low, high = np.nanmin(every, axis=0), np.nanmax(every, axis=0)
    margin = 0.07 * float(max(high - low))
    return (float(low[0]) - margin, float(high[0]) + margin), (float(low[1]) - margin, float(high[1]) + margin)


def _draw(axes: Axes, stage: Stage, plane: str, colour: str, unit: str, shaft: int | None) -> None:
    """A stage seen in a plane; with ``shaft``, the number of its crank's shaft, the pivots are numbered from there."""
    columns = ["xyz".index(letter) for letter in plane]
    joints = [*stage.held, *stage.free]
    poses = np.linspace(0, len(joints[0].path), POSITIONS, endpoint=False).astype(int)
    for order, pose in enumerate(poses):
        first = order == 0
        style: dict[str, Any] = {"color": colour, "linewidth": 2.0 if first else 0.9, "alpha": 1.0 if first else 0.3}
        at = {joint.letter: joint.path[pose, columns] for joint in joints}
        for joint in stage.held:
            if joint.pivot is not None:
                axes.plot(*np.array([joint.pivot[columns], at[joint.letter]]).T, zorder=3, **style)
        coupler = [at[j.letter] for j in stage.held]
        if len(coupler) > 1:
            axes.plot(*np.array(coupler).T, zorder=3, **style)
        for joint in stage.free:
            for end in coupler:
                axes.plot(*np.array([end, at[joint.letter]]).T, zorder=3, **style)
        points = np.array(list(at.values()))
        axes.scatter(
            points[:, 0],
            points[:, 1],
            s=22 if first else 9,
            facecolors="white",
            edgecolors=colour,
            linewidths=1.3 if first else 0.8,
            alpha=1.0 if first else 0.5,
            zorder=6 if first else 5,
        )
    for joint in joints:
        line = joint.path[:, columns]
        free = joint in stage.free or joint.straight
        colour, width, layer = (PATH, 1.8, 4) if free else (QUIET, 0.7, 2)
        axes.plot(*np.vstack([line, line[:1]]).T, color=colour, linewidth=width, zorder=layer)
        if joint.pivot is not None:
            x, y = joint.pivot[columns]
            axes.scatter(x, y, marker="^", s=60, color="#333333", zorder=6)
            if shaft is not None:
                ring = {"boxstyle": "circle,pad=0.15", "facecolor": "white", "edgecolor": "#333333", "linewidth": 0.7}
                axes.annotate(str(shaft), (x, y), (6, 6), textcoords="offset points", bbox=ring, zorder=7)
                shaft += 1
    axes.set_aspect("equal", adjustable="box")
    axes.set_xlabel(f"{plane[0]} [{unit}]" if unit else plane[0])
    axes.set_ylabel(f"{plane[1]} [{unit}]" if unit else plane[1])
