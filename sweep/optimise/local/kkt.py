"""Optimality of a result: multipliers, residual, active limits in words, agreement of the starts."""

from __future__ import annotations

import math
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from kernels import status as st
from sweep.families.base import Array
from sweep.numerics.records import Mask
from sweep.optimise.local.least_squares import non_negative
from sweep.optimise.problem.rows import Form, Label

ACTIVE = 1e-6  # a row within this of its bound (scaled) may carry a multiplier
EDGE = 1e-10  # a variable within this of its bound, as a fraction of the bounds, may carry a multiplier
AGREE = 1e-4  # starts whose objective is within this of the best agree

NO_VALUE = "has no value"  # of an output that a design lacks since it does not turn
CAVEAT = (
    "The conditions hold at a local optimum; starts that agree make a better one less likely, they do not exclude it: "
    "this is no proof of a global optimum."
)

WORDS = {"minimum": "at its minimum", "maximum": "at its maximum", "equal": "held by its equation"}


@dataclass(frozen=True)
class Multipliers:
    """Least-squares multipliers: ``gradient of t = sum weights * gradient of rows + bounds``.

    ``residual`` is the largest component of the remainder, for variables scaled to their bounds and the objective
    scaled by its value at the start; ``bounds`` holds the multipliers of the lower (+) and upper (-) bounds.
    """

    weights: Array
    bounds: Array
    at_bound: Mask
    residual: float


def multipliers(form: Form, rows: Array, jacobian: Array, fractions: Array, tolerance: float = ACTIVE) -> Multipliers:
    """Return multipliers of the active rows and bounds by non-negative least squares (any sign for equations).

    Parameters
    ----------
    form : the program at the design
    rows : (R,) its rows there
    jacobian : (R, n) their gradients by the scaled variables
    fractions : (n,) scaled variables
    tolerance : largest scaled distance from the bound of a row with a multiplier
    """
    n = len(fractions)
    active = np.flatnonzero((rows <= tolerance) | form.equal)
    lower, upper = np.flatnonzero(fractions <= EDGE), np.flatnonzero(fractions >= 1.0 - EDGE)
    if not np.isfinite(jacobian[active]).all():
        return Multipliers(np.zeros(len(rows)), np.zeros(n), np.zeros(n, np.bool_), math.nan)
    gradients = np.column_stack([jacobian[active], form.slack[active]]).T
    equations = gradients[:, form.equal[active]]
    bound_gradients = np.zeros((n + 1, len(lower) + len(upper)))
    bound_gradients[lower, np.arange(len(lower))] = 1.0
    bound_gradients[upper, len(lower) + np.arange(len(upper))] = -1.0
    matrix = np.concatenate([gradients, -equations, bound_gradients], axis=1)
    target = np.concatenate([np.zeros(n), [1.0]])
    # Small columns beside very large ones would be missed by the choice of the active set.
    norms = np.sqrt((matrix * matrix).sum(axis=0))
    norms[norms == 0.0] = 1.0
    solution = non_negative(matrix / norms, target) / norms
    residual = np.abs(matrix @ solution - target).max()
    weights = np.zeros(len(rows))
    weights[active] = solution[: len(active)]
    weights[active[form.equal[active]]] -= solution[len(active) : len(active) + equations.shape[1]]
    bound_weights = solution[len(active) + equations.shape[1] :]
    bounds = np.zeros(n)
    bounds[lower] += bound_weights[: len(lower)]
    bounds[upper] -= bound_weights[len(lower) :]
    at_bound = bounds != 0.0
    complementarity = np.abs(weights * rows)[~form.equal].max(initial=0.0)
    return Multipliers(weights, bounds, at_bound, float(max(residual, complementarity)))


@dataclass(frozen=True)
class Result:
    """Outcome of a search from one start.

    ``design`` (P,) is in the family's units.  ``gap`` is the difference between the maximum that the search used and
    the true one found afterwards on a finer grid, relative to the objective.  ``violation`` is the largest scaled
    violation; ``relaxation`` is the amount by which each violated limit would have to be relaxed, in the unit of its
    output.  ``multipliers`` are relative changes of the objective (of cos^2 of a pressure angle) per relative change of
    each active limit (of sin^2 of a pressure angle, of a margin itself; per width between the bounds of a variable),
    negative only for equations.  If infeasible, they are changes of the smallest relaxation per relative change of each
    limit, and ``kkt_residual`` is that of the smallest relaxation.  ``status`` is OK, LIMIT_EXCEEDED (infeasible) or
    NOT_CONVERGED, and ``ended`` is the ending of the search: "converged", "stalled", "differs" (from the values of
    ``summarise``, see :mod:`sweep.optimise.local.start`), "infeasible", "looks", "time" or "interrupted".  ``basin``
    numbers the values at which starts ended, 1 for the best, 0 if infeasible; ``looks`` counts the evaluations.
    """

    start: int
    design: Array
    objective: float
    gap: float
    violation: float
    kkt_residual: float
    active: tuple[str, ...]
    multipliers: dict[str, float]
    relaxation: dict[str, float]
    values: dict[str, float]
    status: int
    ended: str
    agree: int = 1
    basin: int = 0
    looks: int = 0

    @property
    def feasible(self) -> bool:
        """Whether every limit is kept."""
        return self.status != st.LIMIT_EXCEEDED

    @property
    def rank(self) -> tuple[bool, float]:
        """Sort key of results: feasible ones by their objective, then infeasible ones by their violation."""
        value = self.objective if self.feasible else self.violation
        return not self.feasible, math.inf if math.isnan(value) else value

    @property
    def given_way(self) -> str:
        """``relaxation`` in words."""
        return "; ".join(
            f"{name} {NO_VALUE if math.isnan(short) else f'by {short:.6g}'}" for name, short in self.relaxation.items()
        )


def noted(result: Result) -> dict[str, Any]:
    """Return a result as a dict that JSON can store."""
    return asdict(result) | {"design": result.design.tolist()}


def result_of(part: dict[str, Any]) -> Result:
    """Return the result stored as a dict."""
    return Result(**part | {"design": np.array(part["design"], np.float64), "active": tuple(part["active"])})


def in_words(labels: tuple[Label, ...], duals: Multipliers, variables: tuple[str, ...]) -> dict[str, float]:
    """Return active limits and bounds with their multipliers, by name; multipliers of one limit's points are added."""
    words: dict[str, float] = {}
    for label, weight in zip(labels, duals.weights, strict=True):
        if label.side != "objective" and abs(weight) > 1e-9:
            text = f"{label.name} {WORDS[label.side]}"
            words[text] = words.get(text, 0.0) + float(weight) * label.bound_ratio
    for name, weight in zip(variables, duals.bounds, strict=True):
        if abs(weight) > 1e-9:
            words[f"{name} at its {'lower' if weight > 0 else 'upper'} bound"] = abs(float(weight))
    return words
