"""Moment A, where a looper's tip passes the needle and takes its loop: machine-and-stitch, 5.1, 5.2 and 5.4.

In the needle's frame, n along the needle to its point, w out of the scarf and perpendicular to n, u = n x w, the tip is
at X = (T - G).u across, Y = (T - G).w aside, Z = (T - G).n along the needle from the guided point G.
"""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from kernels import status as st
from kernels.types import TWO_PI, Array
from sweep.families.base import PER_RADIAN, Columns, Output, Parameter
from sweep.families.machines import crossings
from sweep.families.machines.segments import Gap, cross, dot, minus
from sweep.families.machines.thread_way import turned as turned_back
from sweep.families.machines.tools import Blade, Needle
from sweep.families.sites import components, rate_of, vector_of
from sweep.numerics.records import Indices, only

if TYPE_CHECKING:
    from sweep.families.machines.machine import Machine

PARALLEL = 1e-6  # share of the scarf vector below which its part normal to the needle gives no direction
AT_LOW = ("lag", "gauge", "free")  # outputs that change with the place where the needle is lowest
BESIDE = 1e-6  # rad: a needle on a cam without dwell moves so little there that its place is known to 1e-9 only
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


@dataclass(frozen=True)
class RiseWindow:
    """Window of the needle's rise at A: the range that two or more fields of work permit in common, 5.4.

    ``fields`` are their names with the least and the greatest rise that each permits.  With ``vary`` these are defaults
    of parameters of the machine; ``of`` is the name of the moment.
    """

    of: str
    fields: tuple[tuple[str, float, float], ...]
    vary: bool = False

    @property
    def parameters(self) -> tuple[Parameter, ...]:
        """Both ends of every field, if they vary."""
        texts = {"least": "least rise that {} permits", "most": "largest rise that {} permits"}
        return tuple(
            Parameter(f"{self.of}_{end}_{_word(field)}", "length", text.format(field), default=value, not_negative=True)
            for field, *values in (self.fields if self.vary else ())
            for (end, text), value in zip(texts.items(), values, strict=True)
        )

    def ends(self, designs: Any, names: Sequence[str]) -> tuple[Any, Any]:
        """Least and greatest rise that every field permits, each (n, F), of designs with these columns."""
        if self.vary:
            found = designs[:, [names.index(p.name) for p in self.parameters]]
            return found[:, 0::2], found[:, 1::2]
        given = np.broadcast_to([ends for _, *ends in self.fields], (len(designs), len(self.fields), 2))
        return given[:, :, 0], given[:, :, 1]

    def binding(self, design: Array, names: Sequence[str]) -> tuple[tuple[str, float], tuple[str, float]]:
        """Name the fields that set the least and the greatest rise of a design (P,), each with that rise."""
        low, high = (one[0] for one in self.ends(design[None, :], names))
        first, last = int(low.argmax()), int(high.argmin())
        return (self.fields[first][0], float(low[first])), (self.fields[last][0], float(high[last]))

    @property
    def words(self) -> str:
        """Description of the window, with the fields that bind."""
        text = "how far the rise lies inside its window"
        if self.vary:
            return f"{text}, which {' and '.join(field for field, *_ in self.fields)} leave"
        (slow, least), (fast, most) = self.binding(np.empty(0), ())
        none = ": none is left" if least > most else ""
        return f"{text}: at least {least:g} for {slow}, at most {most:g} for {fast}{none}"


def _word(field: str) -> str:
    return re.sub(r"\W+", "_", field)


@dataclass(frozen=True)
class Taking(crossings.Moment):
    """A blade's tip in the frame of a needle, pose by pose, and its passage.

    ``sense`` is +1 or -1: the tip passes towards u or against it; ``window`` is that of the rise.
    """

    needle: Needle
    blade: Blade
    sense: int
    window: RiseWindow | None = None

    @property
    def gap(self) -> Gap:
        """Gap of needle and blade as capsules."""
        return Gap(f"{self.name}_gap", (self.needle.body, self.blade.body))

    def beside(self, height: Any) -> Any:
        """Whether a height lies between the needle's top and point."""
        return (height > self.needle.top) & (height < self.needle.point)

    @property
    def rates(self) -> Mapping[str, str]:
        """Derivative by the angle of the main shaft of each pose output."""
        return {f"{self.name}_{what}": f"{self.name}_d{what}" for what in ("across", "side", "height", "depth")}

    @property
    def outputs(self) -> tuple[Output, ...]:
        """Coordinates of the tip in the needle's frame, depth of the needle, and their derivatives."""
        texts = {
            "across": "the tip across the needle, along n x w",
            "side": "the tip beside the needle's axis, out of the scarf",
            "height": "the tip along the needle, from the guided point",
            "depth": "the guided point along the needle's direction",
        }
        found = [Output(f"{self.name}_{what}", "length", text, "(12)") for what, text in texts.items()]
        found += [
            Output(
                f"{self.name}_d{what}", PER_RADIAN, f"derivative of {self.name}_{what} by phi of the main shaft", "(12)"
            )
            for what in texts
        ]
        speed = "speed of the tip relative to the needle, per radian of the main shaft"
        gap = Output(self.gap.name, "length", "gap between needle and blade, less their radii", "(9)", kinks=True)
        return (*found, Output(f"{self.name}_speed", PER_RADIAN, speed, "(12)"), gap)

    @property
    def parameters(self) -> tuple[Parameter, ...]:
        """Parameters of the rise window."""
        return self.window.parameters if self.window else ()

    @property
    def _moving(self) -> frozenset[str]:
        """Names of the outputs that need velocities."""
        return frozenset((*self.rates.values(), f"{self.name}_speed"))

    def needs(self, wanted: frozenset[str]) -> frozenset[str]:
        """Names of coordinates of both points and the line, and of velocities if they are wanted."""
        names = [self.needle.on, self.blade.tip, self.needle.line]
        if not wanted.isdisjoint(self._moving):
            names += [rate_of(self.needle.on), rate_of(self.blade.tip)]
        if self.gap.name in wanted:
            names.append(self.blade.back)
        return frozenset(components(*names))

    def compute(self, found: Mapping[str, Any], wanted: frozenset[str]) -> dict[str, Any]:
        """Compute the wanted outputs, (n, m); nan where the scarf is along the needle."""
        point, tip, line = (vector_of(name, found) for name in (self.needle.on, self.blade.tip, self.needle.line))
        n = [self.needle.sense * x for x in line]
        scarf = self.needle.scarf
        along = dot(scarf, n)
        w = [x - along * part for x, part in zip(scarf, n, strict=True)]
        size = np.sqrt(dot(w, w))
        size = np.where(np.real(size) > PARALLEL * np.linalg.norm(scarf), size, np.nan)
        w = [x / size for x in w]
        u = cross(n, w)
        columns = self.gap.compute(found, frozenset()) if self.gap.name in wanted else {}
        orders = [("", point, tip)]
        if not wanted.isdisjoint(self._moving):
            orders.append(("d", vector_of(rate_of(self.needle.on), found), vector_of(rate_of(self.blade.tip), found)))
        for d, point, tip in orders:
            r = minus(tip, point)
            parts = {"across": dot(r, u), "side": dot(r, w), "height": dot(r, n), "depth": dot(point, n)}
            columns |= {f"{self.name}_{d}{what}": part for what, part in parts.items()}
            columns |= {f"{self.name}_speed": np.sqrt(dot(r, r))} if d else {}
        return columns

    @property
    def provides(self) -> tuple[Output, ...]:
        """Design outputs: the passage of the tip, and what is evaluated there."""
        name = self.name
        place = "crank angle at which the tip passes the needle, in its sense, beside it"
        count = "passages in the stated sense beside the needle"
        texts = TEXTS | (WINDOW | {"room": ("length", self.window.words)} if self.window else {})
        return (
            Output(f"phi_{name}", "rad", place, "5.2"),
            Output(f"count_{name}", "1", count, "5.2", jumps=True),
            *(Output(f"{name}_{key}", unit, text, "5.2") for key, (unit, text) in texts.items()),
        )

    def find(self, poses: crossings.Poses, samples: int, wanted: frozenset[str]) -> crossings.Places:
        """Find the passage of the tip, the next one, and the places of the other outputs.

        Extrema of the tip's coordinate across the needle are found first, on a grid and then as roots of its
        derivative; between neighbours of opposite sign there is one passage.  A pair of extrema between two samples is
        missed.
        """
        name, sense, n = self.name, float(self.sense), len(poses.designs)

        def at(where: crossings.CrankAngles, *what: str) -> list[Array]:
            return poses.at(where.row, where.phi, *(f"{name}_{one}" for one in what))

        names = [f"{name}_{what}" for what in ("across", "dacross", "ddepth")]
        status, (x, dx, ddepth) = poses.samples(names, samples)
        status[(status == st.OK) & np.isnan(dx).any(axis=1)] = st.NO_FRAME
        x, dx, ddepth = (np.where((status == st.OK)[:, None], values, np.nan) for values in (x, dx, ddepth))
        stops, extremes = poses.turning(names[2], ddepth), poses.turning(names[1], dx)
        (depths,), (across,) = at(stops, "depth"), at(extremes, "across")
        roots = poses.roots(extremes, across, names[0], names[1], x)
        height, turned = at(roots, "height", "dacross")
        beside, right = self.beside(height), sense * turned > 0.0
        count, ways = (np.bincount(roots.row, beside & one, n) for one in (right, ~right))
        size = np.abs(poses.designs).max(axis=1)
        # An extremum beside the needle touches it where it is 0 within rounding of its coordinates.
        side, height = at(extremes, "side", "height")
        rounded = crossings.TANGENT * (size[extremes.row] + np.abs(side) + np.abs(height))
        touching = np.bincount(extremes.row, self.beside(height) & (np.abs(across) <= rounded), n) > 0
        found = crossings.verdict(status, touching, count, ways)
        taken = np.flatnonzero(beside & right & (found[roots.row] == st.OK))
        row, phi = roots.row[taken], roots.phi[taken]
        passage = crossings.scattered(n, row, phi)
        after = crossings.scattered(n, row, roots.phi[_following(roots, taken)])
        low = _last(stops, depths, size, passage)
        top = _last(stops, -depths, size, low)
        places: crossings.Places = {"at": passage, "after": after, "low": low, "top": low - np.mod(low - top, TWO_PI)}
        places["far"] = crossings.where_largest(extremes, -sense * across, n)
        lag = np.mod(extremes.phi - passage[extremes.row], TWO_PI)
        between = (lag <= np.mod(after - passage, TWO_PI)[extremes.row]) & (sense * across > 0.0)
        places["beyond"] = crossings.where_largest(only(extremes, between), sense * across[between], n)
        if f"{name}_free" in wanted:
            rows = np.flatnonzero(status == st.OK)
            places["near"] = crossings.scattered(
                n, rows, poses.least(rows, places["top"][rows], low[rows], f"{name}_gap")
            )
        return places | {"count": np.where(status == st.OK, count, np.nan), "status": found}

    def read(self, machine: Machine, designs: Any, places: crossings.Places, wanted: frozenset[str]) -> Columns:
        """Evaluate all outputs of the passage, each (n,), and status; with complex designs the places move too."""
        name, sense = self.name, float(self.sense)
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
        lowest = [f"{name}_{key}" for key in AT_LOW if f"{name}_{key}" in wanted]
        if lowest:
            angles |= {"before": angles["low"] - BESIDE, "behind": angles["low"] + BESIDE}
            names.append("ddepth")
        found = crossings.outputs_at(machine, designs, angles, [f"{name}_{what}" for what in names])
        across, side, height, turned, depth, speed, *others = (found[f"{name}_{what}"] for what in names)
        rise = depth["low"] - depth["at"]
        values = {
            "lag": turned_back(angles["at"] - angles["low"]),
            "rise": rise,
            "clearance": side["at"] - self.needle.floor,
            "above_eye": self.needle.eye - height["at"],
            "below_scarf_end": height["at"] - self.needle.scarf_end,
            "directness": sense * turned["at"] / speed["at"],
            "back_side": side["after"],
            "back_height": height["at"] - height["after"],
            "overtravel": np.where(np.isnan(across["beyond"]), 0.0 * rise, sense * across["beyond"]),
            "gauge": -sense * across["low"],
            "reach": -sense * across["far"],
        }
        if self.window:
            low, high = self.window.ends(designs, machine.parameter_names)
            least, most = low.max(axis=1), high.min(axis=1)
            values |= {"least": least, "most": most, "room": np.minimum(rise - least, most - rise)}
            status[(status == st.OK) & (np.real(least) > np.real(most))] = st.NO_WINDOW
        if "near" in angles:
            free, radii = others[0]["near"], sum(body.radius for body in self.gap.bodies)
            # Axes that meet do so for every neighbouring design: the least gap is constant, and its slope is zero.
            values["free"] = np.where(np.real(free) + radii > MEET * np.real(speed["near"]), free, np.real(free))
        status[np.real(side["at"]) <= 0.0] = st.WRONG_SIDE
        columns: Columns = {f"phi_{name}": angles["at"], f"count_{name}": places["count"], "status": status}
        fast = np.fmax(np.real(speed["at"]), np.real(speed["after"]))
        columns["steep"] = crossings.steepness(fast, turned["at"], turned["after"])
        if lowest:
            bend = (others[-1]["behind"] - others[-1]["before"]) / (2.0 * BESIDE)
            columns |= {f"steep {key}": crossings.steepness(speed["low"], bend) for key in lowest}
        return columns | {f"{name}_{key}": value for key, value in values.items()}


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


def _following(roots: crossings.CrankAngles, taken: Indices) -> Indices:
    """Index of the next passage of the same design, around the turn."""
    after = taken + 1
    same = np.append(roots.row, -1)[after] == roots.row[taken]
    return np.where(same, after, np.searchsorted(roots.row, roots.row[taken]))
