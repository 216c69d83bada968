"""Search of `true_extrema` on poses: samples, candidates, refinement and selection of the highest, block by block."""

from __future__ import annotations

import numpy as np

from kernels import status as st
from kernels.curves import samples as scan
from kernels.types import EPS, TWO_PI, Status
from sweep.families.base import Array, Family
from sweep.families.curve_features import Singular, Switches, about, switches
from sweep.numerics.panel_search import first_of_equals
from sweep.numerics.records import Indices, Mask, joined, only, put
from sweep.quantities.kinds import Request
from sweep.reductions import refine, rounding, sampling
from sweep.reductions.hidden_tops import Sampled, apart, closer_looks, dips, doubtful, tops_of
from sweep.reductions.refine import PeakCandidates, Peaks, Sampler
from sweep.reductions.resolution import MATTERS, PER_SINGULARITY, broken, denser, nearest
from sweep.reductions.window import Window, peaks_within

START = 32  # first number of samples
LIMIT = 32768  # largest number of samples, after which panels are tried
SHARE = 0.6  # a peak below this share of the highest sample is not refined
ROUGH = 0.1  # fourth difference of samples relative to their size above which they do not resolve the curve
NARROWEST = 8.0 * PER_SINGULARITY / LIMIT  # distance [rad] below which panels resolve a peak with fewer poses
BREAKING = 512  # samples from which on a rough curve may be a jump
DISAGREEMENT = 0.05  # allowed between the peak guessed from the samples and the refined one
SEARCHED = 0.25  # share of the allowed error for the search: the rest is for differences to precise poses
RIVALS = 1e-3  # peaks lower than the highest by this share of the size may turn out to be the highest
NEVER = 2**40  # more samples than are ever needed
CLOSE = 0.1  # distance of a singularity [rad] below which the effect of rounding is measured
ROUNDED = 64.0  # times what rounding the inputs changes: an error above that is one of the search
TIE = 1e-10  # relative accuracy to which peaks are compared where their places are wanted


class PeakSearch:
    """State of a search: extrema found so far, and number of samples that each design still needs."""

    def __init__(
        self, family: Family, designs: Array, requests: tuple[Request, ...], target: float, locate: bool,
        anywhere: bool, window: Window | None,
    ) -> None:  # fmt: skip
        self.family, self.designs, self.requests, self.target = family, designs, requests, target
        self.locate, self.anywhere, self.window = locate, anywhere, window
        self.found = {request: sampling.Extremum.unknown(len(designs)) for request in requests}
        self.status: Status = np.zeros(len(designs), np.uint8)
        # A discriminant is smooth whatever its sign; the motion is not smooth where it vanishes.
        self.guards = [] if anywhere else list(sampling.discriminants(family))
        position = [window.position] if window is not None else []
        curves = [request.pose for request in requests]
        self.names = list(dict.fromkeys([*curves, *position, *self.guards]))
        sharp = bool(about(family, Singular, curves))
        self.near = nearest(family, designs, curves, MATTERS) if sharp else None
        # Samples that each request still needs for each design; 0 once its extremum is found.
        fewest = (START * denser(family, designs, self.names, self.near)).astype(np.int64)
        self.undone = np.tile(fewest, (len(requests), 1))
        self.torn = np.zeros(self.undone.shape, np.bool_)  # (near) jumps and dwells, to be searched on panels
        if self.near is not None and not anywhere:
            broken(family, designs, self.near, self.status)
            self.undone[:, self.status != st.OK] = 0
            steep = (self.near.rho.min(axis=1) < NARROWEST) & (self.status == st.OK)
            self.torn[np.ix_([not request.windowed for request in requests], steep)] = True
            self.undone[self.torn] = 0

    def needed(self, rows: Indices) -> Indices:
        """Smallest number of samples that a request of these designs still needs, 0 where all are found."""
        left = np.where(self.undone[:, rows] > 0, self.undone[:, rows], NEVER).min(axis=0, initial=NEVER)
        return np.where(left < NEVER, left, 0)

    def places(self, number: Indices) -> Mask:
        """Whether the crank angles of these requests are wanted."""
        return np.array([self.locate or request.place for request in self.requests], np.bool_)[number]

    def block(self, rows: Indices, samples: int) -> None:
        """Sample some designs, and refine those that the samples resolve."""
        columns, worst, winds = sampling.sample_turn(self.family, self.designs[rows], samples, self.names)
        if self.anywhere:
            good = np.logical_and.reduce([np.isfinite(columns[name]).all(axis=1) for name in self.names])
            self.status[rows] = np.where(good, st.OK, sampling.DESIGN_STATUS[worst])
        else:
            self.status[rows] = np.where((worst == st.OK) & winds, st.NOT_OSCILLATING, sampling.DESIGN_STATUS[worst])
            good = self.status[rows] == st.OK
        self.undone[:, rows[~good]] = 0
        if not good.all():
            rows, columns = rows[good], {name: values[good] for name, values in columns.items()}
        if not rows.size:
            return
        looked = (self.undone[:, rows] > 0) & (self.undone[:, rows] <= samples)
        candidates, scales, needed, alone = self._candidates(rows, columns, samples)
        needed = np.maximum(needed, self._samples_by_singularity(columns, samples, rows.size))
        resolved = looked & ((needed <= samples) | (samples == LIMIT))
        candidates = only(candidates, resolved[candidates.request, candidates.row])
        turn = Sampled(rows, columns, samples)
        candidates, peaks = self._refine(turn, candidates, scales, resolved)
        for number, request in enumerate(self.requests):
            mine = candidates.request == number
            row, found = candidates.row[mine], only(peaks, mine)
            if self.window is not None and request.windowed:
                given = self.family, self.designs, rows, self.window, columns, request
                row, found = peaks_within(*given, row, found, resolved[number])
            again = self._keep_best(rows, request, row, found) > DISAGREEMENT * scales[number]
            self.found[request].err_phi[rows[alone[number]]] = np.pi  # any angle would do
            late = self._late(turn, number, scales[number], resolved[number] & ~alone[number])
            if samples >= BREAKING and not request.windowed:
                # Panels need a motion all over the turn, as a negative discriminant is none.
                torn = late & ~(self.anywhere & (self.found[request].value[rows] <= 0.0))
                self.torn[number, rows[torn]], alone[number, torn] = True, True
            again = (again | late) & resolved[number] & ~alone[number]
            needed[number, again] = np.maximum(needed[number, again], 2 * samples)
        # Every design is sampled LIMIT times before it is given up.
        needed = np.minimum(needed, LIMIT if samples < LIMIT else 2 * LIMIT)
        now = np.where(needed > samples, needed, 0)
        self.undone[:, rows] = np.where(looked, now, self.undone[:, rows])

    def _candidates(
        self, rows: Indices, columns: dict[str, Array], samples: int
    ) -> tuple[PeakCandidates, Array, Indices, Mask]:
        """Return candidates, sizes of the curves, samples needed, and which curves are constants, noise or jump."""
        needed, pieces = np.full((len(self.requests), rows.size), START), []
        scales, alone = np.empty(needed.shape), np.zeros(needed.shape, np.bool_)
        for number, request in enumerate(self.requests):
            values = columns[request.pose]
            allowed, share = None, SHARE
            if self.window is not None and request.windowed:
                # A maximum may lie between two samples that are both outside, beside a higher one that does not count.
                allowed, share = self.window.nears(rows, columns[self.window.position]), 0.0
                needed[number, self.window.grazed(rows, columns[self.window.position])] = 2 * samples
            scale, rough = scales[number], np.empty(rows.size)
            row, column = (np.empty(rows.size * (samples // 2 + 1), np.int64) for _ in range(2))
            count = scan.peaks(values, request.mode, share, allowed, scale, rough, row, column)
            row, column = row[:count], column[:count]
            if request.mode != 0 or self.locate or request.place:
                heights = np.abs(values) if request.mode == 0 else values
                alone[number] = rounding.measure_constants(heights, scale, rough)
            if samples >= BREAKING:
                given = self.family.precise(), self.designs[rows], request.pose
                alone[number] |= rounding.rounding_alone(*given, values, scale, rough > ROUGH)
                rough[alone[number]] = 0.0
            if samples >= BREAKING and allowed is None and (rough > ROUGH).any():
                torn = sampling.jumps(values, scale, ROUGH)
                self.torn[number, rows[torn]], alone[number, torn], rough[torn] = True, True, 0.0
            sign = np.sign(values[row, column]) if request.mode == 0 else np.full(count, float(request.mode))
            pieces.append(PeakCandidates(np.full(count, number), row, column, sign))
            needed[number, rough > ROUGH] = 2 * samples
        return joined(*pieces), scales, needed, alone

    def _samples_by_singularity(self, columns: dict[str, Array], samples: int, count: int) -> Indices:
        distance = np.full(count, np.inf)
        for name in self.guards:
            one, largest = np.empty(count), columns[name].max(axis=1)
            scan.nearest_singularity(columns[name], one)
            distance = np.where(rounding.tells(largest), np.minimum(distance, one), distance)
        # Coarse samples show a near zero only roughly: at most eight times as many samples at once.
        wanted = np.minimum(PER_SINGULARITY / np.maximum(distance, 1e-300), 8.0 * samples)
        samples_needed: Indices = np.exp2(np.ceil(np.log2(np.maximum(wanted, 1.0)))).astype(np.int64)
        return samples_needed

    def _refine(
        self, turn: Sampled, candidates: PeakCandidates, size: Array, resolved: Mask
    ) -> tuple[PeakCandidates, Peaks]:
        """Refine the candidates, and add the peaks that closer looks find beside them and beside switches."""
        spacing = np.full(candidates.row.size, TWO_PI / turn.samples)
        around = candidates.sign[:, None] * turn.around(self.requests, candidates, np.arange(-3, 4))
        first = refine.first_peaks(np.multiply(candidates.column, spacing, dtype=np.float64), spacing, around)
        peaks = self._sharpened(turn, candidates, first, size)
        # The place depends on which of several peaks is the highest, at every target.
        enough = np.where(self.places(candidates.request), min(TIE, self.target), SEARCHED * self.target)
        hidden = doubtful(candidates, peaks, around, enough * size[candidates[:2]])
        least = [request.pose for request in self.requests if request.mode == -1 and not self.anywhere]
        angles = switches(self.family, self.designs[turn.rows], least)
        beside = dips(self.requests, turn.columns, resolved)
        looks, phi = closer_looks(only(candidates, hidden), beside, angles, turn.samples)
        if len(phi):
            sample = self._sampler(self.family, turn, looks)
            more, first = tops_of(sample, looks, phi, turn.samples, peaks.guess[hidden])
            new = apart((candidates, peaks), (more, first))
            more, first = only(more, new), only(first, new)
            peaks = joined(peaks, self._sharpened(turn, more, first, size))
            candidates = joined(candidates, more)
        if self.family.precise_poses is None:
            rivals, tolerance, tied = self._rivals(turn, candidates, peaks, size[candidates[:2]])
            rivals, tolerance = rivals[tied], tolerance[tied]
            sample = self._sampler(self.family, turn, only(candidates, rivals))
            put(peaks, rivals, refine.sharpen(sample, only(peaks, rivals), tolerance, np.full(rivals.size, np.inf)))
        share = self._share(turn, candidates, peaks.phi)
        peaks = peaks._replace(err_height=peaks.err_height + share * np.abs(peaks.height))
        if self.family.precise_poses is None:
            # A quartic may fall below zero where a curve touches zero; a value at a pose is attained.
            sample = self._sampler(self.family, turn, candidates)
            return candidates, refine.attained(sample, peaks, np.arange(len(peaks.phi)))
        self._confirm(turn, candidates, peaks, size[candidates[:2]], share)
        return candidates, peaks

    def _sharpened(self, turn: Sampled, candidates: PeakCandidates, first: Peaks, size: Array) -> Peaks:
        """Refine peaks; ``size`` (r, n) are the sizes of the curves."""
        place = np.where(self.places(candidates.request), self.target, np.inf)
        tolerance = SEARCHED * self.target * size[candidates[:2]]
        return refine.sharpen(self._sampler(self.family, turn, candidates), first, tolerance, place)

    def _confirm(self, turn: Sampled, candidates: PeakCandidates, peaks: Peaks, size: Array, share: Array) -> None:
        """Replace the peaks that may be the highest by those of the family's precise poses.

        ``share`` of a height is the possible effect of rounding.
        """
        rivals, tolerance, _ = self._rivals(turn, candidates, peaks, size)
        mine, peak = only(candidates, rivals), only(peaks, rivals)
        located = self.places(mine.request)
        sample = self._sampler(self.family.precise(), turn, mine, mine.sign * peak.height)
        locate = np.full(rivals.size, np.inf)
        # Without a derivative to polish it, a place is limited by the rounding of the heights: precise poses locate it.
        bare = np.array([request.pose not in self.family.derivative_of for request in self.requests])[mine.request]
        bare &= located
        locate[bare] = self.target
        peak.err_phi[bare] = np.maximum(peak.err_phi, np.maximum(peak.step, refine.SHRINK**3 * peak.spacing))[bare]
        peak = refine.confirmed(sample, peak, tolerance, locate, share[rivals] * np.abs(peak.height))
        # The first stage of a chain gets its exact input angle, later stages a rounded one.
        blurred = self._rounding(turn, mine, self.guards[1:]) * np.abs(peak.height)
        put(peaks, rivals, peak._replace(err_height=peak.err_height + blurred))

    def _rivals(
        self, turn: Sampled, candidates: PeakCandidates, peaks: Peaks, size: Array
    ) -> tuple[Indices, Array, Mask]:
        """Select the peaks that may be the highest; their tolerances, and whether a place depends on which one is."""
        number = candidates.request
        windowed = np.array([request.windowed for request in self.requests])[number]  # those outside are dropped later
        group, doubt = number * turn.rows.size + candidates.row, peaks.err_height + RIVALS * size
        lowest = np.full(len(self.requests) * turn.rows.size, -np.inf)
        np.maximum.at(lowest, group, peaks.height - doubt)
        rivals = np.flatnonzero((peaks.height + doubt >= lowest[group]) | windowed)
        group = group[rivals]
        tied = (np.bincount(group, minlength=lowest.size)[group] > 1) & self.places(number[rivals])
        # The errors of the largest and the least value add up in a range.
        whole = np.array([1.0 if request.mode == 0 else 0.5 for request in self.requests])[number[rivals]]
        return rivals, np.where(tied, min(self.target, TIE), whole * self.target) * size[rivals], tied

    def _sampler(
        self, family: Family, turn: Sampled, candidates: PeakCandidates, middle: Array | None = None
    ) -> Sampler:
        """Make a function that evaluates candidates by the poses of ``family``.

        An angle is continued from ``middle`` (k,), by default the sample at the candidate.
        """
        number, row, _, sign = candidates
        if middle is None:
            middle = turn.around(self.requests, candidates, np.zeros(1, np.intp))[:, 0]

        def sample(active: Indices, phi: Array) -> Array:
            designs = turn.rows[row[active]]
            poses, status = sampling.pose_columns(family, self.designs[designs], phi, self.names)
            if not self.anywhere:
                bad = status != st.OK
                hit = bad.any(axis=1)
                self.status[designs[hit]] = sampling.DESIGN_STATUS[status[hit, bad[hit].argmax(axis=1)]]
            out = np.empty(phi.shape)
            for k, request in enumerate(self.requests):
                mine = number[active] == k
                values = sampling.continued(
                    self.family, request.pose, poses[request.pose][mine], middle[active][mine, None]
                )
                out[mine] = sign[active][mine, None] * values
            return out

        return sample

    def _rounding(self, turn: Sampled, candidates: PeakCandidates, guards: list[str]) -> Array:
        """Share of a value by which rounding may have changed it and its neighbours alike."""
        given = self.designs[turn.rows], turn.columns, candidates.row, candidates.column
        return rounding.rounding_share(self.family, *given, guards, self._orders(candidates))

    def _share(self, turn: Sampled, candidates: PeakCandidates, phi: Array) -> Array:
        """Share of values at the angles phi (k,) that rounding may have changed, near other singularities too."""
        share = self._rounding(turn, candidates, self.guards)
        if self.near is not None:
            near = only(self.near, turn.rows[candidates.row])
            share += rounding.singular_share(near, phi, self._orders(candidates))
        return share

    def _late(self, turn: Sampled, number: int, size: Array, which: Mask) -> Mask:
        """Whether extrema of some designs of the block miss their target by more than rounding explains, (r,)."""
        request, found = self.requests[number], only(self.found[self.requests[number]], turn.rows)
        late: Mask = which & (found.err > self.target * size)
        row = np.flatnonzero(late)
        if row.size:
            phi = found.phi[row]
            column = np.rint(phi * (turn.samples / TWO_PI)).astype(np.int64) % turn.samples
            here = PeakCandidates(np.full(row.size, number), row, column, np.ones(row.size))
            off = rounding.shaken_anywhere(self.family, self.designs[turn.rows[row]], phi, request.pose)
            known = 2.0 * self._share(turn, here, phi) * np.abs(found.value[row]) + ROUNDED * off
            late[row] = found.err[row] > known
        return late

    def _orders(self, candidates: PeakCandidates) -> Indices:
        """Order of derivative of each candidate; a discriminant rounds like a position."""
        orders = [0 if self.anywhere else rounding.order_of(self.family, r.pose) for r in self.requests]
        return np.array(orders)[candidates.request]

    def _keep_best(self, rows: Indices, request: Request, row: Indices, peaks: Peaks) -> Array:
        """Store the highest candidate of each row; return its distance from the first guess (0 where none)."""
        best, which = np.full(rows.size, -np.inf), np.full(rows.size, -1)
        scan.best_candidate(row, peaks.height, best, which)
        has, found = which >= 0, self.found[request]
        chosen = which[has]
        found.value[rows[has]] = peaks.height[chosen] * (-1.0 if request.mode == -1 else 1.0)
        ceiling = np.full(rows.size, -np.inf)
        np.maximum.at(ceiling, row, peaks.height + peaks.err_height)
        # A less accurate maximum may be higher.
        err = np.maximum(peaks.err_height[chosen], ceiling[has] - peaks.height[chosen])
        located, rounded, off = self.locate or request.place, rounding.plain(self.family), np.zeros(rows.size)
        if (located or rounded) and chosen.size:
            given = self.family.precise() if rounded else self.family
            off[has] = rounding.shaken(given, self.designs[rows[has]], peaks.phi[chosen], request.pose)
        if rounded and chosen.size:
            # Badly scaled designs lose digits before any discriminant is computed.
            err = np.maximum(err, rounding.CANCELLED * off[has])
            if self.near is not None:
                err += np.where(
                    only(self.near, rows[has]).distance(peaks.phi[chosen]) < CLOSE, refine.VARIES * off[has], 0.0
                )
        found.err[rows[has]] = err
        moved = np.zeros(rows.size)
        moved[has] = np.abs(peaks.height[chosen] - peaks.guess[chosen])
        if located:
            alike = refine.VARIES * (off[row] + 4.0 * EPS * np.abs(peaks.height))
            err_height = np.maximum(peaks.err_height, alike)
            chosen = first_of_equals(row, peaks.phi, peaks.err_phi, peaks.height, err_height, chosen)
        phi, err_phi = peaks.phi[chosen], peaks.err_phi[chosen]
        slope = self.family.derivative_of.get(request.pose)
        if located and slope is not None and not request.windowed:
            phi, err_phi = refine.polished(self.family, self.designs[rows[has]], slope, phi, err_phi)
        found.phi[rows[has]] = np.mod(phi, TWO_PI)
        found.err_phi[rows[has]] = err_phi
        if located and not request.windowed and about(self.family, Switches, (request.pose,)):
            dwells = refine.dwells(self.family, self.designs[rows[has]], request.pose, phi)
            self.torn[self.requests.index(request), rows[has]] |= dwells
        return moved
