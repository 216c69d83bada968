"""True extrema of a chain over the turn, refined between samples: the generated kernel (docs/internals/extrema.md).

Per design: samples that resolve the curve, or two curves of one motion (`kernels.chains.listing`); every local maximum
of at least 60 % of the best is refined, vectorised over the maxima of a block of designs (`kernels.chains.peaks`).
Maxima that are not trusted, or that rounding may have changed by more than 2^-14 of the target, are left to precise
poses.
"""

from __future__ import annotations

import math
from functools import lru_cache
from typing import NamedTuple

import numpy as np

from kernels import status as st
from kernels.arithmetic.intrinsics import prefetch_rows
from kernels.chains.chain import Chained
from kernels.chains.curves import MARGIN, curve, sampling
from kernels.chains.form import BLOCK, Helper
from kernels.chains.listing import aligned, enlister, listed_numbers, new_room
from kernels.chains.look import FEWEST, MOST, OPEN, Counts, Scratch, Spans
from kernels.chains.peaks import (
    ERROR,
    HEIGHT,
    LAST,
    MOVED,
    PLACE,
    REACH,
    ROUNDING,
    SCALE,
    START,
    WIDTH,
    begin_at_vertex,
    finisher,
    refiner,
)
from kernels.jit import generated, generated_inline, generated_part, inline
from kernels.types import TWO_PI as TURN
from kernels.types import Array, CosSin, Status

PLAIN = 2.0**-14  # of the target: larger rounding errors are left to precise poses
RIVALS = 64.0  # factor of the rounding error: a peak lower by no more may be the highest without rounding
LEVEL = 2.0**-4  # of the target: rounding errors up to which tops of equal height need no precise poses
# A literal number in a call is a type of its own, for which a part is compiled once more: these are no literals.
ONE = np.int64(1)
SETTLING = np.int64(8)  # more steps for a maximum that is not trusted after the usual ones
MORE = 4  # factor of the number of samples for a design of which a maximum is not trusted even so
ROUNDED, UNTRUSTED = 254, 253  # instead of a status; ROUNDED is explained in `find_extrema`
VALUE, PHI, VALUE_ERROR, PHI_ERROR, SCALE_ROW, SPACING = range(6)


class Given(NamedTuple):
    """Arguments of `find_extrema` before the modes, without ``opening``."""

    designs: Array
    distance: Array
    table: CosSin
    made_of: Array


class Wanted(NamedTuple):
    """Modes, target and tie of `find_extrema`."""

    modes: Counts
    target: float
    tie: float


@lru_cache(maxsize=64)
def find_extrema(chain: Chained, orders: tuple[int, ...], along: bool = False) -> Helper:
    """Make the kernel ``find(designs, opening, distance, table, made_of, modes, target, tie, status, found)``.

    It finds extrema over the turn of a chain's curve of that order, or of its `MARGIN` (`kernels.chains.curves`), or of
    two curves of rising order, which share their samples; with ``along`` every b is 0, which takes fewer operations and
    gives the same bits.

    Its arguments: designs (n, P); opening (n,), OK where the first stage turns, NOT_ROTATABLE where it does not;
    distance (n,) [rad] of its nearest singularity from the real axis; `sampling_tables`; made_of (n, 3), the numbers a,
    b, c of the curves; modes (w,): 0 for the largest magnitude, or +1 for the largest value, -1 for the least, or both;
    of two curves one for each; target: relative error wanted, of the magnitude or of the curve's range; tie: share of
    that size by which every other peak must be lower than the highest one, negative where it does not matter which of
    two is higher.  Then out: status (w, n), and found (6, w, n) with the rows VALUE; PHI, its crank angle in [0, 2 pi);
    estimates of the errors of both; SCALE, the size that the target is relative to; SPACING of the samples [rad].
    What is found together has the same bits as each alone.

    The status is OK; ROUNDED, where rounding may have moved a single highest peak by more than its share of the target;
    NOT_ROTATABLE, where a stage does not reach; OPEN, where nothing is decided.  With the last two ``found`` is nan.
    """
    of, curves, half = sampling(chain, orders, along), len(orders), listed_numbers(chain)
    guarded, wide, enlist = of.guarded, chain.record.wide, enlister(chain, of)
    first, last = _concluder(chain, orders[0], along), _concluder(chain, orders[-1], along)

    def find(
        designs: Array, opening: Status, distance: Array, table: CosSin, made_of: Array, modes: Counts, target: float,
        tie: float, status: Status, found: Array,
    ) -> None:  # fmt: skip
        m, room = aligned(curves * half), new_room(curves, guarded, wide)
        given = Given(designs, distance, table, made_of)
        for start in range(0, designs.shape[0], BLOCK):
            end = min(start + BLOCK, designs.shape[0])
            for i in range(start, end):
                for which in range(modes.size):
                    status[which, i] = st.NOT_ROTATABLE if opening[i] == st.NOT_ROTATABLE else OPEN
                room.near[i - start] = distance[i] if opening[i] == st.OK else 0.0
            enlist(designs, start, end, table, made_of, modes, m, status, room)
            prefetch_rows(designs, end, end + BLOCK)  # of the next block
            ones = modes.size if curves == 1 else 1
            wanted = Wanted(modes[:ones], target, tie)
            first(start, end, given, wanted, m[:half], room.span[:ones], room, status[:ones], found[:, :ones])
            if curves > 1:
                room.length[0], wanted = room.length[1], Wanted(modes[1:], target, tie)
                last(start, end, given, wanted, m[half:], room.span[1:], room, status[1:], found[:, 1:])

    return generated(f"find_{of.name}", find)


@lru_cache(maxsize=64)
def _concluder(chain: Chained, order: int, along: bool) -> Helper:
    """Make the part ``conclude(start, end, given, wanted, m, span, room, status, found)``.

    It refines the listed maxima of one curve of a block, and writes the highest of each mode.
    """
    of, allowed = curve(chain, order, along), 1.0 if order == MARGIN else PLAIN
    density, enlist = of.alone.density, enlister(chain, of.alone)
    refine, finish = refiner(of, chain.record.get), finisher(of, chain.record.get)
    decide = _decider(of.alone.name, refine, finish, allowed)

    def conclude(
        start: int, end: int, given: Given, wanted: Wanted, m: Array, span: Spans, room: Scratch, status: Status,
        found: Array,
    ) -> None:  # fmt: skip
        (designs, distance, table, made_of), (modes, target, tie) = given, wanted
        rounds = 2 if target > 1e-4 else 3
        begin_at_vertex(room.length[0], m)
        refine(room.length[0], m, rounds)
        finish(room.length[0], m, target)
        for which in range(modes.size):
            decide(start, end, m, span[which], modes[which], target, tie, status[which], found[:, which])
        # Now the list is free for single designs with a maximum that is not trusted: they get more samples.
        for which in range(modes.size):
            one, code, into = modes[which : which + 1], status[which : which + 1], found[:, which]
            for i in range(start, end):
                rho = density / (FEWEST * MORE)
                while code[0, i] == UNTRUSTED and rho * MOST >= density:
                    room.near[0] = min(rho, distance[i])
                    enlist(designs, i, i + 1, table, made_of, one, m, code, room)
                    begin_at_vertex(room.length[0], m)
                    refine(room.length[0], m, rounds + SETTLING)
                    finish(room.length[0], m, target)
                    if code[0, i] == st.OK:
                        own, low, high = room.span[0, 0, 0], room.span[0, 0, 1], room.span[0, 0, 2]
                        code[0, i] = _decide(own, low, high, m, one[0], allowed, target, tie, i, into)
                    rho /= MORE
                code[0, i] = OPEN if code[0, i] == UNTRUSTED else code[0, i]
                if code[0, i] != st.OK and code[0, i] != ROUNDED:
                    into[:, i] = math.nan

    return generated_part(f"conclude_{of.alone.name}", conclude)


def _decider(name: str, refine: Helper, finish: Helper, allowed: float) -> Helper:
    """Make the function ``decide(start, end, m, span, ...)``, which writes the highest maxima for one mode."""

    def decide(
        start: int, end: int, m: Array, span: Spans, mode: int, target: float, tie: float, status: Status, found: Array
    ) -> None:
        for i in range(start, end):
            if status[i] != st.OK:
                continue
            own, low, high = span[i - start, 0], span[i - start, 1], span[i - start, 2]
            if not _trusted(own, low, high, m):
                for slot in range(low - 1, high):
                    peak = (own if slot < low else slot) & PLACE
                    if not m[peak + ERROR] < math.inf:  # a flat top, which Newton's method climbs slowly
                        refine(ONE, m[peak:], SETTLING)
                        finish(ONE, m[peak:], target)
            status[i] = _decide(own, low, high, m, mode, allowed, target, tie, i, found)

    return generated_inline(f"decide_{name}", decide)


@inline
def _decide(
    own: int, begin: int, end: int, m: Array, mode: int, allowed: float, target: float, tie: float, i: int, found: Array
) -> int:
    """Write the highest maximum of design i, among place ``own`` and places ``begin``, ..., ``end`` - 1 of the list.

    Return OK, ROUNDED, UNTRUSTED, or OPEN where it is not certain which is highest.
    """
    own, second, third = _first_three(own, begin, end)
    winner = second if m[second + HEIGHT] > m[own + HEIGHT] else own
    winner = third if m[third + HEIGHT] > m[winner + HEIGHT] else winner
    for slot in range(begin + 2, end):
        peak = slot & PLACE
        winner = peak if m[peak + HEIGHT] > m[winner + HEIGHT] else winner
    height, blur, scale = m[winner + HEIGHT], m[winner + ROUNDING], m[winner + SCALE]
    code = st.OK if blur <= allowed * target * scale else ROUNDED
    apart, error = RIVALS * blur if code == ROUNDED else tie * scale, m[winner + ERROR] + blur
    if apart >= 0.0:
        for slot in range(begin - 1, end):
            peak = (own if slot < begin else slot) & PLACE
            if peak != winner and m[peak + HEIGHT] + m[peak + ROUNDING] >= height - blur - apart:
                code, error = OPEN, max(error, m[peak + ERROR] + m[peak + ROUNDING])
        # A follower that reverses within the swing of its driver reaches one end twice, at equal heights.
        code = st.OK if code == OPEN and tie < 0.0 and error <= LEVEL * target * scale else code
    place = m[winner + START] + m[winner + MOVED] + m[winner + LAST]
    found[VALUE, i], found[PHI, i] = -height if mode < 0 else height, place - TURN * np.floor(place / TURN)
    found[VALUE_ERROR, i], found[PHI_ERROR, i] = error, m[winner + REACH]
    found[SCALE_ROW, i], found[SPACING, i] = scale, m[winner + WIDTH]
    return code if _trusted(own, begin, end, m) else UNTRUSTED


@inline
def _first_three(own: int, begin: int, end: int) -> tuple[int, int, int]:
    """Places of a design's first three maxima; a missing one is replaced by the first.

    Few designs have more, and the processor cannot predict how many: these are chosen without a branch.
    """
    own = own & PLACE
    return own, (begin if end > begin else own) & PLACE, (begin + 1 if end > begin + 1 else own) & PLACE


@inline
def _trusted(own: int, begin: int, end: int, m: Array) -> bool:
    """Whether all maxima of a design are trusted."""
    own, second, third = _first_three(own, begin, end)
    sure: bool = (m[own + ERROR] < math.inf) & (m[second + ERROR] < math.inf) & (m[third + ERROR] < math.inf)
    for slot in range(begin + 2, end):
        sure = sure & (m[(slot & PLACE) + ERROR] < math.inf)
    return sure
