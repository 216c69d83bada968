"""Bodies of the five-link for loads (:mod:`kernels.links`): crank, cross-piece, coupler, rocker."""

from __future__ import annotations

import math

from kernels._jit import kernel
from kernels.links import (
    Array,
    Links,
    Moving,
    acceleration_at,
    put,
    put_ball,
    put_body,
    put_crank,
    put_turning,
    shaft,
    velocity_at,
)
from kernels.vectors import add, cross, dot, mix, scale, spun, sub


@kernel
def links(
    designs: Array,
    cos_phi: Array,
    sin_phi: Array,
    psi: Array,
    dpsi: Array,
    d2psi: Array,
    theta: Array,
    beta: Array,
    out: Links,
) -> None:
    """Fill the bodies, freedoms and closing lines of every pose.

    The coupler turns about axis 1 by theta and about axis 2, t, by -beta; the rates of both follow from the motion of
    the ball C seen from the crank pin B.  Vectors m, t, u and the points are those of docs/five_link.md.

    Parameters
    ----------
    designs : (n, 11);  cos_phi, sin_phi : (n, m) or (1, m)
    psi, dpsi, d2psi, theta, beta : (n, m), outputs of ``poses``
    out : four bodies, four freedoms, three lines: the ball C, whose forces act on the rocker
    """
    for i in range(designs.shape[0]):
        d = designs[i]
        u, e2 = shaft(d[6])
        e1, k = (1.0, 0.0, 0.0), (0.0, 0.0, 1.0)
        centre, foot = scale(d[4], u), (d[3], 0.0, d[5])
        row = i if cos_phi.shape[0] > 1 else 0
        for j in range(psi.shape[1]):
            bodies, axes = out.bodies[i, j], out.axes[i, j]
            crank = put_crank(bodies[0], axes[0], centre, u, e1, e2, cos_phi[row, j], sin_phi[row, j])
            pin = add(centre, scale(d[0], mix(cos_phi[row, j], e1, sin_phi[row, j], e2)))
            rho = (math.cos(psi[i, j]), math.sin(psi[i, j]), 0.0)
            rocker = put_turning(bodies[3], foot, k, rho, dpsi[i, j], d2psi[i, j])
            ball = add(foot, scale(d[2], rho))
            m = mix(math.cos(theta[i, j]), e1, math.sin(theta[i, j]), e2)
            t = cross(u, m)
            cb, sb = math.cos(beta[i, j]), math.sin(beta[i, j])
            hinge = add(pin, mix(d[7], m, d[8], t))
            arm, swept = mix(cb, m, sb, u), mix(-sb, m, cb, u)
            seen = sub(velocity_at(rocker, ball), velocity_at(crank, pin))
            reach = d[7] + d[1] * cb
            rate = dot(seen, u) / (d[1] * cb)
            spin = (dot(seen, t)) / reach
            omega1 = scale(spin, u)
            seen2 = sub(acceleration_at(rocker, ball), acceleration_at(crank, pin))
            # What the ball does at constant rates: about axis 1, of Coriolis, about axis 2.
            known = add(spun(omega1, (0.0, 0.0, 0.0), sub(ball, pin)), scale(2.0 * rate * d[1], cross(omega1, swept)))
            left = sub(seen2, sub(known, scale(rate * rate * d[1], arm)))
            rate2, spin2 = dot(left, u) / (d[1] * cb), dot(left, t) / reach
            eps1 = scale(spin2, u)
            piece = Moving(pin, velocity_at(crank, pin), acceleration_at(crank, pin), omega1, eps1)
            put_body(bodies[1], piece, m, t, u, pin)
            omega2 = mix(1.0, omega1, -rate, t)
            eps2 = add(mix(1.0, eps1, -rate2, t), scale(-rate, cross(omega1, t)))
            coupler = Moving(hinge, velocity_at(piece, hinge), acceleration_at(piece, hinge), omega2, eps2)
            put_body(bodies[2], coupler, arm, t, cross(arm, t), hinge)
            put(axes[1], u)
            put(axes[2], t)
            put(axes[3], k)
            put_ball(out.lines[i, j], ball)
