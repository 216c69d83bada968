"""Motion of the five-link at given crank angles, and its bodies for their loads.

The bodies are crank, cross-piece, coupler and rocker (:mod:`kernels.linkage.bodies`).
"""

from __future__ import annotations

import math
from collections import namedtuple
from typing import Any

import numpy as np

from kernels import status as st
from kernels.arithmetic.complex_step import arctan2, divisor, hypotenuse
from kernels.arithmetic.vectors import add, cross, dot, mix, scale, spun, sub
from kernels.curves.arc_roots import MOST
from kernels.families.five_link.closure import Joint, axial_reach, extremes, reaches, reduce_design, slope
from kernels.families.five_link.solve import pose_terms, real_joint, solve
from kernels.jit import inline, kernel
from kernels.linkage import bodies as tree
from kernels.linkage.crank_closure import Reduced
from kernels.linkage.outputs import put_block, write
from kernels.types import Array, Numbers, Status

# Terms of the swivelling joint in the second and third derivative of the closure, and rho; zero where plain.
# ``second``: share rho''; ``third``: share (rho' + rho''').
Bends = namedtuple("Bends", "rho second third")


@inline
def _bends(joint: Joint, c: Any, s: Any) -> Bends:
    z, square = axial_reach(joint, s)
    rho = np.sqrt(square) if square.real > 0.0 else 0.0 * square
    second, third = 0.0 * rho, 0.0 * rho
    if not joint.plain:
        per_rho = 1.0 / divisor(rho)
        z1, z2 = joint.sweep * c, -joint.sweep * s
        rho1 = -z * z1 * per_rho
        rho2 = -(z1 * z1 + z * z2 + rho1 * rho1) * per_rho
        rho3 = -(3.0 * z1 * z2 - z * z1 + 3.0 * rho1 * rho2) * per_rho
        second, third = joint.share * rho2, joint.share * (rho1 + rho3)
    return Bends(rho, second, third)


@inline
def transfer(r: Reduced, joint: Joint, u: Any, v: Any, c: Any, s: Any, t: Any) -> tuple[Any, Any, Any]:
    """First three derivatives of the mirrored angle, from minus its cosine, minus its sine and dG5/dpsi; (5)."""
    bends = _bends(joint, -c, -s)
    hu, hv = r.ca * u, r.ca * v
    w1 = r.k2 * u - r.k1 * v
    w = (r.k0 - w1) - joint.shift - joint.share * bends.rho if joint.share != 0.0 else (r.k0 - w1) - joint.shift
    per_t, w_ph = 1.0 / t, r.k1 * u + r.k2 * v
    g_ph = w_ph - (v * c - hu * s)
    p = -g_ph * per_t
    g_phph = w1 - (u * c + hv * s)
    g_phps = v * s + hu * c
    g_psps, turn = w - bends.second, t + bends.third
    q = -(g_phph + p * (2.0 * g_phps + g_psps * p)) * per_t
    g_phphps = u * s - hv * c
    g_phpsps = w_ph - g_ph
    jerk = (g_ph - p * (3.0 * g_phphps + p * (3.0 * g_phpsps - turn * p)) - 3.0 * q * (g_phps + g_psps * p)) * per_t
    return p, q, jerk


@inline
def _extreme(joint: Joint, x: Any, y: Any, w: Any, c: float, s: float) -> Any:
    """G5 at an extremum; at the end of an arc the place moves with the design and is computed from it."""
    if reaches(real_joint(joint), s):
        return slope(joint, x, y, w, c, s).value
    z, _ = axial_reach(real_joint(joint), s)
    sine = ((joint.coupler if z > 0.0 else -joint.coupler) - joint.axial) / joint.sweep
    cosine = np.sqrt((1.0 - sine) * (1.0 + sine))
    return x * (cosine if c > 0.0 else -cosine) - y * sine + (w - joint.shift)


@inline
def _shortfall(r: Reduced, joint: Joint, u: Any, v: Any) -> Any:
    """Negative measure of the gap by which the links do not reach; Delta of a crank-rocker; (7)."""
    x, y, w = pose_terms(r, u, v)
    real = real_joint(joint)
    if joint.plain:
        close = w - joint.shift
        _, square = axial_reach(joint, 0.0 * x)
        if joint.share != 0.0 and square.real > 0.0:
            close = close - joint.share * np.sqrt(square)
        value = x * x + y * y - close * close
        return value if value.real < 0.0 else square
    low, high = extremes(real, x.real, y.real, w.real)
    if not low.value < math.inf:
        nearest = joint.axial - joint.sweep if (joint.axial * joint.sweep).real > 0.0 else joint.axial + joint.sweep
        return (joint.coupler - nearest) * (joint.coupler + nearest)
    product = _extreme(joint, x, y, w, math.cos(low.psi), math.sin(low.psi))
    product *= _extreme(joint, x, y, w, math.cos(high.psi), math.sin(high.psi))
    return -product if product.real > 0.0 else product


@inline
def across(r: Reduced, joint: Joint, v: Any, w: Any, c: Any, s: Any) -> tuple[Any, Any]:
    """Force through the rocker ball along the rocker and along its axis; dG5/dpsi is its third part; (6)."""
    _, square = axial_reach(joint, -s)
    rho = np.sqrt(square) if square.real > 0.0 else 0.0 * square
    close = w - joint.shift
    lean = 0.0 * close
    if joint.share != 0.0:
        close = close - joint.share * rho
        z, _ = axial_reach(joint, -s)
        lean = joint.h * z / divisor(rho)
    along = (r.rocker - close) - lean * joint.sweep * s / r.rocker
    return along, (r.z0 - r.sa * v) - lean * (r.branch * r.ca)


@inline
def discriminant_of(r: Reduced, joint: Joint, code: int, u: Any, v: Any, w: Any, c: Any, s: Any, t: Any) -> Any:
    """Return b^2 cos^2(pressure angle) in units of the crank; negative where the links do not reach; (7)."""
    if joint.h == 0.0 and joint.s2 == 0.0:
        x, y, _ = pose_terms(r, u, v)
        return x * x + y * y - w * w
    if code == st.OK or code == st.DEAD_POINT:
        along, rise = across(r, joint, v, w, c, s)
        return joint.coupler * joint.coupler * (t * t / divisor(along * along + rise * rise + t * t))
    return _shortfall(r, joint, u, v)


# Pose outputs, each (n, m), and places (11, n, m); outputs of None are not computed.
Outputs = namedtuple("Outputs", "psi dpsi d2psi d3psi sin_psi cos_psi discriminant pressure_angle places")


@kernel
def poses(designs: Numbers, cos_phi: Numbers, sin_phi: Numbers, status: Status, out: Outputs) -> None:
    """Position, transfer functions, discriminant, pressure angle and joints of every design at its crank angles.

    Equations (1)-(8) of docs/five_link.md; joints in the fixed frame of its section 1.

    Parameters
    ----------
    designs : (n, 11) columns as `PARAMETERS` of sweep/families/five_link.py; complex128 for gradients by the
        complex step
    cos_phi, sin_phi : (n, m), or (1, m) shared by all designs; complex128 where they depend on the designs
    status : (n, m) out; OK, NOT_ASSEMBLED, DEAD_POINT, SINGULAR (the coupler is parallel to the crank axis) or
        INVALID_INPUT
    psi ... pressure_angle : (n, m) out, or None: then it is neither computed nor compiled; complex128 if an
        input is
    places : (11, n, m) out, theta, beta, and x y z of crank pin, axis 2 nearest to it, and rocker ball, or None

    Notes
    -----
    Where the status is not OK the values are nan, except that a dead point keeps its angle and the discriminant is
    always given; its complex part is 0 where the closure is not that of a crank-rocker.
    """
    room = np.empty(2 * MOST)
    for i in range(designs.shape[0]):
        r, joint = reduce_design(designs, i)
        row = i if cos_phi.shape[0] > 1 else 0
        two_ac = 2.0 * designs[i, 0] * designs[i, 2]
        for j in range(cos_phi.shape[1]):
            u, v = cos_phi[row, j], sin_phi[row, j]
            code, c, s, t, w = solve(r, joint, u, v, room)
            status[i, j] = code
            if out.discriminant is not None:
                write(out.discriminant, i, j, math.nan)
                if code != st.INVALID_INPUT:
                    write(out.discriminant, i, j, (discriminant_of(r, joint, code, u, v, w, c, s, t) * two_ac) * two_ac)
            write(out.cos_psi, i, j, -c)
            sine = 0.0 - r.branch * s  # never -0.0, which would turn the angle pi into -pi
            write(out.sin_psi, i, j, sine)
            write(out.psi, i, j, arctan2(sine, -c))
            if out.pressure_angle is not None:
                along, rise = across(r, joint, v, w, c, s)
                write(out.pressure_angle, i, j, arctan2(hypotenuse(along, rise), t))
            if out.dpsi is not None or out.d2psi is not None or out.d3psi is not None:
                p, q, jerk = (
                    transfer(r, joint, u, v, c, s, t) if code == st.OK else (math.nan * t, math.nan * t, math.nan * t)
                )
                write(out.dpsi, i, j, r.branch * p)
                write(out.d2psi, i, j, r.branch * q)
                write(out.d3psi, i, j, r.branch * jerk)
            if out.places is not None:
                put_block(out.places, i, j, _places(designs[i], r, joint, u, v, c, s), 1.0)


@inline
def _places(d: Numbers, r: Reduced, joint: Joint, u: Any, v: Any, c: Any, s: Any) -> tuple[Any, ...]:
    """Angles theta and beta, crank pin B, the point of axis 2 nearest to axis 1 moved by s2 along it, rocker ball C."""
    z, square = axial_reach(joint, -s)
    # a square that rounding made negative counts as zero; poses truly out of reach have their status already
    rho = np.sqrt(square) if square.real > 0.0 else 0.0 * square
    # d from the crank pin to the ball, along e1 and e2 of the crank's frame
    d1 = r.e - u - r.rocker * c
    d2 = -r.rocker * (r.ca * s + r.k1) - v
    reach = joint.h + rho
    towards, aside = d1 * reach + d2 * joint.s2, d2 * reach - d1 * joint.s2
    theta, beta = arctan2(aside, towards), arctan2(z, rho)
    a, ca = d[0], r.branch * r.ca
    length = hypotenuse(towards, aside)
    cos_theta, sin_theta = towards / divisor(length), aside / divisor(length)
    m1, m2 = joint.h * cos_theta - joint.s2 * sin_theta, joint.h * sin_theta + joint.s2 * cos_theta
    x, y, z = a * u, d[4] * r.sa + a * (ca * v), d[4] * ca - a * (r.sa * v)
    hinge = (x + a * m1, y + a * (ca * m2), z - a * (r.sa * m2))
    # the last one is nan where there is no angle
    ball = (d[3] - d[2] * c, -r.branch * d[2] * s, d[5] + 0.0 * c)
    return (theta, beta, x, y, z, *hinge, *ball)


@kernel
def links(designs: Array, cos_phi: Array, sin_phi: Array, motion: Array, out: tree.Links) -> None:
    """Fill the bodies, freedoms and closing lines of every pose.

    The coupler turns about axis 1 by theta and about axis 2, t, by -beta; the rates of both follow from the motion of
    the ball C seen from the crank pin B.  Vectors m, t, u and the points are those of docs/five_link.md.

    Parameters
    ----------
    designs : (n, 11);  cos_phi, sin_phi : (n, m) or (1, m)
    motion : (5, n, m), outputs psi, dpsi, d2psi, theta, beta of ``poses``
    out : four bodies, four freedoms, three lines: the ball C, whose forces act on the rocker
    """
    for i in range(designs.shape[0]):
        d = designs[i]
        shaft, k, foot = tree.main_shaft(d[6], d[4]), (0.0, 0.0, 1.0), (d[3], 0.0, d[5])
        u = shaft.axis
        row = i if cos_phi.shape[0] > 1 else 0
        for j in range(motion.shape[2]):
            psi, dpsi = motion[0, i, j], motion[1, i, j]
            d2psi, theta, beta = motion[2, i, j], motion[3, i, j], motion[4, i, j]
            bodies, axes = out.bodies[i, j], out.axes[i, j]
            crank, pin = tree.put_crank(bodies[0], axes[0], shaft, d[0], cos_phi[row, j], sin_phi[row, j])
            rho = (math.cos(psi), math.sin(psi), 0.0)
            rocker = tree.put_turning(bodies[3], foot, k, rho, dpsi, d2psi)
            ball = add(foot, scale(d[2], rho))
            m = mix(math.cos(theta), shaft.first, math.sin(theta), shaft.second)
            t = cross(u, m)
            cb, sb = math.cos(beta), math.sin(beta)
            hinge = add(pin, mix(d[7], m, d[8], t))
            arm, swept = mix(cb, m, sb, u), mix(-sb, m, cb, u)
            seen = sub(tree.velocity_at(rocker, ball), tree.velocity_at(crank, pin))
            reach = d[7] + d[1] * cb
            rate = dot(seen, u) / (d[1] * cb)
            spin = (dot(seen, t)) / reach
            omega1 = scale(spin, u)
            seen2 = sub(tree.acceleration_at(rocker, ball), tree.acceleration_at(crank, pin))
            # Accelerations of the ball at constant rates: about axis 1, of Coriolis, about axis 2.
            known = add(spun(omega1, (0.0, 0.0, 0.0), sub(ball, pin)), scale(2.0 * rate * d[1], cross(omega1, swept)))
            left = sub(seen2, sub(known, scale(rate * rate * d[1], arm)))
            rate2, spin2 = dot(left, u) / (d[1] * cb), dot(left, t) / reach
            eps1 = scale(spin2, u)
            piece = tree.Moving(pin, tree.velocity_at(crank, pin), tree.acceleration_at(crank, pin), omega1, eps1)
            tree.put_body(bodies[1], piece, m, t, u, pin)
            omega2 = mix(1.0, omega1, -rate, t)
            eps2 = add(mix(1.0, eps1, -rate2, t), scale(-rate, cross(omega1, t)))
            coupler = tree.Moving(
                hinge, tree.velocity_at(piece, hinge), tree.acceleration_at(piece, hinge), omega2, eps2
            )
            tree.put_body(bodies[2], coupler, arm, t, cross(arm, t), hinge)
            tree.put(axes[1], u)
            tree.put(axes[2], t)
            tree.put(axes[3], k)
            tree.put_ball(out.lines[i, j], ball)
