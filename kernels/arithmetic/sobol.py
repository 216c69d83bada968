"""Points of a Sobol sequence by number, from tables of exclusive ors; the tables are made by `sweep.study.sobol`."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from kernels.arithmetic.intrinsics import largest, smallest
from kernels.jit import kernel
from kernels.types import Array

Integers = NDArray[np.int64]

BITS = 52  # of a coordinate as an integer, which float64 holds exactly
TABLE_BITS = 10  # binary digits of a point's Gray code per table
RUN = 2**TABLE_BITS


class Digits(NamedTuple):
    """Exclusive ors of the direction numbers of each dimension, tabulated by digits of a point's Gray code.

    Parameters
    ----------
    first_runs : (dimensions, 2, RUN) of the lowest TABLE_BITS digits, for the points of an even and of an odd run
    tables : (dimensions, parts, RUN) of each group of TABLE_BITS digits; the lowest group is not used
    shift : (dimensions,) digital shift
    centre : added to the integer of a coordinate before it is scaled to (0, 1)
    """

    first_runs: Integers
    tables: Integers
    shift: Integers
    centre: float


@kernel
def sobol_points(
    start: int, stop: int, of: Digits, which: Integers, low: Array, high: Array, columns: Integers, out: Array
) -> None:
    """Compute the points start, ..., stop - 1 in the wanted dimensions, scaled from (0, 1) to given intervals.

    A run is a set of numbers that differ in the lowest TABLE_BITS digits alone.  The low digits of their Gray codes are
    those of the first run or of the second, so each coordinate takes one exclusive or.

    Parameters
    ----------
    start, stop : numbers of the first point and of the one after the last
    of : the sequence
    which : (k,) dimensions wanted
    low, high : (k,) ends of each interval, low <= high; coordinate x in (0, 1) becomes low (1 - x) + high x, clipped
    columns : (k,) column of ``out`` for each dimension
    out : (stop - start, P) out; only ``columns`` are written
    """
    scale = 2.0**-BITS
    values = np.empty((which.size, RUN))
    for run in range(start // RUN, (stop - 1) // RUN + 1):
        first = run * RUN
        begin, end = max(start - first, 0), min(stop - first, RUN)
        for k in range(which.size):
            dimension, a, b = which[k], low[k], high[k]
            digits, upper = run ^ (run >> 1), of.shift[which[k]]
            for part in range(1, of.tables.shape[1]):
                upper ^= of.tables[dimension, part, digits & (RUN - 1)]
                digits >>= TABLE_BITS
            # Whole rows and runs show the compiler that no index counts from the end: the loop becomes vector code.
            these, to = of.first_runs[dimension, run & 1], values[k]
            for j in range(RUN):
                share = (np.float64(these[j] ^ upper) + of.centre) * scale
                to[j] = smallest(largest(a * (1.0 - share) + b * share, a), b)
        for k in range(which.size):
            column = columns[k]
            for j in range(begin, end):
                out[first + j - start, column] = values[k, j]
