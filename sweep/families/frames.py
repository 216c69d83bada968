"""Frames of stages and members, determined by placing each crank axis on a turning axis."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise
from typing import Any, NamedTuple

import numpy as np

from kernels.types import Array
from sweep.families.base import Family, Parameter, Stage
from sweep.families.capabilities import OutputLink, skeleton_of
from sweep.families.skeletons import X, Z

CRANKS = ("a", "a1", "o2")  # families' names of the joint on the axis of their first crank


class Frame(NamedTuple):
    """A frame in an outer frame, for each design or for all: a vector v becomes ``rotation`` v, its origin is ``at``.

    ``rotation`` is (n, 3, 3) or (1, 3, 3), ``at`` (n, 3) or (1, 3); complex designs give complex frames.
    """

    rotation: Array
    at: Array

    def turned(self, vector: list[Any]) -> list[Any]:
        """Transform a vector to the outer frame; components (n, m) each."""
        x, y, z = vector
        return [r[:, 0, None] * x + r[:, 1, None] * y + r[:, 2, None] * z for r in self.rotation.swapaxes(0, 1)]

    def placed(self, point: list[Any]) -> list[Any]:
        """Transform a point to the outer frame; coordinates (n, m) each."""
        return [self.at[:, [k]] + part for k, part in enumerate(self.turned(point))]

    def within(self, outer: Frame) -> Frame:
        """Return this frame, given in ``outer``, relative to the frame that ``outer`` is given in."""
        if self is WHOLE:
            return outer
        return Frame(outer.rotation @ self.rotation, outer.at + _times(outer.rotation, self.at))

    @property
    def inverse(self) -> Frame:
        """The outer frame in this one."""
        back = np.swapaxes(self.rotation, 1, 2)
        return Frame(back, -_times(back, self.at))


class TurningAxis(NamedTuple):
    """A turning axis: a point of it, its direction, and the zero direction of angles about it; each (n, 3)."""

    at: Array
    along: Array
    zero: Array


WHOLE = Frame(np.eye(3)[None], np.zeros((1, 3)))


def tilted(rotation: Array, tilts: Array) -> Array:
    """Turn a rotation (1, 3, 3) by angles (n, 3) about x, y, z of the outer frame, one after another."""
    if not tilts.any():
        return rotation
    rows = np.broadcast_to(rotation, (len(tilts), 3, 3)).astype(tilts.dtype)
    for k, (i, j) in enumerate(((1, 2), (2, 0), (0, 1))):
        cos, sin = np.cos(tilts[:, [k]]), np.sin(tilts[:, [k]])
        rows[:, i], rows[:, j] = cos * rows[:, i] - sin * rows[:, j], sin * rows[:, i] + cos * rows[:, j]
    return rows


def place_parameters(what: str, at: Sequence[float]) -> tuple[Parameter, ...]:
    """Make the parameters of a part's place and tilt in the machine's frame, which may have tolerances."""
    return (
        *(
            Parameter(f"{axis}_at", "length", f"{axis} of {what} in the machine's frame", default=x)
            for axis, x in zip("xyz", at, strict=True)
        ),
        *(
            Parameter(f"{axis}_tilt", "angle", f"turn of {what} about {axis} of the machine's frame", default=0.0)
            for axis in "xyz"
        ),
    )


def _times(matrix: Array, vector: Array) -> Array:
    return np.asarray(np.einsum("nij,nj->ni", matrix, vector))


def mounted(axis: TurningAxis, crank: TurningAxis, sense: Any, shift: Any, turn: Any) -> Frame:
    """Compute the frame whose crank axis lies on a turning axis, machine-and-stitch (1) and (4).

    Parameters
    ----------
    axis : the turning axis
    crank : the crank axis in the wanted frame, with the direction of the crank at phi = 0
    sense : +1 or -1: whether the crank axis runs along the turning axis or against it
    shift : from the point of the axis, along it, to the point of the crank axis, (n,)
    turn : angle about the axis, from its zero, to the direction of the crank at phi = 0, (n,)
    """
    sense, shift, turn = (np.atleast_1d(x)[:, None] for x in (sense, shift, turn))
    zero = np.cos(turn) * axis.zero + np.sin(turn) * np.cross(axis.along, axis.zero)
    rotation = _triad(zero, sense * axis.along, -1) @ _triad(crank.zero, crank.along, -2)
    return Frame(rotation, axis.at + shift * axis.along - _times(rotation, crank.at))


def _triad(zero: Array, along: Array, axis: int) -> Array:
    zero, along = np.broadcast_arrays(zero, along)
    return np.stack([zero, np.cross(along, zero), along], axis=axis)


def crank_axis(family: Family, designs: Array) -> TurningAxis | None:
    """Return the axis of the first crank in the family's frame; None if the family has none."""
    fixed = skeleton_of(family).fixed
    crank = next((fixed[name] for name in CRANKS if name in fixed), None)
    if crank is None or crank.axis is None or crank.kind != "axis":
        return None
    at = crank.at if crank.foot is None else crank.foot
    zero = np.tile(X, (len(designs), 1)) if crank.zero is None else crank.zero(designs)
    return TurningAxis(at(designs), crank.axis(designs), zero)


def output_axis(family: Family, designs: Array) -> TurningAxis | None:
    """Return the output link's axis in the family's frame, from its point with z = 0; None without such a link."""
    link = family.find(OutputLink)
    if link is None:
        return None
    at = link.origin(designs)
    return TurningAxis(at, np.tile(Z, (len(at), 1)), np.tile(X, (len(at), 1)))


def stage_frames(stages: Sequence[Stage], designs: Array) -> list[Frame]:
    """Compute the frames of all stages of a chain in that of the first, from designs of the chain."""
    found = [WHOLE]
    for before, stage in pairwise(stages):
        axis = output_axis(before.family, before.designs(designs))
        crank = crank_axis(stage.family, stage.designs(designs))
        assert axis is not None and crank is not None and stage.shift is not None
        kappa, shift, turn = (designs[:, k] for k in (stage.kappa, stage.shift, stage.turn))
        found.append(mounted(axis, crank, kappa, shift, turn).within(found[-1]))
    return found


def can_be_placed(families: Sequence[Family]) -> bool:
    """Whether each family drives the crank of the next about an axis that both define."""
    return all(
        before.find(OutputLink) is not None and crank_axis(family, np.ones((1, len(family.parameters)))) is not None
        for before, family in pairwise(families)
    )
