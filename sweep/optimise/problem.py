"""What is to be optimised: a family, the dimensions that may change, the objective and the limits."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np

from sweep.errors import InputError, nearest
from sweep.families.base import Accuracy, Array, Family

if TYPE_CHECKING:
    from sweep.study import Limit

PLACE = "optimisation problem"


@dataclass(frozen=True)
class Problem:
    """Minimise one design output of a family between bounds, under limits on others.

    Parameters
    ----------
    family : single family or chain
    variables : names of the parameters that may change; signs (branches) are fixed by each start, never varied
    lower, upper : (n,) bounds of the variables, in the family's internal units
    fixed : values of the other parameters; what is missing takes the family's default
    objective : design output to be minimised
    limits : ``Limit(output, minimum, maximum)``; equal minimum and maximum make an equation.  That every stage
        assembles over the whole turn is demanded without being asked.
    window : part of the stroke in which ``max_abs_dev`` counts, as fractions from the smallest position
    accuracy : relative error to which the extrema over the turn are verified (``target``), or the number of poses per
        turn they are looked for on (``samples``)

    Raises
    ------
    InputError
        for an unknown or doubled name, a sign among the variables, bounds that are not finite or not in order.
    """

    family: Family
    variables: tuple[str, ...]
    lower: Array
    upper: Array
    fixed: Mapping[str, float]
    objective: str
    limits: tuple[Limit, ...] = ()
    window: tuple[float, float] | None = None
    accuracy: Accuracy = field(default_factory=lambda: Accuracy(target=1e-9))

    def __post_init__(self) -> None:
        names = self.family.parameter_names
        for name in (*self.variables, *self.fixed):
            if name not in names:
                raise InputError("parameter", name, f"{', '.join(names)}{nearest(name, names)}", PLACE)
        if len(set(self.variables)) < len(self.variables) or not self.variables:
            raise InputError("variables", self.variables, "at least one parameter, each once", PLACE)
        for parameter in self.family.parameters:
            if parameter.name in self.variables and parameter.choices is not None:
                raise InputError("variables", parameter.name, "parameters that change steadily", PLACE)
        for name, low, high in zip(self.variables, self.lower, self.upper, strict=True):
            if not (np.isfinite(low) and np.isfinite(high) and low < high):
                raise InputError(name, (float(low), float(high)), "finite bounds, lower below upper", PLACE)
        if self.window is not None and not 0.0 <= self.window[0] < self.window[1] <= 1.0:
            raise InputError("window", self.window, "two fractions of the stroke, in order, between 0 and 1", PLACE)

    @property
    def columns(self) -> tuple[int, ...]:
        """Columns of the variables in the design matrix."""
        return tuple(self.family.parameter_names.index(name) for name in self.variables)

    @property
    def span(self) -> Array:
        """Upper minus lower bounds (n,)."""
        return np.asarray(self.upper, np.float64) - np.asarray(self.lower, np.float64)

    def scaled(self, designs: Array) -> Array:
        """Variables of designs (k, P) as fractions of their bounds (k, n)."""
        return (designs[:, list(self.columns)] - self.lower) / self.span

    def placed(self, base: Array, fractions: Array) -> Array:
        """Design ``base`` (P,) with its variables at the fractions (n,) of their bounds."""
        design = np.array(base, dtype=np.float64)
        design[list(self.columns)] = self.lower + fractions * self.span
        return design

    def rows(self, values: Array, **signs: float) -> Array:
        """Design matrix (k, P) of variable values (k, n); ``signs`` and ``fixed`` and the defaults fill the rest.

        Raises
        ------
        InputError
            for a parameter that has no value.
        """
        values = np.atleast_2d(np.asarray(values, np.float64))
        designs = np.empty((len(values), len(self.family.parameters)))
        for column, parameter in enumerate(self.family.parameters):
            value = signs.get(parameter.name, self.fixed.get(parameter.name, parameter.default))
            if value is None and parameter.name not in self.variables:
                raise InputError(parameter.name, None, "a variable or a fixed value", PLACE)
            designs[:, column] = np.nan if value is None else value
        designs[:, list(self.columns)] = values
        return designs
