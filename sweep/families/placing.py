"""Where a member of a machine stands: its own frame in the machine's frame."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from sweep.errors import InputError
from sweep.families.base import Array

AXES = "xyz"


@dataclass(frozen=True)
class Place:
    """A member's frame in the machine's frame.

    Parameters
    ----------
    at : where the origin of the member's frame stands [length]
    axis : direction of the member's z, of any length
    zero : direction of the member's x; what it has along ``axis`` does not count
    """

    at: tuple[float, float, float] = (0.0, 0.0, 0.0)
    axis: tuple[float, float, float] = (0.0, 0.0, 1.0)
    zero: tuple[float, float, float] = (1.0, 0.0, 0.0)

    @property
    def rotation(self) -> Array:
        """R (3, 3): a vector v of the member's frame is R v in the machine's frame."""
        z = np.array(self.axis) / np.linalg.norm(self.axis)
        x = np.array(self.zero) - np.dot(self.zero, z) * z
        x /= np.linalg.norm(x)
        return np.column_stack([x, np.cross(z, x), z])


# Where a record per pose and one per design have points; the other vectors of both are directions (kernels/joints.py).
_PLACES_OF_POSE, _PLACES_OF_DESIGN = (0, 3), (6, 9)


def move_records(rotation: Array, origin: Array, per_pose: Array, per_design: Array) -> None:
    """Bring joint records that were filled in the frame of another family into a family's own frame, in place.

    A vector v of the other frame is ``rotation`` v in the own one, (3, 3), and its origin stands at ``origin``, (n, 3).
    Quarter turns, which have one 1 or -1 a row, change no digit.
    """
    for vectors, places, shift in (
        (per_pose, _PLACES_OF_POSE, origin[:, None, :]),
        (per_design, _PLACES_OF_DESIGN, origin),
    ):
        for k in range(0, 21 if vectors is per_pose else 12, 3):
            vectors[..., k : k + 3] = vectors[..., k : k + 3] @ rotation.T
        for k in places:
            vectors[..., k : k + 3] += shift


def place(member: str, given: Place | dict[str, Any] | None) -> Place:
    """Return a member's place from what a user gives, checked.

    Raises
    ------
    InputError
        for a key that is none, a vector without three finite numbers, an axis of no length or along ``zero``.
    """
    if given is None:
        return Place()
    if isinstance(given, Place):
        return given
    where = f"machine.{member}.place"
    for key in given:
        if key not in ("at", "axis", "zero"):
            raise InputError(key, given[key], "at, axis, zero", where)
    found = Place(**{key: vector(value, f"{where}.{key}") for key, value in given.items()})
    if not np.linalg.norm(found.axis) > 0.0:
        raise InputError("axis", found.axis, "a direction", where)
    if not np.linalg.norm(np.cross(found.axis, found.zero)) > 1e-9 * np.linalg.norm(found.axis) * np.linalg.norm(
        found.zero
    ):
        raise InputError("zero", found.zero, "a direction that is not along axis", where)
    return found


def vector(value: object, where: str) -> tuple[float, float, float]:
    """Return three finite numbers.

    Raises
    ------
    InputError
        for anything else.
    """
    allowed = "three finite numbers [x, y, z]"
    if not isinstance(value, Sequence | np.ndarray) or isinstance(value, str) or len(value) != 3:
        raise InputError(where, value, allowed, where)
    try:
        x, y, z = (float(part) for part in value)
    except (TypeError, ValueError):
        raise InputError(where, value, allowed, where) from None
    if not np.isfinite([x, y, z]).all():
        raise InputError(where, value, allowed, where)
    return x, y, z
