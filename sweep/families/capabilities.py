"""Capabilities: what a family offers besides its motion, as typed objects.

An effect, a proof, a drawing or a fit names the type of what it needs; a family that offers an object of that type is
served.  Nothing asks for a family's name.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, Literal, TypeAlias

import numpy as np
from numpy.typing import NDArray

from kernels.types import Array, Numbers
from sweep.families.base import Angles, Columns, Family, Output, PoseFunction

if TYPE_CHECKING:  # families without such kernels do not wait for them
    from kernels.chains.form import Form

DesignMap: TypeAlias = Callable[[Array], Array]
FillFunction: TypeAlias = Callable[[Array, Angles, Columns, Array, Array], None]


@dataclass(frozen=True)
class Assembly:
    """A loop of links that may fail to reach, or lock: what rotatability, margin and pressure angle are made of.

    ``discriminant`` is the pose output that is negative where the links do not reach; it is a smooth function of the
    crank angle whatever its sign.  ``scale(designs)``, (n,), divides it so that the quotient is the squared cosine of
    the pose output ``pressure_angle`` wherever the links reach.  In a chain ``stage`` is the number of the stage.
    """

    discriminant: str
    pressure_angle: str
    scale: DesignMap
    stage: str = ""


def constant(*numbers: float) -> DesignMap:
    """Return the same numbers for every design, (n, k)."""
    return lambda designs: np.tile(np.array(numbers), (len(designs), 1))


@dataclass(frozen=True)
class JointRecords:
    """Positions, directions and their rates at the joints, from which the effects of loads work.

    ``fill(designs, angles, motion, per_pose, per_design)`` writes the records that :mod:`kernels.linkage.joints`
    describes, from the pose outputs ``needs`` in ``motion``, in the frame of the family.  ``follower`` is what the
    coupler drives.  ``moved`` gives these outputs where the family has them not: plain poses and precise ones.
    """

    fill: FillFunction
    needs: tuple[str, ...]
    follower: Literal["rocker", "slider"]
    moved: tuple[PoseFunction, PoseFunction] | None = None


@dataclass(frozen=True)
class PressureEllipse:
    """The curve of the coupler direction across the follower's motion, (n, 7), for its extrema in closed form."""

    curve: DesignMap


@dataclass(frozen=True)
class Curve:
    """A pose output as a fused chain has it: a derivative of a x + b y + c of what its last stage moves.

    ``order`` is that of the derivative by the crank angle, 0, 1 or 2; ``made_of(designs)``, (n, 3), gives a, b, c of
    the stage's own designs.
    """

    order: int
    made_of: DesignMap


@dataclass(frozen=True)
class InSeries:
    """A stage whose motion can be fused with that of the stages before and behind it (:mod:`kernels.chains`).

    Parameters
    ----------
    form : its inline closures
    curves : the pose outputs whose extrema a fused search finds where it is the last stage
    components : of those pose outputs that a grid has at once, the component: "x1", "x2", "x3", "y0", "y1", "y2"
    opening : of a family that can be the first stage, ``opening(designs, status, distance)``: does it turn, and how
        far is its nearest singularity
    matrix : of a family that moves as another one, the designs of that; then it is fused by itself alone
    """

    form: Form
    curves: Mapping[str, Curve]
    components: Mapping[str, str]
    opening: Callable[[Array, NDArray[np.uint8], Array], None] | None = None
    matrix: DesignMap | None = None


@dataclass(frozen=True)
class CrankRockerLoop:
    """The loop of the family is that of a crank-rocker whose output angle is the family's.

    ``matrix(designs)`` is the design matrix of that crank-rocker, (n, 8): a b c e f g alpha branch.
    """

    matrix: DesignMap


@dataclass(frozen=True)
class GuidedPoint:
    """A coupler point that runs along a line: its position is linear in the directions of crank, coupler and rocker.

    ``shares(designs)``, (n, 8), are the factors that the proof of its maxima takes (:mod:`sweep.reductions.extrema`).
    The coupler point, the line and the scale can be fitted: ``fitted`` are the parameters of the point along and across
    the coupler, of the line's direction and of its distance from the origin, ``scaled`` the lengths that grow with the
    stroke, ``direction`` the third of the fitted ones.  ``links`` are the crank, the coupler and the other lengths of
    the linkage, ``arms`` the point along and across the coupler, ``offset`` that of the line.  ``across`` names the
    pose output across the line beside each one along it.
    """

    shares: DesignMap
    fitted: tuple[str, ...]
    scaled: tuple[str, ...]
    direction: str
    links: tuple[str, ...]
    arms: tuple[str, str]
    offset: str
    across: Mapping[str, str]


@dataclass(frozen=True)
class LimitLocus:
    """The limit positions of the follower can be prescribed; the links that keep them lie on a locus.

    The loci of a family are those of :data:`sweep.synthesis.locus.LOCI`.  ``travel`` is the design output for the way
    between both limit positions.  ``sized`` are the length of the follower and the offsets of its axis, along the
    common perpendicular and along the axis, where the length can be given instead of the offsets; empty where it
    cannot.
    """

    travel: str
    sized: tuple[str, ...] = ()


@dataclass(frozen=True)
class ProvableLocus:
    """Bounds of an output can be proven for whole boxes of designs on the locus of limit positions.

    ``coordinates`` are what a box is made of, the swing first; ``links`` the lengths that follow and may have limits.
    ``objectives`` has the outputs that can be proven, with the numbers by which the kernels know them; ``rows`` says
    for each kind of row what it is about.  ``explore(question, search, leaves)`` fills arrays (low, high, outcome,
    bound, kinds, theta, factors) with the boxes that were not halved; it gives their number and that of the boxes
    judged.  Lengths are in one unit, angles in rad.

    ``question`` : the branch; the number of the objective; the least squared cosine of the pressure angle; least and
    most of all links; the target of the objective; the tube, crank angles with the least and most angle of a follower
    that reaches it (:mod:`kernels.boxes.tube`), empty where none is known.  ``search`` : low and high ends and known
    bounds of the boxes it starts from; widths of the whole space; numbers of the free coordinates, and all of them as
    given; the share of the whole below which a box is not halved; the most boxes to judge.
    """

    coordinates: tuple[str, ...]
    links: tuple[str, ...]
    objectives: Mapping[str, int]
    rows: tuple[str, ...]
    explore: Callable[[tuple[Any, ...], tuple[Any, ...], tuple[Numbers, ...]], tuple[int, int]]


@dataclass(frozen=True)
class OutputLink:
    """The link that turns about an axis parallel to z by the family's position angle.

    ``origin(designs)``, (n, 3), is the point of the axis with z = 0, from which a point fixed to the link is measured:
    x along the link at angle 0, y across it, z along the axis.
    """

    origin: DesignMap

    def carried(self, designs: Array, angle: Array, point: Iterable[Any]) -> list[Array]:
        """Return x, y, z, (n, m) each, of a point of the link, given by three numbers or columns (n, 1)."""
        x, y, z = point
        cos, sin, origin = np.cos(angle), np.sin(angle), self.origin(designs)
        return [origin[:, [0]] + x * cos - y * sin, origin[:, [1]] + x * sin + y * cos, origin[:, [2]] + z + 0.0 * cos]


@dataclass(frozen=True)
class ThreadPath:
    """A thread that is bent at one place: the pose outputs of its wrap angle there, and of the thread taken up.

    ``rate`` and ``rate2`` are the first and second derivative of the thread taken up.
    """

    wrap: str
    rate: str
    rate2: str
    taken: str = "P"


@dataclass(frozen=True)
class ToolPoint:
    """A point of the coupler that a tool hangs on, such as a needle bar, which may move along a fixed direction.

    ``point(designs)``, (n, 3), is its place from B along the coupler, across it (k x s) and along the rocker's axis;
    ``direction(designs)``, (n, 3), the unit vector of the tool's way in the family's frame, None where the tool moves
    freely with the point.
    """

    point: DesignMap
    direction: DesignMap | None = None


@dataclass(frozen=True)
class PresserFoot:
    """A presser foot that a rack lifts: the march over its turns that tells what it does.

    ``march(designs, nodes)`` returns the columns of ``outputs``, ``status`` and the ``changes`` of
    :func:`kernels.effects.foot_fabric.march`; the path of the rack, heights and forces of the foot at so many equal
    crank angles, ``nodes`` where nobody asks for others.  On a feed mechanism it takes a sense besides: a crank that
    turns backwards has the sense -1, and its angles are counted as it turns.
    """

    march: Callable[..., tuple[Columns, Array, Array, Array]]
    nodes: int
    outputs: tuple[Output, ...]


@dataclass(frozen=True)
class Fixed:
    """A point of the frame, and the direction of the axis or the line through it.

    Parameters
    ----------
    at : where it stands, (n, 3), in the family's frame
    axis : unit vector (n, 3) about which its link turns right-handed, or along which its slider moves; None for a point
        about which a link may turn anyhow
    kind : "axis" of a link that turns, "slide" of one that moves along a line, "point" for neither
    foot : of a crank axis, the point from which lengths along it count, (n, 3); None is ``at``
    zero : of a crank axis, unit vector (n, 3) to the crank pin at phi = 0; None is x
    """

    at: DesignMap
    axis: DesignMap | None = None
    kind: Literal["axis", "slide", "point"] = "axis"
    foot: DesignMap | None = None
    zero: DesignMap | None = None


@dataclass(frozen=True)
class Link:
    """A part of the mechanism, by the joints it connects; the first is the pivot of a link that turns about one."""

    name: str
    joints: tuple[str, ...]


@dataclass(frozen=True)
class Made:
    """A moving point that is no pose output: ``at(designs, angles, motion)``, (n, m, 3), from the outputs ``needs``."""

    needs: tuple[str, ...]
    at: Callable[[Array, Angles, Columns], Array]


@dataclass(frozen=True)
class Skeleton:
    """What stands still in the family's frame, what else moves, and which joints each link connects.

    Moving joints are the family's points and those of ``made``.  Drawings and exports are made from it.
    """

    fixed: Mapping[str, Fixed]
    links: tuple[Link, ...]
    made: Mapping[str, Made] = field(default_factory=dict)


def skeleton_of(family: Family) -> Skeleton:
    """Skeleton of a family; an empty one of a chain, a machine, or a mechanism without joints."""
    return family.find(Skeleton) or Skeleton({}, ())


@dataclass(frozen=True)
class Arm:
    """A point that a link carries: its coordinates and those of the link's other joint, both from its first joint.

    Each is the names of one to three parameters, along perpendicular directions fixed to the link; the first of both
    is the same direction.
    """

    point: tuple[str, ...]
    link: tuple[str, ...]


@dataclass(frozen=True)
class Dimensions:
    """Parameters that are dimensions of the moving links, on which limits of manufacture bear.

    Parameters
    ----------
    links : of every link the parameters of the vector between its two joints: its length, or the coordinates of one
        joint from the other
    optional : lengths of links that a design may lack; 0 stands for a link that is not there
    arms : points that links carry beyond their joints
    """

    links: tuple[tuple[str, ...], ...]
    optional: tuple[str, ...] = ()
    arms: tuple[Arm, ...] = ()

    @property
    def names(self) -> tuple[str, ...]:
        """All these parameters."""
        vectors = (*self.links, self.optional, *(side for arm in self.arms for side in (arm.point, arm.link)))
        return tuple(dict.fromkeys(name for vector in vectors for name in vector))


@dataclass(frozen=True)
class Hardpoints:
    """The family's dimensions can be read off points of a drawing.

    ``needs`` and ``may`` are the names of points and directions that must or may be given.  ``fit(points)``
    returns parameters, the crank angle [rad], and origin, z and x of the family's frame in that of the drawing; it
    raises :class:`sweep.errors.InputError` for points that make no such mechanism.
    """

    needs: tuple[str, ...]
    may: tuple[str, ...]
    fit: Callable[[Mapping[str, Array]], FittedPose]


@dataclass(frozen=True)
class FittedPose:
    """Parameters, crank angle [rad], and origin, z and x of the family's frame in the drawing's."""

    parameters: dict[str, float]
    phi: float
    at: Array
    z: Array
    x: Array
