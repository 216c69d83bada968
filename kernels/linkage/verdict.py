"""Statuses of every family: of a pose by its discriminant, of a turn by the least discriminant."""

from __future__ import annotations

from kernels import status as st
from kernels.jit import inline


@inline
def pose_status(valid: bool, discriminant: float, tolerance: float, square: float | None) -> int:
    """Decide whether the links reach at a pose: OK, NOT_ASSEMBLED, DEAD_POINT, SINGULAR or INVALID_INPUT.

    Parameters
    ----------
    valid : whether the parameters of the design are valid
    discriminant : its real part; the links reach where it is positive
    tolerance : bound of its rounding error
    square : squared distance of the crank pin from the axis of the follower, in the unit of the discriminant.  A pin on
        that axis leaves a rocker free to take every angle, which is SINGULAR; a slider has no such axis, so it is None
    """
    code = st.OK
    # A comparison with nan is false, so nan would pass every other test.
    if not valid or discriminant != discriminant:
        code = st.INVALID_INPUT
    elif discriminant < -tolerance:
        code = st.NOT_ASSEMBLED
    elif discriminant <= tolerance:
        code = st.DEAD_POINT
        if square is not None and not square > tolerance:
            code = st.SINGULAR
    return code


@inline
def follower_status(valid: bool, undefined: bool, discriminant: float, tolerance: float) -> int:
    """Decide as :func:`pose_status` does, for a follower that may have no direction whatever the discriminant is.

    ``undefined`` says so: a pin stands on the axis of the slotted link that it drives, or a side of the triangle of
    links has no length.  Such a pose is SINGULAR.
    """
    code = pose_status(valid, discriminant, tolerance, None)
    return st.SINGULAR if valid and undefined else code


@inline
def turning_status(least: float, tolerance: float, valid: bool) -> int:
    """Decide whether the crank turns fully: OK, NOT_ROTATABLE, UNDECIDABLE or INVALID_INPUT.

    ``least`` is the smallest discriminant of the turn and ``tolerance`` the bound of its rounding error.
    """
    # Without a branch: loops over the designs of a block vectorise only so.
    code = st.OK if least > tolerance else st.UNDECIDABLE
    code = st.NOT_ROTATABLE if least < -tolerance else code
    return code if valid & (least == least) else st.INVALID_INPUT
