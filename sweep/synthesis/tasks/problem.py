"""Interface of a task for the solver: unknowns in a box, equations, limits, a curve whose maximum is minimised.

Fields are validated when a task is created: every number must be in range, every choice one of its words.
"""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, fields
from typing import Any, NamedTuple, TypeAlias

import numpy as np

from kernels.types import TWO_PI
from sweep.errors import InputError, choices
from sweep.families.base import Array

Bounds: TypeAlias = Mapping[str, tuple[float, float]]
Rule: TypeAlias = tuple[str, Callable[[Any], bool]]

_NUMBER: Rule = ("a finite number", math.isfinite)
_SIGN: Rule = ("+1 or -1", lambda x: x in (1, -1))
_POSITIVE: Rule = ("a positive number", lambda x: 0.0 < x < math.inf)
_TURN: Rule = ("an angle between 0 and 2 pi", lambda x: 0.0 < x < TWO_PI)
_PLACES: Rule = ("finite numbers", lambda x: bool(np.isfinite(np.asarray(x, np.float64)).all()))
_RANGE: Rule = ("two finite numbers, the lower one first", lambda x: -math.inf < x[0] <= x[1] < math.inf)
_LENGTHS: Rule = ("two positive numbers, the lower one first", lambda x: 0.0 < x[0] <= x[1] < math.inf)
SECOND = ("guide", "slider_crank", "swivel")
RULES: dict[str, Rule] = {
    "swing": ("an angle between 0 and 2 pi, or its negative", lambda x: 0.0 < abs(x) < TWO_PI),
    "phi0": _TURN,
    "max_pressure_angle": ("an angle between 0 and pi/2", lambda x: 0.0 < x <= 0.5 * math.pi),
    "objective": ("acceleration or pressure_angle", lambda x: x in ("acceleration", "pressure_angle")),
    "second": ("guide, slider_crank or swivel", lambda x: x in SECOND),
    "limit": ("extended or folded", lambda x: x in ("extended", "folded")),
    "adjusted": ("a, b, c, e, f or g", lambda x: x in tuple("abcefg")),
    "swing_range": (
        "two angles of one sign below 2 pi, the lower one first",
        lambda x: -TWO_PI < x[0] <= x[1] < TWO_PI and x[0] * x[1] > 0.0,
    ),
    "phi0_range": ("two angles between 0 and 2 pi, the lower one first", lambda x: 0.0 < x[0] <= x[1] < TWO_PI),
    "ratio_range": (
        "two positive numbers on one side of 1, the lower one first",
        lambda x: 0.0 < x[0] <= x[1] < math.inf and (x[0] - 1.0) * (x[1] - 1.0) > 0.0,
    ),
    "rho0": ("a length, positive or negative, not zero", lambda x: 0.0 < abs(x) < math.inf),
    "settings": ("Setting(swing, phi0) each", lambda x: all(hasattr(setting, "asked") for setting in x)),
    "dwell": _TURN,
    "tolerance": _POSITIVE,
    "bounds": (
        "two finite numbers for every name, the lower one first",
        lambda x: all(-math.inf < low < high < math.inf for low, high in x.values()),
    ),
    **dict.fromkeys(("e", "f", "g", "alpha", "f2", "alpha2", "f2_ratio", "stroke"), _NUMBER),
    **dict.fromkeys(("start_acceleration", "end_acceleration", "start_direction", "end_direction"), _NUMBER),
    **dict.fromkeys(("kappa", "branch"), _SIGN),
    **dict.fromkeys(("f_range", "g_range", "alpha_range", "adjusted_range", "offset_range"), _RANGE),
    **dict.fromkeys(("size_range", "coupler_range"), _LENGTHS),
    **dict.fromkeys(("positions", "start", "end"), _PLACES),
}


def check_given(task: SynthesisTask) -> None:
    """Check every given field of a task that has a rule; None is "not given".

    Raises
    ------
    InputError
        for the first field out of its range.
    """
    for entry in fields(task):
        value = getattr(task, entry.name) if entry.init and entry.name in RULES else None
        if value is None:
            continue
        allowed, holds = RULES[entry.name]
        if not holds(value):
            shown = dict(value) if isinstance(value, Mapping) else value
            raise InputError(entry.name, shown, allowed, type(task).__name__)


class Unknown(NamedTuple):
    """An unknown between two bounds; ``periodic`` if both bounds are equivalent."""

    name: str
    low: float
    high: float
    periodic: bool = False


class Candidates(NamedTuple):
    """Values of n candidates by name, (n,) each; nan if there is no mechanism.

    ``equations`` vanish at a solution, ``limits`` hold if they are not negative, both scaled so that 1 is a large
    violation.  The objective of a candidate is the largest magnitude in its row of ``curve`` (n, m).  ``results`` holds
    the mechanisms, named like the parameters of families; one that is the same for all candidates may be a number.
    """

    equations: Mapping[str, Array]
    limits: Mapping[str, Array]
    curve: Array
    results: Mapping[str, Any]


@dataclass(frozen=True)
class Solution:
    """A mechanism that solves a task, or the nearest one found if ``feasible`` is false.

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
        """Return the solution as text in a few lines."""
        head = "feasible" if self.feasible else "infeasible"
        lines = [f"{head}, objective {self.objective:.6g}"]
        for title, entries in (
            ("unknowns", self.unknowns), ("mechanism", self.mechanism), ("residuals", self.equations),
            ("slacks", self.limits),
        ):  # fmt: skip
            words = ", ".join(f"{name} = {value:.9g}" for name, value in entries.items())
            lines += [f"  {title}: {words}"] if entries else []
        return "\n".join(lines)


@dataclass(frozen=True)
class SynthesisTask(ABC):
    """One of the tasks of the engineering method with its numbers, the argument of `solve`.

    Parameters
    ----------
    max_pressure_angle : limit over the whole turn [rad]; pi/2 requires a full turn only
    bounds : bounds of results by name

    Raises
    ------
    InputError
        for a number out of its range or a word that is not allowed.
    """

    max_pressure_angle: float = field(default=0.5 * np.pi, kw_only=True)
    bounds: Bounds = field(default_factory=dict, kw_only=True)

    def __post_init__(self) -> None:
        check_given(self)

    @property
    @abstractmethod
    def unknowns(self) -> tuple[Unknown, ...]:
        """Unknowns of the task."""

    @abstractmethod
    def candidates(self, x: Mapping[str, Array]) -> Candidates:
        """Compute equations, limits, curve and mechanisms of candidates from their unknowns by name, (n,) each."""

    def evaluate(self, x: Array) -> Candidates:
        """Return the values of candidates x (n, unknowns), with slacks of the bounds in units of their range."""
        named = self.candidates(dict(zip((u.name for u in self.unknowns), x.T, strict=True)))
        limits = dict(named.limits)
        results = {
            name: np.broadcast_to(np.asarray(x, np.float64), len(named.curve)) for name, x in named.results.items()
        }
        for name, (low, high) in self.bounds.items():
            if name not in results:
                raise InputError("bounds", name, choices(name, results), "task")
            limits[f"{name} not below"] = (results[name] - low) / (high - low)
            limits[f"{name} not above"] = (high - results[name]) / (high - low)
        return named._replace(limits=limits, results=results)


def turning(name: str) -> Unknown:
    """Return an unknown angle with the range of a whole turn."""
    return Unknown(name, 0.0, TWO_PI, periodic=True)


def ranges(task: object, *names: str) -> list[Unknown]:
    """Return the unknowns with these names for which a task gives a range, ``name_range``."""
    pairs = ((name, getattr(task, f"{name}_range")) for name in names)
    return [Unknown(name, *ends) for name, ends in pairs if ends is not None]
