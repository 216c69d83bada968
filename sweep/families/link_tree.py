"""Bodies and joints of a linkage as a tree with loops: the capability from which loads of any linkage follow."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Literal, TypeAlias

import numpy as np

from kernels.types import Array
from sweep.families.base import Angles, Columns
from sweep.families.capabilities import DesignMap

if TYPE_CHECKING:  # families without such kernels do not wait for them
    from kernels.linkage.bodies import Links


@dataclass(frozen=True)
class LinkBody:
    """A body of a :class:`LinkTree`: its name in the names of inputs, and where its axes x, y, z lie, in words.

    A ``slender`` one is a rod along x between two balls, of which the spin about x has no inertia.
    """

    name: str
    axes: str
    slender: bool = False


@dataclass(frozen=True)
class LinkJoint:
    """A joint of a :class:`LinkTree` whose reaction is given.

    Parameters
    ----------
    name, text : in the names of outputs; what it is
    kind : "shaft" turns about an axis on two supports, "sleeve" slides along it too; "hinge" is a ball by which a body
        hangs on its parent, "ball" one that closes a loop; "contact" slides
    acts : which body's force on which it is, in words
    body, freedom : of a shaft, a sleeve, a hinge the body; the number of the freedom whose axis is its own
    lines : of a ball, a contact the first of the lines that make it, and how many
    touch : where its surfaces press without fitting: a ball or a pin in a straight slot, a strap on an eccentric
    """

    name: str
    text: str
    kind: Literal["shaft", "hinge", "sleeve", "ball", "contact"]
    acts: str
    body: int = -1
    freedom: int = -1
    lines: tuple[int, int] = (-1, 0)
    touch: Literal["", "ball", "line", "strap"] = ""


LinkFill: TypeAlias = "Callable[[Array, Angles, Columns, Links], None]"


@dataclass(frozen=True)
class LinkTree:
    """Bodies of any number with the joints between them, from which loads are computed: :mod:`kernels.linkage.bodies`.

    Parameters
    ----------
    bodies, joints : in the order of their numbers
    parents, freedoms, ends : the tree as :class:`kernels.linkage.bodies.Links` takes it, of an ordinary design
    needs : pose outputs that ``fill(designs, angles, motion, links)`` writes the poses of the bodies from
    carrier : number of the body that a tool hangs on
    tip : place of the tool in the axes of that body, (n, 3); None where it is an input
    output : number of the freedom that is the family's position, on which a load acts; -1 where no load does
    rubs : whether its joints have dimensions for friction and bearings
    """

    bodies: tuple[LinkBody, ...]
    joints: tuple[LinkJoint, ...]
    parents: tuple[int, ...]
    freedoms: tuple[tuple[int, int], ...]
    ends: tuple[tuple[int, int], ...]
    needs: tuple[str, ...]
    fill: LinkFill
    carrier: int
    tip: DesignMap | None = None
    output: int = -1
    rubs: bool = True


def filled_by(kernel: Callable[..., object], needs: tuple[str, ...], stacked: tuple[str, ...] = ()) -> LinkFill:
    """Fill by a kernel that takes pose outputs one by one, then those ``stacked`` in one array, if any."""

    def fill(designs: Array, angles: Angles, motion: Columns, out: Links) -> None:
        given = [np.asarray(motion[name], np.float64) for name in needs]
        if stacked:
            given.append(np.stack([np.asarray(motion[name], np.float64) for name in stacked]))
        kernel(designs, angles.cos, angles.sin, *given, out)

    return fill
