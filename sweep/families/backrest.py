"""Registry entry of the moving back-rest whose bracket angle a let-off regulator sets over the beam radius."""

from __future__ import annotations

import numpy as np

from kernels.families import backrest
from sweep.families.base import Angles, Array, Columns, Family, Output, Parameter, guarded
from sweep.families.capabilities import Points
from sweep.families.domain import Interval
from sweep.families.warp import skeleton

FRAME = (
    Parameter("a1", "length", "warp stop motion, where the warp ends, to the right of the beam axis"),
    Parameter("b1", "length", "warp stop motion, above the beam axis"),
    Parameter("a2", "length", "pivot O2 of the brackets, to the right of the beam axis"),
    Parameter("b2", "length", "pivot O2 of the brackets, above the beam axis"),
    Parameter("H", "length", "axis of the back-rest above the line of the bracket"),
    Parameter("r", "length", "radius of the back-rest", positive=True),
    Parameter("r0", "length", "radius of the pin under the guide", not_negative=True),
    Parameter("psi", "angle", "direction of the guide, above the direction towards the beam"),
    Parameter("xE", "length", "point E of the guide, to the right of the beam axis"),
    Parameter("yE", "length", "point E of the guide, above the beam axis"),
    Parameter("f", "ratio", "friction of pin and slider", default=0.0, not_negative=True),
    Parameter("P1", "force", "weight of the back-rest"),
    Parameter("P2", "force", "weight of the brackets"),
    Parameter("lM", "length", "pivot O2 to the end M of the spring on the bracket", not_negative=True),
    Parameter("nu", "angle", "from the bracket to O2M, upwards"),
    Parameter("x3", "length", "fixed end of the spring, to the right of the beam axis"),
    Parameter("y3", "length", "fixed end of the spring, above the beam axis"),
    Parameter("cs", "stiffness", "stiffness of the spring"),
    Parameter("l0", "length", "length of the spring at which its force is F0"),
    Parameter("F0", "force", "preload of the spring"),
    Parameter("rg", "length", "pivot O2 to the centre of gravity of the brackets"),
    Parameter("nug", "angle", "from the bracket to its centre of gravity, upwards"),
    Parameter("s1", "choice", "friction of the guide: +1 as if moving in, -1 out, 0 none",
              default=1.0, choices=(-1.0, 0.0, 1.0)),
    Parameter("s2", "choice", "friction of the slider: +1 as if moving in, -1 out, 0 none",
              default=1.0, choices=(-1.0, 0.0, 1.0)),
)  # fmt: skip

BEAM = (
    Parameter("rho_full", "length", "radius of the yarn on the full beam", default=0.0, not_negative=True),
    Parameter("rho_empty", "length", "radius of the yarn on the empty beam", default=0.0, not_negative=True),
)

LAW = (
    Parameter("phi", "angle", "bracket angle above the direction towards the beam, with the full beam"),
    Parameter("turn", "angle", "what the regulator adds to it until the beam is empty, linear in 1/rho", default=0.0),
)

GEOMETRY = (
    Output("phi_rho", "rad", "bracket angle at this beam radius", "(13)"),
    Output("R1", "length", "slider on the bracket, from the pivot O2", "(1)"),
    Output("h", "length", "pin on the guide, from E", "(2)"),
    Output("theta", "rad", "direction of the yarn branch beam - back-rest, from the upward vertical", "(3)"),
    Output("gamma", "rad", "fall of the yarn branch back-rest - warp stop motion", "(4)"),
    Output("L1", "length", "yarn branch beam - back-rest", "(3)"),
    Output("L2", "length", "yarn branch back-rest - warp stop motion", "(4)"),
    Output("Lc", "length", "yarn on the back-rest", "(5)"),
    Output("wrap", "rad", "angle of the yarn on the back-rest", "(5)"),
    Output("x_axis", "length", "axis of the back-rest, to the right of the beam axis", "(1)"),
    Output("y_axis", "length", "axis of the back-rest, above the beam axis", "(1)"),
    Output("clearance", "length", "between the yarn on the beam and the back-rest", "(5)"),
    Output("roots", "1", "how many bracket angles solve the equation", "(12)", jumps=True),
)

LOADS = (
    Output("K", "N", "warp tension, slider's reaction at the axis of the back-rest", "(9)"),
    Output("N1", "N", "reaction of the guide, as for K", "(9)"),
    Output("N2", "N", "reaction of the bracket, as for K", "(9)"),
    Output("K_couple", "N", "warp tension, the slider bears a couple", "(11)"),
    Output("N1_couple", "N", "reaction of the guide, as for K_couple", "(10)"),
    Output("N2_couple", "N", "reaction of the bracket, as for K_couple", "(10)"),
    Output("offset_e", "length", "how far outwards of the axis the slider's reaction acts", "(11)"),
    Output("F_spring", "N", "force of the spring", "(6)"),
    Output("spring_length", "length", "length of the spring", "(6)"),
)

BAND = (
    Output("K_low", "N", "K_couple with friction -1, -1: one edge of the band within which friction leaves it", "(11)"),
    Output("K_high", "N", "K_couple with friction +1, +1: the other edge", "(11)"),
)

DRIFT = Output("drift", "N", "K_couple - K0", "(11)")
# The worked example of docs/backrest.md
EXAMPLE = {
    "a1": 0.75, "b1": 0.5625, "a2": 0.125, "b2": 0.4375, "H": 0.03125, "r": 0.0625, "r0": 0.046875, "psi": 1.5,
    "xE": 0.0, "yE": 0.25, "f": 0.125, "P1": 300.0, "P2": 200.0, "lM": 0.25, "nu": 1.0, "x3": 0.75, "y3": 0.6875,
    "cs": 512.0, "l0": 0.5, "F0": 1856.0, "rg": 0.1875, "nug": 0.125, "rho_full": 0.375, "rho_empty": 0.09375,
}  # fmt: skip

K0 = Parameter("K0", "force", "warp tension wanted", default=0.0)

_COLUMNS = backrest.Design._fields


def kernel_matrix(designs: Array, names: tuple[str, ...]) -> Array:
    """Return columns of the kernel's design matrix from those of an entry;
    what the entry lacks is 0, the root the first.
    """
    matrix = np.zeros((len(designs), len(_COLUMNS)), designs.dtype)
    matrix[:, -1] = 1.0
    for k, name in enumerate(names):
        if name in _COLUMNS:
            matrix[:, _COLUMNS.index(name)] = designs[:, k]
    return matrix


def solved(matrix: Array, modes: np.ndarray, angles: Angles, wanted: frozenset[str], position: str) -> Columns:
    """Return the wanted outputs and status from the kernel; ``position`` is the entry's name of the bracket angle."""
    shape, dtype = (len(matrix), angles.phi.shape[1]), np.result_type(matrix, angles.phi)
    # the complex step goes through the radius too, or no extremum over the beam could be followed
    matrix, radius = matrix.astype(dtype, copy=False), np.ascontiguousarray(angles.phi, dtype)
    status = np.empty(shape, np.uint8)
    needed = wanted | ({"K_couple"} if DRIFT.name in wanted else set())
    names = [[position, *(o.name for o in GEOMETRY[1:])], [o.name for o in LOADS], [o.name for o in BAND]]
    blocks = [None if needed.isdisjoint(group) else np.empty((len(group), *shape), dtype) for group in names]
    backrest.poses(matrix, radius, modes, status, *blocks)
    found: dict[str, Array] = {}
    for group, block in zip(names, blocks, strict=True):
        if block is not None:
            found |= dict(zip(group, block, strict=True))
    if DRIFT.name in wanted:
        found[DRIFT.name] = found["K_couple"] - matrix[:, _COLUMNS.index("K0"), None]
    return {name: x for name, x in found.items() if name in wanted} | {"status": status}


PARAMETERS = (*FRAME, *LAW, *BEAM, K0)
_NAMES = tuple(p.name for p in PARAMETERS)


def poses(designs: Array, angles: Angles, wanted: frozenset[str]) -> Columns:
    """Return the wanted outputs and status of every design at its beam radii, each (n, m)."""
    modes = np.full(len(designs), int(backrest.Mode.LAW), np.uint8)
    return solved(kernel_matrix(designs, _NAMES), modes, angles, wanted, "phi_rho")


def beam_of(names: tuple[str, ...]) -> Interval:
    """Return the beam radius, from empty to full, for an entry with those parameters."""
    empty, full = names.index("rho_empty"), names.index("rho_full")

    def ends(designs: Array) -> tuple[Array, Array]:
        return designs[:, empty], designs[:, full]

    return Interval("rho", "length", "radius of the yarn on the beam", ends)


POINTS = Points({"axis": ("x_axis", "y_axis", None)})

FAMILY = Family(
    name="backrest",
    title="moving back-rest, bracket angle set by the let-off regulator",
    parameters=PARAMETERS,
    position="K_couple",
    pose_outputs=GEOMETRY[:-1] + LOADS + BAND + (DRIFT,),
    poses=guarded(poses),
    example=EXAMPLE | {"phi": 0.4, "turn": -0.15, "K0": 1482.0},
    domain=beam_of(_NAMES),
    capabilities=(POINTS, skeleton(PARAMETERS, "phi_rho")),
)
