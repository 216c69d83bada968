"""What a study without an optimiser leaves to the report: the reference's outputs, and curves over one turn."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from sweep.errors import InputError
from sweep.evaluation.curves import joint_curves, motion_curves
from sweep.exchange.scene import over
from sweep.families.base import Angles
from sweep.families.domain import Interval
from sweep.report.mechanisms import exists

if TYPE_CHECKING:
    import pandas as pd

    from sweep.evaluation.joints import Part
    from sweep.study import Study

POSES = 720
JOINT_POSES = 180  # of paths in a drawing


def reference_row(study: Study) -> dict[str, float] | None:
    """Return parameters and outputs of the study's reference design, computed as the sweep computes its designs."""
    if study.reference is None:
        return None
    from sweep.evaluation.summaries import design_outputs
    from sweep.evaluation.tables import design_matrix

    matrix, _ = design_matrix(study.family, study.reference)
    outputs = design_outputs(study.family, matrix, study.want, study.accuracy, study.window)
    parameters = dict(zip(study.family.parameter_names, matrix[0].tolist(), strict=True))
    return parameters | {name: float(values[0]) for name, values in outputs.items()}


def parts_over_turn(study: Study, rows: Mapping[str, Mapping[str, Any]]) -> dict[str, list[Part]]:
    """Return joints and links over one closed turn, for every role whose design has a pose."""
    found = {}
    for role, row in rows.items():
        design = {name: float(row[name]) for name in study.family.parameter_names}
        try:
            parts = over(study.family, design, 0.0, JOINT_POSES)
        except InputError:  # a mechanism without joints has curves only
            return {}
        if exists(parts):
            found[role] = parts
    return found


def curves(study: Study, rows: Mapping[str, Mapping[str, Any] | None]) -> pd.DataFrame:
    """Return poses over one turn of the design of every role, as ``_curves.parquet`` holds them."""
    import pandas as pd

    family = study.family
    # Over an interval there is no turn to draw.
    over_turn = not isinstance(family.domain, Interval)
    known = {role: row for role, row in rows.items() if row is not None and over_turn}
    names = [*motion_curves(family), *joint_curves(family)]
    matrix = np.array([[float(row[p]) for p in family.parameter_names] for row in known.values()])
    phi = np.arange(POSES, dtype=np.float64) * (2.0 * np.pi / POSES)
    columns = family.poses(
        matrix.reshape(len(known), len(family.parameters)), Angles.of(phi[None, :]), frozenset(names)
    )
    head = {"role": np.repeat(list(known), POSES), "phi": np.tile(phi, len(known))}
    return pd.DataFrame(head | {name: columns[name].ravel() for name in [*names, "status"]})
