"""Rotatability of the slider-crank, its margin, and its limit positions.

Margin and largest pressure angle come from one exact minimum.  In a limit position crank and coupler are in line,
stretched (extended) or overlapping (folded).

Q(phi) = (b - m)(b + m) - n^2 is a trigonometric polynomial of degree 2 without a sin 2 phi term and Q/b^2 =
cos^2(pressure angle), so its minimum answers all three; equation (4) of docs/rssp.md.

At a limit the slider ball lies in the plane of crank axis and crank, so its distance from the crank pin is the smallest
or the largest that the crank circle allows; equations (7)-(10) of docs/rssp.md:

    E_ext(s)  = (rho - a)^2 + (s sin al - f)^2 - b^2 = 0,     E_fold(s) = (rho + a)^2 + (s sin al - f)^2 - b^2 = 0,

rho = hypot(e, s cos al).  E_fold is convex, so Newton's method from outside falls onto its two roots, one per branch.
Where the crank turns fully E_ext has exactly one root beyond each of them, and it is bracketed by the folded position
and the reach a + b about the crank centre.  The slope of both is 2 (s - y_B): a limit is known as well as the pressure
angle there allows.
"""

from __future__ import annotations

import math
from collections import namedtuple

from kernels import status as st
from kernels.curves.polynomials import minimum
from kernels.families.rssp.motion import reduce_design
from kernels.jit import inline, kernel
from kernels.linkage.slider_closure import Reduced, place
from kernels.linkage.verdict import turning_status
from kernels.types import EPS, TWO_PI, Array, Status

# Smallest Q of the turn in squared units of the reduced design, its place, and the bound of its rounding error.
# ``across``: distance of the coupler's ends across the slide line.
LeastQ = namedtuple("LeastQ", "q cos sin across tolerance")


@inline
def least_q(r: Reduced) -> LeastQ:
    """Find the smallest Q of the turn; ``tolerance`` bounds its rounding error (docs/rssp.md, on rotatability)."""
    lowest = minimum(2.0 * r.a * r.e, 2.0 * r.n0 * r.na, -0.5 * r.ka * r.ka, 0.0)
    u, v = lowest.cos, lowest.sin
    # The coefficients only place the minimum; its value comes from m and n, and the slope there corrects for the
    # rounding of the place.
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
    margin: Array,
    rotatable: Array,
    max_pressure_angle: Array,
) -> None:
    """Compute rotatability, margin and largest pressure angle of every design, exact.

    Parameters
    ----------
    designs : (n, 6) columns as `PARAMETERS` of sweep/families/rssp.py
    status : (n,) out; OK, NOT_ROTATABLE, UNDECIDABLE (the least Q is zero within rounding) or INVALID_INPUT
    margin : (n,) out, least Q/b^2 = least cos^2(pressure angle) over the turn; negative if the crank does not turn
    rotatable : (n,) out, 1 or 0; nan where undecidable
    max_pressure_angle : (n,) out [rad]; nan unless rotatable
    """
    for i in range(designs.shape[0]):
        r = reduce_design(designs, i)
        least = least_q(r)
        code = turning_status(least.q, least.tolerance, r.valid)
        status[i] = code
        known = code != st.INVALID_INPUT
        margin[i] = least.q / (r.b * r.b) if known else math.nan
        rotatable[i] = (1.0 if least.q > 0.0 else 0.0) if known and code != st.UNDECIDABLE else math.nan
        # atan2, not acos: acos loses half the digits near zero.
        max_pressure_angle[i] = math.atan2(least.across, math.sqrt(least.q)) if code == st.OK else math.nan


_MOST_STEPS = 200


@inline
def _excess(r: Reduced, crank: float, ca: float, sa: float, f: float, s: float) -> tuple[float, float, float]:
    """Evaluate E(s), dE/ds and rho for a crank pointing away from the ball (``crank`` = -a) or towards it (+a)."""
    x, z = s * ca, s * sa - f
    rho = math.sqrt(r.e * r.e + x * x)
    reach = rho - crank
    value = (reach - r.b) * (reach + r.b) + z * z
    slope = 2.0 * (z * sa + (reach * ca * (x / rho) if rho > 0.0 else 0.0))
    return value, slope, rho


@inline
def _folded(r: Reduced, ca: float, sa: float, f: float) -> tuple[float, bool]:
    """Find the outer root of the convex E_fold on the side of the branch, by Newton's method from outside."""
    # A product instead of b^2 - (f cos alpha)^2, which would cancel where the two are nearly equal.
    far = (r.b - f * ca) * (r.b + f * ca)
    s = f * sa + r.branch * math.sqrt(max(far, 0.0))
    for _ in range(_MOST_STEPS):
        value, slope, _ = _excess(r, -r.a, ca, sa, f, s)
        # From outside a convex function's Newton steps never pass the root: where one does, rounding is reached.
        if value <= 0.0 or slope * r.branch <= 0.0:
            return s, True
        following = s - value / slope
        if (following - s) * r.branch >= 0.0 or abs(following - s) <= EPS * abs(s):
            return following, True
        s = following
    return s, False


@inline
def _extended(r: Reduced, ca: float, sa: float, f: float, folded: float) -> tuple[float, bool]:
    """Find the root of E_ext between the folded position and the reach a + b, by Newton's method in the bracket."""
    inner, reach = folded, r.a + r.b
    outer = f * sa + r.branch * math.sqrt(max((reach - f * ca) * (reach + f * ca) - r.e * r.e, 0.0))
    s = outer
    before = math.inf
    for _ in range(_MOST_STEPS):
        value, slope, _ = _excess(r, r.a, ca, sa, f, s)
        if value == 0.0:
            return s, True
        if value > 0.0:
            outer = s
        else:
            inner = s
        following = s - value / slope if slope != 0.0 else math.nan
        inside = (following - inner) * r.branch > 0.0 and (outer - following) * r.branch > 0.0
        if abs(following - s) <= 2.0 * EPS * abs(s):
            return following if inside else s, True
        # Bisect where a step leaves the bracket or does not halve the one before.
        if not inside or abs(following - s) > 0.5 * before:
            following = 0.5 * (inner + outer)
            if following in (inner, outer):
                return s, True
        before = abs(following - s)
        s = following
    return s, False


@inline
def _turn(angle: float) -> float:
    """Angle of an arctangent in [0, 2 pi)."""
    return angle + TWO_PI if angle < 0.0 else angle


@kernel
def limits(designs: Array, status: Status, out: Array) -> None:
    """Compute both limit positions of every design on its branch.

    Equations (7)-(10) of docs/rssp.md.

    Parameters
    ----------
    designs : (n, 6) columns as `PARAMETERS` of sweep/families/rssp.py
    status : (n,) out; OK, NOT_ROTATABLE, UNDECIDABLE, NOT_OSCILLATING (the slider stands still: e = 0, alpha = 90 deg),
        SINGULAR (the slider ball reaches the crank axis), NOT_CONVERGED or INVALID_INPUT
    out : (9, n) out; s_ext, s_fold [length], slider at the extended and the folded position; phi_ext, phi_fold [rad],
        crank angles in [0, 2 pi); phi0 [rad], crank angle from the extended to the folded position, in [0, 2 pi);
        stroke_ratio phi0/(2 pi - phi0); stroke [length], s_fold - s_ext with its sign, -branch, by the half-stroke
        identity (10), which keeps full relative accuracy for tiny cranks; bounds of the rounding errors of s_ext and
        s_fold [length]

    Notes
    -----
    Where the status is not OK all are nan.
    """
    for i in range(designs.shape[0]):
        r = reduce_design(designs, i)
        least = least_q(r)
        code = turning_status(least.q, least.tolerance, r.valid)
        far, near = math.nan, math.nan
        rho_ext, rho_fold, slope_ext, slope_fold = math.nan, math.nan, math.nan, math.nan
        sa, ca, f = math.sin(designs[i, 4]), math.cos(designs[i, 4]), designs[i, 3] / r.unit
        if code == st.OK:
            near, settled = _folded(r, ca, sa, f)
            far, settled2 = _extended(r, ca, sa, f, near)
            _, slope_ext, rho_ext = _excess(r, r.a, ca, sa, f, far)
            _, slope_fold, rho_fold = _excess(r, -r.a, ca, sa, f, near)
            if not (settled and settled2):
                code = st.NOT_CONVERGED
            elif r.e == 0.0 and ca == 0.0:
                code = st.NOT_OSCILLATING
            elif rho_ext == 0.0 or rho_fold == 0.0:
                code = st.SINGULAR
        status[i] = code
        if code != st.OK:
            far, near = math.nan, math.nan
        out[0, i], out[1, i] = far * r.unit, near * r.unit
        # The ball's direction from the crank axis; at the folded position the crank points the other way.
        towards, away = math.atan2(far * ca, r.e), math.atan2(-near * ca, -r.e)
        out[2, i], out[3, i] = _turn(towards), _turn(away)
        # The stroke by the half-stroke identity: the difference far - near would lose the digits of a small stroke.
        step = -2.0 * r.a * (rho_ext + rho_fold) / (far + near - 2.0 * f * sa)
        out[6, i] = step * r.unit
        # phi0 - pi as one arctangent: small for nearly central mechanisms, without a difference of angles.
        beyond = math.atan2(r.e * ca * step, r.e * r.e + (far * ca) * (near * ca))
        out[4, i] = math.pi + beyond
        out[5, i] = (math.pi + beyond) / (math.pi - beyond)
        size = 8.0 * EPS * r.unit
        reach = (r.m_size + r.b) * (r.m_size + r.b) + r.n_size * r.n_size
        out[7, i] = size * (reach / abs(slope_ext) + abs(far))
        out[8, i] = size * (reach / abs(slope_fold) + abs(near))
