"""Moments B and C, at which a tip enters the triangle of a blade, its thread and the seam: machine-and-stitch, 5.3.

B: the upper looper takes the lower looper's thread.  C: the needle takes that of the upper looper.  Corners are the eye
P1 of the blade, the place P2 where it holds a loop or meets the plane of the seam, and the seam P3.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from kernels import status as st
from kernels.types import TWO_PI
from sweep.families.base import PER_RADIAN, Columns, Output
from sweep.families.machines import crossings
from sweep.families.machines.segments import cross, dot, minus
from sweep.families.sites import Spot

if TYPE_CHECKING:
    from sweep.families.machines.machine import Machine

FLAT = 1e-6  # least sine of the angle between two sides: flatter triangles have no plane
SIDES = {"seam": (1, 2), "thread": (2, 0), "blade": (0, 1)}  # both corners of each side, in cyclic order
TEXTS = {
    "from_blade": "from the side eye - hold, positive inside the triangle",
    "from_thread": "from the side seam - eye, positive inside the triangle",
    "from_seam": "from the side hold - seam, positive inside the triangle",
    "margin": "least distance of the tip from a side of the triangle, less its radius; negative: outside",
    "pace": "speed of the tip through the plane of the triangle, per radian of the main shaft",
}


@dataclass(frozen=True)
class Entering(crossings.Moment):
    """A tip and the plane of a triangle, pose by pose, and the passage of the tip.

    Parameters
    ----------
    name : of the relation
    tip : point that enters;  corners : eye and hold of the blade, seam
    radius : of the body that enters
    sense : +1 or -1: passage along the normal (P2 - P1) x (P3 - P1), or against it
    window : from, to: crank angles of the main shaft between which the passage is sought, modulo a turn; None for all
    """

    tip: Spot
    corners: tuple[Spot, Spot, Spot]
    radius: float
    sense: int
    window: tuple[float, float] | None = None

    @property
    def rates(self) -> Mapping[str, str]:
        """Derivative of the height above the plane by the angle of the main shaft."""
        return {f"{self.name}_above": f"{self.name}_dabove"}

    @property
    def outputs(self) -> tuple[Output, ...]:
        """Height of the tip above the plane, its derivative, and the distances of the tip from the sides."""
        of = "of the tip above the plane of the triangle"
        return (
            Output(f"{self.name}_above", "length", f"height {of}", "(13)"),
            Output(
                f"{self.name}_dabove", PER_RADIAN, f"derivative of the height {of} by phi of the main shaft", "(13)"
            ),
            *(Output(f"{self.name}_to_{side}", "length", TEXTS[f"from_{side}"], "(13)") for side in SIDES),
        )

    def needs(self, wanted: frozenset[str]) -> frozenset[str]:
        """Return coordinates of tip and corners, and velocities where the derivative is wanted."""
        moving = f"{self.name}_dabove" in wanted
        return frozenset().union(*(spot.needs(moving) for spot in (self.tip, *self.corners)))

    def compute(self, found: Mapping[str, Any], wanted: frozenset[str]) -> dict[str, Any]:
        """Return the wanted outputs, (n, m); nan where the corners are collinear."""
        tip, *corners = (spot.position(found) for spot in (self.tip, *self.corners))
        first, second, reach = (minus(point, corners[0]) for point in (corners[1], corners[2], tip))
        normal = cross(first, second)
        size = np.sqrt(dot(normal, normal))
        flat = FLAT * np.sqrt(np.real(dot(first, first)) * np.real(dot(second, second)))
        size = np.where(np.real(size) > flat, size, np.nan)
        above = dot(reach, normal) / size
        columns = {f"{self.name}_above": above}
        for side, (j, k) in SIDES.items():
            along, from_j = minus(corners[k], corners[j]), minus(tip, corners[j])
            columns[f"{self.name}_to_{side}"] = dot(normal, cross(along, from_j)) / (size * np.sqrt(dot(along, along)))
        if f"{self.name}_dabove" in wanted:
            dtip, *moves = (spot.velocity(found) for spot in (self.tip, *self.corners))
            dfirst, dsecond, dreach = (minus(rate, moves[0]) for rate in (moves[1], moves[2], dtip))
            turning = [x + y for x, y in zip(cross(dfirst, second), cross(first, dsecond), strict=True)]
            slope = dot(dreach, normal) + dot(reach, turning) - above * dot(normal, turning) / size
            columns[f"{self.name}_dabove"] = slope / size
        return columns

    @property
    def provides(self) -> tuple[Output, ...]:
        """Design outputs: the crank angle at which the tip enters the triangle, and the distances there."""
        name, units = self.name, {"pace": PER_RADIAN}
        place = "crank angle at which the tip passes the plane of the triangle"
        count = "passages of the plane in the stated sense and window"
        return (
            Output(f"phi_{name}", "rad", place, "(13)"),
            Output(f"count_{name}", "1", count, "(13)", jumps=True),
            *(Output(f"{name}_{key}", units.get(key, "length"), text, "(13)") for key, text in TEXTS.items()),
        )

    def find(self, poses: crossings.Poses, samples: int, wanted: frozenset[str]) -> crossings.Places:
        """Find the crank angle at which the tip enters, by the method for the passage of a needle."""
        name, sense, n = self.name, float(self.sense), len(poses.designs)
        above, dabove = f"{name}_above", f"{name}_dabove"
        status, (x, slope) = poses.samples([above, dabove], samples)
        status[(status == st.OK) & np.isnan(slope).any(axis=1)] = st.NO_TRIANGLE
        x, slope = (np.where((status == st.OK)[:, None], values, np.nan) for values in (x, slope))
        extremes = poses.turning(dabove, slope)
        (heights,) = poses.at(extremes.row, extremes.phi, above)
        roots = poses.roots(extremes, heights, above, dabove, x)
        (turned,) = poses.at(roots.row, roots.phi, dabove)
        inside, right = self._within(roots.phi), sense * turned > 0.0
        count, ways = (np.bincount(roots.row, inside & one, n) for one in (right, ~right))
        size = np.abs(poses.designs[extremes.row]).max(axis=1, initial=0.0)
        near = self._within(extremes.phi) & (np.abs(heights) <= crossings.TANGENT * size)
        found = crossings.verdict(status, np.bincount(extremes.row, near, n) > 0, count, ways)
        taken = np.flatnonzero(inside & right & (found[roots.row] == st.OK))
        place = crossings.scattered(n, roots.row[taken], roots.phi[taken])
        places = {"at": place, "count": np.where(status == st.OK, count, np.nan), "status": found}
        return places | {"fastest": np.abs(slope).max(axis=1)}

    def read(self, machine: Machine, designs: Any, places: crossings.Places, wanted: frozenset[str]) -> Columns:
        """Evaluate all outputs of the entry, each (n,), and status; complex designs move the crank angle too."""
        name, status, at = self.name, np.array(places["status"]), places["at"]
        if np.iscomplexobj(designs):
            at = crossings.moved(machine, designs, at[:, None], [f"{name}_above"])[:, 0]
        reads = [f"{name}_dabove", *(f"{name}_to_{side}" for side in SIDES)]
        found = crossings.outputs_at(machine, designs, {"at": at}, reads)
        turned, *distances = (found[one]["at"] for one in reads)
        least = np.minimum.reduce(distances) - self.radius
        columns: Columns = {f"phi_{name}": at, f"count_{name}": places["count"], f"{name}_margin": least}
        columns |= {f"{name}_from_{side}": one for side, one in zip(SIDES, distances, strict=True)}
        columns["steep"] = crossings.steepness(places["fastest"], turned)
        columns[f"{name}_pace"] = float(self.sense) * turned
        status[np.real(least) <= -self.radius] = st.WRONG_SIDE
        status[np.isfinite(places["at"]) & np.isnan(least)] = st.NO_TRIANGLE
        return columns | {"status": status}

    def _within(self, phi: Any) -> Any:
        """Return the mask of the angles in the window, modulo a turn."""
        if self.window is None:
            return np.ones(np.shape(phi), np.bool_)
        start, end = self.window
        return np.mod(phi - start, TWO_PI) <= np.mod(end - start, TWO_PI)
