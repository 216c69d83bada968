"""What else a family can be asked for besides its motion, as typed objects.

An effect, a proof, a drawing or a fit names the type of what it needs; a family that offers an object of that type is
served.  Nothing asks for a family's name.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Literal, TypeAlias

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    from sweep.families.base import Angles, Columns

Array: TypeAlias = NDArray[np.float64]
DesignMap: TypeAlias = Callable[[Array], Array]
FillFunction: TypeAlias = "Callable[[Array, Angles, Columns, Array, Array], None]"
Coordinates: TypeAlias = tuple[str | None, str | None, str | None]


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


@dataclass(frozen=True)
class JointRecords:
    """Positions, directions and their rates at the joints, from which the effects of loads work.

    ``fill(designs, angles, motion, per_pose, per_design)`` writes the records that :mod:`kernels.joints` describes,
    from the pose outputs ``needs`` in ``motion``.  ``follower`` is what the coupler drives.
    """

    fill: FillFunction
    needs: tuple[str, ...]
    follower: Literal["rocker", "slider"]


@dataclass(frozen=True)
class PressureEllipse:
    """The curve of the coupler direction across the follower's motion, (n, 7), for its extrema in closed form."""

    curve: DesignMap


@dataclass(frozen=True)
class CrankRockerLoop:
    """The loop of the family is that of a crank-rocker whose output angle is the family's.

    ``matrix(designs)`` is the design matrix of that crank-rocker, (n, 8): a b c e f g alpha branch.
    """

    matrix: DesignMap


@dataclass(frozen=True)
class GuidedPoint:
    """A coupler point that runs along a line: its position is linear in the directions of crank, coupler and rocker.

    ``shares(designs)``, (n, 6), are the factors that the proof of its maxima takes (:mod:`sweep.reductions.travel`).
    The coupler point, the line and the scale can be fitted: ``fitted`` are the parameters of point and line, ``scaled``
    the lengths that grow with the stroke, ``direction`` the parameter of the line's direction.
    """

    shares: DesignMap
    fitted: tuple[str, ...]
    scaled: tuple[str, ...]
    direction: str


@dataclass(frozen=True)
class Points:
    """Named moving points, each as the pose outputs of its x, y, z in the family's frame; None is a coordinate 0."""

    at: Mapping[str, Coordinates]


@dataclass(frozen=True)
class OutputLink:
    """The link that turns about an axis parallel to z by the family's position angle.

    ``origin(designs)``, (n, 3), is the point of the axis from which a point fixed to the link is measured: x along the
    link at angle 0, y across it, z along the axis.
    """

    origin: DesignMap


@dataclass(frozen=True)
class ThreadPath:
    """A thread that is bent at one place: the pose outputs of its wrap angle there, and of the thread taken up.

    ``rate`` and ``rate2`` are the first and second derivative of the thread taken up.
    """

    wrap: str
    rate: str
    rate2: str


@dataclass(frozen=True)
class ToolPoint:
    """A point of the coupler that a tool hangs on, such as a needle bar, which moves along a fixed direction.

    ``point(designs)``, (n, 3), is its place from B along the coupler, across it (k x s) and along the rocker's axis;
    ``direction(designs)``, (n, 3), the unit vector of the tool's way in the family's frame.
    """

    point: DesignMap
    direction: DesignMap
