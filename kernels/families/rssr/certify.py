"""Certified maxima: proof that the search missed no peak, of a crank-rocker, and of a point guided by a chain.

docs/rssr.md, section 6.1, and docs/internals/extrema.md.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from kernels import status as st
from kernels.certified import cells as cells_of
from kernels.certified import covering
from kernels.certified.jets import LANES
from kernels.families.rssr.driven import ACROSS, ALONG, JETS, RATE, SHARES, STAGE, Stages, enclose_motion, load
from kernels.jit import kernel
from kernels.types import Array, Status


class InSeries(NamedTuple):
    """Designs of K crank-rockers of which each drives the next.

    Parameters
    ----------
    stages : (K, n, 8) columns as `PARAMETERS` of sweep/families/rssr.py, the four-bar of a guide last
    couplings : (K - 1, n, 2) kappa and offset [rad] of each stage but the first
    shares : (n, 8) of :func:`kernels.families.guide.point_shares`; any where no curve is of a point
    """

    stages: Stages
    couplings: Array
    shares: Array


@kernel
def certify_maxima(
    designs: InSeries, curves: NDArray[np.int64], target: float, most: int, status: Status, maximum: Array,
    phi: Array, error: Array, cells: Array,
) -> None:  # fmt: skip
    """Prove maxima of derivatives of a rocker's angle, or of the path of a point that crank-rockers in series guide.

    A maximum that the proof contradicts is corrected.

    Several designs are enclosed side by side; one that is proven makes room for the next.

    Parameters
    ----------
    designs : n of them
    curves : (m, 2); kind of each curve, travel along the line (0), deviation across it (1) or velocity of the first
        rocker (2), and the order of its derivative by phi: 1 to 3 along, 0 to 3 across, 0 to 2 of the velocity
    target : relative error within which no other peak may be higher
    most : enclosures per design after which a curve is given up
    status : (m, n) in and out; only designs whose first one is OK are looked at; NOT_CONVERGED where nothing is proven
    maximum, phi : (m, n) in and out [length; rad], maxima found by a search; replaced where the proof contradicts
    error : (m, n) out [length], proven bound of the absolute error of ``maximum``; nan where nothing is proven
    cells : (n,) out, number of enclosures; 0 for designs that are not looked at
    """
    n, count = cells.size, designs.stages.shape[0]
    rows = count * STAGE + SHARES * LANES
    numbers, design, good = np.zeros(rows), np.empty(LANES, np.int64), np.zeros(LANES)
    walk, of, jets = np.zeros(cells_of.WALK), np.zeros((curves.shape[0], cells_of.CURVE)), np.zeros(JETS)
    along, across, rate = (curves[:, 0] == 0).any(), (curves[:, 0] == 1).any(), (curves[:, 0] == 2).any()
    places = np.array([ALONG, ACROSS, RATE])[curves[:, 0]]
    lanes, coming = 0, 0
    while True:
        while coming < n and lanes < LANES:
            cells[coming] = 0.0
            if status[0, coming] == st.OK:
                design[lanes] = coming
                load(lanes, numbers, designs.stages, designs.couplings, designs.shares, coming)
                covering.begin(lanes, walk, of, phi, coming, most)
                lanes += 1
            coming += 1
        if lanes == 0:
            break
        enclose_motion(lanes, count, numbers, jets, walk, rate, along, across, good)
        covering.close(lanes, walk, of, jets, places, curves[:, 1], good, target)
        for lane in range(lanes):
            if walk[cells_of.ALONE + lane] != 0.0:
                covering.decide(lane, good[lane] != 0.0, walk, of, target, most)
        # Lanes that are done are freed, from last to first: the lane that moves into a free one is not done.
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
