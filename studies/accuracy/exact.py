"""What the closure in twice the working precision buys where the given doubles are meant to the last bit, and costs."""

from __future__ import annotations

from collections.abc import Iterable
from typing import TYPE_CHECKING

import numpy as np

from studies.accuracy import reference
from studies.accuracy.regions import Region
from studies.accuracy.timing import seconds
from sweep.families import family
from sweep.families.base import Angles, Array, Family

if TYPE_CHECKING:
    import pandas as pd

COPIES = 50
PLAIN = family("rssr")
CLOSURES = {"plain, as in sweeps": PLAIN, "twice the precision, as in evaluate": PLAIN.precise()}


def motion(mechanism: Family, designs: Array, phi: Array) -> Array:
    """Return the motion, psi and three derivatives, (4, n), at one crank angle per design."""
    columns = mechanism.poses(designs, Angles.of(phi[:, None]), frozenset(reference.ORDERS))
    return np.stack([np.asarray(columns[name], np.float64)[:, 0] for name in reference.ORDERS])


def exact_table(regions: Iterable[Region], poses: int) -> pd.DataFrame:
    """Return the largest error of psi [rad] and, relatively, of its derivatives:
    by the poses of sweeps and of evaluate.
    """
    import pandas as pd

    rows = []
    for region in regions:
        designs = region.designs[:poses]
        phi = np.random.default_rng(len(region.name)).uniform(0.0, 2.0 * np.pi, len(designs))
        truth = [reference.transfer_functions(*pair) for pair in zip(designs, phi, strict=True)]
        many, angles = np.tile(designs, (COPIES, 1)), np.tile(phi, COPIES)
        for name, mechanism in CLOSURES.items():
            got = motion(mechanism, designs, phi)
            row: dict[str, object] = {"region": region.name, "closure": name}
            row["psi"] = max(reference.angle_error(g, y[0]) for g, y in zip(got[0], truth, strict=True))
            for order in (1, 2, 3):
                # relative to the size of the derivatives, not to one that passes zero
                errors = [
                    abs(float(g - y[order])) / (abs(float(y[order])) + abs(float(y[1])))
                    for g, y in zip(got[order], truth, strict=True)
                ]
                row[reference.ORDERS[order]] = max(errors)
            took = seconds(lambda f=mechanism, d=many, p=angles: motion(f, d, p))  # type: ignore[misc]
            row["ns_per_pose"] = 1e9 * took / len(many)
            rows.append(row)
    return pd.DataFrame(rows)
