"""Registry entry of the geared dwell drive with any whole gear ratio, external or internal."""

from __future__ import annotations

import numpy as np

from kernels.families import epicyclic_dwell
from sweep.families.base import Accuracy, Angles, Array, Columns, Family, Output, Parameter, Step, Work, poses_of
from sweep.families.capabilities import Link, Made, Points, Skeleton
from sweep.families.pace import Singular, Waves
from sweep.families.skeletons import ORIGIN, parameter, standing

PARAMETERS = (
    Parameter("k", "ratio", "distance of the pin from the planet centre, in planet radii", positive=True),
    Parameter("a", "ratio", "offset of the output axis from the carrier axis, in planet radii"),
    Parameter(
        "n", "count", "radius of the fixed gear in planet radii, a whole number", positive=True, default=1.0,
        choices=tuple(float(n) for n in range(1, epicyclic_dwell.MOST_TEETH + 1)),
    ),
    Parameter("mesh", "sign", "+1: planet outside the fixed gear, -1: inside a ring", default=1.0, choices=(-1.0, 1.0)),
)  # fmt: skip

POSE_OUTPUTS = (
    Output("psi", "rad", "output angle in (-pi, pi]", "(2)", wraps=True),
    Output("dpsi", "1", "velocity analogue dpsi/dphi", "(3)"),
    Output("d2psi", "1", "acceleration analogue", "(3)"),
    Output("d3psi", "1", "jerk analogue", "(3)"),
    Output("sin_psi", "1", "sine of the output angle", "(2)"),
    Output("cos_psi", "1", "cosine of the output angle", "(2)"),
    Output("x_b", "1", "pin from the output axis towards phi = 0, in planet radii", "(1)"),
    Output("y_b", "1", "pin from the output axis across it, in planet radii", "(1)"),
)

DWELL_OUTPUTS = (
    Output("dwell_angle", "rad", "return dwell: carrier angle between first and third passage of mid-dwell", "(5)"),
    Output("dwell_deviation", "rad", "largest deviation of psi from mid-dwell, half the peak to peak", "(6)"),
    Output("dwell_band", "rad", "carrier angle during which psi stays within +-dwell_deviation", "(7)"),
)

_NAMES = tuple(o.name for o in POSE_OUTPUTS)

# Wanted pose outputs and status of every design at its angles, each (n, m).
poses = poses_of(epicyclic_dwell.poses, _NAMES)


def pin_distance_squared(designs: Array, angles: Angles, found: Columns) -> Array:
    """Return the squared distance of the pin from the output axis, (n, m): near the axis the output turns at once."""
    x, y = (np.asarray(found[name], np.float64) for name in ("x_b", "y_b"))
    return x * x + y * y


def dwell(designs: Array, wanted: frozenset[str], accuracy: Accuracy) -> Columns:
    """Return dwell measures to rounding: every root is bisected."""
    n = len(designs)
    status, values = np.empty(n, np.uint8), [np.empty(n) for _ in DWELL_OUTPUTS]
    epicyclic_dwell.dwell_measures(designs, status, *values)
    columns: Columns = {o.name: x for o, x in zip(DWELL_OUTPUTS, values, strict=True) if o.name in wanted}
    return columns | {"status": status}


def planet_turns(designs: Array) -> Array:
    """Return how often the planet turns while the carrier turns once, (n,)."""
    n, mesh = (parameter(PARAMETERS, name, designs) for name in ("n", "mesh"))
    found: Array = np.abs(n + mesh)
    return found


def planet_centre(designs: Array, angles: Angles, motion: Columns) -> Array:
    """Return the planet's centre, (n, m, 3), in planet radii."""
    n, mesh, a = (parameter(PARAMETERS, name, designs)[:, None] for name in ("n", "mesh", "a"))
    x = a + (n + mesh) * angles.cos
    return np.stack([x, (n + mesh) * angles.sin, np.zeros_like(x)], axis=-1)


FAMILY = Family(
    name="epicyclic_dwell",
    title="geared dwell drive with a whole gear ratio",
    parameters=PARAMETERS,
    position="psi",
    pose_outputs=POSE_OUTPUTS,
    poses=poses,
    example={"k": 1.3, "a": 0.2, "n": 3.0},
    steps=(Step("dwell", DWELL_OUTPUTS, dwell, work=Work.LONG),),
    derivative_of={"psi": "dpsi", "dpsi": "d2psi", "d2psi": "d3psi"},
    uses_phi=False,
    capabilities=(
        Singular(pin_distance_squared, ("x_b", "y_b")),
        Waves(planet_turns),
        Points({"b": ("x_b", "y_b", None)}),
        Skeleton(
            {"a": standing(PARAMETERS, "a"), "d": ORIGIN},
            (Link("carrier", ("a", "o")), Link("planet", ("o", "b")), Link("slotted link", ("d", "b"))),
            {"o": Made((), planet_centre)},
        ),
    ),
)
