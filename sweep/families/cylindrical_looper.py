"""Registry entry of the looper on a cylinder."""

from __future__ import annotations

from itertools import chain

import numpy as np

from kernels.families import cylindrical_looper
from kernels.families.cylindrical_looper.motion import links as fill_links
from kernels.linkage.bodies import DRIVEN, FRAME, SLIDE, TURN
from kernels.types import Array
from sweep.families.base import Angles, Columns, Family, Output, about, parameters_of
from sweep.families.capabilities import Assembly, Dimensions, Link, MovingPoint, Skeleton
from sweep.families.link_tree import LinkBody, LinkJoint, LinkTree
from sweep.families.outputs import coordinate_outputs, joint_outputs, ladders, magnitude_outputs, point_outputs
from sweep.families.poses import filled_by, poses_of
from sweep.families.skeletons import crank_axis, links, parameter, squared, standing

PARAMETERS = parameters_of("cylindrical_looper")

_D2 = [p.name for p in PARAMETERS].index("d2")

SHAFT_OUTPUTS = coordinate_outputs("psi", "rad", "angle of the shaft", "(3)", "(3)")
SLIDE_OUTPUTS = coordinate_outputs("s", "length", "place of the shaft along its axis", "(1)", "(1)", of_name=True)
SHAFT_LOOP_OUTPUTS = (
    Output("discriminant1", "length^2", "b1^2 cos^2(pressure_angle1); negative where the links do not reach", "(3)"),
    Output("pressure_angle1", "rad", "between the force of coupler 1 and the turning velocity of the rocker's ball",
           "(3)"),
)  # fmt: skip
SLIDE_LOOP_OUTPUTS = (
    Output("discriminant2", "length^2", "b2^2 cos^2(pressure_angle2); negative where the links do not reach", "(1)"),
    Output("pressure_angle2", "rad", "between the force of coupler 2 and the shaft's direction", "(1)"),
)
POINT_OUTPUTS = point_outputs("(4)")
MAGNITUDE_OUTPUTS = magnitude_outputs("(5)")
JOINT_OUTPUTS = joint_outputs({"b1": "pin of crank 1", "c1": "rocker's ball"}, "(2)")

_BLOCKS = (
    SHAFT_OUTPUTS, SHAFT_LOOP_OUTPUTS, SLIDE_OUTPUTS, SLIDE_LOOP_OUTPUTS,
    *POINT_OUTPUTS, MAGNITUDE_OUTPUTS, JOINT_OUTPUTS,
)  # fmt: skip
_BY_FIELD = dict(zip(cylindrical_looper.Outputs._fields, _BLOCKS, strict=True))
_on_axis = poses_of(cylindrical_looper.poses, cylindrical_looper.Outputs, _BY_FIELD)
_beside = poses_of(cylindrical_looper.coupled_poses, cylindrical_looper.Outputs, _BY_FIELD)


def poses(designs: Array, angles: Angles, wanted: frozenset[str]) -> Columns:
    """Compute the wanted pose outputs and status of every design at its crank angles, each (n, m)."""
    # invalid values count even if the place of the ball does not
    beside = (designs[:, _D2] != 0.0) | ~np.isfinite(designs[:, _D2:]).all(axis=1)
    if beside.any() and not beside.all():
        return _of_both(designs, angles, wanted, beside)
    return (_beside if beside.any() else _on_axis)(designs, angles, wanted)


def _of_both(designs: Array, angles: Angles, wanted: frozenset[str], beside: np.ndarray) -> Columns:
    """Compute poses of designs some of which have the second ball beside the axis."""
    found: Columns = {}
    for rows in (beside, ~beside):
        for name, values in poses(np.ascontiguousarray(designs[rows]), angles.part(rows), wanted).items():
            if name not in found:
                found[name] = np.empty((len(designs), values.shape[1]), values.dtype)
            found[name][rows] = values
    return found


def foot(height: str) -> MovingPoint:
    """Make the point of the shaft at the height of a pose output: of the rocker's ball, or of the working point."""

    def at(designs: Array, angles: Angles, motion: Columns) -> Array:
        z = np.asarray(motion[height], np.float64)
        return np.stack([parameter(PARAMETERS, "e1", designs)[:, None] + 0.0 * z, 0.0 * z, z], axis=-1)

    return MovingPoint((height,), at)


_ON_AXIS = "from the axis at the height of the rocker's ball"
_RATES = ("psi", "dpsi", "d2psi", "s", "ds", "d2s")
LINKS = LinkTree(
    bodies=(
        LinkBody("crank1", "along crank 1, tangential, along its axis, from its centre", free=(DRIVEN,)),
        LinkBody("crank2", "along crank 2, tangential, along its axis, from its centre", free=(DRIVEN,)),
        LinkBody("shaft", f"along the rocker, tangential, along the shaft, {_ON_AXIS} at s = 0, moving with it",
                 free=(TURN, SLIDE)),
        LinkBody("rocker", f"along the rocker, tangential, along the shaft, {_ON_AXIS}", 2, (SLIDE,)),
        LinkBody("coupler1", "along coupler 1, from crank 1", 0, (TURN, TURN), slender=True),
        LinkBody("coupler2", "along coupler 2, from crank 2", 1, (TURN, TURN), slender=True),
    ),
    joints=(
        LinkJoint("a1", "bearing of crank 1", "shaft", "frame on crank 1", body=0),
        LinkJoint("b1", "ball of crank 1", "hinge", "crank 1 on coupler 1", body=4),
        LinkJoint("c1", "rocker's ball", "ball", "coupler 1 on the rocker", lines=(0, 3)),
        LinkJoint("key", "key of the rocker on the shaft", "sleeve", "shaft on the rocker", body=3),
        LinkJoint("hold", "hold of the rocker along the shaft", "contact", "frame, or shaft, on the rocker",
                  lines=(6, 1)),
        LinkJoint("d", "guide of the shaft", "sleeve", "frame on the shaft", body=2),
        LinkJoint("a2", "bearing of crank 2", "shaft", "frame on crank 2", body=1),
        LinkJoint("b2", "ball of crank 2", "hinge", "crank 2 on coupler 2", body=5),
        LinkJoint("c2", "ball of the sliding drive", "ball", "coupler 2 on the shaft", lines=(3, 3)),
    ),
    ends=((3, 4),) * 3 + ((2, 5),) * 3 + ((3, FRAME),),
    needs=_RATES,
    fill=filled_by(fill_links, _RATES),
    carrier=2,
    tip=standing(PARAMETERS, "p0x", "p0y", "p0z").at,
    arms=((3, 0),),
)  # fmt: skip

FAMILY = Family(
    **about("cylindrical_looper"),
    parameters=PARAMETERS,
    position="psi",
    pose_outputs=tuple(chain.from_iterable(_BLOCKS)),
    poses=poses,
    derivative_of=ladders("psi", "s", "x_p", "y_p", "z_p"),
    outward="branch1",
    points={name: (f"x_{name}", f"y_{name}", f"z_{name}") for name in ("b1", "c1", "p")},
    capabilities=(
        Dimensions(links("a1 b1 c1 a2 b2")),
        LINKS,
        Assembly("discriminant1", "pressure_angle1", squared(PARAMETERS, "b1"), "1"),
        Assembly("discriminant2", "pressure_angle2", squared(PARAMETERS, "b2"), "2"),
        Skeleton(
            {"a1": crank_axis(PARAMETERS, "f1", "alpha1"), "d1": standing(PARAMETERS, "e1", None, "g1")},
            (
                Link("crank 1", ("a1", "b1")), Link("coupler 1", ("b1", "c1")),
                Link("rocker", ("q1", "c1")), Link("looper", ("q", "p")),
            ),
            {"q1": foot("z_c1"), "q": foot("z_p")},
        ),
    ),
)  # fmt: skip
