"""Registry entry of the presser foot on a rack that rises harmonically."""

from __future__ import annotations

import numpy as np

from kernels.effects.foot import OUTPUTS as _EVENTS
from kernels.effects.foot import march
from kernels.effects.foot_fabric import march_on_fabric
from kernels.families import foot
from kernels.families.foot.harmonic import OUTPUTS as _CLOSED
from kernels.status import NO_EVENT, OK
from sweep.families.base import Accuracy, Angles, Array, Columns, Family, Output, Parameter, Step, Work, guarded
from sweep.families.capabilities import Link, Made, Skeleton
from sweep.families.domain import March
from sweep.families.skeletons import Y as UPWARDS
from sweep.families.skeletons import parameter, standing

FOOT = (
    Parameter("m", "mass", "foot with its bar", positive=True),
    Parameter("k", "stiffness", "spring of the foot", not_negative=True),
    Parameter("F0", "force", "preload of the spring with the foot on the plate, weight included", positive=True),
    Parameter("omega", "speed", "speed of the crank", positive=True),
)
RESTITUTION = Parameter("restitution", "ratio", "of the foot against rack and plate, below 1; 0 does not bounce",
                        default=0.0, not_negative=True)  # fmt: skip

FABRIC = (
    Parameter("kf", "stiffness", "of the fabric between foot and ground; 0: rigid", default=0.0, not_negative=True),
    Parameter("cf", "damping", "of the fabric, which takes the place of restitution", default=0.0, not_negative=True),
)

PARAMETERS = (
    *FOOT,
    Parameter("Y", "length", "amplitude of the rack's height", positive=True),
    Parameter("p", "length", "depth of the rack's middle below the plate"),
    RESTITUTION,
    Parameter("X", "length", "half of the rack's travel along the feed", default=0.0),
    *FABRIC,
)

CLOSED_OUTPUTS = (
    Output("x0", "rad", "event: crank angle at which the rack rises through the plate", "(1)"),
    Output("v_entry", "length/time", "speed of the rack there", "(1)"),
    Output("omega_n", "rad/s", "natural frequency of foot and spring", "(2)"),
    Output("jump_height_free", "length", "height of the first jump, if nothing is met", "(6)"),
    Output("flight_time_free", "time", "its time until the plate level, if nothing is met before", "(6)"),
    Output("k_min_contact", "force/length", "spring that keeps contact at the top", "(3)"),
    Output("F0_min_contact", "N", "preload that keeps contact at entry", "(3)"),
    Output("N_at_entry", "N", "contact force at entry, if the foot follows the rack", "(2)"),
    Output("N_at_top", "N", "contact force at the top, if the foot follows the rack", "(2)"),
    Output("t_recontact", "time", "until the foot first meets rack or plate again; nan without a rebound", "(6)"),
)

POSE_OUTPUTS = (
    Output("y_rack", "length", "height of the rack above the plate", "(1)"),
    Output("y_foot", "length", "height of the foot above the plate", "(6)"),
    Output("force", "N", "between the foot and rack or plate; 0 in flight", "(5)"),
)

EVENT_OUTPUTS = (
    Output("flights", "1", "how often contact is lost in a turn, bounces included", "(10)", jumps=True),
    Output("phi_loss", "rad", "event: crank angle at which contact is first lost, in [0, 2 pi); nan if never", "(5)"),
    Output("phi_land", "rad", "event: crank angle at which that flight ends, in [0, 2 pi)", "(7)"),
    Output("lost_angle", "rad", "crank angle per turn in flight while the rack is above the plate", "(10)"),
    Output("lost_travel", "length", "way of the rack along the feed meanwhile", "(11)"),
    Output("stitch_error", "1", "lost_travel over the way of the rack above the plate", "(11)"),
    Output("impact_speed", "length/time", "greatest relative speed of an impact in a turn", "(7)"),
    Output("impulse", "N*s", "greatest impulse of an impact in a turn", "(9)"),
    Output("least_force", "N", "least contact force above the plate, if the foot follows the rack; (5) at the nodes; "
           "on fabric the least of the march", "(5), (14)"),
    Output("most_force", "N", "greatest force between the foot and rack or plate, impacts apart", "(5)"),
    Output("settled", "1", "1 if the foot lies on the plate when the rack is lowest: every turn is alike", "(12)",
           jumps=True),
)  # fmt: skip

TURNS = 4
NODES = 720
FEET = [0, 1, 2, 3, 6, 8, 9]  # columns of what the march takes


def marched(path: Array, feet: Array) -> tuple[Columns, Array, Array]:
    """Return events, status and the heights and forces at the nodes of the last turn.

    ``feet`` (n, 7) are mass, spring, preload, speed, restitution, stiffness and damping of the fabric.
    """
    n = len(path)
    status, values = np.empty(n, np.uint8), np.empty((len(_EVENTS), n))
    heights, forces = np.empty((n, path.shape[2])), np.empty((n, path.shape[2]))
    soft = (feet[:, 5] != 0.0) | (feet[:, 6] != 0.0)
    for rows, kernel, count in ((~soft, march, 5), (soft, march_on_fabric, 7)):
        if rows.any():
            room = status[rows], values[:, rows], heights[rows], forces[rows]
            kernel(path[rows], np.ascontiguousarray(feet[rows, :count]), TURNS, *room)
            status[rows], values[:, rows], heights[rows], forces[rows] = room
    columns: dict[str, Array] = dict(zip(_EVENTS, values, strict=True))
    travel = columns.pop("travel")
    with np.errstate(all="ignore"):
        columns["stitch_error"] = np.where(travel != 0.0, columns["lost_travel"] / travel, np.nan)
    return columns | {"status": status}, heights, forces


def nodes_for(poses: int) -> tuple[int, int]:
    """Return how many nodes are marched for so many poses of a turn, and how many nodes apart the poses stand."""
    apart = -(-NODES // poses)
    return poses * apart, apart


def chosen(columns: Columns, wanted: frozenset[str]) -> Columns:
    """Return the wanted columns and the status: NO_EVENT where one of them is about an event that does not happen."""
    found = {name: x for name, x in columns.items() if name in wanted}
    status = np.array(columns["status"], np.uint8)
    for values in found.values():
        status[(status == OK) & np.isnan(values)] = NO_EVENT
    return found | {"status": status}


def path_of(designs: Array, nodes: int) -> Array:
    """Return the path of the rack at so many equal crank angles, (n, 6, nodes)."""
    path = np.empty((len(designs), 6, nodes))
    foot.rack_path(designs, path)
    return path


def poses(designs: Array, angles: Angles, wanted: frozenset[str]) -> Columns:
    """Return the wanted pose outputs and status of every design over one turn in equal steps from 0, each (n, m)."""
    nodes, apart = nodes_for(angles.phi.shape[1])
    path = path_of(designs, nodes)
    columns, heights, forces = marched(path, designs[:, FEET])
    found: Columns = {"y_rack": path[:, 0, ::apart], "y_foot": heights[:, ::apart], "force": forces[:, ::apart]}
    status = np.repeat(np.asarray(columns["status"], np.uint8)[:, None], angles.phi.shape[1], axis=1)
    return {name: x for name, x in found.items() if name in wanted} | {"status": status}


def closed(designs: Array, wanted: frozenset[str], accuracy: Accuracy) -> Columns:
    """Return the entry, first jump, limits of spring and preload."""
    status, values = np.empty(len(designs), np.uint8), np.empty((len(_CLOSED), len(designs)))
    foot.closed_forms(designs, status, values)
    columns: Columns = dict(zip(_CLOSED, values, strict=True))
    return chosen(columns | {"status": status}, wanted)


def events(designs: Array, wanted: frozenset[str], accuracy: Accuracy) -> Columns:
    """Return the loss of contact, landing, impacts and what they cost, of the last turn marched."""
    columns, _, _ = marched(path_of(designs, NODES), designs[:, FEET])
    return chosen(columns, wanted)


def foot_place(designs: Array, angles: Angles, found: Columns) -> Array:
    """Return the foot, above the middle of the rack's travel."""
    y = np.asarray(found["y_foot"], np.float64)
    return np.stack([0.0 * y, y, 0.0 * y], axis=-1)


def rack_place(designs: Array, angles: Angles, found: Columns) -> Array:
    """Return the rack's tooth."""
    y = np.asarray(found["y_rack"], np.float64)
    return np.stack([-parameter(PARAMETERS, "X", designs)[:, None] * np.cos(angles.phi) + 0.0 * y, y, 0.0 * y], axis=-1)


EXAMPLE = {"m": 0.05, "k": 3000.0, "F0": 6.0, "omega": 400.0, "Y": 1.5e-3, "p": 0.5e-3, "X": 1e-3}


FAMILY = Family(
    name="foot",
    title="presser foot on a harmonic rack",
    parameters=PARAMETERS,
    position="y_foot",
    pose_outputs=POSE_OUTPUTS,
    poses=guarded(poses),
    domain=March(turns=TURNS),
    steps=(
        Step("closed forms", CLOSED_OUTPUTS, closed, work=Work.LONG),
        Step("march", EVENT_OUTPUTS, events, work=Work.LONG),
    ),
    example=EXAMPLE,
    analytic=False,
    capabilities=(
        Skeleton(
            {"d": standing(PARAMETERS, axis=UPWARDS, kind="slide")},
            (Link("foot", ("p",)), Link("rack", ("t",))),
            {"p": Made(("y_foot",), foot_place), "t": Made(("y_rack",), rack_place)},
        ),
    ),
)
