"""List of the local maxima of a block of designs: samples that resolve each curve, and the peaks among the samples."""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np

from kernels import status as st
from kernels.arithmetic.intrinsics import lowest_bit
from kernels.chains.chain import Chained
from kernels.chains.curves import Curve
from kernels.chains.form import BLOCK, Helper
from kernels.chains.halves import HANDED
from kernels.chains.lanes import (
    CLOSE,
    DIPS,
    FLAT_CURVE,
    LOW,
    MARKS,
    ROUGHNESS,
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
    Counts,
    Scratch,
    looker,
    samples_for,
)  # fmt: skip
from kernels.chains.peaks import CAPACITY, CONSTANTS, MOST_PEAKS, PLACE, A, B, C, append
from kernels.jit import generated_inline, generated_part, inline
from kernels.types import TWO_PI as TURN
from kernels.types import Array, CosSin, Status

ZERO = np.int64(0)  # a literal 0 in a call is a type of its own, for which `gather` would be compiled once more
CHUNK = FEWEST  # samples whose peaks are marked together
ROW = 2**62 - 1  # as `kernels.chains.peaks.PLACE`, for rows of a table
ANGLE = 2**15 - 1  # as `kernels.chains.peaks.PLACE`, for samples and crank angles
LINE = 8  # numbers in a cache line
ABREAST = MOST + LINE  # begin of the samples of a block, behind the samples of one design


@inline
def aligned(numbers: int) -> Array:
    """Memory that begins at a cache line: a vector that lies across two lines would be fetched twice."""
    memory = np.empty(numbers + LINE)
    begin = -(memory.ctypes.data // memory.itemsize) % LINE
    return memory[begin : begin + numbers]


@inline
def new_room(guarded: int, wide: int) -> Scratch:
    """Memory of the search for a curve with ``guarded`` later stages and designs of ``wide`` columns."""
    stages = max(guarded, 1)
    return Scratch(
        aligned(ABREAST + SAMPLES), aligned(stages * GUARD_ROW), aligned(stages * DIPS), aligned(LOW + stages * BLOCK),
        aligned(wide * BLOCK), aligned(HANDED), np.zeros(BLOCK, np.int64), np.zeros(BLOCK, np.int64),
        np.empty((2, BLOCK, 3), np.int64),
    )  # fmt: skip


@inline
def _enough(distance: float, per_rho: float) -> int:
    """Find the number of samples that resolves a singularity at a distance [rad]; 0 if above MOST."""
    n = FEWEST
    while n <= MOST and not n * distance >= per_rho:
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
    """Samples of one design alone or of a block: their number, and for one alone the largest and the least."""

    alone: bool
    n: int
    most: float
    least: float


def enlister(chain: Chained, of: Curve) -> Helper:
    """Make the part ``enlist(designs, begin, end, near, ...)``, which lists the local maxima of some designs.

    It samples designs begin, ..., end - 1 once for all modes and returns the length of the list, in whole vectors.

    ``near`` is the distance of each design's nearest singularity [rad], 0 for a design that is left out.
    """
    get, doubts, seat, gather = chain.record.get, chain.record.doubts, _placer(chain), _gatherer(chain)
    look, look_abreast, guarded = looker(of), first_looker(of, get), of.guarded
    last, per_rho = chain.stages - 1, of.samples

    # One function with a single return: with more the references to each array are counted, which takes time.
    def enlist(
        designs: Array, begin: int, end: int, near: Array, table: CosSin, made_of: Array, modes: Counts, m: Array,
        status: Status, room: Scratch,
    ) -> int:  # fmt: skip
        values, dips, said, place, needed = room.values, room.dips, room.said, room.place, room.needed
        length: int
        abreast, length = seat(designs, begin, end, near, per_rho, made_of, m, room)
        look_abreast(abreast, m, table, modes, values[ABREAST:], dips, said, room.handed)
        for i in range(begin, end):
            n = _enough(near[i - begin], per_rho)
            if n > 0:
                own = place[i - begin] & PLACE
                limits: Any = doubts(get(m, own + CONSTANTS))
                code = LOOKING if limits[last] < math.inf else OPEN
                if n == FEWEST and code == LOOKING:
                    n, code = _judge(limits, own, dips, said, guarded, per_rho)
                needed[i - begin] = n
                for which in range(modes.size):
                    status[which, i] = code
        few = Sampled(False, FEWEST, 0.0, 0.0)
        for which in range(modes.size):
            length = gather(
                ZERO, end - begin, few, which, modes[which], table, m, status[which, begin:end], length, room
            )
        for i in range(begin, end):
            if status[0, i] == LOOKING:
                k: Any = get(m, (place[i - begin] & PLACE) + CONSTANTS)
                a, b, c = made_of[i, 0], made_of[i, 1], made_of[i, 2]
                # Largest and least value need the same samples.
                n, most, least, code = look(k, a, b, c, needed[i - begin], table, modes[0], doubts(k), room)
                by_itself = Sampled(True, n, most, least)
                for which in range(modes.size):
                    status[which, i], only = code, status[which, begin:end]
                    lane = i - begin
                    length = gather(lane, lane + 1, by_itself, which, modes[which], table, m, only, length, room)
        return (length + 7) & ~7

    return generated_part(f"enlist_{of.name}", enlist)


def _gatherer(chain: Chained) -> Helper:
    """Make the function ``gather(begin, end, at, which, mode, table, m, status, length, room)``.

    It appends the local maxima of all designs with status OK to the list, and returns the length of the list.
    """
    get, put = chain.record.get, chain.record.put

    def gather(
        begin: int, end: int, at: Sampled, which: int, mode: int, table: CosSin, m: Array, status: Status, length: int,
        room: Scratch,
    ) -> int:  # fmt: skip
        # A magnitude is the curve times its own sign, a least value the largest of the negative curve.
        up, down = 1.0 if mode >= 0 else -1.0, 1.0 if mode > 0 else -1.0
        (cos, sin), values, said, span, width = table, room.values, room.said, room.span, TURN / at.n
        for i in range(begin, end):
            if status[i] != st.OK:
                continue
            own = room.place[i] & PLACE
            first, stride, scale, floor = ABREAST + own, BLOCK, said[SCALE_AT + own], 0.0
            if at.alone:
                first, stride = 0, 1
                scale, floor = _counting(mode, at.most, at.least)
            # The first maximum of the first mode stands where the constants are already.
            many, begun, seats = 0, length, 1 - which
            for chunk in range(2, at.n + 2, CHUNK):
                marked = said[MARKS + which * BLOCK + own]
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
            span[which, i, 0], span[which, i, 1], span[which, i, 2] = own if seats else begun, begun + which, length
            if many == 0 or many > MOST_PEAKS or length > CAPACITY:
                status[i], length = OPEN, begun
        return length

    return generated_inline(f"gather_{chain.record.name}", gather)


def _placer(chain: Chained) -> Helper:
    """Make the function ``seat(designs, begin, end, near, per_rho, ...)``, which gives the designs places in the list.

    It writes the constants of all designs to be sampled into the list, and returns how many are sampled abreast and how
    many in all, each rounded up to whole vectors; the surplus is never read.
    """
    load, loaded, put = chain.record.load, chain.record.loaded, chain.record.put

    def seat(
        designs: Array, begin: int, end: int, near: Array, per_rho: float, made_of: Array, m: Array, room: Scratch
    ) -> tuple[int, int]:
        abreast, count = 0, 0
        # Designs whose first stage needs no more than the first look come first.
        for some in range(2):
            abreast = count
            for i in range(begin, end):
                distance = near[i - begin]
                few = distance * FEWEST >= per_rho
                if few if some == 0 else (not few) & (distance * MOST >= per_rho):
                    room.place[i - begin] = count
                    load(designs, i & ROW, room.block, count & PLACE)
                    m[count + A], m[count + B], m[count + C] = made_of[i, 0], made_of[i, 1], made_of[i, 2]
                    count += 1
        length = (count + 7) & ~7
        for place in range(length):
            put(m, place + CONSTANTS, loaded(room.block, place))
        return (abreast + 7) & ~7, length

    return generated_inline(f"seat_{chain.record.name}", seat)


@inline
def _judge(limits: Any, lane: int, dips: Array, said: Array, guarded: int, samples: float) -> tuple[int, int]:
    """Find the number of samples that a design needs by its first look, and its status.

    The status is that of :func:`kernels.chains.look.looker`, or LOOKING if the first 32 samples are too few.
    """
    code, n = LOOKING, FEWEST
    for slot in range(guarded):
        low = said[LOW + slot * BLOCK + lane]
        if code == LOOKING and not low > limits[slot + 1]:
            code = st.NOT_ROTATABLE if low < -limits[slot + 1] else OPEN
        if code == LOOKING and said[CLOSE + lane] != 0.0:
            n = samples_for(samples, FEWEST, nearest_dip(dips, slot, lane), n)
    rough = said[ROUGHNESS + lane]
    if code == LOOKING and rough == FLAT_CURVE:
        code = OPEN
    elif code == LOOKING and rough == UNRESOLVED:
        n = max(n, 2 * FEWEST)
    return n, st.OK if code == LOOKING and n == FEWEST else code


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
