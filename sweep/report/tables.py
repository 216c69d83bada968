"""The tables of the report: limits, outputs, parameters, fates of the designs, errors, provenance."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from kernels import status as codes
from sweep.errors import how_many
from sweep.evaluation.statuses import meaning
from sweep.families.names import error_of, is_flag, is_place, without_minus
from sweep.optimise.local.descent import KKT
from sweep.quantities.limits import compared, meets
from sweep.report.dataset import Dataset, Row
from sweep.report.quantities import ShownQuantity, change, number, quantity
from sweep.report.scan import Scan
from sweep.study import Limit, Study
from sweep.study.parameter import definition

ACTIVE = 1e-5  # distance of the optimum from a limit, relative to its size, below which the limit is active
DWELLS = 0.1  # error of a place [rad] above which it is one of many equally good ones


@dataclass(frozen=True)
class LimitState:
    """One limit and the result's value; ``state`` is "active", "met", "missed" or "unknown".

    ``value`` and ``reference`` are the compared values: magnitudes of swing and stroke.
    ``room`` is the distance to the limit relative to its size, negative if it is missed.
    """

    shown: ShownQuantity
    bound: str
    value: str
    reference: str
    slack: str
    state: str
    room: float = 0.0


def limited(data: Dataset, name: str) -> ShownQuantity:
    """Return the display form of a limited output; a parameter keeps its own name."""
    shown = data.shown(name)
    return replace(shown, symbol=name, words=name) if name in data.study.family.parameter_names else shown


def limit_state(
    limit: Limit, row: Row | None, reference: Row | None, shown: ShownQuantity, active_names: frozenset[str],
    settled: bool = False,
) -> LimitState:  # fmt: skip
    """Return whether a design keeps a limit, and its distance from it.

    A search that has ``settled`` says which limits hold the objective back; an output that does not matter to it may
    have stopped at a bound, too.
    """
    value, other = value_of(row, limit.output), value_of(reference, limit.output)
    if is_flag(limit.output):
        state = "unknown" if math.isnan(value) else "met" if meets(limit, np.array([value]))[0] else "missed"
        return LimitState(shown, bound_words(limit, shown), _yes(value), _yes(other), "", state)
    size = compared(limit.output, value)
    low, high = limit.ends
    room, bound = min((size - low, low), (high - size, high), key=lambda pair: pair[0])
    tolerance = ACTIVE * max(abs(bound), 1e-12)
    error = value_of(row, error_of(limit.output))
    if bound == 0.0 and error > tolerance:
        tolerance = error  # relative to a limit of 0 there is no size: use the error of the value
    if math.isnan(room):
        state = "unknown"
    elif room < -tolerance:
        state = "missed"
    elif limit.output in active_names or (room <= tolerance and (limit.is_equation or not settled)):
        state = "active"
    else:
        state = "met"
    slack = "" if state in ("unknown", "active") else shown.show(abs(room), 3)
    return LimitState(
        shown,
        bound_words(limit, shown),
        shown.show(size),
        shown.show(compared(limit.output, other)),
        slack,
        state,
        room / max(abs(bound), 1e-12),
    )


def bound_words(limit: Limit, shown: ShownQuantity) -> str:
    """Return a limit as ``at most 45°`` or ``24.4 to 24.6 mm``."""
    if is_flag(limit.output):
        return "must turn fully"
    if limit.minimum is not None and limit.maximum is not None:
        if limit.minimum == limit.maximum:
            return f"exactly {shown.show(limit.maximum)}"
        return f"{number(limit.minimum * shown.factor)} to {shown.show(limit.maximum)}"
    if limit.maximum is not None:
        return f"at most {shown.show(limit.maximum)}"
    return f"at least {shown.show(limit.minimum if limit.minimum is not None else math.nan)}"


def limit_states(data: Dataset) -> list[LimitState]:
    """Return the state of every limit at the result of the study."""
    row = data.result
    active, parameters = frozenset(data.active), data.study.family.parameter_names
    settled = data.optimum is not None and value_of(data.optimum, "kkt_residual") <= KKT
    return [
        limit_state(x, row, data.reference, limited(data, x.output), active, settled and x.output not in parameters)
        for x in data.study.limits
    ]


def value_of(row: Row | None, name: str) -> float:
    """Return a number of a row; nan if there is no row or no number."""
    value = None if row is None else row.get(name)
    return math.nan if value is None else float(value)


FEW = 3
# Relative to the ends of its axis, below which a value is rounding of zero.
ROUNDING = 1e-12
NOTHING = 1e-9  # share of the longest length below which a length is zero


@dataclass(frozen=True)
class ParameterRow:
    """One parameter; ``space`` is its searched range, ``edge`` the end of it at which the result lies, if any."""

    name: str
    text: str
    value: str
    reference: str
    space: str
    edge: str


@dataclass(frozen=True)
class Fate:
    """Number of designs with one status."""

    code: int
    text: str
    count: int


@dataclass(frozen=True)
class OutputRow:
    """One output of the result beside the reference; values with ``fast`` are those at the study's speed."""

    name: str
    symbol: str
    text: str
    value: str
    fast: str
    reference: str
    reference_fast: str
    change: str


def output_rows(data: Dataset) -> list[OutputRow]:
    """Return the wanted outputs in designers' units, compared with the reference, the objective first."""
    study = data.study
    objective = [data.objective.name] if data.objective is not None else []
    rows = []
    for name in dict.fromkeys([*objective, *study.want]):
        shown = data.shown(name)
        value, other = value_of(data.result, name), value_of(data.reference, name)
        flag, error = is_flag(name), value_of(data.result, error_of(name))
        text = data.definitions.get(name, shown.words).removeprefix(f"negative of {without_minus(name)}: ")
        blurred = is_place(name) and error > DWELLS
        rows.append(
            OutputRow(
                name=name,
                symbol=shown.symbol,
                text=f"{text}; one angle of a dwell, known to ±{shown.show(error, 2)}" if blurred else text,
                value=_yes(value) if flag else shown.show(value),
                fast=shown.at_speed(value, study.speed),
                reference=_yes(other) if flag else shown.show(other),
                reference_fast=shown.at_speed(other, study.speed),
                change="" if flag or is_place(name) else change(shown, value, other),
            )
        )
    return rows


def parameter_rows(data: Dataset, row: Row | None = None, digits: int = 6) -> list[ParameterRow]:
    """Return all parameters of the result or another design, with their searched ranges."""
    study, rows = data.study, []
    row = data.result if row is None else row
    links = () if study.locus is None else study.locus.made
    mechanism_names = study.bare.parameter_names
    size = max((abs(value_of(row, p.name)) for p in study.bare.parameters if p.unit == "length"), default=0.0)
    for p in study.family.parameters:
        left_out = 0.0 if p.unless else p.default
        if p.name not in mechanism_names and p.name in study.space.fixed and study.space.fixed[p.name] == left_out:
            continue  # an input of an effect that the study does not use
        shown = quantity(p.name, data.units.get(p.name, {"length": "mm", "angle": "rad"}.get(p.unit, "1")))
        value, other = value_of(row, p.name), value_of(data.reference, p.name)
        space, edge = "fixed", ""
        low, high = study.space.bounds.get(p.name, (math.nan, math.nan))
        if abs(value) < max(ROUNDING * np.nanmax([abs(low), abs(high), 0.0]), NOTHING * size * (p.unit == "length")):
            value = 0.0
        if p.name in study.made:
            space = "follows from the limit positions" if p.name in links else "fitted"
        elif p.choices is not None and high > low:
            space = " or ".join(number(choice) for choice in p.choices)
        elif high > low and data.optimum is None and (listed := _few_values(study, p.name)) is not None:
            space = f"{', '.join(number(value * shown.factor) for value in listed[:-1])} or {shown.show(listed[-1])}"
        elif high > low:
            space = f"{number(low * shown.factor)} to {shown.show(high)}"
            tolerance = 1e-9 * (high - low)
            if p.name not in study.rescaled:
                edge = "lower edge" if value - low <= tolerance else "upper edge" if high - value <= tolerance else ""
        space += ", then scaled" if p.name in study.rescaled else ""
        words = [
            f"{x:+g}".replace("-", "−") if p.choices and math.isfinite(x) else shown.show(x, digits)
            for x in (value, other)
        ]
        rows.append(ParameterRow(p.name, definition(p), words[0], words[1], space, edge))
    return rows


def _few_values(study: Study, name: str) -> list[float] | None:
    """Return the two or three listed values of an axis, which a sweep treats as a choice, or None."""
    axis = next((axis for axis in study.space.axes if axis.name == name), None)
    listed = "values" in study.written.get(name, {})
    return None if axis is None or axis.values is None or not listed or axis.count > FEW else axis.values.tolist()


def fates(data: Dataset) -> list[Fate]:
    """Return the number of designs per status in the order of the sweep's checks, feasible ones last."""
    counts = data.counts
    order = [codes.INVALID_INPUT, codes.NOT_ADMISSIBLE, codes.NOT_ASSEMBLED, codes.NOT_ROTATABLE, codes.UNDECIDABLE]
    failed = sorted(
        (c for c in counts if c != codes.OK), key=lambda c: order.index(c) if c in order else len(order) + c
    )
    rows: list[Fate] = []
    for code in failed:
        if code == codes.LIMIT_EXCEEDED and sum(data.missed.values()) == counts[code]:
            rows += [Fate(code, words, count) for words, count in _by_limit(data)]
        else:
            rows.append(Fate(code, meaning(code), counts[code]))
    return [*rows, Fate(codes.OK, "within all limits", counts.get(codes.OK, 0))]


def _by_limit(data: Dataset) -> list[tuple[str, int]]:
    """Return the missed limits in words, with their counts, in the order of the study file."""
    shown = [(limited(data, limit.output), limit) for limit in data.study.limits]
    return [
        (f"{quantity.words}: not {bound_words(limit, quantity)}", data.missed[limit.output])
        for quantity, limit in shown
        if data.missed.get(limit.output)
    ]


def error_rows(data: Dataset, scanned: Scan) -> list[tuple[str, str, str, str]]:
    """Return symbol of every output, error at the result, largest error in the sweep, and largest relative error."""
    rows = []
    for name in data.study.want:
        error = f"err_{name}"
        if is_place(name) or is_flag(name):
            continue  # a relative error of an angle or of a flag is meaningless
        if error not in scanned.errors and math.isnan(value_of(data.result, error)):
            continue
        shown = quantity(error, data.units.get(error, data.units.get(name, "")))
        largest, relative = scanned.errors.get(error, (math.nan, math.nan))
        here, most = (shown.show(size, 2) for size in (value_of(data.result, error), largest))
        rows.append((quantity(name, "").symbol, here, most, number(relative, 2)))
    return rows


def provenance(data: Dataset) -> list[tuple[str, str]]:
    """Return the data needed to reproduce the dataset."""
    rows = [("study", data.study.name), ("fingerprint of the study", data.study.fingerprint)]
    rows += [(key, str(data.plan[key])) for key in ("code", "identity", "designs", "chunks") if key in data.plan]
    return [*rows, ("extrema over the turn", accuracy_words(data.study)), *run_rows(data.runs)]


def accuracy_words(study: Study) -> str:
    """Say how exact the extrema of a study are."""
    accuracy = study.accuracy
    if accuracy.target is None:
        return f"on a grid of {accuracy.samples} crank angles"
    of = f" of {', '.join(accuracy.proven)}" if accuracy.proven else ""
    proof = f", with the proof that no peak{of} is missed" if accuracy.certify else ""
    return f"to a relative error of {accuracy.target:g}{proof}"


def run_rows(runs: tuple[dict[str, Any], ...]) -> list[tuple[str, str]]:
    """Return time, machine and versions of the last run, and the total time of all runs."""
    starts = [run for run in runs if run.get("event") == "start"]
    if not starts:
        return []
    last = starts[-1]
    keys = ("command", "time", "commit", "machine", "python", "jobs", "backend")
    rows = [(key, str(last[key])) for key in keys if last.get(key)]
    rows.append(("versions", ", ".join(f"{name} {release}" for name, release in last.get("versions", {}).items())))
    seconds = sum(run.get("seconds", 0.0) for run in runs)
    rows.append(("time taken", f"{number(seconds, 3)} s in {how_many(len(starts), 'run')} into this folder"))
    return rows


def _yes(value: float) -> str:
    return "–" if math.isnan(value) else "yes" if value else "no"
