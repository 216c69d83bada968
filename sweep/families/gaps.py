"""Gaps between bodies of a machine, taken as capsules: machine-and-stitch, 4."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from sweep.families.base import Output, Parameter
from sweep.families.frames import Frame
from sweep.families.segments import closest, dot, minus, triple_product
from sweep.families.sites import AXES


@dataclass(frozen=True)
class Body:
    """A segment with a radius.

    ``ends`` are dotted names of two points, or of a point and of a direction along which both ends lie, at ``reach``.
    """

    name: str
    ends: tuple[str, str]
    reach: tuple[float, float] | None = None
    radius: float = 0.0

    @property
    def needs(self) -> frozenset[str]:
        """Return the coordinates of its ends."""
        return frozenset(f"{end}_{axis}" for end in self.ends for axis in AXES)

    def segment(self, found: Mapping[str, Any]) -> tuple[list[Any], list[Any]]:
        """Return both ends, coordinates (n, m)."""
        start, end = ([found[f"{name}_{axis}"] for axis in AXES] for name in self.ends)
        if self.reach is None:
            return start, end
        first, last = ([x + far * along for x, along in zip(start, end, strict=True)] for far in self.reach)
        return first, last


@dataclass(frozen=True)
class Gap:
    """Least distance of two bodies, less their radii."""

    name: str
    bodies: tuple[Body, Body]

    @property
    def outputs(self) -> tuple[Output, ...]:
        """The gap, the places along both bodies, and the side."""
        a, b = self.bodies
        places = (
            Output(f"{self.name}_{k}", "1", f"where along {body.name} it is nearest, 0 to 1", "(9)", kinks=True)
            for k, body in (("first", a), ("second", b))
        )
        side = (
            f"signed distance of the lines of {a.name} and {b.name}, times the sine of their angle; 0 where they meet"
        )
        return (
            Output(self.name, "length", f"gap between {a.name} and {b.name}, less their radii", "(9)", kinks=True),
            *places,
            Output(f"{self.name}_side", "length", side, "(11)"),
        )

    @property
    def parameters(self) -> tuple[Parameter, ...]:
        """It has none of its own."""
        return ()

    def needs(self, wanted: frozenset[str]) -> frozenset[str]:
        """Return the ends of both bodies."""
        return self.bodies[0].needs | self.bodies[1].needs

    def compute(self, found: Mapping[str, Any], frames: Mapping[str, Frame], wanted: frozenset[str]) -> dict[str, Any]:
        """Return the gap, where it is, and the side, (n, m)."""
        (p1, q1), (p2, q2) = (body.segment(found) for body in self.bodies)
        nearest = closest(p1, q1, p2, q2)
        columns = {self.name: nearest.distance - sum(body.radius for body in self.bodies)}
        columns |= {f"{self.name}_first": nearest.first, f"{self.name}_second": nearest.second}
        if f"{self.name}_side" in wanted:
            sizes = [np.sqrt(dot(d, d)) for d in (minus(q1, p1), minus(q2, p2))]
            columns[f"{self.name}_side"] = triple_product(p1, q1, p2, q2) / (sizes[0] * sizes[1])
        return columns
