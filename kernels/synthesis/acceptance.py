"""The acceptance tests of a synthesised mechanism, in the order in which they are made; docs/synthesis.md, section 3.

The locus equation knows tan(phi0) only and its square roots are taken without asking for the assembly mode, so a point
of the locus may belong to a mechanism that does something else: tests 1 to 5 find out.
"""

from __future__ import annotations

from kernels import status as st
from kernels.jit import inline

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
    """Return the number of the first of the tests (i)-(iii) that is failed, or PASSED.

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
