"""Registry entries of cranks whose pin slides along another link that turns.

The slotted link is spatial, with a fork slot or a bar; the inverted slider-crank is the planar one with a slot; in the
swivel linkage the rod slides through a block that swivels, with a working point on the rod.
"""

from __future__ import annotations

from functools import partial
from itertools import chain

import numpy as np

from kernels.families import inverted_slider_crank, slotted, swivel
from kernels.families.slotted import links as fill_links
from kernels.families.swivel import links as fill_swivel_links
from kernels.linkage.bodies import DRIVEN, FRAME, SLIDE, TURN
from kernels.types import Array
from sweep.families.base import Angles, Columns, Family, Output, Parameter, about, floats, parameters_of
from sweep.families.capabilities import Assembly, Dimensions, Link, OutputLink, Skeleton
from sweep.families.curve_features import Singular
from sweep.families.link_tree import LinkBody, LinkJoint, LinkTree
from sweep.families.outputs import ALONG_FRAME, coordinate_outputs, joint_outputs, ladders, point_outputs
from sweep.families.planar_trees import slotted_rocker
from sweep.families.poses import filled_by, poses_of, together
from sweep.families.sites import AXES
from sweep.families.skeletons import CRANK, ORIGIN, crank_axis, dimensions, links, moving, standing

PARAMETERS = parameters_of("slotted")

VALUE_OUTPUTS = (
    *coordinate_outputs(
        "psi", "rad", "angle of the driven link: direction of the slot or bar", "(3)", "(5)", circle="psi"
    ),
    *coordinate_outputs(
        "rho",
        "length",
        "place of the ball along the slot or bar, from the foot of the driven axis",
        "(2)",
        "(6)",
        kind="sliding ",
    ),
    Output("discriminant", "1", "cos^2(pressure angle); negative where slot or arm do not reach the ball", "(7)"),
    Output("pressure_angle", "rad", "between the force on the driven link at the ball and its velocity there", "(7)"),
)

_WAYS = ("along the common perpendicular", "normal to both", "along the driven axis")
JOINT_OUTPUTS = (
    *joint_outputs({"b": "ball of the crank"}, "(1)", _WAYS),
    *joint_outputs({"c": "point of the driven link that guides the ball"}, "(2)", _WAYS),
)

_poses = poses_of(slotted.poses, slotted.Outputs, {"joints": JOINT_OUTPUTS})


@together(VALUE_OUTPUTS + JOINT_OUTPUTS)
def poses(designs: Array, angles: Angles, wanted: frozenset[str]) -> Columns:
    """Wanted pose outputs and status of every design at its crank angles, each (n, m)."""
    return _poses(designs, angles, wanted)


def unit(designs: Array) -> Array:
    """Return 1 for every design: the discriminant itself is the squared cosine of the pressure angle."""
    return np.ones(len(designs))


def axis_squared(parameters: tuple[Parameter, ...], designs: Array, angles: Angles, found: Columns) -> Array:
    """Squared distance of the pin from the driven axis in crank lengths, (n, m); at 0 a slot without offset jumps.

    Its pressure angle is 0 everywhere, so that the discriminant does not show it.
    """
    a, e = dimensions(parameters, designs, "a", "e")
    x, y = floats(found, "x_b", "y_b")
    return np.square((x - e) / a) + np.square(y / a)


_RATES = ("cos_psi", "sin_psi", "dpsi", "d2psi", "rho", "drho", "d2rho")
LINKS = LinkTree(
    bodies=(
        LinkBody("crank", "along the crank, tangential, along its axis, from A", free=(DRIVEN,)),
        LinkBody("link", "along the slot, across it, along the driven axis, from D"),
        LinkBody("arm", "bar: along the arm, along the bar, normal to both, from the bar; fork: across the slot, along "
                 "it, normal to both, from the ball", 1, (SLIDE, TURN)),
    ),
    joints=(
        LinkJoint("a", "crank bearing", "shaft", "frame on the crank", body=0),
        LinkJoint("b", "ball of the crank", "ball", "crank on the arm, or on the block of the fork", lines=(0, 3)),
        LinkJoint("c", "guide of the driven link", "sleeve", "driven link on the arm, or on the block", body=2,
                  touch="ball"),
        LinkJoint("d", "bearing of the driven link", "shaft", "frame on the driven link", body=1),
    ),
    ends=((2, 0),) * 3,
    needs=_RATES,
    fill=filled_by(fill_links, _RATES),
    carrier=1,
    output=1,
)  # fmt: skip

FAMILY = Family(
    **about("slotted"),
    parameters=PARAMETERS,
    position="psi",
    pose_outputs=VALUE_OUTPUTS + JOINT_OUTPUTS,
    poses=poses,
    derivative_of=ladders("psi", "rho"),
    points={"b": ("x_b", "y_b", "z_b"), "c": ("x_c", "y_c", "z_c")},
    capabilities=(
        Singular(partial(axis_squared, PARAMETERS), ("x_b", "y_b")),
        Dimensions(links("a"), optional=("k",)),
        Assembly("discriminant", "pressure_angle", unit),
        OutputLink(standing(PARAMETERS, "e").at),
        LINKS,
        Skeleton(
            {"a": crank_axis(PARAMETERS, "f", "alpha"), "d": standing(PARAMETERS, "e", None, "g")},
            (CRANK, Link("arm", ("b", "c")), Link("driven link", ("d", "c"))),
        ),
    ),
)  # fmt: skip


PLANAR_PARAMETERS = parameters_of("inverted_slider_crank")

PLANAR_VALUES = (
    *coordinate_outputs("psi", "rad", "rocker angle in (-pi, pi]", "(2)", "(4)"),
    *coordinate_outputs(
        "s",
        "length",
        "place of the crank pin along the slot, from the foot of the rocker pivot",
        "(2)",
        "(5)",
        kind="sliding ",
    )[:3],
    Output(
        "discriminant", "1", "1 - h^2/r^2, r from pin to rocker pivot; the slot reaches where it is not negative", "(1)"
    ),
    Output("pressure_angle", "rad", "between the force of the slot and the velocity of the rocker there", "(3)"),
)

PLANAR_JOINTS = joint_outputs({"b": "crank pin"}, "(1)", ALONG_FRAME)


def slot_foot(angles: Angles, h: Array, e: Array, psi: Array) -> tuple[Array, Array]:
    """Foot of the perpendicular from the rocker pivot on the slot, at the distance ``h``."""
    return e - h * np.sin(psi), h * np.cos(psi)


PLANAR = Family(
    **about("inverted_slider_crank"),
    parameters=PLANAR_PARAMETERS,
    position="psi",
    pose_outputs=PLANAR_VALUES + PLANAR_JOINTS,
    poses=poses_of(inverted_slider_crank.poses, inverted_slider_crank.Outputs, {"joints": PLANAR_JOINTS}),
    derivative_of=ladders("psi") | ladders("s", orders=2),
    points={"b": ("x_b", "y_b", None)},
    capabilities=(
        Singular(partial(axis_squared, PLANAR_PARAMETERS), ("x_b", "y_b")),
        Dimensions(links("a")),
        Assembly("discriminant", "pressure_angle", unit),
        OutputLink(standing(PLANAR_PARAMETERS, "e").at),
        slotted_rocker(PLANAR_PARAMETERS),
        Skeleton(
            {"a": ORIGIN, "d": standing(PLANAR_PARAMETERS, "e")},
            (CRANK, Link("rocker", ("d", "c", "b"))),
            {"c": moving(PLANAR_PARAMETERS, "h e", ("psi",), slot_foot)},
        ),
    ),
)


SWIVEL_PARAMETERS = parameters_of("swivel")

ROD_OUTPUTS = coordinate_outputs(
    "rho", "length", "rod between crank pin and the block's centre", "(2)", "(3)", kind="sliding "
)
POINT_OUTPUTS = point_outputs("(4)")
ROD_JOINT_OUTPUTS = (
    *joint_outputs({"b": "crank pin"}, "(1)"),
    *(Output(f"{axis}_n", "1", f"direction of the rod from the crank pin, along {axis}", "(2)") for axis in AXES),
)

_BLOCKS = (ROD_OUTPUTS, *POINT_OUTPUTS, ROD_JOINT_OUTPUTS)


swivel_poses = poses_of(swivel.poses, swivel.Outputs, dict(zip(swivel.Outputs._fields, _BLOCKS, strict=True)))


_ROD_RATES = ("rho", "drho", "x_n", "y_n", "z_n")
SWIVEL_LINKS = LinkTree(
    bodies=(
        LinkBody("crank", "along the crank, tangential, along its axis, from A", free=(DRIVEN,)),
        LinkBody("rod", "along the rod, from B", 0, (TURN, TURN), slender=True),
    ),
    joints=(
        LinkJoint("a", "crank bearing", "shaft", "frame on the crank", body=0),
        LinkJoint("b", "ball at the crank pin", "hinge", "crank on the rod", body=1),
        LinkJoint("q", "swivel block", "contact", "block on the rod", lines=(0, 2)),
    ),
    ends=((1, FRAME),) * 2,
    needs=_ROD_RATES,
    fill=filled_by(fill_swivel_links, _ROD_RATES),
    carrier=1,
    tip=standing(SWIVEL_PARAMETERS, "Lw").at,
)

SWIVEL = Family(
    **about("swivel"),
    parameters=SWIVEL_PARAMETERS,
    position="rho",
    pose_outputs=tuple(chain.from_iterable(_BLOCKS)),
    poses=swivel_poses,
    derivative_of=ladders("rho", "x_p", "y_p", "z_p"),
    points={"b": ("x_b", "y_b", "z_b"), "p": ("x_p", "y_p", "z_p")},
    capabilities=(
        Singular.where_small("rho"),
        Dimensions(links("a")),
        SWIVEL_LINKS,
        Skeleton(
            {
                "a": crank_axis(SWIVEL_PARAMETERS, "f", "alpha"),
                "q": standing(SWIVEL_PARAMETERS, "e", None, "g", axis=None, kind="point"),
            },
            (CRANK, Link("rod", ("b", "q", "p"))),
        ),
    ),
)
