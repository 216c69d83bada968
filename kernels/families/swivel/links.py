"""Bodies of the swivel linkage for loads (:mod:`kernels.links`): crank and rod."""

from __future__ import annotations

from kernels._jit import kernel
from kernels.links import (
    Array,
    Links,
    Moving,
    acceleration_at,
    across,
    put,
    put_body,
    put_crank,
    put_line,
    shaft,
    velocity_at,
)
from kernels.vectors import add, cross, mix, scale


@kernel
def links(
    designs: Array,
    cos_phi: Array,
    sin_phi: Array,
    rho: Array,
    drho: Array,
    d2rho: Array,
    direction: Array,
    out: Links,
) -> None:
    """Fill the bodies, freedoms and closing lines of every pose; equation numbers are of docs/swivel.md.

    Parameters
    ----------
    designs : (n, 6);  cos_phi, sin_phi : (n, m) or (1, m)
    rho, drho, d2rho : (n, m), outputs of ``poses``;  direction : (3, n, m), the rod's
    out : two bodies, three freedoms, two lines: the block's forces on the rod across it
    """
    for i in range(designs.shape[0]):
        d = designs[i]
        u, e2 = shaft(d[4])
        centre, block = scale(d[2], u), (d[1], 0.0, d[3])
        row = i if cos_phi.shape[0] > 1 else 0
        for j in range(rho.shape[1]):
            bodies, axes = out.bodies[i, j], out.axes[i, j]
            first = (1.0, 0.0, 0.0)
            crank = put_crank(bodies[0], axes[0], centre, u, first, e2, cos_phi[row, j], sin_phi[row, j])
            pin = add(centre, scale(d[0], mix(cos_phi[row, j], first, sin_phi[row, j], e2)))
            n = (direction[0, i, j], direction[1, i, j], direction[2, i, j])
            v, a = velocity_at(crank, pin), acceleration_at(crank, pin)
            per = 1.0 / rho[i, j]
            # (3): rho n' = E' - rho' n and rho n'' = E'' - rho'' n - 2 rho' n', with E' = -B'
            n1 = scale(-per, mix(1.0, v, drho[i, j], n))
            n2 = scale(-per, mix(1.0, mix(1.0, a, d2rho[i, j], n), 2.0 * drho[i, j], n1))
            rod = Moving(pin, v, a, cross(n, n1), cross(n, n2))
            y = across(n)
            z = cross(n, y)
            put_body(bodies[1], rod, n, y, z, pin)
            put(axes[1], y)
            put(axes[2], z)
            put_line(out.lines[i, j, 0], block, y)
            put_line(out.lines[i, j, 1], block, z)
