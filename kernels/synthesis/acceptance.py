"""Acceptance tests of a synthesised mechanism, and ends of the admissible arcs of its locus.

The acceptance tests are made in the order of docs/synthesis.md, section 3; the arcs end at crank angles phi1 at which
the side condition changes.
"""

from __future__ import annotations

import math

from kernels import status as st
from kernels.arithmetic.sincos import sine_cosine
from kernels.jit import inline, kernel
from kernels.types import TWO_PI, Array

PASSED = 0
NO_POINT = 1
SIDE = 2
CRANK = 3
BRANCH = 4
ROTATION = 5
PRESSURE = 6

NAMES = ("", "point", "side", "crank", "branch", "rotation", "pressure angle")
MEANING: dict[int, str] = {
    PASSED: "",
    NO_POINT: "the locus has no point here: at infinity, no real root, or the rocker would be negative",
    SIDE: "(i) side condition: the crank would turn phi0 + 180 deg, or the limits change places",
    CRANK: "(ii) the crank length is not positive: the first limit is the folded one",
    BRANCH: "(iii) branch defect: the limits lie on different assembly modes, or the follower goes the other way",
    ROTATION: "(iv) the crank does not turn fully between the two limit positions",
    PRESSURE: "(v) the pressure angle exceeds its limit",
}


@inline
def first_failure(point: bool, ahead: float, back: float, a: float, t_ext: float, t_fold: float, branch: float) -> int:
    """Find the first of the tests (i)-(iii) that is failed, or return PASSED.

    Parameters
    ----------
    point : whether there is a point of the locus
    ahead, back : projection of the driven joint on the crank's direction at the extended and at the folded position
    a : crank
    t_ext, t_fold : dF/d(follower) at both limits, any positive factor
    branch : the assembly mode that the direction of the stroke demands
    """
    if not point:
        return NO_POINT
    if not (ahead > 0.0 and back < 0.0):
        return SIDE
    if not a > 0.0:
        return CRANK
    if not (t_ext * branch > 0.0 and t_fold * branch > 0.0):
        return BRANCH
    return PASSED


@inline
def design_status(valid: bool, failed: int) -> int:
    """Status of a design after the tests (i)-(iii)."""
    if not valid:
        return st.INVALID_INPUT
    return st.OK if failed == PASSED else st.NOT_ADMISSIBLE


@kernel
def rssr_arc_ends(requirements: Array, ends: Array) -> None:
    """Compute crank angles phi1 at which the rocker ball would lie on the crank axis or at infinity.

    Equation (4) of docs/synthesis.md: the zeros of rho1, rho2 and of the determinant.

    Parameters
    ----------
    requirements : (n, 7) columns of :func:`kernels.synthesis.rssr_on_locus`; phi1 and f are not used
    ends : (n, 8) out [rad] in [0, 2 pi), ascending; nan last, where there are fewer
    """
    for i in range(requirements.shape[0]):
        phi0, e, g = requirements[i, 1], requirements[i, 3], requirements[i, 5]
        sh, ch = sine_cosine(0.5 * requirements[i, 0])
        s0, c0 = sine_cosine(phi0)
        sa, ca = sine_cosine(requirements[i, 6])
        h, ss, q = g * sa, 2.0 * sh * ch, 2.0 * sh * sh
        first = math.atan2(ca * (h * q + e * ca * ss), h * ss - e * ca * q) - phi0
        second = math.atan2(-ca * (h * q - e * ca * ss), h * ss + e * ca * q)
        # det = 0: cos(2 phi1 + phi0) = level/size
        size, level = ss * (sa * sa), (1.0 + ca * ca) * c0 * ss - 2.0 * ca * (1.0 - q) * s0
        inner = (size - level) * (size + level)
        infinite = math.nan
        if inner >= 0.0 and size != 0.0:
            infinite = math.atan2(math.sqrt(inner), math.copysign(level, level * size))
        ends[i, 0], ends[i, 1] = first, first + math.pi
        ends[i, 2], ends[i, 3] = second, second + math.pi
        ends[i, 4], ends[i, 5] = 0.5 * (infinite - phi0), 0.5 * (infinite - phi0) + math.pi
        ends[i, 6], ends[i, 7] = 0.5 * (-infinite - phi0), 0.5 * (-infinite - phi0) + math.pi
        ends[i] %= TWO_PI
        ends[i].sort()


@kernel
def rssp_arc_ends(requirements: Array, ends: Array) -> None:
    """Compute crank angles phi1 at which the slider ball would lie on the crank axis; (10) of docs/synthesis.md.

    Parameters
    ----------
    requirements : (n, 5) columns of :func:`kernels.synthesis.rssp_on_locus`; phi1, f and alpha are not used
    ends : (n, 4) out [rad] in [0, 2 pi), ascending
    """
    for i in range(requirements.shape[0]):
        second = 0.5 * math.pi - requirements[i, 1]
        ends[i, 0], ends[i, 1] = 0.5 * math.pi, 1.5 * math.pi
        ends[i, 2], ends[i, 3] = second % TWO_PI, (second + math.pi) % TWO_PI
        ends[i].sort()
