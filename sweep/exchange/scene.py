"""What every export begins with: the joints over one whole turn, stages in frames of their own side by side."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from sweep.errors import InputError
from sweep.evaluation.joints import Part, parts
from sweep.evaluation.statuses import meaning
from sweep.families import Mechanism
from sweep.families.base import Array

if TYPE_CHECKING:
    from sweep.evaluation.tables import Table

GAP = 0.25  # between two frames side by side, as a part of the larger one


@dataclass(frozen=True)
class Placed:
    """A part, and by how much its frame is moved so that nothing stands in its way."""

    part: Part
    shift: Array


def turn(mechanism: Mechanism, design: Table, phi: float, poses: int) -> list[Placed]:
    """All parts over one turn from ``phi`` on, the last pose being the first one again.

    Raises
    ------
    InputError
        where a pose does not exist.
    """
    angles = phi + np.linspace(0.0, 2.0 * math.pi, poses + 1)
    found = parts(mechanism, design, angles)
    for part in found:
        if not part.links:
            raise InputError(
                "mechanism", part.family.name, "a mechanism whose links are known: see docs/frames.md", "export"
            )
        bad = np.flatnonzero([not np.isfinite(path).all(axis=1).all() for path in part.joints.values()])
        if bad.size:
            pose = int(np.argmax(part.status != 0))
            value = f"{meaning(int(part.status[pose]))} at phi = {angles[pose]:.6g}"
            raise InputError(part.label, value, "a design whose crank turns fully", "export")
    return side_by_side(found)


def side_by_side(found: Sequence[Part]) -> list[Placed]:
    """Parts of one frame stay together; each further frame stands beside those before it, along x."""
    placed, right = [], math.nan
    for frame in dict.fromkeys(part.frame for part in found):
        same = [part for part in found if part.frame == frame]
        points = np.vstack([path for part in same for path in part.joints.values()])
        low, high = float(np.nanmin(points[:, 0])), float(np.nanmax(points[:, 0]))
        along = 0.0 if math.isnan(right) else right + GAP * extent(same) - low
        placed += [Placed(part, np.array([along, 0.0, 0.0])) for part in same]
        right = high + along
    return placed


def extent(found: Sequence[Part]) -> float:
    """Largest extent of all joints over the turn."""
    points = np.vstack([path for part in found for path in part.joints.values()])
    return float(np.nanmax(np.nanmax(points, axis=0) - np.nanmin(points, axis=0)))


def shown_name(joint: str) -> str:
    """A joint as the docs write it: A, B, C1, but point and line."""
    return joint.upper() if len(joint) < 3 else joint
