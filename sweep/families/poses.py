"""Calls of the kernels of poses: for the wanted outputs, with checks of non-finite values, one set from another.

A kernel of poses is compiled for every set of outputs: code of outputs outside the set is left out.  That takes a
quarter of a second per set, and a study with an optimum asks for dozens of sets, most of them on a few thousand poses.
So in :class:`Together` a set on few poses is taken from a larger one, and gets machine code of its own once it is asked
for on many.  The larger set is that of all outputs; in twice the working precision that of all values, with the joints
only where one of them is wanted: a loop that writes all of these is not vectorised, and takes five times as long.
Where arguments are complex, which takes longer to compile, the larger set is the first set asked for, as long as it
includes the wanted one: optimisers ask for all curves first.  The bits are the same.

For families without complex arithmetic :func:`differentiable` answers a complex step by central differences.  Families
with the kernels of another family, but other symbols or another frame, convert the steps and joint records of that.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import replace
from functools import partial, update_wrapper
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import DTypeLike

from kernels.status import INVALID_INPUT, OK
from kernels.types import TWO_PI, Array, Status
from sweep.families.base import Accuracy, Angles, Columns, Domain, Family, Interval, Output, PoseFunction, Step, floats
from sweep.families.capabilities import DesignMap


def guarded(poses: PoseFunction) -> PoseFunction:
    """Wrap poses so that a parameter that is not finite, or a value beyond float64, gives INVALID_INPUT and nan.

    For kernels that read some parameters only where they matter.
    """

    def safe(designs: Array, angles: Angles, wanted: frozenset[str]) -> Columns:
        with np.errstate(all="ignore"):  # results that are not finite get a status
            columns = poses(designs, angles, wanted)
        status = np.array(columns["status"], np.uint8)
        bad = np.zeros(status.shape, np.bool_)
        for name in wanted:
            bad |= ~np.isfinite(columns[name])
        bad &= status == OK  # any other status explains its nan
        bad[~np.all(np.isfinite(designs), axis=1)] = True
        status[bad & (status == OK)] = INVALID_INPUT
        found: Columns = {name: np.where(bad, np.nan, columns[name]) for name in wanted}
        return found | {"status": status}

    return safe


def chosen(columns: Mapping[str, Any], wanted: frozenset[str], status: Status) -> Columns:
    """Return the wanted outputs with their errors, and the status."""
    return {name: x for name, x in columns.items() if name.removeprefix("err_") in wanted} | {"status": status}


def filled_each(
    kernel: Callable[..., object], arguments: Sequence[object], names: tuple[str, ...], wanted: frozenset[str],
    status: Status,
) -> Columns:  # fmt: skip
    """Call ``kernel(*arguments, status, *arrays)`` of an effect, with one array or None per output."""
    arrays = optional_outputs(names, wanted, status.shape)
    kernel(*arguments, status, *arrays)
    columns: Columns = {name: array for name, array in zip(names, arrays, strict=True) if array is not None}
    return columns | {"status": status}


def filled_all(
    kernel: Callable[..., object], arguments: Sequence[object], names: tuple[str, ...], wanted: frozenset[str],
    status: Status, dtype: DTypeLike = np.float64,
) -> Columns:  # fmt: skip
    """Call ``kernel(*arguments, status, out)``, which writes all its outputs, (k, n, m)."""
    out = np.empty((len(names), *status.shape), dtype)
    kernel(*arguments, status, out)
    return chosen(dict(zip(names, out, strict=True)), wanted, status)


def filled_by(kernel: Callable[..., object], needs: tuple[str, ...]) -> Callable[..., None]:
    """Make the function that fills joint records or bodies from the pose outputs ``needs``, with their kernel.

    It takes designs, angles, pose outputs and what ``kernel(designs, cos, sin, motion, *out)`` fills.
    """

    def fill(designs: Array, angles: Angles, motion: Columns, *out: Any) -> None:
        kernel(designs, angles.cos, angles.sin, np.stack(floats(motion, *needs)), *out)

    return fill


def poses_of(
    kernel: Callable[..., object],
    outputs: Any,
    blocks: Mapping[str, Sequence[Output]] | None = None,
    *,
    angles: str = "cos sin",
) -> PoseFunction:
    """Make poses of a ``kernel(designs, *angles, status, out)``, each output (n, m).

    Parameters
    ----------
    outputs : the kernel's namedtuple of arrays or None; a field is an output, or one of the ``blocks``
    blocks : fields that are several outputs in one array (k, n, m), computed where one of them is wanted
    angles : arguments of the kernel, of phi, cos and sin
    """
    of_block = {field: [o.name for o in block] for field, block in (blocks or {}).items()}
    names = {field: of_block.get(field, [field]) for field in outputs._fields}
    taken = angles.split()

    def poses(designs: Array, angles: Angles, wanted: frozenset[str]) -> Columns:
        shape, dtype = (len(designs), angles.cos.shape[1]), np.result_type(designs, angles.cos)
        status = np.empty(shape, np.uint8)
        rooms: list[Array | None] = []
        columns: Columns = {}
        for field, group in names.items():
            if wanted.isdisjoint(group):
                rooms.append(None)
                continue
            room = np.empty((len(group), *shape) if field in of_block else shape, dtype)
            rooms.append(room)
            if field in of_block:
                columns |= {name: values for name, values in zip(group, room, strict=True) if name in wanted}
            else:
                columns[field] = room
        kernel(designs, *(getattr(angles, name) for name in taken), status, outputs(*rooms))
        return columns | {"status": status}

    return poses


Made: TypeAlias = Mapping[str, tuple[tuple[str, ...], Callable[..., Array]]]
"""For an output the names that it needs, of other outputs or "status", and a function of the designs and of these."""


def following(poses: PoseFunction, made: Made, theirs: Callable[[str], str] = str) -> PoseFunction:
    """Make poses some of whose outputs follow from those of other poses; ``theirs`` names the rest there."""

    def found(designs: Array, angles: Angles, wanted: frozenset[str]) -> Columns:
        needs = {name: made[name][0] if name in made else (theirs(name),) for name in wanted}
        given = poses(designs, angles, frozenset[str]().union(*needs.values()) - {"status"})
        columns: Columns = {"status": given["status"]}
        for name, names in needs.items():
            parts = [given[one] for one in names]
            columns[name] = made[name][1](designs, *parts) if name in made else parts[0]
        return columns

    return found


def on_matrix(poses: PoseFunction, matrix: DesignMap) -> PoseFunction:
    """Make poses of designs that ``matrix`` maps to those of other poses."""
    return lambda designs, angles, wanted: poses(matrix(designs), angles, wanted)


def optional_outputs(names: tuple[str, ...], wanted: frozenset[str], shape: tuple[int, ...]) -> list[Array | None]:
    """Return an empty array for each wanted name and None for the others, in the order of a kernel's out arguments."""
    return [np.empty(shape) if name in wanted else None for name in names]


MANY = 2**16  # poses of one call: dense samples, or the price of an output being measured
# Number of poses above which a set is compiled.  All outputs take up to 40 ns more per pose than a few, 60 ns more
# where they are complex: for this number, less than the compilation of a set.
PAID = 2**21


class Together:
    """Poses of a kernel with nested ``sets`` of outputs, of which each is compiled; ``poses`` calls it for any set."""

    def __init__(self, poses: PoseFunction, sets: Sequence[frozenset[str]]) -> None:
        update_wrapper(self, poses)
        self._poses = poses
        self._sets = sets
        self._asked: dict[tuple[frozenset[str], bool], int] = {}
        self._first: frozenset[str] | None = None  # set that was asked for with complex arguments

    def __reduce__(self) -> str:
        """Pickle by name, as functions are: each process has its own counts."""
        return self._poses.__qualname__

    def __call__(self, designs: Array, angles: Angles, wanted: frozenset[str]) -> Columns:
        """Return the wanted outputs and the status of every design at its angles, each (n, m)."""
        key = wanted, np.iscomplexobj(angles.cos) or np.iscomplexobj(designs)
        if key[1]:  # one code for complex designs, complex angles, and both
            whole: list[Any] = [np.ascontiguousarray(x, np.complex128) for x in (designs, *angles)]
            designs, angles = whole[0], Angles(*whole[1:])
        count = len(designs) * angles.cos.shape[1]
        self._asked[key] = self._asked.get(key, 0) + count
        if count >= MANY or self._asked[key] > PAID:
            return self._poses(designs, angles, wanted)
        found = self._poses(designs, angles, self._larger(*key))
        return {name: found[name] for name in (*wanted, "status")}

    def _larger(self, wanted: frozenset[str], is_complex: bool) -> frozenset[str]:
        """Return the set from which a set on few poses is taken."""
        if is_complex:
            if self._first is None:
                self._first = wanted
            return self._first if wanted <= self._first else self._sets[-1]
        return next(names for names in self._sets if wanted <= names)


def together(*outputs: Sequence[Output]) -> Callable[[PoseFunction], PoseFunction]:
    """Decorate poses of a kernel with groups of outputs; few poses give all groups up to the last wanted one."""
    sets = [frozenset(o.name for part in outputs[: k + 1] for o in part) for k in range(len(outputs))]
    return lambda poses: Together(poses, sets)


# Columns of points in a record per pose and per design (kernels/linkage/joints.py); other vectors are directions.
_POINTS_OF_POSE, _POINTS_OF_DESIGN = (0, 3), (6, 9)


def step_of(
    step: Step, matrix: DesignMap, ours: Callable[[str], str] = str, theirs: Callable[[str], str] = str
) -> Step:
    """Convert a step of another family to one for designs of this family; ``matrix`` maps these to designs of that.

    ``theirs`` gives the other family's name of an output, ``ours`` the inverse.
    """

    def run(designs: Array, wanted: frozenset[str], accuracy: Accuracy) -> Columns:
        asked = frozenset(theirs(name) for name in wanted)
        if accuracy.proven:
            accuracy = replace(accuracy, proven=tuple(map(theirs, accuracy.proven)))
        found = step.run(matrix(designs), asked, accuracy)
        return {ours(name): values for name, values in found.items()}

    provides = tuple(replace(o, name=ours(o.name), equation="") for o in step.provides)
    return replace(step, provides=provides, run=run)


def move_records(rotation: Array, origin: Array, per_pose: Array, per_design: Array) -> None:
    """Transform joint records from the frame of another family to a family's own frame, in place.

    A vector v of the other frame is ``rotation`` v in the own frame, (3, 3), and its origin is at ``origin``, (n, 3).
    Quarter turns, with one 1 or -1 per row, are exact.
    """
    for vectors, points, shift in (
        (per_pose, _POINTS_OF_POSE, origin[:, None, :]),
        (per_design, _POINTS_OF_DESIGN, origin),
    ):
        for k in range(0, 21 if vectors is per_pose else 12, 3):
            vectors[..., k : k + 3] = vectors[..., k : k + 3] @ rotation.T
        for k in points:
            vectors[..., k : k + 3] += shift


# Relative step: its error of second order and its rounding are some 1e-10 of the derivative.
DIFFERENCE = 1e-5


def differentiable(family: Family) -> Family:
    """Family with poses of complex designs and angles; the family itself where its poses already take them."""
    if family.analytic:
        return family
    return replace(family, poses=partial(_poses, family.poses), analytic=True)


def _poses(poses: PoseFunction, designs: Array, angles: Angles, wanted: frozenset[str]) -> Columns:
    if np.iscomplexobj(designs) or np.iscomplexobj(angles.phi):
        return differenced(poses, designs, angles, wanted)
    return poses(designs, angles, wanted)


def differenced(poses: PoseFunction, designs: Array, angles: Angles, wanted: frozenset[str]) -> Columns:
    """Answer a complex step of poses that are not analytic (norms, friction, a march) by a central difference.

    The difference is along the imaginary parts; its measured relative error is about 1e-9.
    """
    steps = [np.abs(x.imag) / np.maximum(np.abs(x.real), 1e-3) for x in (designs, angles.cos, angles.sin)]
    # An interval's variable may move where no cosine does; near 0 an angle is small against a turn, not against itself.
    steps.append(np.abs(angles.phi.imag) / np.maximum(np.abs(angles.phi.real), 1.0))
    # Each design has its own step: that of the smallest dimension of all would lose other designs in rounding.
    largest = [np.broadcast_to(x.max(axis=1, initial=0.0), len(designs)) for x in steps]
    t = DIFFERENCE / np.maximum(np.max(largest, axis=0), 1e-300)[:, None]

    # All three in one call: a search asks for a few poses at a time, which take less than the call.
    shape = len(designs), angles.cos.shape[1]
    moves = (0.0, t, -t)
    x = np.concatenate([designs.real + move * designs.imag for move in moves])
    if len(angles.phi) > 1 or any(map(np.iscomplexobj, angles)):  # a march takes one row, which all designs share
        angles = Angles(
            *(np.concatenate([np.broadcast_to(z.real + move * z.imag, shape) for move in moves]) for z in angles)
        )
    found = poses(x, angles, wanted)
    columns: Columns = {"status": found["status"][: shape[0]]}
    for name in wanted:
        here, ahead, behind = np.asarray(found[name], np.float64).reshape(3, *shape)
        columns[name] = here + 1j * ((ahead - behind) / (2.0 * t))
    return columns


def blocks(shape: tuple[int, ...], size: int) -> Iterator[tuple[slice, slice]]:
    """Split (designs, poses) into blocks of at most ``size`` poses, which fit the caches."""
    rows, poses = max(1, size // max(shape[1], 1)), min(max(shape[1], 1), size)
    for i in range(0, shape[0], rows):
        for j in range(0, shape[1], poses):
            yield slice(i, i + rows), slice(j, j + poses)


def equal_steps(domain: Domain, designs: Array, poses: int) -> Array:
    """Equal steps of the variable for the first design: one turn from 0, or a whole interval."""
    if isinstance(domain, Interval):
        first, last = domain.ends(designs)
        return np.linspace(float(first[0]), float(last[0]), poses, dtype=np.float64)
    return np.arange(poses, dtype=np.float64) * (TWO_PI / poses)
