"""Slider-cranks (RSSP) from stroke and crank angle between the limits; equations (9)-(13) of docs/synthesis.md.

Position 1 is extended, position 2 folded, s2 = s1 + stroke with its sign.  In the plane (s1 cos alpha, e) the locus is
a circle; with the crank angle phi1 as its parameter e, s1, s2 and the two distances from the crank axis are products.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np

from kernels.arithmetic.complex_step import divisor
from kernels.arithmetic.sincos import sine_cosine
from kernels.jit import inline, kernel
from kernels.linkage.outputs import write_number
from kernels.synthesis.acceptance import design_status, first_failure
from kernels.types import EPS, TWO_PI, Array, Status


class Given(NamedTuple):
    """Numbers of a slider-crank that are prescribed or chosen beforehand."""

    stroke: Any  # [length] signed from extended to folded
    e: Any
    f: Any
    alpha: Any
    sa: Any  # sin alpha
    ca: Any
    valid: bool


class Limits(NamedTuple):
    """The two limit positions found; v = sin phi."""

    s1: Any
    s2: Any
    middle: Any  # (s1 + s2)/2
    ahead: Any  # distance of the slider ball from the crank axis, extended
    back: Any  # and folded, negative where the crank points away
    v1: Any
    v2: Any
    point: bool  # whether they are defined


@inline
def _finish(g: Given, at: Limits, i: int, status: Status, failed: Status, designs: Array) -> None:
    """Compute the crank and coupler of (11), (12), the tests (i)-(iii), and the row of the design."""
    stroke, e, f, alpha, sa, ca, valid = g
    s1, s2, middle, ahead, back, v1, v2, point = at
    branch = -1.0 if stroke.real > 0.0 else 1.0
    a = stroke * (f * sa - middle) / divisor(ahead - back)
    radial, axial = ahead - a, s1 * sa - f
    b = np.sqrt(radial * radial + axial * axial)
    t1, t2 = s1 - (f * sa + a * ca * v1), s2 - (f * sa + a * ca * v2)
    finite = point and 0.0 < b.real < math.inf
    test = first_failure(finite, ahead.real, back.real, a.real, t1.real, t2.real, branch)
    failed[i] = test
    status[i] = design_status(valid, test)
    good = valid and test == 0
    designs[i, 0] = a if good else math.nan
    designs[i, 1] = b if good else math.nan
    designs[i, 2] = e if good else math.nan
    designs[i, 3], designs[i, 4], designs[i, 5] = f, alpha, branch


@inline
def _valid(stroke: float, place: float, f: float, alpha: float) -> bool:
    size = max(abs(place.real), abs(f.real))
    return 0.0 < abs(stroke.real) < 1e150 and size < 1e150 and abs(alpha.real) < 1e5


@kernel
def rssp_on_locus(requirements: Array, status: Status, failed: Status, designs: Array, s1: Array | None) -> None:
    """Compute slider-cranks at given crank angles of the extended position.

    Equations (9)-(12) of docs/synthesis.md.  A central mechanism, phi0 = pi, needs :func:`rssp_at_place`.

    Parameters
    ----------
    requirements : (n, 5) stroke [length] signed from extended to folded, phi0, phi1 [rad], f [length], alpha [rad]
    status : (n,) out; OK, NOT_ADMISSIBLE (``failed`` says why) or INVALID_INPUT
    failed : (n,) out, number of the first acceptance test failed, see :mod:`kernels.synthesis.acceptance`
    designs : (n, 6) out, columns a, b, e, f, alpha, branch; lengths found nan where the status is not OK
    s1 : (n,) out [length], slider at the extended position, or None

    Notes
    -----
    Requirements may be complex128, with designs and s1 of that type: exact gradients by the complex step.
    """
    for i in range(requirements.shape[0]):
        stroke, phi0, phi1 = requirements[i, 0], requirements[i, 1], requirements[i, 2]
        f, alpha = requirements[i, 3], requirements[i, 4]
        s0, c0 = sine_cosine(phi0)
        v1, u1 = sine_cosine(phi1)
        sa, ca = sine_cosine(alpha)
        u2, v2 = u1 * c0 - v1 * s0, v1 * c0 + u1 * s0
        per = stroke / s0
        e, start, end = per * ca * u1 * u2, per * v1 * u2, per * v2 * u1
        middle = 0.5 * per * (v1 * u2 + v2 * u1)
        valid = _valid(stroke, phi1, f, alpha) and abs(phi1.real) < 1e5 and 0.0 < phi0.real < TWO_PI
        point = min(abs(s0.real), abs(ca.real)) > 4.0 * EPS
        at = Limits(start, end, middle, per * ca * u2, per * ca * u1, v1, v2, point)
        _finish(Given(stroke, e, f, alpha, sa, ca, valid), at, i, status, failed, designs)
        write_number(s1, i, start if status[i] == 0 else math.nan)


@inline
def _between(
    g: Given, s1: float, s2: float, middle: float, side: float, point: bool,
    i: int, status: Status, failed: Status, designs: Array,
) -> float:  # fmt: skip
    """Compute a slider-crank from its two limits; return the crank angle phi1.  ``side`` < 0 if phi0 is met."""
    e, ca = g.e, g.ca
    y1, y2 = s1 * ca, s2 * ca
    rho1, rho2 = math.sqrt(e * e + y1 * y1), math.sqrt(e * e + y2 * y2)
    back = -rho2 if side < 0.0 else rho2
    point = point and min(rho1, rho2) > 4.0 * EPS * max(abs(s1), abs(s2))
    _finish(g, Limits(s1, s2, middle, rho1, back, y1 / rho1, -y2 / rho2, point), i, status, failed, designs)
    return math.atan2(y1, e) if status[i] == 0 else math.nan


@kernel
def rssp_at_offset(
    requirements: Array, root: Array, status: Status, failed: Status, designs: Array, s1: Array | None,
    phi1: Array | None,
) -> None:  # fmt: skip
    """Compute slider-cranks at given offsets e of the slide line: a quadratic equation for the slider's place.

    Equations (11)-(13) of docs/synthesis.md.

    Parameters
    ----------
    requirements : (n, 5) stroke [length], phi0 [rad], e, f [length], alpha [rad]
    root : (n,) +1 or -1: sign of the middle (s1 + s2)/2 of the stroke
    status, failed, designs, s1 : as :func:`rssp_on_locus`
    phi1 : (n,) out [rad], crank angle of the extended position in (-pi, pi], or None
    """
    for i in range(requirements.shape[0]):
        stroke, phi0, e = requirements[i, 0], requirements[i, 1], requirements[i, 2]
        f, alpha = requirements[i, 3], requirements[i, 4]
        s0, c0 = sine_cosine(phi0)
        sa, ca = sine_cosine(alpha)
        sh, ch = sine_cosine(0.5 * phi0)
        lift, cot = e / ca, stroke * c0 / s0
        inner = (0.5 * stroke * (ch / sh) - lift) * (0.5 * stroke * (sh / ch) + lift)
        middle = root[i] * math.sqrt(max(inner, 0.0))
        # The end away from the foot is a sum without cancellation, the other one comes from the product s1 s2.
        product = -lift * (lift - cot)
        if stroke * middle > 0.0:
            end = middle + 0.5 * stroke
            start = product / end
        else:
            start = middle - 0.5 * stroke
            end = product / start
        valid = _valid(stroke, e, f, alpha) and 0.0 < phi0 < TWO_PI and root[i] * root[i] == 1.0
        point = inner >= 0.0 and abs(s0) > 4.0 * EPS
        side = (e * e + (ca * start) * (ca * end)) * c0 + e * ca * stroke * s0
        g = Given(stroke, e, f, alpha, sa, ca, valid)
        place = _between(g, start, end, middle, side, point, i, status, failed, designs)
        write_number(s1, i, start if status[i] == 0 else math.nan)
        write_number(phi1, i, place)


@kernel
def rssp_at_place(
    requirements: Array, status: Status, failed: Status, designs: Array, phi0: Array | None, phi1: Array | None
) -> None:
    """Compute slider-cranks whose stroke begins at a given place; phi0 is a result.  Those with e = 0 are central.

    Equations (11), (12) and (14) of docs/synthesis.md.

    Parameters
    ----------
    requirements : (n, 5) stroke, s1, e, f [length], alpha [rad]; s1 is the slider at the extended position
    status, failed, designs, phi1 : as :func:`rssp_at_offset`
    phi0 : (n,) out [rad], crank angle from the extended to the folded position, or None
    """
    for i in range(requirements.shape[0]):
        stroke, s1, e = requirements[i, 0], requirements[i, 1], requirements[i, 2]
        f, alpha = requirements[i, 3], requirements[i, 4]
        sa, ca = sine_cosine(alpha)
        s2 = s1 + stroke
        valid = _valid(stroke, e, f, alpha) and abs(s1) < 1e150
        g = Given(stroke, e, f, alpha, sa, ca, valid)
        place = _between(g, s1, s2, s1 + 0.5 * stroke, -1.0, True, i, status, failed, designs)
        if phi0 is not None:
            turn = math.atan2(e * ca * stroke, e * e + (s1 * ca) * (s2 * ca))
            phi0[i] = math.pi + turn if status[i] == 0 else math.nan
        write_number(phi1, i, place)
