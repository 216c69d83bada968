"""Figures of one design: its motion, the mechanism itself, the load on a bearing, its cyclogram."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from itertools import cycle
from typing import TYPE_CHECKING, Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from sweep.errors import InputError
from sweep.evaluation.angles import AngleUnit, grid_in_radians, in_radians
from sweep.evaluation.curves import motion_curves
from sweep.evaluation.cyclogram import cyclogram as table
from sweep.evaluation.joints import parts
from sweep.evaluation.poses import evaluate, pose_wants
from sweep.evaluation.tables import Table
from sweep.exchange.scene import VIEWS, exists, over, shown_name
from sweep.families import Mechanism
from sweep.families import family as find_family
from sweep.families.base import Array, Family, Interval
from sweep.plot.drawing import COLOURS, mechanism_figure
from sweep.quantities.units import speed_given
from sweep.report.figures import LIMIT, OPTIMUM, QUIET, REFERENCE, WIDTH, crank_axis, house_style, new_figure
from sweep.report.live import lowest, without_jumps
from sweep.report.quantities import LENGTHS, quantity

if TYPE_CHECKING:
    from matplotlib.axes import Axes


TURN = 360.0
BAR, THIN = 0.5, 0.16  # heights of strokes and dwells, relative to a row
FILLS = {"rises": OPTIMUM, "falls": "#a9c1df", "flies": "none", "low": QUIET, "high": QUIET}
KEY = {"rises": "rising stroke", "falls": "falling stroke", "flies": "flight of the foot"}


def _events(axes: Axes, events: pd.DataFrame, rows: int, made: Mapping[str, tuple[float, float]]) -> None:
    """Draw each event as a line, with its name above the rows, stacked so that names do not overlap."""
    named: Any = zip(events["name"], events["start"], strict=True)
    for k, (name, start) in enumerate(named):
        phi, height = math.degrees(start), rows - 0.35 + 0.34 * k
        axes.plot([phi, phi], [-0.6, height], color=LIMIT, linewidth=1.0, zorder=3, label="event")
        words = f"{name} {phi:.1f}°"
        if name in made:
            low, high = made[name]
            band = axes.fill_betweenx([-0.6, height], low, high, color=LIMIT, alpha=0.3, linewidth=0, zorder=1)
            band.set_label("event of 95 % of what is made")
            words += f" ({low:.2f} to {high:.2f}°)"
        side, place = ("right", phi - 3) if phi > 0.75 * TURN else ("left", phi + 3)
        clear = {"facecolor": "white", "edgecolor": "none", "pad": 0.5}  # lines of other events pass behind the text
        axes.text(place, height, words, ha=side, va="top", fontsize=8, zorder=4, bbox=clear)


POSES = 720
MOST_LINES = 20  # lines per panel


def motion(
    mechanism: Mechanism,
    design: Table,
    want: str | Sequence[str] | None = None,
    *,
    unit: str = "mm",
    speed: float | str | None = None,
    angles: AngleUnit | None = None,
    axes: Sequence[Axes] | Axes | None = None,
) -> NDArray[Any]:
    """Draw curves over one turn, one panel for each.

    Parameters
    ----------
    mechanism : as of :func:`sweep.joints`
    design : one design, or several as rows of a table: one line each, named by the table's index
    want : pose outputs, as a list or in one string separated by commas; by default position and derivatives, deviations
        and pressure angles
    unit : the length unit of the design, for the axes: mm, um, cm, m or in
    speed : speed of the driving shaft [rad/s], or a text such as "7000 rpm": adds scales of velocity, acceleration and
        jerk in time
    angles : the unit of the angles of ``design``, "rad" or "deg", as of :func:`sweep.evaluate`
    axes : axes of an existing figure to draw into, one for each curve

    Returns
    -------
    array of Axes
        in the order of ``want``.  Crank angles count from the lowest position if the follower has one

    Examples
    --------
    >>> import sweep
    >>> axes = sweep.plot.motion("slider_crank", {"a": 20.0, "b": 70.0, "e": 5.0}, "s, d2s")
    >>> [panel.get_title(loc="left") for panel in axes]
    ['displacement s, from its lowest [mm]', 'acceleration s″ [mm/rad²]']
    """
    family = find_family(mechanism)
    if isinstance(family.domain, Interval):
        raise InputError("mechanism", family.name, "a mechanism that turns: this one runs over an interval", "plot")
    if unit not in LENGTHS:
        raise InputError("unit", unit, ", ".join(LENGTHS), "plot")
    names = list(dict.fromkeys(motion_curves(family))) if want is None else pose_wants(family, want)
    phi = np.arange(POSES) * (2.0 * math.pi / POSES)
    design = in_radians(family, design, angles)
    poses = evaluate(mechanism, design, list(dict.fromkeys([*names, family.position])), phi=phi, angles="rad")
    index = design.index if isinstance(design, pd.DataFrame) else range(int(poses["design"].iloc[-1]) + 1)
    if not 1 <= len(index) <= MOST_LINES:
        raise InputError("design", f"{len(index)} rows", f"1 to {MOST_LINES} designs", f"table of {family.name}")
    panels = None if axes is None else list(np.atleast_1d(np.array(axes, dtype=object)).ravel())
    if panels is not None and len(panels) != len(names):
        raise InputError("axes", len(panels), f"{len(names)}, one for each of {', '.join(names)}", "plot")
    labels = [str(name) if isinstance(name, str) else f"design {name}" for name in index]
    with house_style():
        turns = list(zip(labels, (turn for _, turn in poses.groupby("design")), strict=True))
        return _panels(family, names, turns, unit, speed_given(speed), panels)


def _panels(
    family: Family, names: list[str], turns: Sequence[tuple[str, pd.DataFrame]], unit: str, speed: float | None,
    panels: list[Any] | None,
) -> NDArray[Any]:  # fmt: skip
    """Draw curves over the crank angle from the lowest position, so that several designs can be compared."""
    if panels is None:
        figure = new_figure(WIDTH, 2.1 * -(-len(names) // 2) + 0.5)
        grid = np.atleast_1d(figure.subplots(-(-len(names) // 2), 2)).ravel().tolist()
        for axes in grid[len(names) :]:
            axes.set_axis_off()
        panels = grid[: len(names)]
    free = any(lowest(family.position, turn[family.position].to_numpy(float))[1] for _, turn in turns)
    for axes, name in zip(panels, names, strict=True):
        shown = quantity(name, family.pose_output[name].unit.replace("length", unit))
        for (design, turn), colour in zip(turns, cycle(COLOURS)):
            angle, values = aligned_turn(turn, name, family.position)
            look = {"color": REFERENCE, "linestyle": "--"} if design == "reference" else {"color": colour}
            axes.plot(np.degrees(angle), values * shown.factor, label=design, zorder=3, **look)
        below = ", from its lowest" if name == family.position and not free else ""
        axes.set_title(f"{shown.heading}{below} [{shown.unit}]" if shown.unit else f"{shown.heading}{below}")
        if speed is not None and shown.order:
            scale = shown.speed_scale * speed**shown.order / shown.factor
            twin = axes.secondary_yaxis("right", functions=(lambda v, k=scale: v * k, lambda v, k=scale: v / k))
            twin.set_ylabel(shown.speed_unit)
        crank_axis(axes, "crank angle [°]" if free else "crank angle from the lowest position [°]")
    if len(turns) > 1:
        panels[0].legend()
    return np.array(panels, dtype=object)


def aligned_turn(turn: pd.DataFrame, name: str, position: str) -> tuple[Array, Array]:
    """Return one closed turn that starts at the smallest position; the position itself is relative to it."""
    phi, values = turn["phi"].to_numpy(float), turn[name].to_numpy(float)
    path, free, start = lowest(position, turn[position].to_numpy(float))
    if name == position:
        values = path
    if free:
        full = np.copysign(2.0 * np.pi, path[-1] - path[0]) if name == position else 0.0
        return np.append(phi, 2.0 * np.pi), np.append(values, values[0] + full)
    order = np.r_[start : phi.size, 0:start]
    values = without_jumps(name, values[order]) - (values[start] if name == position else 0.0)
    return np.append(np.mod(phi[order] - phi[start], 2.0 * np.pi), 2.0 * np.pi), np.append(values, values[0])


def cyclogram(
    mechanism: Mechanism,
    design: Table,
    *,
    dwell: float = 0.02,
    angles: AngleUnit | None = None,
    made: Mapping[str, tuple[float, float]] | None = None,
) -> Axes:
    """Draw the motion of all members of a machine over one turn: strokes, dwells and events; :func:`sweep.cyclogram`.

    Parameters
    ----------
    mechanism, design, dwell, angles : as of :func:`sweep.cyclogram`
    made : interval [deg] of manufactured mechanisms' events by event name, drawn as a band

    Returns
    -------
    Axes
        a row of bars for each member: rising strokes dark, falling light, flights hatched, dwells beneath, events lines

    Examples
    --------
    >>> import sweep
    >>> axes = sweep.plot.cyclogram("slider_crank", {"a": 20.0, "b": 70.0, "e": 5.0})
    >>> axes.get_xlabel()
    'angle of the main shaft [°]'
    """
    rows = table(mechanism, design, dwell=dwell, angles=angles)
    with house_style():
        members = list(dict.fromkeys(rows["member"][rows["kind"] != "event"]))
        events = rows[rows["kind"] == "event"]
        figure = new_figure(WIDTH, 0.62 * len(members) + 1.3 + 0.14 * len(events))
        axes = figure.subplots()
        spans: Any = zip(*(rows[column] for column in ("member", "kind", "name", "start", "end")), strict=True)
        for member, kind, name, begin, end in spans:
            if kind == "event":
                continue
            height = len(members) - 1 - members.index(member)
            start, length = math.degrees(begin), math.degrees(end - begin) % TURN
            bottom, high = (height - 0.5 * BAR - THIN - 0.04, THIN) if kind == "dwell" else (height - 0.5 * BAR, BAR)
            pieces = [(start, min(length, TURN - start)), (0.0, max(start + length - TURN, 0.0))]
            bars = axes.broken_barh(pieces, (bottom, high), facecolor=FILLS[name], linewidth=0, zorder=2)
            bars.set(edgecolor=LIMIT, hatch="/////" if kind == "flight" else None, label=KEY.get(name, "dwell"))
        _events(axes, events, len(members), made or {})
        axes.set_yticks(range(len(members)), members[::-1])
        axes.set_ylim(-0.6, len(members) - 0.3 + 0.34 * len(events))
        crank_axis(axes, "angle of the main shaft [°]")
        handles, labels = axes.get_legend_handles_labels()
        once = dict(zip(labels, handles, strict=True))
        figure.legend(once.values(), once.keys(), loc="outside lower center", ncols=len(once))
        return axes


def mechanism(
    mechanism: Mechanism,
    design: Table,
    phi: float = 0.0,
    *,
    view: str | None = None,
    positions: int = 1,
    unit: str = "mm",
    angles: AngleUnit | None = None,
) -> NDArray[Any]:
    """Draw the mechanism in one or several positions with paths of its joints, axes and senses; a panel per frame.

    Parameters
    ----------
    mechanism, design : as of :func:`sweep.joints`
    phi : angle of the driving shaft [rad]; over an interval the value of its variable
    view : "space", from a corner with z upwards, or "xy", "zy", "xz"; by default "space" for a spatial mechanism
    positions : number of positions drawn at equal steps over the turn; the first stands out.  The report draws 8
    unit : the length unit of the design, for the axes
    angles : the unit of the angles of ``design`` and ``phi``, "rad" or "deg", as of :func:`sweep.evaluate`

    Returns
    -------
    array of Axes
        one for each frame: stages of a chain have their own, placed members of a machine one in common

    Examples
    --------
    >>> import sweep
    >>> (axes,) = sweep.plot.mechanism("slider_crank", {"a": 20.0, "b": 70.0, "e": 5.0}, phi=0.8)
    >>> axes.get_xlabel()
    'x [mm]'
    """
    if view is not None and view != "space" and view not in VIEWS:
        raise InputError("view", view, f"space, {', '.join(VIEWS)}", "plot")
    family = find_family(mechanism)
    design = in_radians(family, design, angles)
    start = float(np.asarray(grid_in_radians(family.domain, phi, angles), np.float64))
    stages = over(mechanism, design, start, 180)
    if not exists(stages):
        raise InputError("design", dict(stages[0].parameters), "one with a pose in which all its joints exist", "plot")
    with house_style():
        figure = mechanism_figure(stages, unit, view, positions)
    return np.array(figure.axes, dtype=object)


def polar_load(
    mechanism: Mechanism,
    design: Table,
    joint: str = "a",
    *,
    member: str = "",
    stage: str = "",
    angles: AngleUnit | None = None,
) -> Axes:
    """Draw the force on a link at a fixed axis over one turn, its direction as the angle, its size as the radius.

    Parameters
    ----------
    mechanism : a family or chain that has joint loads (`sweep effects kinetostatics`)
    design : its parameters with masses, inertias and ``speed`` of the load effects, docs/effects.md
    joint : "a", the frame's force on the crank, or "d", that on the rocker
    member, stage : name of the member of a machine, number of the stage of a chain
    angles : the unit of the angles of ``design``, "rad" or "deg", as of :func:`sweep.evaluate`

    Returns
    -------
    Axes
        polar; the angle is counted right-handed about the axis, from x of the frame projected perpendicular to the axis
        [force unit of the masses: N if lengths are mm and masses t]

    Raises
    ------
    InputError
        for a joint without an axis, a family without joint loads, or a missing mass or speed.

    Examples
    --------
    >>> import sweep
    >>> design = {"a": 10.0, "b": 40.0, "c": 25.0, "e": 35.0, "f": 5.0, "g": -3.0, "alpha": 1.0}
    >>> masses = {"m_crank": 1e-4, "m_coupler": 2e-4, "m_rocker": 1.5e-4, "speed": 100.0}  # t, rad/s
    >>> sweep.plot.polar_load("rssr", design | masses, "a").get_title(loc="left")
    'force at A [N], marks: crank angle'
    """
    design = in_radians(find_family(mechanism), design, angles)
    names = find_family(mechanism).parameter_names  # parts have no use for masses and speed
    own = {str(key): values for key, values in design.items() if str(key) in names}
    selected = [part for part in parts(mechanism, own, 0.0) if part.member == member and part.stage == stage]
    axes_here = [name for part in selected for name, kind in part.kinds.items() if kind == "axis"]
    if joint not in axes_here:
        allowed = f"a joint with an axis: {', '.join(axes_here) or 'none here; name member and stage'}"
        raise InputError("joint", joint, allowed, "plot")
    axis = selected[0].axes[joint]
    first = np.array([1.0, 0.0, 0.0]) if abs(axis[0]) < 0.9 else np.array([0.0, 1.0, 0.0])
    first = first - (first @ axis) * axis
    first /= np.linalg.norm(first)
    prefix = f"{member}." if member else ""
    forces = [f"{prefix}force_{joint}_{letter}{stage}" for letter in "xyz"]
    phi = np.arange(POSES) * (2.0 * math.pi / POSES)
    force = evaluate(mechanism, design, forces, phi=phi, angles="rad")[forces].to_numpy(np.float64)
    along, across = force @ first, force @ np.cross(axis, first)
    with house_style():
        figure = new_figure(5.0, 5.0)
        axes = figure.subplots(subplot_kw={"projection": "polar"})
        angle, size = np.arctan2(across, along), np.hypot(along, across)
        axes.plot(np.append(angle, angle[:1]), np.append(size, size[:1]), color=OPTIMUM)
        for k in range(0, POSES, POSES // 8):
            axes.annotate(f"{360 * k // POSES}°", (angle[k], size[k]), fontsize="small")
            axes.plot(angle[k], size[k], "o", color=OPTIMUM, markersize=3)
        axes.set_title(f"force at {shown_name(joint)} [N], marks: crank angle")
    return axes
