"""Registry entry of the looper on a sphere."""

from __future__ import annotations

from itertools import chain

import numpy as np

from kernels.families import spherical_looper
from kernels.families.spherical_looper import links as fill_links
from kernels.linkage.bodies import DRIVEN, TURN
from kernels.types import Array
from sweep.families.base import Family, Output, about, parameters_of
from sweep.families.capabilities import Arm, Assembly, Dimensions, Fixed, Link, Skeleton
from sweep.families.link_tree import LinkBody, LinkJoint, LinkTree
from sweep.families.outputs import coordinate_outputs, joint_outputs, ladders, magnitude_outputs, point_outputs
from sweep.families.poses import filled_by, poses_of
from sweep.families.skeletons import crank_axis, links, parameter, squared, standing

PARAMETERS = parameters_of("spherical_looper")

CARRIER_OUTPUTS = coordinate_outputs("psi", "rad", "angle of the carrier", "(1)", "(1)")
LOOPER_OUTPUTS = coordinate_outputs("chi", "rad", "angle of the looper in the carrier", "(3)", "(4)", of_name=True)
CARRIER_LOOP_OUTPUTS = (
    Output("discriminant1", "length^2", "b1^2 cos^2(pressure_angle1); negative where the links do not reach", "(1)"),
    Output("pressure_angle1", "rad", "between the force of coupler 1 and the velocity of the carrier's ball", "(1)"),
)
LOOPER_LOOP_OUTPUTS = (
    Output("discriminant2", "length^2", "b2^2 cos^2(pressure_angle2); negative where the links do not reach", "(3)"),
    Output("pressure_angle2", "rad", "between the force of coupler 2 and the velocity of the looper's ball in the "
           "carrier", "(3)"),
)  # fmt: skip
POINT_OUTPUTS = point_outputs("(5)")
MAGNITUDE_OUTPUTS = magnitude_outputs("(6)")
JOINT_OUTPUTS = joint_outputs(
    {"b1": "pin of crank 1", "c1": "carrier's ball", "b2": "pin of crank 2", "c2": "looper's ball"}, "(1), (2)"
)

_BLOCKS = (
    CARRIER_OUTPUTS, CARRIER_LOOP_OUTPUTS, LOOPER_OUTPUTS, LOOPER_LOOP_OUTPUTS,
    *POINT_OUTPUTS, MAGNITUDE_OUTPUTS, JOINT_OUTPUTS,
)  # fmt: skip
_BY_FIELD = dict(zip(spherical_looper.Outputs._fields, _BLOCKS, strict=True))
poses = poses_of(spherical_looper.poses, spherical_looper.Outputs, _BY_FIELD)


def second_shaft(designs: Array) -> Array:
    """Direction of the shaft of crank 2, (n, 3)."""
    theta, beta = parameter(PARAMETERS, "theta2", designs), parameter(PARAMETERS, "beta2", designs)
    return np.stack([np.sin(theta) * np.cos(beta), np.sin(theta) * np.sin(beta), np.cos(theta)], axis=1)


LOOPER = ("c0x", "c0y", "c0z")  # ball of the looper, from the joint Os


_RATES = ("psi", "dpsi", "d2psi", "chi", "dchi", "d2chi")
LINKS = LinkTree(
    bodies=(
        LinkBody("crank1", "along crank 1, tangential, along its shaft, from its centre", free=(DRIVEN,)),
        LinkBody("crank2", "along crank 2, tangential, along its shaft, from its centre", free=(DRIVEN,)),
        LinkBody(
            "carrier", "along the carrier's rocker, tangential, along its axis, from the axis at the ball's height"
        ),
        LinkBody("looper", "x, y, z of the family's frame at psi = chi = 0, from Os", 2),
        LinkBody("coupler1", "along coupler 1, from crank 1", 0, (TURN, TURN), slender=True),
        LinkBody("coupler2", "along coupler 2, from crank 2", 1, (TURN, TURN), slender=True),
    ),
    joints=(
        LinkJoint("a1", "bearing of crank 1", "shaft", "frame on crank 1", body=0),
        LinkJoint("b1", "ball of crank 1", "hinge", "crank 1 on coupler 1", body=4),
        LinkJoint("c1", "carrier's ball", "ball", "coupler 1 on the carrier", lines=(0, 3)),
        LinkJoint("d1", "carrier's bearing", "shaft", "frame on the carrier", body=2),
        LinkJoint("a2", "bearing of crank 2", "shaft", "frame on crank 2", body=1),
        LinkJoint("b2", "ball of crank 2", "hinge", "crank 2 on coupler 2", body=5),
        LinkJoint("c2", "looper's ball", "ball", "coupler 2 on the looper", lines=(3, 3)),
        LinkJoint("os", "looper's bearing in the carrier", "shaft", "carrier on the looper", body=3),
    ),
    ends=((2, 4),) * 3 + ((3, 5),) * 3,
    needs=_RATES,
    fill=filled_by(fill_links, _RATES),
    carrier=3,
    tip=standing(PARAMETERS, "p0x", "p0y", "p0z").at,
)

FAMILY = Family(
    **about("spherical_looper"),
    parameters=PARAMETERS,
    position="psi",
    pose_outputs=tuple(chain.from_iterable(_BLOCKS)),
    poses=poses,
    derivative_of=ladders("psi", "chi", "x_p", "y_p", "z_p"),
    outward="branch1",
    points={name: (f"x_{name}", f"y_{name}", f"z_{name}") for name in ("b1", "c1", "b2", "c2", "p")},
    capabilities=(
        Dimensions((*links("a1 b1 c1 a2 b2"), LOOPER), arms=(Arm(("p0x", "p0y", "p0z"), LOOPER),)),
        LINKS,
        Assembly("discriminant1", "pressure_angle1", squared(PARAMETERS, "b1"), "1"),
        Assembly("discriminant2", "pressure_angle2", squared(PARAMETERS, "b2"), "2"),
        Skeleton(
            {
                "a1": crank_axis(PARAMETERS, "f1", "alpha1"),
                "d1": standing(PARAMETERS, "e1", None, "g1"),
                "os": standing(PARAMETERS, "e1", None, "o", axis=None, kind="point"),
                "a2": Fixed(standing(PARAMETERS, "x2", "y2", "z2").at, second_shaft),
            },
            (
                Link("crank 1", ("a1", "b1")), Link("coupler 1", ("b1", "c1")), Link("carrier", ("d1", "c1")),
                Link("crank 2", ("a2", "b2")), Link("coupler 2", ("b2", "c2")), Link("looper", ("os", "c2", "p")),
            ),
        ),
    ),
)  # fmt: skip
