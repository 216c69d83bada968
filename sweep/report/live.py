"""Data of the interactive page: designs in motion and feasible designs as numbers, and the scripts that show them.

The scripts are in ``templates/live``.  Lists of numbers are base64 of little-endian float32.
"""

from __future__ import annotations

import base64
import json
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from kernels import status as codes
from sweep.dataset.chunk_files import batches
from sweep.errors import InputError
from sweep.evaluation.curves import motion_curves
from sweep.evaluation.joints import Part, parts
from sweep.exchange.scene import extent, is_spatial, shown_name, side_by_side
from sweep.families.base import Angles, Array, Family, Interval, Turn
from sweep.families.names import is_flag, is_largest, reduced, stem
from sweep.families.poses import equal_steps
from sweep.quantities.limits import compared
from sweep.report.dataset import Dataset
from sweep.report.optima import DistinctOptimum, Shown, shown_designs
from sweep.report.quantities import ShownQuantity, quantity
from sweep.report.scan import Cells
from sweep.report.tables import limited
from sweep.study import Limit

SPATIAL, PLANE = ("live/three.min.js", "live/view.js"), ("live/charts.js", "live/lines.js", "live/page.js")


def live(data: Dataset, cells: Sequence[Cells], different: Sequence[DistinctOptimum]) -> dict[str, Any]:
    """Return the template's variables for both interactive sections as JSON, empty if there is nothing to show."""
    designs = shown_designs(data, different)
    motion = moving(data, designs)
    lines = parallel(data, cells, designs)
    return {
        "shown": designs,
        "live_designs": [(design.name, design.role) for design in designs],
        "motion_data": "" if motion is None else embedded(motion),
        "axis": "" if motion is None else motion["axis"],
        "sides": motion is not None and len({tuple(part["shift"]) for part in motion["designs"][0]["parts"]}) > 1,
        "lines_data": "" if lines is None else embedded(lines),
        "lines_axes": [] if lines is None else [axis["label"] for axis in lines["axes"]],
        "scripts": scripts_of(motion) if motion or lines else [],
    }


def scripts_of(motion: Mapping[str, Any] | None) -> list[str]:
    """Return the scripts that a page needs, the large one only for a spatial mechanism."""
    spatial = motion is not None and motion["size"] > 0.0
    return [*(SPATIAL if spatial else ()), *PLANE]


def embedded(values: dict[str, Any]) -> str:
    """Return JSON for a script element, in which no character can end the element."""
    return json.dumps(values, ensure_ascii=False, allow_nan=False, separators=(",", ":")).replace("<", "\\u003c")


FAR_LIMIT = 2.5  # limits farther out than this multiple of the curves are not drawn, since the curves would look flat
ROUNDING = 1e-11  # angle [rad] below which a curve shows rounding errors only: it is drawn as 0


def in_window(path: Array, window: tuple[float, float]) -> NDArray[np.bool_]:
    """Return a mask of poses whose position lies between two fractions of the stroke, from its smallest value."""
    low, high = np.nanmin(path), np.nanmax(path)
    fraction = (path - low) / (high - low) if high > low else np.zeros_like(path)
    return (fraction >= window[0]) & (fraction <= window[1])


FOLLOWERS = ("psi", "alpha")  # positions that are angles


def without_jumps(name: str, path: Array) -> Array:
    """Return a follower's angle without jumps of a turn; any other curve unchanged."""
    finite = np.isfinite(path)
    unwrapped = path.copy()
    unwrapped[finite] = np.unwrap(path[finite]) if stem(name) in FOLLOWERS else path[finite]
    return unwrapped


def lowest(position: str, path: Array) -> tuple[Array, bool, int]:
    """Find the pose from which the curves of a follower are shown: its lowest position, unless it turns fully.

    Returns
    -------
    path, bool, int
        path without the jumps of an angle; whether the follower turns fully; number of the pose, 0 if it turns fully.
    """
    path = without_jumps(position, path)
    free = stem(position) in FOLLOWERS and bool(abs(path[-1] - path[0]) > 0.9 * 2.0 * np.pi)
    return path, free, int(np.nanargmin(path)) if not free and np.isfinite(path).any() else 0


def limit_values(name: str, limits: tuple[Limit, ...]) -> list[float]:
    """Return the limits of a curve itself as ordinates in stored units, both signs for a limit on magnitude."""
    values = []
    above, below = (reduced("max_abs", name), reduced("max", name)), (reduced("min", name),)
    for limit in limits:
        for value, outputs in ((limit.maximum, above), (limit.minimum, below)):
            if value is None or limit.output not in outputs:
                continue
            two_sided = is_largest(limit.output, magnitude=True) and stem(name) != "pressure_angle"
            values += [value, -value] if two_sided else [value]
    return values


POSES = 240
AROUND = 1.25  # range of a panel relative to the largest deviation that counts


@dataclass(frozen=True)
class Motion:
    """A design over its turn or interval, in stored units.

    Parameters
    ----------
    shown : the design
    phi : values of the input variable, (m,)
    from_lowest : whether turn and position are counted from the lowest position, which a full turn does not have
    curves : by name, (m,) each
    inside : mask of poses in which a deviation counts, (m,)
    placed : stages and members with their joints, empty for a mechanism without joints
    """

    shown: Shown
    phi: Array
    from_lowest: bool
    curves: dict[str, Array]
    inside: NDArray[np.bool_]
    placed: tuple[Part, ...]


def moving(data: Dataset, shown: Sequence[Shown]) -> dict[str, Any] | None:
    """Return the data of the moving designs; None if the study wants no curves or has no design to show."""
    if not shown or data.study.output.curves == "none":
        return None
    family = data.study.family
    names = list(dict.fromkeys(motion_curves(family)))
    motions = [_motion(data, placed, names) for placed in shown]
    interval = isinstance(family.domain, Interval)
    phase = " from the lowest position" if all(motion.from_lowest for motion in motions) else ""
    variable = quantity(family.domain.name, family.domain.unit)
    joints = [part for motion in motions for part in motion.placed]
    designs = [_design(data, motion, variable.factor) for motion in motions]
    return {
        "closed": not interval,
        "axis": f"{family.domain.text}{phase}",
        "unit": variable.unit,
        "size": max(design["size"] for design in designs),
        "draggable": bool(joints) and not is_spatial(joints) and isinstance(family.domain, Turn),
        "curves": [_panel(data, name, motions) for name in names],
        "designs": designs,
    }


def _motion(data: Dataset, shown: Shown, names: list[str]) -> Motion:
    """Return the motion of a design from its lowest position on, as in the static figure."""
    family = data.study.family
    design = data.design(shown.row)
    matrix = np.array([list(design.values())])
    phi = equal_steps(family.domain, matrix, POSES)
    windowed = next((family.follower(o.name) for o in family.pose_outputs if o.windowed), family.position)
    poses = family.poses(matrix, Angles.of(phi[None, :]), frozenset([*names, family.position, windowed]))
    path = np.asarray(poses[family.position][0], np.float64)
    closed, free, start = not isinstance(family.domain, Interval), False, 0
    if closed:
        path, free, start = lowest(family.position, path)
    order = np.roll(np.arange(POSES), -start)
    curves = {name: without_jumps(name, np.asarray(poses[name][0], np.float64)[order]) for name in names}
    from_lowest = closed and not free
    curves[family.position] = path[order] - (path[start] if from_lowest else 0.0)
    window = data.study.window
    working = curves[windowed] if windowed in curves else np.asarray(poses[windowed][0], np.float64)[order]
    inside = np.zeros(POSES, np.bool_) if window is None else in_window(working, window)
    return Motion(shown, phi[order], from_lowest, curves, inside, _placed(family, design, phi, order))


def _placed(family: Family, design: dict[str, float], phi: Array, order: NDArray[np.intp]) -> tuple[Part, ...]:
    """Return stages and members with their joints in the order of the poses; a march is computed in its own order."""
    try:
        stages = parts(family, design, phi)
    except InputError:  # a mechanism without joints has curves only
        return ()
    stages = [replace(part, joints={name: path[order] for name, path in part.joints.items()}) for part in stages]
    assembled = [part for part in stages if any(np.isfinite(path).all() for path in part.joints.values())]
    return tuple(side_by_side(assembled)) if assembled else ()


def _panel(data: Dataset, name: str, motions: list[Motion]) -> dict[str, Any]:
    """Return the panel of one curve: title, unit, limits and range."""
    shown = data.shown(name)
    speed = data.study.speed
    windowed = data.study.window is not None and data.study.family.pose_output[name].windowed
    values = np.concatenate([m.curves[name][m.inside if windowed else np.ones(POSES, np.bool_)] for m in motions])
    values = values[np.isfinite(values)]
    low, high = (float(values.min()), float(values.max())) if values.size else (0.0, 0.0)
    most = FAR_LIMIT * max(abs(low), abs(high))
    lines = [value for value in limit_values(name, data.study.limits) if abs(value) <= most]
    low, high = min([low, *lines]), max([high, *lines])
    if shown.unit == "°" and max(abs(low), abs(high)) < ROUNDING:
        low = high = 0.0
    if windowed:
        high = AROUND * max(abs(low), abs(high))
        low = -high
    fast = shown.order and speed is not None
    relative = name == data.study.family.position and any(m.from_lowest for m in motions)
    return {
        "name": name,
        "title": shown.heading + (", from its lowest" if relative else ""),
        "unit": shown.unit,
        "range": [low * shown.factor, high * shown.factor],
        "limits": [value * shown.factor for value in lines],
        "fast": {"unit": shown.speed_unit, "factor": shown.speed_scale * (speed or 0.0) ** shown.order / shown.factor}
        if fast
        else None,
    }


def _design(data: Dataset, motion: Motion, factor: float) -> dict[str, Any]:
    shown = {name: data.shown(name) for name in motion.curves}
    return {
        "name": motion.shown.name,
        "role": motion.shown.role,
        "note": motion.shown.note,
        "phi": packed(motion.phi * factor),
        "curves": {name: packed(values * shown[name].factor) for name, values in motion.curves.items()},
        "shaded": runs(motion.inside),
        "size": extent(motion.placed) if motion.placed else 0.0,
        "parts": [_part(part) for part in motion.placed],
    }


def _part(part: Part) -> dict[str, Any]:
    """Return joints over the poses, fixed ones once, with axes, kinds and links by the names that the page shows."""
    name = {joint: f"{shown_name(joint)}{part.stage}" for joint in part.joints}
    return {
        "label": part.label if part.member or part.stage else "",
        "shift": part.shift.tolist(),
        "joints": {
            name[joint]: packed(path[:1] if joint in part.kinds else path) for joint, path in part.joints.items()
        },
        "kinds": {name[joint]: kind for joint, kind in part.kinds.items()},
        "axes": {name[joint]: axis.tolist() for joint, axis in part.axes.items()},
        "links": [{"name": link.name, "joints": [name[joint] for joint in link.joints]} for link in part.links],
    }


def runs(inside: NDArray[np.bool_]) -> list[list[int]]:
    """Return intervals of poses that are inside, as first and last pose."""
    edges = np.flatnonzero(np.diff(np.concatenate([[False], inside, [False]]).astype(np.int8)))
    return [[int(first), int(after) - 1] for first, after in edges.reshape(-1, 2)]


def packed(values: ArrayLike) -> str:
    """Return numbers as base64 of little-endian float32, a third of the size of decimal digits."""
    return base64.b64encode(np.ascontiguousarray(values, "<f4").tobytes()).decode("ascii")


BEST, SPREAD = 250, 550  # number of lines for the best designs, and for designs spaced evenly among the others
DIMENSIONS, OUTPUTS = 9, 4
CONSTANT = 1e-12


def parallel(data: Dataset, cells: Sequence[Cells], shown: Sequence[Shown]) -> dict[str, Any] | None:
    """Return lines, their axes and the named designs among them; None without two designs to compare.

    A line's number is that of the column ``design``, by which ``sweep export`` finds the design.
    """
    axes = _axes(data, cells)
    if len(axes) < 2:
        return None
    objective = data.objective
    of = data.counts.get(codes.OK, 0)
    names, best = [axis.name for axis in axes], None if objective is None else objective.name
    numbers, values = _lines(data.parts, names, best, of)
    if len(numbers) < 2:
        return None
    varying = np.ptp(values, axis=0) > CONSTANT * np.abs(values).max(axis=0)
    axes, values = [axis for axis, varies in zip(axes, varying, strict=True) if varies], values[:, varying]
    if len(axes) < 2:
        return None
    named = [item for item in shown if item.role != "front"]
    marks = [[float(item.row.get(axis.name, np.nan)) * axis.factor for axis in axes] for item in named]
    return {
        "axes": [{"name": x.name, "symbol": x.symbol, "unit": x.unit, "label": x.label} for x in axes],
        "objective": next((k for k, axis in enumerate(axes) if objective and axis.name == objective.name), -1),
        "numbers": numbers.tolist(),
        "values": packed(values * [axis.factor for axis in axes]),
        "designs": [
            {"name": x.name, "role": x.role, "values": packed(mark)} for x, mark in zip(named, marks, strict=True)
        ],
        "of": of,
    }


def _axes(data: Dataset, cells: Sequence[Cells]) -> list[ShownQuantity]:
    """Return the axes: swept dimensions, objective and limited outputs; without an objective the wanted outputs."""
    study = data.study
    objective = study.want if study.objective is None else [study.objective.output]
    second = [] if data.second is None else [data.second]
    stored = set(data.units) | set(study.want)
    limits = [limit.output for limit in study.limits if limit.output in study.want and not is_flag(limit.output)]
    dimensions = [limited(data, cell.name) for cell in cells][:DIMENSIONS]
    names = {axis.name for axis in dimensions}  # a prescribed output of [locus] is a dimension
    outputs = [name for name in dict.fromkeys([*objective, *second, *limits]) if name in stored and not is_flag(name)]
    return [*dimensions, *[data.shown(name) for name in outputs if name not in names][:OUTPUTS]]


def _lines(parts: Sequence[Path], names: list[str], objective: str | None, of: int) -> tuple[NDArray[np.int64], Array]:
    """Return numbers and values of the best designs, and of evenly spaced others, among ``of`` feasible designs."""
    step = max(1, -(-of // SPREAD))
    rows_before = 0
    numbers, values = np.empty(0, np.int64), np.empty((0, len(names)))
    best_numbers, best_values = numbers, values
    for batch_numbers, table in _feasible(parts, names):
        picked = slice(-rows_before % step, None, step)
        numbers, values = np.concatenate([numbers, batch_numbers[picked]]), np.vstack([values, table[picked]])
        rows_before += batch_numbers.size
        if objective is not None:
            best_numbers, best_values = np.concatenate([best_numbers, batch_numbers]), np.vstack([best_values, table])
            order = np.argsort(compared(objective, best_values[:, names.index(objective)]), kind="stable")[:BEST]
            best_numbers, best_values = best_numbers[order], best_values[order]
    numbers, first = np.unique(np.concatenate([numbers, best_numbers]), return_index=True)
    return numbers, np.vstack([values, best_values])[first]


def _feasible(parts: Sequence[Path], names: list[str]) -> Iterator[tuple[NDArray[np.int64], Array]]:
    """Yield batches of feasible designs with finite values: numbers, and values (n, names)."""
    for batch in batches(parts, ["design", *names, "status"]):
        table = np.column_stack([np.asarray(batch[name], np.float64) for name in names])
        good = np.flatnonzero((np.asarray(batch["status"]) == 0) & np.isfinite(table).all(axis=1))
        yield np.asarray(batch["design"])[good], table[good]
