"""Bodies of the slotted link for loads (:mod:`kernels.links`): crank, driven link, between them an arm or a block."""

from __future__ import annotations

import math

from kernels._jit import kernel
from kernels.links import (
    SLIDE,
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
    rho: Array,
    drho: Array,
    d2rho: Array,
    out: Links,
) -> None:
    """Fill the bodies, freedoms and closing lines of every pose; t, n and rho are those of docs/slotted.md.

    The arm slides along the bar by rho and tilts about it.  In the fork slot (k = 0) a block takes its place, which
    moves with the ball and slides along t and along the driven axis.  The loop is closed at the ball.

    Parameters
    ----------
    designs : (n, 9);  cos_phi, sin_phi : (n, m) or (1, m)
    psi, dpsi, d2psi, rho, drho, d2rho : (n, m), outputs of ``poses``
    out : crank, driven link, arm or block; four freedoms, three lines: the ball, whose forces act on the arm
    """
    for i in range(designs.shape[0]):
        d = designs[i]
        u, e2 = shaft(d[4])
        first, k = (1.0, 0.0, 0.0), (0.0, 0.0, 1.0)
        centre, pivot = scale(d[2], u), (d[1], 0.0, d[3])
        row = i if cos_phi.shape[0] > 1 else 0
        for j in range(psi.shape[1]):
            bodies, axes = out.bodies[i, j], out.axes[i, j]
            crank = put_crank(bodies[0], axes[0], centre, u, first, e2, cos_phi[row, j], sin_phi[row, j])
            ball = add(centre, scale(d[0], mix(cos_phi[row, j], first, sin_phi[row, j], e2)))
            t = (math.cos(psi[i, j]), math.sin(psi[i, j]), 0.0)
            n = cross(k, t)
            driven = put_turning(bodies[1], pivot, k, t, dpsi[i, j], d2psi[i, j])
            put(axes[1], k)
            put(axes[2], t)
            put_ball(out.lines[i, j], ball)
            if d[6] == 0.0:
                block = Moving(
                    ball, velocity_at(crank, ball), acceleration_at(crank, ball), driven.omega, driven.eps
                )  # fmt: skip
                put_body(bodies[2], block, n, t, cross(n, t), ball)
                put(axes[3], k)
                out.freedoms[i, 3, 1] = SLIDE
            else:
                foot = add(pivot, mix(rho[i, j], t, d[5], n))
                arm = sub(ball, foot)
                # Seen from the driven link the foot slides and the arm tilts about the bar, t x arm per radian.
                slid, swept = scale(drho[i, j], t), cross(t, arm)
                v = add(velocity_at(driven, foot), slid)
                a = add(acceleration_at(driven, foot), scale(d2rho[i, j], t))
                a = add(a, scale(2.0, cross(driven.omega, slid)))
                per = 1.0 / dot(swept, swept)
                tilt = per * dot(swept, sub(sub(velocity_at(crank, ball), v), cross(driven.omega, arm)))
                omega = mix(1.0, driven.omega, tilt, t)
                # eps = psi'' k + tilt'' t + tilt' psi' k x t; tilt'' from the ball's acceleration
                known = mix(1.0, driven.eps, tilt, cross(driven.omega, t))
                left = sub(sub(acceleration_at(crank, ball), a), spun(omega, known, arm))
                eps = mix(1.0, known, per * dot(swept, left), t)
                x = scale(1.0 / d[6], arm)
                put_body(bodies[2], Moving(foot, v, a, omega, eps), x, t, cross(x, t), foot)
                put(axes[3], t)
