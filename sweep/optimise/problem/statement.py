"""The optimisation problem: a family, the dimensions that may change, the objective and the limits."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from sweep.errors import InputError, MissingInput, choices
from sweep.families.base import Accuracy, Array, Family, March
from sweep.study import Limit

if TYPE_CHECKING:
    from sweep.optimise.manufacture.curve_margins import Allowance, CurveMargin
    from sweep.optimise.problem.on_locus import LocusCoordinates

PLACE = "optimisation problem"


@dataclass(frozen=True)
class Problem:
    """Minimise one design output of a family between bounds, under limits on others.

    Parameters
    ----------
    family : single family or chain
    variables : names of the parameters that may change; signs (branches) are fixed by each start, never varied
    lower, upper : (n,) bounds of the variables, in the family's internal units
    fixed : values of the other parameters; a missing one has the family's default
    objective : design output to be minimised, or a parameter
    limits : ``Limit(output, minimum, maximum)``, also of parameters that follow from others; equal minimum and maximum
        make an equation.  Every stage must assemble over the whole turn, without a limit for it.
    window : part of the stroke in which deviations from a line count, as fractions from the smallest position
    accuracy : relative error to which the extrema over the turn are verified (``target``), or the number of poses per
        turn on which they are sought (``samples``)
    coordinates : variables that are no parameters, and the parameters that follow; None varies parameters alone
    curve_margins : margins added to pose outputs along the turn, if limits are to hold for manufactured mechanisms
    allowances : changes of the margins of other limits with the design, by their outputs

    Raises
    ------
    InputError
        for an unknown or doubled name, a sign among the variables, a number that is not finite, bounds not in order.
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
    coordinates: LocusCoordinates | None = None
    curve_margins: Mapping[str, CurveMargin] = field(default_factory=dict)
    allowances: Mapping[str, Allowance] = field(default_factory=dict)

    def __post_init__(self) -> None:
        if isinstance(self.family.domain, March):
            allowed = "a family without history: poses that depend on those before have no gradient"
            raise InputError("family", self.family.name, allowed, PLACE)
        names = tuple(name for name in self.family.parameter_names if name not in self.made) + self.given
        for name in (*self.variables, *self.fixed):
            if name not in names:
                raise InputError("parameter", name, choices(name, names), PLACE)
        if len(set(self.variables)) < len(self.variables) or not self.variables:
            raise InputError("variables", self.variables, "at least one parameter, each once", PLACE)
        for parameter in self.family.parameters:
            if parameter.name in self.variables and parameter.choices is not None:
                raise InputError("variables", parameter.name, "parameters that change steadily", PLACE)
        for name, low, high in zip(self.variables, self.lower, self.upper, strict=True):
            if not (np.isfinite(low) and np.isfinite(high) and low < high):
                raise InputError(name, (float(low), float(high)), "finite bounds, lower below upper", PLACE)
        for name, value in self.fixed.items():
            if not np.isfinite(value):
                raise InputError(name, value, "a finite number", PLACE)
        for limit in self.limits:
            if not np.isfinite([x for x in (limit.minimum, limit.maximum) if x is not None]).all():
                allowed = "finite bounds, None for a side without one"
                raise InputError(limit.output, (limit.minimum, limit.maximum), allowed, PLACE)
        for name in self.given:
            if name not in self.variables and name not in self.fixed:
                raise MissingInput(name, "a variable or a fixed value", PLACE)
        if self.window is not None and not 0.0 <= self.window[0] < self.window[1] <= 1.0:
            raise InputError("window", self.window, "two fractions of the stroke, in order, between 0 and 1", PLACE)

    @property
    def given(self) -> tuple[str, ...]:
        """Variables of the coordinates that are no parameters."""
        return () if self.coordinates is None else self.coordinates.given

    @property
    def made(self) -> tuple[str, ...]:
        """Parameters that follow from the coordinates."""
        return () if self.coordinates is None else self.coordinates.made

    @cached_property
    def columns(self) -> tuple[int, ...]:
        """Columns of the design matrix that the variables change."""
        changed = (*self.variables, *self.made)
        return tuple(k for k, name in enumerate(self.family.parameter_names) if name in changed)

    @cached_property
    def others(self) -> list[int]:
        """Columns that the variables leave alone: signs, listed and fixed parameters."""
        return [k for k in range(len(self.family.parameters)) if k not in self.columns]

    @cached_property
    def span(self) -> Array:
        """Upper minus lower bounds (n,)."""
        return np.asarray(self.upper, np.float64) - np.asarray(self.lower, np.float64)

    def scaled(self, designs: Array) -> Array:
        """Return the variables of designs (k, P) as fractions of their bounds, (k, n).

        A coordinate that does not exist for a design is nan.
        """
        read = {} if self.coordinates is None else self.coordinates.read(self.family, designs)
        names = self.family.parameter_names
        values = [read[n] if n in read else designs[:, names.index(n)] for n in self.variables]
        return (np.column_stack(values) - self.lower) / self.span

    def placed(self, base: Array, fractions: Array) -> Array:
        """Return designs like ``base`` (P,) with their variables at the given fractions of their bounds.

        Parameters
        ----------
        base : (P,) one design, or (k, P)
        fractions : (n,) or (k, n); complex ones give complex designs

        Returns
        -------
        (P,) or (k, P); parameters that follow from coordinates are nan if no such design exists.
        """
        values = np.atleast_2d(self.lower + fractions * self.span)
        designs = self._filled(np.asarray(base, np.float64), values)
        return designs if fractions.ndim == 2 else np.asarray(designs[0])

    def rows(self, values: Array, **signs: float) -> Array:
        """Return the designs (k, P) of variable values (k, n).

        The other parameters come from ``signs``, ``fixed`` and the defaults.

        Raises
        ------
        InputError
            for a parameter that has no value.
        """
        values = np.atleast_2d(np.asarray(values, np.float64))
        base = np.full(len(self.family.parameters), np.nan)
        for column, parameter in enumerate(self.family.parameters):
            value = signs.get(parameter.name, self.fixed.get(parameter.name, parameter.default))
            if value is None and column not in self.columns:
                raise MissingInput(parameter.name, "a variable or a fixed value", PLACE)
            base[column] = np.nan if value is None else value
        return self._filled(base, values)

    def _filled(self, base: Array, values: Array) -> Array:
        designs = np.empty((len(values), base.shape[-1]), values.dtype)
        designs[:] = base
        indices, columns = self._direct
        designs[:, columns] = values[:, indices]
        if self.coordinates is not None:
            names = self.family.parameter_names
            given = dict(zip(self.variables, values.T, strict=True))
            given |= {name: np.full(len(values), self.fixed[name]) for name in self.given if name not in given}
            for name, column in self.coordinates.make(dict(zip(names, designs.T, strict=True)) | given).items():
                designs[:, names.index(name)] = column
        return designs

    @cached_property
    def _direct(self) -> tuple[list[int], list[int]]:
        """Indices of the variables that are parameters, and their columns of the design matrix."""
        names = self.family.parameter_names
        indices = [k for k, name in enumerate(self.variables) if name in names]
        return indices, [names.index(self.variables[k]) for k in indices]
