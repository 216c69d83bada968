"""T1, T2, W1, U1: a thread over a moving eyelet, its tension behind it, with its speed, and by Euler's law.

The law is that of the source with its misprints corrected; the equation numbers are those of docs/thread.md.  The
two-term law of friction

    dT/dtheta = beta (T + B/(R + r)^2) + alpha R,      r = 1/sqrt(pi gamma N)                                (1), (2)

integrates to T2 = T1 e^x + (B/(R + r)^2) (e^x - 1) + alpha R theta (e^x - 1)/x with x = beta theta.          (3)
With expm1 all limits are regular: beta = 0, R = 0, alpha = B = 0 (Euler).  All terms are positive: nothing cancels.
The unit of angle is that of beta and alpha, whichever it is.

Its limit alpha = B = 0 is Euler's law, (5), (6).  The tension depends on the speed of the thread by (7), (8).

The thread runs from guide N1 over E to guide N2; its wrap angle, length L = |E - N1| + |E - N2| and the derivatives of
the length hold for an eyelet on any link.
"""

from __future__ import annotations

import math

from kernels import status as st
from kernels.arithmetic.vectors import Vector, cross, dot, norm, sub
from kernels.jit import inline, kernel
from kernels.linkage.outputs import write
from kernels.linkage.thread_path import bend, length, slope, wrap_angle
from kernels.types import Array, Status

# Columns of the data matrix: radius R, adhesion alpha, friction beta, bending B, metric count N, density gamma.
CONTOUR_COLUMNS = ("R", "alpha", "beta", "B", "N", "gamma")
# Columns of the data matrix: reference speed v_ref, share K, exponent n.
SPEED_COLUMNS = ("v_ref", "K", "n")


@inline
def thread_radius(count: float, density: float) -> float:
    """Radius of a round thread of metric count N [m/g] and density gamma [g/cm^3], in mm; (2)."""
    return 1.0 / math.sqrt(math.pi * density * count)


@inline
def growth(x: float) -> float:
    """Return (e^x - 1)/x, 1 at x = 0; relative error of some roundings for every x."""
    # expm1: e^x - 1 as it stands has no correct digit left where x is a rounding error of 1
    return math.expm1(x) / x if x != 0.0 else 1.0


@kernel
def thread_contour(
    before: Array,
    theta: Array,
    data: Array,
    status: Status,
    tension: Array | None,
    capstan: Array | None,
    bending: Array | None,
    adhesion: Array | None,
    radius: Array | None,
) -> None:
    """Compute the tension behind a contour and its three parts; equations (1) to (3) of docs/thread.md.

    Parameters
    ----------
    before : (n, m), tension T1 in front of the contour [force]
    theta : (n, m), wrap angle, in the unit of angle that beta and alpha are given in
    data : (n, 6), see CONTOUR_COLUMNS; R and r in one unit of length
    status : (n, m), in and out; INVALID_INPUT where a number is negative or not finite, N gamma = 0, or the result is
        beyond float64: these give nan
    tension, capstan, bending, adhesion : (n, m) or None; T2 and its parts T1 e^x, of B, of alpha
    radius : (n, m) or None; thread radius r

    Notes
    -----
    Measured on the oracle table: relative error below 8 * 2^-53.
    """
    for i in range(before.shape[0]):
        r, alpha, beta, stiff = data[i, 0], data[i, 1], data[i, 2], data[i, 3]
        # written so that a nan fails every comparison
        valid = r >= 0.0 and alpha >= 0.0 and beta >= 0.0 and stiff >= 0.0 and data[i, 4] > 0.0 and data[i, 5] > 0.0
        thick = thread_radius(data[i, 4], data[i, 5]) if valid else math.nan
        curvature = 1.0 / (r + thick)
        # one factor after the other: the square of a large curvature may overflow where the product does not
        pressed = stiff * curvature * curvature
        for j in range(before.shape[1]):
            t1, angle = before[i, j], theta[i, j]
            x = beta * angle
            more = math.expm1(x)
            euler, bent, stuck = t1 * math.exp(x), pressed * more, alpha * r * angle * growth(x)
            t2 = euler + bent + stuck
            # the sum of positive parts is finite only if each of them is: one test serves all outputs
            if status[i, j] == st.OK and not (valid and t1 >= 0.0 and angle >= 0.0 and math.isfinite(t2)):
                status[i, j] = st.INVALID_INPUT
            good = 1.0 if status[i, j] == st.OK else math.nan
            write(tension, i, j, good * t2)
            write(capstan, i, j, good * euler)
            write(bending, i, j, good * bent)
            write(adhesion, i, j, good * stuck)
            write(radius, i, j, good * thick)


@inline
def least_radius(alpha: float, beta: float, stiff: float, thick: float) -> float:
    """Radius of least tension, (2 B beta/alpha)^(1/3) - r, not below 0; inf without adhesion; (4)."""
    # no adhesion: the tension falls with R without end, or does not depend on it
    if alpha == 0.0:
        return math.inf if stiff * beta > 0.0 else math.nan
    return max(math.pow(2.0 * stiff * beta / alpha, 1.0 / 3.0) - thick, 0.0)


@kernel
def contour_of_least_tension(data: Array, radius: Array) -> None:
    """Compute the radius of the contour behind which the tension is least, for every wrap angle and tension; (4).

    Parameters
    ----------
    data : (n, 6), see CONTOUR_COLUMNS, R not used
    radius : (n,) out, inf without adhesion, nan where every radius is as good
    """
    for i in range(data.shape[0]):
        radius[i] = least_radius(data[i, 1], data[i, 2], data[i, 3], thread_radius(data[i, 4], data[i, 5]))


@kernel
def thread_speed(speed: Array, data: Array, status: Status, ratio: Array) -> None:
    """Compute the tension at a thread speed over the tension at the reference speed: 1 + K ((v/v_ref)^n - 1); (7).

    Parameters
    ----------
    speed : (n, m), speed of the thread; its magnitude counts
    data : (n, 3), see SPEED_COLUMNS
    status : (n, m), in and out; INVALID_INPUT where v_ref or n is not positive, K is not in 0..1, or v is not finite
    ratio : (n, m) out

    Notes
    -----
    Measured on the oracle table: relative error below 4 * 2^-53.
    """
    for i in range(speed.shape[0]):
        reference, share, exponent = data[i, 0], data[i, 1], data[i, 2]
        valid = reference > 0.0 and exponent > 0.0 and 0.0 <= share <= 1.0
        for j in range(speed.shape[1]):
            v = abs(speed[i, j])
            # expm1 of the logarithm: exact near the reference speed, 1 - K for a thread at rest.
            power = math.expm1(exponent * math.log(v / reference)) if v > 0.0 else -1.0
            if status[i, j] == st.OK and not (valid and math.isfinite(v) and math.isfinite(power)):
                status[i, j] = st.INVALID_INPUT
            ratio[i, j] = 1.0 + share * power if status[i, j] == st.OK else math.nan


@kernel
def capstan(
    before: Array, wrap: Array, friction: Array, status: Status, tension: Array | None, force: Array | None
) -> None:
    """Compute the tension behind the eyelet and magnitude of the force on it.

    Parameters
    ----------
    before : (n, m), tension T1 in front of the eyelet [force]
    wrap : (n, m), wrap angle [rad];  friction : (n,), coefficient of friction mu
    status : (n, m), in and out; INVALID_INPUT where T1, the angle or mu is negative or not finite: these give nan
    tension : (n, m) or None, T2 = T1 e^(mu wrap)
    force : (n, m) or None, |T1 e1 + T2 e2| = sqrt((T2 - T1)^2 + 4 T1 T2 sin^2(wrap/2))
    """
    for i in range(before.shape[0]):
        mu = friction[i]
        for j in range(before.shape[1]):
            t1, angle = before[i, j], wrap[i, j]
            t2 = t1 * math.exp(mu * angle)
            valid = mu >= 0.0 and t1 >= 0.0 and angle >= 0.0 and math.isfinite(t2)
            if status[i, j] == st.OK and not valid:
                status[i, j] = st.INVALID_INPUT
            good = 1.0 if status[i, j] == st.OK else math.nan
            write(tension, i, j, good * t2)
            if force is not None:
                # As a sum of squares it keeps its digits for a nearly straight thread.
                force[i, j] = good * math.hypot(
                    t1 * math.expm1(mu * angle), 2.0 * math.sqrt(t1 * t2) * math.sin(0.5 * angle)
                )


@kernel
def thread_over_point(
    guides: Array,
    position: Array,
    velocity: Array | None,
    acceleration: Array | None,
    status: Status,
    total: Array | None,
    first: Array | None,
    second: Array | None,
    wrap: Array | None,
) -> None:
    """Compute the length of the thread N1, E, N2, its derivatives by the crank angle, and the wrap angle at E.

    Parameters
    ----------
    guides : (n, 6), coordinates of N1 and N2 [length]
    position, velocity, acceleration : (n, m, 3), E and its derivatives; a derivative may be None if not needed
    status : (n, m), in and out; SINGULAR where E is at a guide; what is not OK gives nan
    total, first, second : (n, m) or None; L, dL/dphi, d2L/dphi2 [length]
    wrap : (n, m) or None; angle by which the thread turns at E [rad], 0 to pi

    Notes
    -----
    Measured on the oracle table: errors below 4 * 2^-53 * max(cond, |y|).
    """
    for i in range(position.shape[0]):
        n1, n2 = _point(guides[i, :3]), _point(guides[i, 3:])
        for j in range(position.shape[1]):
            e = _point(position[i, j])
            if status[i, j] == st.OK and not math.isfinite(e[0] + e[1] + e[2] + guides[i].sum()):
                status[i, j] = st.INVALID_INPUT
            d1, d2 = sub(e, n1), sub(e, n2)
            if status[i, j] == st.OK and not (dot(d1, d1) > 0.0 and dot(d2, d2) > 0.0):
                status[i, j] = st.SINGULAR
            good = 1.0 if status[i, j] == st.OK else math.nan
            write(total, i, j, good * length(e, n1, n2))
            if first is not None and velocity is not None:
                first[i, j] = good * slope(e, n1, n2, _point(velocity[i, j]))
            if second is not None and velocity is not None and acceleration is not None:
                second[i, j] = good * bend(e, n1, n2, _point(velocity[i, j]), _point(acceleration[i, j]))
            write(wrap, i, j, good * wrap_angle(e, n1, n2))


@kernel
def guide_line(guides: Array, position: Array, off: Array, along: Array, half: Array) -> None:
    """Compute (26): distance of E from the line of the guides, place along it from its middle, half its length.

    Parameters
    ----------
    guides : (n, 6), N1 and N2;  position : (n, 3), E;  off, along, half : (n,) out [length], nan if N1 = N2
    """
    for i in range(position.shape[0]):
        n1, n2, e = _point(guides[i, :3]), _point(guides[i, 3:]), _point(position[i])
        way = sub(n2, n1)
        distance = norm(way)
        # E from the middle as the sum of two differences: the middle itself would be rounded.
        d1, d2 = sub(e, n1), sub(e, n2)
        off[i] = norm(cross(d1, way)) / distance
        along[i] = 0.5 * (dot(d1, way) + dot(d2, way)) / distance
        half[i] = 0.5 * distance


@inline
def _point(a: Array) -> Vector:
    return a[0], a[1], a[2]
