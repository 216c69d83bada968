"""Entry and leaving of a tooth as events, and what the rack does in between; (11)-(14) of docs/feed.md."""

from __future__ import annotations

import math

import numpy as np

from kernels import status as st
from kernels._jit import inline, kernel
from kernels.families.feed.closure import Array, Reduced, Status, reduce_design
from kernels.families.feed.motion import tooth_at

SAMPLES = 256
TWO_PI = 2.0 * math.pi
_MOST_STEPS = 100  # a bound, so that the loop always ends
_PANELS = 16
# Gauss-Legendre, 8 points: abscissae and weights of the positive half
_NODES = (0.1834346424956498, 0.5255324099163290, 0.7966664774136267, 0.9602898564975363)
_WEIGHTS = (0.3626837833783620, 0.3137066458778873, 0.2223810344533745, 0.1012285362903763)

OUTPUTS = (
    "phi_entry", "phi_leave", "feed_angle", "entry_speed", "leave_speed", "stitch_length", "rise", "flatness",
    "crossings",
)  # fmt: skip


@inline
def _height(r: Reduced, phi: float, order: int) -> float:
    """Return the height of the tooth above the plate (order 0), or its first derivative by phi (order 1)."""
    tooth, _ = tooth_at(r, math.cos(phi), math.sin(phi))
    value: float = tooth.y - r.plate if order == 0 else tooth.y1
    return value


@inline
def _passage(r: Reduced, low: float, high: float, f_low: float, f_high: float, order: int) -> float:
    """Find by false position where the height (or its derivative) passes zero between two crank angles
    of opposite signs.

    The end that stays is given half its value (Illinois), so that both ends close in.
    """
    for _ in range(_MOST_STEPS):
        x = low - f_low * ((high - low) / (f_high - f_low))
        # rounding may throw the secant's zero out of a bracket that has become narrow
        if not low < x < high:
            x = 0.5 * (low + high)
        if x in (low, high):
            break
        f = _height(r, x, order)
        if f == 0.0:
            return x
        if (f > 0.0) == (f_high > 0.0):
            high, f_high = x, f
            f_low *= 0.5
        else:
            low, f_low = x, f
            f_high *= 0.5
        if high - low <= 4.0 * 2.0**-53 * max(abs(low), abs(high)):
            break
    return 0.5 * (low + high)


@inline
def _between(r: Reduced, entry: float, leave: float) -> tuple[float, float]:
    """Return the greatest height between two crank angles, and the area under the path there."""
    rise, area = 0.0, 0.0
    width = (leave - entry) / _PANELS
    for k in range(_PANELS):
        middle = entry + (k + 0.5) * width
        for n in range(4):
            for side in (-1.0, 1.0):
                phi = middle + side * 0.5 * width * _NODES[n]
                tooth, _ = tooth_at(r, math.cos(phi), math.sin(phi))
                area += 0.5 * width * _WEIGHTS[n] * (tooth.y - r.plate) * tooth.x1
    # the top is where the slope falls through zero: exact, where the largest of the samples would lie below it
    before, f_before = entry, _height(r, entry, 1)
    steps = 4 * _PANELS
    for k in range(1, steps + 1):
        phi = entry + (leave - entry) * (k / steps)
        f = _height(r, phi, 1)
        # equality on one side alone: a top that falls on a step is found once
        if f_before > 0.0 >= f:
            top = _passage(r, before, phi, f_before, f, 1) if f < 0.0 else phi
            rise = max(rise, _height(r, top, 0))
        before, f_before = phi, f
    return rise, area


@kernel
def feeding(designs: Array, status: Status, outputs: Array) -> None:
    """Compute the entry and leaving of the tooth, its speed there, stitch length, rise and flatness of every design.

    Equations (11)-(14) of docs/feed.md.  Of several times above the plate the longest counts.

    Parameters
    ----------
    designs : (n, 23) columns of :class:`kernels.families.feed.Design`
    status : (n,) out; OK, NO_EVENT (the tooth never passes the plate), that of the first pose that is not assembled
    outputs : (9, n) out in the order of :data:`OUTPUTS` [rad, length, length per rad]; nan where the status is not OK

    Notes
    -----
    Times above or below the plate that are shorter than 1/256 of a turn may be missed.
    """
    heights = np.empty(SAMPLES)
    step = TWO_PI / SAMPLES
    for i in range(designs.shape[0]):
        r = reduce_design(designs, i)
        for k in range(9):
            outputs[k, i] = math.nan
        worst = st.OK if r.valid else st.INVALID_INPUT
        for j in range(SAMPLES):
            tooth, code = tooth_at(r, math.cos(j * step), math.sin(j * step))
            heights[j] = tooth.y - r.plate
            if worst == st.OK and code != st.OK:
                worst = code
        status[i] = worst
        if worst != st.OK:
            continue
        crossings, longest, first, last = 0, -1, 0, 0
        for j in range(SAMPLES):
            after = heights[(j + 1) % SAMPLES]
            if (heights[j] > 0.0) != (after > 0.0):
                crossings += 1
            if heights[j] <= 0.0 < after:
                # around the seam of the turn: a stay may begin before phi = 2 pi and end after it
                stay = 1
                while heights[(j + 1 + stay) % SAMPLES] > 0.0:
                    stay += 1
                if stay > longest:
                    longest, first, last = stay, j, j + stay
        outputs[8, i] = crossings
        if crossings == 0:
            status[i] = st.NO_EVENT
            continue
        entry = _passage(r, first * step, (first + 1) * step, heights[first], heights[(first + 1) % SAMPLES], 0)
        leave = _passage(r, last * step, (last + 1) * step, heights[last % SAMPLES], heights[(last + 1) % SAMPLES], 0)
        one, _ = tooth_at(r, math.cos(entry), math.sin(entry))
        two, _ = tooth_at(r, math.cos(leave), math.sin(leave))
        rise, area = _between(r, entry, leave)
        stitch = two.x - one.x
        outputs[0, i], outputs[1, i], outputs[2, i] = entry % TWO_PI, leave % TWO_PI, leave - entry
        outputs[3, i], outputs[4, i], outputs[5, i] = one.y1 * r.unit, two.y1 * r.unit, stitch * r.unit
        outputs[6, i], outputs[7, i] = rise * r.unit, area / (rise * stitch)
