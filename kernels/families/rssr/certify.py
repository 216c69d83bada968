"""Certified maxima of |psi'|, |psi''|, |psi'''|: proof that the search missed no peak (docs/rssr.md, section 6.1)."""

from __future__ import annotations

import numpy as np

from kernels import status as st
from kernels._jit import kernel
from kernels.certificate import CENTRE, DONE, MODE, REACH, STATE, begin, conclude, judge
from kernels.enclosure import ORDER
from kernels.families.rssr.closure import Array, Status, reduce_design
from kernels.families.rssr.enclosure import SIZE, VELOCITY, enclose
from kernels.sincos import sincos


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
