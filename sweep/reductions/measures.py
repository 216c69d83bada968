"""What each design output is along the turn: which extrema of which pose outputs make it, and how.

The optimiser works with *inner* values that are smooth and sums of pose outputs at single crank angles.  Most outputs
are their own inner value; the pressure angle becomes -cos^2 of itself, the stroke ratio the angle phi0, and both rise
with what they replace, so minima, maxima and limits carry over.
"""

from __future__ import annotations

import math
import re
from dataclasses import dataclass
from typing import Literal, TypeAlias

from sweep.errors import InputError
from sweep.families.base import Family
from sweep.reductions.catalogue import STAY
from sweep.reductions.means import PREFIX
from sweep.reductions.size import SIZE, lengths

# A crank that turns must keep this much of Delta/b^2 at its worst pose: cos^2 of 89.94 degrees.
ROTATABLE_MARGIN = 1e-6

Kind: TypeAlias = Literal[
    "max_abs", "max", "min", "range", "phi_max_abs", "ext", "fold", "phi_ext", "phi_fold", "phi0", "scalar", "lengths"
]
Inner: TypeAlias = Literal["same", "pressure", "ratio", "rotatable"]


@dataclass(frozen=True)
class Series:
    """A curve over the turn whose extrema are followed.

    ``output`` is the pose output; with ``pressure`` it is a discriminant and the curve is Delta/b^2 = cos^2 of that
    pressure angle (the ratio of both does not depend on the crank angle, and the discriminant goes on below zero).
    ``window`` limits it to a part of the stroke.  ``wrapped`` curves are angles that jump by a full turn.
    """

    output: str
    pressure: str = ""
    window: tuple[float, float] | None = None
    wrapped: bool = False


@dataclass(frozen=True)
class Measure:
    """A design output as ``sign`` * (reduction ``kind`` of its series), read back through ``inner``.

    ``numbers`` are plain numbers instead of series: the output itself ("scalar"), or parameters of which it is the
    largest magnitude ("lengths").
    """

    name: str
    kind: Kind
    series: tuple[Series, ...]
    inner: Inner = "same"
    sign: float = 1.0
    numbers: tuple[str, ...] = ()

    def to_inner(self, value: float) -> float:
        """Inner value that stands for a value of the output."""
        if self.inner == "pressure":
            return -(math.cos(value) ** 2)
        if self.inner == "ratio":
            return 2.0 * math.pi * value / (1.0 + value)
        if self.inner == "rotatable":
            return ROTATABLE_MARGIN * value
        return value

    def from_inner(self, value: float) -> float:
        """Value of the output for an inner value; nan where there is none (a mechanism that does not turn)."""
        if self.inner == "pressure":
            # 1 - cos^2 may come out as -1e-16 where coupler force and velocity are in line.
            return math.atan2(math.sqrt(max(1.0 + value, 0.0)), math.sqrt(-value)) if value <= 0.0 else math.nan
        if self.inner == "ratio":
            return value / (2.0 * math.pi - value)
        if self.inner == "rotatable":
            return 1.0 if value > 0.0 else 0.0
        return value


def curve(output: str, window: tuple[float, float] | None = None) -> Series:
    """The series of a plain pose output."""
    return Series(output, window=window, wrapped=output.rstrip("0123456789") == "psi")


def margins(family: Family, stage: str = "") -> tuple[Series, ...]:
    """Delta/b^2 of the stage of that number; without a number of every stage.  Empty where nothing can lock."""
    pairs = {}
    for name in family.pose_names:
        found = re.fullmatch(r"discriminant(\d*)", name)
        if found and f"pressure_angle{found[1]}" in family.pose_names:
            pairs[found[1]] = Series(name, pressure=f"pressure_angle{found[1]}")
    numbered = {number: series for number, series in pairs.items() if number} or pairs
    if not stage:
        return tuple(numbered.values())
    return (numbered[stage],) if stage in numbered else ()


def measure(family: Family, name: str, window: tuple[float, float] | None = None) -> Measure:
    """The measure of a design output.

    Parameters
    ----------
    family : whose output it is
    name : ``margin``, ``rotatable``, ``max_pressure_angle``, ``swing``, ``stroke``, ``phi0``, ``stroke_ratio``,
        positions and angles of the limit positions, ``max_abs_x``, ``phi_max_abs_x``, ``max_x``, ``min_x``, ``range_x``
        of any pose output x, ``size``; chains: with a stage number.  ``rms_x``, parameters, and what only a step of the
        family computes, are taken as numbers without inner structure.
    window : see :class:`sweep.optimise.problem.Problem`

    Raises
    ------
    InputError
        for a name that is none of these.
    """
    stem, stage = _split(name)
    if stem in ("margin", "rotatable", "max_pressure_angle"):
        found = margins(family, stage)
        if found or name == "rotatable":
            return _margin_measure(name, stem, found)
    limits: dict[str, Kind] = {
        "swing": "range", "stroke": "range", "phi0": "phi0", "stroke_ratio": "phi0", "phi_ext": "phi_ext",
        "phi_fold": "phi_fold", "psi_ext": "ext", "s_ext": "ext", "psi_fold": "fold", "s_fold": "fold",
    }  # fmt: skip
    if stem in limits:
        position = _position(family, stage)
        fits = {"swing": "psi", "stroke": "s"}.get(stem, stem.split("_")[0] if limits[stem] in ("ext", "fold") else "")
        if position and (not fits or position.rstrip("0123456789") == fits):
            inner: Inner = "ratio" if stem == "stroke_ratio" else "same"
            return Measure(name, limits[stem], (curve(position),), inner)
    reductions: dict[str, Kind] = {
        "phi_max_abs_": "phi_max_abs", "max_abs_": "max_abs", "max_": "max", "min_": "min", "range_": "range",
    }  # fmt: skip
    for prefix, kind in reductions.items():
        x = name.removeprefix(prefix)
        if x != name and x in family.pose_names:
            inside = window if x == "dev" and kind in ("max_abs", "phi_max_abs") else None
            return Measure(name, kind, (curve(x, inside),))
    mean = name.startswith(PREFIX) and name.removeprefix(PREFIX) in family.pose_names
    steps = {output.name for step in family.steps for output in step.provides}
    if mean or name == STAY.name or name in steps or name in family.parameter_names:
        return Measure(name, "scalar", (), numbers=(name,))
    if name == SIZE.name and lengths(family):
        return Measure(name, "lengths", (), numbers=lengths(family))
    known = (
        "margin, rotatable, max_pressure_angle, swing or stroke, phi0, stroke_ratio, max_abs_x, max_x, min_x, range_x, "
        "rms_x, size"
    )
    raise InputError(
        "output", name, f"{known} for x = {', '.join(family.pose_names)}", f"design outputs of {family.name}"
    )


def _margin_measure(name: str, stem: str, series: tuple[Series, ...]) -> Measure:
    if stem == "max_pressure_angle":
        return Measure(name, "min", series, "pressure", sign=-1.0)
    return Measure(name, "min", series, "rotatable" if stem == "rotatable" else "same")


def _position(family: Family, stage: str) -> str:
    name = family.position + stage
    if name in family.pose_names:
        return name
    for letter in ("psi", "s"):
        if stage and letter + stage in family.pose_names:
            return letter + stage
    return ""


def _split(name: str) -> tuple[str, str]:
    if name == "phi0":
        return name, ""
    found = re.fullmatch(r"(.*?)(\d*)", name)
    stem, number = (found[1], found[2]) if found else (name, "")
    # phi01 is phi0 of stage 1.
    return ("phi0", number[1:]) if stem == "phi" and number.startswith("0") else (stem, number)
