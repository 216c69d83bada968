"""Cyclogram of a machine over one turn: strokes, dwells at their ends, and events; machine-and-stitch, 8."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from numbers import Real
from typing import TYPE_CHECKING, Any

import numpy as np

from kernels.effects.foot import FLIGHT, PLATE, RACK, rack_height
from kernels.types import TWO_PI, Array
from sweep.errors import InputError
from sweep.evaluation.angles import AngleUnit, in_radians
from sweep.evaluation.summaries import design_outputs
from sweep.evaluation.tables import Table, one_design
from sweep.families import Mechanism
from sweep.families import family as find_family
from sweep.families.base import Accuracy, Columns, Family, March
from sweep.families.capabilities import PresserFoot
from sweep.families.machines.crossings import SAMPLES, Moment, Poses
from sweep.families.machines.machine import Machine
from sweep.families.machines.pressing import Pressing
from sweep.numerics.events import beyond, zeros
from sweep.quantities.resolve import event_names

if TYPE_CHECKING:
    import pandas as pd

CyclogramRow = tuple[str, str, str, float, float, float]
AWAY = {PLATE: ("dwell", "low", 0.0), FLIGHT: ("flight", "flies", float("nan"))}  # states of a foot off the rack
LEVEL = 1e-9  # share of the largest stroke below which a difference of heights is rounding
FLIGHT_ENDS = ("loss", "land")  # of a presser foot's first flight
COLUMNS = ("member", "kind", "name", "start", "end", "size")
UNITS = {"start": "rad", "end": "rad", "size": "length, or rad of a follower that turns"}


def cyclogram(
    mechanism: Mechanism, design: Table, *, dwell: float = 0.02, angles: AngleUnit | None = None
) -> pd.DataFrame:
    """List the strokes, dwells and events of all members over one turn of the main shaft, ordered by angle.

    Parameters
    ----------
    mechanism, design : as of :func:`sweep.joints`
    dwell : share of the largest stroke within which a member counts as standing still at its end
    angles : unit of the angles of ``design``, "rad" or "deg", as of :func:`sweep.evaluate`

    Returns
    -------
    DataFrame
        ``member`` ("" for events, and without a machine), ``kind`` (stroke, dwell, flight, event), ``name``, ``start``
        and ``end`` (crank angles of the main shaft [rad]; an end below its start lies in the next turn), ``size``
        (signed stroke of the follower; band of a dwell; nan for a flight and an event).  A member that turns fully has
        no strokes.  A presser foot has strokes while it follows the rack, its dwell on the plate, and its flights;
        none of them where its turns differ.  ``attrs["units"]`` names the units

    Examples
    --------
    >>> import sweep
    >>> sweep.cyclogram("slider_crank", {"a": 20.0, "b": 70.0, "e": 0.0})[["kind", "name", "size"]].values.tolist()
    [['stroke', 'falls', -40.0], ['dwell', 'low', 0.8], ['stroke', 'rises', 40.0], ['dwell', 'high', 0.8]]
    """
    import pandas as pd

    family = find_family(mechanism)
    designs = one_design(family, in_radians(family, design, angles))
    if not isinstance(dwell, Real) or not 0.0 < dwell < 0.5:
        raise InputError("dwell", dwell, "a share of the stroke between 0 and 0.5", "cyclogram")
    poses = Poses(family, family.precise(), designs)
    rows = [row for member, name in _positions(family) for row in _strokes(poses, family, member, name, dwell)]
    rows += [row for foot in _feet(family, designs) for row in _foot_rows(*foot)]
    rows += _events(family, designs)
    table = pd.DataFrame(rows, columns=list(COLUMNS))
    table = table.sort_values(["start", "kind"], kind="stable", ignore_index=True)
    table.attrs["units"] = dict(UNITS)
    return table


def table_in_degrees(rows: pd.DataFrame) -> pd.DataFrame:
    """Convert the table for output: crank angles in degrees, with the duration of each row."""
    start, end = (np.degrees(rows[name].to_numpy(np.float64)) for name in ("start", "end"))
    columns = {"member": rows["member"], "kind": rows["kind"], "name": rows["name"]}
    return rows[[]].assign(**columns, **{"from [deg]": start, "to [deg]": end, "lasts [deg]": (end - start) % 360.0})


def _positions(family: Family) -> Iterator[tuple[str, str]]:
    """Yield each member with the position of its follower, if its derivative is a pose output."""
    if isinstance(family, Machine):
        pairs = [(m.name, f"{m.name}.{m.family.position}") for m in family.members]
    else:
        pairs = [("", family.position)]
    yield from ((member, name) for member, name in pairs if name in family.derivative_of)


def _strokes(poses: Poses, family: Family, member: str, name: str, dwell: float) -> Iterator[CyclogramRow]:
    """Yield the strokes between neighbouring extrema, and the dwells at the global minimum and maximum."""
    rate = family.derivative_of[name]
    status, (slope, values) = poses.samples([rate, name], SAMPLES)
    wraps = family.pose_output[name].wraps
    path = np.unwrap(values[0]) if wraps else values[0]
    if status[0] or (wraps and abs(path[-1] - path[0]) > np.pi):
        return
    extrema = np.sort(poses.turning(rate, slope).phi % TWO_PI)
    if extrema.size < 2:
        return
    exact = poses.at(np.zeros(extrema.size, np.intp), extrema, name)[0]
    if wraps:  # shifted by full turns to the unwrapped samples
        grid = np.arange(SAMPLES + 1) * TWO_PI / SAMPLES
        exact = exact + TWO_PI * np.round((np.interp(extrema, grid, np.append(path, path[0])) - exact) / TWO_PI)
    most = float(np.ptp(exact))
    for k, size in enumerate(np.roll(exact, -1) - exact):
        if abs(size) <= LEVEL * most:  # from one end of a piece to the other along which a cam stands still
            continue
        yield member, "stroke", "rises" if size > 0.0 else "falls", extrema[k], extrema[(k + 1) % extrema.size], size
    band = dwell * most
    for word, level in (("low", float(exact.min())), ("high", float(exact.max()))):

        def beyond_band(phi: float, level: float = level) -> float:
            return float(abs(beyond(poses.at(np.zeros(1, np.intp), np.array([phi]), name)[0], level, wraps)[0])) - band

        found: list[tuple[float, float]] = []
        for phi in extrema[np.abs(exact - level) <= LEVEL * most]:  # a geared member is there several times a turn
            if all((phi - start) % TWO_PI > end - start for start, end in found):
                found.append((_band_end(beyond_band, float(phi), -1.0), _band_end(beyond_band, float(phi), 1.0)))
        for start, end in found:
            yield member, "dwell", word, start % TWO_PI, end % TWO_PI, band


def _band_end(beyond_band: Callable[[float], float], phi: float, direction: float) -> float:
    """Find where the band about an extremum is left, searching in one direction."""
    from scipy.optimize import brentq

    step = direction * TWO_PI / SAMPLES
    inside = phi
    while beyond_band(inside + step) < 0.0 and abs(inside - phi) < TWO_PI:
        inside += step
    return float(brentq(beyond_band, inside, inside + step)) if abs(inside - phi) < TWO_PI else inside


def _feet(family: Family, designs: Array) -> Iterator[tuple[str, Columns, Array, float]]:
    """Yield each presser foot: name, outputs of its march, path of its rack, its angle at crank angle 0."""
    for presser in family.every(PresserFoot):
        columns, path, _, _ = presser.march(designs, presser.nodes)
        yield "", columns, path[0], 0.0
    for foot in family.every(Pressing):
        assert isinstance(family, Machine)
        columns, path, ahead = foot.marched(family, designs, foot.foot.nodes)
        yield foot.name, columns, path[0], float(ahead[0])


def _foot_rows(member: str, columns: Columns, path: Array, ahead: float) -> Iterator[CyclogramRow]:
    """Yield strokes, dwell and flights of a foot whose turns are alike; on the rack strokes end at extrema.

    On fabric its path is not known as exactly: only its flights are listed.
    """
    changes = np.asarray(columns["changes"], np.float64)[0]
    if columns["status"][0] or not columns["settled"][0] or changes[0] > changes[1:].size // 2:
        return
    begins, modes = changes[1 : 1 + 2 * int(changes[0])].reshape(-1, 2).T
    slope, step = path[1], TWO_PI / path.shape[1]
    k = np.flatnonzero((slope > 0.0) & (np.roll(slope, -1) <= 0.0) | (slope < 0.0) & (np.roll(slope, -1) >= 0.0))
    extrema = zeros(lambda _, phi: _rack(path, phi)[1], k * step, (k + 1) * step)
    for begin, end, mode in zip(begins, np.roll(begins, -1), modes, strict=True):
        duration, offsets = (end - begin) % TWO_PI, np.sort((extrema - begin) % TWO_PI)
        cuts = begin + np.array([0.0, *offsets[(mode == RACK) & (offsets > 0.0) & (offsets < duration)], duration])
        for start, stop, rise in zip(cuts, cuts[1:], np.diff(_rack(path, cuts)[0]), strict=False):
            stroke = ("stroke", "rises" if rise > 0.0 else "falls", float(rise))
            if mode in AWAY or mode == RACK:
                kind, name, size = AWAY.get(int(mode), stroke)
                yield member, kind, name, (start - ahead) % TWO_PI, (stop - ahead) % TWO_PI, size


def _rack(path: Array, phi: Array) -> Array:
    """Height of a rack's path (6, N) and its slope at crank angles (k,); (2, k)."""
    cells = np.mod(phi, TWO_PI) * (path.shape[1] / TWO_PI)
    return np.array([rack_height(path, int(x), x % 1.0)[:2] for x in cells]).reshape(-1, 2).T


def event_angles(family: Family) -> dict[str, str]:
    """Map the name of each event and moment in the cyclogram to the output that is its crank angle."""
    names = {event.name: event_names(family, event)[0] for event in family.events}
    relations: tuple[Any, ...] = getattr(family, "relations", ())
    names |= {r.name: f"phi_{r.name}" for r in relations if isinstance(r, Moment)}
    if family.find(PresserFoot) is not None:
        names |= {end: f"phi_{end}" for end in FLIGHT_ENDS}
    feet = [f"{foot.name}_{end}" for foot in family.every(Pressing) for end in FLIGHT_ENDS]
    return names | {name: f"phi_{name}" for name in feet}


def _events(family: Family, designs: Array) -> Iterator[CyclogramRow]:
    """Yield the events and moments of the machine that occur."""
    accuracy = Accuracy(samples=SAMPLES) if isinstance(family.domain, March) else Accuracy(target=1e-9)
    for name, angle in event_angles(family).items():
        outputs = design_outputs(family, designs, [angle], accuracy)
        phi = float(np.asarray(outputs[angle], np.float64)[0])
        if np.isfinite(phi):
            yield "", "event", name, phi, phi, float("nan")
