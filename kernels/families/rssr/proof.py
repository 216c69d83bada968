"""Proof that crank-rockers on the locus are no better than a target: the search over boxes of designs.

A box is halved until its rows (:mod:`kernels.families.rssr.box_rows`) prove that it holds no feasible design, or none
that reaches the target.
"""

from __future__ import annotations

import math
from heapq import heapify, heappop, heappush
from typing import NamedTuple

import numpy as np

from kernels.boxes.branching import COMBINED, OPEN, TOO_SMALL, Flags, Indices
from kernels.families.rssr import box_turn as bt
from kernels.families.rssr.box_peaks import POSES
from kernels.families.rssr.box_problem import BoxQuestion, BoxScratch, room
from kernels.families.rssr.box_rows import crank_known, judge, judge_any_crank
from kernels.families.rssr.box_turn import Formulas
from kernels.jit import inline, kernel
from kernels.types import Array

NARROWEST = 1.0 / 64.0  # of the widest side


class Leaves(NamedTuple):
    """Boxes that were not halved: their ends, and what was proven of them."""

    low: Array  # (m, n)
    high: Array
    outcome: Flags  # (m,)
    bound: Array
    kinds: Indices  # (m, COMBINED) rows that prove it, -1 where there are fewer
    theta: Array
    factors: Array


@kernel
def _record(
    leaves: Leaves, count: int, low: Array, high: Array, outcome: int, bound: float, rows: BoxScratch, used: int
) -> int:
    """Append a leaf with the rows that prove it; return the number of leaves."""
    leaves.low[count], leaves.high[count] = low, high
    leaves.outcome[count], leaves.bound[count] = outcome, bound
    leaves.kinds[count], leaves.theta[count], leaves.factors[count] = -1, 0.0, 0.0
    place = 0
    for j in range(used):
        if rows.factors[j] != 0.0 and place < COMBINED:
            leaves.kinds[count, place], leaves.theta[count, place] = rows.kinds[j], rows.theta[j]
            leaves.factors[count, place] = rows.factors[j]
            place += 1
    return count + 1


@inline
def _to_halve(low: Array, high: Array, whole: Array, smallest: float, loose: Array) -> int:
    """Choose the variable to halve: the one that loosens the bound most, or -1 where all are too narrow.

    A variable far narrower than the widest is not halved, so that a row that stays undecided is not pursued for ever.

    Where no looseness is known, it is the variable of the widest share of the space.
    """
    best, most, widest = -1, 0.0, 0.0
    known = loose.max() > 0.0
    for k in range(low.shape[0]):
        widest = max(widest, (high[k] - low[k]) / whole[k])
    least_share = max(smallest, NARROWEST * widest)
    for k in range(low.shape[0]):
        share = (high[k] - low[k]) / whole[k]
        cost = loose[k] if known else share
        divisible = share >= least_share and low[k] < 0.5 * (low[k] + high[k]) < high[k]
        if divisible and (best < 0 or cost > most):
            best, most = k, cost
    return best


@kernel
def explore(
    p: BoxQuestion, f: Formulas, starts: tuple[Array, Array, Array], whole: Array, varied: Array, given: Array,
    smallest: float, most: int, leaves: Leaves,
) -> tuple[int, int]:  # fmt: skip
    """Halve boxes until every part is proven not to reach the target, or ``most`` parts were judged; worst first.

    Parameters
    ----------
    p, f : the question, and the formulas of the locus of ``box_locus``
    starts : low and high ends of the boxes, (m, n) with n <= 4, and the bounds (m,) known of them; 0 for nothing
    whole : (n,) width of the whole space, by which widths are compared
    varied, given : (n,) which of the seven coordinates vary, and all seven
    smallest : share of ``whole`` below which a side is not halved again
    most : largest number of parts to judge
    leaves : out, of at least m + most rows

    Returns
    -------
    Number of leaves filled, and of parts judged.  Leaves of outcome OPEN or TOO_SMALL are not proven; their bound is
    the best one known.
    """
    boxes, n = starts[0].shape
    rows, more = room(f.forms, n), room(f.forms, n + 1)
    any_crank = p.tube.shape[0] > 0 and f.slots[bt.FREE_PASSED] >= 0 and p.limits[1] < math.inf
    scratch, used = np.zeros((4, POSES)), np.zeros(POSES, np.uint8)
    lows, highs, bounds = np.zeros((boxes + most, n)), np.zeros((boxes + most, n)), np.zeros(boxes + most)
    filled, judged = 0, 0
    lows[:boxes], highs[:boxes], bounds[:boxes] = starts
    # the least bound first, among equal bounds the smaller depth
    waiting = [(bounds[i], 0, i) for i in range(boxes)]
    heapify(waiting)
    while waiting and judged < most:
        _, depth, box = heappop(waiting)
        judged += 1
        lo, hi = lows[box], highs[box]
        found, loose = rows, rows.loose
        outcome, count, bound = judge(p, f, lo, hi, varied, given, rows, scratch, used)
        if outcome == OPEN and any_crank and not crank_known(f, rows):
            found, loose = more, more.loose[:n]
            outcome, count, bound = judge_any_crank(p, f, lo, hi, varied, given, more, scratch)
        bounds[box] = max(bounds[box], bound)
        if outcome != OPEN:
            filled = _record(leaves, filled, lo, hi, outcome, bound, found, count)
            continue
        k = _to_halve(lo, hi, whole, smallest, loose)
        if k < 0:
            filled = _record(leaves, filled, lo, hi, TOO_SMALL, bounds[box], found, 0)
            continue
        middle = 0.5 * (lo[k] + hi[k])
        lows[boxes], highs[boxes], bounds[boxes] = lo, hi, bounds[box]
        lows[boxes, k], highs[box, k] = middle, middle
        heappush(waiting, (bounds[box], depth + 1, box))
        heappush(waiting, (bounds[box], depth + 1, boxes))
        boxes += 1
    for _, _, box in waiting:
        filled = _record(leaves, filled, lows[box], highs[box], OPEN, bounds[box], found, 0)
    return filled, judged
