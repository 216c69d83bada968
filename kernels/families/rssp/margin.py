"""Whether the crank turns fully, by what margin, and the largest pressure angle: all three from one exact minimum.

Q(phi) = (b - m)(b + m) - n^2 is a trigonometric polynomial of degree 2 without a sin 2 phi term and Q/b^2 =
cos^2(pressure angle), so its minimum answers all three; equation (4) of docs/rssp.md.
"""

from __future__ import annotations

import math
from typing import NamedTuple

from kernels import status as st
from kernels._jit import inline, kernel
from kernels.families.rssp.closure import EPS, Array, Reduced, Status, place, reduce_design
from kernels.trigpoly import minimum
from kernels.verdict import turning_status


class LeastQ(NamedTuple):
    """Smallest Q of the turn in squared units of the reduced design, where it is, and how well it is known."""

    q: float
    cos: float
    sin: float
    across: float  # distance of the coupler's ends across the slide line
    tolerance: float


@inline
def least_q(r: Reduced) -> LeastQ:
    """Return the smallest Q over the turn;
    ``tolerance`` bounds its rounding error (docs/rssp.md, section on rotatability).
    """
    lowest = minimum(2.0 * r.a * r.e, 2.0 * r.n0 * r.na, -0.5 * r.ka * r.ka, 0.0)
    u, v = lowest.cos, lowest.sin
    # The coefficients only place the minimum; its value comes from m and n, and its slope there takes off what the
    # rounding of the place displaced it by.
    m, n, q = place(r, u, v)
    half_slope = -(m * (r.a * v) - n * (r.na * u))
    moved = 2.0 * half_slope * half_slope / lowest.curvature
    if 0.0 <= moved < 1e-6 * abs(q):
        q -= moved
    size, size2 = r.m_size, r.n_size
    tolerance = EPS * (12.0 * abs(m) * size + 18.0 * abs(n) * size2) + 64.0 * EPS * EPS * (size * size + size2 * size2)
    return LeastQ(q, u, v, math.sqrt(m * m + n * n), tolerance)


@kernel
def margin(
    designs: Array,
    status: Status,
    margin: Array | None,
    rotatable: Array | None,
    max_pressure_angle: Array | None,
    phi_min: Array | None,
) -> None:
    """Compute rotatability, margin and largest pressure angle of every design, exact.

    Parameters
    ----------
    designs : (n, 6) columns of :class:`Design`
    status : (n,) out; OK, NOT_ROTATABLE, UNDECIDABLE (the least Q is zero within rounding) or INVALID_INPUT
    margin : (n,) out, least Q/b^2 = least cos^2(pressure angle) over the turn; negative if the crank does not turn
    rotatable : (n,) out, 1 or 0; nan where undecidable
    max_pressure_angle : (n,) out [rad]; nan unless rotatable
    phi_min : (n,) out [rad], crank angle in (-pi, pi] of the least Q

    Notes
    -----
    What is None is neither computed nor compiled.
    """
    for i in range(designs.shape[0]):
        r = reduce_design(designs, i)
        least = least_q(r)
        code = turning_status(least.q, least.tolerance, r.valid)
        status[i] = code
        known = code != st.INVALID_INPUT
        if margin is not None:
            margin[i] = least.q / (r.b * r.b) if known else math.nan
        if rotatable is not None:
            rotatable[i] = (1.0 if least.q > 0.0 else 0.0) if known and code != st.UNDECIDABLE else math.nan
        if max_pressure_angle is not None:
            # atan2, not acos: acos loses half the digits near zero.
            max_pressure_angle[i] = math.atan2(least.across, math.sqrt(least.q)) if code == st.OK else math.nan
        if phi_min is not None:
            phi_min[i] = math.atan2(least.sin, least.cos) if known else math.nan
