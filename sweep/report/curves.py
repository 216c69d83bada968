"""The motion over one turn, optimum against reference: its numbers where no optimiser left them, and its picture."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from sweep.evaluation.curves import coordinate, joint_curves, motion_curves
from sweep.evaluation.summaries import design_outputs
from sweep.evaluation.tables import design_matrix
from sweep.families.base import Angles
from sweep.families.domain import Interval
from sweep.families.names import is_largest, reduced, stem
from sweep.report.figures import LIMIT, OPTIMUM, REFERENCE, WIDTH, crank_axis, new_figure
from sweep.report.quantities import Quantity, quantity

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from sweep.families.base import Array
    from sweep.report.dataset import Dataset
    from sweep.study import Limit, Study


FAR_LIMIT = 2.5  # limits farther out than so many times the curves are not drawn: the curves would be flat
NOT_CURVES = ("role", "phi", "status")


OTHERS = (OPTIMUM, "#2f8f5b", "#7a4fa3", "#14808f", "#8c6d1f")


def styles_of(roles: Iterable[str]) -> dict[str, dict[str, Any]]:
    """Return styles of lines: the reference is dashed, the others are solid and differ in colour."""
    others = [role for role in roles if role != "reference"]
    found: dict[str, dict[str, Any]] = {role: {"color": OTHERS[k % len(OTHERS)]} for k, role in enumerate(others)}
    return found | {"reference": {"color": REFERENCE, "linestyle": (0, (4, 2))}}


def shown_curves(columns: list[str], position: str) -> list[str]:
    """Columns that get a panel, in the order in which they stand: the position, and all that are no coordinates."""
    return [name for name in columns if name not in NOT_CURVES and (name == position or coordinate(name) is None)]


def motion_figure(
    curves: pd.DataFrame,
    units: dict[str, str],
    position: str,
    speed: float | None,
    limits: tuple[Limit, ...],
    window: tuple[float, float] | None,
    names: list[str] | None = None,
    given: Sequence[Any] | None = None,
) -> Sequence[Any]:
    """Panels over the crank angle from the lowest position, so that two mechanisms can be laid over each other.

    ``names`` are the curves that get a panel, all that are none of coordinates if left out; ``given`` the axes they are
    drawn into, those of a new figure if left out.
    """
    names = shown_curves(list(curves.columns), position) if names is None else names
    turns = {str(role): turn for role, turn in curves.groupby("role", sort=False)}
    label = "crank angle [°]" if turning(curves, position) else "crank angle from the lowest position [°]"
    panels, styles = _panels(len(names)) if given is None else given, styles_of(turns)
    for axes, name in zip(panels, names, strict=False):
        shown = quantity(name, units.get(name, ""))
        for role, turn in turns.items():
            angle, values = aligned_turn(turn, name, position)
            axes.plot(np.degrees(angle), values * shown.factor, label=role, zorder=3, **styles[role])
        _limit_lines(axes, name, shown, limits)
        axes.set_title(shown.title)
        if name == "dev" and window is not None:
            bound = max((x.maximum for x in limits if x.output == "max_abs_dev" and x.maximum is not None), default=0.0)
            _show_window(axes, turns, position, window, shown.factor, bound * shown.factor)
        if speed is not None and shown.order:
            scale = shown.speed_scale * speed**shown.order / shown.factor
            twin = axes.secondary_yaxis("right", functions=(lambda v, k=scale: v * k, lambda v, k=scale: v / k))
            twin.set_ylabel(shown.speed_unit)
        crank_axis(axes, "")
    lowest = panels if given is not None else panels[max(0, len(names) - 2) :]
    for axes in lowest:
        axes.set_xlabel(label)
        axes.tick_params(labelbottom=True)
    if len(turns) > 1 and given is not None:
        panels[0].legend()
    elif len(turns) > 1:
        handles, labels = panels[0].get_legend_handles_labels()
        panels[0].get_figure(root=True).legend(handles, labels, loc="outside upper right", ncols=min(len(turns), 6))
    return panels


def _panels(count: int) -> list[Any]:
    """Return axes of a new figure, two in a row."""
    figure = new_figure(WIDTH, 2.1 * -(-count // 2) + 0.5)
    panels = np.atleast_1d(figure.subplots(-(-count // 2), 2, sharex=True)).ravel().tolist()
    for axes in panels[count:]:
        axes.set_axis_off()
    return list(panels[:count])


def _show_window(
    axes: Axes, turns: dict[str, pd.DataFrame], position: str, window: tuple[float, float], factor: float, bound: float
) -> None:
    """Shade the part of the turn in which the deviation counts, and scale the axis to what happens there."""
    sizes = [bound]
    styles = styles_of(turns)
    for role, turn in turns.items():
        angle, path = aligned_turn(turn, position, position)
        _, dev = aligned_turn(turn, "dev", position)
        inside = in_window(path, window)
        sizes.append(float(np.nanmax(np.abs(dev[inside]))) * factor)
        axes.fill_between(
            np.degrees(angle), 0, 1, where=inside, transform=axes.get_xaxis_transform(),
            color=styles[role]["color"], alpha=0.08, linewidth=0, zorder=1,
        )  # fmt: skip
    top = 1.25 * max(sizes)
    if np.isfinite(top) and top > 0.0:
        axes.set_ylim(-top, top)


def in_window(path: Array, window: tuple[float, float]) -> NDArray[np.bool_]:
    """Return poses whose position lies between two fractions of the stroke, counted from its smallest value."""
    low, high = np.nanmin(path), np.nanmax(path)
    fraction = (path - low) / (high - low) if high > low else np.zeros_like(path)
    return (fraction >= window[0]) & (fraction <= window[1])


def is_angle(position: str) -> bool:
    """Whether a position is a follower's angle, known up to full turns."""
    return stem(position) == "psi"


def rotates(turn: pd.DataFrame, position: str) -> bool:
    """Whether the follower itself turns fully, so that it has no lowest position."""
    if not is_angle(position):
        return False
    return turns_fully(np.unwrap(turn[position].to_numpy(float)))


def turns_fully(path: Array) -> bool:
    """Whether an unwrapped angle over one turn of the crank makes a turn itself."""
    return bool(abs(path[-1] - path[0]) > 0.9 * 2.0 * np.pi)


def turning(curves: pd.DataFrame, position: str) -> bool:
    """Whether the follower of any of the mechanisms turns fully."""
    return any(rotates(turn, position) for _, turn in curves.groupby("role", sort=False))


def motion_caption(curves: pd.DataFrame, position: str, speed: str, window: tuple[float, float] | None) -> str:
    """Return what the panels show."""
    text = "Derivatives are with respect to the crank angle" + (f"; right-hand scales: at {speed}. " if speed else ". ")
    if not turning(curves, position):
        text += "Every curve starts at the lowest position, from which the position counts. "
    text += "Dotted red: limits that are near the curves."
    if window is not None and "dev" in curves:
        text += f" Shaded: the part of the stroke in which the deviation counts, {100 * window[0]:g} to"
        text += f" {100 * window[1]:g} % from the lowest position; outside it the curve may leave the panel."
    return text


def aligned_turn(turn: pd.DataFrame, name: str, position: str) -> tuple[Array, Array]:
    """One closed turn that starts where the position is smallest; the position itself counts from there."""
    phi, values = turn["phi"].to_numpy(float), turn[name].to_numpy(float)
    path = turn[position].to_numpy(float)
    if is_angle(position):
        path = np.unwrap(path)
    if name == position:
        values = path
    if rotates(turn, position):
        full = np.copysign(2.0 * np.pi, path[-1] - path[0]) if name == position else 0.0
        return np.append(phi, 2.0 * np.pi), np.append(values, values[0] + full)
    start = int(np.nanargmin(path)) if np.isfinite(path).any() else 0
    order = np.r_[start : phi.size, 0:start]
    values = values[order] - (values[start] if name == position else 0.0)
    return np.append(np.mod(phi[order] - phi[start], 2.0 * np.pi), 2.0 * np.pi), np.append(values, values[0])


def _limit_lines(axes: Axes, name: str, shown: Quantity, limits: tuple[Limit, ...]) -> None:
    """Draw the limits that bound this curve itself as thin lines; far ones would make the curves flat."""
    reach = FAR_LIMIT * np.abs(axes.dataLim.intervaly).max()
    for value in limit_values(name, limits):
        if abs(value) * shown.factor <= reach:
            axes.axhline(value * shown.factor, color=LIMIT, linewidth=0.9, linestyle=":", zorder=2)


def limit_values(name: str, limits: tuple[Limit, ...]) -> list[float]:
    """Ordinates, in stored units, that the limits set to a curve itself; both signs where its size is limited."""
    found = []
    for limit in limits:
        for value, outputs in (
            (limit.maximum, (reduced("max_abs", name), reduced("max", name))),
            (limit.minimum, (reduced("min", name),)),
        ):
            if value is None or limit.output not in outputs:
                continue
            both = is_largest(limit.output, magnitude=True) and stem(name) != "pressure_angle"
            found += [value, -value] if both else [value]
    return found


POSES = 720


def reference_row(study: Study) -> dict[str, float] | None:
    """Parameters and outputs of the study's reference design, computed as the sweep computes its designs."""
    if study.reference is None:
        return None
    matrix, _ = design_matrix(study.family, study.reference)
    outputs = design_outputs(study.family, matrix, study.want, study.accuracy, study.window)
    parameters = dict(zip(study.family.parameter_names, matrix[0].tolist(), strict=True))
    return parameters | {name: float(values[0]) for name, values in outputs.items()}


def curves(study: Study, rows: Mapping[str, Mapping[str, Any] | None]) -> pd.DataFrame:
    """Return poses over one turn of the design of every role, as ``_curves.parquet`` holds them."""
    import pandas as pd

    family = study.family
    # Over an interval there is no turn to draw.
    over_turn = not isinstance(family.domain, Interval)
    known = {role: row for role, row in rows.items() if row is not None and over_turn}
    names = [*motion_curves(family), *joint_curves(family)]
    matrix = np.array([[float(row[p]) for p in family.parameter_names] for row in known.values()])
    phi = np.arange(POSES, dtype=np.float64) * (2.0 * np.pi / POSES)
    columns = family.poses(
        matrix.reshape(len(known), len(family.parameters)), Angles.of(phi[None, :]), frozenset(names)
    )
    head = {"role": np.repeat(list(known), POSES), "phi": np.tile(phi, len(known))}
    return pd.DataFrame(head | {name: columns[name].ravel() for name in [*names, "status"]})


def motion(data: Dataset) -> Figure | None:
    """Curves over one turn."""
    if data.curves is None or not len(data.curves):
        return None
    study = data.study
    panels = motion_figure(data.curves, data.units, study.family.position, study.speed, study.limits, study.window)
    figure: Figure = panels[0].get_figure(root=True)
    return figure
