"""Registry entry of the moving back-rest with the closure of the source, for comparison: f N2 H = f N1 r0."""

from __future__ import annotations

import numpy as np

from kernels.families import backrest
from sweep.families import backrest as regulated
from sweep.families.backrest_tension import PHI, SOUGHT
from sweep.families.base import Angles, Array, Columns, Family, guarded
from sweep.families.warp import skeleton

PARAMETERS = (*regulated.FRAME, *SOUGHT, *regulated.BEAM)
_NAMES = tuple(p.name for p in PARAMETERS)


def poses(designs: Array, angles: Angles, wanted: frozenset[str]) -> Columns:
    """Return the wanted outputs and status of every design at its beam radii, each (n, m);
    the count of roots in any case.
    """
    modes = np.full(len(designs), int(backrest.Mode.CLOSURE), np.uint8)
    return regulated.solved(regulated.kernel_matrix(designs, _NAMES), modes, angles, wanted, "phi")


FAMILY = Family(
    name="backrest_closure",
    title="moving back-rest, closure of the source",
    parameters=PARAMETERS,
    position="phi",
    pose_outputs=(PHI, *regulated.GEOMETRY[1:], *regulated.LOADS, *regulated.BAND),
    poses=guarded(poses),
    example=regulated.EXAMPLE | {"phi_lo": -0.5, "phi_hi": 0.6},
    domain=regulated.beam_of(_NAMES),
    capabilities=(regulated.POINTS, skeleton(PARAMETERS, "phi")),
)
