"""Bodies of the looper on a sphere for loads (:mod:`kernels.links`): two cranks and couplers, carrier, looper."""

from __future__ import annotations

import math

from kernels._jit import kernel
from kernels.links import (
    Array,
    Links,
    Moving,
    put,
    put_ball,
    put_body,
    put_crank,
    put_rod,
    put_turning,
    shaft,
    turned_about,
)
from kernels.vectors import add, cross, mix, scale


@kernel
def links(
    designs: Array,
    cos_phi: Array,
    sin_phi: Array,
    psi: Array,
    dpsi: Array,
    d2psi: Array,
    chi: Array,
    dchi: Array,
    d2chi: Array,
    out: Links,
) -> None:
    """Fill the bodies, freedoms and closing lines of every pose; symbols are those of docs/spherical_looper.md.

    Parameters
    ----------
    designs : (n, 26);  cos_phi, sin_phi : (n, m) or (1, m)
    psi, dpsi, d2psi, chi, dchi, d2chi : (n, m), outputs of ``poses``
    out : crank 1, crank 2, carrier, looper, coupler 1, coupler 2; the axes of the looper are x, y, z at psi = chi = 0.
        Eight freedoms; six lines, of the carrier's and the looper's ball, whose forces act on them
    """
    for i in range(designs.shape[0]):
        d = designs[i]
        u1, e2 = shaft(d[6])
        first, k = (1.0, 0.0, 0.0), (0.0, 0.0, 1.0)
        centre1, foot, os = scale(d[4], u1), (d[3], 0.0, d[5]), (d[3], 0.0, d[8])
        still = (math.sin(d[9]) * math.cos(d[10]), math.sin(d[9]) * math.sin(d[10]), math.cos(d[9]))
        st, ct, sb, cb = math.sin(d[22]), math.cos(d[22]), math.sin(d[23]), math.cos(d[23])
        u2, g1, g2 = (st * cb, st * sb, ct), (ct * cb, ct * sb, -st), (-sb, cb, 0.0)
        centre2, co, so = (d[19], d[20], d[21]), math.cos(d[24]), math.sin(d[24])
        row = i if cos_phi.shape[0] > 1 else 0
        for j in range(psi.shape[1]):
            bodies, axes, lines = out.bodies[i, j], out.axes[i, j], out.lines[i, j]
            u, v = cos_phi[row, j], sin_phi[row, j]
            w, x = u * co - v * so, v * co + u * so
            crank1 = put_crank(bodies[0], axes[0], centre1, u1, first, e2, u, v)
            crank2 = put_crank(bodies[1], axes[1], centre2, u2, g1, g2, w, x)
            pin1 = add(centre1, scale(d[0], mix(u, first, v, e2)))
            pin2 = add(centre2, scale(d[17], mix(w, g1, x, g2)))
            cp, sp = math.cos(psi[i, j]), math.sin(psi[i, j])
            rho = (cp, sp, 0.0)
            carrier = put_turning(bodies[2], foot, k, rho, dpsi[i, j], d2psi[i, j])
            put(axes[2], k)
            n2 = turned_about(k, cp, sp, still)
            cc, sc = math.cos(chi[i, j]), math.sin(chi[i, j])
            gyro = scale(dpsi[i, j] * dchi[i, j], cross(k, n2))
            eps = add(mix(d2psi[i, j], k, d2chi[i, j], n2), gyro)
            none = (0.0, 0.0, 0.0)
            looper = Moving(os, none, none, mix(dpsi[i, j], k, dchi[i, j], n2), eps)
            bx = turned_about(k, cp, sp, turned_about(still, cc, sc, first))
            by = turned_about(k, cp, sp, turned_about(still, cc, sc, (0.0, 1.0, 0.0)))
            put_body(bodies[3], looper, bx, by, cross(bx, by), os)
            put(axes[3], n2)
            ball1 = add(foot, scale(d[2], rho))
            ball2 = add(os, add(mix(d[11], bx, d[12], by), scale(d[13], cross(bx, by))))
            put_rod(bodies[4], axes[4:], crank1, pin1, carrier, ball1)
            put_rod(bodies[5], axes[6:], crank2, pin2, looper, ball2)
            put_ball(lines, ball1)
            put_ball(lines[3:], ball2)
