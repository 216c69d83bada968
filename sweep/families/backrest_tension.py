"""Registry entry of the moving back-rest whose bracket angle holds a wanted warp tension at every beam radius."""

from __future__ import annotations

import numpy as np

from kernels.families import backrest
from sweep.families import backrest as regulated
from sweep.families.base import Angles, Array, Columns, Family, Output, Parameter, guarded
from sweep.families.warp import skeleton

SOUGHT = (
    Parameter("phi_lo", "angle", "bracket angles are sought from here"),
    Parameter("phi_hi", "angle", "bracket angles are sought up to here"),
    Parameter("root", "count", "which of the bracket angles, counted from phi_lo", default=1.0, positive=True),
)
PHI = Output("phi", "rad", "bracket angle that solves the equation", "(12)")

PARAMETERS = (
    *regulated.FRAME,
    Parameter("K0", "force", "warp tension to be held"),
    Parameter("couple", "choice", "1: the slider bears a couple; 0: its reaction acts at the axis of the back-rest",
              default=1.0, choices=(0.0, 1.0)),
    *SOUGHT,
    *regulated.BEAM,
)  # fmt: skip
_NAMES = tuple(p.name for p in PARAMETERS)
_COUPLE = _NAMES.index("couple")


def poses(designs: Array, angles: Angles, wanted: frozenset[str]) -> Columns:
    """Return the wanted outputs and status of every design at its beam radii, each (n, m);
    the count of roots in any case.
    """
    with_couple, without = int(backrest.Mode.COUPLE), int(backrest.Mode.TENSION)
    modes = np.where(designs[:, _COUPLE].real == 1.0, with_couple, without).astype(np.uint8)
    return regulated.solved(regulated.kernel_matrix(designs, _NAMES), modes, angles, wanted, "phi")


FAMILY = Family(
    name="backrest_tension",
    title="moving back-rest, bracket angle that holds a tension",
    parameters=PARAMETERS,
    position="phi",
    pose_outputs=(PHI, *regulated.GEOMETRY[1:], *regulated.LOADS, *regulated.BAND),
    poses=guarded(poses),
    example=regulated.EXAMPLE | {"K0": 1482.0, "phi_lo": -0.1, "phi_hi": 1.2},
    domain=regulated.beam_of(_NAMES),
    capabilities=(regulated.POINTS, skeleton(PARAMETERS, "phi")),
)
