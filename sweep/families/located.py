"""Points of a member in the machine's frame: coordinates and velocities."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from sweep.families.base import Array
from sweep.families.capabilities import OutputLink, Points
from sweep.families.placing import AXES

if TYPE_CHECKING:
    from sweep.families.members import Member

TIP = "tip"


def coordinates(m: Member, point: str, designs: Array, own_designs: Array, result: Mapping[str, Any]) -> dict[str, Any]:
    """Coordinates of a point in the machine's frame, (n, m)."""
    start, at = m.columns.stop + 1, m.origin(designs)
    if point == TIP:
        link = m.family.find(OutputLink)
        assert link is not None
        x, y, z = (designs[:, [start + k]] for k in range(3, 6))
        angle = result[m.family.position]
        cos, sin, origin = np.cos(angle), np.sin(angle), link.origin(own_designs)
        local = [origin[:, [0]] + x * cos - y * sin, origin[:, [1]] + x * sin + y * cos, origin[:, [2]] + z + 0.0 * cos]
    else:
        names = next(points.at[point] for points in m.family.every(Points) if point in points.at)
        local = [result[name] if name else 0.0 for name in names]
    turn = m.place.rotation
    return {f"{point}_{axis}": at[:, [k]] + sum(turn[k, j] * local[j] for j in range(3)) for k, axis in enumerate(AXES)}


def velocity(m: Member, point: str, designs: Array, result: Mapping[str, Any]) -> dict[str, Any]:
    """Velocity analogue of a point in the machine's frame, (n, m): the place of a member does not move."""
    if point == TIP:
        start = m.columns.stop + 1
        x, y = designs[:, [start + 3]], designs[:, [start + 4]]
        angle, rate = result[m.family.position], result[str(m.moving[TIP][0])]
        cos, sin = np.cos(angle), np.sin(angle)
        local = [rate * (-x * sin - y * cos), rate * (x * cos - y * sin), 0.0 * rate]
    else:
        local = [result[name] if name else 0.0 for name in m.moving[point]]
    turn = m.place.rotation
    return {f"d{point}_{axis}": sum(turn[k, j] * local[j] for j in range(3)) for k, axis in enumerate(AXES)}
