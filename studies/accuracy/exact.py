"""What the closure constant in twice the working precision buys, and costs."""

from __future__ import annotations

from collections.abc import Iterable
from typing import TYPE_CHECKING

import numpy as np

from kernels.families import rssr
from kernels.families.rssr.exact import exact_constant
from studies.accuracy import reference
from studies.accuracy.regions import Region
from studies.accuracy.timing import seconds
from sweep.families.base import Array

if TYPE_CHECKING:
    import pandas as pd

COPIES = 50


def motion(designs: Array, phi: Array, k0: Array | None) -> Array:
    """Motion, psi and three derivatives, (4, n), at one crank angle per design."""
    n = len(designs)
    status = np.empty((n, 1), np.uint8)
    p, d1, d2, d3 = (np.empty((n, 1)) for _ in range(4))
    cos, sin = np.cos(phi)[:, None], np.sin(phi)[:, None]
    rssr.poses(
        designs, cos, sin, status, p, d1, d2, d3,
        None, None, None, None, None, None, None, None, None, None, k0,
    )  # fmt: skip
    return np.concatenate([p, d1, d2, d3], axis=1).T


def constants(designs: Array) -> Array:
    """The constant of each design."""
    k0 = np.empty(len(designs))
    exact_constant(designs, k0)
    return k0


def exact_table(regions: Iterable[Region], poses: int) -> pd.DataFrame:
    """Largest error of psi [rad] and, relatively, of its derivatives: plain, and with the constant compensated."""
    import pandas as pd

    rows = []
    for region in regions:
        designs = region.designs[:poses]
        phi = np.random.default_rng(len(region.name)).uniform(0.0, 2.0 * np.pi, len(designs))
        truth = [reference.transfer_functions(*pair) for pair in zip(designs, phi, strict=True)]
        many = np.tile(designs, (COPIES, 1))
        for name, k0 in (("plain", None), ("exact constant", constants(designs))):
            got = motion(designs, phi, k0)
            row: dict[str, object] = {"region": region.name, "constant": name}
            row["psi"] = max(reference.angle_error(g, y[0]) for g, y in zip(got[0], truth, strict=True))
            for order in (1, 2, 3):
                # relative to the size of the derivatives, not to one that passes zero
                errors = [
                    abs(float(g - y[order])) / (abs(float(y[order])) + abs(float(y[1])))
                    for g, y in zip(got[order], truth, strict=True)
                ]
                row[reference.ORDERS[order]] = max(errors)
            row["ns_per_design"] = 0.0 if k0 is None else 1e9 * seconds(lambda d=many: constants(d)) / len(many)  # type: ignore[misc]
            rows.append(row)
    return pd.DataFrame(rows)
