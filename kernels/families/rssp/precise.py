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
    (cos phi, sin phi) give the direction of the crank, its length is the crank's.
    """
    for i in range(designs.shape[0]):
        r = reduce_design(designs, i)
        row = i if cos_phi.shape[0] > 1 else 0
        sa, ca = two.sine_cosine(designs[i, 4])
        n0, na = two.scale(ca, designs[i, 3] * (1.0 / r.unit)), two.scale(sa, r.a)
        for j in range(cos_phi.shape[1]):
            u, v = two.unit_vector(cos_phi[row, j], sin_phi[row, j])
            m = two.subtract((r.e, 0.0), two.scale(u, r.a))
            n = two.subtract(n0, two.multiply(na, v))
            reach = two.multiply(two.subtract((r.b, 0.0), m), two.add((r.b, 0.0), m))
            q[i, j] = two.subtract(reach, two.multiply(n, n))[0]
