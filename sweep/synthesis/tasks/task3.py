"""Task 3: an adjustable crank-rocker with settings that differ in one dimension, and the effect of each dimension."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Literal, NamedTuple

import numpy as np

from sweep.errors import InputError
from sweep.evaluation.summaries import design_outputs
from sweep.evaluation.tables import design_matrix
from sweep.families.base import Accuracy, Angles, Array
from sweep.synthesis.tasks.crank_rocker import RSSR, acceleration, designs_on_locus, named, outputs_of, pressure_limit
from sweep.synthesis.tasks.problem import Candidates, SynthesisTask, Unknown, ranges, turning

if TYPE_CHECKING:
    import pandas as pd

_EXACT = Accuracy(target=1e-12)
STEP = 1e-30  # imaginary step of a dimension: the error is of order STEP^2, without cancellation
ALONE = 10.0  # ratio of sensitivities above which a dimension adjusts one quantity alone


class Setting(NamedTuple):
    """Required values of the mechanism after one dimension has been changed [rad]; None leaves a value free."""

    swing: float | None
    phi0: float | None = None

    @property
    def asked(self) -> dict[str, float]:
        """Prescribed values by name."""
        return {name: value for name, value in self._asdict().items() if value is not None}


@dataclass(frozen=True)
class Task3(SynthesisTask):
    """The unknowns are phi1, f, and for every further setting the value of the one dimension that differs.

    Parameters
    ----------
    swing, phi0 : values of the first setting, signed and in the crank's sense [rad]
    settings : requirements of each further setting, swing or phi0 or both
    adjusted : the dimension that differs, and ``adjusted_range``, the range of its other values
    e, g, alpha : as `EngineeringMethod`; of the first setting, if e or g is the adjusted dimension
    f_range : range of f
    g_range, alpha_range : ranges of g and alpha, if they are unknown as well

    Raises
    ------
    InputError
        for no setting, one without requirements or with those of the first, or more requirements than unknowns.
    """

    swing: float
    phi0: float
    settings: tuple[Setting, ...]
    adjusted: Literal["a", "b", "c", "e", "f", "g"]
    adjusted_range: tuple[float, float]
    e: float
    g: float
    alpha: float
    f_range: tuple[float, float]
    g_range: tuple[float, float] | None = None
    alpha_range: tuple[float, float] | None = None

    def __post_init__(self) -> None:
        super().__post_init__()
        if not self.settings:
            raise InputError("settings", self.settings, "at least one besides the first", "Task3")
        first = {"swing": self.swing, "phi0": self.phi0}
        for setting in self.settings:
            if all(first[name] == value for name, value in setting.asked.items()):
                raise InputError("settings", setting, "another swing or phi0 than the first", "Task3")
        count = sum(len(setting.asked) for setting in self.settings)
        if count > len(self.unknowns):
            allowed = f"at most {len(self.unknowns)} swings and phi0 in all, or g_range, alpha_range"
            raise InputError("settings", count, allowed, "Task3")

    @property
    def unknowns(self) -> tuple[Unknown, ...]:
        """phi1, f, further free parameters, and the further values of the adjusted dimension."""
        values = (Unknown(self._value(k), *self.adjusted_range) for k in range(2, len(self.settings) + 2))
        return (turning("phi1"), *ranges(self, "f", "g", "alpha"), *values)

    def _value(self, k: int) -> str:
        return f"{self.adjusted} of setting {k}"

    def candidates(self, x: Mapping[str, Array]) -> Candidates:
        """Compute equations, limits, curve and mechanisms of candidates from their unknowns, (n,) each."""
        place = (x["phi1"], self.e, x["f"], x.get("g", self.g), x.get("alpha", self.alpha))
        first, _ = designs_on_locus(self.swing, self.phi0, *place)
        results, equations, designs = dict(named(first)), dict[str, Array](), [first]
        for k, setting in enumerate(self.settings, 2):
            design = first.copy()
            results[self._value(k)] = design[:, RSSR.parameter_names.index(self.adjusted)] = x[self._value(k)]
            design[np.isnan(first).any(axis=1) | (design[:, :3] <= 0.0).any(axis=1)] = np.nan
            designs.append(design)
            reached = outputs_of(design, setting.asked, _EXACT)
            equations |= {f"{name} of setting {k}": reached[name] - value for name, value in setting.asked.items()}
        limits = {
            f"pressure angle of setting {k}": pressure_limit(design, self.max_pressure_angle)
            for k, design in enumerate(designs, 1)
        }
        return Candidates(equations, limits, np.hstack([acceleration(design) for design in designs]), results)


def adjustments(design: Mapping[str, float]) -> pd.DataFrame:
    """Tell which limit values each dimension of a crank-rocker adjusts, from derivatives of swing and phi0.

    Parameters
    ----------
    design : parameters of ``rssr`` [one length unit, rad]

    Returns
    -------
    DataFrame
        one row per dimension: ``dswing``, ``dphi0``, ``dpsi_ext``, ``dpsi_fold`` [rad per length unit, per rad for
        alpha], and ``adjusts``: "swing", "phi0", "both" or "nothing"; a single one if it responds ten times more
        strongly than the other.

    Raises
    ------
    InputError
        for a bad design, or one that has no limit positions.
    """
    import pandas as pd

    matrix, _ = design_matrix(RSSR, design)
    limits = design_outputs(RSSR, matrix, ("phi_ext", "phi_fold"), _EXACT)
    if limits["status"][0] != 0:
        raise InputError("design", dict(design), "a crank-rocker that turns fully and oscillates", "adjustments")
    dimensions = RSSR.parameter_names[:-1]
    stepped = matrix + 1j * STEP * np.eye(len(dimensions), matrix.shape[1])
    angles = Angles.of(np.array([[limits["phi_ext"][0], limits["phi_fold"][0]]], np.complex128))
    poses = RSSR.poses(stepped, angles, frozenset({"psi", "dpsi", "d2psi"}))
    # At a limit dpsi/dphi is 0 and stays 0: psi changes as at a fixed crank angle, and phi by -(d dpsi/dp)/d2psi.
    psi_ext, psi_fold = poses["psi"].T.imag / STEP
    phi_ext, phi_fold = -poses["dpsi"].T.imag / STEP / poses["d2psi"].T.real
    swing, phi0 = psi_fold - psi_ext, phi_fold - phi_ext
    units = np.where(np.array(dimensions) == "alpha", 1.0, matrix[0, 2])  # lengths relative to the rocker
    frame = pd.DataFrame(
        {
            "dswing": swing,
            "dphi0": phi0,
            "dpsi_ext": psi_ext,
            "dpsi_fold": psi_fold,
            "adjusts": [_adjusts(*pair) for pair in zip(np.abs(swing * units), np.abs(phi0 * units), strict=True)],
        },
        index=pd.Index(dimensions, name="dimension"),
    )
    frame.attrs["units"] = dict.fromkeys(("dswing", "dphi0", "dpsi_ext", "dpsi_fold"), "rad per unit of the dimension")
    return frame


def _adjusts(swing: float, phi0: float) -> str:
    if max(swing, phi0) < 1e-12:
        return "nothing"
    if swing > ALONE * phi0:
        return "swing"
    return "phi0" if phi0 > ALONE * swing else "both"
