"""``rod``: a body from its material and its section, as a bar between the joints of a mechanism."""

from __future__ import annotations

import math
import re
from collections.abc import Callable

from sweep.errors import InputError, choices
from sweep.quantities.units import factor

# kg/m^3.  EN 1991-1-1, table A.4: weights over 9.81 m/s^2, the middle of a range, of steel its lower end.  Titanium and
# magnesium: CRC Handbook of Chemistry and Physics, physical constants of the elements.
DENSITIES = {
    "steel": 7850.0,
    "cast iron": 7310.0,
    "aluminium": 2750.0,
    "brass": 8560.0,
    "bronze": 8560.0,
    "titanium": 4506.0,
    "magnesium": 1738.0,
}
SECTIONS = '"6 mm round", "5 mm square", "6 x 4 mm rectangular", "8 x 1 mm tube" (outer diameter, wall)'
_SECTION = re.compile(r"([\d.]+)(?:\s*x\s*([\d.]+))?\s*([a-z]+)\s+(round|square|rectangular|tube)")
_AREAS: dict[str, Callable[..., float]] = {
    "round": lambda d: 0.25 * math.pi * d * d,
    "square": lambda a: a * a,
    "rectangular": lambda a, b: a * b,
    "tube": lambda d, wall: math.pi * wall * (d - wall),
}


def rod(body: str, material: str, section: str) -> dict[str, float]:
    """Mass of a body as a slender bar between its joints: columns to put into a table beside the dimensions.

    Centre and inertia follow from the length that the body has in each design, J = m l^2/12.

    Parameters
    ----------
    body : its name, with the number of its stage, as ``crank``, ``rocker2``, ``needle.coupler1``
    material : one of :data:`DENSITIES`
    section : as "6 mm round", "5 mm square", "6 x 4 mm rectangular", "8 x 1 mm tube" (outer diameter, wall)

    Returns
    -------
    dict
        the mass per length [t/mm], and 0 for what its mass is besides [t]

    Raises
    ------
    InputError
        for an unknown material, or a section that is not written like these

    Examples
    --------
    >>> import sweep
    >>> found = sweep.rod("crank", "steel", "6 mm round")
    >>> {name: round(value * 1e9, 3) for name, value in found.items()}  # g/m
    {'m_crank': 0.0, 'line_mass_crank': 221.954}
    """
    if material not in DENSITIES:
        raise InputError("material", material, choices(material, list(DENSITIES)), body)
    try:
        match = _SECTION.fullmatch(section.strip())
        assert match is not None
        sizes = [factor(match[3], "mm") * float(size) for size in match.groups()[:2] if size is not None]
        area = _AREAS[match[4]](*sizes)
    except (AssertionError, TypeError, ValueError):
        raise InputError("section", section, f"a section, as {SECTIONS}", body) from None
    if not area > 0.0:
        raise InputError("section", section, "positive sizes, a wall of less than the diameter", body)
    member, dot, own = body.rpartition(".")
    place = f"{member}{dot}"
    return {f"{place}m_{own}": 0.0, f"{place}line_mass_{own}": 1e-12 * DENSITIES[material] * area}
