"""Moments of a machine: roots of pose outputs of many designs at once, and the outputs that are evaluated there.

Extrema are found first, then one root between neighbours of opposite sign.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, NamedTuple, TypeAlias

import numpy as np
from numpy.polynomial.polynomial import polyder, polyval
from numpy.typing import NDArray

from kernels import status as st
from kernels.curves import samples as scan
from kernels.types import TWO_PI, Array
from sweep.families.base import Accuracy, Angles, Columns, Family, Output, Step, Work
from sweep.families.machines.relations import Relation
from sweep.numerics.events import LAST, beyond, bottoms, first_passage, passages, zeros
from sweep.numerics.records import Indices, Mask, only

if TYPE_CHECKING:
    from sweep.families.machines.machine import Machine

SAMPLES, MOST = 512, 16384  # samples of a turn, and largest number before an event is given up
BLOCK = 256  # designs at once: their samples stay in the caches
TANGENT = 64.0 * 2.0**-53  # relative rounding of a distance, which is a difference of coordinates
FLAT = 1e-9  # share of the largest slope that an extremum's may have
NEAR = 1e-3  # share of a sample's step: the slope of a polynomial this close to the poses is trusted

Places: TypeAlias = dict[str, Any]
"""Crank angles (n,) of the designs by name, "count" and "status"."""


class CrankAngles(NamedTuple):
    """Crank angles of several designs, with the row of the design of each."""

    row: Indices
    phi: Array


@dataclass(frozen=True)
class Moment(Relation, ABC):
    """A relation with the crank angle of a passage, ``phi_NAME``, and the outputs that are evaluated there."""

    @property
    @abstractmethod
    def provides(self) -> tuple[Output, ...]:
        """Design outputs: crank angle of the passage, number of passages, and what is evaluated there."""

    @abstractmethod
    def find(self, poses: Poses, samples: int, wanted: frozenset[str]) -> Places:
        """Find the crank angles that the wanted outputs need."""

    @abstractmethod
    def read(self, machine: Machine, designs: Any, places: Places, wanted: frozenset[str]) -> Columns:
        """Evaluate all outputs at these angles, each (n,), ``status``, and ``steep`` (`steepness`).

        ``steep NAME`` is that of an output which another place determines too.  With complex designs the places move
        too, to first order.
        """

    def step(self, machine: Machine) -> Step:
        """Make the machine's own step to the outputs of the moment."""
        last: dict[str, tuple[bytes, Places]] = {}

        def places_of(designs: Array, wanted: frozenset[str], samples: int) -> Places:
            """Find the places of designs, cached for the last designs: a search needs values, then slopes."""
            asked = designs.tobytes() + repr((samples, sorted(wanted))).encode()
            known = last.get(self.name)
            if known is None or known[0] != asked:
                found = self.find(Poses(machine, machine.precise(), designs), samples, wanted)
                known = last[self.name] = asked, found
            return known[1]

        def block(designs: Array, wanted: frozenset[str], samples: int) -> Columns:
            if not np.iscomplexobj(designs):
                return self.read(machine, designs, places_of(designs, wanted, samples), wanted)
            real = np.ascontiguousarray(designs.real)
            if (real == real[:1]).all():  # the complex step: one design, perturbed along each variable
                places = {key: np.repeat(x, len(real)) for key, x in places_of(real[:1], wanted, samples).items()}
            else:
                places = places_of(real, wanted, samples)
            return self.read(machine, designs, places, wanted)

        def run(designs: Array, wanted: frozenset[str], accuracy: Accuracy) -> Columns:
            samples = accuracy.samples or SAMPLES
            parts = [block(designs[k : k + BLOCK], wanted, samples) for k in range(0, max(len(designs), 1), BLOCK)]
            found: Columns = {key: np.concatenate([part[key] for part in parts]) for key in parts[0]}
            steep = np.asarray(found.pop("steep"), np.float64)
            steeper = {key: found.pop(key) for key in list(found) if key.startswith("steep ")}
            if accuracy.target is not None:
                size = TANGENT * np.abs(designs).max(axis=1, initial=0.0)
                for key in wanted:
                    rounded = size * np.fmax(steep, steeper.get(f"steep {key}", 1.0))
                    found[f"err_{key}"] = np.maximum(np.abs(found[key]) * accuracy.target, rounded)
            return found

        def cost(accuracy: Accuracy) -> float:
            return 2000.0 * (accuracy.samples or SAMPLES)

        return Step(f"passage {self.name}", self.provides, run, work=Work.LONG, cost=cost, analytic=machine.analytic)


def steepness(speed: Any, *slopes: Any) -> Array:
    """Return the factor from the rounding of a function at its roots to that of outputs read there, (n,), at least 1.

    A root moves by the rounding over the function's slope, and outputs change at that ``speed``.
    """
    fast = np.maximum(np.real(speed), 1.0)
    with np.errstate(divide="ignore", invalid="ignore"):
        return np.asarray(np.fmax.reduce([np.ones(len(fast)), *(fast / np.abs(np.real(x)) for x in slopes)]))


def outputs_at(
    machine: Machine, designs: Any, places: Mapping[str, Any], names: Sequence[str]
) -> dict[str, dict[str, Any]]:
    """Evaluate outputs of designs at angles of each, (n,) by output and place; precise ones, or complex ones."""
    phi = np.stack(list(places.values()), axis=1)
    known = np.isfinite(phi)
    family = machine if np.iscomplexobj(phi) else machine.precise()
    found = family.poses(designs, Angles.of(np.where(known, phi, 0.0)), frozenset(names))
    return {name: dict(zip(places, np.where(known, found[name], np.nan).T, strict=True)) for name in names}


def moved(machine: Machine, designs: Any, phi: Array, names: Sequence[str]) -> Any:
    """Compute the roots (n, k) of outputs, one per column, for complex designs: phi - f_p/f'.

    The imaginary parts are the derivatives, by the implicit function theorem.
    """
    step, wanted, known = 1e-100, frozenset(names), np.isfinite(phi)
    at: Any = np.where(known, phi, 0.0)
    along = machine.poses(designs.real, Angles.of(at + 1j * step), wanted)
    across = machine.poses(designs, Angles.of(at), wanted)
    moves = [across[name][:, k].imag / (along[name][:, k].imag / step) for k, name in enumerate(names)]
    return np.where(known, phi - 1j * np.stack(moves, axis=1), np.nan)


@dataclass(frozen=True)
class Poses:
    """Pose outputs of several designs, at one or several angles each: roots by quick poses, values by precise ones."""

    quick: Family
    precise: Family
    designs: Array
    sampled: dict[tuple[str, int], tuple[NDArray[np.uint8], Array]] = field(default_factory=dict)

    def at(self, rows: Any, phi: Array, *names: str) -> list[Array]:
        """Evaluate outputs of designs ``rows`` at angles (k,) or (k, m), with precise poses."""
        return self._of(self.precise, rows, phi, names)

    def near(self, rows: Any, phi: Array, name: str) -> Array:
        """Evaluate an output with quick poses, for the search of a root."""
        return self._of(self.quick, rows, phi, (name,))[0]

    def _of(self, family: Family, rows: Any, phi: Array, names: Sequence[str]) -> list[Array]:
        angles = Angles.of(phi if phi.ndim == 2 else phi[:, None])
        found = family.poses(self.designs[rows], angles, frozenset(names))
        return [np.asarray(found[name], np.float64).reshape(phi.shape) for name in names]

    def samples(self, names: Sequence[str], count: int) -> tuple[NDArray[np.uint8], list[Array]]:
        """Sample outputs over the turn: status (n,), and samples (n, count); nan without status 0."""
        new = [name for name in names if (name, count) not in self.sampled]
        if new:
            grid: Array = np.arange(count) * np.float64(TWO_PI / count)
            found = self.quick.poses(self.designs, Angles.of(grid[None, :]), frozenset(new))
            status = np.asarray(found["status"], np.uint8).max(axis=1, initial=0)
            status[status == st.NOT_ASSEMBLED] = st.NOT_ROTATABLE
            good = (status == st.OK)[:, None]
            for name in new:
                self.sampled[name, count] = status, np.where(good, np.asarray(found[name], np.float64), np.nan)
        kept = [self.sampled[name, count] for name in names]
        return np.maximum.reduce([status for status, _ in kept]), [values for _, values in kept]

    def turning(self, rate: str, slope: Array) -> CrankAngles:
        """Find where samples (n, m) of a derivative change their sign, refined to its roots.

        Where a cam stands still the derivative is exactly zero: both ends of such a piece are found.
        """
        after, step = np.roll(slope, -1, axis=1), TWO_PI / slope.shape[1]
        still = (slope == 0.0) & ((after == 0.0) | (np.roll(slope, 1, axis=1) == 0.0))
        ends = still != np.roll(still, -1, axis=1)
        passes = (slope > 0.0) & (after <= 0.0) | (slope < 0.0) & (after >= 0.0)
        row, column = np.nonzero(passes | ends)
        left, right, end = column * step, (column + 1) * step, ends[row, column]
        phi = 0.5 * (left + right)
        phi[~end] = self._root(row[~end], left[~end], right[~end], rate, slope)
        rows = row[end]
        phi[end] = zeros(lambda k, x: np.where(self.near(rows[k], x, rate) == 0.0, -1.0, 1.0), left[end], right[end])
        return CrankAngles(row, phi)

    def roots(self, extremes: CrankAngles, at_extremes: Array, name: str, rate: str, values: Array) -> CrankAngles:
        """Find the zeros of an output, of each design in order, between neighbours of opposite sign.

        Neighbours are samples (n, m) and extrema: two zeros between samples have an extremum between them.  Each is
        refined to rounding, and polished by a Newton step on precise poses.
        """
        n, count = values.shape
        grid = np.arange(count) * (TWO_PI / count)
        row = np.concatenate([np.repeat(np.arange(n), count), extremes.row])
        phi = np.concatenate([np.tile(grid, n), extremes.phi])
        height = np.concatenate([values.ravel(), at_extremes])
        order = np.lexsort((phi, row))
        nodes, height = only(CrankAngles(row, phi), order), height[order]
        left, right, after = _neighbours(nodes)
        k = np.flatnonzero((height < 0.0) & (height[after] >= 0.0) | (height > 0.0) & (height[after] <= 0.0))
        row = nodes.row[k]
        found = self._root(row, left[k], right[k], name, values)
        x, slope = self.at(row, found, name, rate)
        with np.errstate(divide="ignore", invalid="ignore"):
            polished = found - x / slope
        found = np.mod(np.where((polished > left[k]) & (polished < right[k]), polished, found), TWO_PI)
        return only(CrankAngles(row, found), np.lexsort((found, row)))

    def first(self, name: str, level: float, sense: float, count: int = SAMPLES) -> tuple[NDArray[np.uint8], Array]:
        """Find status and first passage of an output through a level in a sense, each (n,); nan without one.

        Designs whose samples may touch the level between two of them are sampled twice as densely, as for events alone.
        """
        status, (values,) = self.samples([name], count)
        wraps = self.quick.pose_output[name].wraps
        off = beyond(values, level, wraps)
        passes = passages(sense * off, wraps)
        row = np.flatnonzero(passes.any(axis=1))
        start = first_passage(passes[row], off[row]) * np.float64(TWO_PI / count)
        found = scattered(len(off), row, self._root(row, start, start + TWO_PI / count, name, off, level))
        status = np.where((status == st.OK) & np.isnan(found), st.NO_EVENT, status).astype(np.uint8)
        touching = np.zeros(len(off), np.bool_)
        scan.grazes(off, np.zeros(len(off)), touching)
        row = np.flatnonzero(touching)
        if row.size and count < MOST:
            denser = Poses(self.quick, self.precise, self.designs[row])
            status[row], found[row] = denser.first(name, level, sense, 2 * count)
        elif row.size:
            status[row] = st.NOT_CONVERGED
        return status, found

    def _root(self, row: Indices, left: Array, right: Array, name: str, off: Array, level: float = 0.0) -> Array:
        """Find a root in each bracket where an output passes a level.

        It is computed on polynomials through samples (n, m) of how far it lies beyond, then corrected by two steps on
        poses; where the first is not small or what it leaves is not, the polynomial is inaccurate and the root is found
        on poses alone.  A cam is flat where it turns back: there polynomials miss the place by more than they show.
        """
        if not row.size:
            return np.zeros(0)
        step, wraps = TWO_PI / off.shape[1], self.quick.pose_output[name].wraps
        column = np.floor(0.5 * (left + right) / step).astype(np.intp)
        near = off[row[:, None], (column[:, None] + np.arange(-2, 4)) % off.shape[1]]
        polynomial = np.linalg.solve(np.vander(np.arange(-2.0, 4.0), increasing=True), near.T)
        on_samples: Any = lambda k, t: polyval(t, polynomial[:, k], tensor=False)  # noqa: E731
        t = zeros(on_samples, left / step - column, right / step - column)

        def beyond_at(k: Indices, phi: Array) -> Array:
            return beyond(self.near(row[k], phi, name), level, wraps)

        every, guess = np.arange(row.size), (column + t) * step
        height = beyond_at(every, guess)
        with np.errstate(divide="ignore", invalid="ignore"):
            better = guess - height * step / polyval(t, polyder(polynomial), tensor=False)
        close = (np.abs(better - guess) <= NEAR * step) & (better >= left) & (better <= right)
        better = np.where(close, better, guess)
        left_over = beyond_at(every, better)
        with np.errstate(divide="ignore", invalid="ignore"):
            last = better - left_over * (better - guess) / (left_over - height)
        better = np.where(np.abs(last - better) < np.abs(better - guess), last, better)
        rest = np.flatnonzero(~close | (np.abs(left_over) > FLAT * np.abs(off).max(axis=1)[row]))
        better[rest] = zeros(lambda k, phi: beyond_at(rest[k], phi), left[rest], right[rest])
        return np.asarray(better, np.float64)

    def least(self, row: Indices, start: Array, end: Array, name: str, samples: int = 64) -> Array:
        """Find where an output is smallest between two angles of each design, (k,)."""
        if not row.size:
            return np.zeros(0)
        step = 1.0 / (samples - 1)  # one sample beyond either end, so that a dip next to an end has neighbours
        grid = start[:, None] + np.linspace(-step, 1.0 + step, samples + 2) * (end - start)[:, None]
        values = self.at(row, grid, name)[0]
        which = values[:, 1:-1].argmin(axis=1) + 1
        place: Array = np.take_along_axis(grid, which[:, None], axis=1)[:, 0]
        place = np.where(which == 1, start, np.where(which == samples, end, place))
        dips = (values[:, 1:-1] <= values[:, :-2]) & (values[:, 1:-1] <= values[:, 2:])
        # A dip between the least sample and its neighbours shows in no sample if that one lies at an end.
        k, j = np.nonzero(dips | (np.arange(1, samples + 1) == which[:, None]))
        if k.size:
            # To rounding, not to its square root: where axes meet the curve is a wedge as steep as the bodies are fast.
            low, high = np.maximum(grid[k, j], start[k]), np.minimum(grid[k, j + 2], end[k])
            phi = bottoms(lambda places: self.near(row[k], places, name), low, high)
            phi = np.where(phi - start[k] <= LAST, start[k], np.where(end[k] - phi <= LAST, end[k], phi))
            height = self.at(row[k], phi, name)[0]
            least = values[:, 1:-1].min(axis=1)
            for one in np.argsort(-height, kind="stable"):  # the smallest one last
                if height[one] < least[k[one]]:
                    place[k[one]] = phi[one]
        return place


def _neighbours(ordered: CrankAngles) -> tuple[Array, Array, Indices]:
    """Return each angle, sorted by design, the next angle of its design around the turn, and the index of that."""
    row, phi = ordered.row, ordered.phi
    first = np.searchsorted(row, row)
    last = np.append(row[1:] != row[:-1], True)[: row.size]
    after = np.where(last, first, np.arange(row.size) + 1)
    return phi, phi[after] + np.where(last, TWO_PI, 0.0), after


def largest(row: Indices, values: Array, n: int) -> Array:
    """Largest value of each design; nan for designs without one."""
    most = np.full(n, -np.inf)
    np.maximum.at(most, row, values)
    return np.where(np.isfinite(most), most, np.nan)


def where_largest(found: CrankAngles, values: Array, n: int) -> Array:
    """Angle of each design at which the value is largest; nan for designs without one."""
    order = np.argsort(values, kind="stable")
    return scattered(n, found.row[order], found.phi[order])


def scattered(n: int, row: Indices, values: Array) -> Array:
    """Expand values of some designs to all; nan for the others."""
    column = np.full(n, np.nan)
    column[row] = values
    return column


def verdict(status: NDArray[np.uint8], touching: Mask, right: NDArray[Any], wrong: NDArray[Any]) -> NDArray[np.uint8]:
    """Status of designs from the numbers of passages in the stated sense and against it."""
    return np.select(
        [status != st.OK, touching, right > 1, (right == 0) & (wrong > 0), right == 0],
        [status.astype(np.int64), st.TANGENT, st.TWICE, st.WRONG_WAY, st.NEVER], st.OK,
    ).astype(np.uint8)  # fmt: skip
