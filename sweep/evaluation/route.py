"""Routes: ways to compute design outputs together, by a family's step, a general reduction, or from other outputs."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from numbers import Real
from typing import Literal, NamedTuple, TypeAlias

import numpy as np
from numpy.typing import NDArray

from kernels import status as st
from kernels.types import TWO_PI
from sweep.errors import InputError
from sweep.families.base import Accuracy, Array, Columns, Family, Stage, Step, Work, floats
from sweep.families.machines.machine import Machine
from sweep.families.machines.relations import EventValue, Timing
from sweep.families.names import at_stage, by_magnitude, error_of
from sweep.quantities.box import ROUNDING, Box
from sweep.quantities.kinds import GeneralRoute, Reduced
from sweep.quantities.resolve import find
from sweep.reductions.events import event_outputs
from sweep.reductions.means import mean_squares
from sweep.reductions.rounding import shaken, sharpen_maxima
from sweep.reductions.sampling import pose_columns
from sweep.reductions.steps import NO_JUMPS, group_ns, group_order, step_ns, steps_of
from sweep.reductions.turn import limits_and_reductions, margin_group

Window: TypeAlias = tuple[float, float] | None
"""A window of the stroke as two fractions, or None."""


@dataclass(frozen=True)
class Route:
    """A way to compute some design outputs together.

    Parameters
    ----------
    name : name of the step or reduction
    outputs : names of the outputs
    ns_per_design : estimated time [ns]
    run : ``run(designs, accuracy, window)`` returns the outputs, perhaps their ``err_``, and ``status``, each (n,)
    general : name of the general reduction; "" for a family's own step or an effect
    order : kind of work, and the place among routes of that kind
    columns : number of leading columns of the design matrix that ``run`` reads; None for all
    stuck : whether the outputs say something of designs whose crank does not turn, as margins do
    """

    name: str
    outputs: tuple[str, ...]
    ns_per_design: float
    run: Callable[[Array, Accuracy, Window], Columns]
    general: GeneralRoute | Literal[""] = ""
    order: tuple[Work, int] = (Work.SEARCH, 0)
    columns: int | None = None
    stuck: bool = False


def check_window(window: tuple[float, float] | None) -> None:
    """Raise if the window is no part of the stroke."""
    if window is None:
        return
    two = isinstance(window, Sequence) and len(window) == 2 and all(isinstance(x, Real) for x in window)
    if not (two and 0.0 <= window[0] < window[1] <= 1.0):
        raise InputError("window", window, "two fractions of the stroke, 0 <= from < to <= 1", "design outputs")


def own_route(
    step: Step, stage: Stage, outputs: tuple[str, ...], accuracy: Accuracy, jumps: frozenset[str] = NO_JUMPS
) -> Route:
    """Make the route of a family's own step, or of a step of a chain's first stage."""
    position = [other.name for other in steps_of(stage.family)].index(step.name)
    named, cost = _step_outputs(step, stage, outputs), step_ns(stage.family, step, accuracy, jumps)
    refined = accuracy.target is not None and not accuracy.certify
    maxima = {output.maximum: output.pose for output in named if output.pose and refined}
    run = partial(_run_step, step, stage, named, maxima)
    route = Route(step.name, outputs, cost, run, order=(step.work, position))
    if not stage.tail:
        return route
    return replace(route, name=f"stage {stage.tail}: {step.name}", columns=stage.columns.stop)


def general_route(
    family: Family, general: GeneralRoute, effect: str, outputs: tuple[str, ...], accuracy: Accuracy, windowed: bool,
    jumps: frozenset[str],
) -> Route:  # fmt: skip
    """Make the route of a general reduction over poses."""
    run = partial(_run_general, family, general, outputs)
    cost = group_ns(family, general, outputs, accuracy, windowed, jumps)
    order = group_order(family, general, outputs)
    return Route(f"{general} {effect}".rstrip(), outputs, cost, run, general, order)


OVER_THE_TURN: Mapping[str, Callable[[Family, Array, Sequence[str], Accuracy], Columns]] = {
    "margin": margin_group, "means": mean_squares, "events": event_outputs,
}  # fmt: skip
"""Reductions that know no window, by their general route."""


def _run_general(
    family: Family, general: GeneralRoute, outputs: tuple[str, ...], designs: Array, accuracy: Accuracy, window: Window
) -> Columns:
    if general in OVER_THE_TURN:
        return OVER_THE_TURN[general](family, designs, outputs, accuracy)
    return limits_and_reductions(family, designs, outputs, accuracy, window)


class _StepOutput(NamedTuple):
    """Output of a step: outer name, name in the stage, and the pose output whose precise maximum may replace it.

    ``maximum`` is that maximum in the stage: the output itself, or the one whose place it is.
    """

    name: str
    plain: str
    maximum: str
    pose: str


def _step_outputs(step: Step, stage: Stage, outputs: Sequence[str]) -> tuple[_StepOutput, ...]:
    found = []
    for name in outputs:
        plain = at_stage(name, stage.tail)
        maximum = plain.removeprefix(f"{stage.family.domain.name}_")
        found.append(_StepOutput(name, plain, maximum, _sharpened(stage.family, step, maximum)))
    return tuple(found)


def _sharpened(family: Family, step: Step, name: str) -> str:
    """Name the pose output of a maximum whose place is known, to be recomputed by precise poses; "" if none.

    The poses of an effect come from the same solution of the whole turn and have the same error.
    """
    if family.precise_poses is None or step.work is Work.EFFECT:
        return ""
    place = f"{family.domain.name}_{name}"
    if not any(o.name == place for o in step.provides):
        return ""
    quantity = find(family, name)
    return quantity.of if isinstance(quantity, Reduced) and quantity.reduction.modes == (0,) else ""


def _run_step(
    step: Step, stage: Stage, outputs: tuple[_StepOutput, ...], maxima: dict[str, str], designs: Array,
    accuracy: Accuracy, window: Window,
) -> Columns:  # fmt: skip
    """Run a step; ``maxima`` are those that precise poses may replace, with their pose outputs."""
    part = stage.designs(designs)
    wanted = frozenset((*(output.plain for output in outputs), *maxima))
    results = step.run(part, wanted, accuracy)
    if accuracy.target is not None:
        for plain in wanted:
            if error_of(plain) not in results:  # a step either meets the target, or gives its own error
                results[error_of(plain)] = accuracy.target * np.abs(np.asarray(results[plain], np.float64))
        for maximum, pose in maxima.items():  # rounding may have left one less accurate than the target
            sharpen_maxima(stage.family, step, part, pose, maximum, results, accuracy.target)
    columns: Columns = {"status": results["status"]}
    for name, plain, _, _ in outputs:
        columns[name] = results[plain]
        if error_of(plain) in results:
            columns[error_of(name)] = results[error_of(plain)]
    return columns


SLOPE = 1e-5  # rad, step of the finite difference that propagates an angle's error to a value there


Composed: TypeAlias = tuple[Array, Array, NDArray[np.generic]]
"""Values of an output that is composed of others, their errors (of no meaning on samples), and the status."""


def _error(columns: Columns, name: str) -> Array:
    """Error of an output; 0 on samples, where it has none."""
    return np.asarray(columns.get(error_of(name), 0.0), np.float64)


def negative(of: str, designs: Array, columns: Columns) -> Composed:
    """Compute the negative of an output, which is minimised to maximise the output."""
    values = np.asarray(columns[of], np.float64)
    return -np.abs(values) if by_magnitude(of) else -values, _error(columns, of), columns["status"]


def extent(box: Box, designs: Array, columns: Columns) -> Composed:
    """Compute the extent of a mechanism from the largest and smallest coordinates of its joints."""
    still = [np.asarray(piece(designs), np.float64) for piece in box.still]
    ends = []
    errors: Array = np.zeros(len(designs))
    for end, extremum in ((0, np.maximum), (1, np.minimum)):
        names = [pair[end] for pair in box.reductions]
        values = floats(columns, *names)
        ends.append(extremum.reduce([*values, *still]))  # nan where a joint's extremum is nan: its status says why
        errors = errors + np.maximum.reduce([_error(columns, name) for name in names])
    errors = errors + 4.0 * ROUNDING * np.maximum(np.abs(ends[0]), np.abs(ends[1]))
    return ends[0] - ends[1], errors, columns["status"]


def difference(timing: Timing, designs: Array, columns: Columns) -> Composed:
    """Compute the difference of two crank angles, in (-pi, pi]."""
    first, second = floats(columns, *timing.places)
    interval = second - first
    error = _error(columns, timing.places[0]) + _error(columns, timing.places[1])
    return interval - TWO_PI * np.ceil((interval - np.pi) / TWO_PI), error, columns["status"]


def value_at(machine: Machine, reading: EventValue, designs: Array, columns: Columns) -> Composed:
    """Compute a pose output at a crank angle of each design; the angle's error times the slope adds to its error."""
    place = reading.places[0]
    phi = np.asarray(columns[place], np.float64)
    finite = np.isfinite(phi)
    near = np.where(finite, phi, 0.0)[:, None] + SLOPE * np.array([0.0, -1.0, 1.0])
    poses, pose_status = pose_columns(machine, designs, near, [reading.of.name])
    values = np.where(finite[:, None], poses[reading.of.name], np.nan)
    status = np.where(columns["status"] == st.OK, pose_status[:, 0], columns["status"]).astype(np.uint8)
    slope = np.abs(values[:, 2] - values[:, 1]) / (2.0 * SLOPE)
    rounding = shaken(machine, designs, near[:, 0], reading.of.name) + 4.0 * ROUNDING * np.abs(values[:, 0])
    return np.where(status == st.OK, values[:, 0], np.nan), slope * _error(columns, place) + rounding, status
