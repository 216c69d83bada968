"""Root mean square over one turn of any pose output: equidistant precise poses, or adaptive quadrature on panels.

The mean of a smooth curve converges on equidistant poses.  All other curves need panels, which crowd about the nearest
singularities, begin and end where a curve has kinks or jumps, and are halved adaptively.  Fused chains have a kernel
for the mean, which leaves difficult designs to panels.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from kernels import status as st
from kernels.curves import samples as scan
from kernels.types import EPS, TWO_PI, Status
from sweep.families.base import Accuracy, Array, Columns, Family
from sweep.families.curve_features import NARROWEST, Switches, about, crossed
from sweep.numerics.events import with_events
from sweep.numerics.quadrature import integrate
from sweep.numerics.records import Indices, only
from sweep.numerics.singularities import FAR, turn_edges
from sweep.quantities.kinds import Request
from sweep.reductions.fused import curve_of
from sweep.reductions.resolution import denser, ends, nearest, series_of
from sweep.reductions.rounding import ALONE, CANCELLED, plain, shaken, shaken_anywhere
from sweep.reductions.sampling import DESIGN_STATUS, blocks, continued, pose_columns, sample_turn

SAMPLES = 128  # first number of samples of a turn
HIGHEST = 9  # number of the highest orders that samples show, the largest of which bounds the error of their mean
NEAR = 0.3  # distance of a singularity [rad] below which panels are used
PANEL = 1.0  # length of the first panels relative to that distance, for which the 15-point rule errs by 1e-13
PANELS_AT_ONCE = 1024
LOOKS = 512  # samples on which kinks and jumps of a curve are searched
EVEN = 16  # first panels of a curve with kinks, jumps or waves, in addition to cuts at its known kinks
KNOWN = 4  # first panels of a curve all of whose kinks are known
ROUGH = 1e-3  # error of the mean of SAMPLES poses, as a share of it, from which on the curve may be rounding alone
PREFIX = "rms_"


def mean_squares(family: Family, designs: Array, names: Sequence[str], accuracy: Accuracy) -> Columns:
    """Compute root mean squares over one turn, on samples or refined until they converge.

    Parameters
    ----------
    family, designs : the (n, P) design matrix of any family
    names : ``rms_x`` of pose outputs x, ``member.rms_x`` of one of a member
    accuracy : dense grid, or relative error

    Returns
    -------
    Columns
        the names and ``err_<name>`` (nan on samples), each (n,), and ``status``: as of extrema, NOT_CONVERGED where
        panels do not converge; the value is kept, with its error.  Errors include the rounding of the poses.
    """
    n, poses = len(designs), [name.removeprefix(PREFIX).replace(f".{PREFIX}", ".") for name in names]
    if accuracy.samples is not None:
        means, status = _on_grid(family, designs, accuracy.samples, poses)
        unknown = {f"err_{name}": np.full(n, np.nan) for name in names}
        return dict(zip(names, means, strict=True)) | unknown | {"status": status}
    assert accuracy.target is not None
    columns: Columns = {}
    status = np.zeros(n, np.uint8)
    for name, pose in zip(names, poses, strict=True):
        # Each by itself, so that no bit of it depends on the other wanted names.
        columns[name], columns[f"err_{name}"], now = _of_one(family, designs, pose, accuracy.target)
        status = np.where(status == st.OK, now, status)
    return columns | {"status": status}


def _of_one(family: Family, designs: Array, pose: str, target: float) -> tuple[Array, Array, Status]:
    """Mean of one pose output, its error, and status, each (n,): by the kernel of a fused chain, else from poses."""
    known = family.pose_output[pose]
    request = Request(pose, 0)
    smooth = not known.kinks and not known.jumps
    curve = (curve_of(family, request, False, mean=True) or series_of(family, request)) if smooth else None
    if curve is None:
        return _refined(family, designs, pose, target)
    mean, err, status, undecided = curve.mean(designs, target)
    rows = np.flatnonzero(undecided | crossed(family, designs, (pose,)))
    if rows.size:
        mean[rows], err[rows], status[rows] = _refined(family, designs[rows], pose, target)
    return mean, err, status


def _refined(family: Family, designs: Array, pose: str, target: float) -> tuple[Array, Array, Status]:
    """Mean of one pose output, its error, and status, each (n,), from poses alone."""
    mean, err, status, top = _on_turn(family.precise(), designs, pose)
    output = family.pose_output[pose]
    # Curves with jumps, kinks or waves are cut into panels.
    cut = crossed(family, designs, (pose,)) | (denser(family, designs, (pose,)) > 1.0) | output.kinks | output.jumps
    even = KNOWN if about(family, Switches, (pose,)) and pose not in family.dear else EVEN
    alive = np.flatnonzero(status == st.OK)
    noise = _alone(family, designs, alive[err[alive] > ROUGH * mean[alive]], pose, top, mean, err)
    left = np.setdiff1d(alive, noise)
    for rows in np.split(left, range(PANELS_AT_ONCE, left.size, PANELS_AT_ONCE)):
        near = nearest(family, designs[rows], (pose,), NEAR)
        open_ = cut[rows] | (near.rho.min(axis=1, initial=FAR) < NEAR) | ~(err[rows] <= target * mean[rows])
        edges, rows = turn_edges(only(near, np.flatnonzero(open_)), PANEL), rows[open_]
        if not rows.size:
            continue
        which = np.flatnonzero(cut[rows])
        if which.size:
            places = ends(family, designs[rows[which]], even, LOOKS, pose)
            edges = with_events(edges, np.repeat(which, places.shape[1]), places.ravel())
        mean[rows], err[rows], status[rows] = _on_panels(family, designs[rows], pose, edges, target)
    lost = (status != st.OK) & (status != st.NOT_CONVERGED)
    mean[lost], err[lost] = np.nan, np.nan
    if plain(family) and alive.size:
        # Badly scaled designs lose digits in every pose: the mean may lose as much as the largest value.
        # Beside the top, which may be at a jump: rounding moves the jump, but hardly the mean.
        beside = top[alive] + (2.0 * NARROWEST if output.kinks or output.jumps else 0.0)
        err[alive] = np.maximum(err[alive], CANCELLED * shaken(family.precise(), designs[alive], beside, pose))
    late = np.flatnonzero(status == st.NOT_CONVERGED)
    status[_alone(family, designs, late, pose, top, mean, err)] = st.OK
    return mean, err, status


def _alone(family: Family, designs: Array, rows: Indices, pose: str, top: Array, mean: Array, err: Array) -> Indices:
    """Select rows whose curve is rounding alone: its mean never settles, and its error becomes as large as itself."""
    off = shaken_anywhere(family, designs[rows], top[rows], pose)
    found: Indices = rows[off >= ALONE * mean[rows]]
    err[found] = np.maximum(err[found], np.maximum(off[off >= ALONE * mean[rows]], mean[found]))
    return found


def _on_turn(family: Family, designs: Array, pose: str) -> tuple[Array, Array, Status, Array]:
    """Means over equidistant samples, their errors, status, and place of the largest value [rad], each (n,).

    The error is the sum of those orders of the squares that are multiples of SAMPLES.  The highest orders that samples
    show are larger.  One of them alone, by which the mean of every other sample differs, may vanish by chance.
    """
    n = len(designs)
    mean, err, top, status = np.full(n, np.nan), np.full(n, np.nan), np.empty(n), np.empty(n, np.uint8)
    for part in blocks(np.arange(n), SAMPLES):
        columns, worst, winds = sample_turn(family, designs[part], SAMPLES, [pose])
        status[part] = np.where((worst == st.OK) & winds, st.NOT_OSCILLATING, DESIGN_STATUS[worst])
        values = columns[pose]
        top[part] = np.abs(values).argmax(axis=1) * (TWO_PI / SAMPLES)
        size = np.abs(values).max(axis=1)
        size = np.where((size > 0.0) & np.isfinite(size), size, 1.0)
        squares = np.square(values / size[:, None])
        whole = np.sqrt(squares.sum(axis=1) / SAMPLES)
        last = 2.0 * np.abs(np.fft.rfft(squares, norm="forward"))[:, -HIGHEST:].max(axis=1)
        mean[part], err[part] = size * whole, size * _rounded(TWO_PI * last + _blur(squares), whole)
    return mean, err, status, top


def _on_panels(family: Family, designs: Array, pose: str, edges: Array, target: float) -> tuple[Array, Array, Status]:
    """Compute means, errors and status by adaptive quadrature of precise poses: others may be dominated by rounding."""
    family, n = family.precise(), len(designs)
    status = np.zeros(n, np.uint8)
    columns, codes = pose_columns(family, designs, edges, [pose])
    scan.worst_status(codes, status)
    starts = columns[pose]
    if family.pose_output[pose].wraps:
        scan.unwrap(starts, np.empty(n, np.int64))
    size = np.abs(starts).max(axis=1)
    size = np.where((size > 0.0) & np.isfinite(size), size, 1.0)
    blur = _blur(np.square(starts / size[:, None]))

    def squares(rows: Indices, origins: Indices, phi: Array) -> Array:
        columns, codes = pose_columns(family, designs[rows], phi, [pose])
        worst = np.empty(rows.size, np.uint8)
        scan.worst_status(codes, worst)
        bad = worst != st.OK
        status[rows[bad]] = worst[bad]
        values = continued(family, pose, columns[pose], starts[rows, origins][:, None])
        out: Array = np.square(values / size[rows, None])
        out[bad] = np.nan
        return out[:, :, None]

    integrals = integrate(squares, edges, 2.0 * target)  # the root halves a relative error
    mean = np.sqrt(integrals.value[:, 0] / TWO_PI)
    state = DESIGN_STATUS[status].astype(np.uint8)
    state[(state == st.OK) & ~np.isfinite(starts).all(axis=1)] = st.INVALID_INPUT  # a pose beyond float64
    state[(state == st.OK) & ~integrals.settled] = st.NOT_CONVERGED
    return size * mean, size * _rounded(integrals.err[:, 0] + blur, mean), state


def _rounded(off: Array, mean: Array) -> Array:
    """Error of means whose integrals of squares are off by ``off``, rounding included."""
    half: Array = np.divide(0.5 * off, TWO_PI * mean, out=np.sqrt(off / TWO_PI), where=mean > 0.0)
    return half + 16.0 * EPS * mean


def _blur(squares: Array) -> Array:
    """Bound the effect of rounded crank angles on the integral of squares by the total variation of the squares."""
    # A running sum: repeated angles add nothing, however many there are.
    variation: Array = np.cumsum(np.abs(squares - np.roll(squares, 1, axis=1)), axis=1)[:, -1]
    return 2.0 * EPS * TWO_PI * variation


def _on_grid(family: Family, designs: Array, samples: int, poses: Sequence[str]) -> tuple[Array, Status]:
    """Compute means (q, n) of q pose outputs over equidistant samples, and the status."""
    n = len(designs)
    found, status = np.full((len(poses), n), np.nan), np.empty(n, np.uint8)
    names = list(dict.fromkeys(poses))
    for part in blocks(np.arange(n), samples, len(names)):
        columns, worst, winds = sample_turn(family, designs[part], samples, names)
        status[part] = np.where((worst == st.OK) & winds, st.NOT_OSCILLATING, DESIGN_STATUS[worst])
        for mean, pose in zip(found, poses, strict=True):
            # Not by einsum: from 8192 samples on it sums one row in another order than several.
            values = np.sqrt(np.square(columns[pose]).sum(axis=1) / samples)
            turns = winds & (np.abs(columns[pose][:, -1] - columns[pose][:, 0]) > np.pi)
            lost = turns if family.pose_output[pose].wraps else np.zeros_like(turns)
            mean[part] = np.where((worst == st.OK) & ~lost, values, np.nan)
    return found, status
