"""Passage of a looper's tip past the needle at moment A, and the outputs evaluated there (machine-and-stitch, 5.2)."""

from __future__ import annotations

from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from kernels import status as st
from kernels.types import TWO_PI, Array
from sweep.families.base import Columns, Output, Step
from sweep.families.machines import crossings
from sweep.families.machines.moments import Taking
from sweep.families.machines.thread_way import turned as turned_back

if TYPE_CHECKING:
    from sweep.families.machines.machine import Machine

MEET = 1e-9  # rad of the tip's travel: axes closer than this meet, the accuracy of a minimum's place by quick poses
TEXTS = {
    "lag": ("rad", "crank angle from the needle's lowest point to the passage"),
    "rise": ("length", "rise of the needle at the passage since its lowest point"),
    "clearance": ("length", "side of the tip at the passage, less the distance from the axis to the scarf's floor"),
    "above_eye": ("length", "height of the tip above the eye at the passage; negative: below"),
    "below_scarf_end": ("length", "how far the tip passes below the upper end of the scarf"),
    "directness": ("1", "the tip's own passing as a share of its speed relative to the needle"),
    "overtravel": ("length", "how far the tip goes beyond the needle after the passage"),
    "gauge": ("length", "how far the tip stands before the needle where that is lowest"),
    "reach": ("length", "how far the tip stands before the needle where the looper reverses"),
    "back_side": ("length", "side of the tip where it passes the needle on its way back; negative: in front"),
    "back_height": ("length", "height of the tip above that of the passage where it passes back"),
    "free": ("length", "least gap between needle and blade while the needle goes down"),
}

WINDOW = {
    "least": ("length", "least rise that every field of work permits"),
    "most": ("length", "largest rise that every field of work permits"),
}


def taking_step(taking: Taking, machine: Machine) -> Step:
    """Make the machine's step to the passage of the tip and its outputs."""
    name = taking.name
    place = Output(
        f"phi_{name}", "rad", "crank angle at which the tip passes the needle, in its sense, beside it", "5.2"
    )
    count = Output(f"count_{name}", "1", "passages in the stated sense beside the needle", "5.2", jumps=True)
    texts = TEXTS | (WINDOW | {"room": ("length", taking.window.words)} if taking.window else {})
    provides = (place, count, *(Output(f"{name}_{key}", unit, text, "5.2") for key, (unit, text) in texts.items()))
    return crossings.step_of(name, provides, machine, partial(_found, taking), partial(_read, taking))


def passages(taking: Taking, machine: Machine, poses: crossings.Poses, samples: int) -> Columns:
    """Compute outputs of the passage that need no further search, each (n,), and status."""
    return _read(taking, machine, poses.designs, _found(taking, poses, samples, frozenset()), frozenset())


def _found(taking: Taking, poses: crossings.Poses, samples: int, wanted: frozenset[str]) -> crossings.Places:
    """Find the passage of the tip, the next one, and the places of the other outputs.

    Extrema of the tip's coordinate across the needle are found first, on a grid and then as roots of its derivative;
    between neighbours of opposite sign there is one passage.  A pair of extrema between two samples is missed.
    """
    name, sense, n = taking.name, float(taking.sense), len(poses.designs)
    at = _Tip(taking, poses)
    names = [f"{name}_{what}" for what in ("across", "dacross", "ddepth")]
    status, (x, dx, ddepth) = poses.samples(names, samples)
    status[(status == st.OK) & np.isnan(dx).any(axis=1)] = st.NO_FRAME
    x, dx, ddepth = (np.where((status == st.OK)[:, None], values, np.nan) for values in (x, dx, ddepth))
    stops, extremes = poses.turning(names[2], ddepth), poses.turning(names[1], dx)
    (depths,), (across,) = at(stops, "depth"), at(extremes, "across")
    roots = poses.roots(extremes, across, names[0], names[1], x)
    height, turned = at(roots, "height", "dacross")
    beside, right = taking.beside(height), sense * turned > 0.0
    count, ways = (np.bincount(roots.row, beside & one, n) for one in (right, ~right))
    found = crossings.verdict(status, at.touches(extremes, across), count, ways)
    taken = np.flatnonzero(beside & right & (found[roots.row] == st.OK))
    row, phi = roots.row[taken], roots.phi[taken]
    passage = crossings.scattered(n, row, phi)
    after = crossings.scattered(n, row, roots.phi[_following(roots, taken)])
    size = np.abs(poses.designs).max(axis=1)
    low = _last(stops, depths, size, passage)
    top = _last(stops, -depths, size, low)
    places: crossings.Places = {"at": passage, "after": after, "low": low, "top": low - np.mod(low - top, TWO_PI)}
    places["far"] = crossings.where_largest(extremes, -sense * across, n)
    lag = np.mod(extremes.phi - passage[extremes.row], TWO_PI)
    between = (lag <= np.mod(after - passage, TWO_PI)[extremes.row]) & (sense * across > 0.0)
    places["beyond"] = crossings.where_largest(extremes.take(between), sense * across[between], n)
    if f"{name}_free" in wanted:
        rows = np.flatnonzero(status == st.OK)
        places["near"] = crossings.scattered(n, rows, poses.least(rows, places["top"][rows], low[rows], f"{name}_gap"))
    return places | {"count": np.where(status == st.OK, count, np.nan), "status": found}


def _read(taking: Taking, machine: Machine, designs: Any, places: crossings.Places, wanted: frozenset[str]) -> Columns:
    """Evaluate all outputs of the passage, each (n,), and status; with complex designs the places move too."""
    name, sense = taking.name, float(taking.sense)
    status = np.array(places["status"])
    angles = {key: values for key, values in places.items() if key not in ("count", "status")}
    if np.iscomplexobj(designs):
        roots = {"at": "across", "after": "across", "low": "ddepth", "top": "ddepth"}
        before = np.stack([angles[key] for key in roots], axis=1)
        after = crossings.moved(machine, designs, before, [f"{name}_{what}" for what in roots.values()])
        now = dict(zip(roots, after.T, strict=True))
        for end in ("low", "top") if "near" in angles else ():  # a least gap at an end of the stroke moves with it
            now["near"] = np.where(places["near"] == places[end], now[end], now.get("near", places["near"]))
        angles |= now  # an extremum's value does not depend on the motion of its place
    del angles["top"]
    names = ["across", "side", "height", "dacross", "depth", "speed", *(["gap"] if "near" in angles else [])]
    found = crossings.outputs_at(machine, designs, angles, [f"{name}_{what}" for what in names])
    across, side, height, turned, depth, speed, *gap = (found[f"{name}_{what}"] for what in names)
    rise = depth["low"] - depth["at"]
    values = {
        "lag": turned_back(angles["at"] - angles["low"]),
        "rise": rise,
        "clearance": side["at"] - taking.needle.floor,
        "above_eye": taking.needle.eye - height["at"],
        "below_scarf_end": height["at"] - taking.needle.scarf_end,
        "directness": sense * turned["at"] / speed["at"],
        "back_side": side["after"],
        "back_height": height["at"] - height["after"],
        "overtravel": np.where(np.isnan(across["beyond"]), 0.0 * rise, sense * across["beyond"]),
        "gauge": -sense * across["low"],
        "reach": -sense * across["far"],
    }
    if taking.window:
        low, high = taking.window.ends(designs, machine.parameter_names)
        least, most = low.max(axis=1), high.min(axis=1)
        values |= {"least": least, "most": most, "room": np.minimum(rise - least, most - rise)}
        status[(status == st.OK) & (np.real(least) > np.real(most))] = st.NO_WINDOW
    if gap:
        free, radii = gap[0]["near"], sum(body.radius for body in taking.gap.bodies)
        # Axes that meet do so for every neighbouring design: the least gap is constant, and its slope is zero.
        values["free"] = np.where(np.real(free) + radii > MEET * np.real(speed["near"]), free, np.real(free))
    status[np.real(side["at"]) <= 0.0] = st.WRONG_SIDE
    columns: Columns = {f"phi_{name}": angles["at"], f"count_{name}": places["count"], "status": status}
    fast = np.fmax(np.real(speed["at"]), np.real(speed["after"]))
    columns["steep"] = crossings.steepness(fast, turned["at"], turned["after"])
    return columns | {f"{name}_{key}": value for key, value in values.items()}


class _Tip:
    """Coordinates of the tip in the needle's frame, at given crank angles of several designs."""

    def __init__(self, taking: Taking, poses: crossings.Poses) -> None:
        self.taking, self.poses = taking, poses

    def __call__(self, where: crossings.CrankAngles, *what: str) -> list[Array]:
        """Evaluate outputs by their own names."""
        return self.poses.at(where.row, where.phi, *(f"{self.taking.name}_{one}" for one in what))

    def touches(self, extremes: crossings.CrankAngles, across: Array) -> NDArray[np.bool_]:
        """Whether an extremum beside the needle is 0 within rounding of its coordinates, per design (n,)."""
        side, height = self(extremes, "side", "height")
        designs = self.poses.designs
        size = np.abs(designs[extremes.row]).max(axis=1) + np.abs(side) + np.abs(height)
        near = self.taking.beside(height) & (np.abs(across) <= crossings.TANGENT * size)
        return np.bincount(extremes.row, near, len(designs)) > 0


def _last(stops: crossings.CrankAngles, depth: Array, size: Array, phi: Array) -> Array:
    """Find where the needle is lowest; of several places equal to rounding, the last one before ``phi``.

    A guide whose own dead point is passed on the way down and up is lowest twice, and so is one that turns twice.
    Depths are differences of coordinates of that ``size``, (n,).
    """
    lag = np.mod(np.where(np.isnan(phi), TWO_PI, phi)[stops.row] - stops.phi, TWO_PI)
    deepest = crossings.largest(stops.row, depth, size.size)
    lag[depth < (deepest - crossings.TANGENT * (np.abs(deepest) + size))[stops.row]] = np.inf
    found, order = np.full(deepest.size, np.nan), np.argsort(-lag, kind="stable")
    found[stops.row[order]] = stops.phi[order]
    return found


def _following(roots: crossings.CrankAngles, taken: NDArray[np.intp]) -> NDArray[np.intp]:
    """Index of the next passage of the same design, around the turn."""
    after = taken + 1
    same = np.append(roots.row, -1)[after] == roots.row[taken]
    return np.where(same, after, np.searchsorted(roots.row, roots.row[taken]))
