"""C0, M1: orientation of the coupler, its rates, the motion of a point on it, and of the links' centre of mass.

A ball joint with a finger is a universal joint: its first axis ``w`` is fixed in the neighbouring link, its second axis
``n`` in the coupler, normal to w and to the coupler (Polukhin 1971, 2.6).

* finger on the driven joint C: w = rho (the line D-C; on a slider the common perpendicular, which is ours),
  n = branch (w x s)/|w x s|; degenerates only at a dead point, |w x s| >= cos(pressure angle);
* finger on the driving joint B: w = u (crank axis), n = (w x s)/|w x s|; degenerates where the coupler is parallel to
  the crank axis, whatever the pressure angle.

M1 is the shaking force without masses: the acceleration of the common centre of mass of links like slender rods, ours.
Rods of one mass per length have their centres in the middle, so with lengths a, b, c of crank, coupler, rocker

    (a + b + c) S'' = a B''/2 + b (B'' + C'')/2 + c C''/2,                                                    (1)

primes being derivatives with respect to the crank angle; the centres of the fixed pivots do not move.  A slider has no
length and counts for nothing.  Where the crank turns unevenly, as that of a chain's later stage, its rates w, w' with
respect to the independent angle make P'' into w^2 P'' + w' P' (2).
"""

from __future__ import annotations

import math
from typing import NamedTuple

from kernels import status as st
from kernels.arithmetic.vectors import Vector, add, cross, dot, mix, norm, scale, spun, sub
from kernels.jit import inline, kernel
from kernels.linkage.joints import Joints, read
from kernels.linkage.outputs import write
from kernels.types import Array, Status

DRIVEN, DRIVING = 0.0, 1.0

# Below this sine of the angle between coupler and finger axis the axis n has no direction left in float64.
LEAST_SINE = 1e-13


class Coupler(NamedTuple):
    """Orientation (s, n x s, n) and its rates per unit crank speed: multiply omega by speed, eps by speed squared."""

    w: Vector
    n: Vector
    across: Vector  # n x s
    omega: Vector
    eps: Vector
    v_b: Vector
    a_b: Vector
    sine: float  # |w x s|


@inline
def orientation(j: Joints, construction: float) -> Coupler:
    """Orientation and rates of the coupler for one pose; primes are derivatives by the crank angle."""
    v_b, a_b = scale(j.a, j.tau_b), scale(-j.a, j.rho_b)
    v_c = scale(j.c * j.dpsi, j.tau)
    a_c = mix(j.c * j.d2psi, j.tau, -j.turns * j.c * j.dpsi * j.dpsi, j.rho)
    per_b = 1.0 / j.b
    ds, d2s = scale(per_b, sub(v_c, v_b)), scale(per_b, sub(a_c, a_b))
    if construction == DRIVEN:
        w = j.rho
        dw = scale(j.turns * j.dpsi, j.tau)
        d2w = mix(j.turns * j.d2psi, j.tau, -j.turns * j.dpsi * j.dpsi, j.rho)
        sign = j.branch
    else:
        w, dw, d2w, sign = j.u, (0.0, 0.0, 0.0), (0.0, 0.0, 0.0), 1.0
    m = scale(sign, cross(w, j.s))
    dm = scale(sign, add(cross(dw, j.s), cross(w, ds)))
    d2m = scale(sign, add(add(cross(d2w, j.s), scale(2.0, cross(dw, ds))), cross(w, d2s)))
    sine = norm(m)
    per = 1.0 / sine
    n = scale(per, m)
    across = cross(n, j.s)
    d_sine = dot(dm, n)
    dn = scale(per, mix(1.0, dm, -d_sine, n))
    spin = -per * dot(dm, across)
    omega = add(cross(j.s, ds), scale(spin, j.s))
    d_spin = -(per * dot(mix(1.0, d2m, -2.0 * d_sine, dn), across) + dot(dn, cross(omega, across)))
    eps = add(add(cross(j.s, d2s), scale(d_spin, j.s)), scale(spin, ds))
    return Coupler(w, n, across, omega, eps, v_b, a_b, sine)


@inline
def euler_angles(j: Joints, body: Coupler, construction: float) -> tuple[float, float]:
    """Euler angles of the coupler without the precession, in all quadrants.

    Finger on C: Rz(psi) Rx(Theta) Rz(Phi) turns x to s and z to n.  Finger on B: the precession is 90 deg - alpha about
    x, which brings z to u; Theta turns about u, Phi about the new x, and y becomes s.
    """
    if construction == DRIVEN:
        theta = math.atan2(-dot(body.n, j.tau), dot(body.n, cross(j.rho, j.tau)))
        return theta, j.branch * math.atan2(body.sine, dot(j.rho, j.s))
    # e1 is x and e2 = u x e1: the crank axis has no component along the common perpendicular.
    across = j.u[2] * j.s[1] - j.u[1] * j.s[2]
    return math.atan2(j.s[0], -across), math.atan2(-dot(j.u, j.s), body.sine)


class CouplerMotion(NamedTuple):
    """Outputs of the motion of a coupler and a point on it; None where an output is not wanted.

    Parameters
    ----------
    position, velocity, acceleration : (n, m, 3) with respect to the crank angle [length]
    n, omega, eps : (n, m, 3) unit vector n, angular velocity and acceleration per unit crank speed
    euler : (n, m, 2) nutation and rotation about the coupler's own axis, `euler_angles` [rad]
    """

    position: Array | None = None
    velocity: Array | None = None
    acceleration: Array | None = None
    n: Array | None = None
    omega: Array | None = None
    eps: Array | None = None
    euler: Array | None = None


@kernel
def coupler_point(
    poses: Array, designs: Array, point: Array, finger: Array, status: Status, out: CouplerMotion
) -> None:
    """Compute the motion of a point of the coupler and the coupler's orientation and rates.

    Parameters
    ----------
    poses : (n, m, PER_POSE), designs : (n, PER_DESIGN), records of :mod:`kernels.linkage.joints`
    point : (n, 3), coordinates along (s, n x s, n) from B [length]
    finger : (n,) DRIVEN or DRIVING, which ball joint carries the finger
    status : (n, m), in and out; poses that are not OK give nan, SINGULAR where the finger axis meets the coupler
    out : the wanted outputs
    """
    for i in range(poses.shape[0]):
        p = (point[i, 0], point[i, 1], point[i, 2])
        for j in range(poses.shape[1]):
            joints = read(poses[i, j], designs[i])
            body = orientation(joints, finger[i])
            if status[i, j] == st.OK and not body.sine > LEAST_SINE:
                status[i, j] = st.SINGULAR
            good = 1.0 if status[i, j] == st.OK else math.nan
            arm = add(mix(p[0], joints.s, p[1], body.across), scale(p[2], body.n))
            _store(out.position, i, j, good, add(joints.B, arm))
            _store(out.velocity, i, j, good, add(body.v_b, cross(body.omega, arm)))
            _store(out.acceleration, i, j, good, add(body.a_b, spun(body.omega, body.eps, arm)))
            _store(out.n, i, j, good, body.n)
            _store(out.omega, i, j, good, body.omega)
            _store(out.eps, i, j, good, body.eps)
            _store_euler(out.euler, i, j, good, joints, body, finger[i])


@inline
def _store(out: Array | None, i: int, j: int, good: float, a: Vector) -> None:
    """Write a vector where it is wanted; without ``out`` nothing is compiled."""
    if out is not None:
        out[i, j, 0], out[i, j, 1], out[i, j, 2] = good * a[0], good * a[1], good * a[2]


@inline
def _store_euler(
    out: Array | None, i: int, j: int, good: float, joints: Joints, body: Coupler, construction: float
) -> None:
    if out is not None:
        theta, turn = euler_angles(joints, body, construction)
        out[i, j, 0], out[i, j, 1] = good * theta, good * turn


@kernel
def centre_acceleration(
    poses: Array,
    designs: Array,
    first: Array,
    second: Array,
    status: Status,
    size: Array | None,
    x: Array | None,
    y: Array | None,
    z: Array | None,
) -> None:
    """Compute the acceleration analogue S'' of the common centre of mass, and its magnitude.

    Parameters
    ----------
    poses : (n, m, PER_POSE), designs : (n, PER_DESIGN), records of :mod:`kernels.linkage.joints`
    first, second : (n, m) first and second derivative of the crank angle with respect to the independent angle
    status : (n, m), in; nan where it is not OK
    size, x, y, z : (n, m) or None; magnitude and components along the fixed axes
    """
    for i in range(poses.shape[0]):
        for k in range(poses.shape[1]):
            j = read(poses[i, k], designs[i])
            good = 1.0 if status[i, k] == st.OK else math.nan
            w, dw = first[i, k], second[i, k]
            crank = mix(-j.a * w * w, j.rho_b, j.a * dw, j.tau_b)
            along = j.c * (j.d2psi * w * w + j.dpsi * dw)
            driven = mix(-j.turns * j.c * (j.dpsi * w) ** 2, j.rho, along, j.tau)
            rocker = j.turns * j.c
            total = j.a + j.b + rocker
            s = mix(0.5 * good * (j.a + j.b) / total, crank, 0.5 * (j.b + rocker) / total, driven)
            write(size, i, k, math.sqrt(dot(s, s)))
            write(x, i, k, s[0])
            write(y, i, k, s[1])
            write(z, i, k, s[2])
