"""Registry entry of the presser foot on the rack of the feed mechanism."""

from __future__ import annotations

import numpy as np

from kernels.families import feed as kernels
from kernels.families.feed.motion import OUTPUTS as _RACK
from sweep.families import feed
from sweep.families.base import Accuracy, Angles, Array, Columns, Family, Output, Step, Work, guarded
from sweep.families.domain import March
from sweep.families.foot import EVENT_OUTPUTS, FOOT, NODES, POSE_OUTPUTS, RESTITUTION, TURNS, chosen, marched, nodes_for

PARAMETERS = (*feed.PARAMETERS, *FOOT, RESTITUTION)
_RACK_COLUMNS = len(feed.PARAMETERS)
_FEET = [_RACK_COLUMNS + k for k in range(len(FOOT) + 1)]
_PLATE = feed.FAMILY.parameter_names.index("y_plate")
_ROWS = [_RACK.index(name) for name in ("y_t", "dy_t", "d2y_t", "x_t", "dx_t", "d2x_t")]


def path_of(designs: Array, nodes: int) -> tuple[Array, np.ndarray]:
    """Path of the tooth above the plate at so many equal crank angles, (n, 6, nodes), and the status of the linkage."""
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
    """Wanted pose outputs and status of every design over one turn in equal steps from 0, each (n, m)."""
    nodes, apart = nodes_for(angles.phi.shape[1])
    columns, path, heights, forces = _marched(designs, nodes)
    found: Columns = {
        "y_rack": path[:, 0, ::apart], "x_rack": path[:, 3, ::apart], "y_foot": heights[:, ::apart],
        "force": forces[:, ::apart],
    }  # fmt: skip
    status = np.repeat(np.asarray(columns["status"], np.uint8)[:, None], angles.phi.shape[1], axis=1)
    return {name: x for name, x in found.items() if name in wanted} | {"status": status}


def events(designs: Array, wanted: frozenset[str], accuracy: Accuracy) -> Columns:
    """Loss of contact, landing, impacts and what they cost, of the last turn marched."""
    return chosen(_marched(designs, NODES)[0], wanted)


def feeding(designs: Array, wanted: frozenset[str], accuracy: Accuracy) -> Columns:
    """Entry, leaving and path of the tooth, as of the rack alone."""
    return feed.events(np.ascontiguousarray(designs[:, :_RACK_COLUMNS]), wanted, accuracy)


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
        Step("march", EVENT_OUTPUTS, events, work=Work.LONG),
    ),
    example=EXAMPLE,
    analytic=False,
)
