"""A given crank-rocker as first stage, and chains that it drives."""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np

from sweep.errors import InputError
from sweep.evaluation.summaries import design_outputs
from sweep.evaluation.tables import design_matrix
from sweep.families import family
from sweep.families.base import Accuracy, Array, Columns, Family
from sweep.synthesis.tasks.crank_rocker import RSSR, turn


class Drive(NamedTuple):
    """A crank-rocker that turns and oscillates: its row of the design matrix and its limits."""

    row: Array
    psi_ext: float
    swing: float
    phi_ext: float
    phi_fold: float

    @classmethod
    def of(cls, design: Mapping[str, float], place: str) -> Drive:
        """Return the limits of a design of ``rssr``.

        Raises
        ------
        InputError
            for a bad design, or one that has no limit positions.
        """
        matrix, _ = design_matrix(RSSR, design)
        names = ("psi_ext", "swing", "phi_ext", "phi_fold")
        found = design_outputs(RSSR, matrix, names, Accuracy(target=1e-12))
        if len(matrix) != 1 or found["status"][0] != 0:
            raise InputError("drive", dict(design), "one crank-rocker that turns fully and oscillates", place)
        return cls(matrix[0], *(float(found[name][0]) for name in names))

    def columns(self, count: int) -> dict[str, Array]:
        """Return its parameters as columns of stage 1."""
        return {f"{name}1": np.full(count, value) for name, value in zip(RSSR.parameter_names, self.row, strict=True)}


def chain_of(second: str) -> Family:
    """Return a crank-rocker and what it drives."""
    return family(["rssr", second])


def chain_motion(chain: Family, columns: Mapping[str, Array], *wanted: str) -> Columns:
    """Return pose outputs of chains over one turn, nan where there is no mechanism or a stage does not reach."""
    rows = np.column_stack([columns[name] for name in chain.parameter_names])
    return chain.poses(rows, turn(), frozenset(wanted))


def second_pressure_limit(motion: Columns, largest: float) -> Array:
    """Return the slack of the limit on the pressure angle of stage 2 over the poses of a turn,
    cos^2 - cos^2[largest].
    """
    angle = np.asarray(motion["pressure_angle2"], np.float64)
    slack: Array = (np.cos(angle) ** 2).min(axis=1) - np.cos(largest) ** 2
    return slack
