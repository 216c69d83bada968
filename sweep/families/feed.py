"""Registry entries of the feed rack: on a horizontal and a lift chain, or on three leads.

The three leads are the pin of the rocker and two eccentrics, each with a link to the rack.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from itertools import combinations

import numpy as np

from kernels.families import feed
from kernels.status import NO_EVENT, NOT_ASSEMBLED, NOT_CONVERGED, OK
from kernels.types import EPS, TWO_PI, Array
from sweep.families.base import (
    Accuracy,
    Angles,
    Columns,
    Family,
    Output,
    Parameter,
    Step,
    Work,
    about,
    floats,
    parameters_of,
)
from sweep.families.capabilities import Arm, Dimensions, Link, MovingPoint, Skeleton
from sweep.families.curve_features import Singular
from sweep.families.feed_trees import three_leads, two_leads
from sweep.families.outputs import joint_outputs, joint_rate_outputs, ladders
from sweep.families.parameter import PER_RADIAN
from sweep.families.poses import chosen, filled_all
from sweep.families.rssr import FAMILY as CRANK_ROCKER
from sweep.families.sites import AXES
from sweep.families.skeletons import COUPLER, CRANK, crank_axis, dimensions, links, moving, parameter, standing
from sweep.numerics.records import Indices, Mask
from sweep.numerics.singularities import dips, side_by_side

PARAMETERS = parameters_of("feed")

_WAYS = ("along the feed", "upwards")


def _place_of_tooth(equation: str) -> tuple[Output, ...]:
    return joint_outputs({"t": "tooth"}, equation, _WAYS)


POSE_OUTPUTS = (
    Output("psi_plus_dh", "rad", "direction of the arm to H", "(3)", wraps=True),
    Output("dpsi", "1", "its first derivative by phi", "(3)"),
    Output("d2psi", "1", "its second derivative", "(3)"),
    Output("chi", "rad", "angle of the rack", "(7)", wraps=True),
    Output("dchi", "1", "its first derivative by phi", "(8)"),
    Output("d2chi", "1", "its second derivative", "(8)"),
    *joint_outputs({"h": "pin H of the rack"}, "(4)", ("along x", "along y")),
    *joint_outputs({"e": "centre E of the lift eccentric"}, "(5)", ("along x", "along y")),
    *joint_outputs({"f": "joint F of the lift coupler"}, "(9)", ("along x", "along y")),
    *_place_of_tooth("(9)"),
    *joint_rate_outputs("t", "tooth", "(9)", _WAYS),
)

FEEDING_OUTPUTS = (
    Output("phi_entry", "rad", "event: crank angle at which the tooth rises through the plate, in [0, 2 pi)", "(11)"),
    Output("phi_leave", "rad", "event: crank angle at which it sinks through the plate, in [0, 2 pi)", "(11)"),
    Output("feed_angle", "rad", "crank angle from entry to leaving: time in the fabric times the speed", "(11)"),
    Output("entry_speed", PER_RADIAN, "dy_t at entry, per radian: times the speed it is that of the impact", "(12)"),
    Output("leave_speed", PER_RADIAN, "dy_t at leaving, per radian", "(12)"),
    Output("stitch_length", "length", "way of the tooth along the feed from entry to leaving, signed", "(13)"),
    Output("rise", "length", "greatest height of the tooth above the plate from entry to leaving", "(14)"),
    Output("flatness", "1", "area under the path over rise times stitch length: 1 for a rectangle", "(14)"),
    Output("crossings", "1", "passages of the plate per turn", "(11)", jumps=True),
)

_ENDS_OF_LIFT = ("x_h", "y_h", "x_e", "y_e")
_CLOSE = 0.3  # distance of a lock [rad] below which it is located better than samples show it
_LENGTHS = [k for k, p in enumerate(PARAMETERS) if p.unit == "length"]


def _poses(
    kernel: Callable[..., object], outputs: tuple[Output, ...], taken: tuple[str, ...],
    designs: Array, angles: Angles, wanted: frozenset[str],
) -> Columns:  # fmt: skip
    """Compute the wanted pose outputs and status of every design at its crank angles, each (n, m)."""
    given = designs, *(getattr(angles, name) for name in taken)
    status = np.empty((len(designs), angles.cos.shape[1]), np.uint8)
    return filled_all(kernel, given, tuple(o.name for o in outputs), wanted, status, np.result_type(*given))


poses = partial(_poses, feed.poses, POSE_OUTPUTS, ("cos", "sin"))


def _of_chain(parameters: tuple[Parameter, ...], designs: Array, angles: Angles, *names: str) -> list[Array]:
    """Compute outputs of the crank-rocker of the horizontal chain, (n, m) each."""
    own = np.column_stack([designs[:, [0, 1, 2, 3, 4, 5, 6]], parameter(parameters, "h_sigma", designs)])
    return CRANK_ROCKER.values(own, angles, *names)


def rocker_loop(parameters: tuple[Parameter, ...], designs: Array, angles: Angles, found: Columns) -> Array:
    """Discriminant of the horizontal chain, (n, m)."""
    return _of_chain(parameters, designs, angles, "discriminant")[0]


def chain_joints(parameters: tuple[Parameter, ...]) -> dict[str, MovingPoint]:
    """Points of the skeleton: crank pin and rocker ball of the horizontal chain."""

    def joint(name: str, designs: Array, angles: Angles, found: Columns) -> Array:
        return np.stack(_of_chain(parameters, designs, angles, *(f"{axis}_{name}" for axis in AXES)), axis=-1)

    return {name: MovingPoint((), partial(joint, name)) for name in "bc"}


CHAIN_LINKS = (CRANK, COUPLER, Link("rocker", ("d", "c", "h")))


def lift_loop(designs: Array, angles: Angles, found: Columns) -> Array:
    """Compute Heron's product of the triangle H, E, F, (n, m): 16 times its squared area."""
    x_h, y_h, x_e, y_e = floats(found, *_ENDS_OF_LIFT)
    q, fx, fy = dimensions(PARAMETERS, designs, "q", "fx", "fy")
    w, f = np.hypot(x_h - x_e, y_h - y_e), np.hypot(fx, fy)
    product: Array = ((w + f) - q) * ((w + f) + q) * (q - (w - f)) * (q + (w - f))
    return product


def _locks(designs: Array, angles: Angles) -> tuple[Array, Array]:
    """Shares of the discriminants in their terms, of rocker and rack, (n, m): 0 where a loop locks."""
    found = poses(designs, angles, frozenset(_ENDS_OF_LIFT))
    x_h, y_h, x_e, y_e = floats(found, *_ENDS_OF_LIFT)
    q, fx, fy = dimensions(PARAMETERS, designs, "q", "fx", "fy")
    rack = lift_loop(designs, angles, found) / (np.hypot(x_h - x_e, y_h - y_e) + np.hypot(fx, fy) + q) ** 4
    h_b, h_c = dimensions(PARAMETERS, designs, "h_b", "h_c")
    return rocker_loop(PARAMETERS, designs, angles, found) / (2.0 * h_b * h_c) ** 2, rack


def _amplified(designs: Array, entry: Array, leave: Array) -> Array:
    """Factor by which rounding grows near a lock at entry, at leaving, and at most on the way between them, (n, 3)."""

    def share(loop: int, rows: Indices, phi: Array) -> Array:
        return _locks(designs[rows], Angles.of(phi))[loop]

    near = side_by_side([dips(partial(share, loop), len(designs), loop, _CLOSE) for loop in range(2)])
    phi = np.column_stack([entry, leave, near.phi])
    rocker, rack = (1.0 / np.sqrt(np.fmax(share, 0.0)) for share in _locks(designs, Angles.of(phi)))
    found = 1.0 + rocker + rack
    passed = np.mod(phi - entry[:, None], TWO_PI) <= np.mod(leave - entry, TWO_PI)[:, None]
    passed[:, :2] = True
    return np.column_stack([found[:, :2], np.where(passed, found, 1.0).max(axis=1)])


def _errors(designs: Array, columns: dict[str, Array], area_error: Array) -> dict[str, Array]:
    """Estimate the errors of `FEEDING_OUTPUTS`, (n,) each, from the rounding of the path of a tooth.

    Near a lock a place loses digits like the inverse root of a discriminant, and a speed twice as many.
    """
    size = np.abs(designs[:, _LENGTHS]).sum(axis=1)
    ends = np.column_stack([columns["phi_entry"], columns["phi_leave"]])
    near_one = designs.copy()
    near_one[:, _LENGTHS] = np.ldexp(designs[:, _LENGTHS], -np.frexp(size)[1][:, None])
    grown = _amplified(near_one, *ends.T)
    place = EPS * size[:, None] * (16.0 + 4.0 * grown)
    at = poses(designs, Angles.of(ends), frozenset(("dpsi", "dchi", "dx_t", "dy_t", "d2y_t")))
    dpsi, dchi, dx, dy, d2y = (np.abs(x) for x in floats(at, "dpsi", "dchi", "dx_t", "dy_t", "d2y_t"))
    angle = place[:, :2] / dy
    speed = place[:, :2] + 4.0 * EPS * size[:, None] * (1.0 + dpsi + dchi) * grown[:, :2] ** 2 + angle * d2y
    stitch, rise = (place[:, :2] + angle * dx).sum(axis=1), place[:, 2]
    longest = np.abs(columns["stitch_length"])
    flat = np.fmax(np.abs(columns["flatness"]), 1.0) * (rise / columns["rise"] + stitch / longest)
    return {
        "phi_entry": angle[:, 0], "phi_leave": angle[:, 1], "feed_angle": angle.sum(axis=1),
        "entry_speed": speed[:, 0], "leave_speed": speed[:, 1], "stitch_length": stitch, "rise": rise,
        "flatness": flat + rise * size / (columns["rise"] * longest) + area_error, "crossings": np.zeros(len(designs)),
    }  # fmt: skip


def events(designs: Array, wanted: frozenset[str], accuracy: Accuracy) -> Columns:
    """Compute entry, leaving and feed between them, with errors estimated from the rounding of a tooth's path."""
    status, values = np.empty(len(designs), np.uint8), np.empty((len(FEEDING_OUTPUTS) + 1, len(designs)))
    feed.feeding(designs, status, values)
    *events, area_error = values
    columns: dict[str, Array] = {o.name: x for o, x in zip(FEEDING_OUTPUTS, events, strict=True)}
    feeds = np.flatnonzero(status == OK)
    with np.errstate(all="ignore"):
        known = _errors(designs[feeds], {name: x[feeds] for name, x in columns.items()}, area_error[feeds])
    errors = {name: np.full(len(designs), np.nan) for name in known}
    for name, error in known.items():
        errors[name][feeds] = error
    errors["crossings"][:] = 0.0
    if "flatness" in wanted:  # a path that the tooth retraces encloses no area
        retraced = (status == OK) & (columns["stitch_length"] == 0.0)
        status[retraced], columns["flatness"][retraced] = NO_EVENT, np.nan
    return chosen(columns | {f"err_{name}": error for name, error in errors.items()}, wanted, status)


SKELETON = Skeleton(
    {
        "a": crank_axis(PARAMETERS, "h_f", "h_alpha"), "d": standing(PARAMETERS, "h_e"),
        "l": standing(PARAMETERS, "xE", "yE"),
    },
    (
        *CHAIN_LINKS, Link("eccentric", ("l", "e")),
        Link("lift coupler", ("e", "f")), Link("rack", ("h", "f", "t")),
    ),
    chain_joints(PARAMETERS),
)  # fmt: skip
_RACK = ("fx", "fy")
SIZES = Dimensions((*links("h_a h_b h_c rh q"), _RACK), optional=("rE",), arms=(Arm(("tx", "ty"), _RACK),))

FAMILY = Family(
    **about("feed"),
    parameters=PARAMETERS,
    position="x_t",
    pose_outputs=POSE_OUTPUTS,
    poses=poses,
    steps=(Step("feeding", FEEDING_OUTPUTS, events, work=Work.LONG),),
    derivative_of={"psi_plus_dh": "dpsi", "dpsi": "d2psi"} | ladders("chi", "x_t", "y_t", orders=2),
    points={k: (f"x_{k}", f"y_{k}", None) for k in ("h", "e", "f", "t")},
    capabilities=(
        Singular(partial(rocker_loop, PARAMETERS)),
        Singular(lift_loop, _ENDS_OF_LIFT),
        SIZES,
        two_leads(PARAMETERS),
        SKELETON,
    ),
)  # fmt: skip


TRIAD_PARAMETERS = parameters_of("feed_triad")

TRIAD_OUTPUTS = (
    *_place_of_tooth("(15)"),
    Output("chi", "rad", "angle of the rack", "(15)", wraps=True),
    *joint_rate_outputs("t", "tooth", "(16)", _WAYS, (1,)),
    Output("dchi", "1", "first derivative of chi by phi", "(16)"),
    *joint_rate_outputs("t", "tooth", "(17)", _WAYS, (2,)),
    Output("d2chi", "1", "second derivative of chi", "(17)"),
    Output("determinant", "length^4", "of the closures: zero where the three leads lock", "(16)"),
)


def rocker_pin(designs: Array, angles: Angles, found: Columns) -> Array:
    """Compute the point H on the arm of the horizontal chain's rocker, (n, m, 3)."""
    (psi,) = _of_chain(TRIAD_PARAMETERS, designs, angles, "psi")
    e, arm, ahead = dimensions(TRIAD_PARAMETERS, designs, "h_e", "rh", "dh")
    return np.stack([e + arm * np.cos(psi + ahead), arm * np.sin(psi + ahead), 0.0 * psi], axis=-1)


def _on_circle(angles: Angles, x: Array, y: Array, radius: Array, ahead: Array) -> tuple[Array, Array]:
    return x + radius * np.cos(angles.phi + ahead), y + radius * np.sin(angles.phi + ahead)


def eccentric(number: int) -> MovingPoint:
    """Point of the skeleton: centre of an eccentric."""
    sizes = " ".join(f"{name}{number}" for name in ("xE", "yE", "rE", "dE"))
    return moving(TRIAD_PARAMETERS, sizes, (), _on_circle)


def _on_rack(angles: Angles, along: Array, across: Array, x: Array, y: Array, chi: Array) -> tuple[Array, Array]:
    cos, sin = np.cos(chi), np.sin(chi)
    return x + along * cos - across * sin, y + along * sin + across * cos


def rack_joint(number: int) -> MovingPoint:
    """Point of the skeleton: joint of a link on the rack."""
    return moving(TRIAD_PARAMETERS, f"f{number}x f{number}y", ("x_t", "y_t", "chi"), _on_rack)


_SURELY = 1e-6  # relative excess of a side over the sum of the others, above rounding of a rocker pin


def _apart(designs: Array) -> Mask:
    """Whether designs cannot assemble at phi = 0: two links, rack and leads do not close from any initial guess."""
    start = Angles.of(np.zeros((1, 1)))
    leads = [at(designs, start, {})[:, 0] for at in (rocker_pin, eccentric(2).at, eccentric(3).at)]
    x, y, q = ([dimensions(TRIAD_PARAMETERS, designs, name.format(k))[0] for k in (1, 2, 3)]
               for name in ("f{}x", "f{}y", "q{}"))  # fmt: skip
    apart = np.zeros(len(designs), np.bool_)
    for i, j in combinations(range(3), 2):
        distance = np.linalg.norm(leads[i] - leads[j], axis=1, keepdims=True)
        sides = np.sort(np.hstack([distance, np.hypot(x[i] - x[j], y[i] - y[j]), q[i], q[j]]), axis=1)
        apart |= sides[:, 3] > (1.0 + _SURELY) * sides[:, :3].sum(axis=1)
    return apart


def triad_poses(designs: Array, angles: Angles, wanted: frozenset[str]) -> Columns:
    """Compute the wanted pose outputs and status; designs with two leads too far apart are NOT_ASSEMBLED."""
    columns = _poses(feed.triad_poses, TRIAD_OUTPUTS, ("phi",), designs, angles, wanted)
    lost = columns["status"] == NOT_CONVERGED
    rows = np.flatnonzero(lost.any(axis=1))
    if rows.size:
        lost[rows] &= _apart(designs[rows].real)[:, None]
        columns["status"][lost] = NOT_ASSEMBLED
    return columns


TRIAD = Family(
    **about("feed_triad"),
    parameters=TRIAD_PARAMETERS,
    position="x_t",
    pose_outputs=TRIAD_OUTPUTS,
    poses=triad_poses,
    uses_phi=True,
    derivative_of=ladders("x_t", "y_t", "chi", orders=2),
    points={"t": ("x_t", "y_t", None)},
    capabilities=(
        Singular(partial(rocker_loop, TRIAD_PARAMETERS)),
        Singular.where_small("determinant"),
        Dimensions(links("h_a h_b h_c rh q1 q2 q3"), optional=("rE2", "rE3")),
        three_leads(TRIAD_PARAMETERS),
        Skeleton(
            {
                "a": crank_axis(TRIAD_PARAMETERS, "h_f", "h_alpha"), "d": standing(TRIAD_PARAMETERS, "h_e"),
                "l2": standing(TRIAD_PARAMETERS, "xE2", "yE2"), "l3": standing(TRIAD_PARAMETERS, "xE3", "yE3"),
            },
            (
                *CHAIN_LINKS, Link("eccentric 2", ("l2", "e2")), Link("eccentric 3", ("l3", "e3")),
                Link("link 1", ("h", "f1")), Link("link 2", ("e2", "f2")), Link("link 3", ("e3", "f3")),
                Link("rack", ("f1", "f2", "f3", "t")),
            ),
            chain_joints(TRIAD_PARAMETERS) | {
                "h": MovingPoint((), rocker_pin), "e2": eccentric(2), "e3": eccentric(3),
                "f1": rack_joint(1), "f2": rack_joint(2), "f3": rack_joint(3),
            },
        ),
    ),
)  # fmt: skip
