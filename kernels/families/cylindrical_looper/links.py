"""Bodies of the looper on a cylinder for loads (:mod:`kernels.links`): two cranks and couplers, shaft, rocker."""

from __future__ import annotations

import math

from kernels._jit import kernel
from kernels.links import (
    FRAME,
    Array,
    Links,
    Moving,
    put,
    put_ball,
    put_body,
    put_crank,
    put_line,
    put_rod,
    shaft,
)
from kernels.vectors import add, cross, mix, scale

SHAFT = 2  # its number among the bodies


@kernel
def links(
    designs: Array,
    cos_phi: Array,
    sin_phi: Array,
    psi: Array,
    dpsi: Array,
    d2psi: Array,
    s: Array,
    ds: Array,
    d2s: Array,
    out: Links,
) -> None:
    """Fill the bodies, freedoms and closing lines of every pose; symbols are those of docs/cylindrical_looper.md.

    The rocker sits on the shaft, which guides it across and takes its torque by a key.  Along the shaft it is held by
    the shaft where it slides with it, and by the frame where it stays at its height.

    Parameters
    ----------
    designs : (n, 23);  cos_phi, sin_phi : (n, m) or (1, m)
    psi, dpsi, d2psi, s, ds, d2s : (n, m), outputs of ``poses``
    out : crank 1, crank 2, shaft, rocker, coupler 1, coupler 2; shaft and rocker from the axis at the height of the
        rocker's ball at s = 0, the shaft moved by s, the rocker where it slides.  Nine freedoms; seven lines, of both
        balls, whose forces act on rocker and shaft, and along the shaft on the rocker
    """
    for i in range(designs.shape[0]):
        d = designs[i]
        u1, e2 = shaft(d[6])
        first, k = (1.0, 0.0, 0.0), (0.0, 0.0, 1.0)
        centre1, foot = scale(d[4], u1), (d[3], 0.0, d[5])
        # Frame of crank 2: x2 across the shaft, y2 = k along it, z2 = x2 x k; its slide is the shaft's axis.
        x2 = (math.cos(d[21]), math.sin(d[21]), 0.0)
        z2 = cross(x2, k)
        sa, ca = math.sin(d[12]), math.cos(d[12])
        u2, g2 = mix(sa, k, ca, z2), mix(ca, k, -sa, z2)
        centre2 = add(mix(1.0, foot, -d[10], x2), scale(d[11], u2))
        co, so = math.cos(d[13]), math.sin(d[13])
        row = i if cos_phi.shape[0] > 1 else 0
        for j in range(psi.shape[1]):
            bodies, axes, lines = out.bodies[i, j], out.axes[i, j], out.lines[i, j]
            u, v = cos_phi[row, j], sin_phi[row, j]
            w, x = u * co - v * so, v * co + u * so
            crank1 = put_crank(bodies[0], axes[0], centre1, u1, first, e2, u, v)
            crank2 = put_crank(bodies[1], axes[1], centre2, u2, x2, g2, w, x)
            pin1 = add(centre1, scale(d[0], mix(u, first, v, e2)))
            pin2 = add(centre2, scale(d[8], mix(w, x2, x, g2)))
            rho = (math.cos(psi[i, j]), math.sin(psi[i, j]), 0.0)
            omega, eps = scale(dpsi[i, j], k), scale(d2psi[i, j], k)
            place = mix(1.0, foot, s[i, j], k)
            looper = Moving(place, scale(ds[i, j], k), scale(d2s[i, j], k), omega, eps)
            put_body(bodies[2], looper, rho, cross(k, rho), k, foot)
            held = mix(1.0, foot, d[15] * s[i, j], k)
            rocker = Moving(held, scale(d[15] * ds[i, j], k), scale(d[15] * d2s[i, j], k), omega, eps)
            put_body(bodies[3], rocker, rho, cross(k, rho), k, held)
            put(axes[2], k)
            put(axes[3], k)
            put(axes[4], k)
            ball1 = add(held, scale(d[2], rho))
            beta = psi[i, j] + d[20]
            ball2 = add(place, scale(d[19], (math.cos(beta), math.sin(beta), 0.0)))
            put_rod(bodies[4], axes[5:], crank1, pin1, rocker, ball1)
            put_rod(bodies[5], axes[7:], crank2, pin2, looper, ball2)
            put_ball(lines, ball1)
            put_ball(lines[3:], ball2)
            put_line(lines[6], held, k)
            out.ends[i, 6, 1] = SHAFT if d[15] == 1.0 else FRAME
