"""Certified maxima: proof that the search missed no peak, of a crank-rocker, and of a point guided by a chain.

docs/rssr.md, section 6.1, and docs/extrema.md, section 5.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from kernels import status as st
from kernels.arithmetic.sincos import sincos
from kernels.certified import cells as cells_of
from kernels.certified import covering
from kernels.certified.certificate import CENTRE, DONE, MODE, REACH, STATE, begin, conclude, judge
from kernels.certified.enclosure import ORDER
from kernels.certified.lanes import LANES
from kernels.families.rssr.closure import Array, Status, reduce_design
from kernels.families.rssr.driven import ACROSS, ALONG, JETS, SHARES, STAGE, Stages, enclose_point, load
from kernels.families.rssr.enclosure import SIZE, VELOCITY, enclose
from kernels.jit import kernel


@kernel
def certify_maxima(
    designs: Array, order: int, target: float, most: int, status: Status, maximum: Array, phi: Array, error: Array,
    cells: Array,
) -> None:  # fmt: skip
    """Prove maxima of |d^order psi / dphi^order| over the whole turn, or correct them.

    Parameters
    ----------
    designs : (n, 8) columns of :class:`Design`
    order : 1, 2 or 3
    target : relative error within which no other peak may be higher
    most : enclosures per design after which it is given up
    status : (n,) in and out; only designs that are OK are looked at, and become NOT_CONVERGED where nothing is proven
    maximum, phi : (n,) in and out, what a search found and where [rad]; replaced where the proof contradicts it
    error : (n,) out, proven bound of the absolute error of ``maximum``; nan where nothing is proven
    cells : (n,) out, how many enclosures it took; 0 for what is not looked at
    """
    at, state, y = np.empty(SIZE), np.empty(STATE), np.empty(ORDER + 1)
    for i in range(designs.shape[0]):
        cells[i] = 0.0
        if status[i] != st.OK:
            continue
        r = reduce_design(designs, i)
        begin(state, phi[i], target, most)
        while state[MODE] != DONE:
            sine, cosine = sincos(state[CENTRE])
            encloses = enclose(at, r, cosine, sine, state[REACH])
            judge(state, encloses, at, VELOCITY, order - 1, y)
        conclude(state, i, most, status, maximum, phi, error, cells)


@kernel
def certify_point(
    stages: Stages, couplings: Array, shares: Array, curves: NDArray[np.int64], target: float, most: int,
    status: NDArray[np.uint8], maximum: Array, phi: Array, error: Array, cells: Array,
) -> None:  # fmt: skip
    """Prove maxima of derivatives of a guided point's way that crank-rockers in series drive, or correct them.

    Several designs are enclosed side by side; one that is proven makes room for the next.

    Parameters
    ----------
    stages : (K, n, 8) columns of :class:`kernels.families.rssr.closure.Design`, the four-bar of the guide last
    couplings : (K - 1, n, 2) kappa and offset [rad] of each stage but the first
    shares : (n, 8) of :func:`kernels.families.guide.point_shares`
    curves : (m, 2); of each curve whether it is the way along the line (0) or across it (1), and the order of its
        derivative by phi: 1 to 3 along, 0 to 3 across
    target : relative error within which no other peak may be higher
    most : enclosures per design after which a curve is given up
    status : (m, n) in and out; only designs whose first one is OK are looked at; NOT_CONVERGED where nothing is proven
    maximum, phi : (m, n) in and out [length; rad], what a search found and where; replaced where the proof contradicts
    error : (m, n) out [length], proven bound of the absolute error of ``maximum``; nan where nothing is proven
    cells : (n,) out, how many enclosures it took; 0 for what is not looked at
    """
    n, count, rows = cells.size, stages.shape[0], stages.shape[0] * STAGE + SHARES * LANES
    numbers, design, good = np.zeros(rows), np.empty(LANES, np.int64), np.zeros(LANES)
    walk, of, jets = np.zeros(cells_of.WALK), np.zeros((curves.shape[0], cells_of.CURVE)), np.zeros(JETS)
    along, across = (curves[:, 0] == 0).any(), (curves[:, 0] == 1).any()
    places = np.where(curves[:, 0] == 0, ALONG, ACROSS)
    lanes, coming = 0, 0
    while True:
        while coming < n and lanes < LANES:
            cells[coming] = 0.0
            if status[0, coming] == st.OK:
                design[lanes] = coming
                load(lanes, numbers, stages, couplings, shares, coming)
                covering.begin(lanes, walk, of, phi, coming, most)
                lanes += 1
            coming += 1
        if lanes == 0:
            break
        enclose_point(lanes, count, numbers, jets, walk, along, across, good)
        covering.close(lanes, walk, of, jets, places, curves[:, 1], good, target)
        for lane in range(lanes):
            if walk[cells_of.ALONE + lane] != 0.0:
                covering.decide(lane, good[lane] != 0.0, walk, of, target, most)
        # Lanes that are done make room. From last to first: what moves into a free one is not done.
        for lane in range(lanes - 1, -1, -1):
            if walk[cells_of.MODE + lane] != cells_of.DONE:
                continue
            i = design[lane]
            cells[i] = walk[cells_of.CELLS + lane]
            for j in range(curves.shape[0]):
                covering.conclude(lane, of, j, i, status, maximum, phi, error)
            lanes -= 1
            design[lane] = design[lanes]
            for row in range(0, cells_of.WALK, LANES):
                walk[row + lane] = walk[row + lanes]
            for j in range(curves.shape[0]):
                for row in range(0, cells_of.KEEP, LANES):
                    of[j, row + lane] = of[j, row + lanes]
            for row in range(0, rows, LANES):
                numbers[row + lane] = numbers[row + lanes]
