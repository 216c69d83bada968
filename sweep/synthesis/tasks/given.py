"""What tasks are given: every number in its range, every choice among its words, checked when a task is made."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import fields
from typing import TYPE_CHECKING, Any, TypeAlias

import numpy as np

from kernels.types import TWO_PI
from sweep.errors import InputError

if TYPE_CHECKING:
    from _typeshed import DataclassInstance

Rule: TypeAlias = tuple[str, Callable[[Any], bool]]

_NUMBER: Rule = ("a finite number", math.isfinite)
_SIGN: Rule = ("+1 or -1", lambda x: x in (1, -1))
_POSITIVE: Rule = ("a positive number", lambda x: 0.0 < x < math.inf)
_TURN: Rule = ("an angle between 0 and 2 pi", lambda x: 0.0 < x < TWO_PI)
_PLACES: Rule = ("finite numbers", lambda x: bool(np.isfinite(np.asarray(x, np.float64)).all()))
_RANGE: Rule = ("two finite numbers, the lower one first", lambda x: -math.inf < x[0] <= x[1] < math.inf)
_LENGTHS: Rule = ("two positive numbers, the lower one first", lambda x: 0.0 < x[0] <= x[1] < math.inf)
RULES: dict[str, Rule] = {
    "swing": ("an angle between 0 and 2 pi, or its negative", lambda x: 0.0 < abs(x) < TWO_PI),
    "phi0": _TURN,
    "max_pressure_angle": ("an angle between 0 and pi/2", lambda x: 0.0 < x <= 0.5 * math.pi),
    "objective": ("acceleration or pressure_angle", lambda x: x in ("acceleration", "pressure_angle")),
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


def check_given(task: DataclassInstance) -> None:
    """Check every field of a task that is given and has a rule; None is "not given".

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
