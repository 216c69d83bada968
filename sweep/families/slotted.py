"""Registry entry of the spatial slotted link: fork slot and bar."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from kernels.families import slotted
from kernels.families.slotted.links import links as fill_links
from kernels.links import DRIVEN, FRAME, SLIDE, TURN
from sweep.families.base import Angles, Array, Columns, Family, Output, Parameter, filled_with_places
from sweep.families.capabilities import Assembly, Dimensions, Link, OutputLink, Points, Skeleton
from sweep.families.link_tree import LinkBody, LinkJoint, LinkTree
from sweep.families.linked import filled_by
from sweep.families.skeletons import CRANK, crank_axis, links, standing

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
    Output("psi", "rad", "angle of the driven link: direction of the slot or bar", "(3)", wraps=True),
    Output("dpsi", "1", "velocity analogue dpsi/dphi", "(5)"),
    Output("d2psi", "1", "acceleration analogue", "(5)"),
    Output("d3psi", "1", "jerk analogue", "(5)"),
    Output("sin_psi", "1", "sine of psi", "(3)"),
    Output("cos_psi", "1", "cosine of psi", "(3)"),
    Output("rho", "length", "place of the ball along the slot or bar, from the foot of the driven axis", "(2)"),
    Output("drho", "length", "sliding velocity analogue drho/dphi", "(6)"),
    Output("d2rho", "length", "sliding acceleration analogue", "(6)"),
    Output("d3rho", "length", "sliding jerk analogue", "(6)"),
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

_VALUES = tuple(o.name for o in VALUE_OUTPUTS)
_JOINTS = tuple(o.name for o in JOINT_OUTPUTS)


def poses(designs: Array, angles: Angles, wanted: frozenset[str]) -> Columns:
    """Return the wanted pose outputs and status of every design at its crank angles, each (n, m)."""
    return filled_with_places(_with_slide, designs, angles, _VALUES, _JOINTS, wanted)


def _with_slide(*given: Any) -> None:
    """Call the kernel with rho and its derivatives in one record; they follow its six outputs of the angle."""
    kernel: Callable[..., None] = slotted.poses
    kernel(*given[:10], slotted.Slide(*given[10:14]), *given[14:])


def unit(designs: Array) -> Array:
    """Return 1 for every design: the discriminant is the squared cosine of the pressure angle itself."""
    return np.ones(len(designs))


def pivot(designs: Array) -> Array:
    """Return the point (e, 0, g) of the driven axis, (n, 3)."""
    return np.stack([designs[:, 1], np.zeros(len(designs)), designs[:, 3]], axis=1)


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
                  freedom=2),
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
    derivative_of={
        "psi": "dpsi", "dpsi": "d2psi", "d2psi": "d3psi", "rho": "drho", "drho": "d2rho", "d2rho": "d3rho",
    },
    example={"a": 1.0, "e": 2.6, "f": 0.7, "g": -0.4, "alpha": 0.6, "s": 0.5},
    uses_phi=False,
    capabilities=(
        Dimensions(links("a"), optional=("k",)),
        Assembly("discriminant", "pressure_angle", unit),
        Points({"b": ("x_b", "y_b", "z_b"), "c": ("x_c", "y_c", "z_c")}),
        OutputLink(pivot),
        LINKS,
        Skeleton(
            {"a": crank_axis(PARAMETERS, "f", "alpha"), "d": standing(PARAMETERS, "e", None, "g")},
            (CRANK, Link("arm", ("b", "c")), Link("driven link", ("d", "c"))),
        ),
    ),
)  # fmt: skip
