"""First look at a block of designs: 32 samples of each, all designs side by side.

It is for designs whose first stage is resolved by 32 samples.  Most of them need no more, and then no step loops over
the samples of one design: neither the nearest zero of a later discriminant, nor the local maxima, which come as bits
of one number.  Designs that need more samples are sampled one by one in :mod:`kernels.chains.look`.
"""

from __future__ import annotations

from kernels.arithmetic.intrinsics import largest, smallest
from kernels.chains.curves import Sampling
from kernels.chains.form import BLOCK, Helper
from kernels.chains.halves import TOGETHER, handed_rows, keepers, writers
from kernels.chains.look import FEWEST, FLAT, ROUGH, SHARE, Counts, Scratch, fourth_difference, zero_beside
from kernels.chains.peaks import CONSTANTS, A, B, C
from kernels.jit import generated_inline, inline
from kernels.types import TWO_PI as TURN
from kernels.types import Array, CosSin

# Rows of BLOCK numbers: results of the samples of a curve; those of the discriminants, the least of each later stage.
SCALE_AT, ROUGHNESS, _MOST, _LEAST, _FLOOR, MARKS, _MARKS_TOO, SAID = (k * BLOCK for k in range(8))
CLOSE, LOW = 0, BLOCK
RESOLVED, UNRESOLVED, FLAT_CURVE = 0.0, 1.0, 2.0  # values of ROUGHNESS
ANGLES = TOGETHER // BLOCK  # crank angles per round of both loops
AT_ONCE = 4  # samples per round, so that a row is fetched less often
SAMPLES = (FEWEST + 4) * BLOCK  # closed periodically by two rows on either side
DIPS = (FEWEST + 2) * BLOCK  # discriminants of a later stage, closed by one row on either side


@inline
def _row(rows: Array, i: int) -> Array:
    """Row number i.  The compiler sees that an index into it is not negative; of an index that is a sum it does not."""
    return rows[i * BLOCK : (i + 1) * BLOCK]


@inline
def _close(count: int, rows: Array, first: int, beyond: int) -> None:
    """Copy rows at the ends, so that ``beyond`` rows on either side of the samples close them periodically."""
    for k in range(beyond):
        before, last = _row(rows, first + k), _row(rows, first + FEWEST + k)
        after, begin = _row(rows, first + FEWEST + beyond + k), _row(rows, first + beyond + k)
        for i in range(count):
            before[i] = last[i]
        for i in range(count):
            after[i] = begin[i]


@inline
def _spread(count: int, values: Array, said: Array, mode: int) -> None:
    """Write the size of each curve (largest magnitude, or range), and whether the samples resolve the curve."""
    fourth, most, least = _row(said, ROUGHNESS // BLOCK), _row(said, _MOST // BLOCK), _row(said, _LEAST // BLOCK)
    scale = _row(said, SCALE_AT // BLOCK)
    for i in range(count):
        fourth[i], most[i], least[i] = 0.0, -1e300, 1e300
    for j in range(0, FEWEST, AT_ONCE):
        at0, at1, at2, at3 = _row(values, j), _row(values, j + 1), _row(values, j + 2), _row(values, j + 3)
        at4, at5, at6, at7 = _row(values, j + 4), _row(values, j + 5), _row(values, j + 6), _row(values, j + 7)
        for i in range(count):
            y0, y1, y2, y3, y4, y5, y6, y7 = at0[i], at1[i], at2[i], at3[i], at4[i], at5[i], at6[i], at7[i]
            even = largest(fourth_difference(y0, y1, y2, y3, y4), fourth_difference(y1, y2, y3, y4, y5))
            odd = largest(fourth_difference(y2, y3, y4, y5, y6), fourth_difference(y3, y4, y5, y6, y7))
            fourth[i] = largest(fourth[i], largest(even, odd))
            most[i] = largest(most[i], largest(largest(y2, y3), largest(y4, y5)))
            least[i] = smallest(least[i], smallest(smallest(y2, y3), smallest(y4, y5)))
    for i in range(count):
        size, varies = max(most[i], -least[i]), most[i] - least[i]
        scale[i] = size if mode == 0 else varies
        rough = UNRESOLVED if fourth[i] > ROUGH * scale[i] else RESOLVED
        fourth[i] = rough if varies > FLAT * size else FLAT_CURVE


@inline
def _mark(count: int, values: Array, said: Array, which: int, mode: int) -> None:
    """Mark the local maxima that are above the floor, as a sum of powers of two."""
    floor, marks = _row(said, _FLOOR // BLOCK), _row(said, MARKS // BLOCK + which)
    most, least, scale = _row(said, _MOST // BLOCK), _row(said, _LEAST // BLOCK), _row(said, SCALE_AT // BLOCK)
    # A magnitude is the curve times its own sign, a least value the largest of the negative curve.
    up, down = 1.0 if mode >= 0 else -1.0, 1.0 if mode > 0 else -1.0
    for i in range(count):
        best = most[i] if mode > 0 else -least[i]
        floor[i], marks[i] = SHARE * scale[i] if mode == 0 else best - (1.0 - SHARE) * scale[i], 0.0
    mark = 1.0
    for j in range(1, FEWEST + 1, AT_ONCE):
        at0, at1, at2 = _row(values, j), _row(values, j + 1), _row(values, j + 2)
        at3, at4, at5 = _row(values, j + 3), _row(values, j + 4), _row(values, j + 5)
        for i in range(count):
            least, y0, y1, y2, y3, y4, y5 = floor[i], at0[i], at1[i], at2[i], at3[i], at4[i], at5[i]
            first = _peak_bit(y0, y1, y2, up, down, least) + 2.0 * _peak_bit(y1, y2, y3, up, down, least)
            second = _peak_bit(y2, y3, y4, up, down, least) + 2.0 * _peak_bit(y3, y4, y5, up, down, least)
            marks[i] += mark * (first + 4.0 * second)
        mark *= 16.0


@inline
def _peak_bit(before: float, y: float, after: float, up: float, down: float, floor: float) -> float:
    """Return 1 for a local maximum that is not below the floor, else 0."""
    sign = up if y >= 0.0 else down
    z = sign * y
    return 1.0 if (z >= floor) & (z > sign * before) & (z >= sign * after) else 0.0


@inline
def _dip(count: int, guards: Array, low_at: Array, slot: int, enough: float) -> None:
    """Write the least discriminant of a stage, and 1 where its nearest complex zero may be too near for the samples.

    That is nearer than ``enough``, a squared distance [samples] as of :func:`kernels.chains.look.zero_beside`, which is
    tested here without a division.
    """
    low, near, row = _row(low_at, LOW // BLOCK + slot), _row(low_at, CLOSE // BLOCK), slot * (FEWEST + 2)
    for i in range(count):
        low[i] = 1e300
    for j in range(0, FEWEST, AT_ONCE):
        at0, at1, at2 = _row(guards, row + j), _row(guards, row + j + 1), _row(guards, row + j + 2)
        at3, at4, at5 = _row(guards, row + j + 3), _row(guards, row + j + 4), _row(guards, row + j + 5)
        for i in range(count):
            y0, y1, y2, y3, y4, y5 = at0[i], at1[i], at2[i], at3[i], at4[i], at5[i]
            low[i] = smallest(low[i], smallest(smallest(y1, y2), smallest(y3, y4)))
            first = largest(_dip_bit(y0, y1, y2, enough), _dip_bit(y1, y2, y3, enough))
            second = largest(_dip_bit(y2, y3, y4, enough), _dip_bit(y3, y4, y5, enough))
            near[i] = largest(near[i], largest(first, second))


@inline
def _dip_bit(left: float, here: float, right: float, enough: float) -> float:
    """Return 1 where the parabola through three samples has its complex zero nearer than ``enough``, else 0."""
    bend, slope = 0.5 * (left + right) - here, 0.5 * (right - left)
    dips = (here <= left) & (here <= right) & (bend > 0.0)
    return 1.0 if dips & (here * bend - 0.25 * slope * slope < enough * (bend * bend)) else 0.0


@inline
def nearest_dip(guards: Array, slot: int, lane: int) -> float:
    """Squared distance [samples] of the nearest complex zero of one design's discriminant, by parabolas."""
    nearest = 1e300
    for j in range(1, FEWEST + 1):
        at = (slot * (FEWEST + 2) + j) * BLOCK + lane
        nearest = smallest(nearest, zero_beside(guards[at - BLOCK], guards[at], guards[at + BLOCK]))
    return nearest


def first_looker(of: Sampling, get: Helper) -> Helper:
    """Make the function ``look(count, m, table, modes, room)``.

    It samples the designs whose constants stand at the places 0 ... count - 1 of the list m, and writes of each curve
    the rows SCALE_AT, ROUGHNESS and MARKS (one of each mode) of ``room.said``, and the rows CLOSE and LOW of
    ``room.low``.  The samples stand in the rows 2 ... 33 of each curve in ``room.abreast``, the discriminants in the
    rows 1 ... 32 of each later stage in ``room.dips``.
    """
    curves, guarded, drive, sample, hand, take = of.curves, of.guarded, of.drive, of.sample, of.hand, of.take
    (guard_rows, keep, keep_last), (value_rows, write) = keepers(of), writers(of)
    # A little more than needed: where the test holds the exact distance is computed afterwards.
    enough = (1.0 + 1e-6) * (of.density / TURN) ** 2

    def look(count: int, m: Array, table: CosSin, modes: Counts, room: Scratch) -> None:
        (cos, sin), values, guards, handed = table, room.abreast, room.dips, room.handed
        for start in range(0, FEWEST, ANGLES):
            for j in range(ANGLES):
                u, v, rows = cos[start + j], sin[start + j], handed_rows(handed, j * BLOCK, (j + 1) * BLOCK)
                low = guard_rows(guards, DIPS, (start + j + 1) * BLOCK, (start + j + 2) * BLOCK)
                for i in range(count):
                    t, deltas = drive(get(m, i + CONSTANTS), u, v)
                    hand(rows, i, t)
                    keep(low, deltas, i)
            for j in range(ANGLES):
                here = value_rows(values, SAMPLES, (start + j + 2) * BLOCK, (start + j + 3) * BLOCK)
                rows = handed_rows(handed, j * BLOCK, (j + 1) * BLOCK)
                low = guard_rows(guards, DIPS, (start + j + 1) * BLOCK, (start + j + 2) * BLOCK)
                for i in range(count):
                    y, delta = sample(get(m, i + CONSTANTS), m[i + A], m[i + B], m[i + C], take(rows, i))
                    write(here, i, y)
                    keep_last(low, delta, i)
        near = _row(room.low, CLOSE // BLOCK)
        for i in range(count):
            near[i] = 0.0
        for slot in range(guarded):
            _close(count, guards, slot * (FEWEST + 2), 1)
            _dip(count, guards, room.low, slot, enough)
        for c in range(curves):
            own, said = values[c * SAMPLES : (c + 1) * SAMPLES], room.said[c * SAID : (c + 1) * SAID]
            _close(count, own, 0, 2)
            _spread(count, own, said, modes[c])
            # Of two curves each has one mode.
            for which in range(c, c + 1 if curves > 1 else modes.size):
                _mark(count, own, said, which - c, modes[which])

    return generated_inline(f"look_abreast_{of.name}", look)
