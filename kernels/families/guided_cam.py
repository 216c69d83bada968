"""Thread take-up by a cam whose follower moves in a guide and carries the thread between two fixed guides.

Polukhin 1971, section 7, as worked out in docs/takeup.md; the equation numbers are of that page.  The cam is made for
the thread: P(phi) is given as a Fourier series, and the follower's displacement, its profile, the pressure angle at
which it jams in its guide, and the least radius at which nothing jams follow from it.
"""

from __future__ import annotations

import math
from collections import namedtuple
from typing import Any, NamedTuple

import numpy as np

from kernels import status as st
from kernels.arithmetic.complex_step import arctan2, magnitude, unit_near
from kernels.curves.periodic import harmonics, highest_top
from kernels.jit import inline, kernel
from kernels.linkage.outputs import put_block, write, write_number
from kernels.linkage.verdict import pose_status
from kernels.types import EPS, TWO_PI, Array, Status


@inline
def displacement(thread: float, across_z: float, across_x: float) -> float:
    """Return S^2 = L^2/4 - Z1^2 - (e - X1)^2 without the cancellation of large squares; (10)."""
    half = 0.5 * thread
    off = np.sqrt(across_z * across_z + across_x * across_x)
    return (half - off) * (half + off)  # type: ignore[no-any-return]


@inline
def reaches(square: float, thread: float) -> int:
    """Status of a squared displacement: within the rounding of L^2/4 it counts as zero, which is a dead point."""
    code = pose_status(math.isfinite(square), square, EPS * thread * thread, None)
    return st.NOT_ASSEMBLED if code != st.INVALID_INPUT and not thread > 0.0 else code


@inline
def follow(s: float, thread: float, first: float, second: float) -> tuple[float, float]:
    """Return S' and S'' from L, L', L''; (11), (12)."""
    ds = thread * first / (4.0 * s)
    return ds, (0.25 * (first * first + thread * second) - ds * ds) / s


@kernel
def follower(data: Array, status: Status, S: Array | None, dS: Array | None, d2S: Array | None) -> None:
    """Displacement of the follower and its derivatives from the length of thread; (10) to (12) of docs/takeup.md.

    Parameters
    ----------
    data : (n, 6), columns L, dL, d2L, Z1, e, X1 [length]
    status : (n,) out; NOT_ASSEMBLED where the thread is shorter than the way between the guides, DEAD_POINT where it is
        just as long (S = 0, infinite slope), INVALID_INPUT where a number is not finite
    S, dS, d2S : (n,) out or None [length]; nan where the status is not OK, but S = 0 at a dead point

    Notes
    -----
    Measured on the oracle table: errors below 8 * 2^-53 * max(cond, |y|).
    """
    for i in range(data.shape[0]):
        thread, first, second = data[i, 0], data[i, 1], data[i, 2]
        square = displacement(thread, data[i, 3], data[i, 4] - data[i, 5])
        code = reaches(square, thread) if math.isfinite(first + second) else st.INVALID_INPUT
        status[i] = code
        good = 1.0 if code == st.OK else math.nan
        s = math.sqrt(square) if code == st.OK else 0.0 if code == st.DEAD_POINT else math.nan
        ds, d2s = follow(good * s, thread, first, second)
        write_number(S, i, s)
        write_number(dS, i, ds)
        write_number(d2S, i, d2s)


@inline
def jam_angle(mu1: float, mu2: float) -> float:
    """Pressure angle at which the follower jams: 90 deg - arctan mu1 - arctan mu2; (13)."""
    # one arctangent of the sum's tangent: it goes on below 0 where mu1 mu2 > 1 and subtracts nothing from 90 deg
    return arctan2(1.0 - mu1 * mu2, mu1 + mu2)  # type: ignore[no-any-return]


@kernel
def jam_angles(friction: Array, angle: Array, tan_half: Array) -> None:
    """Permissible pressure angle of the follower and the tangent of its half; (13), (14) of docs/takeup.md.

    Parameters
    ----------
    friction : (n, 2), coefficients of friction mu1 on the cam, mu2 in the guide, not negative
    angle : (n,) out [rad]; negative where mu1 mu2 > 1: it jams at every angle
    tan_half : (n,) out
    """
    for i in range(friction.shape[0]):
        mu1, mu2 = friction[i, 0], friction[i, 1]
        angle[i] = jam_angle(mu1, mu2)
        # -m + sqrt(1 + m^2) with numerator and denominator multiplied: no difference for mu1 mu2 < 1.
        rest, both = 1.0 - mu1 * mu2, mu1 + mu2
        tan_half[i] = rest / (math.hypot(rest, both) + both)


# Harmonics of P(phi); columns of the design matrix: P_h, X1, Z1, e, R0, mu1, mu2, A1 ... A6, B1 ... B6.
HARMONICS = 6
FIRST = 7
COLUMNS = FIRST + 2 * HARMONICS
LOOKS = 64  # samples over the turn: ten for each period of the highest harmonic


class Reduced(NamedTuple):
    """Per-design numbers in units of ``unit``: the thread's store, the guide's offsets, radius of the cam less S."""

    store: float
    across_z: float
    across_x: float
    radius: float  # cam radius at the least displacement
    lowest: float  # thread law where the displacement is least
    least: float  # least displacement over the turn
    unit: float
    valid: bool


@inline
def law(designs: Array, i: int, u: Any, v: Any) -> tuple[Any, Any, Any]:
    """Return P and its first two derivatives for u = cos(phi), v = sin(phi); (9)."""
    value, first, second, _ = harmonics(designs[i, FIRST:], HARMONICS, u, v)
    return value, first, second


@inline
def _curve(phi: float, designs: Array, i: int, needs: tuple[Reduced, float] | None) -> tuple[float, float]:
    """Evaluate a curve to be maximised over the cam angle, and its derivative.

    It is S' cot - S, the radius needed less a constant, for a reduced design and cot; for None it is -P, the thread
    given, of the real parts: where it is most a complex step of the place changes nothing.
    """
    value, first, second = law(designs, i, math.cos(phi), math.sin(phi))
    if needs is None:
        return -value.real, -first.real
    r, cotangent = needs
    thread = r.store + value / r.unit
    s = math.sqrt(displacement(thread, r.across_z, r.across_x))
    ds, d2s = follow(s, thread, first / r.unit, second / r.unit)
    return ds * cotangent - s, d2s * cotangent - ds


@inline
def _largest(designs: Array, i: int, needs: tuple[Reduced, float] | None, looks: int) -> tuple[float, float]:
    """Find the largest value of a curve over the turn, and its cam angle, from ``looks`` samples."""
    samples = np.empty(looks)
    for j in range(looks):
        samples[j] = _curve(TWO_PI / looks * j, designs, i, needs)[0]
    where, value, best = highest_top(_curve, 1.0, samples, 0.0, (designs, i, needs))
    # where two tops share the bracket the search may have come to the lower one
    return max(value, samples[best]), where


@inline
def reduce_design(designs: Array, i: int) -> Reduced:
    """Constants of one design; one of them, the least displacement, needs a search over the whole turn."""
    size = 0.0
    for k in range(COLUMNS):
        if k != 5 and k != 6:  # the coefficients of friction are no lengths
            size += abs(designs[i, k].real)
    valid = 1e-140 < size < 1e140 and designs[i, 0].real > 0.0 and designs[i, 4].real >= 0.0
    valid = valid and 0.0 <= designs[i, 5].real < 1e100 and 0.0 <= designs[i, 6].real < 1e100
    # a store this small against the rest would have squares below float64 after scaling
    valid = valid and designs[i, 0].real > 1e-140 * size
    unit, per_unit = unit_near(size if valid else 1.0)
    _, where = _largest(designs, i, None, LOOKS)
    lowest = law(designs, i, math.cos(where), math.sin(where))[0] * per_unit
    thread = designs[i, 0] * per_unit + lowest
    across_z, across_x = designs[i, 2] * per_unit, (designs[i, 3] - designs[i, 1]) * per_unit
    square = displacement(thread, across_z, across_x)
    least = np.sqrt(square) if reaches(square.real, thread.real) == st.OK else math.nan * square
    return Reduced(
        designs[i, 0] * per_unit, across_z, across_x, designs[i, 4] * per_unit, lowest, least, unit, valid
    )  # fmt: skip


# Pose outputs, each (n, m), and profile (2, n, m); outputs of None are not computed.
Outputs = namedtuple("Outputs", "P dP d2P L S dS d2S pressure_angle curvature profile")


@kernel
def poses(designs: Array, cos_phi: Array, sin_phi: Array, status: Status, out: Outputs) -> None:
    """Compute the thread law, follower and profile of the cam; (9) to (17) of docs/takeup.md.

    Parameters
    ----------
    designs : (n, 19), see COLUMNS; complex128 for gradients by the complex step
    cos_phi, sin_phi : (n, m), or (1, m) shared by all designs
    status : (n, m) out; OK, NOT_ASSEMBLED where the thread is shorter than the way between the guides, DEAD_POINT where
        it is just as long (S = 0), INVALID_INPUT
    P, dP, d2P, L : (n, m) out or None; thread taken up, its derivatives, thread length [length]
    S, dS, d2S : (n, m) out or None; displacement of the follower from the line of the guides, its derivatives [length]
    pressure_angle : (n, m) out or None; between the normal of the profile and the way of the follower [rad]; nan with
        NOT_ASSEMBLED if the thread does not reach somewhere else in the turn, and so for the profile
    curvature : (n, m) out or None; curvature of the profile, positive where it is convex [1/length]
    profile : (2, n, m) out or None; point of the profile in the cam's axes, x and y [length]
    """
    for i in range(designs.shape[0]):
        r = reduce_design(designs, i)
        row = i if cos_phi.shape[0] > 1 else 0
        # the radius is counted from the least displacement, so these need the thread to reach all over the turn
        whole = out.pressure_angle is not None or out.curvature is not None or out.profile is not None
        for j in range(cos_phi.shape[1]):
            u, v = cos_phi[row, j], sin_phi[row, j]
            value, first, second = law(designs, i, u, v)
            value, first, second = value / r.unit, first / r.unit, second / r.unit
            thread = r.store + value
            square = displacement(thread, r.across_z, r.across_x)
            code = reaches(square.real, thread.real) if r.valid else st.INVALID_INPUT
            if code == st.OK and whole and r.least.real != r.least.real:
                code = st.NOT_ASSEMBLED
            status[i, j] = code
            good = 1.0 if code == st.OK else math.nan
            given = math.nan if code == st.INVALID_INPUT else 1.0
            write(out.P, i, j, given * value * r.unit)
            write(out.dP, i, j, given * first * r.unit)
            write(out.d2P, i, j, given * second * r.unit)
            write(out.L, i, j, given * thread * r.unit)
            s = np.sqrt(square) if code == st.OK else (0.0 if code == st.DEAD_POINT else math.nan) * square
            ds, d2s = follow(good * s, thread, first, second)
            write(out.S, i, j, s * r.unit)
            write(out.dS, i, j, ds * r.unit)
            write(out.d2S, i, j, d2s * r.unit)
            if whole:
                # S less its least value by the difference of P: near it two large displacements would cancel.
                rise = (value - r.lowest) * (thread + (r.store + r.lowest)) / (4.0 * (s + r.least))
                reach = r.radius + rise
                write(out.pressure_angle, i, j, arctan2(magnitude(ds), reach))
                # The cam turns by phi against the follower: its profile is passed backwards.
                put_block(out.profile, i, j, (reach * u, -reach * v), r.unit)
                if out.curvature is not None:
                    way = reach * reach + ds * ds
                    write(out.curvature, i, j, (way + ds * ds - reach * d2s) / (way * np.sqrt(way)) / r.unit)


ROOT_LOOKS = 512  # samples over the turn; where S is small its root has far shorter waves than the series P


@kernel
def least_radius(designs: Array, status: Status, radius: Array, place: Array, angle: Array, displaced: Array) -> None:
    """Compute the least R0 for which the pressure angle nowhere exceeds the jamming angle; (16) of docs/takeup.md.

    Parameters
    ----------
    designs : (n, 19), see :data:`kernels.families.guided_cam.COLUMNS`; R0 is not used
    status : (n,) out; NOT_ASSEMBLED where the thread does not reach all through the turn, JAMMED where the follower
        jams at every pressure angle (mu1 mu2 >= 1), INVALID_INPUT
    radius : (n,) out [length]; cam radius at the least displacement, not below 0
    place : (n,) out [rad]; cam angle that requires it, -pi to pi
    angle : (n,) out [rad]; jamming angle;  displaced : (n,) out [length]; least displacement S over the turn
    """
    for i in range(designs.shape[0]):
        r = reduce_design(designs, i)
        limit = jam_angle(designs[i, 5], designs[i, 6])
        code = st.OK if r.least > 0.0 else st.NOT_ASSEMBLED
        # "not >" also catches a limit that is no number
        if code == st.OK and not limit > 0.0:
            code = st.JAMMED
        if not r.valid:
            code = st.INVALID_INPUT
        status[i], angle[i], displaced[i] = code, limit, r.least * r.unit
        radius[i], place[i] = math.nan, math.nan
        if code == st.OK:
            cotangent = 1.0 / math.tan(limit)
            best, where = -math.inf, 0.0
            # rise and return: the guide jams alike whichever way the follower is pressed aside
            for sign in (1.0, -1.0):
                value, at = _largest(designs, i, (r, sign * cotangent), ROOT_LOOKS)
                if value > best:
                    best, where = value, at
            radius[i] = max(best + r.least, 0.0) * r.unit
            # the bisection may have left the turn at its seam
            place[i] = where - TWO_PI * np.rint(where / TWO_PI)
