"""Slotted links for a wanted crank angle between the limit positions; (8) of docs/slotted.md."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from kernels import status as st
from kernels.families.slotted import crank_of_phi0
from sweep.errors import InputError
from sweep.evaluation.summaries import design_outputs
from sweep.evaluation.tables import design_matrix, parameter_units
from sweep.families import family as find_family
from sweep.families.base import Accuracy, Parameter

if TYPE_CHECKING:
    import pandas as pd

    from sweep.evaluation.tables import Table

_LIMITS = ("phi_ext", "phi_fold", "psi_ext", "psi_fold", "swing", "phi0", "margin", "max_pressure_angle")


@dataclass(frozen=True)
class CentralSlot:
    """The columns of the requirement."""

    name: str = "slotted"
    parameters: tuple[Parameter, ...] = (
        Parameter("phi0", "angle", "crank angle of the shorter stroke, below 180 deg"),
        Parameter("e", "length", "common perpendicular"),
        Parameter("f", "length", "offset of the crank plane", default=0.0),
        Parameter("alpha", "angle", "angle from the crank axis to the driven axis", default=0.0),
    )

    @property
    def parameter_names(self) -> tuple[str, ...]:
        """Columns of the requirement in order."""
        return tuple(p.name for p in self.parameters)


def central_slots(table: Table) -> pd.DataFrame:
    """Return fork slots with s = 0 for a wanted crank angle between the limit positions,
    one row per row of the table.

    Parameters
    ----------
    table : DataFrame or mapping with phi0 [rad], the crank angle of the shorter stroke, below pi; e; f and alpha (0)

    Returns
    -------
    DataFrame
        the parameters of ``slotted``; ``phi_ext phi_fold psi_ext psi_fold swing phi0`` of the mechanism found, where
        extended is the larger psi, so that ``phi0`` is the wanted angle or 2 pi minus it; ``margin`` (1),
        ``max_pressure_angle`` (0) and ``status``: OK, or NOT_ADMISSIBLE where both axes meet at the driven pivot or
        alpha is a right angle.

    Raises
    ------
    InputError
        for a missing or misspelt column, a bad number, a phi0 outside (0, pi).
    """
    import pandas as pd

    matrix, _ = design_matrix(CentralSlot(), table)
    phi0, e, f, alpha = matrix.T.copy()
    bad = ~((phi0 > 0.0) & (phi0 < np.pi))
    if bad.any():
        row = int(np.argmax(bad))
        raise InputError("phi0", float(phi0[row]), "an angle between 0 and pi", f"column phi0, row {row}")
    status, a = np.empty(len(matrix), np.uint8), np.empty(len(matrix))
    crank_of_phi0(phi0, e, f, alpha, status, a)
    slotted = find_family("slotted")
    given = {"a": a, "e": e, "f": f, "alpha": alpha}
    columns: dict[str, object] = {p.name: given.get(p.name, p.default or 0.0) for p in slotted.parameters}
    index = table.index if isinstance(table, pd.DataFrame) else pd.RangeIndex(len(matrix))
    frame = pd.DataFrame(columns, index=index)
    alive = np.flatnonzero(status == st.OK)
    turn = design_outputs(slotted, frame.to_numpy()[alive], list(_LIMITS), Accuracy(target=1e-12))
    status[alive] = turn["status"]
    for name in _LIMITS:
        values = np.full(len(matrix), np.nan)
        values[alive] = turn[name]
        frame[name] = values
    frame["status"] = status
    limits = dict.fromkeys(_LIMITS, "rad") | {"margin": "1"}
    frame.attrs["units"] = parameter_units(slotted.parameters) | limits
    return frame
