"""Motion of the spatial slider-crank for exactly the given doubles: everything in twice the working precision.

In plain arithmetic (:mod:`kernels.families.rssp.motion`) the discriminant near a dead point is a small difference of
large numbers, and so are the derivatives for long offsets.
"""

from __future__ import annotations

import math

from kernels import status as st
from kernels.arithmetic import double_double as two
from kernels.families.rssp.closure import EPS, reduce_design
from kernels.families.rssp.motion import Outputs
from kernels.jit import kernel
from kernels.linkage.outputs import write
from kernels.linkage.verdict import pose_status
from kernels.types import Array, Status

BAND = 4.0 * EPS  # what rounding the given numbers does to Q: a dead point made in float64 is still one


@kernel
def precise_poses(
    designs: Array,
    cos_phi: Array,
    sin_phi: Array,
    status: Status,
    out: Outputs,
    joints: Array | None,
) -> None:
    """Poses as of the module ``motion``, correct to a few roundings, for float64 designs only.

    Notes
    -----
    (cos phi, sin phi) give the direction of the crank, its length is the crank's.
    """
    for i in range(designs.shape[0]):
        r = reduce_design(designs, i)
        row = i if cos_phi.shape[0] > 1 else 0
        unit = r.unit
        sa, ca = two.sine_cosine(designs[i, 4])
        f, ka, na = designs[i, 3] * (1.0 / unit), two.scale(ca, r.a), two.scale(sa, r.a)
        y0, n0, ae = two.scale(sa, f), two.scale(ca, f), two.two_product(r.a, r.e)
        for j in range(cos_phi.shape[1]):
            u, v = two.unit_vector(cos_phi[row, j], sin_phi[row, j])
            hu, hv = two.multiply(ka, u), two.multiply(ka, v)
            y, m = two.add(y0, hv), two.subtract((r.e, 0.0), two.scale(u, r.a))
            n = two.subtract(n0, two.multiply(na, v))
            q = two.multiply(two.subtract((r.b, 0.0), m), two.add((r.b, 0.0), m))
            q = two.subtract(q, two.multiply(n, n))
            tolerance = BAND * (abs(m[0]) * r.m_size + abs(n[0]) * r.n_size)
            tolerance += BAND * BAND * (r.m_size * r.m_size + r.n_size * r.n_size)
            code = pose_status(r.valid, q[0], tolerance, None)
            status[i, j] = code

            write(out.discriminant, i, j, (q[0] * unit) * unit if r.valid else math.nan)
            root = two.root(q) if code == st.OK else (0.0, 0.0)
            assembled = code == st.OK or code == st.DEAD_POINT
            w = two.scale(root, r.branch)
            place = two.add(y, w)[0] * unit if assembled else math.nan
            write(out.s, i, j, place)
            write(out.pressure_angle, i, j, math.atan2(math.hypot(m[0], n[0]), root[0]) if assembled else math.nan)
            if joints is not None:
                joints[0, i, j], joints[1, i, j], joints[2, i, j] = r.a * u[0] * unit, y[0] * unit, n[0] * unit
                joints[3, i, j], joints[5, i, j] = (r.e * unit, 0.0) if assembled else (math.nan, math.nan)
                joints[4, i, j] = place
            if out.ds is not None or out.d2s is not None or out.d3s is not None:
                per_w = 1.0 / w[0] if code == st.OK else math.nan
                q1 = two.subtract(two.multiply(hu, y), two.multiply(ae, v))
                w1 = two.divide(q1, w, per_w)
                write(out.ds, i, j, two.add(hu, w1)[0] * unit)
                if out.d2s is not None or out.d3s is not None:
                    q2 = two.subtract(two.multiply(hu, hu), two.add(two.multiply(hv, y), two.multiply(ae, u)))
                    w2 = two.divide(two.subtract(q2, two.multiply(w1, w1)), w, per_w)
                    write(out.d2s, i, j, two.subtract(w2, hv)[0] * unit)
                    if out.d3s is not None:
                        q3 = two.add(two.multiply(hu, hv), two.multiply(w1, w2))
                        w3 = two.divide(two.add(q1, two.scale(q3, 3.0)), w, per_w)  # negative
                        write(out.d3s, i, j, -two.add(w3, hu)[0] * unit)
