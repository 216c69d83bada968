"""Loads over the turn as a user of ``evaluate`` and ``summarise`` gives them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, TypeAlias

import numpy as np

from sweep.effects import curved_inputs
from sweep.errors import InputError, nearest
from sweep.evaluation.tables import numbers
from sweep.families.base import Array, Family
from sweep.numerics.curves import Curve, SeriesCurve, TableCurve, table_curve

SERIES = ("mean", "cos", "sin")
ALLOWED = "a pair (angles [rad], values), or a Fourier series as a dict of mean, cos and sin"

Loads: TypeAlias = "Mapping[str, Curve | tuple[Any, Any] | Mapping[str, Any]]"


def curves_of(family: Family, loads: Loads | None) -> dict[str, Curve]:
    """Return the curves of the argument ``loads=``, by the input that each adds to.

    Raises
    ------
    InputError
        for a name that is no load of this mechanism, or what is no curve.
    """
    found: dict[str, Curve] = {}
    known = curved_inputs(family) if loads else ()
    for name, given in (loads or {}).items():
        if name not in known:
            raise InputError(
                "loads",
                name,
                f"{', '.join(known) or 'no load: no effect takes one'}{nearest(name, known)}",
                family.name,
            )
        found[name] = _curve(name, given)
    return found


def _curve(name: str, given: Any) -> Curve:
    if isinstance(given, TableCurve | SeriesCurve):
        return given
    if isinstance(given, Mapping):
        unknown = [key for key in given if key not in SERIES]
        if unknown or not given:
            raise InputError("loads", unknown[0] if unknown else {}, ALLOWED, name)
        mean, cos, sin = (
            _column(given.get(key, default), name) for key, default in zip(SERIES, (0.0, (), ()), strict=True)
        )
        if mean.size != 1:
            raise InputError("mean", given["mean"], "one number", name)
        return SeriesCurve(float(mean[0]), tuple(map(float, cos)), tuple(map(float, sin)))
    if not isinstance(given, Sequence) or isinstance(given, str) or len(given) != 2:
        raise InputError("loads", given, ALLOWED, name)
    try:
        return table_curve(_column(given[0], name), _column(given[1], name))
    except InputError:
        raise
    except ValueError as error:
        raise InputError("loads", given, str(error), name) from None


def _column(values: object, name: str) -> Array:
    column = np.atleast_1d(numbers(values, "loads", f"{name}, position"))
    if column.ndim != 1 or not np.isfinite(column).all():
        raise InputError("loads", values, "finite numbers in one row", name)
    return column
