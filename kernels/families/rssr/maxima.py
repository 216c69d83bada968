"""True maxima of |psi'|, |psi''|, |psi'''| over the turn, refined between samples (docs/rssr.md, section 6).

Per design: the exact margin; if it turns N >= 11/rho samples, rho being the distance of the nearest singularity;
then every local maximum that may be the highest is refined on the next derivative, vectorised over the maxima of a
whole block of designs.  A maximum whose refinement fails its checks, or a design that would need more than 1024
samples, goes to :mod:`kernels.families.rssr.careful`.

The fused search of chains (:mod:`kernels.chains`) finds the same within 1e-11, in 1.4 to 1.7 times the time.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np

from kernels import status as st
from kernels.families.rssr.block import (
    ACROSS,
    BLOCK,
    Counts,
    keep_what_turns,
    least_delta,
    load_block,
    new_block,
    singularity_distance,
)
from kernels.families.rssr.careful import NONE, careful
from kernels.families.rssr.sampling import (
    ERROR,
    FEWEST,
    GRID_SIZE,
    HEIGHT,
    LAST,
    MARKS,
    MOST,
    MOVED,
    REACH,
    ROUNDING,
    START,
    Samples,
    begin_at_vertex,
    finish,
    list_marked,
    list_peaks,
    mark_peaks,
    new_list,
    refine,
    sample,
    sample_block,
    sample_block_both,
    sample_both,
    settle,
)
from kernels.jit import inline, kernel
from kernels.linkage.outputs import write, write_number
from kernels.types import TWO_PI as TURN
from kernels.types import Array, CosSin, Status

PER_RHO, PER_RHO_JERK = 11.0, 18.0  # samples per distance of the nearest singularity, at least
# Share of the highest sample that the sample at the highest maximum has at least.  Beside a square root's zero at the
# distance rho it is 0.96, 0.88 and 0.87 for the three orders, with samples as far apart as PER_RHO permits.
_OF_VELOCITY, _OF_OTHERS = 0.9, 0.75
# A literal number in a call is a type of its own, for which a helper is compiled once more: this is no literal.
_ZERO: Any = np.int64(0)


class Search(NamedTuple):
    """Memory of the search of one order: samples of a block and of one design, the list of maxima, its index.

    The maxima of design i of a block are those from first[i] to first[i + 1] of the list.
    """

    grid: Array
    size: Array
    m: Array
    first: Counts


class Places(NamedTuple):
    """Crank angles of the maxima, errors of maxima and of angles, (3, n) each; None where not wanted."""

    phi: Array | None
    error: Array | None
    phi_error: Array | None


class Heights(NamedTuple):
    """Maxima of the first, second and third derivative, (n,); None where not wanted."""

    dpsi: Array | None
    d2psi: Array | None
    d3psi: Array | None


@inline
def _new_search() -> Search:
    return Search(np.empty(GRID_SIZE), np.empty(MOST + 2), new_list(), np.empty(BLOCK + 1, np.int64))


@inline
def _put(i: int, order: int, result: tuple[float, float, float, float], places: Places, heights: Heights) -> None:
    """Write height, place and the errors of both for one order of design i, where they are wanted."""
    best, place, bound, reach = result
    write(places.phi, order - 1, i, place - TURN * np.floor(place / TURN))  # math.floor makes an integer; nan has none
    write(places.error, order - 1, i, bound)
    write(places.phi_error, order - 1, i, reach)
    write_number(heights.dpsi, i, best)
    write_number(heights.d2psi, i, best)
    write_number(heights.d3psi, i, best)


@inline
def _highest(begin: int, end: int, m: Array) -> tuple[float, float, float, float]:
    """Height, place and the errors of both of the highest refined maximum of a design."""
    # The first and the last without a loop: few designs have more, which the processor predicts well.
    best, winner = max(m[begin + HEIGHT], 0.0), begin
    for peak in range(begin + 1, end - 1):
        winner = peak if m[peak + HEIGHT] > best else winner
        best = max(best, m[peak + HEIGHT])
    winner = end - 1 if m[end - 1 + HEIGHT] > best else winner
    best = max(best, m[end - 1 + HEIGHT])
    place = m[winner + START] + m[winner + MOVED] + m[winner + LAST]
    return best, place, m[winner + ERROR] + best * m[winner + ROUNDING], m[winner + REACH]


@inline
def _list_maxima(
    block: int, at: Array, table: CosSin, of: Search, also: Search | None, per_rho: float, first: Array | None,
    second: Array | None,
) -> None:  # fmt: skip
    """List the local maxima of one order among the samples of a block, or among more samples where needed.

    With ``also``, those of the first order and, in ``also``, of the second, from the same samples.
    """
    count, more = _ZERO, _ZERO
    share = _OF_VELOCITY if also is not None or first is not None else _OF_OTHERS
    for i in range(block):
        of.first[i] = count
        if also is not None:
            also.first[i] = more
        if at[i + ACROSS] * MOST < per_rho:
            continue
        n = FEWEST
        while n * at[i + ACROSS] < per_rho:
            n *= 2
        if n == FEWEST:
            count = _list_fewest(i, at, table, of, count)
            if also is not None:
                more = _list_fewest(i, at, table, also, more)
            continue
        if also is not None:
            sample_both(at, i, table, n, of.size, also.size)
            more = list_peaks(at, i, table, n, _OF_OTHERS, also.size, also.m, more)
        else:
            sample(at, i, table, n, of.size, first, second)
        count = list_peaks(at, i, table, n, share, of.size, of.m, count)
    of.first[block] = count
    if also is not None:
        also.first[block] = more


@inline
def _list_fewest(i: int, at: Array, table: CosSin, of: Search, count: int) -> int:
    """List the maxima marked among the samples of a block; returns the new length of the list."""
    return list_marked(int(of.grid[MARKS + i]), at, i, table, of.grid, Samples(i, BLOCK, FEWEST, 0), of.m, count)


@inline
def _maxima_of(
    start: int, block: int, at: Array, who: Counts, of: Search, target: float, status: Status, places: Places,
    heights: Heights,
) -> None:  # fmt: skip
    """Refine the listed maxima of one transfer function of a block; exactly one height is given."""
    m, first_peak, first, second = of.m, of.first, heights.dpsi, heights.d2psi
    order = 1 if first is not None else (2 if second is not None else 3)
    # The parabola at the end is one more step; a maximum not settled then, one in hundreds, gets another three.
    rounds = (1 if target > 1e-10 else 2) if order == 1 else (2 if target > 1e-4 else 3)
    padded = (first_peak[block] + 7) & ~7  # whole vectors; the surplus is never read
    begin_at_vertex(padded, m)
    refine(_ZERO, padded, m, rounds, first, second)
    finish(_ZERO, padded, m, order, target, first, second, places.error, places.phi_error)
    for i in range(block):
        begin, end = first_peak[i], first_peak[i + 1]
        worst = max(m[begin + ERROR], m[end - 1 + ERROR]) if end > begin else math.inf
        for peak in range(begin + 1, end - 1):
            worst = max(worst, m[peak + ERROR])
        if end > begin and not worst < math.inf:
            worst = settle(begin, end, m, order, target, first, second, places.error, places.phi_error)
        if worst < math.inf:
            result = _highest(begin, end, m)
        else:
            result, agreed = careful(at, i, order, target)
            if not agreed:
                status[start + who[i]] = st.NOT_CONVERGED
        _put(start + who[i], order, result, places, heights)


@kernel
def true_maxima(
    designs: Array,
    table: CosSin,
    target: float,
    status: Status,
    phi: Array | None,
    error: Array | None,
    phi_error: Array | None,
    max_abs_dpsi: Array | None,
    max_abs_d2psi: Array | None,
    max_abs_d3psi: Array | None,
) -> None:
    """Find the largest magnitudes of transfer functions over the turn, their places, and estimates of their errors.

    Parameters
    ----------
    designs : (n, 8) columns as `PARAMETERS` of sweep/families/rssr.py
    table : :func:`kernels.families.rssr.sampling.sampling_tables`
    target : relative error wanted, 1e-3 ... 1e-12
    status : (n,) out; OK, NOT_ROTATABLE, UNDECIDABLE, NOT_CONVERGED or INVALID_INPUT
    phi : (3, n) out, or None [rad], crank angles in [0, 2 pi) of the maxima, of order 1, 2 and 3
    error, phi_error : (3, n) out, or None: estimates of the absolute errors of the maxima and of phi
    max_abs_dpsi, max_abs_d2psi, max_abs_d3psi : (n,) out, or None: not wanted, the rows of the others mean nothing

    Notes
    -----
    Where the status is not OK the outputs are nan, with NOT_CONVERGED those that were not found.  What is wanted
    together shares reduction and samples, and has the bits that it has by itself.  The search is statistical, not
    proven; docs/rssr.md gives the number of random designs it was measured on.
    """
    at, who, of, of_q = new_block(), np.empty(BLOCK, np.int64), _new_search(), _new_search()
    places, asked = Places(phi, error, phi_error), Heights(max_abs_dpsi, max_abs_d2psi, max_abs_d3psi)
    for start in range(0, designs.shape[0], BLOCK):
        count = min(BLOCK, designs.shape[0] - start)
        load_block(designs, start, count, at)
        least_delta(count, at)
        block = keep_what_turns(start, count, at, who, status)
        for i in range(start, start + count if block < count else start):
            for order in range(1, 4):
                _put(i, order, NONE, places, asked)
        padded = (block + 7) & ~7  # whole vectors; what stands in the surplus is never read
        singularity_distance(padded, at)
        if max_abs_dpsi is not None and max_abs_d2psi is not None:
            sample_block_both(padded, at, table, of.grid, of_q.grid)
            mark_peaks(padded, of.grid, _OF_VELOCITY)
            mark_peaks(padded, of_q.grid, _OF_OTHERS)
            _list_maxima(block, at, table, of, of_q, PER_RHO, None, None)
            _maxima_of(start, block, at, who, of_q, target, status, places, Heights(None, max_abs_d2psi, None))
            _maxima_of(start, block, at, who, of, target, status, places, Heights(max_abs_dpsi, None, None))
        elif max_abs_dpsi is not None or max_abs_d2psi is not None:
            sample_block(padded, at, table, of.grid, max_abs_dpsi, max_abs_d2psi)
            mark_peaks(padded, of.grid, _OF_VELOCITY if max_abs_dpsi is not None else _OF_OTHERS)
            _list_maxima(block, at, table, of, None, PER_RHO, max_abs_dpsi, max_abs_d2psi)
            heights = Heights(max_abs_dpsi, max_abs_d2psi, None)
            _maxima_of(start, block, at, who, of, target, status, places, heights)
        if max_abs_d3psi is not None:
            sample_block(padded, at, table, of.grid, None, None)
            mark_peaks(padded, of.grid, _OF_OTHERS)
            _list_maxima(block, at, table, of, None, PER_RHO_JERK, None, None)
            _maxima_of(start, block, at, who, of, target, status, places, Heights(None, None, max_abs_d3psi))
