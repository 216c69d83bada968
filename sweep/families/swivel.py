"""Registry entry of the swivel linkage: a crank's rod through a swivel block, with a working point on the rod."""

from __future__ import annotations

from itertools import chain

import numpy as np

from kernels.families import swivel
from kernels.families.swivel.links import links as fill_links
from kernels.links import DRIVEN, FRAME, TURN
from sweep.families.base import Angles, Array, Columns, Family, Output, Parameter
from sweep.families.capabilities import Dimensions, Link, Points, Skeleton
from sweep.families.link_tree import LinkBody, LinkJoint, LinkTree
from sweep.families.linked import filled_by, point_of
from sweep.families.moving_point import filled_blocks, joint_outputs, ladders, point_outputs
from sweep.families.pace import Singular
from sweep.families.skeletons import CRANK, crank_axis, links, standing

PARAMETERS = (
    Parameter("a", "length", "crank", positive=True),
    Parameter("e", "length", "block's centre from the origin along x"),
    Parameter("f", "length", "offset of the crank plane along the crank axis", default=0.0),
    Parameter("g", "length", "block's centre from the origin along z", default=0.0),
    Parameter("alpha", "angle", "angle from the crank axis to z, about x", default=0.0),
    Parameter("Lw", "length", "working point from the crank pin along the rod, towards the block", default=0.0),
)

ROD_OUTPUTS = (
    Output("rho", "length", "rod between crank pin and the block's centre", "(2)"),
    Output("drho", "length", "sliding velocity analogue drho/dphi", "(3)"),
    Output("d2rho", "length", "sliding acceleration analogue", "(3)"),
    Output("d3rho", "length", "sliding jerk analogue", "(3)"),
)
POINT_OUTPUTS = point_outputs("(4)")
JOINT_OUTPUTS = (
    *joint_outputs((("b", "crank pin"),), "(1)"),
    *(Output(f"{axis}_n", "1", f"direction of the rod from the crank pin, along {axis}", "(2)") for axis in "xyz"),
)

_BLOCKS = (ROD_OUTPUTS, *POINT_OUTPUTS, JOINT_OUTPUTS)


def poses(designs: Array, angles: Angles, wanted: frozenset[str]) -> Columns:
    """Return the wanted pose outputs and status of every design at its crank angles, each (n, m)."""
    return filled_blocks(swivel.poses, designs, angles, _BLOCKS, wanted)


def pin_distance_squared(designs: Array, angles: Angles, found: Columns) -> Array:
    """Return the square of the rod between pin and block, (n, m): where it nearly vanishes the rod turns at once."""
    return np.square(np.asarray(found["rho"], np.float64))


_RATES, _DIRECTION = ("rho", "drho", "d2rho"), ("x_n", "y_n", "z_n")
LINKS = LinkTree(
    bodies=(
        LinkBody("crank", "along the crank, tangential, along its axis, from A"),
        LinkBody("rod", "along the rod, from B", slender=True),
    ),
    joints=(
        LinkJoint("a", "crank bearing", "shaft", "frame on the crank", body=0, freedom=0),
        LinkJoint("b", "ball at the crank pin", "hinge", "crank on the rod", body=1),
        LinkJoint("q", "swivel block", "contact", "block on the rod", lines=(0, 2)),
    ),
    parents=(FRAME, 0),
    freedoms=((0, DRIVEN), (1, TURN), (1, TURN)),
    ends=((1, FRAME),) * 2,
    needs=(*_RATES, *_DIRECTION),
    fill=filled_by(fill_links, _RATES, _DIRECTION),
    carrier=1,
    tip=point_of(PARAMETERS, "Lw"),
)

FAMILY = Family(
    name="swivel",
    title="crank and rod through a swivel block",
    parameters=PARAMETERS,
    position="rho",
    pose_outputs=tuple(chain.from_iterable(_BLOCKS)),
    poses=poses,
    derivative_of=ladders("rho", "x_p", "y_p", "z_p"),
    example={"a": 1.0, "e": 2.6, "f": 0.7, "g": -0.4, "alpha": 0.6, "Lw": 5.0},
    uses_phi=False,
    capabilities=(
        Singular(pin_distance_squared, ("rho",)),
        Dimensions(links("a")),
        LINKS,
        Points({"b": ("x_b", "y_b", "z_b"), "p": ("x_p", "y_p", "z_p")}),
        Skeleton(
            {
                "a": crank_axis(PARAMETERS, "f", "alpha"),
                "q": standing(PARAMETERS, "e", None, "g", axis=None, kind="point"),
            },
            (CRANK, Link("rod", ("b", "q", "p"))),
        ),
    ),
)
