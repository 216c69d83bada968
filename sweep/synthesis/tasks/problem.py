"""What a task is to the solver: unknowns in a box, equations, limits, a curve whose largest magnitude is minimised."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple, Protocol

import numpy as np

from sweep.families.base import Array


class Unknown(NamedTuple):
    """A number to be found between two bounds; ``periodic`` if both bounds mean the same."""

    name: str
    low: float
    high: float
    periodic: bool = False


class Candidates(NamedTuple):
    """What n candidates are worth; all nan in a row where there is no mechanism.

    ``equations`` (n, p) vanish at a solution, ``limits`` (n, q) are kept where they are not negative, both scaled so
    that 1 is a large violation.  The objective of a candidate is the largest magnitude in its row of ``curve`` (n, m).
    ``results`` holds the mechanisms: columns of (n,), named as the families name their parameters.
    """

    equations: Array
    limits: Array
    curve: Array
    results: dict[str, Array]


class SynthesisTask(Protocol):
    """One of the tasks with its numbers: what `solve` takes."""

    @property
    def unknowns(self) -> tuple[Unknown, ...]:
        """What is to be found."""

    @property
    def equations(self) -> tuple[str, ...]:
        """Names of the equations, fewer than unknowns or as many."""

    @property
    def limits(self) -> tuple[str, ...]:
        """Names of the limits."""

    @property
    def objective(self) -> str:
        """What is minimised, in words; it chooses among the mechanisms that meet equations and limits."""

    def evaluate(self, x: Array) -> Candidates:
        """Equations, limits, objective curve and mechanisms of candidates x (n, number of unknowns)."""


@dataclass(frozen=True)
class Solution:
    """A mechanism that does a task, or the nearest one found where ``feasible`` is false.

    ``equations`` and ``limits`` hold the remaining residuals and slacks by name; ``objective`` is the largest magnitude
    of the problem's curve, on its samples.
    """

    feasible: bool
    objective: float
    unknowns: dict[str, float]
    mechanism: dict[str, float]
    equations: dict[str, float]
    limits: dict[str, float]

    def __str__(self) -> str:
        """Answer in a few lines."""
        head = "feasible" if self.feasible else "infeasible"
        lines = [f"{head}, objective {self.objective:.6g}"]
        for title, entries in (
            ("unknowns", self.unknowns), ("mechanism", self.mechanism), ("residuals", self.equations),
            ("slacks", self.limits),
        ):  # fmt: skip
            lines.append(f"  {title}: " + ", ".join(f"{name} = {value:.9g}" for name, value in entries.items()))
        return "\n".join(lines)


def stacked(count: int, columns: list[Array]) -> Array:
    """Columns (n,) side by side as (n, k), also for k = 0."""
    return np.column_stack(columns) if columns else np.empty((count, 0))
