"""The multipliers that make the best bound of linear enclosures over a box: a small linear program.

    minimise t   subject to   a_j + g_j d <= t,   b_i + h_i d >= 0,   |d_k| <= half_k,   t >= 0                      (1)

with rows a_j that the objective exceeds and rows b_i that a feasible design keeps.  With a very small curvature lent to
d and t it is the point nearest to a centre far away that keeps linear rows (:mod:`kernels.linear.nearest`).  Where (1)
has no solution, the rows that say so are a proof that the box holds no feasible design.

The multipliers come from ordinary rounding.  What they prove is computed afterwards with outward rounding
(:func:`kernels.boxes.branching.combined`), so a wrong digit here can cost tightness and nothing else.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from kernels import status as st
from kernels.jit import kernel
from kernels.linear.nearest import nearest_with, nothing_held
from kernels.types import Array

LENT = 1e-4  # root of the curvature lent to d, in units of the box, and to t
ROUNDING = 1e-12


@kernel
def multipliers(rows: Array, count: int, objective: NDArray[np.uint8], half: Array, out: Array) -> int:
    """Multipliers of the rows of (1).

    Parameters
    ----------
    rows : (m, 1 + n), the first ``count`` of them used: value at the centre and slopes of each row
    objective : (m,) whether the row is one that t exceeds; the others are limits
    half : (n,) half the widths of the box
    out : (m,) the multipliers, not negative

    Returns
    -------
    OK; LIMIT_EXCEEDED where the rows contradict each other on the box; NOT_CONVERGED, with multipliers that still
    serve.
    """
    n, scale = half.shape[0], 0.0
    sides, needs = np.zeros((n + 1, count + 2 * n + 1)), np.zeros(count + 2 * n + 1)
    centre, y, held = np.zeros(n + 1), np.empty(n + 1), nothing_held(n + 1, count + 2 * n + 1)
    for j in range(count):
        sign = -1.0 if objective[j] else 1.0
        needs[j], scale = -sign * rows[j, 0], max(scale, abs(rows[j, 0]))
        for k in range(n):
            sides[k, j] = sign * rows[j, 1 + k] * half[k] / LENT
        sides[n, j] = 1.0 / LENT if objective[j] else 0.0
    for k in range(n):
        sides[k, count + k], sides[k, count + n + k] = 1.0 / LENT, -1.0 / LENT
        needs[count + k] = needs[count + n + k] = -1.0
    sides[n, count + 2 * n], centre[n] = 1.0 / LENT, -1.0 / LENT
    found, status = nearest_with(sides, needs, centre, ROUNDING * max(scale, 1e-300) * LENT, y, held)
    out[:] = 0.0
    for k in range(found):
        if held.numbers[k] < count:
            out[held.numbers[k]] = max(-held.share[k] if status == st.LIMIT_EXCEEDED else held.weights[k], 0.0)
    if status == st.LIMIT_EXCEEDED and held.numbers[found] < count:
        out[held.numbers[found]] = 1.0
    return int(status)
