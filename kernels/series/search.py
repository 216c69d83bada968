"""True extrema of a chain over the turn, refined between samples: the generated kernel (docs/extrema.md).

Per design: samples that resolve the curve (`kernels.series.look`); every local maximum of at least 60 % of the best is
refined, vectorised over the maxima of a block of designs (`kernels.series.peaks`).  What is not trusted, or what
rounding may have changed by more than 2^-14 of the target, is left to precise poses.
"""

from __future__ import annotations

import math
from functools import lru_cache
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

from kernels import status as st
from kernels._jit import generated, generated_part, inline
from kernels.bits import lowest_bit
from kernels.series.chain import Chained
from kernels.series.curves import MARGIN, Curve, curve
from kernels.series.form import STRIDE, Helper
from kernels.series.look import FEWEST, GUARD_ROW, MOST, OPEN, TURN, looker
from kernels.series.peaks import (
    BLOCK,
    CAPACITY,
    CONSTANTS,
    ERROR,
    HEIGHT,
    LAST,
    MOST_PEAKS,
    MOVED,
    REACH,
    ROUNDING,
    SCALE,
    START,
    WIDTH,
    A,
    B,
    C,
    append,
    begin_at_vertex,
    finisher,
    refiner,
)

Array: TypeAlias = NDArray[np.float64]
Status: TypeAlias = NDArray[np.uint8]
Counts: TypeAlias = NDArray[np.int64]

SHARE = 0.6  # a peak below this share of the best sample is not refined
PLAIN = 2.0**-14  # of the target: larger rounding errors are left to precise poses
RIVALS = 1e-3  # of the scale: peaks lower by no more may turn out the highest where rounding has moved them
SETTLING = 8  # more steps for a maximum that is not trusted after the usual ones
MORE = 4  # times as many samples for a design of which a maximum is not trusted even so
ROUNDED, UNTRUSTED = 254, 253  # instead of a status; the first see `find_extrema`
VALUE, PHI, VALUE_ERROR, PHI_ERROR, SCALE_ROW, SPACING = range(6)
CHUNK = 32  # samples whose peaks are looked for together


@lru_cache(maxsize=64)
def find_extrema(chain: Chained, order: int) -> Helper:
    """Make the kernel ``find(designs, opening, distance, cos, sin, made_of, mode, target, tie, status, found)``.

    It finds one extremum over the turn of a curve of a chain, one of `kernels.series.curves`, of that order or the
    `MARGIN`.

    Its arguments: designs (n, P); opening (n,), OK where the first stage turns, NOT_ROTATABLE where it does not;
    distance (n,) [rad] of its nearest singularity from the real axis; `sampling_tables`; made_of (n, 3), the numbers a,
    b, c of the curve; mode: 0 for the largest magnitude, +1 for the largest value, -1 for the least; target: relative
    error wanted, of the magnitude or of the curve's range; tie: share of that size by which no other peak may come near
    the highest one, negative where it does not matter which of two is higher.  Then out: status (n,), and found (6, n)
    with the rows VALUE; PHI, its crank angle in [0, 2 pi); estimates of the errors of both; SCALE, what the target is
    relative to; SPACING of the samples [rad].

    The status is OK; ROUNDED, where rounding may have moved a single highest peak by more than its share of the target;
    NOT_ROTATABLE, where a stage does not reach; OPEN, where nothing is decided.  With the last two the others are nan.
    """
    of = curve(chain, order)
    get, rows = chain.record.get, CONSTANTS + chain.record.numbers * STRIDE
    per_rho, guards_size, allowed = of.samples, max(of.guarded, 1) * GUARD_ROW, 1.0 if order == MARGIN else PLAIN
    enlist, refine, finish = _enlister(chain, of), refiner(of, get), finisher(of, get)

    def find(
        designs: Array, opening: Status, distance: Array, cos: Array, sin: Array, made_of: Array, mode: int,
        target: float, tie: float, status: Status, found: Array,
    ) -> None:  # fmt: skip
        m, values, guards = np.zeros(rows), np.empty(MOST + 4), np.empty(guards_size)
        first, near = np.empty(BLOCK + 1, np.int64), np.empty(BLOCK)
        rounds = 2 if target > 1e-4 else 3
        for start in range(0, designs.shape[0], BLOCK):
            end = min(start + BLOCK, designs.shape[0])
            for i in range(start, end):
                status[i] = st.NOT_ROTATABLE if opening[i] == st.NOT_ROTATABLE else OPEN
                near[i - start] = distance[i] if opening[i] == st.OK else 0.0
            enlist(designs, start, end, near, cos, sin, made_of, mode, m, first, status, values, guards)
            padded = (first[end - start] + 7) & ~7  # whole vectors; what stands in the surplus is never read
            begin_at_vertex(padded, m)
            refine(padded, m, rounds)
            finish(padded, m, target)
            for i in range(start, end):
                if status[i] != st.OK:
                    continue
                low, high = first[i - start], first[i - start + 1]
                for peak in range(low, high):
                    if not m[peak + ERROR] < math.inf:  # a flat top, which Newton's method climbs slowly
                        refine(1, m[peak:], SETTLING)
                        finish(1, m[peak:], target)
                status[i] = _decide(low, high, m, mode, allowed * target, tie, i, found)
            # Now the list is free for those, one by one, whose tops were not single ones between their samples.
            for i in range(start, end):
                rho = per_rho / (FEWEST * MORE)
                while status[i] == UNTRUSTED and rho * MOST >= per_rho:
                    near[0] = min(rho, distance[i])
                    enlist(designs, i, i + 1, near, cos, sin, made_of, mode, m, first, status, values, guards)
                    begin_at_vertex(first[1], m)
                    refine(first[1], m, rounds + SETTLING)
                    finish(first[1], m, target)
                    if status[i] == st.OK:
                        status[i] = _decide(first[0], first[1], m, mode, allowed * target, tie, i, found)
                    rho /= MORE
                status[i] = OPEN if status[i] == UNTRUSTED else status[i]
                if status[i] != st.OK and status[i] != ROUNDED:
                    found[:, i] = math.nan

    return generated(f"find_{of.name}", find)


@inline
def _decide(begin: int, end: int, m: Array, mode: int, rounding: float, tie: float, i: int, found: Array) -> int:
    """Write the highest maximum of design i; OK, ROUNDED, UNTRUSTED, or OPEN where it is not sure which is highest."""
    winner = begin
    for peak in range(begin, end):
        if not m[peak + ERROR] < math.inf:
            return UNTRUSTED
        winner = peak if m[peak + HEIGHT] > m[winner + HEIGHT] else winner
    height, blur, scale = m[winner + HEIGHT], m[winner + ROUNDING], m[winner + SCALE]
    code = st.OK if blur <= rounding * scale else ROUNDED
    apart = RIVALS if code == ROUNDED else tie
    if apart >= 0.0:
        for peak in range(begin, end):
            if peak != winner and m[peak + HEIGHT] + m[peak + ROUNDING] >= height - blur - apart * scale:
                return OPEN
    found[VALUE, i] = -height if mode < 0 else height
    place = m[winner + START] + m[winner + MOVED] + m[winner + LAST]
    found[PHI, i] = place - TURN * np.floor(place / TURN)
    found[VALUE_ERROR, i], found[PHI_ERROR, i] = m[winner + ERROR] + blur, m[winner + REACH]
    found[SCALE_ROW, i], found[SPACING, i] = scale, m[winner + WIDTH]
    return code


def _enlister(chain: Chained, of: Curve) -> Helper:
    """Make the part ``enlist(designs, begin, end, near, ...)``: samples designs begin, ..., end - 1 and lists their
    local maxima.

    ``near`` has for each the distance of its nearest singularity, 0 for one that is left out; ``first`` gets for each
    where its maxima begin in the list, and at last the list's length.
    """
    constants, put, doubts, look = chain.record.constants, chain.record.put, chain.record.doubts, looker(of)
    last, per_rho = chain.stages - 1, of.samples

    # One function without a return half way: with more the references to each array are counted, which takes time.
    def enlist(
        designs: Array, begin: int, end: int, near: Array, cos: Array, sin: Array, made_of: Array, mode: int, m: Array,
        first: Counts, status: Status, values: Array, guards: Array,
    ) -> None:  # fmt: skip
        # A magnitude is the curve times its own sign, a least value the largest of the negative curve.
        up, down = (1.0, -1.0) if mode == 0 else (1.0 * mode, 1.0 * mode)
        count = 0
        for i in range(begin, end):
            first[i - begin], distance = count, near[i - begin]
            k: Any = constants(designs, i)
            limits: Any = doubts(k)
            if not (distance * MOST >= per_rho and limits[last] < math.inf):
                continue
            a, b, c = made_of[i, 0], made_of[i, 1], made_of[i, 2]
            n = FEWEST
            while n * distance < per_rho:
                n *= 2
            n, most, least, status[i] = look(k, a, b, c, n, cos, sin, mode, limits, values, guards)
            if status[i] != st.OK:
                continue
            scale = max(most, -least) if mode == 0 else most - least
            floor = SHARE * scale if mode == 0 else (most if mode > 0 else -least) - (1.0 - SHARE) * scale
            length, width = count, TURN / n
            for chunk in range(2, n + 2, CHUNK):
                peaks = _peaks(chunk, values, up, down, floor)
                while peaks != 0:
                    j = chunk + lowest_bit(peaks)
                    peaks &= peaks - 1
                    if (length - count < MOST_PEAKS) & (length < CAPACITY):
                        here, sign = n - FEWEST + j - 2, up if values[j] >= 0.0 else down
                        left, z, right = sign * values[j - 1], sign * values[j], sign * values[j + 1]
                        append(m, length, cos[here], sin[here], width, (j - 2) * width, left, z, right, sign, scale)
                        m[length + A], m[length + B], m[length + C] = a, b, c
                        put(m, length + CONSTANTS, k)
                    length += 1
            if length == count or length - count > MOST_PEAKS or length > CAPACITY:
                status[i] = OPEN
            else:
                count = length
        first[end - begin] = count

    return generated_part(f"enlist_{of.name}", enlist)


@inline
def _peaks(chunk: int, values: Array, up: float, down: float, floor: float) -> int:
    """Local maxima that count among the next samples, one bit each; without a branch, so that it is vector code."""
    found = 0
    end = chunk + CHUNK
    before, here, after = values[chunk - 1 : end - 1], values[chunk:end], values[chunk + 1 : end + 1]
    for j in range(CHUNK):
        y = here[j]
        sign = up if y >= 0.0 else down
        z = sign * y
        peak = (z >= floor) & (z > sign * before[j]) & (z >= sign * after[j])
        found |= (1 << j) if peak else 0
    return found
