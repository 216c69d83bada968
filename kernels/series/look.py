"""Samples of a curve over the turn, as many as resolve it; and the local maxima among them.

Samples stand no wider than a twelfth (of the jerk an eighteenth) of the distance of the nearest complex singularity:
that of the first stage is known beforehand, those of the others show as dips of their discriminants.  Where the fourth
difference of the samples says that they do not resolve the curve all the same, twice as many are taken.
"""

from __future__ import annotations

import math
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

from kernels import status as st
from kernels._jit import generated_inline, inline
from kernels.reduce import largest, smallest
from kernels.series.curves import Curve
from kernels.series.form import Helper

Array: TypeAlias = NDArray[np.float64]

OPEN = 255  # instead of a status: nothing is decided here, a slower search is to be asked
_LOOKING = 252
FEWEST, MOST = 32, 8192
AT_ONCE = 8.0  # times as many samples at most: the first look sees a near zero only roughly
ROUGH = 0.5  # fourth difference against the size of the curve; at a pole a twelfth of a turn of samples away it is 0.6
FLAT = 1e-9  # a curve that varies by less of its size is left to the slower search
TURN = 2.0 * math.pi
GUARD_ROW = MOST + 2


def sampling_tables() -> tuple[Array, Array]:
    """Cosines and sines of N equally spaced angles for N = 32, 64, ... 8192; those of N start at position N - 32."""
    counts = [FEWEST << k for k in range((MOST // FEWEST).bit_length())]
    phi = np.concatenate([np.arange(n) * (TURN / n) for n in counts])
    return np.cos(phi), np.sin(phi)


@inline
def _spread(n: int, values: Array) -> tuple[float, float, float]:
    """Largest fourth difference, largest and least of n samples that stand in values[2 ... n + 1]."""
    fourth, most, least = 0.0, -1e300, 1e300
    # Indices into such parts are seen not to count from the end; with sums as indices each number is fetched alone.
    first, left, here, right, last = (
        values[:n], values[1 : n + 1], values[2 : n + 2], values[3 : n + 3], values[4 : n + 4],
    )  # fmt: skip
    for j in range(n):
        y = here[j]
        beside, beyond = left[j] + right[j], first[j] + last[j]
        fourth = largest(fourth, abs(beyond - 4.0 * beside + 6.0 * y))
        most, least = largest(most, y), smallest(least, y)
    return fourth, most, least


@inline
def _dips(n: int, guards: Array, begin: int) -> tuple[float, float]:
    """Least of n discriminants, and squared distance [samples] of their nearest complex zero, by parabolas."""
    low, nearest = 1e300, 1e300
    before, at, after = guards[begin : begin + n], guards[begin + 1 : begin + n + 1], guards[begin + 2 : begin + n + 2]
    for j in range(n):
        left, here, right = before[j], at[j], after[j]
        low = smallest(low, here)
        bend, slope = 0.5 * (left + right) - here, 0.5 * (right - left)
        dips = (here <= left) & (here <= right) & (bend > 0.0)
        per_bend = 1.0 / (bend if dips else 1.0)
        vertex = largest(here - 0.25 * slope * slope * per_bend, 0.0)
        nearest = smallest(nearest, vertex * per_bend if dips else 1e300)
    return low, nearest


def looker(curve: Curve) -> Helper:
    """Make the function ``look(k, a, b, c, n, cos, sin, mode, doubts, values, guards)`` of a curve.

    It samples a design, n times at first, and returns the number of samples that resolve the curve, their largest and
    least, and a status: OK; NOT_ROTATABLE, where a later stage does not reach; OPEN.  The samples stand in
    values[2 ... n + 1], closed periodically.
    """
    guarded, samples, take = curve.guarded, curve.samples, _taker(curve)

    def look(
        k: Any, a: float, b: float, c: float, n: int, cos: Array, sin: Array, mode: int, doubts: Any, values: Array,
        guards: Array,
    ) -> tuple[int, float, float, int]:  # fmt: skip
        # One way out only: with several each array's references are counted, which takes as long as the samples do.
        code, most, least = _LOOKING, 0.0, 0.0
        while code == _LOOKING and n <= MOST:
            take(k, a, b, c, n, cos, sin, values, guards)
            needed = n
            for s in range(guarded):
                low, nearest = _dips(n, guards, s * GUARD_ROW)
                if code == _LOOKING and not low > doubts[s + 1]:
                    code = st.NOT_ROTATABLE if low < -doubts[s + 1] else OPEN
                wanted = samples * n / (TURN * math.sqrt(largest(nearest, 1e-12)))
                while needed < min(wanted, AT_ONCE * n):
                    needed *= 2
            fourth, most, least = _spread(n, values)
            size = max(most, -least)
            scale = size if mode == 0 else most - least
            if fourth > ROUGH * scale:
                needed = max(needed, 2 * n)
            if code == _LOOKING and not most - least > FLAT * size:
                code = OPEN
            elif code == _LOOKING and needed == n:
                code = st.OK
            elif code == _LOOKING:
                n = needed
        return n, most, least, OPEN if code == _LOOKING else code

    return generated_inline(f"look_{curve.name}", look)


def _taker(curve: Curve) -> Helper:
    """Fill ``values`` and ``guards`` with n samples, closed periodically."""
    guarded, sample = curve.guarded, curve.sample

    def nothing(deltas: Any, guards: Array, j: int) -> None:
        pass

    keep = generated_inline(f"keep0_{curve.name}", nothing)
    for slot in range(guarded):
        keep = _keeper(keep, slot, f"keep{slot + 1}_{curve.name}")

    def take(
        k: Any, a: float, b: float, c: float, n: int, cos: Array, sin: Array, values: Array, guards: Array
    ) -> None:
        begin = n - FEWEST
        us, vs = cos[begin : begin + n], sin[begin : begin + n]
        for j in range(n):
            y, deltas = sample(k, a, b, c, us[j], vs[j])
            values[2 + j] = y
            keep(deltas, guards, 1 + j)
        values[0], values[1], values[n + 2], values[n + 3] = values[n], values[n + 1], values[2], values[3]
        for s in range(guarded):
            row = s * GUARD_ROW
            guards[row], guards[row + n + 1] = guards[row + n], guards[row + 1]

    return generated_inline(f"take_{curve.name}", take)


def _keeper(before: Helper, slot: int, name: str) -> Helper:
    # Written out stage by stage: a loop over the stages keeps the loop over the samples from vectorising.
    row = slot * GUARD_ROW

    def keep(deltas: Any, guards: Array, j: int) -> None:
        before(deltas, guards, j)
        guards[row + j] = deltas[slot + 1]

    return generated_inline(name, keep)
