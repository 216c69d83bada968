"""Joint records of the spatial slider-crank, which effects work from."""

from __future__ import annotations

import math

from kernels._jit import kernel
from kernels.families.rssp.closure import Array


@kernel
def joints(
    designs: Array, cos_phi: Array, sin_phi: Array, s: Array, ds: Array, d2s: Array, discriminant: Array,
    per_pose: Array, per_design: Array,
) -> None:  # fmt: skip
    """Fill the records of :mod:`kernels.joints` from the motion, for the effects.

    Parameters
    ----------
    designs : (n, 6);  cos_phi, sin_phi : (n, m) or (1, m)
    s, ds, d2s, discriminant : (n, m), outputs of :func:`poses`
    per_pose : (n, m, PER_POSE) out;  per_design : (n, PER_DESIGN) out

    Notes
    -----
    The slider's triad is (common perpendicular, slide direction, normal of both); t_tau comes from the discriminant.
    """
    for i in range(designs.shape[0]):
        a, b, e, f, branch = designs[i, 0], designs[i, 1], designs[i, 2], designs[i, 3], designs[i, 5]
        sa, ca = math.sin(designs[i, 4]), math.cos(designs[i, 4])
        d = per_design[i]
        d[0], d[1], d[2], d[3], d[4], d[5] = 0.0, sa, ca, 0.0, 0.0, 1.0
        d[6], d[7], d[8], d[9], d[10], d[11] = 0.0, f * sa, f * ca, e, 0.0, 0.0
        d[12], d[13], d[14], d[15], d[16] = a, b, 1.0, branch, 0.0
        row = i if cos_phi.shape[0] > 1 else 0
        for j in range(cos_phi.shape[1]):
            u, v = cos_phi[row, j], sin_phi[row, j]
            root = branch * math.sqrt(discriminant[i, j])
            r = per_pose[i, j]
            r[0], r[1], r[2] = a * u, f * sa + a * (ca * v), f * ca - a * (sa * v)
            r[3], r[4], r[5] = e, s[i, j], 0.0
            # The middle component is the root of the discriminant: a difference of points loses it near a dead point.
            r[6], r[7], r[8] = (e - r[0]) / b, root / b, -r[2] / b
            r[9], r[10], r[11] = u, ca * v, -sa * v
            r[12], r[13], r[14] = -v, ca * u, -sa * u
            r[15], r[16], r[17] = 1.0, 0.0, 0.0
            r[18], r[19], r[20] = 0.0, 1.0, 0.0
            r[21], r[22], r[23] = root / b, ds[i, j], d2s[i, j]
