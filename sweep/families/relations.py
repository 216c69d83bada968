"""What two or more members of a machine are to each other, pose by pose: distances, torques on the shaft, shaking."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np

from sweep.families.base import Array, Output, Parameter
from sweep.families.placing import AXES


class Relation(Protocol):
    """A quantity of several members: pose outputs made of theirs."""

    @property
    def name(self) -> str: ...  # noqa: D102
    @property
    def outputs(self) -> tuple[Output, ...]: ...  # noqa: D102
    @property
    def parameters(self) -> tuple[Parameter, ...]: ...  # noqa: D102
    @property
    def needs(self) -> frozenset[str]: ...  # noqa: D102

    def compute(  # noqa: D102
        self, found: Mapping[str, Any], rotations: Mapping[str, Array], wanted: frozenset[str]
    ) -> dict[str, Any]: ...


@dataclass(frozen=True)
class Timing:
    """Difference of two crank angles of the main shaft, the second minus the first, in (-pi, pi].

    ``places`` are design outputs such as "needle.phi_ext" or "phi_min_clearance"; those of a member count as the angle
    of the main shaft.
    """

    name: str
    places: tuple[str, str]

    @property
    def output(self) -> Output:
        """The difference."""
        first, second = self.places
        return Output(self.name, "rad", f"crank angle from {first} to {second}, in (-pi, pi]", "ours")


@dataclass(frozen=True)
class Distance:
    """Distance of two points; ``points`` are dotted names such as "needle.point"."""

    name: str
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

    @property
    def parameters(self) -> tuple[Parameter, ...]:
        """It has none of its own."""
        return ()

    @property
    def needs(self) -> frozenset[str]:
        """Coordinates of both points."""
        return frozenset(f"{point}_{axis}" for point in self.points for axis in AXES)

    def compute(
        self, found: Mapping[str, Any], rotations: Mapping[str, Array], wanted: frozenset[str]
    ) -> dict[str, Any]:
        """Distance and components, (n, m)."""
        a, b = self.points
        parts = [found[f"{b}_{axis}"] - found[f"{a}_{axis}"] for axis in AXES]
        columns = {f"{self.name}_{axis}": part for axis, part in zip(AXES, parts, strict=True)}
        return columns | {self.name: np.sqrt(parts[0] ** 2 + parts[1] ** 2 + parts[2] ** 2)}


@dataclass(frozen=True)
class Speed:
    """Speed of a point in the machine's frame, or of a second point as the first one sees it.

    ``points`` are one or two dotted names such as "looper.tip".
    """

    name: str
    points: tuple[str, ...]

    @property
    def outputs(self) -> tuple[Output, ...]:
        """The speed, per radian of the main shaft."""
        text = f"speed of {self.points[-1]}" + (f" relative to {self.points[0]}" if len(self.points) == 2 else "")
        return (Output(self.name, "length", f"{text}, per radian of the main shaft", "ours"),)

    @property
    def parameters(self) -> tuple[Parameter, ...]:
        """It has none of its own."""
        return ()

    @property
    def needs(self) -> frozenset[str]:
        """Velocities of the points."""
        return frozenset(velocity for point in self.points for velocity in _velocities(point))

    def compute(
        self, found: Mapping[str, Any], rotations: Mapping[str, Array], wanted: frozenset[str]
    ) -> dict[str, Any]:
        """The speed, (n, m)."""
        parts = [found[name] for name in _velocities(self.points[-1])]
        if len(self.points) == 2:
            parts = [part - found[name] for part, name in zip(parts, _velocities(self.points[0]), strict=True)]
        return {self.name: np.sqrt(parts[0] ** 2 + parts[1] ** 2 + parts[2] ** 2)}


def _velocities(point: str) -> tuple[str, ...]:
    member, _, own = point.partition(".")
    return tuple(f"{member}.d{own}_{axis}" for axis in AXES)


@dataclass(frozen=True)
class ShaftTorque:
    """Torque that the main shaft has to give: drive torques of members, times their ratios.

    ``torques`` are the dotted outputs with their ratios.
    """

    name: str
    torques: tuple[tuple[str, int], ...]

    @property
    def outputs(self) -> tuple[Output, ...]:
        """The torque."""
        words = ", ".join(name for name, _ in self.torques)
        return (Output(self.name, "torque", f"torque on the main shaft that drives {words}", "ours"),)

    @property
    def parameters(self) -> tuple[Parameter, ...]:
        """It has none of its own."""
        return ()

    @property
    def needs(self) -> frozenset[str]:
        """The drive torques."""
        return frozenset(name for name, _ in self.torques)

    def compute(
        self, found: Mapping[str, Any], rotations: Mapping[str, Array], wanted: frozenset[str]
    ) -> dict[str, Any]:
        """The torque, (n, m): equal power on both sides of every gear."""
        return {self.name: sum(ratio * found[name] for name, ratio in self.torques)}


@dataclass(frozen=True)
class Shaking:
    """Resultant force of the members on the frame of the machine; ``members`` by name and stage number."""

    name: str
    members: tuple[tuple[str, str], ...]

    @property
    def outputs(self) -> tuple[Output, ...]:
        """Magnitude and components in the machine's frame."""
        words = ", ".join(f"{member} {stage}".strip() for member, stage in self.members)
        size = Output(self.name, "force", f"magnitude of the force of {words} on the frame", "ours")
        parts = (
            Output(f"{self.name}_{x}", "force", f"{x} of the force of {words} on the frame, machine's frame", "ours")
            for x in AXES
        )
        return size, *parts

    @property
    def parameters(self) -> tuple[Parameter, ...]:
        """It has none of its own."""
        return ()

    @property
    def needs(self) -> frozenset[str]:
        """The frame's forces on crank and follower of every member."""
        return frozenset(
            f"{member}.force_{joint}{stage}_{axis}" for member, stage in self.members for joint in "ad" for axis in AXES
        )

    def compute(
        self, found: Mapping[str, Any], rotations: Mapping[str, Array], wanted: frozenset[str]
    ) -> dict[str, Any]:
        """The force on the frame is minus the force of the frame, (n, m)."""
        total: list[Any] = [0.0, 0.0, 0.0]
        for member, stage in self.members:
            own = [-(found[f"{member}.force_a{stage}_{x}"] + found[f"{member}.force_d{stage}_{x}"]) for x in AXES]
            turn = rotations[member]
            total = [total[k] + sum(turn[k, j] * own[j] for j in range(3)) for k in range(3)]
        columns = {f"{self.name}_{axis}": part for axis, part in zip(AXES, total, strict=True)}
        return columns | {self.name: np.sqrt(total[0] ** 2 + total[1] ** 2 + total[2] ** 2)}
