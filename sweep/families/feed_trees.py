"""Trees of links of feed racks: the crank-rocker that moves the rack to and fro, and the eccentrics that lift it."""

from __future__ import annotations

import numpy as np

from kernels.linkage.bodies import DRIVEN, TURN, Links
from kernels.types import Array
from sweep.families import link_tree as poses
from sweep.families.base import Angles, Columns, Parameter
from sweep.families.link_tree import LinkBody, LinkJoint, LinkTree, Path
from sweep.families.rssr import FAMILY as CRANK_ROCKER
from sweep.families.skeletons import ORIGIN, dimensions

Parameters = tuple[Parameter, ...]
_SPIN = ("psi", "dpsi", "d2psi")
CRANK, COUPLER, ROCKER, ECCENTRIC = range(4)  # bodies of the horizontal chain, then the first eccentric
_BODIES = (
    LinkBody("crank", "along the crank, tangential, along its axis, from the centre of its circle", free=(DRIVEN,)),
    LinkBody("coupler", "along the coupler of the horizontal chain, from the crank pin", CRANK, (TURN, TURN), True),
    LinkBody("rocker", "along the rocker of the horizontal chain, tangential, along its axis, from D"),
)
_JOINTS = (
    LinkJoint("a", "bearing of the crank", "shaft", "frame on the crank", body=CRANK),
    LinkJoint("b", "ball at the crank pin", "hinge", "crank on the coupler", body=COUPLER),
    LinkJoint("c", "ball of the rocker", "ball", "rocker on the coupler", lines=(0, 3)),
    LinkJoint("d", "bearing of the rocker", "shaft", "frame on the rocker", body=ROCKER),
)
_ENDS = ((COUPLER, ROCKER),) * 3


def _horizontal(parameters: Parameters, designs: Array, angles: Angles, links: Links) -> Path:
    """Write crank, coupler and rocker; return the path of the rack's pin H on the rocker's arm."""
    a, c, e, f, g, alpha, arm, ahead, sigma = dimensions(
        parameters, designs, "h_a", "h_c", "h_e", "h_f", "h_g", "h_alpha", "rh", "dh", "h_sigma"
    )
    chain = np.column_stack([designs[:, :7], sigma[:, 0]])
    psi = poses.turning(CRANK_ROCKER.poses(chain, angles, frozenset(_SPIN)), *_SPIN)
    centre = poses.standing_at(links, 0.0, f * np.sin(alpha), f * np.cos(alpha))
    crank = poses.crank_arm(links, angles, alpha, a)
    poses.put_crank(links, CRANK, centre, crank)
    pivot = poses.standing_at(links, e, 0.0, g)
    ball = pivot.plus(psi.arm(c))
    poses.put_between(links, COUPLER, centre.plus(crank), ball)
    poses.put_about(links, ROCKER, pivot, psi)
    poses.put_ball(links, 0, ball.at)
    return poses.standing_at(links, e).plus(psi.arm(arm * np.cos(ahead), arm * np.sin(ahead)))


def _eccentric(parameters: Parameters, designs: Array, angles: Angles, links: Links, body: int, which: str) -> Path:
    """Write an eccentric; return the path of its centre."""
    x, y, radius, ahead = dimensions(parameters, designs, *(f"{name}{which}" for name in ("xE", "yE", "rE", "dE")))
    turned = poses.crank_angle(links, angles, ahead=ahead)
    centre = poses.standing_at(links, x, y)
    poses.put_about(links, body, centre, turned)
    return centre.plus(turned.arm(radius))


def _eccentric_parts(which: str, body: int) -> tuple[LinkBody, LinkJoint]:
    text = f"eccentric{which}"
    axes = f"along the eccentricity of {text}, tangential, along its axis, from its axis"
    found = LinkJoint(f"l{which}", f"bearing of {text}", "shaft", f"frame on {text}", body=body)
    return LinkBody(text, axes, free=(DRIVEN,)), found


def two_leads(parameters: Parameters) -> LinkTree:
    """Tree of a rack on the pin of the rocker and the coupler of the lift eccentric; a tool is at the tooth."""

    def at_tooth(designs: Array) -> Array:
        tx, ty, number, pitch = dimensions(parameters, designs, "tx", "ty", "tooth", "pitch")
        return np.column_stack([tx + number * pitch, ty, 0.0 * ty])

    def fill(designs: Array, angles: Angles, motion: Columns, links: Links) -> None:
        h = _horizontal(parameters, designs, angles, links)
        e = _eccentric(parameters, designs, angles, links, ECCENTRIC, "")
        chi = poses.turning(motion, "chi", "dchi", "d2chi")
        f = h.plus(chi.arm(*dimensions(parameters, designs, "fx", "fy")))
        poses.put_between(links, 4, e, f)
        poses.put_about(links, 5, h, chi)
        poses.put_pin(links, 3, f.at)

    body, joint = _eccentric_parts("", ECCENTRIC)
    return LinkTree(
        bodies=(
            *_BODIES,
            body,
            LinkBody("lift", "along the lift coupler, across it, along the axes, from E", ECCENTRIC),
            LinkBody("rack", "along the rack, across it, along the axes, from H", ROCKER),
        ),
        joints=(
            *_JOINTS,
            joint,
            LinkJoint(
                "e",
                "strap of the lift coupler",
                "shaft",
                "eccentric on the lift coupler",
                body=4,
                touch="strap",
            ),
            LinkJoint("f", "pin of the lift coupler", "ball", "rack on the lift coupler", lines=(3, 2)),
            LinkJoint("h", "pin of the rack on the rocker", "shaft", "rocker on the rack", body=5),
        ),
        ends=(*_ENDS, (4, 5), (4, 5)),
        needs=("chi", "dchi", "d2chi"),
        fill=fill,
        rubs=False,
        carrier=5,
        tip=at_tooth,
    )


def three_leads(parameters: Parameters) -> LinkTree:
    """Tree of a rack on links of the rocker and of two eccentrics; a tool is at the tooth."""
    links_from = 5  # bodies: horizontal chain, two eccentrics, links 1 to 3, rack
    rack = links_from + 3

    def fill(designs: Array, angles: Angles, motion: Columns, links: Links) -> None:
        starts = [_horizontal(parameters, designs, angles, links)]
        starts += [_eccentric(parameters, designs, angles, links, ECCENTRIC + k, str(2 + k)) for k in (0, 1)]
        tooth = _tooth(motion)
        chi = poses.turning(motion, "chi", "dchi", "d2chi")
        ends = [tooth.plus(chi.arm(*dimensions(parameters, designs, f"f{k}x", f"f{k}y"))) for k in (1, 2, 3)]
        for k in (0, 1, 2):
            poses.put_between(links, links_from + k, starts[k], ends[k])
        # the rack hangs on link 1, its tooth is the origin of its axes
        poses.put_about(links, rack, tooth, chi)
        links.bodies[:, :, rack, 24:] = ends[0].at
        for k in (1, 2):
            poses.put_pin(links, 3 + 2 * (k - 1), ends[k].at)

    parts = [_eccentric_parts(str(2 + k), ECCENTRIC + k) for k in (0, 1)]
    leads = ("rocker", "eccentric 2", "eccentric 3")
    pins = [
        LinkJoint(f"q{k}", f"pin of link {k} on the {lead}", "shaft", f"{lead} on link {k}", body=4 + k)
        for k, lead in enumerate(leads, start=1)
    ]
    return LinkTree(
        bodies=(
            *_BODIES,
            *(body for body, _ in parts),
            *(
                LinkBody(f"link{k}", f"along link {k}, across it, along the axes, from its lead", ROCKER + k - 1)
                for k in (1, 2, 3)
            ),
            LinkBody("rack", "along the rack, across it, along the axes, from the tooth", links_from),
        ),
        joints=(
            *_JOINTS,
            *(joint for _, joint in parts),
            *pins,
            LinkJoint("f1", "pin of link 1 on the rack", "shaft", "link 1 on the rack", body=rack),
            *(
                LinkJoint(f"f{k}", f"pin of link {k} on the rack", "ball", f"rack on link {k}", lines=(2 * k - 1, 2))
                for k in (2, 3)
            ),
        ),
        ends=(*_ENDS, (6, rack), (6, rack), (7, rack), (7, rack)),
        needs=("x_t", "y_t", "dx_t", "dy_t", "d2x_t", "d2y_t", "chi", "dchi", "d2chi"),
        fill=fill,
        rubs=False,
        carrier=rack,
        tip=ORIGIN.at,
    )


def _tooth(motion: Columns) -> Path:
    rows = [[np.asarray(motion[f"{order}{x}_t"], np.float64) for x in "xy"] for order in ("", "d", "d2")]
    return Path(*(np.stack([x, y, 0.0 * x], axis=-1) for x, y in rows))
