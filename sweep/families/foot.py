"""Registry entries of the presser foot: on a rack that rises harmonically, or on the rack of a feed mechanism."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial

import numpy as np

from kernels.effects.foot import OUTPUTS as _EVENTS
from kernels.effects.foot_fabric import march
from kernels.families import foot
from kernels.status import NO_EVENT, OK
from kernels.types import TWO_PI, Array
from sweep.families import feed
from sweep.families.base import (
    Accuracy,
    Angles,
    Columns,
    Family,
    March,
    Output,
    Step,
    Work,
    about,
    floats,
    parameters_of,
)
from sweep.families.capabilities import Fixed, Link, MovingPoint, PresserFoot, Skeleton
from sweep.families.poses import chosen, equal_steps, guarded
from sweep.families.skeletons import Y as UPWARDS
from sweep.families.skeletons import moving, standing
from sweep.numerics.events import FLAT, bottoms, zeros
from sweep.numerics.records import Indices

PARAMETERS = parameters_of("foot")

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
    Output("drive_torque", "torque", "that the foot asks of the crank, impacts apart: force times dy_rack", "(17)"),
    Output("shaking_force_y", "force", "force of foot, spring and rack on the frame, upwards; weight and impacts apart",
           "(17)"),
)  # fmt: skip

EVENT_OUTPUTS = (
    Output("flights", "1", "how often contact is lost in a turn, bounces included", "(10)", jumps=True),
    Output("phi_loss", "rad", "event: crank angle at which contact is first lost, in [0, 2 pi); nan if never", "(5)"),
    Output("phi_land", "rad", "event: crank angle at which that flight ends, in [0, 2 pi)", "(7)"),
    Output("lost_angle", "rad", "crank angle per turn in flight while the rack is above the plate", "(10)"),
    Output("lost_travel", "length", "way of the rack along the feed meanwhile", "(11)"),
    Output("stitch_error", "1", "lost_travel over the way of the rack above the plate", "(11)"),
    Output("impact_speed", "length/time", "greatest relative speed of an impact in a turn", "(7)"),
    Output("impulse", "N*s", "greatest impulse of an impact in a turn", "(9)"),
    Output("least_force", "N", "least contact force above the plate, if the foot follows the rack; on fabric the least "
           "of the march", "(5), (14)"),
    Output("most_force", "N", "greatest force between the foot and rack or plate, impacts apart", "(5)"),
    Output("settled", "1", "1 if the foot lies on the plate when the rack is lowest: every turn is alike", "(12)",
           jumps=True),
)  # fmt: skip

TURNS = 4
NODES = 720
CHANGES = 128  # changes of contact in a turn that are recorded: bounces with a restitution of 0.7 need as many
FEET = [0, 1, 2, 3, 6, 8, 9]  # columns of the march's inputs
NEXT_TO_PLATE = 1e-7  # share of the rack's rise below which rounding of a force over the height is no spring


def marched(path: Array, feet: Array) -> tuple[Columns, Array, Array]:
    """Compute events, changes and status, and the heights and forces at the nodes of the last turn.

    ``feet`` (n, 7) are mass, spring, preload, speed, restitution, stiffness and damping of the fabric.
    """
    n = len(path)
    status, values = np.empty(n, np.uint8), np.empty((len(_EVENTS), n))
    heights, forces = np.empty((n, path.shape[2])), np.empty((n, path.shape[2]))
    changes = np.empty((n, 1 + 2 * CHANGES))
    march(path, np.ascontiguousarray(feet), TURNS, status, values, heights, forces, changes)
    columns: dict[str, Array] = dict(zip(_EVENTS, values, strict=True))
    travel = columns.pop("travel")
    with np.errstate(all="ignore"):
        error = columns["lost_travel"] / travel + 0.0  # nothing lost of a travel backwards is 0, not -0
        columns["stitch_error"] = np.where(travel != 0.0, error, np.nan)
    return columns | {"changes": changes, "status": status}, heights, forces


def happening(columns: Columns, wanted: frozenset[str]) -> Columns:
    """Select the wanted columns; status NO_EVENT where one of them belongs to an event that does not occur."""
    status = np.array(columns["status"], np.uint8)
    for name in wanted:
        status[(status == OK) & np.isnan(columns[name])] = NO_EVENT
    return chosen(columns, wanted, status)


def pose_columns(designs: Array, path: Array, heights: Array, forces: Array, apart: int) -> Columns:
    """Compute pose outputs at every ``apart``-th node; ``designs`` are m, k, F0; (17)."""
    _, k, preload = (designs[:, j, None] for j in range(3))
    return {
        "y_rack": path[:, 0, ::apart],
        "x_rack": path[:, 3, ::apart],
        "y_foot": heights[:, ::apart],
        "force": forces[:, ::apart],
        "drive_torque": np.where(path[:, 0] > 0.0, forces * path[:, 1], 0.0)[:, ::apart],
        "shaking_force_y": (preload + k * heights - forces)[:, ::apart],
    }


def path_of(designs: Array, nodes: int) -> Array:
    """Path of the rack at ``nodes`` equal crank angles, (n, 6, nodes)."""
    path = np.empty((len(designs), 6, nodes))
    foot.rack_path(designs, path)
    return path


Marched = tuple[Columns, Array, Array, Array]


def on_rack(designs: Array, nodes: int) -> Marched:
    """March on a harmonic rack: events with the status, path of the rack, heights and forces at the nodes."""
    path = path_of(designs, nodes)
    columns, heights, forces = marched(path, designs[:, FEET])
    return columns, path, heights, forces


def _poses(
    run: Callable[[Array, int], Marched], feet: list[int], designs: Array, angles: Angles, wanted: frozenset[str]
) -> Columns:
    """Compute the wanted pose outputs and status of every design over one turn in equal steps from 0, each (n, m)."""
    poses = angles.phi.shape[1]
    apart = -(-NODES // poses)  # nodes from pose to pose
    columns, path, heights, forces = run(designs, poses * apart)
    found = pose_columns(designs[:, feet], path, heights, forces, apart)
    status = np.repeat(np.asarray(columns["status"], np.uint8)[:, None], poses, axis=1)
    return chosen(found, wanted, status)


def closed(designs: Array, wanted: frozenset[str], accuracy: Accuracy) -> Columns:
    """Compute entry, first jump, and limits of spring and preload in closed form."""
    status, values = np.empty(len(designs), np.uint8), np.empty((len(CLOSED_OUTPUTS), len(designs)))
    foot.closed_forms(designs, status, values)
    columns: Columns = {o.name: x for o, x in zip(CLOSED_OUTPUTS, values, strict=True)}
    return happening(columns | {"status": status}, wanted)


def _events(
    run: Callable[[Array, int], Marched], designs: Array, wanted: frozenset[str], accuracy: Accuracy
) -> Columns:
    """Compute loss of contact, landing, impacts and lost feed of the last turn marched."""
    return happening(run(designs, NODES)[0], wanted)


def foot_place(angles: Angles, y: Array) -> tuple[Array, Array]:
    """Point of the foot, above the middle of the rack's travel."""
    return 0.0 * y, y


def rack_place(angles: Angles, half: Array, y: Array) -> tuple[Array, Array]:
    """Point of the rack's tooth."""
    return -half * np.cos(angles.phi), y


FAMILY = Family(
    **about("foot"),
    parameters=PARAMETERS,
    position="y_foot",
    pose_outputs=POSE_OUTPUTS,
    poses=guarded(partial(_poses, on_rack, FEET)),
    domain=March(turns=TURNS),
    steps=(
        Step("closed forms", CLOSED_OUTPUTS, closed, work=Work.LONG),
        Step("march", EVENT_OUTPUTS, partial(_events, on_rack), work=Work.LONG),
    ),
    analytic=False,
    capabilities=(
        PresserFoot(on_rack, NODES, EVENT_OUTPUTS),
        Skeleton(
            {"d": standing(PARAMETERS, axis=UPWARDS, kind="slide")},
            (Link("foot", ("p",)), Link("rack", ("t",))),
            {
                "p": moving(PARAMETERS, "", ("y_foot",), foot_place),
                "t": moving(PARAMETERS, "X", ("y_rack",), rack_place),
            },
        ),
    ),
)


FEED_PARAMETERS = parameters_of("feed_foot")
_RACK_COLUMNS = len(feed.PARAMETERS)
_FEET = list(range(_RACK_COLUMNS, len(FEED_PARAMETERS)))
_PLATE = feed.FAMILY.parameter_names.index("y_plate")
_PATH = ("y_t", "dy_t", "d2y_t", "x_t", "dx_t", "d2x_t")


def feed_path(designs: Array, nodes: int, sense: int = 1) -> tuple[Array, np.ndarray]:
    """Compute the tooth's path above the plate at equal crank angles, (n, 6, nodes), and the linkage's status."""
    phi = sense * equal_steps(FAMILY.domain, designs, nodes)[None, :]
    rack = np.ascontiguousarray(designs[:, :_RACK_COLUMNS])
    found = feed.poses(rack, Angles.of(phi), frozenset(_PATH))
    path, status = np.stack(floats(found, *_PATH), axis=1), np.asarray(found["status"], np.uint8)
    path[:, 0] -= rack[:, _PLATE, None]
    path[:, [1, 4]] *= sense
    # the first pose that is not ok determines the status of the turn
    worst = np.take_along_axis(status, np.argmax(status != 0, axis=1)[:, None], axis=1)[:, 0]
    return path, worst


def on_feed(designs: Array, nodes: int, sense: int = 1) -> Marched:
    """March as :func:`on_rack` on the rack of a feed mechanism; a backward crank is marched over minus its angle."""
    path, linkage = feed_path(designs, nodes, sense)
    columns, heights, forces = marched(path, designs[:, _FEET])
    # A rack that does not assemble has no path: the linkage's status replaces that of the march.
    columns["status"] = np.where(linkage != 0, linkage, columns["status"]).astype(np.uint8)
    return columns, path, heights, forces


def contact(designs: Array, wanted: frozenset[str], accuracy: Accuracy) -> Columns:
    """Compute the softest spring and least preload that keep a rigid foot on the rack all the time above the plate."""
    mass, _, preload, omega = designs[:, _FEET[:4], None].transpose(1, 0, 2)
    unit, rack = mass * omega * omega, np.ascontiguousarray(designs[:, :_RACK_COLUMNS])
    phi = TWO_PI / NODES * np.arange(-1.0, NODES + 1.0)
    path, status = feed_path(designs, NODES)
    lowest = NEXT_TO_PLATE * path[:, 0].max(axis=1, keepdims=True)

    def springs(rows: Indices, height: Array, bend: Array) -> Array:
        with np.errstate(all="ignore"):
            needed = (-unit[rows] * bend - preload[rows]) / height
        return np.where(height > lowest[rows], needed, -np.inf)

    def look(rows: Indices, phi: Array) -> tuple[Array, Array]:
        y, bend = feed.FAMILY.values(rack[rows], Angles.of(phi), "y_t", "d2y_t")
        return y - rack[rows, _PLATE, None], bend

    above = (path[:, 0] > 0.0) & (status == OK)[:, None]
    nodes = springs(np.arange(len(designs)), path[:, 0], path[:, 2])
    row, column = np.nonzero(above != np.roll(above, -1, axis=1))
    passed = zeros(lambda k, at: look(row[k], at[:, None])[0][:, 0], phi[column + 1], phi[column + 2])
    least, softest = np.full((len(designs), 1), np.nan), np.zeros((len(designs), 1))
    least[row] = 0.0
    np.maximum.at(least, row, -unit[row] * look(row, passed[:, None])[1])
    # of nearly equal tops the higher one may lie between lower nodes
    row, column = np.nonzero(above & (nodes >= np.roll(nodes, 1, axis=1)) & (nodes >= np.roll(nodes, -1, axis=1)))
    top = bottoms(lambda at: -springs(row, *look(row, at)), phi[column], phi[column + 2], FLAT)
    np.maximum.at(softest, row, springs(row, *look(row, top[:, None])))
    softest[~(preload >= least)] = np.nan
    return happening({"k_min_contact": softest[:, 0], "F0_min_contact": least[:, 0], "status": status}, wanted)


def feeding(designs: Array, wanted: frozenset[str], accuracy: Accuracy) -> Columns:
    """Compute entry, leaving and path of the tooth, as for the rack alone."""
    return feed.events(np.ascontiguousarray(designs[:, :_RACK_COLUMNS]), wanted, accuracy)


def _rack(designs: Array, angles: Angles, *names: str) -> list[Array]:
    return feed.FAMILY.values(np.ascontiguousarray(designs[:, :_RACK_COLUMNS]), angles, *names)


def of_rack(joint: str) -> MovingPoint:
    """Point of the skeleton: joint of the feed mechanism."""

    def at(designs: Array, angles: Angles, found: Columns) -> Array:
        x, y = _rack(designs, angles, f"x_{joint}", f"y_{joint}")
        return np.stack([x, y, 0.0 * x], axis=-1)

    return MovingPoint((), at)


def plate(designs: Array) -> Array:
    """Return the place of the foot on the needle plate, above the tooth at phi = 0."""
    (x,) = _rack(designs, Angles.of(np.zeros((1, 1))), "x_t")
    return np.stack([x[:, 0], designs[:, _PLATE], 0.0 * x[:, 0]], axis=1)


def feed_foot_place(designs: Array, angles: Angles, found: Columns) -> Array:
    """Compute the point of the foot, (n, m, 3)."""
    y = np.asarray(found["y_foot"], np.float64)
    return plate(designs)[:, None, :] + np.stack([0.0 * y, y, 0.0 * y], axis=-1)


CONTACT_OUTPUTS = (
    Output("k_min_contact", "force/length", "softest spring that keeps contact with this preload, rigid ground; nan if "
           "none does, for want of preload", "(3)"),
    Output("F0_min_contact", "N", "least preload that keeps contact at every passage of the plate, rigid ground",
           "(3)"),
)  # fmt: skip


ON_FEED = Family(
    **about("feed_foot"),
    parameters=FEED_PARAMETERS,
    position="y_foot",
    pose_outputs=(*POSE_OUTPUTS, Output("x_rack", "length", "tooth, along the feed", "(11)")),
    poses=guarded(partial(_poses, on_feed, _FEET)),
    domain=March(turns=TURNS),
    steps=(
        Step("feeding", feed.FEEDING_OUTPUTS, feeding, work=Work.LONG),
        Step("contact", CONTACT_OUTPUTS, contact, work=Work.LONG),
        Step("march", EVENT_OUTPUTS, partial(_events, on_feed), work=Work.LONG),
    ),
    analytic=False,
    capabilities=(
        feed.SIZES,
        PresserFoot(on_feed, NODES, EVENT_OUTPUTS),
        Skeleton(
            dict(feed.SKELETON.fixed) | {"plate": Fixed(plate, standing(FEED_PARAMETERS, axis=UPWARDS).axis, "slide")},
            (*feed.SKELETON.links, Link("foot", ("p",))),
            feed.chain_joints(FEED_PARAMETERS)
            | {joint: of_rack(joint) for joint in ("h", "e", "f", "t")}
            | {"p": MovingPoint(("y_foot",), feed_foot_place)},
        ),
    ),
)
