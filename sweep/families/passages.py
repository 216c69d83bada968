"""Where a looper's tip passes the needle: roots between extremes, and what is read there (machine-and-stitch, 5.2)."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from kernels import status as st
from kernels.types import Array
from sweep.families.base import Accuracy, Angles, Columns, Output, Step, Work
from sweep.families.moments import Taking

if TYPE_CHECKING:
    from sweep.families.machines import Machine

SAMPLES = 512
BLOCK = 256  # designs at once: their samples stay in the caches
PASSES = 60  # halvings, and secants between them, that bring any bracket to rounding
TWO_PI = 2.0 * np.pi
TANGENT = 64.0 * 2.0**-53  # of the coordinates that the distance across is a difference of
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
}


@dataclass
class _Found:
    """Angles of several designs in one row: the design of each, the angle, what is known there."""

    row: NDArray[np.intp]
    phi: Array


def step_of(taking: Taking, machine: Machine) -> Step:
    """Return the machine's own route to where and how the tip passes."""
    name = taking.name
    place = Output(
        f"phi_{name}", "rad", "crank angle at which the tip passes the needle, in its sense, beside it", "5.2"
    )
    count = Output(f"count_{name}", "1", "passages in the stated sense beside the needle", "5.2", jumps=True)
    provides = tuple(Output(f"{name}_{key}", unit, text, "5.2") for key, (unit, text) in TEXTS.items())

    def run(designs: Array, wanted: frozenset[str], accuracy: Accuracy) -> Columns:
        samples = accuracy.samples or SAMPLES
        parts = [
            passages(taking, machine, designs[k : k + BLOCK], samples) for k in range(0, max(len(designs), 1), BLOCK)
        ]
        found: Columns = {key: np.concatenate([part[key] for part in parts]) for key in parts[0]}
        if accuracy.target is not None:
            found |= {f"err_{key}": np.abs(np.asarray(found[key], np.float64)) * accuracy.target for key in wanted}
        return found

    return Step(f"passage {name}", (place, count, *provides), run, work=Work.SEARCH, cost=_cost)


def _cost(accuracy: Accuracy) -> float:
    return 2000.0 * (accuracy.samples or SAMPLES)


@dataclass(frozen=True)
class _Tip:
    """The tip in the needle's frame, of several designs, at one angle of each: found quickly, read precisely."""

    taking: Taking
    quick: Machine
    precise: Machine
    designs: Array

    def at(self, rows: Any, phi: Array, *what: str) -> list[Array]:
        """Return outputs of these designs at these angles."""
        return self._of(self.precise, rows, phi, what)

    def near(self, rows: Any, phi: Array, what: str) -> Array:
        """Return an output as the search for a root needs it."""
        return self._of(self.quick, rows, phi, (what,))[0]

    def _of(self, machine: Machine, rows: Any, phi: Array, what: Sequence[str]) -> list[Array]:
        names = [f"{self.taking.name}_{one}" for one in what]
        found = machine.poses(self.designs[rows], Angles.of(phi[:, None]), frozenset(names))
        return [np.asarray(found[name], np.float64)[:, 0] for name in names]

    def turning(self, slope: Array, name: str) -> _Found:
        """Return where samples (n, m) of a derivative change their sign, as roots of the output of that name."""
        after = np.roll(slope, -1, axis=1)
        row, column = np.nonzero((slope > 0.0) & (after <= 0.0) | (slope < 0.0) & (after >= 0.0))
        step = TWO_PI / slope.shape[1]
        ends = slope[row, column], after[row, column]
        phi = _root(row, column * step, (column + 1) * step, *ends, lambda r, x: self.near(r, x, name))
        return _Found(row, phi)

    def beside(self, height: Array) -> NDArray[np.bool_]:
        """Tell whether a height is one of the needle's."""
        return (height > self.taking.needle.top) & (height < self.taking.needle.point)

    def touches(self, extremes: _Found, across: Array) -> NDArray[np.bool_]:
        """Tell of each design whether an extreme beside the needle is 0 within rounding of its coordinates."""
        side, height = self.at(extremes.row, extremes.phi, "side", "height")
        size = np.abs(self.designs[extremes.row]).max(axis=1) + np.abs(side) + np.abs(height)
        near = self.beside(height) & (np.abs(across) <= TANGENT * size)
        return np.bincount(extremes.row, near, len(self.designs)) > 0


def passages(taking: Taking, machine: Machine, designs: Array, samples: int = SAMPLES) -> Columns:
    """Return all outputs of the passage, each (n,), and status.

    Extremes of the way across are found first, on a grid and then as roots of its derivative; between neighbours of
    opposite sign lies one passage.  A pair of extremes between two samples is missed.
    """
    name, sense, n = taking.name, float(taking.sense), len(designs)
    tip = _Tip(taking, machine, machine.precise(), designs)
    status, dx, ddepth = _scan(taking, machine, designs, samples)
    good = status == st.OK
    low, extremes = tip.turning(ddepth, "ddepth"), tip.turning(dx, "dacross")
    (lows,), (across,) = tip.at(low.row, low.phi, "depth"), tip.at(extremes.row, extremes.phi, "across")
    deepest = _largest(low.row, lows, n)
    roots = _roots(extremes, across, tip)
    side, height, turned, depth, speed = tip.at(roots.row, roots.phi, "side", "height", "dacross", "depth", "speed")
    beside, right = tip.beside(height), sense * turned > 0.0
    count, ways = (np.bincount(roots.row, beside & one, n) for one in (right, ~right))
    verdict = np.select(
        [~good, tip.touches(extremes, across), count > 1, (count == 0) & (ways > 0), count == 0],
        [status.astype(np.int64), st.TANGENT, st.TWICE, st.WRONG_WAY, st.NEVER], st.OK,
    )  # fmt: skip
    taken = np.flatnonzero(beside & right & (verdict[roots.row] == st.OK))
    row, phi = roots.row[taken], roots.phi[taken]
    place = np.full(n, np.nan)
    place[row] = phi
    phi_low, rows, gauge = _last_low(low, lows, deepest, place), np.flatnonzero(good), np.full(n, np.nan)
    gauge[rows] = -sense * tip.at(rows, phi_low[rows], "across")[0]
    after = _following(roots, taken)
    values = {
        "lag": np.mod(phi - phi_low[row], TWO_PI),
        "rise": deepest[row] - depth[taken],
        "clearance": side[taken] - taking.needle.floor,
        "above_eye": taking.needle.eye - height[taken],
        "below_scarf_end": height[taken] - taking.needle.scarf_end,
        "directness": sense * turned[taken] / speed[taken],
        "back_side": side[after],
        "back_height": height[taken] - height[after],
        "overtravel": _between(extremes, sense * across, phi, roots.phi[after], row),
    }
    columns: Columns = {f"phi_{name}": place, f"count_{name}": np.where(good, count, np.nan), f"{name}_gauge": gauge}
    columns[f"{name}_reach"] = _largest(extremes.row, -sense * across, n)
    for key, value in values.items():
        whole = np.full(n, np.nan)
        whole[row] = value
        columns[f"{name}_{key}"] = whole
    verdict[row[side[taken] <= 0.0]] = st.WRONG_SIDE
    return columns | {"status": verdict.astype(np.uint8)}


def _scan(taking: Taking, machine: Machine, designs: Array, samples: int) -> tuple[NDArray[np.uint8], Array, Array]:
    """Return status, and samples (n, m) of the derivatives of the way across and of the depth; nan without status 0."""
    grid: Array = np.arange(samples) * np.float64(TWO_PI / samples)
    names = [f"{taking.name}_{one}" for one in ("dacross", "ddepth")]
    found = machine.poses(designs, Angles.of(grid[None, :]), frozenset(names))
    slopes = [np.asarray(found[one], np.float64) for one in names]
    status = np.asarray(found["status"], np.uint8).max(axis=1, initial=0)
    status[status == st.NOT_ASSEMBLED] = st.NOT_ROTATABLE
    status[(status == st.OK) & np.isnan(slopes[0]).any(axis=1)] = st.NO_FRAME
    across, depth = (np.where((status == st.OK)[:, None], slope, np.nan) for slope in slopes)
    return status, across, depth


def _root(
    row: Any, left: Array, right: Array, low: Array, high: Array, function: Callable[[Any, Array], Array]
) -> Array:
    """Return a root in each bracket, by the Illinois form of regula falsi with halvings between, all at once."""
    left, right, low, high = left.copy(), right.copy(), low.copy(), high.copy()
    side = np.zeros(left.size)
    phi, best = np.where(high == 0.0, right, left), np.minimum(np.abs(low), np.abs(high))
    a = np.flatnonzero((low != 0.0) & (high != 0.0))
    for turn in range(PASSES):
        if not a.size:
            break
        width = right[a] - left[a]
        secant = right[a] - high[a] * width / (high[a] - low[a])
        trial = 0.5 * (left[a] + right[a]) if turn % 3 == 2 else secant
        now = function(row[a], trial)
        nearer = np.abs(now) < best[a]
        phi[a], best[a] = np.where(nearer, trial, phi[a]), np.where(nearer, np.abs(now), best[a])
        same = now * low[a] > 0.0
        high[a] = np.where(same, np.where(side[a] == -1.0, 0.5, 1.0) * high[a], now)
        low[a] = np.where(same, now, np.where(side[a] == 1.0, 0.5, 1.0) * low[a])
        left[a], right[a] = np.where(same, trial, left[a]), np.where(same, right[a], trial)
        side[a] = np.where(same, -1.0, 1.0)
        a = a[(now != 0.0) & (right[a] - left[a] > 2.0**-50 * TWO_PI)]
    return phi


def _roots(extremes: _Found, across: Array, tip: _Tip) -> _Found:
    """Return the passages between neighbouring extremes of opposite sign, of each design in order."""
    order = np.lexsort((extremes.phi, extremes.row))
    row, phi, value = extremes.row[order], extremes.phi[order], across[order]
    count = np.bincount(row, minlength=int(row.max(initial=-1)) + 1)
    first = np.concatenate([[0], np.cumsum(count)[:-1]]) if count.size else np.zeros(0, np.intp)
    after = np.arange(row.size) + 1
    last = after == (first + count)[row] if row.size else np.zeros(0, np.bool_)
    after = np.where(last, first[row], after) if row.size else after
    left, right = phi, phi[after] + np.where(last, TWO_PI, 0.0) if row.size else phi
    k = np.flatnonzero(value * value[after] < 0.0) if row.size else np.zeros(0, np.intp)
    found = _root(row[k], left[k], right[k], value[k], value[after][k], lambda r, x: tip.near(r, x, "across"))
    x, slope = tip.at(row[k], found, "across", "dacross") if k.size else [np.zeros(0)] * 2
    with np.errstate(divide="ignore", invalid="ignore"):
        polished = found - x / slope
    found = np.where((polished > left[k]) & (polished < right[k]), polished, found)
    found = np.mod(found, TWO_PI)
    ordered = np.lexsort((found, row[k]))
    return _Found(row[k][ordered], found[ordered])


def _largest(row: NDArray[np.intp], values: Array, n: int) -> Array:
    """Return the largest value of each design; nan where there is none."""
    most = np.full(n, -np.inf)
    np.maximum.at(most, row, values)
    return np.where(np.isfinite(most), most, np.nan)


def _last_low(low: _Found, depth: Array, deepest: Array, phi: Array) -> Array:
    """Return where the needle is lowest; of several such places, alike to rounding, the last one before ``phi``.

    A guide whose own dead point is passed on the way down and up is lowest twice.
    """
    lag = np.mod(np.where(np.isnan(phi), TWO_PI, phi)[low.row] - low.phi, TWO_PI)
    lag[depth < deepest[low.row] - TANGENT * np.abs(deepest[low.row])] = np.inf
    found, order = np.full(deepest.size, np.nan), np.argsort(-lag, kind="stable")
    found[low.row[order]] = low.phi[order]
    return found


def _following(roots: _Found, taken: NDArray[np.intp]) -> NDArray[np.intp]:
    """Return of each passage the next one of its design, around the turn."""
    after = taken + 1
    same = np.append(roots.row, -1)[after] == roots.row[taken]
    following: NDArray[np.intp] = np.where(same, after, np.searchsorted(roots.row, roots.row[taken]))
    return following


def _between(extremes: _Found, values: Array, start: Array, end: Array, row: NDArray[np.intp]) -> Array:
    """Return the largest extreme of each design between two angles of its turn."""
    found = np.full(row.size, np.nan)
    for k, one in enumerate(row.tolist()):
        own = extremes.row == one
        inside = np.mod(extremes.phi[own] - start[k], TWO_PI) <= np.mod(end[k] - start[k], TWO_PI)
        found[k] = values[own][inside].max(initial=0.0)
    return found
