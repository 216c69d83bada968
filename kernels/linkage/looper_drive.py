"""The drive that both loopers have: a crank about an inclined axis, a coupler, a rocker about z.

X runs along the common perpendicular from the crank's axis to the rocker's, Z along the rocker's axis; the crank's axis
is (0, sin alpha, cos alpha), as for the spatial crank-rocker (docs/rssr.md).
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from kernels.jit import inline
from kernels.linkage.driven_ball import Path


class Crank(NamedTuple):
    """Constants of one design; the crank pin is at (a cos phi, y0 + a ca sin phi, lift - a sa sin phi)."""

    a: float
    b: float
    c: float
    e: float
    sa: float
    ca: float
    y0: float
    lift: float
    g: float
    branch: float
    size: float  # sum of the magnitudes whose rounding errors make up the pin's place from the rocker's foot
    valid: bool


@inline
def reduce_crank(d: Any, per: float) -> Crank:
    """Return constants from the first eight columns of a design, a b c e f g alpha branch;
    ``per`` scales its lengths.
    """
    a, b, c, e, f, g = d[0] * per, d[1] * per, d[2] * per, d[3] * per, d[4] * per, d[5] * per
    sa, ca, branch = np.sin(d[6]), np.cos(d[6]), d[7].real
    size = a.real + abs(e.real) + abs(f.real) + abs(g.real)
    valid = 0.0 < a.real <= 1.0 and 0.0 < b.real < 1e140 and 0.0 < c.real < 1e140 and size < 1e140
    valid = valid and abs(d[6].real) < 1e5 and branch * branch == 1.0
    return Crank(a, b, c, e, sa, ca, f * sa, f * ca, g, branch, size, valid)


@inline
def pin_path(r: Crank, u: Any, v: Any) -> Path:
    """Return the crank pin from the foot of the rocker, (e, 0, g), with its derivatives, at (cos phi,
    sin phi) = (u, v).
    """
    hu, hv, tu, tv = r.a * (r.ca * u), r.a * (r.ca * v), r.a * (r.sa * u), r.a * (r.sa * v)
    pin = (r.a * u - r.e, r.y0 + hv, r.lift - r.g - tv)
    return pin, (-r.a * v, hu, -tu), (-r.a * u, -hv, tv), (r.a * v, -hu, tu)
