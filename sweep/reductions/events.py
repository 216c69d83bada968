"""Events of a family: passages of a pose output through a level, computed as roots between samples."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from kernels import status as st
from kernels.curves import samples as scan
from kernels.types import EPS, TWO_PI, Status
from sweep.families.base import Accuracy, Array, Columns, Event, Family, Interval
from sweep.families.names import error_of
from sweep.numerics.events import beyond, first_passage, passages, zeros
from sweep.numerics.records import Indices
from sweep.quantities.resolve import event_names
from sweep.reductions.resolution import denser
from sweep.reductions.rounding import shaken
from sweep.reductions.sampling import DESIGN_STATUS, blocks, pose_columns, sample_turn, variable

UNSEEN = 4.0  # rounding of a pose per change by rounded inputs, at most: they may cancel; directions are no inputs
START, LIMIT = 256, 16384  # first number of samples, and the last one before a design is given up


def event_outputs(family: Family, designs: Array, names: Sequence[str], accuracy: Accuracy) -> Columns:
    """Compute the place of the first occurrence, and the count, of the wanted events.

    Parameters
    ----------
    family, designs : the (n, P) design matrix; an interval is taken as a closed turn, out and back
    names : see `sweep.quantities.resolve.event_names`
    accuracy : on samples, two passages between neighbouring samples are missed; otherwise samples are doubled until a
        parabola through three of them excludes that

    Returns
    -------
    Columns
        the names with their ``err_``, each (n,), and ``status``: NO_EVENT where the event does not occur, NOT_CONVERGED
        where 16384 samples are not enough
    """
    n = len(designs)
    columns: Columns = {"status": np.zeros(n, np.uint8)}
    for event in family.events:
        place, count = event_names(family, event)
        if place not in names and count not in names:
            continue
        phi, err, number, status = _events(family, designs, event, accuracy)
        phi, err = variable(family, designs, phi, err)
        none = np.where(status == st.OK, 0.0, np.nan)
        found = {place: phi, error_of(place): err, count: number + none, error_of(count): none}
        columns |= {name: x for name, x in found.items() if name in names or name.removeprefix("err_") in names}
        if place in names:
            status = np.where((status == st.OK) & (number == 0), st.NO_EVENT, status).astype(np.uint8)
        columns["status"] = np.where(columns["status"] == st.OK, status, columns["status"]).astype(np.uint8)
    return columns


def _events(family: Family, designs: Array, event: Event, accuracy: Accuracy) -> tuple[Array, Array, Array, Status]:
    """First angle of the event and its error, count, and status, each (n,)."""
    n = len(designs)
    phi, err, number, status = np.full(n, np.nan), np.full(n, np.nan), np.zeros(n), np.zeros(n, np.uint8)
    samples = accuracy.samples or START
    fewest = (
        samples if accuracy.samples is not None else np.minimum(START * denser(family, designs, (event.of,)), LIMIT)
    )
    pending = np.ones(n, np.bool_)
    while pending.any():
        doubtful = np.zeros(n, np.bool_)
        for rows in blocks(np.flatnonzero(pending & (fewest <= samples)), samples):
            columns, worst, _ = sample_turn(family, designs[rows], samples, [event.of])
            status[rows] = DESIGN_STATUS[worst]
            good = status[rows] == st.OK
            rows, values = rows[good], np.ascontiguousarray(_beyond(family, event, columns[event.of][good]))
            number[rows], phi[rows], err[rows] = _crossings(family, designs, rows, values, event)
            unsure = np.zeros(rows.size, np.bool_)
            scan.grazes(values, np.zeros(rows.size), unsure)
            doubtful[rows] = unsure
        pending = doubtful | (pending & (fewest > samples))
        samples *= 2
        if accuracy.samples is not None:
            break
        if samples > LIMIT:
            status[pending] = st.NOT_CONVERGED
            break
    return phi, err, number, status


def _beyond(family: Family, event: Event, values: Array) -> Array:
    return beyond(values, event.level, family.pose_output[event.of].wraps)


def _crossings(
    family: Family, designs: Array, rows: Indices, values: Array, event: Event
) -> tuple[Array, Array, Array]:
    """Count the passages in the event's sense; also the first place and its error, each (r,).

    ``values`` (r, m) are samples of how far the output lies beyond the event's level.
    """
    off = values * (1.0 if event.rising else -1.0)
    passes = passages(off, family.pose_output[event.of].wraps)
    if isinstance(family.domain, Interval):
        passes[:, values.shape[1] // 2 :] = False  # the way back is not counted
    number = passes.sum(axis=1).astype(np.float64)
    phi, err = np.full(rows.size, np.nan), np.full(rows.size, np.nan)
    row = np.flatnonzero(number > 0)
    if row.size:
        column = first_passage(passes[row], off[row])
        step = TWO_PI / values.shape[1]
        ends = off[row, column], off[row, (column + 1) % values.shape[1]]
        phi[row], err[row] = _root(family, designs[rows[row]], event, column * step, (column + 1) * step, *ends)
    return number, phi, err


def _root(
    family: Family, designs: Array, event: Event, left: Array, right: Array, low: Array, high: Array
) -> tuple[Array, Array]:
    """Find a root between two samples with the values ``low`` and ``high``, from whose slope its error follows."""

    def off(which: Indices, phi: Array) -> Array:
        return _beyond(family, event, pose_columns(family, designs[which], phi[:, None], [event.of])[0][event.of])[:, 0]

    slope = np.abs((high - low) / (right - left))
    phi = zeros(off, left, right)
    left_over = np.abs(off(np.arange(phi.size), phi))
    rounding = 8.0 * EPS * (np.abs(event.level) + left_over + slope)
    rounding += UNSEEN * shaken(family, designs, phi, event.of)
    known = left_over + rounding
    err = known / np.maximum(slope, 1e-300) + 8.0 * EPS
    # Beside an extremum the curve is flatter than between the samples: it has to leave its rounding on both sides.
    flat = np.arange(phi.size)
    while flat.size:
        before, after = off(flat, phi[flat] - err[flat]), off(flat, phi[flat] + err[flat])
        leaves = ((before < 0.0) != (after < 0.0)) & (np.minimum(np.abs(before), np.abs(after)) >= 0.5 * known[flat])
        flat = flat[~leaves & (err[flat] < (right - left)[flat])]
        err[flat] *= 2.0
    return np.mod(phi, TWO_PI), err
