"""Capabilities: typed objects that a family offers besides its motion.

An effect, a proof, a drawing or a fit names the type that it needs, and works for every family with an object of that
type.  No code asks for a family's name.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, Literal, TypeAlias

import numpy as np
from numpy.typing import NDArray

from kernels.types import Array, Numbers
from sweep.families.base import Angles, Columns, Family, Output, PoseFunction

if TYPE_CHECKING:  # families without fused kernels do not wait for the import
    from kernels.chains.form import Form

DesignMap: TypeAlias = Callable[[Array], Array]


@dataclass(frozen=True)
class Assembly:
    """A loop of links that may fail to assemble, or lock: the basis of rotatability, margin and pressure angle.

    ``discriminant`` is the pose output that is negative where the links do not reach; it is a smooth function of the
    crank angle whatever its sign.  Divided by ``scale(designs)``, (n,), it is the squared cosine of the pose output
    ``pressure_angle`` wherever the links reach.  In a chain ``stage`` is the number of the stage.  A motion may also
    end where the discriminant is not zero: ``end`` has a pose output that is extreme there, and a mask (n,) of the
    designs where that can happen.
    """

    discriminant: str
    pressure_angle: str
    scale: DesignMap
    stage: str = ""
    end: tuple[str, DesignMap] | None = None


def constant(*numbers: float) -> DesignMap:
    """Make a function that returns the same numbers for every design, (n, k)."""
    return lambda designs: np.tile(np.array(numbers), (len(designs), 1))


@dataclass(frozen=True)
class JointRecords:
    """Positions, directions and their rates at the joints, the input of the load effects.

    ``fill(designs, angles, motion, per_pose, per_design)`` writes the records that :mod:`kernels.linkage.joints`
    describes, from the pose outputs ``needs`` in ``motion``, in the frame of the family.  ``follower`` is the link that
    the coupler drives.  ``moved`` computes these outputs if the family does not have them: plain poses and precise
    ones.
    """

    fill: Callable[[Array, Angles, Columns, Array, Array], None]
    needs: tuple[str, ...]
    follower: Literal["rocker", "slider"]
    moved: tuple[PoseFunction, PoseFunction] | None = None


@dataclass(frozen=True)
class Rates:
    """Derivatives of effects by the crank angle: ``of`` maps a quantity, not always an output, to its derivative."""

    of: Mapping[str, str]


@dataclass(frozen=True)
class PressureEllipse:
    """Curve of the coupler direction across the follower's motion, (n, 7), for its extrema in closed form."""

    curve: DesignMap


@dataclass(frozen=True)
class FusedOutput:
    """A pose output of a fused chain: a derivative of a x + b y + c of the motion of its last stage.

    ``order`` is that of the derivative by the crank angle, 0, 1 or 2; ``made_of(designs)``, (n, 3), returns a, b, c
    from the stage's own designs.
    """

    order: int
    made_of: DesignMap


@dataclass(frozen=True)
class InSeries:
    """A stage whose motion can be fused with that of the previous and next stages (:mod:`kernels.chains`).

    Parameters
    ----------
    form : its inline closures
    curves : the pose outputs whose extrema a fused search finds if it is the last stage
    components : for pose outputs that a grid computes at once, the component: "x1", "x2", "x3", "y0", "y1", "y2"
    opening : of a family that can be the first stage, ``opening(designs, status, distance)`` writes whether it turns,
        and the distance of its nearest singularity
    matrix : for a family that moves like another one, maps its designs to those of the other; it is fused only alone
    """

    form: Form
    curves: Mapping[str, FusedOutput]
    components: Mapping[str, str]
    opening: Callable[[Array, NDArray[np.uint8], Array], None] | None = None
    matrix: DesignMap | None = None


@dataclass(frozen=True)
class CrankRockerLoop:
    """The loop of the family is that of a crank-rocker with the same output angle.

    ``matrix(designs)`` is the design matrix of that crank-rocker, (n, 8): a b c e f g alpha branch.
    """

    matrix: DesignMap


@dataclass(frozen=True)
class GuidedPoint:
    """A coupler point along a line, whose position is linear in the directions of crank, coupler and rocker.

    ``shares(designs)``, (n, 8), are the factors for the proof of its maxima (:mod:`sweep.reductions.extrema`). The
    coupler point, the line and the scale can be fitted: ``fitted`` are the parameters of the point along and across the
    coupler, of the line's direction and of its distance from the origin, ``scaled`` the lengths that grow with the
    stroke, ``direction`` the third of the fitted ones.  ``links`` are the crank, the coupler and the other lengths of
    the linkage, ``arms`` the point along and across the coupler, ``offset`` that of the line.  ``across`` maps each
    pose output along the line to the one across it.
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
    """Prescribed limit positions of the follower; the links that have them lie on a locus.

    The loci of a family are those of :data:`sweep.synthesis.locus.LOCI`.  ``travel`` is the design output for the
    distance between both limit positions.  ``sized`` are the length of the follower and the offsets of its axis, along
    the common perpendicular and along the axis, if the length can be given instead of the offsets; otherwise empty.
    """

    travel: str
    sized: tuple[str, ...] = ()


@dataclass(frozen=True)
class ProvableLocus:
    """Proofs of an output's bounds for whole boxes of designs on the locus of limit positions.

    ``coordinates`` span a box, the swing first; ``links`` are the resulting lengths, which may have limits.
    ``objectives`` maps the outputs that can be proven to their numbers in the kernels; ``rows`` describes each kind of
    row.  ``explore(question, search, leaves)`` fills arrays (low, high, outcome, bound, kinds, theta, factors) with the
    boxes that were not halved, and returns their number and that of the boxes judged.  Lengths are in one unit, angles
    in rad.

    ``question`` : branch; number of the objective; least squared cosine of the pressure angle; minimum and maximum of
    all links; target of the objective; the tube, crank angles with the least and greatest angle of a follower that
    reaches the target (:mod:`kernels.boxes.tube`), empty if none is known.  ``search`` : lower and upper ends and known
    bounds of the first boxes; widths of the whole space; numbers of the free coordinates, and all coordinates as given;
    share of the whole space below which a box is not halved; largest number of boxes to judge.
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
        """Compute x, y, z, (n, m) each, of a point of the link, given by three numbers or columns (n, 1)."""
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
    """A point of the coupler that carries a tool, such as a needle bar, which may move along a fixed direction.

    ``point(designs)``, (n, 3), is its place from B along the coupler, across it (k x s) and along the rocker's axis;
    ``direction(designs)``, (n, 3), the unit vector of the tool's motion in the family's frame, None if the tool moves
    freely with the point.
    """

    point: DesignMap
    direction: DesignMap | None = None


@dataclass(frozen=True)
class PresserFoot:
    """A presser foot that a rack lifts, with the march over its turns that computes its motion.

    ``march(designs, nodes)`` returns the columns of ``outputs``, ``status`` and the ``changes`` of
    :func:`kernels.effects.foot_fabric.march`; the path of the rack, and heights and forces of the foot, at ``nodes``
    equal crank angles (the attribute ``nodes`` is the default number).  On a feed mechanism ``march`` also takes a
    sense: for a crank that turns backwards it is -1, and angles are counted in the direction of rotation.
    """

    march: Callable[..., tuple[Columns, Array, Array, Array]]
    nodes: int
    outputs: tuple[Output, ...]


@dataclass(frozen=True)
class Fixed:
    """A point of the frame, and the direction of the axis or the line through it.

    Parameters
    ----------
    at : its place, (n, 3), in the family's frame
    axis : unit vector (n, 3) about which its link turns right-handed, or along which its slider moves; None for a point
        about which a link turns in any direction
    kind : "axis" of a link that turns, "slide" of one that moves along a line, "point" otherwise
    foot : of a crank axis, the origin of lengths along it, (n, 3); None is ``at``
    zero : of a crank axis, unit vector (n, 3) to the crank pin at phi = 0; None is x
    """

    at: DesignMap
    axis: DesignMap | None = None
    kind: Literal["axis", "slide", "point"] = "axis"
    foot: DesignMap | None = None
    zero: DesignMap | None = None


@dataclass(frozen=True)
class Link:
    """A link of the mechanism with the joints it connects; the first is the pivot of a link that turns about one."""

    name: str
    joints: tuple[str, ...]


@dataclass(frozen=True)
class MovingPoint:
    """A moving point that is no pose output: ``at(designs, angles, motion)``, (n, m, 3), from the outputs ``needs``."""

    needs: tuple[str, ...]
    at: Callable[[Array, Angles, Columns], Array]


@dataclass(frozen=True)
class Skeleton:
    """Fixed points of the family's frame, further moving points, and the joints that each link connects.

    Moving joints are the family's points and those of ``moving``.  Drawings and exports are generated from it.
    """

    fixed: Mapping[str, Fixed]
    links: tuple[Link, ...]
    moving: Mapping[str, MovingPoint] = field(default_factory=dict)


def skeleton_of(family: Family) -> Skeleton:
    """Skeleton of a family; an empty one for a chain, a machine, or a mechanism without joints."""
    return family.find(Skeleton) or Skeleton({}, ())


@dataclass(frozen=True)
class Arm:
    """A point that a link carries: its coordinates and those of the link's other joint, both from its first joint.

    Both are names of one to three parameters, along perpendicular directions fixed to the link; their first directions
    are the same.
    """

    point: tuple[str, ...]
    link: tuple[str, ...]


@dataclass(frozen=True)
class Dimensions:
    """Parameters that are dimensions of the moving links, for limits of manufacture.

    Parameters
    ----------
    links : for every link the parameters of the vector between its two joints: its length, or the coordinates of one
        joint from the other
    optional : lengths of links that a design may lack; 0 means that the link is absent
    arms : points that links carry beyond their joints
    """

    links: tuple[tuple[str, ...], ...]
    optional: tuple[str, ...] = ()
    arms: tuple[Arm, ...] = ()

    @property
    def names(self) -> tuple[str, ...]:
        """Names of all these parameters."""
        vectors = (*self.links, self.optional, *(side for arm in self.arms for side in (arm.point, arm.link)))
        return tuple(dict.fromkeys(name for vector in vectors for name in vector))


@dataclass(frozen=True)
class Hardpoints:
    """Fit of the family's dimensions to points of a drawing.

    ``needs`` and ``may`` are the names of points and directions that must or may be given.  ``fit(points)`` returns
    parameters, the crank angle [rad], and origin, z and x of the family's frame in that of the drawing; it raises
    :class:`sweep.errors.InputError` for points that no such mechanism has.
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
