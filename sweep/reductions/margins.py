"""Rotatability, margin and largest pressure angle of any family, stage by stage; docs/extrema.md."""

from __future__ import annotations

import numpy as np

from kernels import status as st
from kernels.types import TWO_PI, Status
from sweep.families.base import Accuracy, Array, Columns, Family, Stage, Step
from sweep.families.capabilities import Assembly
from sweep.families.names import is_flag
from sweep.numerics.records import Indices, put
from sweep.quantities.dimensions import near_unit_size
from sweep.quantities.kinds import Request
from sweep.reductions import fused
from sweep.reductions.extrema import true_extrema
from sweep.reductions.sampling import DESIGN_STATUS, Extremum, pose_columns, turn

NAMES = ("rotatable", "margin", "max_pressure_angle")
TRANSMISSION = "least_transmission_angle"
# Relative accuracy of the smallest discriminants unless a finer one is asked for: their sign is what matters.
TARGET = 1e-10
END_TARGET = 1e-4  # of the search for the end of a motion, which only has to meet the missing poses
FEW = 16  # number of poses that identify most non-rotatable designs


def margin_suffixes(family: Family) -> tuple[str, ...]:
    """List the suffixes of a stage's margin names: "" for a single family, the stage numbers for a chain.

    Stages without a discriminant (a geared drive turns always) are left out.
    """
    return tuple(loop.stage for loop in family.every(Assembly))


def margins(
    family: Family, designs: Array, suffixes: tuple[str, ...], accuracy: Accuracy, valued: bool = True
) -> Columns:
    """Compute whether the stages turn fully, their smallest cos^2(pressure angle) and largest pressure angle.

    Parameters
    ----------
    family, designs : the (n, P) design matrix
    suffixes : of the stages (see `margin_suffixes`); a later stage is only computed where the earlier ones turn
    accuracy : passed to the families' own steps, which are preferred; with ``samples`` the margin of a non-rotatable
        design is the minimum over the samples, unless such a step or a fused kernel computes it exactly
    valued : whether the margin of non-rotatable designs is used; if not, it is the minimum over few poses

    Returns
    -------
    Columns
        per suffix ``rotatable``, ``margin`` (negative where the stage does not turn, nan where an earlier one does
        not), ``max_pressure_angle`` [rad] (nan unless it turns), each with its ``err_``; and ``status``.

    Notes
    -----
    The margin of a non-rotatable design is the smallest discriminant over 4 b^2 c^2, or over b^2 if it is a squared
    length: where the links reach this equals cos^2(pressure angle), so the margin is smooth across zero.
    """
    n = len(designs)
    columns: Columns = {}
    status = np.zeros(n, np.uint8)
    looked = FEW if not valued else accuracy.samples or 0
    for suffix in suffixes:
        alive = np.flatnonzero(status == st.OK)
        with np.errstate(all="ignore"):  # invalid values and overflows have their status
            part = _stage_margin(family, designs[alive], suffix, accuracy, looked)
        status[alive] = part["status"]
        for name in NAMES:
            for key in (f"{name}{suffix}", f"err_{name}{suffix}"):
                whole = np.zeros(n, np.bool_) if is_flag(key) else np.full(n, np.nan)
                whole[alive] = part[key]
                columns[key] = whole
    return columns | {"status": status}


def combined(columns: Columns, suffixes: tuple[str, ...]) -> Columns:
    """Combine the margins of a chain's stages: the weakest stage decides."""
    rotatable = np.logical_and.reduce([columns[f"rotatable{s}"] for s in suffixes])
    result: Columns = {"rotatable": rotatable, "err_rotatable": np.zeros(rotatable.size)}
    for name, sign in (("margin", -1.0), ("max_pressure_angle", 1.0)):
        values = np.stack([np.asarray(columns[f"{name}{s}"], np.float64) for s in suffixes])
        errors = np.stack([np.asarray(columns[f"err_{name}{s}"], np.float64) for s in suffixes])
        which = np.where(np.isnan(values), -np.inf, sign * values).argmax(axis=0)[None, :]
        result[name] = np.take_along_axis(values, which, axis=0)[0]
        result[f"err_{name}"] = np.take_along_axis(errors, which, axis=0)[0]
    # Where a stage has no margin because something else ends its motion, the weakest is unknown.
    unknown = ~rotatable & np.greater(result["margin"], result["err_margin"])
    result["margin"][unknown], result["err_margin"][unknown] = np.nan, np.nan
    result["max_pressure_angle"][~rotatable] = np.nan
    result["err_max_pressure_angle"][~rotatable] = np.nan
    return result


def with_transmission(columns: Columns, suffixes: tuple[str, ...]) -> Columns:
    """Add the least transmission angle of each suffix to the columns: 90 degrees less the largest pressure angle.

    It is computed from cosine and sine of the pressure angle, so that it stays exact where the linkage nearly locks.
    """
    for suffix in suffixes:
        margin = np.asarray(columns[f"margin{suffix}"], np.float64)
        pressure = np.asarray(columns[f"max_pressure_angle{suffix}"], np.float64)
        cosine = np.sqrt(np.where(margin > 0.0, margin, np.nan))
        columns[f"{TRANSMISSION}{suffix}"] = np.arctan2(cosine, np.sin(pressure))
        columns[f"err_{TRANSMISSION}{suffix}"] = columns[f"err_max_pressure_angle{suffix}"]
    return columns


def own_step(family: Family, suffix: str, accuracy: Accuracy) -> tuple[Step, Stage] | None:
    """Find the family's own exact step for the margin; that of a chain's first stage also applies to the chain."""
    first = family.stages[0]
    if first.tail and suffix != first.tail:
        return None
    able = (step for step in first.family.steps if step.applies(accuracy))
    return next(((step, first) for step in able if set(NAMES) <= {o.name for o in step.provides}), None)


def _stage_margin(family: Family, designs: Array, suffix: str, accuracy: Accuracy, looked: int) -> Columns:
    own = own_step(family, suffix, accuracy)
    if own is None:
        return _from_poses(family, designs, suffix, looked, min(TARGET, accuracy.target or TARGET))
    step, stage = own
    found = step.run(stage.designs(designs), frozenset(NAMES), accuracy)
    columns: Columns = {f"{name}{suffix}": found[name] for name in NAMES}
    columns[f"err_rotatable{suffix}"] = np.zeros(len(designs))
    for name in NAMES[1:]:
        values = np.asarray(found[name], np.float64)
        columns[f"err_{name}{suffix}"] = found.get(f"err_{name}", np.abs(values) * (accuracy.target or TARGET))
    return columns | {"status": found["status"]}


def _from_poses(family: Family, designs: Array, suffix: str, looked: int, target: float) -> Columns:
    """Compute the margin from the family's discriminant, refined unless ``looked`` poses are enough."""
    designs, _ = near_unit_size(family, designs)  # no discriminant overflows
    loop = next(found for found in family.every(Assembly) if found.stage == suffix)
    discriminant, angle = loop.discriminant, loop.pressure_angle
    request = Request(discriminant, -1)
    exactly = not looked or fused.curve_of(family, request, anywhere=True) is not None
    least = Extremum.unknown(len(designs)) if exactly else _apart(family, designs, discriminant, looked)
    turning, unknown = np.flatnonzero(np.isnan(least.value)), np.zeros(len(designs), np.uint8)
    found, unknown[turning] = true_extrema(family, designs[turning], [request], target, anywhere=True)
    put(least, turning, found[request])
    known = np.isfinite(least.value)
    phi = np.where(known, least.phi, 0.0)[:, None]
    poses, state = pose_columns(family, designs, phi, (discriminant, angle))
    at_least = DESIGN_STATUS[state[:, 0]]
    late = (at_least == st.OK) & (unknown == st.NOT_CONVERGED)
    # A discriminant with nan in it: the status of those poses gives the reason.
    status = np.where(known, at_least, np.where(unknown == st.OK, st.NOT_CONVERGED, unknown)).astype(np.uint8)
    status[_ended(family, designs, loop, status)] = st.NOT_ROTATABLE
    # It is not this loop that ends the motion: its discriminant says nothing about the place.
    elsewhere = (status == st.NOT_ROTATABLE) & (least.value > 0.0)
    least.value[elsewhere], least.err[elsewhere] = np.nan, np.nan
    turns = status == st.OK
    status[turns & late] = st.NOT_CONVERGED
    scale = loop.scale(designs)
    pressure = np.where(turns, poses[angle][:, 0], np.nan)
    err_margin = least.err / scale
    margin = np.where(turns, np.cos(pressure) ** 2, least.value / scale)
    # d(angle) = d(cos^2) / sin(2 angle), and sqrt(d(cos^2)) where the linearisation fails.
    err_angle = np.minimum(err_margin / np.abs(np.sin(2.0 * pressure)), np.sqrt(err_margin)) + 2.0**-51
    return {
        f"rotatable{suffix}": turns,
        f"err_rotatable{suffix}": np.zeros(len(designs)),
        f"margin{suffix}": margin,
        f"err_margin{suffix}": err_margin + 2.0**-51,
        f"max_pressure_angle{suffix}": pressure,
        f"err_max_pressure_angle{suffix}": np.where(turns, err_angle, np.nan),
        "status": status,
    }


def _ended(family: Family, designs: Array, loop: Assembly, status: Status) -> Indices:
    """Find designs that turn by their discriminant, but whose motion ends where that is not zero."""
    if loop.end is None or loop.end[0] not in family.pose_names:
        return np.zeros(0, np.intp)
    pose, possible = loop.end
    rows = np.flatnonzero((status == st.OK) & possible(designs).astype(bool))
    _, met = true_extrema(family, designs[rows], [Request(pose, 0)], END_TARGET)
    return rows[np.isin(met, (st.NOT_ROTATABLE, st.SINGULAR))]


def _apart(family: Family, designs: Array, discriminant: str, looked: int) -> Extremum:
    """Smallest discriminant among ``looked`` poses of designs that fail to assemble in one of them; nan for others."""
    least = Extremum.unknown(len(designs))
    columns, status = pose_columns(family, designs, turn(looked).phi, (discriminant,))
    values = np.where(status == st.NOT_ASSEMBLED, columns[discriminant], 0.0)
    lowest = values.argmin(axis=1)
    rows = np.flatnonzero(values.min(axis=1) < 0.0)
    least.value[rows], least.phi[rows] = values[rows, lowest[rows]], lowest[rows] * (TWO_PI / looked)
    return least
