"""Families that have the kernels of another one, with other symbols or in another frame: what is carried over."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

from kernels.types import Array
from sweep.families.base import Accuracy, Columns, Step
from sweep.families.capabilities import DesignMap

# Where a record per pose and one per design have points (kernels/linkage/joints.py); the other vectors are directions.
_POINTS_OF_POSE, _POINTS_OF_DESIGN = (0, 3), (6, 9)


def _same(name: str) -> str:
    return name


def step_of(
    step: Step, matrix: DesignMap, ours: Callable[[str], str] = _same, theirs: Callable[[str], str] = _same
) -> Step:
    """Take a step of the other family for designs of this one, whose design matrix there is ``matrix(designs)``.

    ``theirs`` gives the other family's name of an output, ``ours`` the way back.
    """

    def run(designs: Array, wanted: frozenset[str], accuracy: Accuracy) -> Columns:
        asked = frozenset(theirs(name) for name in wanted)
        if accuracy.proven:
            accuracy = replace(accuracy, proven=tuple(map(theirs, accuracy.proven)))
        found = step.run(matrix(designs), asked, accuracy)
        return {ours(name): values for name, values in found.items()}

    provides = tuple(replace(o, name=ours(o.name), equation="") for o in step.provides)
    return replace(step, provides=provides, run=run)


def of_matrix(of_theirs: DesignMap, matrix: DesignMap) -> DesignMap:
    """Take what the other family has of each design, for designs of this one."""
    return lambda designs: of_theirs(matrix(designs))


def move_records(rotation: Array, origin: Array, per_pose: Array, per_design: Array) -> None:
    """Bring joint records that were filled in the frame of another family into a family's own frame, in place.

    A vector v of the other frame is ``rotation`` v in the own one, (3, 3), and its origin stands at ``origin``, (n, 3).
    Quarter turns, which have one 1 or -1 a row, change no digit.
    """
    for vectors, points, shift in (
        (per_pose, _POINTS_OF_POSE, origin[:, None, :]),
        (per_design, _POINTS_OF_DESIGN, origin),
    ):
        for k in range(0, 21 if vectors is per_pose else 12, 3):
            vectors[..., k : k + 3] = vectors[..., k : k + 3] @ rotation.T
        for k in points:
            vectors[..., k : k + 3] += shift
