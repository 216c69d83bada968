"""Samples of the search for true maxima, and the local maxima among them (docs/rssr.md, section 6).

Most designs need no more than 16 samples.  Those of a block of designs are computed side by side, and their local
maxima are marked side by side; a design that needs more samples is taken by itself.  Sets of samples are bits of one
integer, so that what is listed costs no loop over the samples.
"""

from __future__ import annotations

import numpy as np

from kernels.arithmetic.bits import lowest_bit
from kernels.arithmetic.max_min import largest
from kernels.families.rssr.block import BLOCK, CA, K0, K1, K2, Y0, E
from kernels.families.rssr.closure import Array
from kernels.families.rssr.derivatives import follower
from kernels.families.rssr.peaks import MOST_PEAKS, append
from kernels.jit import inline

FEWEST, MOST = 16, 1024
_FLOOR, MARKS = FEWEST + 2, (FEWEST + 3) * BLOCK  # two more rows under the samples of a block
GRID_SIZE = (FEWEST + 4) * BLOCK
# Numbers below 2048 and "and" this are themselves, and the compiler sees that they are not negative.  Otherwise it
# would handle indices that count from the end, and gather samples one by one: twice the time.
_NEVER_NEGATIVE = 2047


def sampling_tables() -> tuple[Array, Array]:
    """Return cosines and sines of N equally spaced angles for N = 16, 32, ...
    1024; those of N start at position N - 16.
    """
    phi = np.concatenate([np.arange(n) * (2.0 * np.pi / n) for n in (16 << k for k in range(7))])
    return np.cos(phi), np.sin(phi)


@inline
def sample(
    at: Array, k: int, cos: Array, sin: Array, n: int, size: Array, first: Array | None, second: Array | None
) -> None:
    """Compute magnitudes at n equally spaced angles into size[1 ... n], closed periodically."""
    e, y0, ca, k0, k1, k2 = at[k + E], at[k + Y0], at[k + CA], at[k + K0], at[k + K1], at[k + K2]
    begin = (n - FEWEST) & _NEVER_NEGATIVE
    for i in range(n):
        p, q, j, _ = follower(e, y0, ca, k0, k1, k2, cos[begin + i], sin[begin + i])
        size[1 + i] = abs(p) if first is not None else (abs(q) if second is not None else abs(j))
    size[0], size[n + 1] = size[n], size[1]


@inline
def _row(size: Array, i: int) -> Array:
    """Return row i of the samples of a block.

    An index into a row is seen not to be negative; one that is a sum is not, and would be written to one by one.
    """
    return size[i * BLOCK : (i + 1) * BLOCK]


@inline
def sample_block(
    count: int, at: Array, cos: Array, sin: Array, size: Array, first: Array | None, second: Array | None
) -> None:
    """Sample as :func:`sample` does with FEWEST angles, all designs of a block:
    angle i of design k at (i + 1) BLOCK + k.
    """
    for i in range(FEWEST):
        u, v, here = cos[i], sin[i], _row(size, 1 + i)
        for k in range(count):
            e, y0, ca, k0, k1, k2 = at[k + E], at[k + Y0], at[k + CA], at[k + K0], at[k + K1], at[k + K2]
            p, q, j, _ = follower(e, y0, ca, k0, k1, k2, u, v)
            here[k] = abs(p) if first is not None else (abs(q) if second is not None else abs(j))
    before, begin, end, after = _row(size, 0), _row(size, 1), _row(size, FEWEST), _row(size, FEWEST + 1)
    for k in range(count):
        before[k], after[k] = end[k], begin[k]


@inline
def mark_peaks(count: int, size: Array) -> None:
    """Mark the local maxima of at least 60 % among the samples of :func:`sample_block`, as a sum of powers of two."""
    floor, marks = _row(size, _FLOOR), _row(size, MARKS // BLOCK)
    for k in range(count):
        floor[k], marks[k] = 0.0, 0.0
    for i in range(1, FEWEST + 1):
        here = _row(size, i)
        for k in range(count):
            floor[k] = largest(floor[k], 0.6 * here[k])
    mark = 1.0
    for i in range(1, FEWEST + 1):
        before, here, after = _row(size, i - 1), _row(size, i), _row(size, i + 1)
        for k in range(count):
            y = here[k]
            peak = (y >= floor[k]) & (y > before[k]) & (y >= after[k])
            marks[k] += mark if peak else 0.0
        mark *= 2.0


@inline
def _append_lowest(
    marks: int, at: Array, k: int, cos: Array, sin: Array, size: Array, first: int, stride: int, n: int, begin: int,
    m: Array, count: int,
) -> None:  # fmt: skip
    """Append the lowest bit of ``marks``, as of :func:`list_marked`; something meaningless where there is none."""
    i = lowest_bit(marks) & 63
    angle = (n - FEWEST + begin + i) & _NEVER_NEGATIVE
    before = (first + i * stride) & _NEVER_NEGATIVE
    left, peak, right = size[before], size[before + stride], size[before + 2 * stride]
    append(at, k, cos[angle], sin[angle], left, peak, right, n, begin + i, m, count & _NEVER_NEGATIVE)


@inline
def list_marked(
    marks: int, at: Array, k: int, cos: Array, sin: Array, size: Array, first: int, stride: int, n: int, begin: int,
    m: Array, count: int,
) -> int:  # fmt: skip
    """Append the local maxima of design k that are bits of ``marks`` to the list; returns its new length.

    Bit i stands for sample ``begin`` + i of n; the samples of the design stand ``stride`` apart in ``size``, the one
    before bit 0 at ``first``.
    """
    # Nearly all designs have one such maximum or two.  Two are written in any case, without a branch that the
    # processor could guess wrong; what is too many the next design writes over.
    for _ in range(2):
        _append_lowest(marks, at, k, cos, sin, size, first, stride, n, begin, m, count)
        count += 1 if marks != 0 else 0
        marks &= marks - 1
    while marks != 0:
        _append_lowest(marks, at, k, cos, sin, size, first, stride, n, begin, m, count)
        count += 1
        marks &= marks - 1
    return count


@inline
def _marks(begin: int, width: int, floor: float, size: Array) -> int:
    """Return the local maxima of at least ``floor`` among ``width`` samples from ``begin`` on, as bits."""
    begin, marks = begin & _NEVER_NEGATIVE, 0
    for i in range(width):
        y = size[begin + i + 1]
        peak = (y >= floor) & (y > size[begin + i]) & (y >= size[begin + i + 2])
        marks |= (1 << i) if peak else 0
    return marks


@inline
def list_peaks(at: Array, k: int, cos: Array, sin: Array, n: int, size: Array, m: Array, count: int) -> int:
    """Append the local maxima among the samples of one design by :func:`sample`; none if there are too many."""
    most = 0.0
    for i in range(n):
        most = largest(most, size[i])
    length, width = count, min(n, 64)
    for begin in range(0, n, width):
        marks = _marks(begin, width, 0.6 * most, size)
        length = list_marked(marks, at, k, cos, sin, size, begin, 1, n, begin, m, length)
        if length - count > MOST_PEAKS:
            return count
    return length
