"""Blocks of designs side by side: reduction and least Delta, vectorised over the designs.

A block is a plain array of ROWS rows of BLOCK numbers; the constant stride lets the compiler see that rows do not
overlap, so the loops over designs become vector code (8 ns per design for the reduction instead of 30).

One exact minimum says whether the crank turns fully, by what margin, and how large the pressure angle gets:
Delta(phi) = X^2 + Y^2 - W^2 is a trigonometric polynomial of degree 2 and Delta/b^2 = cos^2(pressure
angle); docs/rssr.md, section 4.
"""

from __future__ import annotations

import math
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from kernels import status as st
from kernels.arithmetic.intrinsics import largest, smallest
from kernels.curves.polynomials import approach, far_minimum, lowest_of_16, minimum, point, shortfall
from kernels.families.rssr.closure import closure_terms
from kernels.jit import inline, kernel
from kernels.linkage.crank_closure import reduce_scaled, unit_scale, within_unit_range
from kernels.linkage.verdict import turning_status
from kernels.types import EPS, Array, Status

BLOCK = 64
# Within _NEAR of a minimum one step of Newton's method reaches it to the precision of float64.  Two steps from the
# lowest of 16 points end farther from flat minima.  These, and minima not _SURE to be global, are searched again.
_NEAR, _SURE = 1e-5, 1e-4
# Rows: the fields of Reduced, the polynomial of Delta, its minimum.  During loading they hold the design itself.
E, Y0, CA, K0, K1, K2, W_SIZE, COUPLER, ROCKER, Z0, SA, BRANCH, VALID = (k * BLOCK for k in range(13))
C1, S1, C2, S2, COS, SIN, AGAIN, DELTA, CURVATURE, TOLERANCE, ACROSS = (k * BLOCK for k in range(13, 24))
ROWS = 24
_SEARCHED = (E, Y0, CA, K0, K1, K2, W_SIZE, SA, C1, S1, C2, S2, COS, SIN, DELTA)  # rows that a search for maxima needs
Counts: TypeAlias = NDArray[np.int64]


@inline
def new_block() -> Array:
    """Allocate one block."""
    return np.empty(ROWS * BLOCK)


@inline
def load_block(designs: Array, start: int, count: int, at: Array) -> None:
    """Reduce the designs start ... start + count - 1 into a block."""
    scaled = False
    for k in range(count):
        i = start + k
        at[k + E], at[k + Y0], at[k + CA] = designs[i, 0], designs[i, 1], designs[i, 2]
        at[k + K0], at[k + K1], at[k + K2] = designs[i, 3], designs[i, 4], designs[i, 5]
        at[k + W_SIZE], at[k + COUPLER] = designs[i, 6], designs[i, 7]
        scaled |= not within_unit_range(designs[i, 2])
    if scaled:  # apart, because it is rarely needed
        for k in range(count):
            unit = unit_scale(at[k + CA])
            for row in (E, Y0, CA, K0, K1, K2):
                at[k + row] *= unit
    for k in range(count):
        r = reduce_scaled(
            at[k + E], at[k + Y0], at[k + CA], at[k + K0], at[k + K1], at[k + K2], at[k + W_SIZE], at[k + COUPLER]
        )
        at[k + E], at[k + Y0], at[k + CA] = r.e, r.y0, r.ca
        at[k + K0], at[k + K1], at[k + K2], at[k + W_SIZE] = r.k0, r.k1, r.k2, r.w_size
        at[k + COUPLER], at[k + ROCKER], at[k + Z0], at[k + SA] = r.coupler, r.rocker, r.z0, r.sa
        at[k + BRANCH], at[k + VALID] = r.branch, 1.0 if r.valid else 0.0
        # Delta = const + C1 cos phi + S1 sin phi + C2 cos 2 phi + S2 sin 2 phi
        at[k + C1] = 2.0 * (r.k0 * r.k2 - r.e)
        at[k + S1] = 2.0 * (r.y0 * r.ca - r.k0 * r.k1)
        at[k + C2] = 0.5 * (r.sa * r.sa - (r.k2 - r.k1) * (r.k2 + r.k1))
        at[k + S2] = r.k1 * r.k2


@inline
def least_delta(count: int, at: Array) -> None:
    """Compute the smallest Delta of the turn in squared crank units, its place, and the bound of its rounding error.

    The bound of the rounding error is from standard error analysis (docs/rssr.md, section 4.2): the numbers of the
    closure carry errors of at most 5 (X), 7 (Y) and 18 (W) units of 2^-53 of their terms, the unit length of (cos, sin)
    included, and near Delta = 0 |W| <= |X| + |Y|; where it is not, far from turning, W itself stands for them.
    """
    for k in range(count):
        at[k + COS], at[k + SIN] = lowest_of_16(at[k + C1], at[k + S1], at[k + C2], at[k + S2])
    for k in range(count):
        c1, s1, c2, s2 = at[k + C1], at[k + S1], at[k + C2], at[k + S2]
        u, v, _ = approach(c1, s1, c2, s2, at[k + COS], at[k + SIN])
        at[k + COS], at[k + SIN] = u, v
        size = abs(c1) + abs(s1) + abs(c2) + abs(s2)
        at[k + AGAIN] = 1.0 if shortfall(c1, s1, c2, s2, u, v) > -_SURE * size else 0.0
    for k in range(count):
        _evaluate(at, k)
    for k in range(count):
        if at[k + AGAIN] != 0.0:
            m = minimum(at[k + C1], at[k + S1], at[k + C2], at[k + S2])
            at[k + COS], at[k + SIN] = m.cos, m.sin
            _evaluate(at, k)


@inline
def _evaluate(at: Array, k: int) -> None:
    """Compute Delta at the minimum next to the given place, and mark designs whose place is too far from it."""
    u, v, e, y0, ca = at[k + COS], at[k + SIN], at[k + E], at[k + Y0], at[k + CA]
    k0, k1, k2 = at[k + K0], at[k + K1], at[k + K2]
    # The expanded coefficients only place the minimum; its value comes from X, Y, W themselves, and the slope there
    # corrects for the remaining distance.
    x, y, w = closure_terms(e, y0, ca, k0, k1, k2, u, v)
    slope = x * v + y * ca * u - w * (k1 * u + k2 * v)
    curvature = -(at[k + C1] * u + at[k + S1] * v) - 4.0 * (
        at[k + C2] * ((u - v) * (u + v)) + at[k + S2] * (2.0 * u * v)
    )
    step = -2.0 * slope / curvature
    near = (curvature > 0.0) & (abs(step) <= _NEAR)
    step = step if near else 0.0
    at[k + AGAIN] = at[k + AGAIN] if near else 1.0
    at[k + DELTA] = (x * x + y * y - w * w) + slope * step
    shrink = 1.0 - 0.5 * step * step
    u, v = (u - v * step) * shrink, (v + u * step) * shrink
    at[k + COS], at[k + SIN] = u, v
    at[k + CURVATURE] = curvature
    mx, my, mw = abs(e) + 1.0, abs(y0) + abs(ca), at[k + W_SIZE]
    reach = mx + my if mx + my > abs(w) else abs(w)
    w_error = 18.0 * EPS * mw
    at[k + TOLERANCE] = EPS * (14.0 * mx * mx + 18.0 * my * my + 38.0 * reach * mw) + w_error * w_error


@inline
def singularity_distance(count: int, at: Array) -> None:
    """Write the distance [rad] of the motion's nearest singularity from the real axis to ACROSS, to leading order.

    It sets the spacing of samples.  Singularities are the complex zeros of Delta (its second minimum, where there is
    one, counts too) and those of R = X^2 + Y^2, where the crank pin would lie on the rocker axis: X + i Y = 0 puts the
    point (e, y0) on an ellipse confocal with that of the crank pin, and the difference of their elliptic coordinates is
    the distance.
    """
    for k in range(count):
        c1, s1, c2, s2 = at[k + C1], at[k + S1], at[k + C2], at[k + S2]
        u, v, delta = at[k + COS], at[k + SIN], at[k + DELTA]
        here = point(c1, s1, c2, s2, u, v)
        near = 2.0 * delta / largest(here.curvature, 1e-300)
        fu, fv = far_minimum(c2, s2 + 1e-300, u, v)
        there = point(c1, s1, c2, s2, fu, fv)
        far = 2.0 * (delta + there.value - here.value) / largest(there.curvature, 1e-300)
        e, y0, ca, sa = at[k + E], at[k + Y0], at[k + CA], at[k + SA]
        focal = 0.5 * (math.sqrt((e - sa) * (e - sa) + y0 * y0) + math.sqrt((e + sa) * (e + sa) + y0 * y0))
        size, own = focal + math.sqrt(largest(focal * focal - sa * sa, 0.0)), 1.0 + abs(ca)
        axis = 2.0 * abs(size - own) / (size + own)
        at[k + ACROSS] = smallest(math.sqrt(smallest(near, far)), axis)


@inline
def keep_what_turns(start: int, count: int, at: Array, who: Counts, status: Status) -> int:
    """Move the designs of a block that turn to its front; return their number.  ``who`` gets their old places.

    A design that does not turn costs its verdict only.
    """
    block = 0
    for k in range(count):
        i = start + k
        status[i] = turning_status(at[k + DELTA], at[k + TOLERANCE], at[k + VALID] != 0.0)
        who[block] = k
        block += 1 if status[i] == st.OK else 0
    if block < count:
        for row in _SEARCHED:
            for i in range(block):
                at[row + i] = at[row + who[i]]
    return block


@inline
def _ball(at: Array, k: int) -> tuple[float, float]:
    """Squares of the cosine and the sine of the pressure angle at the least Delta, each times (b/a)^2."""
    u, v = at[k + COS], at[k + SIN]
    radial = at[k + ROCKER] - (at[k + K0] + at[k + K1] * v - at[k + K2] * u)
    axial = at[k + Z0] - at[k + SA] * v
    return at[k + DELTA], radial * radial + axial * axial


@kernel
def margin(
    designs: Array,
    status: Status,
    margin: Array | None,
    rotatable: Array | None,
    max_pressure_angle: Array | None,
    phi_min: Array | None,
    error: Array | None,
    angle_error: Array | None = None,
) -> None:
    """Compute rotatability, margin and largest pressure angle of every design, exact.

    Parameters
    ----------
    designs : (n, 8) columns as `PARAMETERS` of sweep/families/rssr.py
    status : (n,) out; OK, NOT_ROTATABLE, UNDECIDABLE (the least Delta is zero within rounding) or INVALID_INPUT
    margin : (n,) out, least Delta/b^2 = least cos^2(pressure angle) over the turn; negative if the crank does not turn
    rotatable : (n,) out, 1 or 0; nan where undecidable
    max_pressure_angle : (n,) out [rad]; nan unless rotatable
    phi_min : (n,) out [rad], crank angle in (-pi, pi] of the least Delta
    error : (n,) out, bound of the rounding error of ``margin``
    angle_error : (n,) out [rad], error of ``max_pressure_angle`` due to ``error``, which it needs; nan where that is

    Notes
    -----
    Outputs of None are neither computed nor compiled.  Where the least Delta is farther from zero than the error bound
    of :func:`least_delta`, the verdict is that of exact arithmetic on the given doubles.
    """
    at = new_block()
    for start in range(0, designs.shape[0], BLOCK):
        count = min(BLOCK, designs.shape[0] - start)
        load_block(designs, start, count, at)
        least_delta(count, at)
        # Slices of the outputs, so that the index is the loop variable alone: else numbers are written one by one.
        codes = status[start : start + count]
        for k in range(count):
            codes[k] = turning_status(at[k + DELTA], at[k + TOLERANCE], at[k + VALID] != 0.0)
        if margin is not None:
            least = margin[start : start + count]
            for k in range(count):
                value = at[k + DELTA] / (at[k + COUPLER] * at[k + COUPLER])
                least[k] = value if codes[k] != st.INVALID_INPUT else math.nan
        if rotatable is not None:
            turns = rotatable[start : start + count]
            for k in range(count):
                known = (codes[k] != st.INVALID_INPUT) & (codes[k] != st.UNDECIDABLE)
                turns[k] = (1.0 if at[k + DELTA] > 0.0 else 0.0) if known else math.nan
        if error is not None:
            bound = error[start : start + count]
            for k in range(count):
                # The bound of Delta, plus the rounding of the quotient by the square of the coupler.
                per_square = 1.0 / (at[k + COUPLER] * at[k + COUPLER])
                value = (at[k + TOLERANCE] + 4.0 * EPS * abs(at[k + DELTA])) * per_square
                bound[k] = value if codes[k] != st.INVALID_INPUT else math.nan
            if angle_error is not None:
                of_angle = angle_error[start : start + count]
                for k in range(count):
                    square, across = _ball(at, k)
                    # d(angle) = d(cos^2)/sin(2 angle), and sqrt(d(cos^2)) where that is too steep to be linear.
                    linear = bound[k] * (square + across) / (2.0 * math.sqrt(largest(square * across, 0.0)))
                    far = smallest(linear, math.sqrt(bound[k])) + 8.0 * EPS
                    of_angle[k] = far if codes[k] == st.OK else math.nan
        # What needs a call comes last: only without one a loop over designs vectorises.
        if max_pressure_angle is not None:
            for k in range(count):
                # An arctangent, because an arccosine loses half the digits of a small angle.
                square, across = _ball(at, k)
                angle = math.atan2(math.sqrt(across), math.sqrt(square)) if status[start + k] == st.OK else math.nan
                max_pressure_angle[start + k] = angle
        if phi_min is not None:
            for k in range(count):
                known = status[start + k] != st.INVALID_INPUT
                phi_min[start + k] = math.atan2(at[k + SIN], at[k + COS]) if known else math.nan
