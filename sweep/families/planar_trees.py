"""Trees of links of planar families and of thread take-ups: poses of the bodies from the pose outputs alone.

A body on another by a pin in the plane bears there the loads across the plane too; pins and contacts that close a loop
bear forces in the plane.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from kernels.linkage.bodies import DRIVEN, FRAME, SLIDE, Links
from kernels.types import Array
from sweep.families import link_tree as poses
from sweep.families.base import Angles, Columns, Parameter, floats
from sweep.families.link_tree import LinkBody, LinkFill, LinkJoint, LinkTree, Path, Turning
from sweep.families.skeletons import ORIGIN, X, Y, Z, dimensions, standing

Parameters = tuple[Parameter, ...]
_PSI, _CHI = ("psi", "dpsi", "d2psi"), ("chi", "dchi", "d2chi")


_GUIDE = LinkJoint("d", "guide of the follower", "sleeve", "frame on the follower", body=1)


_CAM = LinkBody("cam", "fixed to the cam, along x and y at phi = 0, along its axis, from its axis", free=(DRIVEN,))


def _bearing(text: str) -> LinkJoint:
    return LinkJoint("a", f"bearing of the {text}", "shaft", f"frame on the {text}", body=0)


def _put_cam(angles: Angles, links: Links, at: Path) -> None:
    """Write the pose of a cam on the driven shaft, at the crank angle."""
    poses.put_about(links, 0, at, poses.crank_angle(links, angles))


def slotted_rocker(parameters: Parameters) -> LinkTree:
    """Crank, rocker with a slot, and the block in it that turns on the crank pin."""

    def fill(designs: Array, angles: Angles, motion: Columns, links: Links) -> None:
        a, e, h = dimensions(parameters, designs, "a", "e", "h")
        turned = poses.turning(motion, *_PSI)
        crank = poses.crank_angle(links, angles)
        poses.put_about(links, 0, poses.standing_at(links), crank)
        poses.put_about(links, 1, poses.standing_at(links, e), turned)
        pin = crank.arm(a)
        poses.put_about(links, 2, pin, turned, turned.arm(np.ones_like(h)).at)
        poses.put_pin(links, 0, pin.at)

    return LinkTree(
        bodies=(
            LinkBody("crank", "along the crank, tangential, along its axis, from A", free=(DRIVEN,)),
            LinkBody("rocker", "along the slot, across it, along its axis, from D"),
            LinkBody("block", "along the slot, across it, along the axes, from B", 1, (SLIDE,)),
        ),
        joints=(
            _bearing("crank"),
            LinkJoint("b", "crank pin", "ball", "crank on the block", lines=(0, 2)),
            LinkJoint("c", "slot", "sleeve", "rocker on the block", body=2, touch="line"),
            LinkJoint("d", "rocker bearing", "shaft", "frame on the rocker", body=1),
        ),
        ends=((2, 0),) * 2,
        needs=_PSI,
        fill=fill,
        rubs=False,
        carrier=1,
        output=1,
    )


def rolling_planet(parameters: Parameters) -> LinkTree:
    """Carrier, planet that rolls on a fixed gear, and the slotted link in which its pin slides.

    Teeth press along the tangent of the pitch circles, ours: a pressure angle of the teeth adds a radial force that the
    carrier bears.  Without a fixed gear in ``parameters`` it has the size of the planet.  Lengths of these families are
    in planet radii: loads have the radius as an input.
    """
    whole = "n" in [p.name for p in parameters]

    def fill(designs: Array, angles: Angles, motion: Columns, links: Links) -> None:
        k, a = dimensions(parameters, designs, "k", "a")
        n, mesh = dimensions(parameters, designs, "n", "mesh") if whole else (np.ones_like(k), np.ones_like(k))
        turned, carrier = poses.turning(motion, *_PSI), poses.crank_angle(links, angles)
        axis = poses.standing_at(links, a)
        poses.put_about(links, 0, axis, carrier)
        centre = axis.plus(carrier.arm(n + mesh))
        planet = poses.crank_angle(links, angles, mesh * (n + mesh), np.where(mesh > 0.0, np.pi, 0.0))
        poses.put_about(links, 1, centre, planet)
        poses.put_about(links, 2, poses.standing_at(links), turned)
        ray = carrier.arm(np.ones_like(a)).at
        poses.put_line(links, 0, axis.at + n[..., None] * ray, np.cross(Z, ray))
        pin = centre.plus(planet.arm(k)).at
        poses.put_line(links, 1, pin, np.cross(Z, turned.arm(np.ones_like(a)).at))

    return LinkTree(
        bodies=(
            LinkBody("carrier", "along the carrier, tangential, along its axis, from A", free=(DRIVEN,)),
            LinkBody("planet", "along the arm of the pin, across it, along its axis, from O", 0),
            LinkBody("link", "along the slot, across it, along its axis, from D"),
        ),
        joints=(
            _bearing("carrier"),
            LinkJoint("o", "bearing of the planet", "shaft", "carrier on the planet", body=1),
            LinkJoint("teeth", "teeth of the fixed gear", "contact", "fixed gear on the planet", lines=(0, 1)),
            LinkJoint("b", "pin in the slot", "contact", "slotted link on the planet", lines=(1, 1), touch="line"),
            LinkJoint("d", "bearing of the slotted link", "shaft", "frame on the slotted link", body=2),
        ),
        ends=((1, FRAME), (1, 2)),
        needs=_PSI,
        fill=fill,
        rubs=False,
        carrier=2,
        output=2,
        unit=Parameter("planet_radius", "length", "radius of the planet, unit of k and a", positive=True, default=1.0),
    )


def _cam_and(follower: LinkBody, joint: LinkJoint, needs: tuple[str, ...], fill: LinkFill) -> LinkTree:
    """Cam on the driven shaft and a follower that touches it along one line."""
    slides = follower.free == (SLIDE,)
    return LinkTree(
        bodies=(_CAM, follower),
        joints=(
            _bearing("cam"),
            LinkJoint("r", "roller on the cam", "contact", f"cam on the {follower.name}", lines=(0, 1)),
            joint,
        ),
        ends=((1, 0),),
        needs=needs,
        fill=fill,
        rubs=False,
        carrier=1,
        tip=ORIGIN.at if slides else None,
        output=1,
        arms=() if slides else ((1, 0),),
    )


def sliding_follower(parameters: Parameters) -> LinkTree:
    """Cam and a follower whose roller moves along x."""

    def fill(designs: Array, angles: Angles, motion: Columns, links: Links) -> None:
        r0, e = dimensions(parameters, designs, "r0", "e")
        foot = poses.standing_at(links, np.sqrt(r0 * r0 - e * e), -e)
        roller = foot.plus(poses.sliding(motion, ("s", "ds", "d2s"), X))
        _put_cam(angles, links, poses.standing_at(links))
        poses.put_shifted(links, 1, roller, X)
        poses.put_line(links, 0, roller.at, np.cross(Z, roller.v - np.cross(Z, roller.at)))

    follower = LinkBody("follower", "along the lift, to the left of it, along the cam's axis, from the roller",
                        free=(SLIDE,))  # fmt: skip
    return _cam_and(follower, _GUIDE, ("s", "ds", "d2s"), fill)


def swinging_follower(parameters: Parameters) -> LinkTree:
    """Cam and a lever whose roller moves on an arc."""

    def fill(designs: Array, angles: Angles, motion: Columns, links: Links) -> None:
        c, e = dimensions(parameters, designs, "c", "e")
        turned, pivot = poses.turning(motion, *_PSI), poses.standing_at(links, e)
        roller = pivot.plus(turned.arm(c))
        _put_cam(angles, links, poses.standing_at(links))
        poses.put_about(links, 1, pivot, turned)
        poses.put_line(links, 0, roller.at, np.cross(Z, roller.v - np.cross(Z, roller.at)))

    lever = LinkBody("lever", "along the lever, tangential, along its axis, from D")
    pivot = LinkJoint("d", "bearing of the lever", "shaft", "frame on the lever", body=1)
    return _cam_and(lever, pivot, _PSI, fill)


def thread_follower(parameters: Parameters, cam_axis: Callable[[Array], Array]) -> LinkTree:
    """Cam of a thread take-up and its follower, which moves along y; the thread acts on it as a tool's force."""

    def fill(designs: Array, angles: Angles, motion: Columns, links: Links) -> None:
        axis = cam_axis(designs)
        centre = poses.standing_at(links, axis[:, [0]], axis[:, [1]], axis[:, [2]])
        foot = poses.standing_at(links, *dimensions(parameters, designs, "e"))
        end = foot.plus(poses.sliding(motion, ("S", "dS", "d2S"), Y))
        _put_cam(angles, links, centre)
        poses.put_shifted(links, 1, end, Y)
        poses.put_line(links, 0, end.at, np.cross(Z, end.v - np.cross(Z, end.at - centre.at)))

    follower = LinkBody("follower", "along x, along its way, along the cam's axis, from its end", free=(SLIDE,))
    return _cam_and(follower, _GUIDE, ("S", "dS", "d2S"), fill)


def turning_cam(needs: tuple[str, ...]) -> LinkTree:
    """Cam alone, with a thread on its bare edge."""

    def fill(designs: Array, angles: Angles, motion: Columns, links: Links) -> None:
        _put_cam(angles, links, poses.standing_at(links))

    return LinkTree((_CAM,), (_bearing("cam"),), (), needs, fill, carrier=0, rubs=False)


def eyelet_crank(parameters: Parameters) -> LinkTree:
    """Crank with an eyelet at its end, on which the thread acts as a tool's force."""

    def fill(designs: Array, angles: Angles, motion: Columns, links: Links) -> None:
        a, f, alpha = dimensions(parameters, designs, "a", "f", "alpha")
        centre = poses.standing_at(links, 0.0, f * np.sin(alpha), f * np.cos(alpha))
        poses.put_crank(links, 0, centre, poses.crank_arm(links, angles, alpha, a))

    body = LinkBody("crank", "along the crank, tangential, along its axis, from A", free=(DRIVEN,))
    return LinkTree((body,), (_bearing("crank"),), (), ("P",), fill, 0, standing(parameters, "a").at, rubs=False)


def heddle_shaft(parameters: Parameters, line: Callable[[Array], tuple[Array, Array]]) -> LinkTree:
    """Cam lever, rod, bell crank, shaft lever and shaft of a heddle drive.

    The link between both levers and the heddle rod bear axial force only and have no mass: add half of it to each of
    their neighbours.  Levers of the parallel linkage without dimensions have the arm O4E to it.
    """

    def fill(designs: Array, angles: Angles, motion: Columns, links: Links) -> None:
        lever, bell = poses.crank_angle(links, angles), poses.turning(motion, *_CHI)
        first, second, o2b, o3c, o4e, rod, middle = dimensions(
            parameters, designs, "O2O3", "O3O4", "O2B", "O3C", "O4E", "EG", "chi_mid"
        )
        o2, o3, o4 = (poses.standing_at(links, x) for x in (0.0, first, first + second))
        b, c = lever.arm(o2b), o3.plus(bell.arm(o3c))
        lam = _shaft_lever(parameters, designs, motion)
        at = line(designs)[0]
        shaft = poses.standing_at(links, at[:, [0]]).plus(poses.sliding(motion, ("y", "dy", "d2y"), Y))
        poses.put_about(links, 0, o2, lever)
        poses.put_between(links, 1, b, c)
        poses.put_about(links, 2, o3, bell)
        poses.put_about(links, 3, o4, lam)
        poses.put_shifted(links, 4, shaft, Y)
        poses.put_pin(links, 0, c.at)
        end = o4.plus(lam.arm(o4e)).at
        _put_link(parameters, designs, links, (o3.at, o4.at), (bell.angle - middle, lam.angle))
        poses.put_line(links, 3, end, np.where((rod > 0.0)[..., None], end - shaft.at, np.array(Y)))

    return LinkTree(
        bodies=(
            LinkBody("lever", "along O2B, across it, along its axis, from O2", free=(DRIVEN,)),
            LinkBody("rod", "along the rod, across it, along the axes, from B", 0),
            LinkBody("bell", "along O3C, across it, along its axis, from O3"),
            LinkBody("back", "along O4E, across it, along its axis, from O4"),
            LinkBody("shaft", "along O2O3, along the lift, along the axes, from its rod's end", free=(SLIDE,)),
        ),
        joints=(
            LinkJoint("a", "bearing of the cam lever", "shaft", "frame on the cam lever", body=0),
            LinkJoint("b", "pin of the rod on the cam lever", "shaft", "cam lever on the rod", body=1),
            LinkJoint("c", "pin of the rod on the bell crank", "ball", "rod on the bell crank", lines=(0, 2)),
            LinkJoint("o3", "bearing of the bell crank", "shaft", "frame on the bell crank", body=2),
            LinkJoint("o4", "bearing of the shaft lever", "shaft", "frame on the shaft lever", body=3),
            LinkJoint("f", "link between the levers", "contact", "link on the shaft lever", lines=(2, 1)),
            LinkJoint("e", "heddle rod", "contact", "heddle rod on the shaft", lines=(3, 1)),
            LinkJoint("g", "guide of the shaft", "sleeve", "frame on the shaft", body=4),
        ),
        ends=((2, 1), (2, 1), (3, 2), (4, 3)),
        needs=(*_CHI, "lam", "y", "dy", "d2y"),
        fill=fill,
        rubs=False,
        carrier=4,
        tip=ORIGIN.at,
        output=4,
        arms=((3, 3),),
    )


def _shaft_lever(parameters: Parameters, designs: Array, motion: Columns) -> Turning:
    """Return the angle of the shaft lever and its rates, from the rates of the shaft, (7)."""
    arm, heddle, slide = dimensions(parameters, designs, "O4E", "EG", "x_s")
    lam, first, second = floats(motion, "lam", "dy", "d2y")
    x, y = arm * np.cos(lam), arm * np.sin(lam)
    z = np.where(heddle > 0.0, x - slide, 0.0)
    height = np.where(heddle > 0.0, np.sqrt((heddle - z) * (heddle + z)), 1.0)
    tilt = z / height
    per = x + tilt * y
    bend = -y + np.where(heddle > 0.0, tilt * x - y * y * (1.0 + tilt * tilt) / height, 0.0)
    rate = first / per
    return Turning(lam, rate, (second - bend * rate * rate) / per)


def _put_link(
    parameters: Parameters, designs: Array, links: Links, pivots: tuple[Array, Array], angles: tuple[Array, Array]
) -> None:
    """Write the line of the link between bell crank and shaft lever, at their angles from mid-stroke."""
    first, second, frame, arm, side = dimensions(parameters, designs, "O3D", "O4F", "O3O4", "O4E", "side_F")
    bare = (first == 0.0) & (second == 0.0)
    ends = []
    for pivot, length, angle in zip(pivots, (first, second), angles, strict=True):
        along = side * np.where(bare, arm, length)
        ends.append(pivot + np.stack([-along * np.sin(angle), along * np.cos(angle), 0.0 * angle], axis=-1))
    way = np.where((bare & (frame == 0.0))[..., None], np.array(X), ends[1] - ends[0])
    poses.put_line(links, 2, ends[1], way)
