"""Task 3: an adjustable crank-rocker: two settings that differ in one dimension; which dimension adjusts what."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Literal

import numpy as np

from kernels import synthesis as kernels
from kernels.synthesis.sensitivity import PARAMETERS
from sweep.errors import InputError
from sweep.families.base import Accuracy, Array
from sweep.summaries import design_outputs
from sweep.synthesis.tasks.crank_rocker import (
    RSSR,
    designs_on_locus,
    motion,
    named,
    pressure_limit,
    size_limits,
    size_names,
    turn,
)
from sweep.synthesis.tasks.problem import Candidates, Unknown, stacked
from sweep.tables import design_matrix

if TYPE_CHECKING:
    import pandas as pd

_EXACT = Accuracy(target=1e-12)
ALONE = 10.0  # so many times more strongly: the dimension adjusts that quantity alone


@dataclass(frozen=True)
class Task3:
    """To be found: phi1, f and the second setting of one dimension.

    Parameters
    ----------
    swing, phi0 : of the first setting, signed and in the crank's sense [rad]
    second_swing, second_phi0 : of the second setting; ``second_phi0=None`` leaves it free
    adjusted : the dimension that differs, and ``adjusted_range``, where its second value is looked for
    e, g, alpha : as `EngineeringMethod`; the first setting, if e or g is the dimension adjusted
    f_range : where f is looked for
    max_pressure_angle : limit over the whole turn in both settings [rad]
    bounds : of the lengths found, by name (a, b, c)

    Raises
    ------
    InputError
        if both settings ask for the same.
    """

    swing: float
    phi0: float
    second_swing: float
    second_phi0: float | None
    adjusted: Literal["a", "b", "c", "e", "f", "g"]
    adjusted_range: tuple[float, float]
    e: float
    g: float
    alpha: float
    f_range: tuple[float, float]
    max_pressure_angle: float = 0.5 * np.pi
    bounds: Mapping[str, tuple[float, float]] = field(default_factory=dict)

    objective: str = field(default="largest |d2psi| of both settings", init=False)

    def __post_init__(self) -> None:
        if self.second_swing == self.swing and self.second_phi0 in (None, self.phi0):
            raise InputError("second_swing", self.second_swing, "another swing or phi0 than the first", "Task3")

    @property
    def unknowns(self) -> tuple[Unknown, ...]:
        """phi1, f and the second value of the adjusted dimension."""
        return (
            Unknown("phi1", 0.0, 2.0 * np.pi, periodic=True),
            Unknown("f", *self.f_range),
            Unknown(f"second_{self.adjusted}", *self.adjusted_range),
        )

    @property
    def equations(self) -> tuple[str, ...]:
        """What the second setting has to do."""
        return ("second swing",) if self.second_phi0 is None else ("second swing", "second phi0")

    @property
    def limits(self) -> tuple[str, ...]:
        """Pressure angles of both settings, bounds of the lengths."""
        return ("pressure angle", "second pressure angle", *size_names(self.bounds))

    def evaluate(self, x: Array) -> Candidates:
        """See `Problem`."""
        ones = np.ones(len(x))
        fixed = (self.swing * ones, self.phi0 * ones, x[:, 0], self.e * ones, x[:, 1])
        first, _ = designs_on_locus(*fixed, self.g * ones, self.alpha * ones)
        second = first.copy()
        second[:, RSSR.parameter_names.index(self.adjusted)] = x[:, 2]
        second[np.isnan(first).any(axis=1)] = np.nan
        alive = np.flatnonzero((second[:, :3] > 0.0).all(axis=1))
        limits = design_outputs(RSSR, second[alive], ["swing", "phi0"], _EXACT)
        equations = np.full((len(x), len(self.equations)), np.nan)
        equations[alive, 0] = np.asarray(limits["swing"], np.float64) - self.second_swing
        if self.second_phi0 is not None:
            equations[alive, 1] = np.asarray(limits["phi0"], np.float64) - self.second_phi0
        slacks = [pressure_limit(d, self.max_pressure_angle) for d in (first, second)]
        curves = [np.asarray(motion(d, turn(), "d2psi")["d2psi"], np.float64) for d in (first, second)]
        columns = named(first)
        sizes = size_limits(columns, self.bounds)
        results = columns | {f"second_{self.adjusted}": x[:, 2]}
        return Candidates(equations, stacked(len(x), [*slacks, *sizes]), np.hstack(curves), results)


def adjustments(design: Mapping[str, float]) -> pd.DataFrame:
    """Which dimension of a crank-rocker adjusts what: derivatives of swing and phi0, by implicit differentiation.

    Parameters
    ----------
    design : parameters of ``rssr`` [one length unit, rad]

    Returns
    -------
    DataFrame
        one row per dimension: ``dswing``, ``dphi0``, ``dpsi_ext``, ``dpsi_fold`` [rad per length unit, per rad for
        alpha], and ``adjusts``: "swing", "phi0", "both" or "nothing"; one alone if it answers ten times more strongly
        than the other.

    Raises
    ------
    InputError
        for a bad design, or one that has no limit positions.
    """
    import pandas as pd

    matrix, _ = design_matrix(RSSR, design)
    names = ("psi_ext", "phi_ext", "psi_fold", "phi_fold")
    found = design_outputs(RSSR, matrix, names, _EXACT)
    if found["status"][0] != 0:
        raise InputError("design", dict(design), "a crank-rocker that turns fully and oscillates", "adjustments")
    rates = np.empty((1, len(PARAMETERS), 4))
    arguments = [matrix, *(np.asarray(found[name], np.float64) for name in names), rates]
    kernels.limit_sensitivities(*arguments)
    psi_ext, phi_ext, psi_fold, phi_fold = rates[0].T
    swing, phi0 = psi_fold - psi_ext, phi_fold - phi_ext
    units = np.where(np.array(PARAMETERS) == "alpha", 1.0, matrix[0, 2])  # lengths by the rocker
    return pd.DataFrame(
        {
            "dswing": swing,
            "dphi0": phi0,
            "dpsi_ext": psi_ext,
            "dpsi_fold": psi_fold,
            "adjusts": [_adjusts(*pair) for pair in zip(np.abs(swing * units), np.abs(phi0 * units), strict=True)],
        },
        index=pd.Index(PARAMETERS, name="dimension"),
    )


def _adjusts(swing: float, phi0: float) -> str:
    if max(swing, phi0) < 1e-12:
        return "nothing"
    if swing > ALONE * phi0:
        return "swing"
    return "phi0" if phi0 > ALONE * swing else "both"
