"""Margins of curves along the turn: standard deviations of pose outputs, as functions of the design."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from sweep.families.base import Angles, Array, Family
from sweep.optimise.extrema.points import STEP
from sweep.optimise.local.least_squares import least_squares
from sweep.optimise.problem.program import Program
from sweep.optimise.problem.statement import Problem

POSES, HARMONICS = 64, 16  # poses per turn at which the margin is computed, and harmonics of the sum through it
SMOOTH = 0.02  # share of a margin by which it changes at most over twice that step, unless it jumps
MOVED = 1e-4  # share of a variable's bounds: step of the difference of exact derivatives, accurate to 1e-4


@dataclass(frozen=True)
class CurveMargin:
    """Trigonometric sum with (M,) coefficients ``constant + slopes @ (values of the columns - place)``.

    ``columns`` (V,) of the design matrix, ``reference`` (V,) their values at which the sum is exact, ``slopes`` (M, V).
    """

    columns: tuple[int, ...]
    reference: Array
    constant: Array
    slopes: Array

    def times(self, level: float) -> CurveMargin:
        """Return the margin multiplied by ``level``."""
        return replace(self, constant=level * self.constant, slopes=level * self.slopes)

    def at(self, designs: Any, phi: Array) -> Any:
        """Return the margin (n, m) of designs (n, P), which may have imaginary parts, at crank angles (m,)."""
        offset = designs[:, list(self.columns)] - self.reference
        return trigonometric_sum(self.constant + offset @ self.slopes.T, phi)

    def slope(self, design: Array, phi: Array) -> Array:
        """Return the derivative (m,) of the margin of one design (P,) by the crank angle."""
        offset = design[list(self.columns)] - self.reference
        return np.asarray(trigonometric_sum((self.constant + self.slopes @ offset)[None, :], phi, True)[0], np.float64)


@dataclass(frozen=True)
class Allowance:
    """Margin of a limit beyond a fixed amount: ``slopes`` (V,) times the changes of the parameters ``names``.

    ``reference`` (V,) are the values of these parameters at which the fixed amount is exact.  Tops and dips keep the
    distance ``at_edges`` from the edges of a window, a share of the window.
    """

    names: tuple[str, ...] = ()
    reference: Array = field(default_factory=lambda: np.empty(0))
    slopes: Array = field(default_factory=lambda: np.empty(0))
    at_edges: float = 0.0

    def times(self, level: float) -> Allowance:
        """Return the allowance multiplied by ``level``."""
        return replace(self, slopes=level * self.slopes, at_edges=level * self.at_edges)


def allowances(problem: Problem, design: Array, spread: Callable[[Array], dict[str, float]]) -> dict[str, Allowance]:
    """Return the first-order changes of the margins of some outputs with the variables.

    A margin that jumps, as where another extremum becomes the largest, has none.

    Parameters
    ----------
    problem : its variables are those that may change
    design : (P,)
    spread : returns the margin of every output of a design
    """
    designs, moves = _neighbours(problem, design)
    here, *margins = (spread(row) for row in designs)
    n, columns = len(moves), list(problem.columns)
    names = tuple(problem.family.parameter_names[k] for k in columns)
    change = {name: np.array([margins[k][name] - margins[n + k][name] for k in range(n)]) for name in margins[0]}
    return {
        name: Allowance(names, design[columns], _shortest_slopes(moves, values))
        for name, values in change.items()
        if np.abs(values).max() <= SMOOTH * here[name]
    }


def _neighbours(problem: Problem, design: Array) -> tuple[Array, Array]:
    """Return a design with its neighbours one step up and down in every variable, and the differences of columns."""
    n = len(problem.variables)
    steps = np.concatenate([np.zeros((1, n)), MOVED * np.eye(n), -MOVED * np.eye(n)])
    designs = problem.placed(design, problem.scaled(design[None, :])[0] + steps)
    return designs, np.stack([designs[1 : n + 1, k] - designs[n + 1 :, k] for k in problem.columns], axis=1)


def trigonometric_sum(coefficients: Any, phi: Array, derivative: bool = False) -> Any:
    """Sum ``c_0 + sum over k of (c_(2k-1) cos k phi + c_2k sin k phi)`` or its derivative by phi, (n, m).

    Parameters
    ----------
    coefficients : (n, 2 K + 1), which may have imaginary parts
    phi : (m,) angles in rad
    derivative : whether the derivative is returned
    """
    k = np.arange(1, coefficients.shape[1] // 2 + 1)
    powers = np.exp(1j * phi)[None, :].repeat(len(k), axis=0).cumprod(axis=0)  # faster than computing cosines and sines
    cosines, sines = coefficients[:, 1::2], coefficients[:, 2::2]
    if derivative:
        return (k * sines) @ powers.real - (k * cosines) @ powers.imag
    return coefficients[:, :1] + cosines @ powers.real + sines @ powers.imag


def curves_with_margin(problem: Problem) -> dict[str, str]:
    """Return the pose outputs whose limits can have a margin along the turn, by the names of these limits.

    The limits bound largest and smallest values, and no other kind of limit uses the same curve.
    """
    program = Program(problem)
    measures = [program.objective, *(r.measure for r in program.requirements)]
    # The margin raises maxima and lowers minima: a largest value with a lower limit needs the opposite sign.
    opposite = {
        r.measure.name
        for r in program.requirements
        if (r.maximum if r.measure.kind == "min" else r.minimum) is not None
    }
    kinds = ("max_abs", "max", "min")
    one_curve = {m.name for m in measures if m.kind in kinds and len(m.series) == 1 and m.name not in opposite}
    other_curves = {s.output for m in measures if m.name not in one_curve for s in m.series}
    limits = {r.measure.name: r.measure.series[0] for r in program.requirements if r.measure.name in one_curve}
    return {
        name: s.output
        for name, s in limits.items()
        if s.output not in other_curves and not s.scale and not s.wrapped and name != problem.objective
    }


def curve_margins(problem: Problem, design: Array, sigma: Array, levels: Mapping[str, float]) -> dict[str, CurveMargin]:
    """Return standard deviations of pose outputs along the turn, and their changes with the variables.

    Parameters
    ----------
    problem : its variables are those that may change
    design : (P,)
    sigma : (P,) standard deviations of the dimensions
    levels : number of standard deviations of each pose output; an output with a value that is not finite is left out
    """
    n = len(problem.variables)
    # Parameters that follow from coordinates move together: take the shortest slopes that reproduce their changes.
    designs, moves = _neighbours(problem, design)
    turn: Array = np.arange(POSES, dtype=np.float64) * (2.0 * math.pi / POSES)
    derivatives = curve_derivatives(problem.family, designs, sigma, tuple(levels), turn)
    columns = tuple(problem.columns)
    basis = np.array([trigonometric_sum(row[None, :], turn)[0] for row in np.eye(2 * HARMONICS + 1)])
    weights = basis * (np.where(np.arange(len(basis)) == 0, 1.0, 2.0) / POSES)[:, None]
    margins = {}
    for name, level in levels.items():
        spread = level * np.sqrt((derivatives[name] ** 2).sum(axis=1))
        if not np.isfinite(spread).all():
            continue
        coefficients = spread @ weights.T
        change = coefficients[1 : n + 1] - coefficients[n + 1 :]
        slopes = np.array([_shortest_slopes(moves, change[:, k]) for k in range(change.shape[1])])
        margins[name] = CurveMargin(columns, design[list(columns)], coefficients[0], slopes)
    return margins


def _shortest_slopes(moves: Array, change: Array) -> Array:
    """Return the shortest slopes (V,) that explain the changes (n,) by the moves (n, V) of the columns."""
    scale = np.abs(moves).max(axis=0)
    scale[scale == 0.0] = 1.0
    return np.asarray(least_squares(moves / scale, change, 1e-10) / scale, np.float64)


def curve_derivatives(
    family: Family, designs: Array, sigma: Array, outputs: Sequence[str], phi: Array
) -> dict[str, Array]:
    """Return the changes of outputs for a deviation of one dimension by its standard deviation, by the complex step.

    Parameters
    ----------
    family : family of the designs
    designs : (n, P)
    sigma : (P,) standard deviations; an exact dimension has 0 and no row
    outputs : names of pose outputs
    phi : (m,) crank angles

    Returns
    -------
    For each output (n, q, m), one row per inexact dimension.  The root of the sum of their squares is the standard
    deviation of the curve there, to first order and for independent dimensions; nan for designs with a nan.
    """
    varied = np.flatnonzero(sigma)
    # Complex kernels raise on a division by zero: designs with nan are left out.
    finite = np.flatnonzero(np.isfinite(designs).all(axis=1))
    stepped = np.repeat(designs[finite].astype(np.complex128), len(varied), axis=0)
    stepped[np.arange(len(stepped)), np.tile(varied, len(finite))] += 1j * STEP * np.tile(sigma[varied], len(finite))
    angles = Angles.of(phi[None, :].astype(np.complex128))
    with np.errstate(all="ignore"):  # a design may not reach every pose; the caller handles its nan
        columns = family.poses(np.ascontiguousarray(stepped), angles, frozenset(outputs))
    out = {name: np.full((len(designs), len(varied), len(phi)), np.nan) for name in outputs}
    for name, values in out.items():
        values[finite] = (columns[name].imag / STEP).reshape(len(finite), len(varied), len(phi))
    return out
