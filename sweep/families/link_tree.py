"""Bodies and joints of a linkage as a tree with loops: the capability from which loads of any linkage follow."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Literal, TypeAlias

from sweep.families.capabilities import Array, DesignMap

if TYPE_CHECKING:
    from kernels.links import Links
    from sweep.families.base import Angles, Columns


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
    """

    name: str
    text: str
    kind: Literal["shaft", "hinge", "sleeve", "ball", "contact"]
    acts: str
    body: int = -1
    freedom: int = -1
    lines: tuple[int, int] = (-1, 0)


LinkFill: TypeAlias = "Callable[[Array, Angles, Columns, Links], None]"


@dataclass(frozen=True)
class LinkTree:
    """Bodies of any number with the joints between them, from which loads are computed: :mod:`kernels.links`.

    Parameters
    ----------
    bodies, joints : in the order of their numbers
    parents, freedoms, ends : the tree as :class:`kernels.links.Links` takes it, of an ordinary design
    needs : pose outputs that ``fill(designs, angles, motion, links)`` writes the poses of the bodies from
    carrier : number of the body that a tool hangs on
    tip : place of the tool in the axes of that body, (n, 3); None where it is an input
    output : number of the freedom that is the family's position, on which a load acts; -1 where no load does
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
