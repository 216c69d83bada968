"""Over what a family is evaluated: a closed turn, an interval of some variable, or a march in which history counts."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import ClassVar, TypeAlias

import numpy as np

from kernels.types import TWO_PI, Array

EndsFunction: TypeAlias = Callable[[Array], tuple[Array, Array]]

TWO_TURNS, TWO_TURNS_DEG = 2.0 * TWO_PI * (1.0 + 1e-9), 720.0


def reads_as_degrees(largest: float) -> bool:
    """Whether crank angles, the largest of which is given, were written in degrees though rad were expected.

    Crank angles may run on over many turns.  Between two turns in rad and two turns in degrees a grid whose largest
    value is a whole or half number was written in degrees: one in rad ends at a multiple of pi.

    >>> reads_as_degrees(180.0), reads_as_degrees(12.5), reads_as_degrees(62.83185)
    (True, False, False)
    """
    return TWO_TURNS < abs(largest) <= TWO_TURNS_DEG and (2.0 * largest).is_integer()


@dataclass(frozen=True)
class Turn:
    """A closed turn: every pose output is a function of the crank angle phi with period 2 pi."""

    kind: ClassVar[str] = "turn"
    name: str = "phi"
    unit: str = "rad"
    text: str = "crank angle"


@dataclass(frozen=True)
class Interval:
    """An interval of an input variable; its ends are candidates for extrema.

    ``ends(designs)`` gives the first and the last value of the variable for each row of the (n, P) design matrix, both
    (n,).  ``poses`` of the family gets the values of the variable as ``angles.phi``; cosine and sine mean nothing.
    """

    kind: ClassVar[str] = "interval"
    name: str
    unit: str
    text: str
    ends: EndsFunction


@dataclass(frozen=True)
class March:
    """A motion with history: what a pose is depends on the poses before it, in the order of the crank angle.

    The family marches over ``turns`` turns in equal steps and keeps the last one, so its values exist only on the grid
    that was marched: ``poses`` takes one row of equally spaced crank angles of one turn, from 0.
    """

    kind: ClassVar[str] = "march"
    name: str = "phi"
    unit: str = "rad"
    text: str = "crank angle"
    turns: int = 2


Domain: TypeAlias = Turn | Interval | March


def equal_steps(domain: Domain, designs: Array, poses: int) -> Array:
    """Spread values of the variable for the first design: one turn from 0 in equal steps, or a whole interval."""
    if isinstance(domain, Interval):
        first, last = domain.ends(designs)
        return np.linspace(float(first[0]), float(last[0]), poses, dtype=np.float64)
    return np.arange(poses, dtype=np.float64) * (TWO_PI / poses)
