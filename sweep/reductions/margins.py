"""Rotatability, margin and largest pressure angle of any family, stage by stage; docs/extrema.md."""

from __future__ import annotations

from collections.abc import Iterable
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from kernels import status as st
from kernels.types import TWO_PI, Status
from sweep.families.base import Accuracy, Array, Columns, Family, Stage, Step, floats
from sweep.families.capabilities import Assembly
from sweep.numerics.records import Indices, Mask, put
from sweep.quantities.dimensions import near_unit_size
from sweep.quantities.kinds import Request
from sweep.reductions import fused
from sweep.reductions.extrema import true_extrema
from sweep.reductions.sampling import DESIGN_STATUS, Extremum, pose_columns, turn

NAMES = ("rotatable", "margin", "max_pressure_angle")
# Relative accuracy of the smallest discriminants unless a finer one is asked for: their sign is what matters.
TARGET = 1e-10
END_TARGET = 1e-4  # of the search for the end of a motion, which only has to meet the missing poses
FEW = 16  # number of poses that identify most non-rotatable designs


def margin_suffixes(family: Family) -> tuple[str, ...]:
    """List the suffixes of a stage's margin names: "" for a single family, the stage numbers for a chain.

    Stages without a discriminant (a geared drive turns always) are left out.
    """
    return tuple(loop.stage for loop in family.every(Assembly))


class LoopMargin(NamedTuple):
    """Margin of one loop, or of the weakest of several, each (n,).

    ``rotatable`` tells whether it turns fully; ``margin`` is the smallest cos^2(pressure angle), negative where it does
    not turn, and nan where an earlier stage does not; ``pressure`` is the largest pressure angle [rad], nan unless it
    turns.
    """

    rotatable: Mask
    margin: Array
    err_margin: Array
    pressure: Array
    err_pressure: Array

    @classmethod
    def unknown(cls, count: int) -> LoopMargin:
        """Make a record of loops of which nothing is known."""
        return cls(np.zeros(count, np.bool_), *np.full((4, count), np.nan))

    @classmethod
    def of(cls, columns: Columns, accuracy: Accuracy) -> LoopMargin:
        """Read the columns `NAMES`; their errors meet the accuracy where none are given."""
        margin, pressure = floats(columns, *NAMES[1:])
        share = accuracy.target or TARGET
        met: Columns = {"err_margin": share * np.abs(margin), "err_max_pressure_angle": share * np.abs(pressure)}
        err_margin, err_pressure = floats(met | columns, *met)
        return cls(np.asarray(columns["rotatable"], np.bool_), margin, err_margin, pressure, err_pressure)

    def columns(self) -> Columns:
        """Return the columns by their names, errors and the least transmission angle included.

        That angle is 90 degrees less the largest pressure angle.  It is computed from cosine and sine of the pressure
        angle, so that it stays exact where the linkage nearly locks.
        """
        cosine = np.sqrt(np.where(self.margin > 0.0, self.margin, np.nan))
        return {
            "rotatable": self.rotatable,
            "err_rotatable": np.zeros(self.rotatable.size),
            "margin": self.margin,
            "err_margin": self.err_margin,
            "max_pressure_angle": self.pressure,
            "err_max_pressure_angle": self.err_pressure,
            "least_transmission_angle": np.arctan2(cosine, np.sin(self.pressure)),
            "err_least_transmission_angle": self.err_pressure,
        }


def margins(
    family: Family, designs: Array, suffixes: tuple[str, ...], accuracy: Accuracy, valued: bool = True
) -> tuple[dict[str, LoopMargin], Status]:
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
    margins : by suffix
    status : (n,)

    Notes
    -----
    The margin of a non-rotatable design is the smallest discriminant over 4 b^2 c^2, or over b^2 if it is a squared
    length: where the links reach this equals cos^2(pressure angle), so the margin is smooth across zero.
    """
    found = {suffix: LoopMargin.unknown(len(designs)) for suffix in suffixes}
    status = np.zeros(len(designs), np.uint8)
    looked = FEW if not valued else accuracy.samples or 0
    for suffix, margin in found.items():
        alive = np.flatnonzero(status == st.OK)
        with np.errstate(all="ignore"):  # invalid values and overflows have their status
            part, status[alive] = _of_loop(family, designs[alive], suffix, accuracy, looked)
        put(margin, alive, part)
    return found, status


def combined(margins: Iterable[LoopMargin]) -> LoopMargin:
    """Combine the margins of a chain's stages: the weakest stage decides."""
    stages = LoopMargin(*(np.stack(column) for column in zip(*margins, strict=True)))
    rotatable: Mask = np.logical_and.reduce(stages.rotatable)
    every = np.arange(rotatable.size)
    least = np.where(np.isnan(stages.margin), np.inf, stages.margin).argmin(axis=0), every
    most = np.where(np.isnan(stages.pressure), -np.inf, stages.pressure).argmax(axis=0), every
    margin, err_margin = stages.margin[least], stages.err_margin[least]
    # Where a stage has no margin because something else ends its motion, the weakest is unknown.
    unknown = ~rotatable & (margin > err_margin)
    margin[unknown], err_margin[unknown] = np.nan, np.nan
    pressure, err_pressure = (np.where(rotatable, x[most], np.nan) for x in (stages.pressure, stages.err_pressure))
    return LoopMargin(rotatable, margin, err_margin, pressure, err_pressure)


def own_step(family: Family, suffix: str, accuracy: Accuracy) -> tuple[Step, Stage] | None:
    """Find the family's own exact step for the margin; that of a chain's first stage also applies to the chain."""
    first = family.stages[0]
    if first.tail and suffix != first.tail:
        return None
    able = (step for step in first.family.steps if step.applies(accuracy))
    return next(((step, first) for step in able if set(NAMES) <= {o.name for o in step.provides}), None)


def _of_loop(
    family: Family, designs: Array, suffix: str, accuracy: Accuracy, looked: int
) -> tuple[LoopMargin, NDArray[np.generic]]:
    own = own_step(family, suffix, accuracy)
    if own is None:
        return _from_poses(family, designs, suffix, looked, min(TARGET, accuracy.target or TARGET))
    step, stage = own
    found = step.run(stage.designs(designs), frozenset(NAMES), accuracy)
    return LoopMargin.of(found, accuracy), found["status"]


def _from_poses(
    family: Family, designs: Array, suffix: str, looked: int, target: float
) -> tuple[LoopMargin, NDArray[np.generic]]:
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
    err_pressure = np.where(turns, err_angle, np.nan)
    return LoopMargin(turns, margin, err_margin + 2.0**-51, pressure, err_pressure), status


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
