"""Registry entries of the geared dwell drives with a slotted output link: equal gears, or any whole gear ratio."""

from __future__ import annotations

from collections.abc import Callable
from functools import lru_cache

import numpy as np

from kernels import status as st
from kernels.families import epicyclic_dwell, geared_dwell
from kernels.types import EPS, Array
from sweep.families.base import Accuracy, Angles, Columns, Family, Output, Parameter, Step, Work, about, parameters_of
from sweep.families.capabilities import Link, OutputLink, Skeleton, constant
from sweep.families.curve_features import Singular, Waves
from sweep.families.outputs import coordinate_outputs, ladders
from sweep.families.planar_trees import rolling_planet
from sweep.families.poses import chosen, filled_each, poses_of
from sweep.families.skeletons import ORIGIN, moving, parameter, standing

PARAMETERS = parameters_of("geared_dwell")


def _pin_outputs(place: str) -> tuple[Output, ...]:
    return (
        Output("sin_psi", "1", "sine of the output angle", "(2)"),
        Output("cos_psi", "1", "cosine of the output angle", "(2)"),
        Output("x_b", "1", "pin from the output axis towards phi = 0, in planet radii", place),
        Output("y_b", "1", "pin from the output axis across it, in planet radii", place),
    )


def _dwell_outputs(angle: str, deviation: str, band: str) -> tuple[Output, ...]:
    return (
        Output("dwell_angle", "rad", "return dwell: carrier angle between first and third passage of mid-dwell", angle),
        Output("dwell_deviation", "rad", "largest deviation of psi from mid-dwell, half the peak to peak", deviation),
        Output("dwell_band", "rad", "carrier angle during which psi stays within +-dwell_deviation", band),
    )


POSE_OUTPUTS = (
    *coordinate_outputs(
        "psi", "rad", "output angle, continuous over all turns; 0 or pi at phi = 0", "(3)", "(4)", "(5)", "(6)"
    ),
    *_pin_outputs("(2)"),
)

DWELL_OUTPUTS = (
    Output("turns", "1", "turns of the output per turn of the carrier, 0, 1 or 2", "section 2", jumps=True),
    *_dwell_outputs("(10)", "(11)", "(12)"),
)

MAX_OUTPUTS = (
    Output("max_abs_dpsi", "1", "largest velocity analogue over the turn", "(7)"),
    Output("max_abs_d2psi", "1", "largest acceleration analogue over the turn", "(8)"),
    Output("phi_max_abs_d2psi", "rad", "carrier angle in [0, pi] where it occurs; as well at minus it", "(8)"),
    Output("max_abs_d3psi", "1", "largest jerk analogue over the turn", "(9)"),
)

_SAMPLED_OUTPUTS = tuple(o for o in MAX_OUTPUTS if o.name.startswith("max"))


poses = poses_of(geared_dwell.poses, geared_dwell.Outputs, angles="phi cos sin")


def dwell(designs: Array, wanted: frozenset[str], accuracy: Accuracy) -> Columns:
    """Compute dwell measures from closed forms and a bracketed root, to rounding at any accuracy.

    The error bounds exceed the errors measured on the oracle table, below 8 roundings.
    """
    columns = _computed(geared_dwell.dwell_measures, (designs,), DWELL_OUTPUTS, wanted)
    for name in wanted & set(columns) if accuracy.target is not None else ():
        value = np.asarray(columns[name], np.float64)
        columns[f"err_{name}"] = 0.0 * value if name == "turns" else 32.0 * EPS * abs(value)
    return columns


def exact_maxima(designs: Array, wanted: frozenset[str], accuracy: Accuracy) -> Columns:
    """Compute maxima over the turn from all stationary points, to rounding.

    The error bounds follow from errors measured against 60 digits on 1100 designs: below 40 roundings, growing towards
    k = 1, a = -1, where three singularities meet, as the distance to the power -5/4, within 1e-6 as that to the power
    -3/2.  They are relative for a maximum, absolute for its place.  Within about 4e-10 no digit is left: the status is
    NOT_CONVERGED.
    """
    columns = _computed(geared_dwell.turn_maxima, (designs,), MAX_OUTPUTS, wanted)
    with np.errstate(all="ignore"):  # invalid designs have their status
        away = np.hypot(designs[:, 0] - 1.0, designs[:, 1] + 1.0)
        growth = EPS * (128.0 * (1.0 + away**-1.25) + 64.0 * away**-1.5)
    status = np.asarray(columns["status"])
    status[(status == st.OK) & (growth >= 1.0)] = st.NOT_CONVERGED
    for name in wanted & set(columns):
        value = np.asarray(columns[name], np.float64)
        columns[f"err_{name}"] = growth * (1.0 + 0.0 * value if name.startswith("phi") else abs(value))
    return columns


def sampled_maxima(designs: Array, wanted: frozenset[str], accuracy: Accuracy) -> Columns:
    """Compute maxima over ``accuracy.samples`` equidistant carrier angles, the first at phi = 0."""
    assert accuracy.samples is not None
    return _computed(geared_dwell.dense_maxima, (designs, *half_turn(accuracy.samples)), _SAMPLED_OUTPUTS, wanted)


@lru_cache(maxsize=32)
def half_turn(samples: int) -> tuple[Array, Array]:
    """Tabulate one turn, folded: rows 1 -+ cos(phi), sin(phi) and its square around phi = 0 and around phi = pi.

    phi and -phi have the same magnitudes, so half of the samples represent all.  The last angle is repeated up to a
    multiple of 16, which the vectorised loop processes without a remainder; a grid of an odd number misses phi = pi.
    """
    quarters = np.arange(samples // 2 + 1) * 4  # phi in units of pi/(2 samples)
    return _table(quarters[quarters <= samples], samples), _table(2 * samples - quarters[quarters > samples], samples)


def _table(quarters: np.ndarray[tuple[int], np.dtype[np.int64]], samples: int) -> Array:
    angle = quarters * (np.pi / (2 * samples))
    rows = np.stack([2.0 * np.sin(0.5 * angle) ** 2, np.sin(angle), np.sin(angle) ** 2])
    missing = -quarters.size % 16 if quarters.size else 0
    table: Array = np.pad(rows, ((0, 0), (0, missing)), mode="edge" if missing else "constant")
    table.flags.writeable = False
    return table


def _computed(
    kernel: Callable[..., object], given: tuple[Array, ...], provided: tuple[Output, ...], wanted: frozenset[str]
) -> Columns:
    return filled_each(kernel, given, tuple(o.name for o in provided), wanted, np.empty(len(given[0]), np.uint8))


def skeleton(parameters: tuple[Parameter, ...]) -> Skeleton:
    """Make the skeleton of carrier, planet and slotted link, in planet radii; without a ratio both gears are equal."""
    whole = "n" in [p.name for p in parameters]

    def centre(angles: Angles, a: Array, n: Array | float = 1.0, mesh: Array | float = 1.0) -> tuple[Array, Array]:
        return a + (n + mesh) * angles.cos, (n + mesh) * angles.sin

    return Skeleton(
        {"a": standing(parameters, "a"), "d": ORIGIN},
        (Link("carrier", ("a", "o")), Link("planet", ("o", "b")), Link("slotted link", ("d", "b"))),
        {"o": moving(parameters, "a n mesh" if whole else "a", (), centre)},
    )


FAMILY = Family(
    **about("geared_dwell"),
    parameters=PARAMETERS,
    position="psi",
    pose_outputs=POSE_OUTPUTS,
    poses=poses,
    uses_phi=True,
    steps=(
        Step("dwell", DWELL_OUTPUTS, dwell),
        Step("stationary points", MAX_OUTPUTS, exact_maxima, lambda accuracy: accuracy.target is not None),
        Step("grid", _SAMPLED_OUTPUTS, sampled_maxima, lambda accuracy: accuracy.samples is not None),
    ),
    derivative_of=ladders("psi"),
    points={"b": ("x_b", "y_b", None)},
    capabilities=(
        Singular.where_small("x_b", "y_b"),
        OutputLink(constant(0.0, 0.0, 0.0)),
        rolling_planet(PARAMETERS),
        skeleton(PARAMETERS),
    ),
)


EPICYCLIC_PARAMETERS = (
    *PARAMETERS,
    Parameter(
        "n", "count", "radius of the fixed gear in planet radii, a whole number", positive=True, default=1.0,
        choices=tuple(float(n) for n in range(1, epicyclic_dwell.MOST_TEETH + 1)),
    ),
    Parameter("mesh", "sign", "+1: planet outside the fixed gear, -1: inside a ring", default=1.0, choices=(-1.0, 1.0)),
)  # fmt: skip

EPICYCLIC_OUTPUTS = (
    *coordinate_outputs("psi", "rad", "output angle in (-pi, pi]", "(2)", "(3)"),
    *_pin_outputs("(1)"),
)

EPICYCLIC_DWELL = _dwell_outputs("(5)", "(6)", "(7)")

# Wanted pose outputs and status of every design at its angles, each (n, m).
epicyclic_poses = poses_of(epicyclic_dwell.poses, epicyclic_dwell.Outputs)


def epicyclic_measures(designs: Array, wanted: frozenset[str], accuracy: Accuracy) -> Columns:
    """Compute dwell measures to rounding: every root is bisected."""
    n = len(designs)
    status, values = np.empty(n, np.uint8), [np.empty(n) for _ in EPICYCLIC_DWELL]
    epicyclic_dwell.dwell_measures(designs, status, *values)
    return chosen({o.name: x for o, x in zip(EPICYCLIC_DWELL, values, strict=True)}, wanted, status)


def planet_turns(designs: Array) -> Array:
    """Return the number of turns of the planet per turn of the carrier, (n,)."""
    n, mesh = (parameter(EPICYCLIC_PARAMETERS, name, designs) for name in ("n", "mesh"))
    return np.abs(n + mesh)


EPICYCLIC = Family(
    **about("epicyclic_dwell"),
    parameters=EPICYCLIC_PARAMETERS,
    position="psi",
    pose_outputs=EPICYCLIC_OUTPUTS,
    poses=epicyclic_poses,
    steps=(Step("dwell", EPICYCLIC_DWELL, epicyclic_measures, work=Work.LONG),),
    derivative_of=ladders("psi"),
    points={"b": ("x_b", "y_b", None)},
    capabilities=(
        Singular.where_small("x_b", "y_b"),
        Waves(planet_turns),
        OutputLink(constant(0.0, 0.0, 0.0)),
        rolling_planet(EPICYCLIC_PARAMETERS),
        skeleton(EPICYCLIC_PARAMETERS),
    ),
)
