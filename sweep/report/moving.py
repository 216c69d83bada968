"""Designs in motion as numbers for the page: joints and links in every pose, curves over the turn.

The scripts in ``templates/live`` read them.  Lists of numbers are base64 of little-endian float32.
"""

from __future__ import annotations

import base64
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sweep.errors import InputError
from sweep.evaluation.curves import motion_curves
from sweep.evaluation.joints import Part, parts
from sweep.exchange.scene import Placed, extent, shown_name, side_by_side
from sweep.families.base import Angles, Array, Family
from sweep.families.domain import Interval, equal_steps
from sweep.report.curves import FAR_LIMIT, in_window, is_angle, limit_values, shown_curves, turns_fully
from sweep.report.quantities import quantity

if TYPE_CHECKING:
    from sweep.report.alternatives import Shown
    from sweep.report.dataset import Dataset

POSES = 240
AROUND = 1.25  # a panel reaches so far beyond the deviation that counts


@dataclass(frozen=True)
class Motion:
    """A design over its turn or interval, in stored units.

    Parameters
    ----------
    shown : the design
    phi : values of the input variable, (m,)
    free : the follower turns fully, so that there is no lowest position to start from
    curves : by name, (m,) each
    inside : poses in which a deviation counts, (m,)
    placed : stages and members with their joints, empty where the mechanism has none
    """

    shown: Shown
    phi: Array
    free: bool
    curves: dict[str, Array]
    inside: NDArray[np.bool_]
    placed: tuple[Placed, ...]


def moving(data: Dataset, shown: Sequence[Shown]) -> dict[str, Any] | None:
    """Return what the page moves; None where the study wants no curves or has no design to show."""
    if not shown or data.study.output.curves == "none":
        return None
    family = data.study.family
    names = shown_curves(list(motion_curves(family)), family.position)
    motions = [_motion(data, one, names) for one in shown]
    interval = isinstance(family.domain, Interval)
    phase = "" if interval or any(motion.free for motion in motions) else " from the lowest position"
    variable = quantity(family.domain.name, family.domain.unit)
    joints = [one.part for motion in motions for one in motion.placed]
    return {
        "closed": not interval,
        "axis": f"{family.domain.text}{phase}",
        "unit": variable.unit,
        "size": extent(joints) if joints else 0.0,
        "curves": [_panel(data, name, motions) for name in names],
        "designs": [_design(data, motion, variable.factor) for motion in motions],
    }


def _motion(data: Dataset, shown: Shown, names: list[str]) -> Motion:
    """Return a design from its lowest position on, as the static figure has it."""
    family = data.study.family
    design = {name: float(shown.row[name]) for name in family.parameter_names}
    matrix = np.array([list(design.values())])
    phi = equal_steps(family.domain, matrix, POSES)
    found = family.poses(matrix, Angles.of(phi[None, :]), frozenset([*names, family.position]))
    path = np.asarray(found[family.position][0], np.float64)
    closed = not isinstance(family.domain, Interval)
    if closed and is_angle(family.position):
        path = np.unwrap(path)
    free = closed and is_angle(family.position) and turns_fully(path)
    counted = closed and not free and bool(np.isfinite(path).any())
    start = int(np.nanargmin(path)) if counted else 0
    order = np.roll(np.arange(POSES), -start)
    curves = {name: np.asarray(found[name][0], np.float64)[order] for name in names}
    curves[family.position] = path[order] - (path[start] if counted else 0.0)
    window = data.study.window
    inside = np.zeros(POSES, np.bool_) if window is None else in_window(curves[family.position], window)
    return Motion(shown, phi[order], free, curves, inside, _placed(family, design, phi, order))


def _placed(family: Family, design: dict[str, float], phi: Array, order: NDArray[np.intp]) -> tuple[Placed, ...]:
    """Return stages and members with their joints in the order of the poses; a march is made in its own order."""
    try:
        found = parts(family, design, phi)
    except InputError:  # a mechanism without joints has curves only
        return ()
    found = [replace(part, joints={name: path[order] for name, path in part.joints.items()}) for part in found]
    known = [part for part in found if any(np.isfinite(path).all() for path in part.joints.values())]
    return tuple(side_by_side(known)) if known else ()


def _panel(data: Dataset, name: str, motions: list[Motion]) -> dict[str, Any]:
    """Return one curve: words, unit, limits, the range that its panel shows."""
    shown = quantity(name, data.units.get(name, ""))
    speed = data.study.speed
    windowed = name == "dev" and data.study.window is not None
    values = np.concatenate([m.curves[name][m.inside if windowed else np.ones(POSES, np.bool_)] for m in motions])
    values = values[np.isfinite(values)]
    low, high = (float(values.min()), float(values.max())) if values.size else (0.0, 0.0)
    most = FAR_LIMIT * max(abs(low), abs(high))
    lines = [value for value in limit_values(name, data.study.limits) if abs(value) <= most]
    low, high = min([low, *lines]), max([high, *lines])
    if windowed:
        high = AROUND * max(abs(low), abs(high))
        low = -high
    fast = shown.order and speed is not None
    return {
        "name": name,
        "title": shown.heading,
        "unit": shown.unit,
        "range": [low * shown.factor, high * shown.factor],
        "limits": [value * shown.factor for value in lines],
        "fast": {"unit": shown.speed_unit, "factor": shown.speed_scale * (speed or 0.0) ** shown.order / shown.factor}
        if fast
        else None,
    }


def _design(data: Dataset, motion: Motion, factor: float) -> dict[str, Any]:
    shown = {name: quantity(name, data.units.get(name, "")) for name in motion.curves}
    return {
        "name": motion.shown.name,
        "role": motion.shown.role,
        "note": motion.shown.note,
        "phi": packed(motion.phi * factor),
        "curves": {name: packed(values * shown[name].factor) for name, values in motion.curves.items()},
        "shaded": runs(motion.inside),
        "size": extent([one.part for one in motion.placed]) if motion.placed else 0.0,
        "parts": [_part(one) for one in motion.placed],
    }


def _part(one: Placed) -> dict[str, Any]:
    """Return joints over the poses, fixed ones once; axes, kinds and links by the names that the page shows."""
    part: Part = one.part
    name = {joint: f"{shown_name(joint)}{part.stage}" for joint in part.joints}
    return {
        "label": part.label if part.member or part.stage else "",
        "shift": one.shift.tolist(),
        "joints": {
            name[joint]: packed(path[:1] if joint in part.kinds else path) for joint, path in part.joints.items()
        },
        "kinds": {name[joint]: kind for joint, kind in part.kinds.items()},
        "axes": {name[joint]: axis.tolist() for joint, axis in part.axes.items()},
        "links": [{"name": link.name, "joints": [name[joint] for joint in link.joints]} for link in part.links],
    }


def runs(inside: NDArray[np.bool_]) -> list[list[int]]:
    """Return runs of poses that are inside, as first and last pose."""
    edges = np.flatnonzero(np.diff(np.concatenate([[False], inside, [False]]).astype(np.int8)))
    return [[int(first), int(after) - 1] for first, after in edges.reshape(-1, 2)]


def packed(values: ArrayLike) -> str:
    """Return numbers as base64 of little-endian float32: a third of the room of decimal digits."""
    return base64.b64encode(np.ascontiguousarray(values, "<f4").tobytes()).decode("ascii")
