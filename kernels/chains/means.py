"""Root mean square over the turn of a curve of a chain: the trapezoid rule on samples that resolve it, generated.

With n samples the rule errs by the amplitude of harmonic n.  From harmonic to harmonic amplitudes fall by the factor
exp(-rho), rho being the distance of the nearest singularity, and grow with a power of the harmonic's number that the
order of the singularity sets.  Harmonics n/4 and n/8 are computed from the samples, whatever their phase, and tell
whether amplitudes really fall so fast.  Where the error is above the target, the samples are doubled.
"""

from __future__ import annotations

import math
from functools import lru_cache
from typing import Any

import numpy as np

from kernels import status as st
from kernels.chains.chain import Chained
from kernels.chains.curves import Curve, curve
from kernels.chains.form import Helper
from kernels.chains.halves import HANDED
from kernels.chains.listing import aligned
from kernels.chains.look import FEWEST, GUARD_ROW, LOOKING, MOST, OPEN, VALUES, dips, taker
from kernels.jit import generated, generated_inline, inline
from kernels.types import EPS, TWO_PI, Array, CosSin, Status

PER_TARGET, PER_POWER = 1.2, 1.4  # samples times distance, per logarithm of the target: mostly enough at first
SLOWEST = 0.3  # ratio of amplitudes n/8 apart above which the samples do not resolve the curve
SURE = 40.0  # factor of the amplitude of the harmonic, which counts twice; 8 was 4.7 times too small near two dips
ARCS = 8  # sums of samples, by their number modulo 8
_HALF = math.sqrt(0.5)
THIN, FEW = 4, MOST // 4  # every fourth sample is used to estimate the rounding; their largest number
ROUGH = 64.0 * EPS  # share of a mean below which rounding is no reason to compute precise poses
NOISE = 64.0 * EPS  # share of the mean square below which an amplitude is rounding


@lru_cache(maxsize=64)
def mean_squares(chain: Chained, order: int, along: bool = False) -> Helper:
    """Make the kernel ``mean(designs, opening, distance, table, made_of, target, status, found)``.

    The arguments are those of :func:`kernels.chains.search.find_extrema`; ``found`` (2, n) gets the root mean square
    and an estimate of its error, rounding included.  The status is OK, NOT_ROTATABLE, or OPEN where precise poses or
    more samples are needed; with the last two both are nan.
    """
    of = curve(chain, order, along)
    alone = of.alone
    constants, doubts, guarded, last = chain.record.constants, chain.record.doubts, alone.guarded, chain.stages - 1
    take, blur = taker(alone), _blur(of)
    power = 2.0 * max(order - 1, 0)

    def mean(
        designs: Array, opening: Status, distance: Array, table: CosSin, made_of: Array, target: float,
        status: Status, found: Array,
    ) -> None:  # fmt: skip
        values, guards, handed = aligned(VALUES), aligned(max(guarded, 1) * GUARD_ROW), aligned(HANDED)
        sums, thin, per_rho = np.empty(ARCS), np.empty(3 * FEW), PER_POWER * power - PER_TARGET * math.log(target)
        for i in range(designs.shape[0]):
            found[0, i], found[1, i] = math.nan, math.nan
            status[i] = st.NOT_ROTATABLE if opening[i] == st.NOT_ROTATABLE else OPEN
            if opening[i] != st.OK or not distance[i] * MOST >= per_rho:
                continue
            k, a, b, c = constants(designs, i), made_of[i, 0], made_of[i, 1], made_of[i, 2]
            limits, n, code = doubts(k), FEWEST, LOOKING
            while n * _shortened(distance[i]) < per_rho:
                n *= 2
            while code == LOOKING and n <= MOST:
                take(k, a, b, c, n, table, values, guards, handed)
                rho, code = distance[i], LOOKING if limits[last] < math.inf else OPEN
                for s in range(guarded):
                    low, nearest = dips(n, guards, s * GUARD_ROW)
                    if code == LOOKING and not low > limits[s + 1]:
                        code = st.NOT_ROTATABLE if low < -limits[s + 1] else OPEN
                    rho = min(rho, TWO_PI / n * math.sqrt(nearest))
                rho = _shortened(rho)
                square, error = _trapezoid(n, values, rho, power, sums)
                if code == LOOKING and (rho * n >= per_rho) & (error <= 2.0 * target * square):
                    root = math.sqrt(square)
                    rounding = blur(k, a, b, n, table, values, thin) / root + EPS * (4.0 + n / ARCS) * root
                    code = OPEN
                    if rounding <= max(target, ROUGH) * root:
                        code, found[0, i], found[1, i] = st.OK, root, 0.5 * error / root + rounding
                n *= 2
            status[i] = OPEN if code == LOOKING else code

    return generated(f"mean_{alone.name}", mean)


@inline
def _shortened(rho: float) -> float:
    """Lower bound of asinh of a distance of a zero that is known to leading order.

    Asinh is the distance where the discriminant's curvature comes from its second harmonic; from the first it is a
    little larger.
    """
    return rho / math.sqrt(1.0 + rho * rho / 3.0)


@inline
def _trapezoid(n: int, values: Array, rho: float, power: float, sums: Array) -> tuple[float, float]:
    """Mean square of the n samples in values[2 ... n + 1], and an estimate of the trapezoid rule's error."""
    for r in range(ARCS):
        sums[r] = 0.0
    here = values[2 : n + 2]
    for j in range(0, n, ARCS):
        for r in range(ARCS):
            sums[r] += here[j + r] * here[j + r]
    s0, s1, s2, s3, s4, s5, s6, s7 = sums[0], sums[1], sums[2], sums[3], sums[4], sums[5], sums[6], sums[7]
    square = (((s0 + s4) + (s2 + s6)) + ((s1 + s5) + (s3 + s7))) / n
    re, im = (s0 + s4) - (s2 + s6), (s1 + s5) - (s3 + s7)
    quarter = math.sqrt(re * re + im * im) / n
    re, im = (s0 - s4) + _HALF * ((s1 - s5) - (s3 - s7)), (s2 - s6) + _HALF * ((s1 - s5) + (s3 - s7))
    eighth = math.sqrt(re * re + im * im) / n
    # With two singularities equally near, one of the two amplitudes may vanish, but not both.
    grows = 2.0**power
    falls = math.exp(-rho * n / ARCS)
    falls = max(falls, quarter / (grows * eighth)) if eighth > 0.0 else falls
    size = max(quarter, eighth * falls * grows)
    cube = falls * falls * falls
    error = SURE * size * (cube * cube) * (grows * grows) if falls <= SLOWEST else math.inf
    return square, SURE * size if size <= NOISE * square else error


def _blur(of: Curve) -> Helper:
    """Make the function that estimates half the rounding error of the mean square from every fourth sample."""
    rounding = of.rounding

    def blur(k: Any, a: float, b: float, n: int, table: CosSin, values: Array, thin: Array) -> float:
        (cos, sin), total, begin, count = table, 0.0, n - FEWEST, n // THIN
        us, vs, here = thin[:count], thin[FEW : FEW + count], thin[2 * FEW : 2 * FEW + count]
        for j in range(count):
            us[j], vs[j], here[j] = cos[begin + j * THIN], sin[begin + j * THIN], values[2 + j * THIN]
        for j in range(count):
            here[j] = abs(here[j]) * rounding(k, a, b, us[j], vs[j])
        for j in range(count):
            total += here[j]
        return total / count

    return generated_inline(f"mean_blur_{of.alone.name}", blur)
