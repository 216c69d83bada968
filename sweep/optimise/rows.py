"""The epigraph program of one design: rows ``c = constant + matrix @ atoms + slack * t``, to be >= 0 or = 0.

Atoms are what the gradients know: the curves at K points, the crank angles of these points, and plain numbers.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from sweep.families.base import Array
from sweep.optimise.dense import times
from sweep.optimise.points import Points

AT_HAND = 0.6  # scaled distance from its bound beyond which a row is left out at first
FAR = 1e3  # stands for a row that cannot be computed at a trial design: far outside, but a number


@dataclass(frozen=True)
class Label:
    """What a row stands for: an output and its side, "objective", "minimum", "maximum" or "equal".

    ``per`` turns the row's multiplier into one per relative change of the bound: the bound over the row's scale.
    """

    name: str
    side: str
    per: float = 1.0


@dataclass(frozen=True)
class Form:
    """Rows of the program and the points whose curves they use.

    ``complete`` says that the design turns and every limit exists for it, ``reaches`` that every stage assembles
    somewhere, so that its margin says how far it is from turning.
    """

    points: Points
    scalars: tuple[str, ...]
    matrix: Array
    constant: Array
    slack: Array
    equal: NDArray[np.bool_]
    labels: tuple[Label, ...]
    complete: bool
    reaches: bool

    def rows(self, atoms: Array, t: float) -> Array:
        """Return the rows' values; a row that is nan counts as far outside."""
        if np.isfinite(atoms).all():
            return np.asarray(self.constant + times(self.matrix, atoms) + self.slack * t)
        far = times(self.matrix, np.nan_to_num(atoms, nan=1e30))
        return np.nan_to_num(self.constant + far + self.slack * t, nan=-FAR)

    def objective(self, atoms: Array) -> float:
        """Return the largest of the objective's rows: the smallest t they allow."""
        own = np.array([label.side == "objective" for label in self.labels], dtype=np.bool_)
        if not own.any():
            return math.inf
        return float(-(self.constant + times(self.matrix, atoms))[own].min())

    def violation(self, atoms: Array) -> float:
        """Return the largest scaled violation of the limits;
        infinite where one of them does not exist for this design.
        """
        if not self.complete:
            return math.inf
        return self.known_violation(atoms)

    def known_violation(self, atoms: Array) -> float:
        """Return the largest scaled violation of those limits that exist for this design;
        infinite where it reaches nowhere.
        """
        if not self.reaches:
            return math.inf
        c = self.constant + times(self.matrix, atoms)
        own = np.array([label.side != "objective" for label in self.labels], dtype=np.bool_)
        if np.isnan(c[own]).any():
            return math.inf
        return float(np.maximum(np.where(self.equal, np.abs(c), -c)[own], 0.0).max(initial=0.0))

    def near(self, atoms: Array, t: float) -> Form:
        """Return the form without the rows that are far inside: no short step reaches them."""
        keep = (self.rows(atoms, t) < AT_HAND) | self.equal
        labels = tuple(label for label, kept in zip(self.labels, keep, strict=True) if kept)
        return replace(
            self, matrix=self.matrix[keep], constant=self.constant[keep], slack=self.slack[keep],
            equal=self.equal[keep], labels=labels,
        )  # fmt: skip

    def relaxed(self, hard: set[str]) -> Form:
        """Return the elastic program: smallest t by which all limits but the ``hard`` ones have to give way."""
        keep = np.array([label.side != "objective" for label in self.labels], dtype=np.bool_)
        soft = np.array([label.name not in hard for label in self.labels], dtype=np.float64)[keep]
        both = self.equal[keep]
        matrix, constant = self.matrix[keep], self.constant[keep]
        labels = tuple(label for label, kept in zip(self.labels, keep, strict=True) if kept)
        return replace(
            self,
            matrix=np.concatenate([matrix, -matrix[both]]),
            constant=np.concatenate([constant, -constant[both]]),
            slack=np.concatenate([soft, soft[both]]),
            equal=np.zeros(len(labels) + int(both.sum()), dtype=np.bool_),
            labels=labels + tuple(label for label, twice in zip(labels, both, strict=True) if twice),
        )
