"""Bodies and loads of a user: ``rod`` from material and section, load curves over the turn."""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Mapping, Sequence
from typing import Any, TypeAlias

import numpy as np

from sweep.effects import curved_inputs
from sweep.errors import InputError, choices, nearest
from sweep.evaluation.tables import numbers
from sweep.families.base import Array, Family
from sweep.numerics.curves import Curve, SeriesCurve, TableCurve, table_curve
from sweep.quantities.units import factor

SERIES = ("mean", "cos", "sin")
ALLOWED = "a pair (angles [rad], values), or a Fourier series as a dict of mean, cos and sin"

Loads: TypeAlias = "Mapping[str, Curve | tuple[Any, Any] | Mapping[str, Any]]"


def curves_of(family: Family, loads: Loads | None) -> dict[str, Curve]:
    """Read the argument ``loads=``: curves by the input to which each is added.

    Raises
    ------
    InputError
        for a name that is no load of this mechanism, or a value that is no curve.
    """
    curves: dict[str, Curve] = {}
    inputs = curved_inputs(family) if loads else ()
    for name, curve in (loads or {}).items():
        if name not in inputs:
            allowed = f"{', '.join(inputs) or 'no load: no effect takes one'}{nearest(name, inputs)}"
            raise InputError("loads", name, allowed, family.name)
        curves[name] = _curve(name, curve)
    return curves


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


# kg/m^3.  EN 1991-1-1, table A.4: weights over 9.81 m/s^2, the middle of a range, for steel its lower end.  Titanium
# and magnesium: CRC Handbook of Chemistry and Physics, physical constants of the elements.
DENSITIES = {
    "steel": 7850.0,
    "cast iron": 7310.0,
    "aluminium": 2750.0,
    "brass": 8560.0,
    "bronze": 8560.0,
    "titanium": 4506.0,
    "magnesium": 1738.0,
}
INERTIAS = ("slender", "exact")
SECTIONS = '"6 mm round", "5 mm square", "6 x 4 mm rectangular", "8 x 1 mm tube" (outer diameter, wall)'
_SECTION = re.compile(r"([\d.]+)(?:\s*x\s*([\d.]+))?\s*([a-z]+)\s+(round|square|rectangular|tube)")
_AREAS: dict[str, Callable[..., float]] = {
    "round": lambda d: 0.25 * math.pi * d * d,
    "square": lambda a: a * a,
    "rectangular": lambda a, b: a * b,
    "tube": lambda d, wall: math.pi * wall * (d - wall) if 2.0 * wall <= d else math.nan,
}
# Squared radius of gyration about a diameter of the section, for sections where it is the same for all diameters.
_GYRATIONS: dict[str, Callable[..., float]] = {
    "round": lambda d: d * d / 16.0,
    "square": lambda a: a * a / 12.0,
    "tube": lambda d, wall: (d * d + (d - 2.0 * wall) ** 2) / 16.0,
}
UNITS = ("t", "t/mm", "mm")  # of the columns


def rod(body: str, material: str, section: str, inertia: str = "slender") -> dict[str, float]:
    """Mass columns of a body as a bar between its joints, to be added to the columns of dimensions.

    Centre and inertia follow from the length of the body in each design.

    Parameters
    ----------
    body : its name, with the number of its stage, as ``crank``, ``rocker2``, ``needle.coupler1``
    material : one of :data:`DENSITIES`
    section : as "6 mm round", "5 mm square", "6 x 4 mm rectangular", "8 x 1 mm tube" (outer diameter, wall)
    inertia : "slender", J = m l^2/12 across the bar and 0 along it, or "exact", m (l^2/12 + k^2) and 2 m k^2 with the
        section's radius of gyration k; a rectangular section is slender: its orientation is not known

    Returns
    -------
    dict
        additional mass, 0 [t], mass per length [t/mm], and k [mm], 0 for "slender"

    Raises
    ------
    InputError
        for an unknown material, a section in another notation, or another inertia

    Examples
    --------
    >>> import sweep
    >>> found = sweep.rod("crank", "steel", "6 mm round")
    >>> {name: round(value * 1e9, 3) for name, value in found.items()}  # g/m
    {'m_crank': 0.0, 'line_mass_crank': 221.954, 'gyration_crank': 0.0}
    >>> sweep.rod("crank", "steel", "6 mm round", "exact")["gyration_crank"]  # mm
    1.5
    """
    if material not in DENSITIES:
        raise InputError("material", material, choices(material, list(DENSITIES)), body)
    try:
        match = _SECTION.fullmatch(section.strip())
        assert match is not None
        sizes = [factor(match[3], "mm") * float(size) for size in match.groups()[:2] if size is not None]
        area, squared_radius = _AREAS[match[4]](*sizes), _GYRATIONS.get(match[4])
        squared = math.nan if squared_radius is None else squared_radius(*sizes)
    except (AssertionError, AttributeError, TypeError, ValueError):
        raise InputError("section", section, f"a section, as {SECTIONS}", body) from None
    if not area > 0.0:
        raise InputError("section", section, "positive sizes, a wall of at most half the diameter", body)
    if inertia not in INERTIAS or (inertia == "exact" and math.isnan(squared)):
        allowed = f"{' or '.join(INERTIAS)}; how a rectangular section lies is not known, so it is slender"
        raise InputError("inertia", inertia, allowed, body)
    member, dot, plain = body.rpartition(".")
    gyration = math.sqrt(squared) if inertia == "exact" else 0.0
    values = 0.0, 1e-12 * DENSITIES[material] * area, gyration
    return {f"{member}{dot}{name}_{plain}": x for name, x in zip(("m", "line_mass", "gyration"), values, strict=True)}
