"""List of the local maxima of a block of designs: samples that resolve each curve, and the peaks among the samples."""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np

from kernels import status as st
from kernels.arithmetic.intrinsics import lowest_bit
from kernels.chains.chain import Chained
from kernels.chains.curves import Sampling
from kernels.chains.form import BLOCK, STRIDE, Helper
from kernels.chains.halves import HANDED
from kernels.chains.lanes import (
    CLOSE,
    DIPS,
    FLAT_CURVE,
    LOW,
    MARKS,
    ROUGHNESS,
    SAID,
    SAMPLES,
    SCALE_AT,
    UNRESOLVED,
    first_looker,
    nearest_dip,
)
from kernels.chains.look import (
    FEWEST,
    GUARD_ROW,
    LOOKING,
    MOST,
    OPEN,
    SHARE,
    VALUES,
    Counts,
    Scratch,
    Spans,
    resolved,
    samples_for,
    taker,
)
from kernels.chains.peaks import CAPACITY, CONSTANTS, MOST_PEAKS, PLACE, A, B, C, append
from kernels.jit import generated_inline, generated_part, inline
from kernels.types import TWO_PI as TURN
from kernels.types import Array, CosSin, Status

ZERO = np.int64(0)  # a literal 0 in a call is a type of its own, for which `gather` would be compiled once more
CHUNK = FEWEST  # samples whose peaks are marked together
ROW = 2**62 - 1  # as `kernels.chains.peaks.PLACE`, for rows of a table
ANGLE = 2**15 - 1  # as `kernels.chains.peaks.PLACE`, for samples and crank angles
LINE = 8  # numbers in a cache line


@inline
def aligned(numbers: int) -> Array:
    """Memory that begins at a cache line: a vector that lies across two lines would be fetched twice."""
    memory = np.empty(numbers + LINE)
    begin = -(memory.ctypes.data // memory.itemsize) % LINE
    return memory[begin : begin + numbers]


@inline
def new_room(curves: int, guarded: int, wide: int) -> Scratch:
    """Memory of the search for curves with ``guarded`` later stages and designs of ``wide`` columns."""
    stages = max(guarded, 1)
    return Scratch(
        aligned(curves * VALUES), aligned(curves * SAMPLES), aligned(stages * GUARD_ROW), aligned(stages * DIPS),
        aligned(curves * SAID), aligned(LOW + stages * BLOCK), aligned(wide * BLOCK), aligned(HANDED),
        np.empty(BLOCK), np.zeros(BLOCK, np.int64), np.zeros((2, BLOCK), np.int64), np.empty((2, BLOCK, 3), np.int64),
        np.zeros(2, np.int64),
    )  # fmt: skip


@inline
def _enough(distance: float, density: float) -> int:
    """Find the number of samples that resolves a singularity at a distance [rad]; 0 if above MOST."""
    n = FEWEST
    while n <= MOST and not n * distance >= density:
        n *= 2
    return n if n <= MOST else 0


@inline
def _counting(mode: int, most: float, least: float) -> tuple[float, float]:
    """Size of a curve by its extreme samples, and the floor above which a peak may be the highest."""
    if mode == 0:
        scale = max(most, -least)
        return scale, SHARE * scale
    scale = most - least
    return scale, (most if mode > 0 else -least) - (1.0 - SHARE) * scale


class Sampled(NamedTuple):
    """Samples of a curve, of one design alone or of a block; for one alone the largest and the least of them."""

    alone: bool
    n: int
    values: Array
    most: float
    least: float


def enlister(chain: Chained, of: Sampling) -> Helper:
    """Make the part ``enlist(designs, begin, end, table, made_of, modes, m, status, room)``.

    It samples designs begin, ..., end - 1 once and lists their local maxima: of one curve those for all modes in the
    list m; of two curves those of each, for one mode, in the halves of m.  It writes the lengths of the lists, in whole
    vectors, to ``room.length``.
    """
    get, doubts, look_abreast = chain.record.get, chain.record.doubts, first_looker(of, chain.record.get)
    curves, last, guarded, density = of.curves, chain.stages - 1, of.guarded, of.density
    seat, gather = _placer(chain, curves), _gatherer(chain, curves)
    look = _looker(of, gather)

    # One function with a single return: with more the references to each array are counted, which takes time.
    def enlist(
        designs: Array, begin: int, end: int, table: CosSin, made_of: Array, modes: Counts, m: Array, status: Status,
        room: Scratch,
    ) -> None:  # fmt: skip
        needed, place, length = room.needed, room.place, room.length
        look_abreast(seat(designs, begin, end, density, made_of, m, room), m, table, modes, room)
        for i in range(begin, end):
            n = _enough(room.near[i - begin], density)
            if n > 0:
                own = place[i - begin] & PLACE
                limits: Any = doubts(get(m, own + CONSTANTS))
                code = LOOKING if limits[last] < math.inf else OPEN
                for c in range(curves):
                    needed[c, i - begin], status[c, i] = n, code
                    if n == FEWEST and code == LOOKING:
                        needed[c, i - begin], status[c, i] = _judge(limits, own, c, guarded, density, room)
                for which in range(curves, modes.size):
                    status[which, i] = status[0, i]
        for which in range(modes.size):
            own = (which if curves > 1 else 0) * SAMPLES
            few = Sampled(False, FEWEST, room.abreast[own : own + SAMPLES], 0.0, 0.0)
            gather(ZERO, end - begin, few, which, modes[which], table, m, status[which, begin:end], room)
        for i in range(begin, end):
            if status[0, i] == LOOKING or status[curves - 1, i] == LOOKING:
                k: Any = get(m, (place[i - begin] & PLACE) + CONSTANTS)
                look(i - begin, k, made_of[i], doubts(k), table, modes, m, status[:, begin:end], room)
        for c in range(curves):
            length[c] = (length[c] + 7) & ~7

    return generated_part(f"enlist_{of.name}", enlist)


def _gatherer(chain: Chained, curves: int) -> Helper:
    """Make the function ``gather(begin, end, at, which, mode, table, m, status, room)``.

    It appends the local maxima of all designs with status OK to the list of the curve.
    """
    get, put, half = chain.record.get, chain.record.put, listed_numbers(chain)

    def gather(
        begin: int, end: int, at: Sampled, which: int, mode: int, table: CosSin, m: Array, status: Status,
        room: Scratch,
    ) -> None:  # fmt: skip
        # A magnitude is the curve times its own sign, a least value the largest of the negative curve.
        up, down = 1.0 if mode >= 0 else -1.0, 1.0 if mode > 0 else -1.0
        c = which if curves > 1 else 0
        (cos, sin), values, said, span, width = table, at.values, room.said[c * SAID :], room.span, TURN / at.n
        m, length = m[c * half : (c + 1) * half], room.length[c]
        for i in range(begin, end):
            if status[i] != st.OK:
                continue
            own = room.place[i] & PLACE
            first, stride, scale, floor = own, BLOCK, said[SCALE_AT + own], 0.0
            if at.alone:
                first, stride = 0, 1
                scale, floor = _counting(mode, at.most, at.least)
            # The first maximum of a curve's first mode stands where the constants are already.
            many, begun, seats = 0, length, 1 - (which - c)
            for chunk in range(2, at.n + 2, CHUNK):
                marked = said[MARKS + (which - c) * BLOCK + own]
                peaks = _peaks(chunk, values, up, down, floor) if at.alone else int(marked)
                while peaks != 0:
                    j = chunk + (lowest_bit(peaks) & PLACE)
                    peaks &= peaks - 1
                    place = (own if many < seats else length) & PLACE
                    if (many < seats) | ((many < MOST_PEAKS) & (length < CAPACITY)):
                        angle, here = (at.n - FEWEST + j - 2) & ANGLE, (first + j * stride) & ANGLE
                        sign = up if values[here] >= 0.0 else down
                        three = sign * values[here - stride], sign * values[here], sign * values[here + stride]
                        append(m, place, cos[angle], sin[angle], width, (j - 2) * width, three, sign, scale)
                        if many >= seats:
                            m[place + A], m[place + B], m[place + C] = m[own + A], m[own + B], m[own + C]
                            put(m, place + CONSTANTS, get(m, own + CONSTANTS))
                    length += 0 if many < seats else 1
                    many += 1
            span[which, i, 0], span[which, i, 1], span[which, i, 2] = own if seats else begun, begun + which - c, length
            if many == 0 or many > MOST_PEAKS or length > CAPACITY:
                status[i], length = OPEN, begun
        room.length[c] = length

    return generated_inline(f"gather{curves}_{chain.record.name}", gather)


def listed_numbers(chain: Chained) -> int:
    """Size of a list of local maxima."""
    return CONSTANTS + chain.record.numbers * STRIDE


def _placer(chain: Chained, curves: int) -> Helper:
    """Make the function ``seat(designs, begin, end, density, made_of, m, room)``: places of designs in the list.

    It writes the constants of all designs to be sampled into the list of each curve, and begins ``room.length``.  It
    returns how many are sampled abreast, rounded up to whole vectors as the length is; the surplus is never read.
    """
    load, loaded, put = chain.record.load, chain.record.loaded, chain.record.put
    half = listed_numbers(chain)

    def seat(designs: Array, begin: int, end: int, density: float, made_of: Array, m: Array, room: Scratch) -> int:
        abreast, count = 0, 0
        # Designs whose first stage needs no more than the first look come first.
        for some in range(2):
            abreast = count
            for i in range(begin, end):
                distance = room.near[i - begin]
                few = distance * FEWEST >= density
                if few if some == 0 else (not few) & (distance * MOST >= density):
                    room.place[i - begin] = count
                    load(designs, i & ROW, room.block, count & PLACE)
                    for c in range(curves):
                        own = c * half + (count & PLACE)
                        m[own + A], m[own + B], m[own + C] = made_of[i, 0], made_of[i, 1], made_of[i, 2]
                    count += 1
        length = (count + 7) & ~7
        for place in range(length):
            k = loaded(room.block, place)
            put(m, place + CONSTANTS, k)
            if curves > 1:
                put(m, half + place + CONSTANTS, k)
        room.length[:curves] = length
        return (abreast + 7) & ~7

    return generated_inline(f"seat{curves}_{chain.record.name}", seat)


@inline
def _judge(limits: Any, lane: int, c: int, guarded: int, density: float, room: Scratch) -> tuple[int, int]:
    """Find the number of samples that curve c of a design needs by its first look, and its status.

    The status is that of :func:`kernels.chains.look.resolved`.
    """
    code, n = LOOKING, FEWEST
    for slot in range(guarded):
        low = room.low[LOW + slot * BLOCK + lane]
        if code == LOOKING and not low > limits[slot + 1]:
            code = st.NOT_ROTATABLE if low < -limits[slot + 1] else OPEN
        if code == LOOKING and room.low[CLOSE + lane] != 0.0:
            n = samples_for(density, FEWEST, nearest_dip(room.dips, slot, lane), n)
    rough = room.said[c * SAID + ROUGHNESS + lane]
    if code == LOOKING and rough == FLAT_CURVE:
        code = OPEN
    elif code == LOOKING and rough == UNRESOLVED:
        n = max(n, 2 * FEWEST)
    return n, st.OK if code == LOOKING and n == FEWEST else code


def _looker(of: Sampling, gather: Helper) -> Helper:
    """Make the function ``look(lane, k, of, limits, table, modes, m, status, room)``.

    It samples one design, as densely as each curve needs, and gathers the local maxima of the samples.
    """
    curves, guarded, density, take = of.curves, of.guarded, of.density, taker(of)

    def look(
        lane: int, k: Any, made_of: Array, limits: Any, table: CosSin, modes: Counts, m: Array, status: Status,
        room: Scratch,
    ) -> None:  # fmt: skip
        n = _next(curves, lane, status, room.needed)
        while n <= MOST:
            take(k, made_of[0], made_of[1], made_of[2], n, table, room.values, room.guards, room.handed)
            for c in range(curves):
                if status[c, lane] == LOOKING and room.needed[c, lane] == n:
                    values = room.values[c * VALUES : (c + 1) * VALUES]
                    # Largest and least value need the same samples.
                    room.needed[c, lane], most, least, code = resolved(
                        n, values, room.guards, modes[c], limits, guarded, density
                    )
                    at = Sampled(True, n, values, most, least)
                    for which in range(c, c + 1 if curves > 1 else modes.size):
                        status[which, lane] = code
                        gather(lane, lane + 1, at, which, modes[which], table, m, status[which], room)
            n = _next(curves, lane, status, room.needed)
        for which in range(modes.size):
            status[which, lane] = OPEN if status[which, lane] == LOOKING else status[which, lane]

    return generated_inline(f"look_{of.name}", look)


@inline
def _next(curves: int, lane: int, status: Status, needed: Spans) -> int:
    """Least number of samples that a curve of a design still needs; above MOST if none does."""
    n = 2 * MOST
    for c in range(curves):
        n = min(n, needed[c, lane]) if status[c, lane] == LOOKING else n
    return n


@inline
def _peaks(chunk: int, values: Array, up: float, down: float, floor: float) -> int:
    """Local maxima above the floor among CHUNK samples, one bit each; without a branch, so that it is vector code."""
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
