"""Samples of a curve over the turn, as many as resolve the curve.

Samples stand no wider than a twelfth (of the jerk an eighteenth) of the distance of the nearest complex singularity:
that of the first stage is known beforehand, those of the other stages show as dips of their discriminants.  Where the
fourth difference of the samples shows that they do not resolve the curve all the same, twice as many are taken.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple, TypeAlias

import numpy as np
from numpy.typing import NDArray

from kernels import status as st
from kernels.arithmetic.intrinsics import largest, smallest
from kernels.chains.curves import Sampling
from kernels.chains.form import Helper
from kernels.chains.halves import TOGETHER, handed_rows, keepers, writers
from kernels.jit import generated_inline, inline
from kernels.types import TWO_PI, Array, CosSin

Counts: TypeAlias = NDArray[np.int64]
Spans: TypeAlias = NDArray[np.int64]

OPEN = 255  # instead of a status: nothing is decided here, a slower search has to decide
LOOKING = 252  # more samples are needed
FEWEST, MOST = 32, 8192
AT_ONCE = 8.0  # factor of the number of samples at most: the first look sees a near zero only roughly
SHARE = 0.6  # a peak below this share of the best sample is not refined
ROUGH = 0.5  # fourth difference over the size of the curve; at a pole a twelfth of a turn of samples away it is 0.6
FLAT = 1e-9  # a curve that varies by less of its size is left to the slower search
VALUES, GUARD_ROW = MOST + 8, MOST + 2  # numbers of one design: samples of a curve, discriminants of a stage


def sampling_tables() -> CosSin:
    """Cosines and sines of N equally spaced angles for N = 32, 64, ... 8192; those of N start at position N - 32."""
    counts = [FEWEST << k for k in range((MOST // FEWEST).bit_length())]
    phi = np.concatenate([np.arange(n) * (TWO_PI / n) for n in counts])
    return np.cos(phi), np.sin(phi)


@inline
def fourth_difference(first: float, left: float, here: float, right: float, last: float) -> float:
    """Magnitude of the fourth difference of five samples."""
    return abs((first + last) - 4.0 * (left + right) + 6.0 * here)


@inline
def _spread(n: int, values: Array) -> tuple[float, float, float]:
    """Largest fourth difference, largest and least of n samples that stand in values[2 ... n + 1]."""
    fourth, most, least = 0.0, -1e300, 1e300
    # The compiler sees that indices into these slices do not count from the end; with sums as indices it would not.
    first, left, here, right, last = (
        values[:n], values[1 : n + 1], values[2 : n + 2], values[3 : n + 3], values[4 : n + 4],
    )  # fmt: skip
    for j in range(n):
        y = here[j]
        fourth = largest(fourth, fourth_difference(first[j], left[j], y, right[j], last[j]))
        most, least = largest(most, y), smallest(least, y)
    return fourth, most, least


@inline
def dips(n: int, guards: Array, begin: int) -> tuple[float, float]:
    """Least of n discriminants, and squared distance [samples] of their nearest complex zero, by parabolas."""
    low, nearest = 1e300, 1e300
    before, at, after = guards[begin : begin + n], guards[begin + 1 : begin + n + 1], guards[begin + 2 : begin + n + 2]
    for j in range(n):
        low = smallest(low, at[j])
        nearest = smallest(nearest, zero_beside(before[j], at[j], after[j]))
    return low, nearest


@inline
def zero_beside(left: float, here: float, right: float) -> float:
    """Squared distance [samples] of the complex zero of a parabola through three samples; 1e300 where it has no dip."""
    bend, slope = 0.5 * (left + right) - here, 0.5 * (right - left)
    dips = (here <= left) & (here <= right) & (bend > 0.0)
    per_bend = 1.0 / (bend if dips else 1.0)
    vertex = largest(here - 0.25 * slope * slope * per_bend, 0.0)
    return vertex * per_bend if dips else 1e300


@inline
def samples_for(per_distance: float, n: int, nearest: float, needed: int) -> int:
    """Find the number of samples, at least ``needed``, that resolves a zero at a squared distance [samples of n]."""
    wanted = per_distance * n / (TWO_PI * math.sqrt(largest(nearest, 1e-12)))
    while needed < min(wanted, AT_ONCE * n):
        needed *= 2
    return needed


class Scratch(NamedTuple):
    """Memory of the search.

    ``values``, ``abreast``: samples of each curve of one design and of a block, ``guards``, ``dips``: discriminants of
    one design and of a block, ``said``, ``low``: results of the first look about each curve and about discriminants,
    ``block``: designs column by column, ``handed``: inputs of the last stage, ``near``: distance of each design's
    nearest singularity [rad], 0 for a design that is left out, ``place``: its place in the list, ``needed``: number of
    samples of each curve and design, ``span``: places of the local maxima of each mode and design in the list: the
    first, and begin and end of the rest, ``length``: of the list of each curve.
    """

    values: Array
    abreast: Array
    guards: Array
    dips: Array
    said: Array
    low: Array
    block: Array
    handed: Array
    near: Array
    place: Counts
    needed: Spans
    span: Spans
    length: Counts


@inline
def resolved(
    n: int, values: Array, guards: Array, mode: int, doubts: Any, guarded: int, density: float
) -> tuple[int, float, float, int]:
    """Judge n samples of one design: number of samples needed, largest and least of the n, and a status.

    The status is OK; LOOKING, if n are too few; NOT_ROTATABLE, where a later stage does not reach; OPEN.
    """
    code, needed = LOOKING, n
    for s in range(guarded):
        low, nearest = dips(n, guards, s * GUARD_ROW)
        if code == LOOKING and not low > doubts[s + 1]:
            code = st.NOT_ROTATABLE if low < -doubts[s + 1] else OPEN
        needed = samples_for(density, n, nearest, needed)
    fourth, most, least = _spread(n, values)
    size = max(most, -least)
    scale = size if mode == 0 else most - least
    if fourth > ROUGH * scale:
        needed = max(needed, 2 * n)
    if code == LOOKING and not most - least > FLAT * size:
        code = OPEN
    elif code == LOOKING and needed == n:
        code = st.OK
    return needed if code == LOOKING else n, most, least, code


def taker(of: Sampling) -> Helper:
    """Make the function that fills ``values`` and ``guards`` with n samples of one design, closed periodically.

    The samples of each curve stand in the places 2 ... n + 1 of its `VALUES` numbers, the discriminants of each later
    stage in the places 1 ... n of its `GUARD_ROW` numbers.
    """
    curves, guarded, drive, sample, hand, get = of.curves, of.guarded, of.drive, of.sample, of.hand, of.take
    (guard_rows, keep, keep_last), (value_rows, write) = keepers(of), writers(of)

    def take(
        k: Any, a: float, b: float, c: float, n: int, table: CosSin, values: Array, guards: Array, handed: Array
    ) -> None:
        cos, sin = table
        for start in range(0, n, TOGETHER):
            many = min(TOGETHER, n - start)
            begin, first = n - FEWEST + start, start + 2
            us, vs = cos[begin : begin + many], sin[begin : begin + many]
            here = value_rows(values, VALUES, first, first + many)
            rows, low = handed_rows(handed, 0, many), guard_rows(guards, GUARD_ROW, 1 + start, 1 + start + many)
            for j in range(many):
                t, deltas = drive(k, us[j], vs[j])
                hand(rows, j, t)
                keep(low, deltas, j)
            for j in range(many):
                y, delta = sample(k, a, b, c, get(rows, j))
                write(here, j, y)
                keep_last(low, delta, j)
        for c in range(curves):
            own = values[c * VALUES : (c + 1) * VALUES]
            own[0], own[1], own[n + 2], own[n + 3] = own[n], own[n + 1], own[2], own[3]
        for s in range(guarded):
            row = s * GUARD_ROW
            guards[row], guards[row + n + 1] = guards[row + n], guards[row + 1]

    return generated_inline(f"take_{of.name}", take)
