"""Names of quantities and their parts: ``needle.max_abs_d2s2`` is member, stem and stage."""

from __future__ import annotations

import re
from functools import lru_cache
from typing import NamedTuple


class Parts(NamedTuple):
    """The member of a machine and the stage of a chain in a name ("" for none), and the stem between them."""

    member: str
    stem: str
    stage: str


@lru_cache(maxsize=4096)
def parts(name: str) -> Parts:
    """Split a name into member, stem and stage.

    >>> parts("needle.phi01")
    Parts(member='needle', stem='phi0', stage='1')
    >>> parts("swing")
    Parts(member='', stem='swing', stage='')
    >>> parts("minus_needle.stroke")
    Parts(member='needle', stem='minus_stroke', stage='')
    """
    member, _, rest = name.rpartition(".")
    if member.startswith(MINUS):  # the prefix belongs to the stem: the negative of a swing is no swing
        member, rest = member.removeprefix(MINUS), f"{MINUS}{rest}"
    if rest == "phi0" or rest.endswith("_phi0"):
        return Parts(member, rest, "")
    stem, stage = re.fullmatch(r"(.*?)(\d*)", rest, re.DOTALL).groups()  # type: ignore[union-attr]
    if (stem == "phi" or stem.endswith("_phi")) and stage.startswith("0"):
        return Parts(member, f"{stem}0", stage[1:])  # phi01 is phi0 of stage 1
    return Parts(member, stem, stage)


def stem(name: str) -> str:
    """Name without member and stage."""
    return parts(name).stem


@lru_cache(maxsize=4096)
def at_stage(name: str, number: str) -> str:
    """Name without the given number of its stage; "" for a name of another stage.

    Names such as ``support_d1`` end in a digit of their own, so that the stage has to be given.

    >>> at_stage("support_d12", "2")
    'support_d1'
    """
    return name.removesuffix(number) if name.endswith(number) else ""


def ends_in_digit(name: str) -> bool:
    """Tell whether a name of the last stage needs the stage's number: ``b1`` is joint b of stage 1, not a joint b1."""
    return name[-1].isdigit()


def reduced(prefix: str, name: str) -> str:
    """Name of a reduction of an output.

    >>> reduced("max_abs", "needle.d2s")
    'needle.max_abs_d2s'
    """
    member, dot, rest = name.rpartition(".")
    return f"{member}{dot}{prefix}_{rest}"


def is_error(name: str) -> bool:
    """Whether a column holds the error of another column."""
    return without_error(name) != name


def without_error(name: str) -> str:
    """Name of the column whose error a column holds, or the name itself."""
    return name.removeprefix(ERROR)


def error_of(name: str) -> str:
    """Name of the column that holds the error of the given column."""
    return f"{ERROR}{name}"


ERROR = "err_"


def negative(name: str) -> str:
    """Name of the negative of a design output, minimised in place of maximising the output."""
    return f"{MINUS}{name}"


def without_minus(name: str) -> str:
    """Name of the output whose negative a name stands for; "" for any other name."""
    return name.removeprefix(MINUS) if name.startswith(MINUS) else ""


MINUS = "minus_"


def is_place(name: str) -> bool:
    """Whether a design output is the crank angle of an event or extremum, not a size that can be compared."""
    return parts(name).stem.startswith("phi_")


def is_largest(name: str, *, magnitude: bool = False) -> bool:
    """Whether a design output is the largest value of a pose output, or its largest magnitude."""
    return stem(name).startswith("max_abs_" if magnitude else "max_")


def is_flag(name: str) -> bool:
    """Whether a design output is a truth value."""
    return stem(name) == "rotatable"


def judged_by(name: str) -> str:
    """Return the output whose sign decides a truth value; the name itself for any other output.

    >>> judged_by("needle.rotatable2")
    'needle.margin2'
    """
    return name.replace("rotatable", "margin") if is_flag(name) else name


def by_magnitude(name: str) -> bool:
    """Tell whether limits and objectives compare the magnitude of an output whose sign is the assembly mode."""
    return stem(name) in ("swing", "stroke")
