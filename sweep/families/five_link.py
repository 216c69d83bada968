"""Registry entry of the five-link: a crank-rocker whose driving ball is replaced by two perpendicular revolutes."""

from __future__ import annotations

import numpy as np

from kernels.families import five_link
from kernels.families.five_link.motion import links as fill_links
from kernels.linkage.bodies import DRIVEN
from sweep.families import rssr as crank_rocker
from sweep.families.base import Array, Family, Output, about, parameters_of
from sweep.families.capabilities import Assembly, Link, OutputLink, Skeleton
from sweep.families.link_tree import LinkBody, LinkJoint, LinkTree
from sweep.families.outputs import coordinate_outputs, joint_outputs, ladders
from sweep.families.poses import filled_by, poses_of
from sweep.families.skeletons import CRANK, CRANK_ROCKER_SIZES, ROCKER, crank_axis, standing

PARAMETERS = parameters_of("five_link")

VALUE_OUTPUTS = (
    *coordinate_outputs("psi", "rad", "rocker angle in (-pi, pi]", "(1)", "(5)", circle="the rocker angle"),
    Output("discriminant", "length^4", "(2 b c)^2 cos^2(pressure angle); negative where the links do not reach", "(7)"),
    Output("pressure_angle", "rad", "between the force through the rocker ball and its velocity", "(6)"),
)

PLACE_OUTPUTS = (
    Output("theta", "rad", "angle of the coupler's plane about the crank pin, from the common perpendicular", "(8)",
           wraps=True),
    Output("beta", "rad", "angle of the coupler against the crank plane, in (-pi/2, pi/2)", "(8)"),
    *joint_outputs({"b": "crank pin", "h": "second revolute", "c": "rocker ball"}, "(9)", crank_rocker.WAYS),
)  # fmt: skip

poses = poses_of(five_link.poses, five_link.Outputs, {"places": PLACE_OUTPUTS})


_RATES = ("psi", "dpsi", "d2psi", "theta", "beta")
LINKS = LinkTree(
    bodies=(
        LinkBody("crank", "along the crank, tangential, along its axis, from A", free=(DRIVEN,)),
        LinkBody("cross", "from axis 1 to axis 2, along axis 2, along axis 1, from B", 0),
        LinkBody("coupler", "along the coupler, along axis 2, normal to both, from axis 2", 1),
        LinkBody("rocker", "along the rocker, tangential, along its axis, from D"),
    ),
    joints=(
        LinkJoint("a", "crank bearing", "shaft", "frame on the crank", body=0),
        LinkJoint("b", "axis 1 at the crank pin", "shaft", "crank on the cross-piece", body=1),
        LinkJoint("h", "axis 2", "shaft", "cross-piece on the coupler", body=2),
        LinkJoint("c", "rocker ball", "ball", "coupler on the rocker", lines=(0, 3)),
        LinkJoint("d", "rocker bearing", "shaft", "frame on the rocker", body=3),
    ),
    ends=((3, 2),) * 3,
    needs=_RATES,
    fill=filled_by(fill_links, _RATES),
    carrier=3,
    output=3,
)


def _may_stand(designs: Array) -> Array:
    """Whether the ball's height above the crank plane can reach b, with the coupler parallel to the crank axis."""
    b, c, f, g, alpha = designs[:, [1, 2, 4, 5, 6]].T
    return np.asarray(c * np.abs(np.sin(alpha)) + np.abs(g * np.cos(alpha) - f) >= b)


FAMILY = Family(
    **about("five_link"),
    parameters=PARAMETERS,
    position="psi",
    pose_outputs=VALUE_OUTPUTS + PLACE_OUTPUTS,
    poses=poses,
    derivative_of=ladders("psi"),
    outward="branch",
    points={name: (f"x_{name}", f"y_{name}", f"z_{name}") for name in ("b", "h", "c")},
    capabilities=(
        CRANK_ROCKER_SIZES,
        Assembly("discriminant", "pressure_angle", crank_rocker.discriminant_scale, end=("beta", _may_stand)),
        OutputLink(standing(PARAMETERS, "e").at),
        LINKS,
        Skeleton(
            {"a": crank_axis(PARAMETERS, "f", "alpha"), "d": standing(PARAMETERS, "e", None, "g")},
            (CRANK, Link("cross-piece", ("b", "h")), Link("coupler", ("h", "c")), ROCKER),
        ),
    ),
)
