"""Presser foot on fabric, a spring and a damper between foot and ground; and the march, of a rigid foot too.

Equations (13)-(16) of docs/foot.md.  Ground is the rack where it stands above the plate, else the plate.  A cell of the
path is cut into parts over which the foot on its fabric turns by at most a radian; over a part the forcing is a
polynomial, so the foot's motion is a power series that ends within rounding, however stiff the fabric is.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from kernels import status as st
from kernels.curves.polynomials import value_and_slope
from kernels.curves.root_search import bisected, least_value
from kernels.effects.foot import (
    FLIGHT,
    PLATE,
    RACK,
    Foot,
    State,
    apart,
    checked,
    extremes,
    flown,
    held,
    march_cell,
    note,
    quintic,
    rack_height,
    written,
)  # fmt: skip
from kernels.jit import inline, kernel
from kernels.types import TWO_PI, Array, Status

LYING = 3  # on the fabric, in place of PLATE and RACK
TERMS = 22  # of the power series: over a radian the next term is below 2^-53
PARTS = 4  # least number per cell
MOST_PARTS = 4096  # per cell: with more the fabric would swing 650 times within a five-hundredth of a turn
_MOST_EVENTS = 64
ALIKE = 1e-6  # largest difference of turns that count as equal, as a share of the height of foot or rack
ROUNDING = 2.0**-36  # the same between two turns by rounding alone, as angles are counted over many turns


class Fabric(NamedTuple):
    """Stiffness and damping of the fabric, divided by m omega^2 and by m omega."""

    stiffness: float
    damping: float


class Piece(NamedTuple):
    """Part of a cell: its place, its length in crank angle, and whether the rack is the ground there."""

    j: int
    low: float
    high: float
    begin: float  # crank angle
    angle: float
    on_rack: bool


@inline
def _motion(foot: Foot, fabric: Fabric, y: float, v: float, angle: float, ground: Array, series: Array) -> None:
    """Compute power series (TERMS,) of a foot that presses on the fabric, by the share of the piece; (13)."""
    drag, pull = fabric.damping * angle, (foot.kappa * foot.kappa + fabric.stiffness) * angle * angle
    series[0], series[1] = y, v * angle
    for i in range(TERMS - 2):
        force = -foot.g0 * angle * angle if i == 0 else 0.0
        if i < 6:
            force += fabric.stiffness * angle * angle * ground[i]
        if i < 5:
            force += fabric.damping * angle * (i + 1) * ground[i + 1]
        series[i + 2] = (force - drag * (i + 1) * series[i + 1] - pull * series[i]) / ((i + 1) * (i + 2))


@inline
def _press(fabric: Fabric, ground: Array, y: float, v: float, x: float, angle: float) -> tuple[float, float]:
    """Force and compression of the fabric under a foot at height y with speed v; (14)."""
    g, slope = value_and_slope(x, ground, 5)
    return fabric.stiffness * (g - y) + fabric.damping * (slope / angle - v), g - y


@inline
def _look(
    foot: Foot, fabric: Fabric, state: State, piece: Piece, ground: Array, series: Array, x: float
) -> tuple[float, float, float]:
    """Measure at the share x of the piece that is negative after an event; height and speed of the foot there."""
    if state.mode == FLIGHT:
        y, v = flown(foot, state, piece.begin + x * piece.angle)
        force, depth = _press(fabric, ground, y, v, x, piece.angle)
        return -min(force, depth * fabric.stiffness), y, v
    y, slope = value_and_slope(x, series, TERMS - 1)
    force, _ = _press(fabric, ground, y, slope / piece.angle, x, piece.angle)
    return force, y, slope / piece.angle


@inline
def _lasts(x: float, foot: Foot, fabric: Fabric, state: State, piece: Piece, ground: Array, series: Array) -> bool:
    """Whether the state lasts at the share x of the piece."""
    return not _look(foot, fabric, state, piece, ground, series, x)[0] < 0.0


@kernel
def _event(foot: Foot, fabric: Fabric, state: State, piece: Piece, ground: Array, series: Array) -> float:
    """Find the share of the piece at which the state ends; 2 if it lasts beyond the piece."""
    low = 0.0
    for k in range(1, 5):
        high = 0.25 * k
        if not _lasts(high, foot, fabric, state, piece, ground, series):
            return bisected(_lasts, low, high, foot, fabric, state, piece, ground, series)[1]
        low = high
    return 2.0


@inline
def _force(
    x: float, sense: float, foot: Foot, fabric: Fabric, state: State, piece: Piece, ground: Array, series: Array
) -> float:
    return sense * _look(foot, fabric, state, piece, ground, series, x)[0]


@kernel
def _borne_between(
    foot: Foot, fabric: Fabric, state: State, piece: Piece, ground: Array, series: Array, end: float, tally: Array
) -> None:
    """Update the tally with least and greatest force on a lying foot, up to the share ``end`` of a piece.

    The force jumps where the ground does, so the piece's start counts.  Over a radian of the swing it has at most one
    extremum between the ends: golden sections find it where a parabola has its extremum there, or nearly there.
    """
    first = _look(foot, fabric, state, piece, ground, series, 0.0)[0]
    middle = _look(foot, fabric, state, piece, ground, series, 0.5 * end)[0]
    last = _look(foot, fabric, state, piece, ground, series, end)[0]
    bend = first - 2.0 * middle + last
    least, most = min(first, middle, last), max(first, middle, last)
    beats = most + abs(bend) > tally[7] or (piece.on_rack and least - abs(bend) < tally[8])
    if beats and abs(first - last) < 3.0 * abs(bend):
        sense = math.copysign(1.0, bend)
        extreme = sense * least_value(_force, 0.0, end, sense, foot, fabric, state, piece, ground, series)[1]
        least, most = min(least, extreme), max(most, extreme)
    tally[7] = max(tally[7], most)
    if piece.on_rack:
        tally[8] = min(tally[8], max(least, 0.0))


@kernel
def _stretch(
    path: Array, foot: Foot, fabric: Fabric, state: State, piece: Piece, work: Array, tally: Array
) -> tuple[State, float]:
    """March over a piece to its end or its first event; return the state there, and the share of the piece.

    ``work`` is scratch, with a row each for the series of the ground, the feed and the foot.
    """
    ground, along, series = work[0], work[1], work[2]
    size = piece.high - piece.low
    if piece.on_rack:
        quintic(path, 0, piece.j, piece.low, size, ground)
    else:
        ground[:6] = 0.0
    if state.mode == LYING:
        _motion(foot, fabric, state.y, state.v, piece.angle, ground, series)
    end = _event(foot, fabric, state, piece, ground, series)
    ended, end = end <= 1.0, min(end, 1.0)
    _, y, v = _look(foot, fabric, state, piece, ground, series, end)
    phi = piece.begin + end * piece.angle
    if piece.on_rack:
        quintic(path, 3, piece.j, piece.low, size, along)
        way = value_and_slope(end, along, 5)[0] - along[0]
        tally[5] += way
        if state.mode == FLIGHT:
            tally[3] += end * piece.angle
            tally[4] += way
        if state.mode == FLIGHT:
            tally[8] = min(tally[8], 0.0)
    if state.mode == LYING:
        _borne_between(foot, fabric, state, piece, ground, series, end, tally)
    if not ended:
        return (State(LYING, phi, y, v, phi) if state.mode == LYING else state), 1.0
    if state.mode == LYING:
        tally[0] += 1.0
        if math.isnan(tally[1]):
            tally[1] = phi
        note(tally, phi, FLIGHT)
        return State(FLIGHT, phi, y, v, phi), end
    _, slope = value_and_slope(end, ground, 5)
    tally[6] = max(tally[6], slope / piece.angle - v)
    if not math.isnan(tally[1]) and math.isnan(tally[2]):
        tally[2] = phi
    note(tally, phi, LYING)
    return State(LYING, phi, y, v, phi), end


@inline
def _not_yet(s: float, path: Array, j: int, rises: bool) -> bool:
    """Whether the rack has yet to pass the plate at the share s of a cell."""
    return (rack_height(path, j, s)[0] > 0.0) != rises


@kernel
def _cell(
    path: Array, foot: Foot, fabric: Fabric, state: State, j: int, parts: int, work: Array, tally: Array
) -> tuple[State, bool]:
    """March over one cell; return the state at its end, and false if there were too many events."""
    step = TWO_PI / path.shape[1]
    for k in range(parts):
        low, last = k / parts, (k + 1) / parts
        one, two = rack_height(path, j, low)[0], rack_height(path, j, last)[0]
        level = 2.0
        if (one > 0.0) != (two > 0.0):
            _, level = bisected(_not_yet, low, last, path, j, two > 0.0)
        for _ in range(_MOST_EVENTS):
            high = level if low < level < last else last
            on_rack = two > 0.0 if low >= level or level > last else one > 0.0
            piece = Piece(j, low, high, (j + low) * step, (high - low) * step, on_rack)
            state, share = _stretch(path, foot, fabric, state, piece, work, tally)
            low = high if share == 1.0 else low + share * (high - low)
            if low >= last:
                break
        if low < last:
            return state, False
    return state, True


@inline
def _either(
    path: Array, foot: Foot, fabric: Fabric, state: State, j: int, parts: int, work: Array, tally: Array
) -> tuple[State, bool]:
    """March over one cell, of a foot on fabric or of a rigid one, as :func:`_cell`."""
    if fabric.stiffness > 0.0:
        return _cell(path, foot, fabric, state, j, parts, work, tally)
    return march_cell(path, foot, state, j, tally)


@kernel
def _landed(
    path: Array, foot: Foot, fabric: Fabric, state: State, j: int, parts: int, work: Array, tally: Array
) -> float:
    """Crank angle where the first flight of a turn ends; ``state`` is that at the turn's end, where cell j starts."""
    later = tally.copy()
    for k in range(j, j + 4 * path.shape[1]):  # no flight is longer than a few turns
        if math.isnan(later[1]) or not math.isnan(later[2]):
            break
        state, _ = _either(path, foot, fabric, state, k, parts, work, later)
    return float(later[2])


@inline
def _borne(path: Array, node: int, foot: Foot, fabric: Fabric, state: State, phi: float) -> tuple[float, float]:
    """Height of the foot at a node, and the force on the foot over m omega^2; (5), (14)."""
    y, force = state.y, 0.0
    if state.mode == FLIGHT:
        y = flown(foot, state, phi)[0]
    elif fabric.stiffness > 0.0:
        ground, slope = (path[0, node], path[1, node]) if path[0, node] > 0.0 else (0.0, 0.0)
        force = max(fabric.stiffness * (ground - y) + fabric.damping * (slope - state.v), 0.0)
    else:
        y, bend = (path[0, node], path[2, node]) if state.mode == RACK else (0.0, 0.0)
        force = held(foot, y, bend)
    return y, force


@kernel
def march(
    path: Array, feet: Array, turns: int, status: Status, outputs: Array, heights: Array, forces: Array, changes: Array
) -> None:
    """March feet over their racks for some turns and keep the last one; (4)-(16) of docs/foot.md.

    Parameters
    ----------
    path : (n, 6, N) rack at N equal crank angles from 0: height above the plate, way along the feed as rows 0 and 3,
        their first and second derivatives by phi in the rows behind each [length]
    feet : (n, 7) mass, spring stiffness, preload (weight included), speed [rad per time], restitution, stiffness and
        damping of the fabric; both 0 for none.  On fabric restitution is 0: its damper takes the energy of an impact
    turns : number of turns to march, from rest on the plate where the rack is lowest
    status : (n,) out; OK, NO_EVENT (the rack never lies below the plate), NOT_CONVERGED (bounces without end, or a
        fabric that swings more than 650 times a cell) or INVALID_INPUT
    outputs : (11, n) out of the last turn in the order of :data:`kernels.effects.foot.OUTPUTS`; angles in [0, 2 pi),
        nan where there is none.  On fabric ``impulse`` is 0, as forces are finite, and ``least_force`` is the least
        force of the fabric while the rack stands above the plate
    heights, forces : (n, N) out; height of the foot and force between it and rack or plate at every node.  On fabric
        heights count from the unpressed fabric on the plate, so a foot that lies is below 0
    changes : (n, 1 + 2 k) out; number of changes of state in the last turn, then for the first k of them the crank
        angle, counted on over all turns, and the state that begins: PLATE, RACK, FLIGHT or LYING

    Notes
    -----
    A bounce with less than 1e-9 of the greatest speed of the rack counts as the last.
    """
    tally, work = np.empty(9 + changes.shape[1]), np.empty((3, TERMS))
    for i in range(path.shape[0]):
        rack, count = path[i], path.shape[2]
        mass, stiffness, preload, speed, restitution = feet[i, 0], feet[i, 1], feet[i, 2], feet[i, 3], feet[i, 4]
        soft, damping = feet[i, 5], feet[i, 6]
        rigid, step, unit = soft == 0.0 and damping == 0.0, TWO_PI / count, mass * speed * speed
        outputs[:, i], heights[i, :], forces[i, :], changes[i, :] = math.nan, math.nan, math.nan, math.nan
        known, lowest, quickest, highest = extremes(rack)
        status[i] = checked(feet[i], known, rack[0, lowest])
        if status[i] != st.OK:
            continue
        foot = Foot(math.sqrt(stiffness / mass) / speed, preload / unit, restitution, 1e-9 * quickest)
        fabric = Fabric(soft / unit, damping / (mass * speed))
        spring = foot.kappa * foot.kappa + fabric.stiffness
        parts = max(PARTS, math.ceil(min(max(math.sqrt(spring), fabric.damping) * step, 2.0 * MOST_PARTS)))
        if parts > MOST_PARTS and not rigid:
            status[i] = st.NOT_CONVERGED
            continue
        rest = 0.0 if rigid else -foot.g0 / spring
        state = State(PLATE if rigid else LYING, lowest * step, rest, 0.0, lowest * step)
        first, before = state, math.inf
        for turn in range(turns):
            tally[:] = 0.0
            tally[1], tally[2], tally[8] = math.nan, math.nan, math.inf
            if turn > 0:
                before = apart(state, first, spring)
            first = state
            for k in range(count):
                j, node = turn * count + lowest + k, (lowest + k) % count
                y, force = _borne(rack, node, foot, fabric, state, j * step)
                heights[i, node], forces[i, node] = y, unit * force
                state, ended = _either(rack, foot, fabric, state, j, parts, work, tally)
                if not ended:
                    status[i] = st.NOT_CONVERGED
        if status[i] != st.OK:
            heights[i, :], forces[i, :] = math.nan, math.nan
            continue
        tally[2] = _landed(rack, foot, fabric, state, turns * count + lowest, parts, work, tally)
        settled = first.mode == state.mode and state.mode == (PLATE if rigid else LYING)
        if not rigid:
            # A foot that lies on its fabric may still rise and sink.  Turns are alike once its state comes back.
            # The changes of the state shrink like a geometric series; their sum is the difference of all later turns.
            moved, size = apart(state, first, spring), max(-rest, highest)
            left = moved / (1.0 - moved / before) if moved < before < math.inf else math.inf
            settled = settled and (moved <= ROUNDING * size or left <= ALIKE * size)
        written(outputs, i, tally, feet[i], settled)
        changes[i, :] = tally[9:]
