"""Registry entry of the presser foot on the rack of the feed mechanism."""

from __future__ import annotations

import numpy as np

from kernels.families import feed as kernels
from kernels.families.feed.motion import OUTPUTS as _RACK
from sweep.families import feed
from sweep.families.base import Accuracy, Angles, Array, Columns, Family, Output, Step, Work, guarded
from sweep.families.capabilities import Fixed, Link, Made, Skeleton
from sweep.families.domain import March
from sweep.families.foot import (
    EVENT_OUTPUTS,
    FABRIC,
    FOOT,
    NODES,
    POSE_OUTPUTS,
    RESTITUTION,
    TURNS,
    chosen,
    marched,
    nodes_for,
)
from sweep.families.skeletons import Y, standing

PARAMETERS = (*feed.PARAMETERS, *FOOT, RESTITUTION, *FABRIC)
_RACK_COLUMNS = len(feed.PARAMETERS)
_FEET = [_RACK_COLUMNS + k for k in range(len(FOOT) + 1 + len(FABRIC))]
_PLATE = feed.FAMILY.parameter_names.index("y_plate")
_ROWS = [_RACK.index(name) for name in ("y_t", "dy_t", "d2y_t", "x_t", "dx_t", "d2x_t")]


def path_of(designs: Array, nodes: int) -> tuple[Array, np.ndarray]:
    """Return the path of the tooth above the plate at so many equal crank angles, (n, 6, nodes),
    and the status of the linkage.
    """
    phi = np.arange(nodes)[None, :] * (2.0 * np.pi / nodes)
    rack = np.ascontiguousarray(designs[:, :_RACK_COLUMNS])
    status, outputs = np.empty((len(designs), nodes), np.uint8), np.empty((len(_RACK), len(designs), nodes))
    kernels.poses(rack, np.cos(phi), np.sin(phi), status, outputs)
    path = np.ascontiguousarray(outputs[_ROWS].transpose(1, 0, 2))
    path[:, 0] -= rack[:, _PLATE, None]
    # the first pose that is not ok speaks for the turn
    worst = np.take_along_axis(status, np.argmax(status != 0, axis=1)[:, None], axis=1)[:, 0]
    return path, worst


def _marched(designs: Array, nodes: int) -> tuple[Columns, Array, Array, Array]:
    path, linkage = path_of(designs, nodes)
    columns, heights, forces = marched(path, designs[:, _FEET])
    # A rack that is not assembled has no path: the linkage's status stands for what the march found invalid.
    columns["status"] = np.where(linkage != 0, linkage, columns["status"]).astype(np.uint8)
    return columns, path, heights, forces


def poses(designs: Array, angles: Angles, wanted: frozenset[str]) -> Columns:
    """Return the wanted pose outputs and status of every design over one turn in equal steps from 0, each (n, m)."""
    nodes, apart = nodes_for(angles.phi.shape[1])
    columns, path, heights, forces = _marched(designs, nodes)
    found: Columns = {
        "y_rack": path[:, 0, ::apart], "x_rack": path[:, 3, ::apart], "y_foot": heights[:, ::apart],
        "force": forces[:, ::apart],
    }  # fmt: skip
    status = np.repeat(np.asarray(columns["status"], np.uint8)[:, None], angles.phi.shape[1], axis=1)
    return {name: x for name, x in found.items() if name in wanted} | {"status": status}


def events(designs: Array, wanted: frozenset[str], accuracy: Accuracy) -> Columns:
    """Return the loss of contact, landing, impacts and what they cost, of the last turn marched."""
    return chosen(_marched(designs, NODES)[0], wanted)


def contact(designs: Array, wanted: frozenset[str], accuracy: Accuracy) -> Columns:
    """Return the softest spring and the least preload with which a rigid foot stays on the rack from
    entry to leaving.
    """
    mass, _, preload, omega = designs[:, _FEET[:4]].T
    unit = mass * omega * omega
    path, status = path_of(designs, NODES)
    rack = np.ascontiguousarray(designs[:, :_RACK_COLUMNS])
    ends = feed.events(rack, frozenset(("phi_entry", "phi_leave")), accuracy)
    places = np.stack([np.asarray(ends[name], np.float64) for name in ("phi_entry", "phi_leave")], axis=1)
    known = np.asarray(np.isfinite(places).all(axis=1))
    bend = feed.poses(rack, Angles.of(np.where(known[:, None], places, 0.0)), frozenset(("d2y_t",)))["d2y_t"]
    least = np.where(known, unit * np.maximum(-np.asarray(bend, np.float64).min(axis=1), 0.0), np.nan)
    height, rising = path[:, 0], path[:, 0] > 0.0
    with np.errstate(all="ignore"):
        springs = np.where(rising, (-unit[:, None] * path[:, 2] - preload[:, None]) / height, 0.0)
    softest = np.where(known & (preload >= least), np.maximum(springs.max(axis=1), 0.0), np.nan)
    return chosen({"k_min_contact": softest, "F0_min_contact": least, "status": status}, wanted)


def feeding(designs: Array, wanted: frozenset[str], accuracy: Accuracy) -> Columns:
    """Return the entry, leaving and path of the tooth, as of the rack alone."""
    return feed.events(np.ascontiguousarray(designs[:, :_RACK_COLUMNS]), wanted, accuracy)


def _rack(designs: Array, angles: Angles, *names: str) -> list[Array]:
    found = feed.poses(np.ascontiguousarray(designs[:, :_RACK_COLUMNS]), angles, frozenset(names))
    return [np.asarray(found[name], np.float64) for name in names]


def of_rack(joint: str) -> Made:
    """Return a joint of the feed mechanism."""

    def at(designs: Array, angles: Angles, found: Columns) -> Array:
        x, y = _rack(designs, angles, f"x_{joint}", f"y_{joint}")
        return np.stack([x, y, 0.0 * x], axis=-1)

    return Made((), at)


def plate(designs: Array) -> Array:
    """Return the place of the foot on the needle plate: above the tooth's place at phi = 0."""
    (x,) = _rack(designs, Angles.of(np.zeros((1, 1))), "x_t")
    return np.stack([x[:, 0], designs[:, _PLATE], 0.0 * x[:, 0]], axis=1)


def foot_place(designs: Array, angles: Angles, found: Columns) -> Array:
    """Return the foot."""
    y = np.asarray(found["y_foot"], np.float64)
    return plate(designs)[:, None, :] + np.stack([0.0 * y, y, 0.0 * y], axis=-1)


CONTACT_OUTPUTS = (
    Output("k_min_contact", "force/length", "softest spring that keeps contact with this preload, rigid ground; nan if "
           "none does, for want of preload", "(3)"),
    Output("F0_min_contact", "N", "least preload that keeps contact at entry and leaving, rigid ground", "(3)"),
)  # fmt: skip

EXAMPLE = feed.EXAMPLE | {"m": 0.05, "k": 50.0, "F0": 4.0, "omega": 20.0}


FAMILY = Family(
    name="feed_foot",
    title="presser foot on the rack of a feed mechanism",
    parameters=PARAMETERS,
    position="y_foot",
    pose_outputs=(*POSE_OUTPUTS, Output("x_rack", "length", "tooth, along the feed", "(11)")),
    poses=guarded(poses),
    domain=March(turns=TURNS),
    steps=(
        Step("feeding", feed.FEEDING_OUTPUTS, feeding, work=Work.LONG),
        Step("contact", CONTACT_OUTPUTS, contact, work=Work.LONG),
        Step("march", EVENT_OUTPUTS, events, work=Work.LONG),
    ),
    example=EXAMPLE,
    analytic=False,
    capabilities=(
        feed.SIZES,
        Skeleton(
            dict(feed.SKELETON.fixed) | {"plate": Fixed(plate, standing(PARAMETERS, axis=Y).axis, "slide")},
            (*feed.SKELETON.links, Link("foot", ("p",))),
            {joint: of_rack(joint) for joint in ("h", "e", "f", "t")} | {"p": Made(("y_foot",), foot_place)},
        ),
    ),
)
