"""Parameters, outputs and events of a mechanism family, and the words of their units.

Internal units are mm, t, s, rad and units derived from these.  A unit may be a product such as "force/length".
"""

from __future__ import annotations

import re
from collections.abc import Container
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from kernels.types import TWO_PI

Unit = Literal[
    "length", "1/length", "angle", "ratio", "sign", "count", "none", "choice",
    "mass", "line_mass", "inertia", "force", "torque", "pressure", "stiffness", "damping", "speed",
    "angular_acceleration", "acceleration", "time", "rotary_damping",
]  # fmt: skip


@dataclass(frozen=True)
class Parameter:
    """One column of the design matrix.

    ``places`` marks a place of a part, as opposed to a size.  ``unless`` names the parameters that, if given, make the
    default 0: pairs of a part of its own name and the text in its place in the other name, so that they hold with the
    name of a stage or a member too.
    """

    name: str
    unit: Unit
    text: str
    positive: bool = False
    default: float | None = None
    choices: tuple[float, ...] | None = None
    not_negative: bool = False
    not_zero: bool = False
    places: bool = False
    unless: tuple[tuple[str, str], ...] = ()

    def left_out(self, given: Container[str]) -> float | None:
        """Default of the parameter beside the given names; None if it has to be given."""
        return 0.0 if any(self.name.replace(*pair) in given for pair in self.unless) else self.default

    @cached_property
    def sign(self) -> str:
        """Permitted sign in a word; empty without a restriction."""
        words = ((self.positive, "positive"), (self.not_negative, "non-negative"), (self.not_zero, "non-zero"))
        return next((word for holds, word in words if holds), "")

    def wrong_sign(self, values: NDArray[np.float64] | float) -> NDArray[np.bool_]:
        """Mask of the values with a sign that is not permitted."""
        if self.not_zero:
            return np.asarray(values == 0.0)
        if not self.sign:
            return np.zeros(np.shape(values), np.bool_)
        return np.asarray(values <= 0.0 if self.positive else values < 0.0)

    @property
    def choice(self) -> str:
        """Permitted values in words, with signs where one of them is negative."""
        choices = self.choices or ()
        if len(choices) > 4 and choices == tuple(np.arange(choices[0], choices[-1] + 1.0)):
            return f"a whole number, {choices[0]:g} to {choices[-1]:g}"
        signed = any(x < 0.0 for x in choices)
        return " or ".join(f"{x:+g}" if signed else f"{x:g}" for x in choices)


# Internal unit of each kind of quantity, and how it may be written, for messages.
QUANTITIES = {
    "length": ("mm", "a length, in mm, um, cm, m or inch"),
    "angle": ("rad", "an angle, in deg, rad, mrad or rev"),
    "mass": ("t", "a mass, in kg, g, t or lb"),
    "line_mass": ("t/mm", "a mass per length, in g/mm, kg/m or t/mm"),
    "inertia": ("t*mm^2", "an inertia, in kg*mm^2, g*mm^2, kg*m^2 or t*mm^2"),
    "force": ("N", "a force, in N, kN or lbf"),
    "torque": ("N*mm", "a torque, in N*mm or N*m"),
    "pressure": ("MPa", "a pressure, in MPa, N/mm^2 or kN/m^2"),
    "stiffness": ("N/mm", "a stiffness, in N/mm, N/m or kN/mm"),
    "damping": ("N*s/mm", "a damping, in N*s/mm or N*s/m"),
    "rotary_damping": ("N*mm*s", "a torque over a speed, in N*m/rpm, N*m*s or N*mm*s"),
    "speed": ("rad/s", "a speed of rotation, in rpm, rad/s or deg/s"),
    "angular_acceleration": ("rad/s^2", "an angular acceleration, in rad/s^2"),
    "acceleration": ("mm/s^2", "an acceleration, in m/s^2 or mm/s^2"),
    "time": ("s", "a time, in s, ms, min or h"),
}
WORDS = {word: unit for word, (unit, _) in QUANTITIES.items()}
PER_RADIAN = "length/rad"  # of a speed by the crank angle with a name that is no derivative's, unlike ds
_WORD = re.compile(r"[a-z_]{2,}")
_PRODUCT = re.compile(r"(1|rad|s|N|[a-z_]{2,})(\^[2-9])?([*/](rad|s|N|[a-z_]{2,})(\^[2-9])?)*")


def spelt_out(word: str) -> str:
    """Return a product of unit words in internal units.

    >>> spelt_out("length^4"), spelt_out("force/length"), spelt_out("1/length")
    ('mm^4', 'N/mm', '1/mm')
    """
    return _WORD.sub(lambda found: WORDS.get(found[0], found[0]), word)


def is_known(word: str) -> bool:
    """Whether a unit consists of known words, so that study files can convert it and results can name it.

    >>> is_known("length/time"), is_known("parsec"), is_known("N s")
    (True, False, False)
    """
    return bool(_PRODUCT.fullmatch(word)) and set(_WORD.findall(word)) <= {*WORDS, "rad"}


def of_derivative(unit: str, variable: str) -> str:
    """Find the unit of the derivative of a quantity by a variable of the domain; radians are left out of quotients.

    >>> of_derivative("length", "rad"), of_derivative("rad", "rad"), of_derivative("N", "length")
    ('length', '1', 'N/length')
    """
    if unit == variable:
        return "1"
    return unit if variable == "rad" else f"{unit}/{variable}"


@dataclass(frozen=True)
class Output:
    """One quantity of a family: unit in SI words ("rad", "length", "1"), definition, equation of its page.

    Parameters
    ----------
    name, unit, text, equation : as they are printed
    jumps : it is a whole number or otherwise piecewise constant, so that optimisers have no gradient
    wraps : an angle that is known only up to full turns; its curves are made continuous
    windowed : a deviation, of which only the part inside the window of the stroke counts if a window is given
    stage, own : in a chain the number of its stage, and its name there
    parts : components of a rate, for its magnitude
    kinks : its curves have kinks or jumps where a velocity or force reverses, as with friction: extrema are searched
        for panel by panel
    """

    name: str
    unit: str
    text: str
    equation: str = ""
    jumps: bool = False
    wraps: bool = False
    windowed: bool = False
    stage: str = ""
    own: str = ""
    kinks: bool = False
    parts: tuple[str, ...] = ()

    @property
    def base(self) -> str:
        """Name without the number of a stage."""
        return self.own or self.name

    def of_stage(self, number: int) -> Output:
        """Return the output as the one of a stage in a chain, with the number of the stage in its name."""
        words = f"stage {number}: {self.text}"
        return replace(self, name=f"{self.name}{number}", text=words, stage=str(number), own=self.name)


TWO_TURNS, TWO_TURNS_DEG = 2.0 * TWO_PI * (1.0 + 1e-9), 720.0


def reads_as_degrees(largest: float) -> bool:
    """Whether crank angles with the given largest value were written in degrees where rad are expected.

    Crank angles may exceed a turn.  Between two turns in rad and two turns in degrees a grid whose largest value is a
    whole or half number was written in degrees: one in rad ends at a multiple of pi.

    >>> reads_as_degrees(180.0), reads_as_degrees(12.5), reads_as_degrees(62.83185)
    (True, False, False)
    """
    return TWO_TURNS < abs(largest) <= TWO_TURNS_DEG and (2.0 * largest).is_integer()


@dataclass(frozen=True)
class Event:
    """An event where a pose output passes a level: entry, landing, loss of contact.

    Parameters
    ----------
    name : of the event; ``phi_NAME`` is the place of its first occurrence, ``count_NAME`` the number of occurrences
    of : the pose output that passes the level
    text : what happens, in words
    level : in the unit of the output
    rising : whether the level is passed upwards
    """

    name: str
    of: str
    text: str
    level: float = 0.0
    rising: bool = True
