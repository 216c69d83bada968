"""Geared dwell drive with any whole gear ratio, external or internal, and a slotted output link.

The pin's path is a sum of two turning vectors and the offset, so its derivatives are known to every order; those of the
output angle follow from the quotients of them.  Designs may be complex128 (exact gradients by the complex step);
decisions look at the real part.
"""

from __future__ import annotations

import math
from collections import namedtuple
from typing import Any

import numpy as np

from kernels import status as st
from kernels.arithmetic.complex_step import arctan2
from kernels.curves.root_search import bisected
from kernels.jit import inline, kernel
from kernels.linkage.outputs import write
from kernels.types import EPS, Array, Numbers, Status

MOST_TEETH = 64  # largest gear ratio; the pin then turns as often per turn of the carrier


@inline
def power(u: Any, v: Any, times: int) -> tuple[Any, Any]:
    """Cosine and sine of ``times`` the angle, by products: each adds a rounding or two."""
    c, s = 1.0 + 0.0 * u, 0.0 * v
    while times > 0:
        if times % 2 == 1:
            c, s = c * u - s * v, c * v + s * u
        u, v = (u - v) * (u + v), 2.0 * u * v
        times //= 2
    return c, s


# Pose outputs, each (n, m), or None, which is not computed.
Outputs = namedtuple("Outputs", "psi dpsi d2psi d3psi sin_psi cos_psi x_b y_b")


@kernel
def poses(designs: Numbers, cos_phi: Numbers, sin_phi: Numbers, status: Status, out: Outputs) -> None:
    """Compute the output angle, its derivatives and the pin of every design at its carrier angles; (1)-(4).

    Parameters
    ----------
    designs : (n, 4) columns as `EPICYCLIC_PARAMETERS` of sweep/families/geared_dwell.py
    cos_phi, sin_phi : (n, m), or (1, m) shared by all designs
    status : (n, m) out; OK, SINGULAR (the pin is on the output axis within its rounding) or INVALID_INPUT
    psi ... y_b : (n, m) out, or None: then it is neither computed nor compiled

    Notes
    -----
    Where the status is not OK the values are nan.  The angle is in (-pi, pi].
    """
    for i in range(designs.shape[0]):
        k, a, n, mesh = designs[i, 0], designs[i, 1], designs[i, 2].real, designs[i, 3].real
        arm = n + mesh
        valid = 0.0 < k.real < 1e30 and abs(a.real) < 1e30 and mesh * mesh == 1.0
        valid = valid and arm >= 1.0 and n <= MOST_TEETH and n == math.floor(n)
        times = 1
        if valid:
            times = int(arm)
        row = i if cos_phi.shape[0] > 1 else 0
        for j in range(cos_phi.shape[1]):
            u, v = cos_phi[row, j], sin_phi[row, j]
            c, s = power(u, v, times)
            # the pin's own turning vector: backwards in a ring
            pc, ps = -mesh * k * c, -k * s
            x, y = arm * u + pc + a, arm * v + ps
            square = x * x + y * y
            size = arm + abs(k.real) + abs(a.real)
            code = st.OK
            if not valid or square.real != square.real:
                code = st.INVALID_INPUT
            # within its rounding error: the direction of the pin is then arbitrary
            elif square.real <= (8.0 * EPS * arm * size) ** 2:
                code = st.SINGULAR
            status[i, j] = code
            if code != st.OK:
                x, y, square = math.nan * x, math.nan * y, math.nan * square
            write(out.x_b, i, j, x)
            write(out.y_b, i, j, y)
            write(out.psi, i, j, arctan2(y, x))
            if out.sin_psi is not None or out.cos_psi is not None:
                distance = np.sqrt(square)
                write(out.sin_psi, i, j, y / distance)
                write(out.cos_psi, i, j, x / distance)
            if out.dpsi is not None or out.d2psi is not None or out.d3psi is not None:
                # z' = i (L e^{i phi} + m L p), m = mesh: the pin's vector turns with m L
                _put_derivatives(out, i, j, (x, y, square), (arm * u, arm * v), (pc, ps), mesh * arm)


@inline
def _put_derivatives(
    out: Outputs,
    i: int,
    j: int,
    pin: tuple[Any, Any, Any],
    carrier: tuple[Any, Any],
    turning: tuple[Any, Any],
    f: float,
) -> None:
    """Write the wanted derivatives of the output angle, (3).

    ``pin`` is the pin from the output axis with the square of its distance, ``carrier`` the planet's centre from the
    carrier's axis, ``turning`` the pin from that centre, which turns ``f`` times as fast.
    """
    x, y, square = pin
    au, av = carrier
    pc, ps = turning
    # z^(k) / z = r_k + i t_k; the imaginary part of the logarithm's derivatives is that of the angle
    per = 1.0 / square
    x1, y1 = -av - f * ps, au + f * pc
    r1, t1 = (x * x1 + y * y1) * per, (x * y1 - y * x1) * per
    write(out.dpsi, i, j, t1)
    if out.d2psi is not None or out.d3psi is not None:
        x2, y2 = -au - f * f * pc, -av - f * f * ps
        r2, t2 = (x * x2 + y * y2) * per, (x * y2 - y * x2) * per
        write(out.d2psi, i, j, t2 - 2.0 * r1 * t1)
        if out.d3psi is not None:
            x3, y3 = av + f * f * f * ps, -au - f * f * f * pc
            t3 = (x * y3 - y * x3) * per
            write(out.d3psi, i, j, t3 - 3.0 * (r2 * t1 + t2 * r1) + 2.0 * (3.0 * r1 * r1 - t1 * t1) * t1)


STEPS = 64  # per turn of the pin in the search for the end of the band


@inline
def _output(k: float, front: float, arm: float, mesh: float, phi: float) -> tuple[float, float, float]:
    """Output angle, its velocity analogue times the pin's squared distance from the output axis, and the pin's y.

    ``front`` is the pin's x at phi = 0.  No terms cancel for k next to 1 and small angles: L - sin(L phi)/sin(phi) is a
    sum of squares.
    """
    lag = 0.0
    for j in range(int(arm) // 2):
        lag += 4.0 * math.sin((0.5 * (arm - 1.0) - j) * phi) ** 2
    y = math.sin(phi) * lag - (k - 1.0) * math.sin(arm * phi)
    x = front + 2.0 * (mesh * k * math.sin(0.5 * arm * phi) ** 2 - arm * math.sin(0.5 * phi) ** 2)
    x1 = arm * (mesh * k * math.sin(arm * phi) - math.sin(phi))
    closing = 2.0 * math.sin(0.5 * (arm + 1.0) * phi) * math.sin(0.5 * (arm - 1.0) * phi)
    y1 = arm * (closing - (k - 1.0) * math.cos(arm * phi))
    return math.atan2(y, x), x * y1 - y * x1, y


@inline
def _below(phi: float, level: float, which: int, k: float, front: float, arm: float, mesh: float) -> bool:
    """Whether a number of :func:`_output` is below a level."""
    return _output(k, front, arm, mesh, phi)[which] < level


@kernel
def dwell_measures(designs: Array, status: Status, dwell_angle: Array, deviation: Array, band: Array) -> None:
    """Compute the dwell, the largest deviation from mid-dwell and the band dwell around phi = 0.

    Parameters
    ----------
    designs : (n, 4) columns as `EPICYCLIC_PARAMETERS` of sweep/families/geared_dwell.py
    status : (n,) out; OK, NO_DWELL (the pin starts at or behind the output axis, or passes behind it within the dwell,
        or the angle does not leave the band before phi = pi) or INVALID_INPUT
    dwell_angle, deviation, band : (n,) out [rad]

    Notes
    -----
    For k <= 1 the output does not turn back at phi = 0, and the three are 0.  Every root is bracketed and bisected.
    """
    for i in range(designs.shape[0]):
        k, a, n, mesh = designs[i, 0], designs[i, 1], designs[i, 2], designs[i, 3]
        arm = n + mesh
        valid = 0.0 < k < 1e30 and abs(a) < 1e30 and mesh * mesh == 1.0
        valid = valid and arm >= 1.0 and n <= MOST_TEETH and n == math.floor(n)
        code = st.OK if valid else st.INVALID_INPUT
        rough = a - mesh * k
        back = rough - a
        # with the rounding error of a - mesh k
        front = (rough + arm) + ((a - (rough - back)) - (mesh * k + back))
        if valid and not front > 0.0:
            code = st.NO_DWELL
        none = 0.0 if code == st.OK else math.nan
        dwell_angle[i], deviation[i], band[i] = none, none, none
        if code == st.OK and k > 1.0 and arm > 1.0:
            # L sin(phi)/sin(L phi) rises from 1 to infinity: one root of y
            low, high = bisected(_below, 0.0, math.pi / arm, 0.0, 2, k, front, arm, mesh)
            returned = 0.5 * (low + high)
            low, high = bisected(_below, 0.0, returned, 0.0, 1, k, front, arm, mesh)
            most = -_output(k, front, arm, mesh, 0.5 * (low + high))[0]
            step = 2.0 * math.pi / (arm * STEPS)
            low = returned
            while low + step < math.pi and _output(k, front, arm, mesh, low + step)[0] < most:
                low += step
            high = low + step
            if not 0.0 < most < 0.5 * math.pi or high > math.pi:
                code = st.NO_DWELL
                dwell_angle[i], deviation[i], band[i] = math.nan, math.nan, math.nan
            else:
                low, high = bisected(_below, low, high, most, 0, k, front, arm, mesh)
                dwell_angle[i], deviation[i], band[i] = 2.0 * returned, most, low + high
        status[i] = code
