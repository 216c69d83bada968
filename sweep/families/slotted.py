"""Registry entries of cranks whose pin slides along another link, which turns with it.

The slotted link is spatial, with a fork slot or a bar; the inverted slider-crank is the planar one with a slot; of the
swivel linkage the rod slides through a block that swivels, with a working point on the rod.
"""

from __future__ import annotations

from itertools import chain

import numpy as np

from kernels.families import inverted_slider_crank, slotted, swivel
from kernels.families.slotted.motion import links as fill_links
from kernels.families.swivel import links as fill_swivel_links
from kernels.linkage.bodies import DRIVEN, FRAME, SLIDE, TURN
from kernels.types import Array
from sweep.families.base import Angles, Columns, Family, Output, Parameter
from sweep.families.capabilities import Assembly, Dimensions, Link, Made, OutputLink, Points, Skeleton
from sweep.families.curve_features import Singular
from sweep.families.link_tree import LinkBody, LinkJoint, LinkTree, filled_by
from sweep.families.outputs import angle_outputs, joint_outputs, ladders, place_outputs, point_outputs
from sweep.families.parts import AXES
from sweep.families.planar_trees import slotted_rocker
from sweep.families.poses import filled_blocks, filled_with_places
from sweep.families.skeletons import CRANK, ORIGIN, crank_axis, links, parameter, standing

PARAMETERS = (
    Parameter("a", "length", "crank", positive=True),
    Parameter("e", "length", "common perpendicular of both axes, from the crank axis to the driven axis"),
    Parameter("f", "length", "offset of the crank plane along the crank axis", default=0.0),
    Parameter("g", "length", "height of the bar along the driven axis; any for the fork slot", default=0.0),
    Parameter("alpha", "angle", "angle from the crank axis to the driven axis", default=0.0),
    Parameter("s", "length", "offset of the slot's middle plane, or of the bar, from the driven axis", default=0.0),
    Parameter("k", "length", "arm between ball and bar; 0 is the fork slot without an arm", default=0.0,
              not_negative=True),
    Parameter("tau", "sign", "side of the bar on which the ball is, seen along it; of no effect for the fork slot",
              default=1.0, choices=(-1.0, 1.0)),
    Parameter("branch", "sign", "side of the driven axis on which the ball is along the slot: sign of rho",
              default=1.0, choices=(-1.0, 1.0)),
)  # fmt: skip

VALUE_OUTPUTS = (
    *angle_outputs("psi", "angle of the driven link: direction of the slot or bar", "(3)", "(5)"),
    Output("sin_psi", "1", "sine of psi", "(3)"),
    Output("cos_psi", "1", "cosine of psi", "(3)"),
    *place_outputs(
        "rho", "place of the ball along the slot or bar, from the foot of the driven axis", "(2)", "(6)", "sliding"
    ),
    Output("discriminant", "1", "cos^2(pressure angle); negative where slot or arm do not reach the ball", "(7)"),
    Output("pressure_angle", "rad", "between the force on the driven link at the ball and its velocity there", "(7)"),
)

JOINT_OUTPUTS = (
    Output("x_b", "length", "ball of the crank, along the common perpendicular", "(1)"),
    Output("y_b", "length", "ball of the crank, normal to both", "(1)"),
    Output("z_b", "length", "ball of the crank, along the driven axis", "(1)"),
    Output("x_c", "length", "point of the driven link that guides the ball, along the common perpendicular", "(2)"),
    Output("y_c", "length", "point of the driven link that guides the ball, normal to both", "(2)"),
    Output("z_c", "length", "point of the driven link that guides the ball, along the driven axis", "(2)"),
)

_JOINTS = tuple(o.name for o in JOINT_OUTPUTS)


def poses(designs: Array, angles: Angles, wanted: frozenset[str]) -> Columns:
    """Compute the wanted pose outputs and status of every design at its crank angles, each (n, m)."""
    return filled_with_places(slotted.poses, designs, angles, slotted.Outputs, _JOINTS, wanted)


def unit(designs: Array) -> Array:
    """Return 1 for every design: the discriminant is the squared cosine of the pressure angle itself."""
    return np.ones(len(designs))


def driven_origin(designs: Array) -> Array:
    """Point (e, 0, 0) of the driven axis, (n, 3)."""
    origin = np.zeros((len(designs), 3), designs.dtype)
    origin[:, 0] = designs[:, 1]
    return origin


_RATES = ("psi", "dpsi", "d2psi", "rho", "drho", "d2rho")
LINKS = LinkTree(
    bodies=(
        LinkBody("crank", "along the crank, tangential, along its axis, from A"),
        LinkBody("link", "along the slot, across it, along the driven axis, from D"),
        LinkBody("arm", "bar: along the arm, along the bar, normal to both, from the bar; fork: across the slot, along "
                 "it, normal to both, from the ball"),
    ),
    joints=(
        LinkJoint("a", "crank bearing", "shaft", "frame on the crank", body=0, freedom=0),
        LinkJoint("b", "ball of the crank", "ball", "crank on the arm, or on the block of the fork", lines=(0, 3)),
        LinkJoint("c", "guide of the driven link", "sleeve", "driven link on the arm, or on the block", body=2,
                  freedom=2, touch="ball"),
        LinkJoint("d", "bearing of the driven link", "shaft", "frame on the driven link", body=1, freedom=1),
    ),
    parents=(FRAME, FRAME, 1),
    freedoms=((0, DRIVEN), (1, TURN), (2, SLIDE), (2, TURN)),
    ends=((2, 0),) * 3,
    needs=_RATES,
    fill=filled_by(fill_links, _RATES),
    carrier=1,
    output=1,
)  # fmt: skip

FAMILY = Family(
    name="slotted",
    title="spatial slotted link",
    parameters=PARAMETERS,
    position="psi",
    pose_outputs=VALUE_OUTPUTS + JOINT_OUTPUTS,
    poses=poses,
    derivative_of=ladders("psi", "rho"),
    example={"a": 1.0, "e": 2.6, "f": 0.7, "g": -0.4, "alpha": 0.6, "s": 0.5},
    uses_phi=False,
    capabilities=(
        Dimensions(links("a"), optional=("k",)),
        Assembly("discriminant", "pressure_angle", unit),
        Points({"b": ("x_b", "y_b", "z_b"), "c": ("x_c", "y_c", "z_c")}),
        OutputLink(driven_origin),
        LINKS,
        Skeleton(
            {"a": crank_axis(PARAMETERS, "f", "alpha"), "d": standing(PARAMETERS, "e", None, "g")},
            (CRANK, Link("arm", ("b", "c")), Link("driven link", ("d", "c"))),
        ),
    ),
)  # fmt: skip


PLANAR_PARAMETERS = (
    Parameter("a", "length", "crank", positive=True),
    Parameter("e", "length", "frame, from crank pivot to rocker pivot along x"),
    Parameter("h", "length", "offset of the slot from the rocker pivot, to its left", default=0.0),
    Parameter("branch", "sign", "assembly mode: side of the rocker on which the pin is", default=1.0,
              choices=(-1.0, 1.0)),
)  # fmt: skip

PLANAR_VALUES = (
    *angle_outputs("psi", "rocker angle in (-pi, pi]", "(2)", "(4)"),
    Output("s", "length", "place of the crank pin along the slot, from the foot of the rocker pivot", "(2)"),
    Output("ds", "length", "sliding velocity analogue ds/dphi", "(5)"),
    Output("d2s", "length", "sliding acceleration analogue", "(5)"),
    Output(
        "discriminant", "1", "1 - h^2/r^2, r from pin to rocker pivot; the slot reaches where it is not negative", "(1)"
    ),
    Output("pressure_angle", "rad", "between the force of the slot and the velocity of the rocker there", "(3)"),
)

PLANAR_JOINTS = (
    Output("x_b", "length", "crank pin, along the frame", "(1)"),
    Output("y_b", "length", "crank pin, across the frame", "(1)"),
)

_PIN = tuple(o.name for o in PLANAR_JOINTS)


def planar_poses(designs: Array, angles: Angles, wanted: frozenset[str]) -> Columns:
    """Compute the wanted pose outputs and status of every design at its crank angles, each (n, m)."""
    return filled_with_places(inverted_slider_crank.poses, designs, angles, inverted_slider_crank.Outputs, _PIN, wanted)


def slot_squared(designs: Array, angles: Angles, found: Columns) -> Array:
    """Square of the pin's place in the slot, (n, m): where it nearly vanishes the rocker turns at once."""
    return np.square(np.asarray(found["s"], np.float64))


def slot_foot(designs: Array, angles: Angles, motion: Columns) -> Array:
    """Foot of the rocker pivot on the slot, (n, m, 3): ``h`` from the pivot, square to the slot."""
    psi = np.asarray(motion["psi"], np.float64)
    h, e = (parameter(PLANAR_PARAMETERS, name, designs)[:, None] for name in ("h", "e"))
    return np.stack([e - h * np.sin(psi), h * np.cos(psi), np.zeros_like(psi)], axis=-1)


PLANAR = Family(
    name="inverted_slider_crank",
    title="inverted slider-crank",
    parameters=PLANAR_PARAMETERS,
    position="psi",
    pose_outputs=PLANAR_VALUES + PLANAR_JOINTS,
    poses=planar_poses,
    example={"a": 1.0, "e": 2.2, "h": 0.3, "branch": -1.0},
    derivative_of=ladders("psi") | {"s": "ds", "ds": "d2s"},
    uses_phi=False,
    capabilities=(
        Singular(slot_squared, ("s",)),
        Dimensions(links("a")),
        Assembly("discriminant", "pressure_angle", unit),
        Points({"b": ("x_b", "y_b", None)}),
        OutputLink(driven_origin),
        slotted_rocker(PLANAR_PARAMETERS),
        Skeleton(
            {"a": ORIGIN, "d": standing(PLANAR_PARAMETERS, "e")},
            (CRANK, Link("rocker", ("d", "c", "b"))),
            {"c": Made(("psi",), slot_foot)},
        ),
    ),
)


SWIVEL_PARAMETERS = (
    Parameter("a", "length", "crank", positive=True),
    Parameter("e", "length", "block's centre from the origin along x"),
    Parameter("f", "length", "offset of the crank plane along the crank axis", default=0.0),
    Parameter("g", "length", "block's centre from the origin along z", default=0.0),
    Parameter("alpha", "angle", "angle from the crank axis to z, about x", default=0.0),
    Parameter("Lw", "length", "working point from the crank pin along the rod, towards the block", default=0.0),
)

ROD_OUTPUTS = place_outputs("rho", "rod between crank pin and the block's centre", "(2)", "(3)", "sliding")
POINT_OUTPUTS = point_outputs("(4)")
ROD_JOINT_OUTPUTS = (
    *joint_outputs((("b", "crank pin"),), "(1)"),
    *(Output(f"{axis}_n", "1", f"direction of the rod from the crank pin, along {axis}", "(2)") for axis in AXES),
)

_BLOCKS = (ROD_OUTPUTS, *POINT_OUTPUTS, ROD_JOINT_OUTPUTS)


def swivel_poses(designs: Array, angles: Angles, wanted: frozenset[str]) -> Columns:
    """Compute the wanted pose outputs and status of every design at its crank angles, each (n, m)."""
    return filled_blocks(swivel.poses, swivel.Outputs, designs, angles, _BLOCKS, wanted)


def pin_distance_squared(designs: Array, angles: Angles, found: Columns) -> Array:
    """Square of the rod between pin and block, (n, m): where it nearly vanishes the rod turns at once."""
    return np.square(np.asarray(found["rho"], np.float64))


_ROD_RATES, _DIRECTION = ("rho", "drho"), ("x_n", "y_n", "z_n")
SWIVEL_LINKS = LinkTree(
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
    needs=(*_ROD_RATES, *_DIRECTION),
    fill=filled_by(fill_swivel_links, _ROD_RATES, _DIRECTION),
    carrier=1,
    tip=standing(SWIVEL_PARAMETERS, "Lw").at,
)

SWIVEL = Family(
    name="swivel",
    title="crank and rod through a swivel block",
    parameters=SWIVEL_PARAMETERS,
    position="rho",
    pose_outputs=tuple(chain.from_iterable(_BLOCKS)),
    poses=swivel_poses,
    derivative_of=ladders("rho", "x_p", "y_p", "z_p"),
    example={"a": 1.0, "e": 2.6, "f": 0.7, "g": -0.4, "alpha": 0.6, "Lw": 5.0},
    uses_phi=False,
    capabilities=(
        Singular(pin_distance_squared, ("rho",)),
        Dimensions(links("a")),
        SWIVEL_LINKS,
        Points({"b": ("x_b", "y_b", "z_b"), "p": ("x_p", "y_p", "z_p")}),
        Skeleton(
            {
                "a": crank_axis(SWIVEL_PARAMETERS, "f", "alpha"),
                "q": standing(SWIVEL_PARAMETERS, "e", None, "g", axis=None, kind="point"),
            },
            (CRANK, Link("rod", ("b", "q", "p"))),
        ),
    ),
)
