"""Does the crank turn fully, by what margin, and how large does the pressure angle get: one exact minimum.

Delta(phi) = X^2 + Y^2 - W^2 is a trigonometric polynomial of degree 2 and Delta/b^2 = cos^2(pressure angle), so its
minimum answers all three (docs/rssr.md, section 4).
"""

from __future__ import annotations

import math

from kernels import status as st
from kernels.arithmetic.intrinsics import largest, smallest
from kernels.families.rssr.block import (
    BLOCK,
    COS,
    COUPLER,
    DELTA,
    K0,
    K1,
    K2,
    ROCKER,
    SA,
    SIN,
    TOLERANCE,
    VALID,
    Z0,
    least_delta,
    load_block,
    new_block,
)
from kernels.families.rssr.closure import EPS, Array, Status
from kernels.jit import inline, kernel
from kernels.linkage.verdict import turning_status


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
    designs : (n, 8) columns of :class:`Design`
    status : (n,) out; OK, NOT_ROTATABLE, UNDECIDABLE (the least Delta is zero within rounding) or INVALID_INPUT
    margin : (n,) out, least Delta/b^2 = least cos^2(pressure angle) over the turn; negative if the crank does not turn
    rotatable : (n,) out, 1 or 0; nan where undecidable
    max_pressure_angle : (n,) out [rad]; nan unless rotatable
    phi_min : (n,) out [rad], crank angle in (-pi, pi] of the least Delta
    error : (n,) out, bound of the rounding error of ``margin``
    angle_error : (n,) out [rad], what ``error``, which it needs, does to ``max_pressure_angle``; nan as that is

    Notes
    -----
    What is None is neither computed nor compiled.  Where the least Delta is farther from zero than the error bound of
    :func:`least_delta`, the verdict is that of exact arithmetic on the given doubles.
    """
    at = new_block()
    for start in range(0, designs.shape[0], BLOCK):
        count = min(BLOCK, designs.shape[0] - start)
        load_block(designs, start, count, at)
        least_delta(count, at)
        # Parts of the outputs, of which the index is that of the loop alone: else each number is written by itself.
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
