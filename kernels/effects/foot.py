"""Presser foot on a rack: contact, flight, impacts and landing, marched over a path given at equal crank angles.

Equations (4)-(12) of docs/foot.md.  The path stands between its nodes as quintic Hermite polynomials of height, slope
and curvature; the foot flies on the closed solution of its spring, so only the events are searched.  Rates are by the
crank angle; forces are divided by m omega^2 (a foot of mass m at the speed omega).
"""

from __future__ import annotations

import math
from typing import NamedTuple

from kernels import status as st
from kernels.curves.root_search import false_position
from kernels.jit import inline, kernel  # long helpers are kernels: folded into one another they took 17 s to compile
from kernels.types import TWO_PI, Array

PLATE, RACK, FLIGHT = 0, 1, 2
_PARTS = 4
_MOST_EVENTS = 2048  # bounces die out in a few cells, with a restitution of 0.99 too

# Outputs of a march, of its last turn, in order.
OUTPUTS = (
    "flights", "phi_loss", "phi_land", "lost_angle", "lost_travel", "travel", "impact_speed", "impulse", "least_force",
    "most_force", "settled",
)  # fmt: skip


class Foot(NamedTuple):
    """Foot with the crank angle as its time: kappa = natural frequency/speed, g0 = preload/(m omega^2)."""

    kappa: float
    g0: float
    restitution: float
    still: float  # relative speed below which a bounce is the last


class State(NamedTuple):
    """State of the foot: resting on the plate, following the rack, or flying since ``since`` from y with speed v."""

    mode: int
    since: float
    y: float
    v: float
    clear: float  # crank angle at which a new flight is surely above the surface that it left


@inline
def _quintic(path: Array, row: int, j: int) -> tuple[float, float, float, float, float, float]:
    """Coefficients of a row of the path in cell j, from its values, slopes and curvatures by the share; (4)."""
    n = path.shape[1]
    h, j, k = TWO_PI / n, j % n, (j + 1) % n
    p0, m0, c0 = path[row, j], path[row + 1, j] * h, path[row + 2, j] * h * h
    p1, m1, c1 = path[row, k], path[row + 1, k] * h, path[row + 2, k] * h * h
    d, e, f = p1 - p0 - m0 - 0.5 * c0, m1 - m0 - c0, c1 - c0
    return p0, m0, 0.5 * c0, 10.0 * d - 4.0 * e + 0.5 * f, -15.0 * d + 7.0 * e - f, 6.0 * d - 3.0 * e + 0.5 * f


@inline
def on_path(path: Array, row: int, j: int, s: float) -> tuple[float, float, float]:
    """Place of the rack in cell j at the share s, with derivatives by phi: height (row 0) or along the feed (row 3)."""
    p0, m0, half, a3, a4, a5 = _quintic(path, row, j)
    h = TWO_PI / path.shape[1]
    value = p0 + s * (m0 + s * (half + s * (a3 + s * (a4 + s * a5))))
    slope = m0 + s * (2.0 * half + s * (3.0 * a3 + s * (4.0 * a4 + s * 5.0 * a5)))
    return value, slope / h, (2.0 * half + s * (6.0 * a3 + s * (12.0 * a4 + s * 20.0 * a5))) / (h * h)


@inline
def rack_height(path: Array, j: int, s: float) -> tuple[float, float, float]:
    """Height of the rack above the plate in cell j at the share s, with derivatives by phi."""
    return on_path(path, 0, j, s)


@inline
def extremes(rack: Array) -> tuple[bool, int, float, float]:
    """Whether all heights of the rack are finite, its lowest node, its greatest speed and its greatest height."""
    known, lowest, quickest, highest = True, 0, 0.0, 0.0
    for j in range(rack.shape[1]):
        known = known and abs(rack[0, j]) < math.inf
        quickest, highest = max(quickest, abs(rack[1, j])), max(highest, rack[0, j])
        if rack[0, j] < rack[0, lowest]:
            lowest = j
    return known, lowest, quickest, highest


@inline
def quintic(path: Array, row: int, j: int, at: float, size: float, out: Array) -> None:
    """Compute coefficients (6,) of a row of the path in cell j as a polynomial in x, at the share at + size x; (4)."""
    out[0], out[1], out[2], out[3], out[4], out[5] = _quintic(path, row, j)
    # repeated Horner's scheme moves the origin to the share ``at``
    for k in range(5):
        for i in range(4, k - 1, -1):
            out[i] += at * out[i + 1]
    factor = 1.0
    for i in range(6):
        out[i] *= factor
        factor *= size


@inline
def flown(foot: Foot, state: State, phi: float) -> tuple[float, float]:
    """Height and speed of the flying foot at a crank angle; (6)."""
    t = phi - state.since
    half = 0.5 * foot.kappa * t
    sinc = math.sin(half) / half if half != 0.0 else 1.0
    cos, sine = math.cos(2.0 * half), t * sinc * math.cos(half)  # sin(kappa t)/kappa, good for no spring too
    fall = 0.5 * t * t * sinc * sinc  # (1 - cos(kappa t))/kappa^2
    y = state.y * cos + state.v * sine - foot.g0 * fall
    v = state.v * cos - (foot.kappa * foot.kappa * state.y + foot.g0) * sine
    return y, v


@inline
def held(foot: Foot, y: float, bend: float) -> float:
    """Contact force over m omega^2 on a foot that follows the rack at height y, curvature ``bend``; (5)."""
    return foot.g0 + foot.kappa * foot.kappa * y + bend


@inline
def _measure(s: float, path: Array, foot: Foot, state: State, j: int, which: int) -> float:
    """Measure that changes sign at an event: height of the rack (0), contact force (1), gap below the foot (2)."""
    y, _, bend = rack_height(path, j, s)
    if which == 0:
        return y
    if which == 1:
        return held(foot, y, bend)
    return flown(foot, state, (j + s) * (TWO_PI / path.shape[1]))[0] - max(y, 0.0)


@kernel
def _root(path: Array, foot: Foot, state: State, j: int, low: float, high: float, which: int) -> float:
    """Find the share of a cell where a measure passes zero."""
    at_low, at_high = _measure(low, path, foot, state, j, which), _measure(high, path, foot, state, j, which)
    return false_position(_measure, low, high, at_low, at_high, path, foot, state, j, which)


@kernel
def _struck(path: Array, foot: Foot, j: int, s: float, speed: float) -> tuple[State, float]:
    """State after the foot meets rack or plate with a speed, and the relative speed; (7)-(9)."""
    y, y1, bend = rack_height(path, j, s)
    phi = (j + s) * (TWO_PI / path.shape[1])
    on_rack = y > 0.0 or (y >= -1e-14 * abs(y1) and y1 > 0.0)
    ground, surface = (max(y, 0.0), y1) if on_rack else (0.0, 0.0)
    closing = surface - speed
    push = held(foot, ground, bend if on_rack else 0.0)
    rebound = foot.restitution * max(closing, 0.0)
    if rebound > foot.still:
        # The hop is highest after rebound/push at a constant push; the parts of a cell resolve longer hops.
        part = TWO_PI / path.shape[1] / _PARTS
        clear = phi + (min(rebound / push, part) if push > 0.0 else 0.0)
        return State(FLIGHT, phi, ground, surface + rebound, clear), closing
    if push < 0.0:
        return State(FLIGHT, phi, ground, surface, phi), closing
    return State(RACK if on_rack else PLATE, phi, ground, surface, phi), closing


@kernel
def _on_the_other(path: Array, foot: Foot, state: State, j: int, low: float, high: float) -> float:
    """Find where a rebound ends before it is clear, as the rack passes the plate meanwhile; 2 if it does not."""
    if not low < high or _measure(high, path, foot, state, j, 2) >= 0.0:
        return 2.0
    at_low, at_high = _measure(low, path, foot, state, j, 0), _measure(high, path, foot, state, j, 0)
    if at_low < 0.0 < at_high or at_high < 0.0 < at_low:
        low = _root(path, foot, state, j, low, high, 0)
    elif state.since >= j * (TWO_PI / path.shape[1]):
        return 2.0  # it comes down on what it left, of which it is surely clear: a hop within rounding
    return _root(path, foot, state, j, low, high, 2) if _measure(low, path, foot, state, j, 2) > 0.0 else 2.0


@inline
def _thrown_just_before(path: Array, foot: Foot, state: State, j: int, s: float) -> bool:
    """Whether the foot left at most two parts of a cell ago a rack that still draws away: it cannot have landed."""
    y, _, bend = rack_height(path, j, s)
    young = j + s - state.since * (path.shape[1] / TWO_PI) < 2.0 / _PARTS
    return young and state.clear == state.since and y > 0.0 and held(foot, y, bend) < 0.0


@kernel
def _next_event(path: Array, foot: Foot, state: State, j: int, s: float) -> tuple[float, int]:
    """Find the share of the cell at which the state ends, and the measure; 2 and -1 if it lasts beyond the cell."""
    if state.mode == PLATE:
        if _measure(1.0, path, foot, state, j, 0) > 0.0:
            return _root(path, foot, state, j, s, 1.0, 0), 0
        return 2.0, -1
    before = s
    if state.mode == FLIGHT:
        before = max(s, state.clear * (path.shape[1] / TWO_PI) - j)
        landing = _on_the_other(path, foot, state, j, s, min(before, 1.0))
        if landing < 1.0:
            return landing, 2
    for k in range(1, _PARTS + 1):
        after = k / _PARTS
        if after <= before:
            continue
        if state.mode == RACK:
            lost = _measure(after, path, foot, state, j, 1) < 0.0
            sunk = _measure(after, path, foot, state, j, 0) < 0.0
            first, which = 2.0, -1
            if lost:
                first, which = _root(path, foot, state, j, before, after, 1), 1
            if sunk:
                level = _root(path, foot, state, j, before, after, 0)
                if level < first:
                    first, which = level, 0
            if which >= 0:
                return first, which
        elif _measure(after, path, foot, state, j, 2) < 0.0 and not _thrown_just_before(path, foot, state, j, after):
            # A flight begins without a gap: halve towards its begin until there is one.  Where none is found, a rebound
            # ends at its highest point, a launch at the end of this part.
            clear = before
            for n in range(1, 30):
                if _measure(clear, path, foot, state, j, 2) > 0.0:
                    return _root(path, foot, state, j, clear, after, 2), 2
                clear = before + (after - before) * 0.5**n
            return before if state.clear > state.since else after, 2
        before = after
    return 2.0, -1


@inline
def written(outputs: Array, i: int, tally: Array, foot: Array, settled: bool) -> None:
    """Write the outputs of a foot from the sums of its last turn, in the order of :data:`OUTPUTS`."""
    mass, speed, restitution, rigid = foot[0], foot[3], foot[4], foot[5] == 0.0 and foot[6] == 0.0
    unit = mass * speed * speed
    outputs[0, i], outputs[1, i], outputs[2, i] = tally[0], tally[1] % TWO_PI, tally[2] % TWO_PI
    outputs[3, i], outputs[4, i], outputs[5, i] = tally[3], tally[4], tally[5]
    outputs[6, i] = tally[6] * speed
    outputs[7, i] = mass * (1.0 + restitution) * tally[6] * speed if rigid else 0.0
    outputs[8, i] = unit * tally[8] if tally[8] < math.inf else math.nan
    outputs[9, i], outputs[10, i] = unit * tally[7], 1.0 if settled else 0.0


@inline
def note(tally: Array, phi: float, mode: int) -> None:
    """Append a crank angle and the state that begins there to the list behind the sums of the turn, if it has room."""
    k = 10 + 2 * int(tally[9])
    tally[9] += 1.0
    if k < tally.size:
        tally[k], tally[k + 1] = phi, mode


@kernel
def _record(tally: Array, path: Array, foot: Foot, state: State, j: int, low: float, high: float) -> None:
    """Add a piece of a cell to the sums of the turn: forces, feed, and the crank angle and feed lost in flight."""
    if state.mode == PLATE:
        tally[7] = max(tally[7], foot.g0)
    one, two = rack_height(path, j, low)[0], rack_height(path, j, high)[0]
    if one <= 0.0 and two <= 0.0:
        return
    if one < 0.0 < two:
        low = _root(path, foot, state, j, low, high, 0)
    elif two < 0.0 < one:
        high = _root(path, foot, state, j, low, high, 0)
    way = on_path(path, 3, j, high)[0] - on_path(path, 3, j, low)[0]
    tally[5] += way
    if state.mode == FLIGHT:
        tally[3] += (high - low) * (TWO_PI / path.shape[1])
        tally[4] += way
    # Force on a foot that follows the rack: at both ends of the piece, and where a parabola has its extremum.
    first, last = _measure(low, path, foot, state, j, 1), _measure(high, path, foot, state, j, 1)
    middle, rise = _measure(0.5 * (low + high), path, foot, state, j, 1), last - first
    bend = first - 2.0 * middle + last
    top = middle - rise * rise / (8.0 * bend) if abs(rise) < 2.0 * abs(bend) else middle
    tally[8] = min(tally[8], first, last, top)
    if state.mode == RACK:
        tally[7] = max(tally[7], first, last, top)


@kernel
def march_cell(path: Array, foot: Foot, state: State, j: int, tally: Array) -> tuple[State, bool]:
    """March over one cell; return the state at its end, and false if there were too many events."""
    s, step = 0.0, TWO_PI / path.shape[1]
    for _ in range(_MOST_EVENTS):
        at, which = _next_event(path, foot, state, j, s)
        if which < 0:
            _record(tally, path, foot, state, j, s, 1.0)
            return state, True
        _record(tally, path, foot, state, j, s, at)
        phi = (j + at) * step
        y, y1, _ = rack_height(path, j, at)
        if which == 1:
            following = State(FLIGHT, phi, y, y1, phi)
        else:
            speed = 0.0 if state.mode == PLATE else (y1 if state.mode == RACK else flown(foot, state, phi)[1])
            following, closing = _struck(path, foot, j, at, speed)
            if closing > 0.0:
                tally[6] = max(tally[6], closing)
            if state.mode == FLIGHT and not math.isnan(tally[1]) and math.isnan(tally[2]):
                tally[2] = phi
        if following.mode == FLIGHT and (state.mode != FLIGHT or following.since > state.since):
            tally[0] += 1.0
            if math.isnan(tally[1]):
                tally[1] = phi
        note(tally, phi, following.mode)
        state, s = following, at
    return state, False


@inline
def checked(feet: Array, known: bool, lowest: float) -> int:
    """Status by a foot's parameters and its rack's least height; ``known``: whether all heights of it are finite."""
    mass, stiffness, preload, speed, restitution, soft, damping = (
        feet[0], feet[1], feet[2], feet[3], feet[4], feet[5], feet[6],
    )  # fmt: skip
    rigid, unit = soft == 0.0 and damping == 0.0, mass * speed * speed
    valid = mass > 0.0 and stiffness >= 0.0 and preload > 0.0 and speed > 0.0 and 0.0 <= restitution < 1.0
    valid = valid and (rigid or (soft > 0.0 and damping >= 0.0 and restitution == 0.0))
    if not (valid and known and unit > 0.0 and unit < math.inf):
        return st.INVALID_INPUT
    return st.NO_EVENT if lowest > 0.0 else st.OK


@inline
def apart(one: State, other: State, spring: float) -> float:
    """Amplitude of the free swing that is the difference of two states."""
    return math.hypot(one.y - other.y, (one.v - other.v) / math.sqrt(spring))
