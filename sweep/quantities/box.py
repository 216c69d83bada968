"""Bounding box of a mechanism: extent of its joints, moving and fixed, along x, y and z over one turn."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np

from sweep.families.base import Coordinates, Family, March, Output, Stage, of_family
from sweep.families.capabilities import Fixed, skeleton_of
from sweep.families.machines.machine import Machine
from sweep.families.parts import Member
from sweep.families.sites import AXES, TIP
from sweep.quantities.dimensions import DesignFunction, of_columns

NAMES = tuple(f"box_{axis}" for axis in AXES)
ROUNDING = 2.0**-53


@dataclass(frozen=True)
class Box:
    """The extent of a mechanism along one axis: the largest minus the smallest coordinate of all its joints.

    Parameters
    ----------
    output : name, unit, definition
    curves : pose outputs that are this coordinate of the moving joints
    reductions : names of the largest and the smallest value of each curve
    still : this coordinate of what stands still, from designs
    """

    output: Output
    curves: tuple[str, ...]
    reductions: tuple[tuple[str, str], ...]
    still: tuple[DesignFunction, ...]

    @property
    def asked(self) -> tuple[str, ...]:
        """Names of the design outputs, largest and smallest coordinates, that the extent is computed from."""
        return tuple(name for pair in self.reductions for name in pair)


@of_family
def boxes(family: Family) -> dict[str, Box]:
    """Boxes of a family by name: of every stage of a chain; of a machine as a whole and of each member.

    The box of a stage is given in the stage's own frame; of a machine's chain only the last stage counts.
    """
    if isinstance(family.domain, March):
        return {}
    if isinstance(family, Machine):
        whole = [box for k in range(3) if (box := _whole(family, k)) is not None]
        members = [_of_member(m, box) for m in family.members for box in boxes(m.family).values()]
        return {box.output.name: box for box in (*whole, *members)}
    found = [_own(stage, k) for stage in family.stages for k in range(3)]
    return {box.output.name: box for box in found if box is not None}


def _own(of: Stage, axis: int) -> Box | None:
    """Box of a stage along one axis, in the stage's own frame."""
    family, stage = of.family, of.tail
    at = {name: points[axis] for name, points in _moving(family).items()}
    curves = tuple(dict.fromkeys(f"{name}{stage}" for name in at.values() if name is not None))
    if not curves:
        return None
    still: list[DesignFunction] = [partial(_coordinate, fixed, axis, of.columns) for fixed in _standing(family)]
    if None in at.values():
        still.append(lambda designs: 0.0 * designs[:, 0])
    where = f"stage {stage}: " if stage else ""
    text = f"{where}extent along {AXES[axis]} of all joints over one turn, fixed ones too, in the frame of the {{}}"
    text = text.format("stage" if stage else "mechanism")
    name = f"box_{AXES[axis]}{stage}"
    pairs = tuple((f"max_{curve}", f"min_{curve}") for curve in curves)
    return Box(Output(name, "length", text), curves, pairs, tuple(still))


def _of_member(m: Member, found: Box) -> Box:
    """Rename a member's box and its columns for the machine."""
    output = Output(f"{m.name}.{found.output.name}", "length", f"{m.name}: {found.output.text}")
    pairs = tuple((f"{m.name}.{most}", f"{m.name}.{least}") for most, least in found.reductions)
    still = tuple(partial(of_columns, piece, m.columns) for piece in found.still)
    return Box(output, tuple(f"{m.name}.{curve}" for curve in found.curves), pairs, still)


def _whole(machine: Machine, axis: int) -> Box | None:
    """Box of all members along one axis in the machine's frame; a chain is represented by its last stage."""
    curves, pairs, still = [], [], list[DesignFunction]()
    for m in machine.members:
        last = m.family.stages[-1]
        joints = (*_moving(last.family), *((TIP,) if m.tip is not None else ()))
        if not _moving(last.family):
            return None
        for point in joints:
            curves.append(f"{m.name}.{point}_{AXES[axis]}")
            pairs.append((f"{m.name}.max_{point}_{AXES[axis]}", f"{m.name}.min_{point}_{AXES[axis]}"))
        own = slice(m.columns.start + last.columns.start, m.columns.start + last.columns.stop)
        still += [partial(_placed, m, fixed, axis, own) for fixed in _standing(last.family)]
    text = (
        f"extent along {AXES[axis]} of the joints of all members over one turn of the shaft, fixed ones too, in the "
        "machine's frame; of a chain those of its last stage"
    )
    return Box(Output(f"box_{AXES[axis]}", "length", text), tuple(curves), tuple(pairs), tuple(still))


def _moving(family: Family) -> Mapping[str, Coordinates]:
    """Coordinate names of all moving joints; empty where the place of any joint is not a pose output."""
    at, skeleton = family.points, skeleton_of(family)
    joints = [joint for link in skeleton.links for joint in link.joints if joint not in skeleton.fixed]
    return {joint: at[joint] for joint in joints} if set(joints) <= at.keys() else {}


def _standing(family: Family) -> Iterator[Fixed]:
    """Yield the fixed bearings and points of the frame; slide axes are left out."""
    yield from (fixed for fixed in skeleton_of(family).fixed.values() if fixed.kind != "slide")


def _coordinate(fixed: Fixed, axis: int, columns: slice, designs: Any) -> Any:
    return fixed.at(designs[:, columns])[:, axis]


def _placed(m: Member, fixed: Fixed, axis: int, columns: slice, designs: Any) -> Any:
    """Coordinate of a fixed point of a member in the machine's frame, (n,) [length]."""
    at = np.asarray(fixed.at(designs[:, columns]))
    return m.frame(designs).placed([at[:, [k]] for k in range(3)])[axis][:, 0]
