"""Crank-rockers on their locus, the first stage of every task, and the engineering method, which optimises them.

Task 4 is its planar case, the problem of Alt.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from functools import lru_cache
from typing import Literal, TypeAlias

import numpy as np

from kernels import synthesis as kernels
from sweep.effects import extended
from sweep.evaluation.summaries import design_outputs
from sweep.evaluation.tables import design_matrix
from sweep.families import family
from sweep.families.base import Accuracy, Angles, Array
from sweep.synthesis.tasks.problem import Candidates, SynthesisTask, Unknown, turning

Number: TypeAlias = Array | float

POSES = 180
MISSED = 1e-4  # share of the largest magnitude by which a peak is missed; samples with their tops are good to 1e-5
RSSR = family("rssr")
_EXACT = Accuracy(target=1e-10)
PEAK = Accuracy(target=0.1 * MISSED)


@lru_cache(maxsize=8)
def turn(poses: int = POSES) -> Angles:
    """Return equidistant crank angles of one turn, (1, poses)."""
    phi: Array = np.arange(poses, dtype=np.float64)[None, :] * (2.0 * np.pi / poses)
    return Angles.of(phi)


def broadcast_columns(*columns: Array | float) -> Array:
    """Return columns, or numbers that represent whole columns, side by side."""
    return np.column_stack(np.broadcast_arrays(*columns)).astype(np.float64)


def designs_on_locus(
    swing: Number, phi0: Number, phi1: Array, e: Number, f: Number, g: Number, alpha: Number
) -> tuple[Array, Array]:
    """Return designs (n, 8) and rocker angles psi1 (n,) of the extended position; nan if a test (i)-(iii) fails."""
    requirements = broadcast_columns(swing, phi0, phi1, e, f, g, alpha)
    n = len(requirements)
    designs, psi1 = np.empty((n, 8)), np.empty(n)
    kernels.rssr_on_locus(requirements, np.empty(n, np.uint8), np.empty(n, np.uint8), designs, psi1)
    return designs, psi1


def acceleration(designs: Array) -> Array:
    """Return the acceleration analogue of the rocker over a turn with its largest magnitude, as `with_peak` does."""
    true = outputs_of(designs, ["max_abs_d2psi"], PEAK)["max_abs_d2psi"]
    return with_peak(with_tops(RSSR.values(designs, turn(), "d2psi")[0]), true)


def with_peak(curve: Array, peak: Array) -> Array:
    """Add a column to samples of a turn, (n, m): a peak, (n,), that they miss, as they do beside a dead point; or 0."""
    seen = np.abs(peak) <= (1.0 + MISSED) * np.abs(curve).max(axis=1)  # nan, where the crank does not turn, stays
    return np.column_stack([curve, np.where(seen, 0.0, peak)])


def with_tops(curve: Array) -> Array:
    """Replace samples of a turn, (n, m), next to an extreme by the extreme of the parabola through three samples.

    ``away`` is the distance of the parabola's extreme from the middle sample, in samples.  Up to a half the extreme is
    taken in full; from there to one and a half what it adds falls to nothing.  So the largest magnitude changes
    continuously with the dimensions, without a corner where the next sample becomes the highest.
    """
    before, after = np.roll(curve, 1, axis=1), np.roll(curve, -1, axis=1)
    slope, bend = 0.5 * (after - before), after - 2.0 * curve + before
    away = np.abs(np.divide(slope, bend, out=np.full(curve.shape, np.inf), where=bend != 0.0))
    raised: Array = curve - 0.5 * bend * np.minimum(away, 0.5) ** 2 * np.clip(1.5 - away, 0.0, 1.0)
    return raised


def outputs_of(designs: Array, names: Iterable[str], accuracy: Accuracy) -> dict[str, Array]:
    """Return design outputs of crank-rockers, (n,) each; nan if there is no mechanism."""
    alive = np.isfinite(designs).all(axis=1)
    outputs = design_outputs(RSSR, designs[alive], list(names), accuracy)
    columns = {name: np.full(len(designs), np.nan) for name in names}
    for name, column in columns.items():
        column[alive] = outputs[name]
    return columns


def pressure_limit(designs: Array, largest: float) -> Array:
    """Return the slack of the limit on the pressure angle, cos^2 - cos^2[largest]; pi/2 requires a full turn only.

    The smallest cos^2 over the turn is exact; nan if there is no mechanism.
    """
    slack: Array = outputs_of(designs, ["margin"], _EXACT)["margin"] - np.cos(largest) ** 2
    return slack


def bearing_reserve(designs: Array, bearings: Mapping[str, float]) -> Array:
    """Return the least reserve of the rocker's bearings over a turn, (n,): permissible minus actual pressure angle.

    Step 3 of the engineering method.  ``bearings`` are the inputs of the effect ``sliding_bearings`` with its limits,
    or of ``rolling_bearings``, its torque among them; nan where there is no mechanism.
    """
    rolling = "theta1_reserve_rolling"
    name = rolling if "dynamic_capacity" in bearings else "theta1_reserve"
    with_bearings, least = extended(RSSR, [f"min_{name}"]), np.full(len(designs), np.nan)
    alive = np.isfinite(designs).all(axis=1)
    matrix = design_matrix(with_bearings, {**named(designs[alive]), **bearings})[0]
    least[alive] = with_bearings.values(matrix, turn(), name)[0].min(axis=1)
    return least


def named(designs: Array, suffix: str = "") -> dict[str, Array]:
    """Return a design matrix as columns by name."""
    return {f"{name}{suffix}": column for name, column in zip(RSSR.parameter_names, designs.T, strict=True)}


@dataclass(frozen=True)
class LocusTask(SynthesisTask):
    """A task about a crank-rocker with given limit positions; the fields are those of `EngineeringMethod`."""

    swing: float
    phi0: float
    e: float
    g: float
    alpha: float

    def drive(self, phi1: Array, f: Number) -> tuple[Array, Array]:
        """Return designs (n, 8) at places phi1 of the locus with offset f, and psi1 (n,) of the extended position."""
        return designs_on_locus(self.swing, self.phi0, phi1, self.e, f, self.g, self.alpha)


@dataclass(frozen=True)
class EngineeringMethod(LocusTask):
    """Swing, phi0, e, g, alpha are given; the place phi1 on the locus and the offset f of the crank plane are unknown.

    Parameters
    ----------
    swing, phi0 : rocker angle (signed) and crank angle from the extended to the folded position [rad]
    e, g, alpha : position of the rocker axis and of the rocker's plane on it [length, rad]
    f_range : range of f [length]; two equal numbers fix it.  With alpha = 0 only f - g matters.
    objective : "acceleration", max |d2psi|, or "pressure_angle", the largest over the turn
    bearings : bearings of the rocker, inputs of `bearing_reserve`: they bound the radial pressure angle
    bounds : bounds of results by name: the lengths a, b, c, and the place x_ext, y_ext of the rocker ball at the
        extended position, from the rocker axis: a box for the joint C1
    """

    f_range: tuple[float, float]
    objective: Literal["acceleration", "pressure_angle"] = "acceleration"
    bearings: Mapping[str, float] = field(default_factory=dict)

    @property
    def unknowns(self) -> tuple[Unknown, ...]:
        """phi1, and f if it is free."""
        low, high = self.f_range
        return (turning("phi1"),) if low == high else (turning("phi1"), Unknown("f", low, high))

    def candidates(self, x: Mapping[str, Array]) -> Candidates:
        """Compute equations, limits, curve and mechanisms of candidates from their unknowns, (n,) each."""
        designs, psi1 = self.drive(x["phi1"], x.get("f", self.f_range[0]))
        columns = named(designs)
        columns |= {"x_ext": columns["c"] * np.cos(psi1), "y_ext": columns["c"] * np.sin(psi1)}
        if self.objective == "acceleration":
            curve = acceleration(designs)
        else:
            curve = outputs_of(designs, ["max_pressure_angle"], _EXACT)["max_pressure_angle"][:, None]
        limits = {"pressure angle": pressure_limit(designs, self.max_pressure_angle)}
        limits |= {"bearings": bearing_reserve(designs, self.bearings)} if self.bearings else {}
        return Candidates({}, limits, curve, columns)

    def offset_ranges(self, places: int = 180, offsets: int = 181) -> list[tuple[float, float]]:
        """Return the ranges of f in which some place of the locus satisfies all limits: step 3 of the method.

        They are found on a grid of places and offsets: an end is accurate to a step of the grid.
        """
        f: Array = np.linspace(*self.f_range, offsets, dtype=np.float64)
        phi1: Array = np.arange(places, dtype=np.float64) * (2.0 * np.pi / places)
        slacks = (self.evaluate(broadcast_columns(phi1, x)).limits.values() for x in f)
        feasible = np.array([(np.min([*limits], axis=0) >= 0.0).any() for limits in slacks])
        edges = np.flatnonzero(np.diff(np.concatenate([[False], feasible, [False]]).astype(np.int8)))
        return [(float(f[a]), float(f[b - 1])) for a, b in edges.reshape(-1, 2)]


@dataclass(frozen=True)
class Task4(EngineeringMethod):
    """The engineering method in the plane: alpha = 0, f = g; the only unknown is phi1.

    Given are swing, phi0 and the frame e; the objective "pressure_angle" gives the best transmission, "acceleration"
    the smoothest motion.
    """

    g: float = field(default=0.0, init=False)
    alpha: float = field(default=0.0, init=False)
    f_range: tuple[float, float] = field(default=(0.0, 0.0), init=False)
