"""True extrema of curves with kinks and jumps: panels of a turn, halved wherever the curve may have its maximum.

Friction changes its direction where a joint stops turning.  There loads jump or have a kink, and between two such
places a curve may rise and fall within a hundredth of a radian.  So the turn is cut where the followers reverse, which
are roots of known functions, and into even panels between.  On each panel a polynomial interpolates the poses; a panel
whose polynomial plus its error bound stays below the highest pose is discarded.  The others are halved until the poses
of both halves agree with the polynomial before (docs/internals/extrema.md).
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.polynomial import chebyshev

from kernels import status as st
from kernels.types import EPS, TWO_PI, Status
from sweep.families.base import Array, Family
from sweep.families.curve_features import Bends, Singular, Switches, about, bends
from sweep.numerics.chebyshev import DENSE, NODES, at_nodes, basis, product, rising, summits
from sweep.quantities.kinds import Request
from sweep.reductions.refine import hill
from sweep.reductions.resolution import MATTERS, ends, nearest, zeros
from sweep.reductions.rounding import ALONE, PLACES, order_of, rounding_by_pieces, shaken_anywhere, singular_share
from sweep.reductions.sampling import (
    Extremum,
    Index,
    blocks,
    continued,
    discriminants,
    only,
    pose_columns,
    unwrapped,
    worst_of_pieces,
)

PANELS = 64  # first even panels of a turn, besides cuts where a follower reverses
TAIL = 4  # last coefficients that bound a polynomial's error; for a tent in the middle three of them nearly vanish ...
CAREFUL = 3.0  # ... times this: a tent's tip, anywhere on the panel, is up to 2.91 times their sum above the others
LATELY = 0.25  # share of the previous polynomial's error in the bound: halving a panel halves the error of a kink
# Next to a reversal the sign of friction comes from a speed that is only rounding: nearer poses are noise.
NARROWEST = 1e-11  # width of a panel [rad] that can only hold a jump
VANISHED = 1e-4  # share of the size below which a root counts as a zero: of a cube root of forces of 1e-12
EDGE = 2.0**17  # times EPS of the size: change over NARROWEST/4 of a curve with a slope of six sizes per radian
CROWD = 48  # number of small panels of one curve beyond which only rounding is being halved
ALLOWED = 1.0 / 32.0  # share of the target by which two successive polynomials may differ
LEVEL = 16.0  # times EPS of a value: most by which the poses of a level curve miss the polynomial through them, 10.7
AGAIN = 8.0  # factor from that difference to the claimed error: poses may see only 1/8 of a kink between them
STEADY = 10.0 * AGAIN  # times EPS of a value: largest error claimed for a curve that is constant but for rounding
SLOPE = 2.0 * (NODES - 1) ** 2  # bound of the slope of a polynomial bounded by 1 on a panel of width 1 (Markov)


class Panels(NamedTuple):
    """Panels of several curves, each (k,).

    Row of the curve; ends [rad]; coefficients (k, NODES); highest pose on the panel and its place [rad]; difference
    between the poses and the polynomial of the panel before it was halved.
    """

    row: Index
    low: Array
    high: Array
    series: Array
    peak: Array
    at: Array
    missed: Array


class Top(NamedTuple):
    """Maxima of k panels: place [rad], value, error of the value, error of the place [rad]."""

    row: Index
    phi: Array
    value: Array
    err: Array
    err_phi: Array


def has_kinks(family: Family, request: Request, jumps: bool = False) -> bool:
    """Whether an extremum is searched on panels; with ``jumps`` all curves of these designs may jump."""
    output = family.pose_output[request.pose]
    if output.wraps:  # samples find the heights of an angle, but not how long it dwells
        kinked = request.place and bool(about(family, Switches, (request.pose,)))
    else:
        kinked = output.kinks or output.jumps or jumps
    return kinked and not request.windowed


def extrema(
    family: Family, designs: Array, requests: Sequence[Request], target: float, locate: bool
) -> tuple[dict[Request, Extremum], Status]:
    """Compute extrema over one turn of curves with kinks and jumps.

    Parameters
    ----------
    family, designs : the (n, P) design matrix
    requests : requested extrema
    target : relative accuracy; of a place [rad]
    locate : whether all crank angles are wanted

    Returns
    -------
    extrema : values are suprema: beside a jump the limit from its higher side
    status : (n,) OK; status of the turn's poses; NOT_CONVERGED where an error exceeds both the target and the rounding
        of the poses
    """
    n = len(designs)
    found = {request: Extremum.unknown(n) for request in requests}
    status: Status = np.zeros(n, np.uint8)
    for rows in blocks(np.arange(n), 2 * PANELS * NODES, len(requests)):
        for some in _cut_alike(family, requests):
            now = _block(family.precise(), designs, rows, target, {request: found[request] for request in some}, locate)
            status[rows] = np.where(status[rows] == st.OK, now, status[rows])
    return found, status


def _cut_alike(family: Family, requests: Sequence[Request]) -> list[list[Request]]:
    """Group the requests whose curves are cut at the same crank angles."""
    groups: dict[tuple[Bends, ...], list[Request]] = {}
    for request in requests:
        groups.setdefault(bends(family, request.pose), []).append(request)
    return list(groups.values())


def _block(
    family: Family, designs: Array, rows: Index, target: float, found: dict[Request, Extremum], locate: bool
) -> Status:
    """Search the curves of some designs; fill ``found`` and return their status."""
    guards = discriminants(family)
    names = list(dict.fromkeys([*(request.pose for request in found), *guards]))
    row, low, high = _cut(family, designs[rows], names[0])
    poses, each = pose_columns(family, designs[rows[row]], _places(low, high), names)
    status = worst_of_pieces(row, each, rows.size)
    good = status[row] == st.OK
    if not good.any():
        return status
    row, low, high = row[good], low[good], high[good]
    for request, answer in found.items():
        values = poses[request.pose][good]
        if family.pose_output[request.pose].wraps:
            values, winds = unwrapped(row, values)
            status[row[winds]] = st.NOT_OSCILLATING
        panels = _fitted(row, low, high, values, request.mode)
        top, size = _climbed(family, designs[rows], panels, request, target, locate or request.place)
        dead = {name: poses[name][good] for name in (guards[1:] if family.precise_poses else guards)}
        rounding = rounding_by_pieces(dead, row, top.row) * np.abs(top.value)
        lost = np.zeros(top.row.size, np.bool_)  # no correct digit next to a singularity
        if about(family, Singular, (request.pose,)):
            near = nearest(family, designs[rows[top.row]], (request.pose,), MATTERS)
            order = np.full(top.row.size, order_of(family, request.pose))
            share = singular_share(near, top.phi, order)
            rounding, lost = rounding + share * np.abs(top.value), share >= 1.0
        # the range of a constant curve is rounding, which no target can refer to
        allowed = np.maximum(target * size[top.row], STEADY * EPS * np.abs(top.value))
        if request.mode == -1:
            _vanish(family, designs[rows], request.pose, top, size)
        if family.pose_output[request.pose].jumps:  # piecewise constant: a polynomial only adds rounding
            beside = top.phi[:, None] + NARROWEST * np.array([-1.0, 0.0, 1.0])  # it may jump at the place itself
            near_by, _ = pose_columns(family, designs[rows[top.row]], beside, [request.pose])
            heights = _measured(near_by[request.pose], request.mode)
            side = np.abs(heights - top.value[:, None]).argmin(axis=1)
            top = top._replace(value=np.take_along_axis(heights, side[:, None], axis=1)[:, 0])
        late = np.flatnonzero(lost | ((top.err > allowed) & (top.err > rounding)))
        # Not at the place itself: at a pole rounding moves the height by as much as itself.
        off = shaken_anywhere(family, designs[rows[top.row[late]]], top.phi[late] + np.pi / PLACES, request.pose)
        noise = off >= ALONE * size[top.row[late]]
        top.err[late[noise]] = np.maximum(top.err[late], off)[noise]
        late = late[~noise]
        status[top.row[late]] = np.where(status[top.row[late]] == st.OK, st.NOT_CONVERGED, status[top.row[late]])
        at = rows[top.row]
        answer.value[at] = 0.0 - top.value if request.mode == -1 else top.value
        answer.phi[at], answer.err[at], answer.err_phi[at] = np.mod(top.phi, TWO_PI), top.err + rounding, top.err_phi
    return status


def _vanish(family: Family, designs: Array, pose: str, top: Top, size: Array) -> None:
    """Set the minimum to 0, in place, for curves with a known zero, like the square root of a squared distance."""
    row, phi = zeros(family, designs, pose)
    values, _ = pose_columns(family, designs[row], phi[:, None], [pose])
    passes = values[pose][:, 0] <= VANISHED * size[row]  # at a jump the function changes its sign without a zero
    first = np.full(len(designs), np.inf)
    np.minimum.at(first, row[passes], np.mod(phi[passes], TWO_PI))
    at = np.flatnonzero(first[top.row] < np.inf)
    top.phi[at], top.value[at], top.err[at], top.err_phi[at] = first[top.row[at]], 0.0, 0.0, NARROWEST


def _cut(family: Family, designs: Array, output: str) -> tuple[Index, Array, Array]:
    """Design index and ends of the first panels for curves of a pose output."""
    edges = ends(family, designs, PANELS, PANELS * NODES, output)
    low, high = edges[:, :-1], edges[:, 1:]
    row, column = np.nonzero(high - low > NARROWEST)
    return row, low[row, column], high[row, column]


def _climbed(
    family: Family, designs: Array, panels: Panels, request: Request, target: float, locate: bool
) -> tuple[Top, Array]:
    """Find the maximum of every curve that has panels; also return the sizes of the curves."""
    n = len(designs)
    best, least = np.full(n, -np.inf), np.full(n, np.inf)
    np.maximum.at(best, panels.row, panels.peak)
    np.minimum.at(least, panels.row, _measured(at_nodes(panels.series), request.mode).min(axis=1))
    size = best if request.mode == 0 else best - least
    tops: list[Top] = []
    while panels.row.size:
        # Of tops as high as each other none is dropped by rounding.
        level = LEVEL * EPS * np.maximum(np.abs(best), size)
        panels = only(panels, _upper(panels, request.mode) >= (best - level)[panels.row])
        # The even first panels may all be within the target: a constant, or a dwell.
        crowded = panels.high - panels.low < 0.25 * TWO_PI / PANELS
        crowded &= np.bincount(panels.row[crowded], minlength=n)[panels.row] > CROWD
        tops.append(_given_up(only(panels, crowded), request.mode))
        panels = only(panels, ~crowded)
        halves, miss = _halved(family, designs, panels, request)
        np.maximum.at(best, halves.row, halves.peak)
        tolerance = np.maximum(ALLOWED * target * size, 4.0 * EPS * np.abs(best))[halves.row]
        narrow = halves.high - halves.low < NARROWEST
        top = _tops(halves, request.mode, AGAIN * miss)
        settled, at_end = miss <= tolerance, (top.phi <= halves.low) | (top.phi >= halves.high)
        if locate:
            settled &= (top.err_phi <= target) | at_end | (miss <= level[halves.row])
        off = _off(family, designs, halves, top, request, np.flatnonzero(settled & ~narrow))
        settled &= off <= tolerance
        top.err[:] += AGAIN * off + np.where(at_end, EDGE, 4.0) * EPS * size[halves.row]
        ends = only(halves, narrow)
        held = _held(ends, np.repeat(panels.peak, 2)[narrow], size)
        held.err[:] += AGAIN * _beside(family, designs, ends, request)
        tops += [only(top, settled & ~narrow), held]
        panels = only(halves, ~settled & ~narrow)
    return _highest(tops, n), size


def _halved(family: Family, designs: Array, panels: Panels, request: Request) -> tuple[Panels, Array]:
    """Halve each panel; also return the largest difference between the new poses and the panel's polynomial."""
    middle = 0.5 * (panels.low + panels.high)
    low, high = (np.stack(ends, axis=1).ravel() for ends in ((panels.low, middle), (middle, panels.high)))
    row = np.repeat(panels.row, 2)
    values = np.empty((row.size, NODES))
    for some in blocks(np.arange(row.size), NODES):
        poses, _ = pose_columns(family, designs[row[some]], _places(low[some], high[some]), [request.pose])
        middle = np.repeat(panels.series[:, :1], 2, axis=0)[some]
        values[some] = continued(family, request.pose, poses[request.pose], middle)
    nodes, _ = basis()
    inner = np.concatenate([0.5 * (nodes - 1.0), 0.5 * (nodes + 1.0)])
    before = product(panels.series, rising(inner))
    miss = np.abs(values.reshape(-1, 2 * NODES) - before).max(axis=1)
    halves = _fitted(row, low, high, values, request.mode)
    # The highest pose may be isolated, as at the place of a jump: the half that contains it keeps it.
    peak, at = np.repeat(panels.peak, 2), np.repeat(panels.at, 2)
    kept = (peak > halves.peak) & (low <= at) & (at <= high)
    best, at, miss = np.where(kept, peak, halves.peak), np.where(kept, at, halves.at), np.repeat(miss, 2)
    return halves._replace(peak=best, at=at, missed=miss), miss


def _off(family: Family, designs: Array, panels: Panels, top: Top, request: Request, which: Index) -> Array:
    """Difference between maxima and poses at their places: no other pose sees a kink next to an end."""
    off, place = np.zeros(top.row.size), _inside(top.phi, panels.low, panels.high)
    for some in blocks(which, 1):
        poses, _ = pose_columns(family, designs[top.row[some]], place[some, None], [request.pose])
        here = continued(family, request.pose, poses[request.pose][:, 0], panels.series[some, 0])
        off[some] = np.abs(_measured(here, request.mode) - top.value[some])
    return off


def _tops(panels: Panels, mode: int, err: Array) -> Top:
    """Maxima of the polynomials, whose heights are off by ``err`` at most; on a level one they may be anywhere."""
    uneven = np.abs(panels.series[:, 1:]).sum(axis=1) > 4.0 * EPS * np.abs(panels.series[:, 0])
    series, half = panels.series[uneven], 0.5 * (panels.high - panels.low)
    x, value, blur = np.zeros(half.size), panels.peak.copy(), np.ones(half.size)
    x[uneven], value[uneven] = summits(series, mode)
    derived = (chebyshev.chebder(series, order, axis=1).T for order in (1, 2))
    slope, bow = (np.abs(chebyshev.chebval(x[uneven], of, tensor=False)) for of in derived)
    # The slope bounds the error of a place at an end, the bend that of a place inside; poses avoid a jump at the end.
    inside = np.abs(x) < 1.0
    held = np.where(inside[uneven], bow / SLOPE, slope)
    blur[uneven] = np.minimum(np.divide(err[uneven], held, out=np.full(slope.size, 2.0), where=held > 0.0), 2.0)
    err_phi = half * blur + np.where(inside, 0.0, 0.5 * NARROWEST) + 8.0 * EPS * np.pi
    return Top(panels.row, 0.5 * (panels.low + panels.high) + half * x, value, err + 4.0 * EPS * np.abs(value), err_phi)


def _held(panels: Panels, before: Array, size: Array) -> Top:
    """Highest poses of panels at the limit of resolvable crank angles; ``before`` are those before halving."""
    err = np.abs(panels.peak - before) + EDGE * EPS * size[panels.row] + 4.0 * EPS * np.abs(panels.peak)
    return Top(panels.row, panels.at, panels.peak, err, panels.high - panels.low + 8.0 * EPS * np.pi)


def _beside(family: Family, designs: Array, panels: Panels, request: Request) -> Array:
    """Smaller of the differences between the highest poses of narrow panels and the poses on either side.

    Beside a jump the curve is level on its higher side.  Next to a cusp it rises further where no pose can be, by as
    much again, and by a few times that where it rises like a small power of the distance.
    """
    off = np.zeros(panels.row.size)
    for some in blocks(np.arange(panels.row.size), 2):
        both = panels.at[some, None] + NARROWEST * np.array([-1.0, 1.0])
        poses, _ = pose_columns(family, designs[panels.row[some]], both, [request.pose])
        values = continued(family, request.pose, poses[request.pose], panels.series[some, :1])
        heights = _measured(values, request.mode)
        off[some] = np.abs(heights - panels.peak[some, None]).min(axis=1)
    return off


def _given_up(panels: Panels, mode: int) -> Top:
    """Highest poses of panels that are no longer halved, with the upper bounds of their polynomials as error."""
    return Top(panels.row, panels.at, panels.peak, _upper(panels, mode) - panels.peak, panels.high - panels.low)


def _highest(tops: list[Top], n: int) -> Top:
    """Select the highest maximum of each row; rivals that may be higher increase its error and that of its place."""
    every = Top(*(np.concatenate(parts) for parts in zip(*tops, strict=True)))
    order = np.lexsort((every.phi, -every.value, every.row))
    row, first = np.unique(every.row[order], return_index=True)
    highest, ceiling = only(every, order[first]), np.full(n, -np.inf)
    np.maximum.at(ceiling, every.row, every.value + every.err)
    phi, err_phi = hill(every.row, every.phi, every.err_phi, every.value, every.err, order[first])
    return highest._replace(err=np.maximum(highest.err, ceiling[row] - highest.value), phi=phi, err_phi=err_phi)


def _upper(panels: Panels, mode: int) -> Array:
    """Estimate an upper bound of a curve on each panel from its coefficients."""
    dense = _measured(product(panels.series, rising(np.linspace(-1.0, 1.0, DENSE))), mode)
    doubt = CAREFUL * np.abs(panels.series[:, -TAIL:]).sum(axis=1) + LATELY * panels.missed
    between = np.maximum(-np.diff(dense, 2, axis=1).min(axis=1), 0.0) / 8.0  # a parabola rises so far between points
    upper: Array = np.maximum(dense.max(axis=1) + between, panels.peak) + doubt
    return upper


def _measured(values: Array, mode: int) -> Array:
    measured: Array = np.abs(values) if mode == 0 else mode * values
    return measured


def _places(low: Array, high: Array) -> Array:
    """Nodes of panels, kept off the ends, where the curve may already have jumped."""
    places = 0.5 * (low + high)[:, None] + 0.5 * (high - low)[:, None] * basis()[0]
    return _inside(places, low[:, None], high[:, None])


def _inside(phi: Array, low: Array, high: Array) -> Array:
    return np.clip(phi, low + 0.25 * NARROWEST, high - 0.25 * NARROWEST)


def _fitted(row: Index, low: Array, high: Array, values: Array, mode: int) -> Panels:
    """Make panels with the polynomials through their poses."""
    measured, every = _measured(values, mode), np.arange(row.size)
    top = measured.argmax(axis=1)
    series: Array = product(values, basis()[1].T)
    return Panels(row, low, high, series, measured[every, top], _places(low, high)[every, top], np.zeros(row.size))
