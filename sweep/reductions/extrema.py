"""True extrema over one turn of any pose output of any family; docs/internals/extrema.md.

Curves are sampled, refined between the samples, and sampled more densely where the samples do not resolve them.  Fused
chains have one kernel for that, and a smooth curve of expensive poses is represented by the Fourier series of its
samples; all other curves, and undecided designs, are searched on poses alone.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from kernels import status as st
from kernels.types import Status
from sweep.families.base import Array, Family
from sweep.families.curve_features import Singular, about, crossed
from sweep.numerics.panel_search import measured
from sweep.numerics.records import Mask, only, put
from sweep.quantities.kinds import Request
from sweep.reductions import fused, panels, peak_search
from sweep.reductions.peak_search import LIMIT
from sweep.reductions.resolution import series_of
from sweep.reductions.sampling import Extremum, blocks
from sweep.reductions.window import Window

OVER = 1e-6  # distance of a limit position from the angle's branch cut [rad] that counts as beyond it
HARD = 512  # first number of samples for designs that the fused search has left undecided


def true_extrema(
    family: Family,
    designs: Array,
    requests: Sequence[Request],
    target: float,
    *,
    locate: bool = False,
    anywhere: bool = False,
    window: Window | None = None,
) -> tuple[dict[Request, Extremum], Status]:
    """Compute refined extrema over one turn.

    Parameters
    ----------
    family, designs : the (n, P) design matrix of any family
    requests : the requested extrema of pose outputs
    target : relative accuracy of each value
    locate : whether all crank angles are wanted, not only those of requests with ``place``
    anywhere : the requested pose outputs are defined also where the links do not reach (discriminants): the whole turn
        counts whatever its status, and only nan in it makes the extremum nan
    window : for windowed requests, the range of positions whose poses count

    Returns
    -------
    extrema : per request; nan where the status is not OK, except NOT_CONVERGED, which keeps its best value
    status : (n,) OK; NOT_ROTATABLE, UNDECIDABLE, SINGULAR, INVALID_INPUT from poses met by the search; NOT_OSCILLATING
        for an angle without an extremum; NOT_CONVERGED where neither 32768 samples nor panels resolve it.  Dead points
        between the samples are found by the margin (`sweep.reductions.margins`).

    Notes
    -----
    The search from poses starts with 32 samples.  A design is sampled again, with twice as many or more, if the fourth
    difference of its samples exceeds a tenth of their size, if their spacing exceeds a twelfth of the distance of the
    nearest complex zero of a discriminant, or if refinement moved the peak by more than 5 % of its height.
    """
    found: dict[Request, Extremum] = {}
    status = np.zeros(len(designs), np.uint8)
    for part, now in _parts(family, designs, requests, target, locate, anywhere, window):
        found |= part
        status = np.where(status == st.OK, now, status)
    lost = (status != st.OK) & (status != st.NOT_CONVERGED)
    if lost.any():  # extrema of failed designs
        for extremum in found.values():
            for column in extremum:
                column[lost] = np.nan
    return found, status


def _parts(
    family: Family, designs: Array, requests: Sequence[Request], target: float, locate: bool, anywhere: bool,
    window: Window | None,
) -> Iterator[tuple[dict[Request, Extremum], Status]]:  # fmt: skip
    """Yield the extrema in groups that are searched in the same way, each with the status that it gives the designs."""
    alike: dict[tuple[object, ...], list[Request]] = {}
    for request in requests:
        jumps = crossed(family, designs, () if anywhere else (request.pose,))
        alike.setdefault((jumps.tobytes(), *about(family, Singular, (request.pose,))), []).append(request)
    if len(alike) > 1:
        for some in alike.values():
            yield true_extrema(family, designs, some, target, locate=locate, anywhere=anywhere, window=window)
        return
    jumping = crossed(family, designs, () if anywhere else [request.pose for request in requests])
    if jumping.any() and not jumping.all():
        yield _apart(family, designs, requests, target, locate, window, jumping)
        return
    left, kinked, answered, opened = [], [], set[Request](), None
    for request in requests:
        if request in answered:
            continue
        if not anywhere and panels.has_kinks(family, request, bool(jumping.any())):
            kinked.append(request)
            continue
        quickly = not locate and not request.windowed
        curve = (fused.curve_of(family, request, anywhere) or series_of(family, request)) if quickly else None
        if curve is None:
            left.append(request)
            continue
        if isinstance(curve, fused.FusedCurve):
            opened = opened or curve.opened(designs)
            both = fused.together(curve, requests)
            found_both = fused.extrema(both, designs, target, opened)
            answers = {one.request: answer for one, answer in zip(both, found_both, strict=True)}
        else:
            answers = {request: curve.extremum(designs, target)}
        for one, (quick, now, undecided) in answers.items():
            rows = np.flatnonzero(undecided)
            if rows.size:
                slow, now[rows] = _searched(family, designs[rows], [one], target, locate, anywhere, None, HARD)
                put(quick, rows, slow[one])
            answered.add(one)
            yield {one: quick}, now
    if kinked:
        yield panels.extrema(family, designs, kinked, target, locate)
    if left:
        yield _searched(family, designs, left, target, locate, anywhere, window)


def _apart(
    family: Family, designs: Array, requests: Sequence[Request], target: float, locate: bool, window: Window | None,
    apart: Mask,
) -> tuple[dict[Request, Extremum], Status]:  # fmt: skip
    """Compute `true_extrema` separately for designs with jumps (``apart``) and without."""
    found = {request: Extremum.unknown(len(designs)) for request in requests}
    status = np.zeros(len(designs), np.uint8)
    for rows in (np.flatnonzero(apart), np.flatnonzero(~apart)):
        part = None if window is None else window.only(rows)
        some, status[rows] = true_extrema(family, designs[rows], requests, target, locate=locate, window=part)
        for request, extremum in some.items():
            put(found[request], rows, extremum)
    return found, status


def _searched(
    family: Family, designs: Array, requests: Sequence[Request], target: float, locate: bool, anywhere: bool,
    window: Window | None, start: int | None = None,
) -> tuple[dict[Request, Extremum], Status]:  # fmt: skip
    """Compute `true_extrema` from poses alone, beginning with ``start`` samples; failed designs keep their values."""
    search = peak_search.PeakSearch(family, designs, tuple(requests), target, locate, anywhere, window)
    pending, samples = np.arange(len(designs)), start or peak_search.START
    while pending.size:
        for rows in blocks(pending[search.needed(pending) <= samples], samples, len(search.names)):
            search.block(rows, samples)
        pending = pending[search.needed(pending) > 0]
        if samples == LIMIT:  # panels resolve more, but not the ends of a window
            late = search.undone[:, pending] > 0
            even = np.array([anywhere or request.windowed for request in requests])
            search.status[pending[late[even].any(axis=0)]] = st.NOT_CONVERGED
            search.torn[:, pending] |= late & ~even[:, None]
            break
        samples *= 2
    for request, torn in zip(requests, search.torn, strict=True):
        rows, found = np.flatnonzero(torn), search.found[request]
        if rows.size:
            cut, now = panels.extrema(family, designs[rows], [request], target, locate)
            if family.pose_output[request.pose].wraps:  # where it all but jumps to its cut it may have passed it
                cut_off = np.abs(np.abs(cut[request].value) - np.pi) < 2.0 * cut[request].err + OVER
                now = np.where((now == st.OK) & cut_off, st.NOT_CONVERGED, now)
            seen, height = (measured(x, request.mode) for x in (found.value[rows], cut[request].value))
            missed = seen - found.err[rows] > height + cut[request].err  # a peak that only the even samples saw
            now = np.where((now == st.OK) & missed, st.NOT_CONVERGED, now)
            search.status[rows] = np.where(search.status[rows] == st.OK, now, search.status[rows])
            put(found, rows[~missed], only(cut[request], ~missed))
    return search.found, search.status
