"""Rounding errors of poses near a dead point, which neighbouring poses share, so that samples show no ripple."""

from __future__ import annotations

from zlib import crc32

import numpy as np

from kernels import status as st
from kernels.curves import samples as scan
from kernels.types import EPS, TWO_PI
from sweep.families.base import Accuracy, Array, Columns, Family, Step
from sweep.families.capabilities import Assembly
from sweep.numerics.events import beyond
from sweep.numerics.records import Indices, Mask, only
from sweep.numerics.singularities import Singularities, crowded
from sweep.reductions.refine import Peaks, confirmed, first_peaks, polish_places
from sweep.reductions.resolution import nearest
from sweep.reductions.sampling import blocks, pose_columns

TRIES = 3
PLACES = 32  # a force along what bears none is exactly 0 at five of six poses
CANCELLED = 2.0  # error of a pose per change by rounded inputs, at most: changes by several inputs may cancel
BETWEEN = 0.618  # share of their spacing by which they stand off a pose, so that no even share of a turn meets a jump
ALONE = 0.1  # relative change of a curve's highest sample by rounded inputs from which on the curve is only rounding
FAINT = 1e-10  # ratio of range to size below which the rounding of a signed curve is checked
CONSTANT = 64.0 * EPS  # relative range below which a curve is constant but for rounding


def measure_constants(values: Array, scale: Array, rough: Array) -> Mask:
    """Use the size of a curve that is constant but for rounding as the scale of its signed extrema; say which are.

    The range of such a curve is noise: no relative target can be met by it, and no denser samples resolve it.

    Parameters
    ----------
    values : (n, m) samples of one turn
    scale, rough : (n,) range of each curve, and the share of it that the samples do not resolve; changed in place
    """
    size = np.abs(values).max(axis=1)
    constant: Mask = np.ptp(values, axis=1) <= CONSTANT * size
    scale[constant], rough[constant] = size[constant], 0.0
    return constant


def rounding_share(
    family: Family, designs: Array, columns: dict[str, Array], row: Indices, column: Indices, guards: list[str],
    order: Indices,
) -> Array:  # fmt: skip
    """Estimate the share of values that rounding may have changed (docs/internals/extrema.md).

    Parameters
    ----------
    family, designs : the (n, P) design matrix
    columns : the discriminants ``guards`` over one turn, (n, m) each
    row, column : (k,) design and sample of each value
    order : (k,) order of derivative of each value, as of :func:`order_of`

    Notes
    -----
    A pose near a dead point amplifies the rounding of its discriminant.  The rounded terms have the size of the
    discriminant where the links meet at a right angle: with a tiny crank it may be far smaller over the whole turn.
    """
    amplified = np.ones(row.size)
    sizes = {loop.discriminant: loop.scale for loop in family.every(Assembly)}
    for name in guards:
        here, largest = columns[name][row, column], columns[name].max(axis=1)[row]
        if name in sizes:
            largest = np.maximum(largest, sizes[name](designs)[row])
        amplified += np.divide(largest, here, out=np.ones(row.size), where=tells(largest) & (here > 0.0))
    return _of_order(order, amplified)


def rounding_by_pieces(guards: dict[str, Array], row: Indices, of: Indices) -> Array:
    """Bound the share of values that rounding near a dead point may have changed.

    Parameters
    ----------
    guards : the discriminants, (k, m) each, on pieces of turns
    row : (k,) design of each piece;  of : (q,) design of each value
    """
    amplified = np.zeros(of.size)
    for values in guards.values():
        largest, least = np.full(row.max(initial=0) + 1, -np.inf), np.full(row.max(initial=0) + 1, np.inf)
        np.maximum.at(largest, row, values.max(axis=1))
        np.minimum.at(least, row, values.min(axis=1))
        amplified += np.divide(largest[of], least[of], out=np.zeros(of.size), where=least[of] > 0.0)
    return 4.0 * EPS * (1.0 + amplified)


def singular_share(near: Singularities, phi: Array, order: Indices) -> Array:
    """Estimate the rounding near singularities that no discriminant of an assembly shows.

    The rounded quantity falls with the square of the distance of its complex zero.

    Parameters
    ----------
    near : the singularities of the design of each value
    phi, order : (k,) crank angle [rad] and order of derivative of each value
    """
    return _of_order(order, np.maximum(near.distance(phi) ** -2.0 - 1.0, 0.0))


def _of_order(order: Indices, amplified: Array) -> Array:
    """Share of rounding: a derivative of order n grows like the power 1/2 - n of the vanishing quantity."""
    return 4.0 * EPS * np.where(order == 0, np.sqrt(amplified), np.where(order < 3, amplified, 2.0 * amplified))


def shaken(family: Family, designs: Array, phi: Array, name: str) -> Array:
    """Measure the change of a pose output under rounding of the inputs of a design, (n,).

    A kernel as exact as its inputs has an error of this size.  It is the largest change of TRIES poses, at one crank
    angle of each design, (n,), or at several, (n, k); poses that fail are ignored.
    """
    free = np.array([p.choices is None and p.unit != "count" for p in family.parameters])
    # Signs depend on the name of each input, so that further inputs of other outputs do not change them.
    bits = np.array([crc32(p.name.encode()) for p in family.parameters]) >> np.arange(TRIES)[:, None]
    signs = np.where(free, 1.0 - 2.0 * (bits & 1), 0.0)
    every = np.concatenate([designs, *(designs * (1.0 + 2.0 * EPS * sign) for sign in signs)])
    angles = np.atleast_2d(phi.T).T
    columns, status = pose_columns(family, every, np.tile(angles, (TRIES + 1, 1)), [name])
    values, known = (x.reshape(TRIES + 1, *angles.shape) for x in (columns[name], status == st.OK))
    off = beyond(values[1:], values[0], family.pose_output[name].wraps)
    found: Array = np.where(known[1:], np.abs(off), 0.0).max(axis=(0, 2))
    return found


def shaken_anywhere(family: Family, designs: Array, phi: Array, name: str) -> Array:
    """Return the largest of these changes at PLACES poses of a turn: of a few roundings any one pose may keep all.

    None of them is at ``phi``, (n,), itself: beside a jump or a pole rounding moves the height by as much as itself.
    """
    found = np.empty(len(designs))
    for rows in blocks(np.arange(len(designs)), PLACES * (TRIES + 1)):
        places = phi[rows, None] + (np.arange(PLACES) + BETWEEN) * (TWO_PI / PLACES)
        found[rows] = shaken(family, designs[rows], places, name)
    return found


def rounding_alone(family: Family, designs: Array, pose: str, values: Array, scale: Array, rough: Mask) -> Mask:
    """Select the rough curves that are rounding only, such as the moment in a pin whose forces lie in one plane.

    No denser samples resolve them.  With rounded inputs they change by as much as their largest magnitude.  The same
    holds for signed extrema, relative to the range, where forces cancel, as the shaking force of a balanced linkage
    does, or leave a constant one that turns with the crank.

    Parameters
    ----------
    family, designs, pose : the (n, P) design matrix, and the pose output
    values : (n, m) samples of one turn
    scale : (n,) largest magnitude of each curve, of signed extrema its range
    rough : (n,) curves that the samples do not resolve; of signed extrema faint ranges are checked too
    """
    found = np.zeros(len(designs), np.bool_)
    which = np.flatnonzero(rough | (scale < FAINT * np.abs(values).max(axis=1)))
    if which.size:
        top = np.abs(values[which]).argmax(axis=1)
        off = shaken_anywhere(family, designs[which], top * (TWO_PI / values.shape[1]), pose)
        found[which] = off >= ALONE * scale[which]
    return found


def plain(family: Family) -> bool:
    """Whether a family, or a stage of a chain, has no more precise poses than those with the rounding of float64."""
    return any(stage.family.precise_poses is None for stage in family.stages)


def order_of(family: Family, pose: str) -> int:
    """Order of derivative of a pose output; 3 for outputs of unknown order, such as magnitudes and forces."""
    order = len(family.orders(pose))
    return order if order or pose in family.derivative_of else 3


def tells(discriminant: Array) -> Mask:
    """Whether a discriminant is within the range of float64: at scales such as 1e100 or 1e-80 it is not."""
    return (discriminant > 1e-280) & (discriminant < 1e280)


SPACING = 1.0 / 6.0  # of poses, relative to the distance of the nearest singularity
FOLLOWED = 1e-4  # relative accuracy of a height whose place is near enough for the derivative's root to be found
RIVAL = 0.9  # share of the highest pose above which a local maximum may turn out to be the highest
POSES = 512  # poses per turn, roughly, that determine the size of blocks
LEVEL = 8.0 * EPS
AROUND = np.arange(-3.0, 4.0)


def sharpen_maxima(
    family: Family, step: Step, designs: Array, pose: str, name: str, columns: Columns, target: float
) -> None:
    """Replace maxima of a step whose errors exceed the target by more accurate ones, in place.

    Parameters
    ----------
    family : with precise poses;  step : provides ``name`` and its place
    designs : the (n, P) design matrix
    pose : the pose output x;  name : its largest magnitude
    columns : results of the step, with ``err_<name>``, and perhaps the place and its error; changed in place
    target : relative accuracy

    Notes
    -----
    A maximum that is lower than the step's by more than both errors is another peak: then the step's value is kept.
    """
    place = f"{family.domain.name}_{name}"
    value, err = (np.asarray(columns[key], np.float64) for key in (name, f"err_{name}"))
    rough = err > target * np.abs(value)
    found = place in columns
    at, err_at = (np.asarray(columns[key], np.float64) for key in (place, f"err_{place}")) if found else (value, err)
    wanting = np.flatnonzero(rough | (err_at > target) if found else rough)
    if not wanting.size:
        return
    # A larger error usually means a nearer singularity, and more poses for a block of such designs.
    wanting = wanting[np.argsort(err[wanting] / np.abs(value[wanting]), kind="stable")]
    for rows in blocks(wanting, POSES):
        searched = step.run(designs[rows], frozenset((name, place)), Accuracy(target=target))
        phi = np.asarray(searched[place], np.float64)
        peaks = precise_maxima(family, designs[rows], pose, phi, min(target, FOLLOWED), found)
        same = peaks.height >= value[rows] - err[rows] - peaks.err_height
        if found:
            # No bit of the value depends on whether its place is wanted, nor the other way round.
            nearer = same & ((peaks.err_phi < err_at[rows]) | (rough[rows] & (peaks.err_height < err[rows])))
            at[rows[nearer]], err_at[rows[nearer]] = np.mod(peaks.phi, TWO_PI)[nearer], peaks.err_phi[nearer]
        better = same & rough[rows] & (peaks.err_height < err[rows])
        value[rows[better]], err[rows[better]] = peaks.height[better], peaks.err_height[better]


def precise_maxima(family: Family, designs: Array, pose: str, phi: Array, target: float, locate: bool) -> Peaks:
    """Compute the largest magnitudes (n,) over the turn from the family's precise poses alone; error inf if lost.

    Parameters
    ----------
    family, designs : with precise poses; the (n, P) design matrix
    pose : the pose output
    phi : (n,) places of the maxima as known so far [rad]
    target : relative accuracy
    locate : whether the places are wanted too

    Notes
    -----
    Near a change point there are maxima of nearly equal height a few distances of the singularity apart, on either side
    of a sharp zero, or across the turn: only precise poses distinguish them.  So the whole turn is searched again, by
    poses no wider apart than a sixth of that distance.  The known place is one of the candidates, and a maximum below
    the highest pose is rejected.
    """
    precise = family.precise()

    def measured(which: Indices, angles: Array, name: str = pose) -> Array:
        found = pose_columns(precise, designs[which], angles, [name])[0][name]
        return np.abs(found) if name == pose else found

    every = np.arange(phi.size)
    near = nearest(family, designs, (pose,))
    angles = crowded(near, SPACING)
    values = measured(every, angles)
    highest = values.max(axis=1)
    top = (values >= np.roll(values, 1, axis=1)) & (values >= np.roll(values, -1, axis=1))
    row, column = np.nonzero(top & (values >= RIVAL * highest[:, None]))
    row, centre = np.concatenate([row, every]), np.concatenate([angles[row, column], phi])
    spacing = SPACING * only(near, row).distance(centre)
    around = measured(row, centre[:, None] + spacing[:, None] * AROUND)
    np.maximum.at(highest, row, around.max(axis=1))
    first = first_peaks(centre, spacing, around)
    peaks = confirmed(
        lambda active, at: measured(row[active], at), first, target * first.height, np.full(row.size, np.inf)
    )
    best, which = np.full(phi.size, -np.inf), np.full(phi.size, -1)
    scan.best_candidate(row, peaks.height, best, which)
    # Of several candidates at the same maximum the most accurate one is used.
    as_high = peaks.height >= (1.0 - LEVEL) * best[row]
    scan.best_candidate(row, np.where(as_high, -peaks.err_height, -np.inf), np.full(phi.size, -np.inf), which)
    found = only(peaks, which)
    lost = (which < 0) | ~(found.height + found.err_height >= highest)
    found.err_height[lost] = np.inf
    slope = family.derivative_of.get(pose)
    if not locate or slope is None:
        return found
    places = polish_places(lambda active, at: measured(active, at, slope), found.phi, found.err_phi)
    return found._replace(phi=places[0], err_phi=places[1])
