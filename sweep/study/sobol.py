"""Scrambled Sobol points by index: any slice of the sequence, with the same bits however it is divided.

scipy.stats.qmc gives the same sequence, but reaches point i only by stepping through all points before it, and with
more than 30 bits its ``fast_forward`` fails (1.17); a chunk of a study must be computable alone.  The tests compare the
plain sequence with scipy's bit for bit.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from kernels.arithmetic.sobol import BITS, RUN, TABLE_BITS, Digits, sobol_points
from sweep.families.base import Array

INDEX_BITS = 40

# S. Joe and F. Y. Kuo, Constructing Sobol sequences with better two-dimensional projections, SIAM J. Sci. Comput. 30
# (2008), file new-joe-kuo-6.21201, dimensions 1 to 40.  Of each: degree s of the primitive polynomial, its coefficients
# but the first and the last as digits of a, and the first s direction integers.
_TABLE = Path(__file__).with_name("joe_kuo.txt")
_JOE_KUO = [[int(number) for number in row.split()] for row in _TABLE.read_text("utf-8").splitlines()[1:]]
DIMENSIONS = len(_JOE_KUO)


class Sobol:
    """Sobol sequence of one seed, with values in (0, 1).

    ``seed`` chooses a random lower-triangular mixing of the digits and a random digital shift (Matousek's scrambling):
    every aligned block of 2^k points keeps its stratification.  None leaves the plain sequence, which starts at 0.
    """

    def __init__(self, dimensions: int, seed: int | None) -> None:
        # numpy guarantees the raw bit stream of PCG64, but not that of Generator methods.
        source = None if seed is None else np.random.PCG64(seed)
        self._shift = np.zeros(dimensions, np.int64)
        self._centre = 0.0 if seed is None else 0.5
        tables = []
        for k in range(dimensions):
            directions = direction_numbers(k)
            if source is not None:
                raw = [int(x) for x in source.random_raw(BITS + 1)]
                directions = [_mix(v, raw) for v in directions]
                self._shift[k] = raw[BITS] >> (64 - BITS)
            tables.append(_xor_tables(directions))
        self._tables = np.array(tables, np.int64).reshape(dimensions, INDEX_BITS // TABLE_BITS, RUN)
        low = np.arange(2 * RUN)
        # The bit above the lowest TABLE_BITS flips the highest bit of their Gray code.
        gray = (low ^ (low >> 1)) & (RUN - 1)
        first_runs = np.ascontiguousarray(self._tables[:, 0, gray].reshape(dimensions, 2, RUN))
        self._digits = Digits(first_runs, self._tables, self._shift, self._centre)

    def fill(
        self, start: int, stop: int, which: Sequence[int], ends: Sequence[tuple[float, float]], columns: Sequence[int],
        out: Array,
    ) -> None:  # fmt: skip
        """Write points start to stop - 1 of some dimensions, scaled to the two ends of each.

        ``out`` is (stop - start, P); ``columns`` names the column of each dimension of ``which``.
        """
        low, high = np.array(ends, np.float64).reshape(len(which), 2).T.copy()
        dimensions, places = np.array(which, np.int64), np.array(columns, np.int64)
        sobol_points(start, stop, self._digits, dimensions, low, high, places, out)

    def at(self, index: NDArray[np.int64], which: Sequence[int] | None = None) -> Array:
        """Return the points of the given indices, in any order, one row per dimension, with the same bits as `fill`."""
        gray = index ^ (index >> 1)
        first, high = gray & (RUN - 1), gray >> TABLE_BITS
        dimensions = range(len(self._shift)) if which is None else which
        out = np.empty((len(dimensions), index.size))
        for row, k in zip(out, dimensions, strict=True):
            x = self._shift[k] ^ self._tables[k, 0, first]
            for part, table in enumerate(self._tables[k, 1:]):
                x ^= table[(high >> (part * TABLE_BITS)) & (RUN - 1)]
            row[:] = x
        return (out + self._centre) * 2.0**-BITS


def direction_numbers(dimension: int) -> list[int]:
    """Return V_1 ... V_INDEX_BITS as integers of BITS digits, by the recurrence of the primitive polynomial."""
    _, degree, inner, *m = _JOE_KUO[dimension]
    if degree == 0:  # the first dimension is the van der Corput sequence
        return [1 << (BITS - 1 - j) for j in range(INDEX_BITS)]
    polynomial = 1 << degree | inner << 1 | 1
    for j in range(degree, INDEX_BITS):
        new = m[j - degree] ^ (m[j - degree] << degree)
        for i in range(1, degree):
            if polynomial >> (degree - i) & 1:
                new ^= m[j - i] << i
        m.append(new)
    return [m[j] << (BITS - 1 - j) for j in range(INDEX_BITS)]


def _mix(direction: int, raw: list[int]) -> int:
    """Return the scrambled direction number: each digit plus (mod 2) a random selection of the digits above it."""
    mixed = 0
    for digit in range(BITS):
        place = BITS - 1 - digit
        above = (raw[digit] >> (64 - BITS)) >> (place + 1) << (place + 1)
        mixed |= ((direction & (above | 1 << place)).bit_count() & 1) << place
    return mixed


def _xor_tables(directions: list[int]) -> NDArray[np.int64]:
    """Return the exclusive or of the direction numbers for every combination of index digits, one table per group."""
    tables = np.zeros((INDEX_BITS // TABLE_BITS, RUN), np.int64)
    for j, direction in enumerate(directions):
        part, bit = divmod(j, TABLE_BITS)
        half = 1 << bit
        tables[part, half : 2 * half] = tables[part, :half] ^ np.int64(direction)
    return tables
