"""Root mean square over one turn of any pose output: the trapezoid rule on ever finer uniform grids, or panels.

For a smooth periodic curve the rule converges faster than any power of the number of samples, so the change from one
grid to the next, twice as fine, bounds what is left, once the grid resolves the distance of the nearest singularity.
Curves that no such grid resolves, or that have kinks or jumps, are integrated on panels that are halved where needed.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from kernels import status as st
from kernels.curves import samples as scan
from kernels.types import EPS, TWO_PI, Status
from sweep.families.base import Accuracy, Array, Columns, Family
from sweep.families.curve_features import Singular, Switches, crossed, singular_curves
from sweep.numerics.events import with_events
from sweep.numerics.quadrature import integrate
from sweep.numerics.singularities import Singularities, crowded, steps, turn_edges
from sweep.quantities.kinds import Request
from sweep.reductions.fused import curve_of
from sweep.reductions.peak_search import LIMIT, START
from sweep.reductions.resolution import denser, ends, nearest
from sweep.reductions.sampling import DESIGN_STATUS, Index, blocks, discriminants, pose_columns, sample_turn

KINKED = 1e-2  # relative change of a mean from which on its convergence tells kinks from smooth curves
SHIFT = 0.37  # of their spacing: how far samples stand aside that tell whether two grids agree by chance
NEAR = 0.3  # distance of a singularity [rad] as samples see it, from which on it is looked at closely
PER_SINGULARITY = 12.0  # samples per distance of it, below which two grids may agree and both miss a peak
PANEL = 1.0  # length of the first panels against that distance; the rule of 15 points errs by 1e-13 there
PANELS_AT_ONCE = 1024
LOOKS = 512  # samples among which a curve with kinks or jumps is searched for what cuts it
EVEN = 16  # first panels of a curve with kinks or jumps, beside those between its known ones
KNOWN = 4  # of one all of whose kinks are known
PREFIX = "rms_"


def mean_squares(family: Family, designs: Array, names: Sequence[str], accuracy: Accuracy) -> Columns:
    """Root mean squares over one turn, on samples, or refined until they have settled.

    Parameters
    ----------
    family, designs : the (n, P) design matrix of any family
    names : ``rms_x`` of pose outputs x
    accuracy : dense grid, or relative error

    Returns
    -------
    Columns
        the names and ``err_<name>`` (nan on samples), each (n,), and ``status``: as of extrema, NOT_CONVERGED where
        neither grids nor panels settle the value; it stays, with its error.  Errors include the rounding of the poses.
    """
    n, poses = len(designs), [name.removeprefix(PREFIX) for name in names]
    if accuracy.samples is not None:
        found, status = _on_grid(family, designs, np.arange(n), accuracy.samples, poses)
        return _columns(names, found, np.full_like(found, np.nan), status)
    assert accuracy.target is not None
    columns: Columns = {}
    status = np.zeros(n, np.uint8)
    for name, pose in zip(names, poses, strict=True):
        # Each by itself, so that no bit of it depends on what is wanted beside it.
        found, err, now = _of_one(family, designs, pose, accuracy.target)
        columns |= {name: found, f"err_{name}": err}
        status = np.where(status == st.OK, now, status)
    return columns | {"status": status}


def _of_one(family: Family, designs: Array, pose: str, target: float) -> tuple[Array, Array, Status]:
    """Means of one pose output and their errors (n,), and the status: of a fused chain by its kernel, else by poses."""
    known = family.pose_output[pose]
    curve = None if known.kinks or known.jumps else curve_of(family, Request(pose, 0), False, mean=True)
    if curve is None:
        found, errors, status = _refined(family, designs, [pose], target)
        return found[:, 0], errors[:, 0], status
    mean, err, status, undecided = curve.mean(designs, target)
    rows = np.flatnonzero(undecided | crossed(family, designs))
    if rows.size:
        found, errors, status[rows] = _refined(family, designs[rows], [pose], target)
        mean[rows], err[rows] = found[:, 0], errors[:, 0]
    return mean, err, status


def _refined(family: Family, designs: Array, poses: Sequence[str], target: float) -> tuple[Array, Array, Status]:
    """Means and their errors (n, q), and the status."""
    n = len(designs)
    found, status = _on_grid(family, designs, np.arange(n), START, poses)
    err = np.full_like(found, np.nan)
    alive = np.flatnonzero(status == st.OK)
    near = _singularities(family, designs[alive])
    needed = np.zeros(n)
    needed[alive] = PER_SINGULARITY / near.rho.min(axis=1, initial=np.inf)
    needed = np.maximum(needed, START * denser(family, designs))
    kinks = any(family.pose_output[pose].kinks or family.pose_output[pose].jumps for pose in poses)
    jumping = np.full(n, kinks) | crossed(family, designs)
    needed[jumping] = np.inf
    unresolved = _by_grids(family, designs, poses, target, found, err, status, needed)
    settled = np.setdiff1d(np.flatnonzero(status == st.OK), unresolved)
    rounding = _rounding(family, designs[settled], poses, near.only(np.searchsorted(alive, settled)))
    err[settled] += rounding
    if family.precise_poses is not None:
        # Panels are made of the most accurate poses there are: they serve where rounding is too much as well.
        rough = rounding > np.maximum(target, 64.0 * EPS) * found[settled]
        unresolved = np.concatenate([unresolved, settled[rough.any(axis=1)]])
    for k in range(0, unresolved.size, PANELS_AT_ONCE):
        rows = unresolved[k : k + PANELS_AT_ONCE]
        edges = turn_edges(near.only(np.searchsorted(alive, rows)), PANEL)
        if jumping[rows].any():
            even = KNOWN if family.every(Switches) and poses[0] not in family.dear else EVEN
            cut = ends(family, designs[rows[jumping[rows]]], even, LOOKS, poses[0])
            which = np.repeat(np.flatnonzero(jumping[rows]), cut.shape[1])
            edges = with_events(edges, which, cut.ravel())
        found[rows], err[rows], status[rows] = _on_panels(family, designs[rows], poses, edges, target)
    lost = (status != st.OK) & (status != st.NOT_CONVERGED)
    found[lost], err[lost] = np.nan, np.nan
    return found, err, status


def _by_grids(
    family: Family,
    designs: Array,
    poses: Sequence[str],
    target: float,
    found: Array,
    err: Array,
    status: Status,
    needed: Array,
) -> Index:
    """Double the grids until the means agree, in place; return the rows that this does not settle.

    ``needed`` (n,) are the samples below which an agreement means nothing; what takes the finest grids to be resolved
    at all is not tried.
    """
    before = found.copy()
    pending = np.flatnonzero((status == st.OK) & (needed <= LIMIT // 4))
    unresolved = [np.flatnonzero((status == st.OK) & (needed > LIMIT // 4))]
    changes = np.full((2, *found.shape), np.nan)
    samples = 2 * START
    while pending.size and samples <= LIMIT:
        now, state = _on_grid(family, designs, pending, samples, poses)
        change = np.abs(now - before[pending])
        found[pending], status[pending] = now, state
        err[pending] = change + 4.0 * EPS * now
        before[pending] = now
        allowed = np.maximum(target * now, 16.0 * EPS * now)
        unsettled = change > allowed
        unsettled |= (needed[pending] > samples)[:, None]
        # Grids of even samples agree by chance, about jumps, and both about waves as fast as they stand.
        agreed = np.flatnonzero((state == st.OK) & ~unsettled.any(axis=1))
        aside, _ = _on_grid(family, designs, pending[agreed], samples // 2, poses, SHIFT)
        chance = np.abs(aside - now[agreed])
        err[pending[agreed]] += chance
        # A mean that has left float64 gets no better by more samples.
        unsettled[agreed] = ~(chance <= 2.0 * allowed[agreed]) & np.isfinite(now[agreed])
        first, second = changes[:, pending]
        # A smooth curve that is settled to a hundredth gains more than a factor of eight per doubling; a kink or jump
        # gains four or two.
        kinked = (first < KINKED * now) & (second > first / 8.0) & (change > second / 8.0)
        with np.errstate(divide="ignore", invalid="ignore"):
            gain = np.clip(np.sqrt(change / first), 0.2, 0.6)
        kinked &= change * gain ** np.log2(LIMIT / samples) > target * now  # no hope to get there
        changes[:, pending] = second, change
        hopeless = (kinked & unsettled).any(axis=1)
        unresolved.append(pending[(state == st.OK) & hopeless])
        pending = pending[(state == st.OK) & unsettled.any(axis=1) & ~hopeless]
        samples *= 2
    return np.concatenate([*unresolved, pending])


def _on_panels(
    family: Family, designs: Array, poses: Sequence[str], edges: Array, target: float
) -> tuple[Array, Array, Status]:
    """Means, their errors and the status by adaptive quadrature of precise poses: plain ones may be noise alone."""
    family, n = family.precise(), len(designs)
    status = np.zeros(n, np.uint8)
    names = list(dict.fromkeys(poses))
    starts, codes = pose_columns(family, designs, edges, names)
    scan.worst_status(codes, status)
    for name in (name for name in names if family.pose_output[name].wraps):
        scan.unwrap(starts[name], np.empty(n, np.int64))
    size = np.stack([np.abs(starts[name]).max(axis=1) for name in poses], axis=1)
    size = np.where((size > 0.0) & np.isfinite(size), size, 1.0)
    blur = np.stack([_blur(starts[name] / size[:, k, None]) for k, name in enumerate(poses)], axis=1)

    def squares(rows: Index, origins: Index, phi: Array) -> Array:
        columns, codes = pose_columns(family, designs[rows], phi, names)
        worst = np.empty(rows.size, np.uint8)
        scan.worst_status(codes, worst)
        bad = worst != st.OK
        status[rows[bad]] = worst[bad]
        out = np.empty((*phi.shape, len(poses)))
        for k, name in enumerate(poses):
            values = columns[name]
            if family.pose_output[name].wraps:
                from_start = starts[name][rows, origins][:, None]
                values = values + TWO_PI * np.rint((from_start - values) / TWO_PI)
            scaled = values / size[rows, k, None]
            out[:, :, k] = scaled * scaled
        out[bad] = np.nan
        return out

    integrals = integrate(squares, edges, 2.0 * target)  # the root halves a relative error
    mean, off = np.sqrt(integrals.value / TWO_PI), integrals.err + blur
    half = np.divide(0.5 * off, TWO_PI * mean, out=np.sqrt(off / TWO_PI), where=mean > 0.0)
    state = DESIGN_STATUS[status].astype(np.uint8)
    state[(state == st.OK) & ~integrals.settled] = st.NOT_CONVERGED
    return size * mean, size * (half + 16.0 * EPS * mean), state


def _blur(values: Array) -> Array:
    """Bound what the rounding of the crank angles may do to the integral of the squares: their variation times that."""
    squares = values * values
    # One after the other: repeated angles add nothing, however many there are.
    variation: Array = np.cumsum(np.abs(squares - np.roll(squares, 1, axis=1)), axis=1)[:, -1]
    return 2.0 * EPS * TWO_PI * variation


def _singularities(family: Family, designs: Array) -> Singularities:
    """Nearest singularities: as a few samples see them, and closely where they may matter."""
    n, names = len(designs), discriminants(family)
    rows = np.arange(n)
    if family.every(Singular):
        rows = np.arange(n)  # samples of these are not among those of a turn
    elif names and n:
        distance, one = np.full(n, np.inf), np.empty(n)
        for part in blocks(rows, START, len(names)):
            columns, _, _ = sample_turn(family, designs[part], START, names)
            for name in names:
                scan.nearest_singularity(columns[name], one[: part.size])
                distance[part] = np.fmin(distance[part], one[: part.size])
        rows = np.flatnonzero(distance < NEAR)
    far = nearest(family, designs[:0])
    width = far.phi.shape[1]
    phi, rho = np.tile(np.arange(1.0, 1.0 + width), (n, 1)), np.full((n, width), np.pi)
    for part in blocks(rows if singular_curves(family) else rows[:0], START, width):
        close = nearest(family, designs[part])
        phi[part], rho[part] = close
    return Singularities(phi, rho)


def _rounding(family: Family, designs: Array, poses: Sequence[str], near: Singularities) -> Array:
    """Return what the rounding of the poses may do to the means, (n, q): the difference from more precise poses.

    Taken at poses that crowd about the singularities, where rounding is amplified; twice, as it varies between them.
    """
    n, names = len(designs), list(dict.fromkeys(poses))
    out = np.zeros((n, len(poses)))
    if not n:
        return out
    precise = family.precise()
    own = steps(near, PANEL)  # designs with as many angles together: sums have the same bits in any company
    alike = (np.flatnonzero(own == number) for number in np.unique(own))
    for part in (part for rows in alike for part in blocks(rows, 4 * START, len(names))):
        angles = crowded(near.only(part), PANEL)
        width = 0.5 * np.mod(np.roll(angles, -1, axis=1) - np.roll(angles, 1, axis=1), TWO_PI)
        columns, _ = pose_columns(family, designs[part], angles, names)
        better, _ = pose_columns(precise, designs[part], angles, names)
        for k, name in enumerate(poses):
            off = columns[name] - better[name]
            if family.pose_output[name].wraps:
                off -= TWO_PI * np.rint(off / TWO_PI)
            off = np.where(np.isfinite(off), np.abs(off), 0.0)
            size = np.abs(np.where(np.isfinite(better[name]), better[name], 0.0))
            top = np.maximum((size + off).max(axis=1, keepdims=True), np.finfo(float).tiny)
            weighted = np.einsum("ij,ij,ij->i", width, size / top, off / top) + 0.5 * _blur(size / top)
            mean = np.einsum("ij,ij->i", width, (size / top) ** 2)
            share = np.divide(weighted, np.sqrt(mean * TWO_PI), out=np.zeros(part.size), where=mean > 0.0)
            out[part, k] = 3.0 * share * top[:, 0] + 4.0 * EPS * np.sqrt(mean / TWO_PI) * top[:, 0]
    return out


def _on_grid(
    family: Family, designs: Array, rows: Index, samples: int, poses: Sequence[str], shift: float = 0.0
) -> tuple[Array, Status]:
    found, status = np.full((rows.size, len(poses)), np.nan), np.empty(rows.size, np.uint8)
    names = list(dict.fromkeys(poses))
    for part in blocks(np.arange(rows.size), samples, len(names)):
        columns, worst, winds = sample_turn(family, designs[rows[part]], samples, names, shift)
        state = np.where((worst == st.OK) & winds, st.NOT_OSCILLATING, DESIGN_STATUS[worst]).astype(np.uint8)
        status[part] = state
        for k, pose in enumerate(poses):
            values = columns[pose]
            # Not by einsum: from 8192 samples on it adds up one row otherwise than several.
            mean = np.sqrt(np.square(values).sum(axis=1) / samples)
            found[part, k] = np.where(state == st.OK, mean, np.nan)
    return found, status


def _columns(names: Sequence[str], found: Array, err: Array, status: Status) -> Columns:
    columns: Columns = {"status": status}
    for k, name in enumerate(names):
        columns[name], columns[f"err_{name}"] = found[:, k], err[:, k]
    return columns
