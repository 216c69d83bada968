"""Relations between members of a machine, pose by pose: distances, speeds, torques."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from sweep.errors import InputError, choices
from sweep.families.base import PER_RADIAN, Output, Parameter, Step
from sweep.families.sites import AXES, components, rate_of, vector_of

if TYPE_CHECKING:
    from sweep.families.machines.machine import Machine


@dataclass(frozen=True)
class Relation:
    """A quantity of several members; the base class has no pose outputs and no parameters."""

    name: str

    @property
    def outputs(self) -> tuple[Output, ...]:
        """Pose outputs, computed from those of the members."""
        return ()

    @property
    def numbers(self) -> tuple[Output, ...]:
        """Design outputs whose members need effects."""
        return ()

    @property
    def parameters(self) -> tuple[Parameter, ...]:
        """Parameters that the relation adds to the machine."""
        return ()

    @property
    def rates(self) -> Mapping[str, str]:
        """Derivative by the angle of the main shaft of each pose output that has one."""
        return {}

    def step(self, machine: Machine) -> Step | None:
        """Make the machine's own step to the design outputs of the relation; None if it has none."""
        return None

    def needs(self, wanted: frozenset[str]) -> frozenset[str]:
        """Names of the members' pose outputs that the wanted outputs need."""
        return frozenset()

    def compute(self, found: Mapping[str, Any], wanted: frozenset[str]) -> dict[str, Any]:
        """Compute the wanted outputs, (n, m), from those of the members."""
        return {}


@dataclass(frozen=True)
class Timing:
    """Difference of two crank angles of the main shaft, the second minus the first, in (-pi, pi].

    ``places`` are design outputs such as "needle.phi_ext" or "phi_min_clearance"; those of a member are converted to
    the angle of the main shaft.
    """

    name: str
    places: tuple[str, str]

    @property
    def output(self) -> Output:
        """The difference as an output."""
        first, second = self.places
        return Output(self.name, "rad", f"crank angle from {first} to {second}, in (-pi, pi]", "ours")


@dataclass(frozen=True)
class EventValue:
    """Value of a pose output at an event, such as the speed of a tip where it arrives.

    ``of`` is the machine's pose output; ``places`` holds one design output that is a crank angle of the main shaft,
    such as "phi_arrive".
    """

    name: str
    of: Output
    places: tuple[str]

    @property
    def output(self) -> Output:
        """The value as an output."""
        return Output(self.name, self.of.unit, f"{self.of.name} at {self.places[0]}", "ours", wraps=self.of.wraps)


@dataclass(frozen=True)
class Distance(Relation):
    """Distance of two points, whose dotted names are such as "needle.point"."""

    points: tuple[str, str]

    @property
    def outputs(self) -> tuple[Output, ...]:
        """The distance, and its components from the first point to the second."""
        a, b = self.points
        size = Output(self.name, "length", f"distance of {a} and {b}", "ours")
        parts = (
            Output(f"{self.name}_{x}", "length", f"{x} of {b} minus {x} of {a}, machine's frame", "ours") for x in AXES
        )
        return size, *parts

    def needs(self, wanted: frozenset[str]) -> frozenset[str]:
        """Names of the coordinates of both points."""
        return frozenset(components(*self.points))

    def compute(self, found: Mapping[str, Any], wanted: frozenset[str]) -> dict[str, Any]:
        """Compute the distance and its components, (n, m)."""
        a, b = self.points
        parts = [end - start for start, end in zip(vector_of(a, found), vector_of(b, found), strict=True)]
        return with_size(self.name, parts, wanted)


@dataclass(frozen=True)
class PointSpeed(Relation):
    """Speed of a point in the machine's frame, or of a second point relative to the first.

    ``points`` are one or two dotted names such as "looper.tip".
    """

    points: tuple[str, ...]

    @property
    def outputs(self) -> tuple[Output, ...]:
        """The speed, per radian of the main shaft."""
        text = f"speed of {self.points[-1]}" + (f" relative to {self.points[0]}" if len(self.points) == 2 else "")
        return (Output(self.name, PER_RADIAN, f"{text}, per radian of the main shaft", "ours"),)

    def needs(self, wanted: frozenset[str]) -> frozenset[str]:
        """Names of the velocities of the points."""
        return frozenset(components(*map(rate_of, self.points)))

    def compute(self, found: Mapping[str, Any], wanted: frozenset[str]) -> dict[str, Any]:
        """Compute the speed, (n, m)."""
        *first, parts = (vector_of(rate_of(point), found) for point in self.points)
        for other in first:
            parts = [part - rate for part, rate in zip(parts, other, strict=True)]
        return {self.name: np.sqrt(parts[0] ** 2 + parts[1] ** 2 + parts[2] ** 2)}


def with_size(name: str, parts: list[Any], wanted: frozenset[str]) -> dict[str, Any]:
    """Return the components, and the magnitude if it is wanted."""
    columns = {f"{name}_{axis}": part for axis, part in zip(AXES, parts, strict=True)}
    return columns | ({name: np.sqrt(parts[0] ** 2 + parts[1] ** 2 + parts[2] ** 2)} if name in wanted else {})


def check_unique(names: Sequence[str]) -> None:
    """Raise for an output or parameter that two relations have, since its name would be ambiguous."""
    seen: set[str] = set()
    for name in names:
        if name in seen:
            allowed = "an output or parameter of one relation alone: rename one of both"
            raise InputError("relation", name, allowed, "machine.relations")
        seen.add(name)


def pair(key: str, given: object, allowed: str, where: str) -> tuple[Any, Any]:
    """Return the two values that a user gives for a key."""
    if not isinstance(given, tuple) or len(given) != 2:
        raise InputError(key, given, allowed, where)
    return given


def two_names(given: object, known: Sequence[str] | None, what: str, where: str) -> tuple[str, str]:
    """Check that a user gives two names, among the known ones if these are given."""
    names = pair(what, given, f"two {what}", where)
    first, second = names if known is None else known_names(names, known, what, where)
    return first, second


NONE_HERE = "this machine has none"  # of what is allowed


def known_names(given: object, known: Sequence[str], what: str, where: str) -> tuple[str, ...]:
    """Check that a user gives a list of known names."""
    if not isinstance(given, tuple):
        raise InputError(what, given, f"a list of {what}", where)
    for part in given:
        if part not in known:
            raise InputError(what, part, f"{what}: {choices(str(part), known) or NONE_HERE}", where)
    return given
