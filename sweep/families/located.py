"""Points of a member in the machine's frame: coordinates and velocities."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from sweep.families.base import Array
from sweep.families.capabilities import Coordinates, OutputLink, Points
from sweep.families.placing import AXES

if TYPE_CHECKING:
    from sweep.families.members import Member

TIP = "tip"
EYE = "eye"  # on the coupler, the link between the points b and c


def coordinates(m: Member, point: str, designs: Array, own_designs: Array, result: Mapping[str, Any]) -> dict[str, Any]:
    """Return coordinates of a point in the machine's frame, (n, m)."""
    start, at = m.columns.stop + 1, m.origin(designs)
    if point == TIP:
        link = m.family.find(OutputLink)
        assert link is not None
        x, y, z = (designs[:, [start + k]] for k in range(3, 6))
        angle = result[m.family.position]
        cos, sin, origin = np.cos(angle), np.sin(angle), link.origin(own_designs)
        local = [origin[:, [0]] + x * cos - y * sin, origin[:, [1]] + x * sin + y * cos, origin[:, [2]] + z + 0.0 * cos]
    elif point == EYE:
        first = start + (3 if m.tip is None else 6)
        local = _on_coupler(m, result, [designs[:, [first + k]] for k in range(len(m.eye or ()))])
    else:
        local = _local(m, point, result)
    turn = m.place.rotation
    return {f"{point}_{axis}": at[:, [k]] + sum(turn[k, j] * local[j] for j in range(3)) for k, axis in enumerate(AXES)}


def coupler_joints(m: Member) -> tuple[Coordinates, Coordinates] | None:
    """Return coordinates of both joints of the coupler; None where the family does not give them."""
    named = {name: at for points in m.family.every(Points) for name, at in points.at.items()}
    return (named["b"], named["c"]) if {"b", "c"} <= set(named) else None


def is_planar(m: Member) -> bool:
    """Return whether the coupler moves in a plane z = constant, so that its two joints tell how it stands."""
    joints = coupler_joints(m)
    return joints is not None and all(at[2] is None for at in joints)


def _local(m: Member, point: str, result: Mapping[str, Any]) -> list[Any]:
    names = next(points.at[point] for points in m.family.every(Points) if point in points.at)
    return [result[name] if name else 0.0 for name in names]


def _on_coupler(m: Member, result: Mapping[str, Any], eye: list[Any]) -> list[Any]:
    """Return a point of the coupler: along it from b;
    of a planar one also across it, counter-clockwise, and along z.
    """
    b, c = (_local(m, point, result) for point in "bc")
    along = [end - start for start, end in zip(b, c, strict=True)]
    length = np.sqrt(along[0] ** 2 + along[1] ** 2 + along[2] ** 2)
    point = [start + eye[0] / length * part for start, part in zip(b, along, strict=True)]
    if len(eye) == 1:
        return point
    return [point[0] - eye[1] / length * along[1], point[1] + eye[1] / length * along[0], point[2] + eye[2]]


def velocity(m: Member, point: str, designs: Array, result: Mapping[str, Any]) -> dict[str, Any]:
    """Return the velocity analogue of a point in the machine's frame, (n, m): the place of a member does not move."""
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
