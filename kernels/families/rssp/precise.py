"""The discriminant of the spatial slider-crank for exactly the given doubles, in twice the working precision.

Q alone is a small difference of large numbers; what :mod:`kernels.families.rssp.motion` makes of it loses nothing.
"""

from __future__ import annotations

from kernels import twofold as two
from kernels._jit import kernel
from kernels.families.rssp.closure import Array, reduce_design


@kernel
def precise_discriminants(designs: Array, cos_phi: Array, sin_phi: Array, q: Array) -> None:
    """Q of equation (1) of docs/rssp.md, correct to a rounding of what is given.

    Parameters
    ----------
    designs : (n, 6) columns of :class:`kernels.families.rssp.closure.Design`, float64
    cos_phi, sin_phi : (n, m), or (1, m) shared by all designs
    q : (n, m) out, in squared units of the reduced design

    Notes
    -----
    (u, v) = (cos phi, sin phi) are taken as they are; what their rounding takes from the unit length is given back to
    the crank, so that it only displaces the crank pin along its circle.
    """
    for i in range(designs.shape[0]):
        r = reduce_design(designs, i)
        row = i if cos_phi.shape[0] > 1 else 0
        sa, ca = two.sine_cosine(designs[i, 4])
        n0 = two.scale(ca, designs[i, 3] * (1.0 / r.unit))
        for j in range(cos_phi.shape[1]):
            u, v = cos_phi[row, j], sin_phi[row, j]
            uu, vv = two.two_product(u, u), two.two_product(v, v)
            length = two.two_sum(uu[0], vv[0])
            excess = (length[0] - 1.0) + (length[1] + (uu[1] + vv[1]))  # u^2 + v^2 - 1
            crank = two.normal(r.a, -0.5 * r.a * excess)
            m = two.subtract((r.e, 0.0), two.scale(crank, u))
            n = two.subtract(n0, two.scale(two.multiply(sa, crank), v))
            reach = two.multiply(two.subtract((r.b, 0.0), m), two.add((r.b, 0.0), m))
            q[i, j] = two.subtract(reach, two.multiply(n, n))[0]
