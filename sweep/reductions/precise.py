"""Maxima that rounding left less accurate than was asked, taken from the family's precise poses (docs/extrema.md)."""

from __future__ import annotations

import numpy as np

from kernels import scan
from sweep.families.base import Accuracy, Array, Columns, Family, Step
from sweep.numerics.singularities import crowded
from sweep.reductions.density import nearest
from sweep.reductions.refine import EPS, Peaks, confirmed, first_peaks, polish_places
from sweep.reductions.sampling import TWO_PI, Index, blocks, pose_columns

SPACING = 1.0 / 6.0  # of poses, against the distance of the nearest singularity
RIVAL = 0.9  # share of the highest pose above which a local maximum may turn out the highest
POSES = 512  # of a turn, roughly: how many designs are looked at together
LEVEL = 8.0 * EPS
AROUND = np.arange(-3.0, 4.0)


def sharpen_maxima(
    family: Family, step: Step, designs: Array, pose: str, name: str, columns: Columns, target: float
) -> None:
    """Replace those maxima of a step whose errors exceed the target by more accurate ones, in place.

    Parameters
    ----------
    family : with precise poses;  step : provides ``name`` and its place
    designs : the (n, P) design matrix
    pose : the pose output x;  name : the largest magnitude of it
    columns : what the step found, with ``err_<name>``, and perhaps the place and its error; changed in place
    target : relative accuracy

    Notes
    -----
    A maximum below what the step has found, by more than both errors, is another peak: then the step's stands.
    """
    place = f"{family.domain.name}_{name}"
    value, err = (np.asarray(columns[key], np.float64) for key in (name, f"err_{name}"))
    wanting = np.flatnonzero(err > target * np.abs(value))
    # The larger its error the nearer the singularity, as a rule, and the more poses a block of such designs takes.
    wanting = wanting[np.argsort(err[wanting] / np.abs(value[wanting]), kind="stable")]
    for rows in blocks(wanting, POSES):
        searched = step.run(designs[rows], frozenset((name, place)), Accuracy(target=target))
        phi = np.asarray(searched[place], np.float64)
        peaks = precise_maxima(family, designs[rows], pose, phi, target, place in columns)
        better = (peaks.err_height < err[rows]) & (peaks.height >= value[rows] - err[rows] - peaks.err_height)
        rows, peaks = rows[better], peaks.only(better)
        value[rows], err[rows] = peaks.height, peaks.err_height
        if place in columns:
            columns[place][rows], columns[f"err_{place}"][rows] = np.mod(peaks.phi, TWO_PI), peaks.err_phi


def precise_maxima(family: Family, designs: Array, pose: str, phi: Array, target: float, locate: bool) -> Peaks:
    """Return the largest magnitudes (n,) over the turn from the family's precise poses alone;
    error inf where they are lost.

    Parameters
    ----------
    family, designs : with precise poses; the (n, P) design matrix
    pose : which output is largest
    phi : (n,) places of the maxima as known so far [rad]
    target : relative accuracy
    locate : whether the places are wanted too

    Notes
    -----
    Near a change point there are tops of nearly equal height a few distances of the singularity apart, on either side
    of a sharp zero, or across the turn: only precise poses tell them apart.  So the whole turn is looked at again, by
    poses that stand no wider than a sixth of that distance.  The known place is a candidate of its own, and a maximum
    below the highest of all poses seen is none.
    """
    precise = family.precise()

    def measured(which: Index, angles: Array, name: str = pose) -> Array:
        found = pose_columns(precise, designs[which], angles, [name])[0][name]
        return np.abs(found) if name == pose else found

    every = np.arange(phi.size)
    near = nearest(family, designs)
    angles = crowded(near, SPACING)
    values = measured(every, angles)
    highest = values.max(axis=1)
    top = (values >= np.roll(values, 1, axis=1)) & (values >= np.roll(values, -1, axis=1))
    row, column = np.nonzero(top & (values >= RIVAL * highest[:, None]))
    row, centre = np.concatenate([row, every]), np.concatenate([angles[row, column], phi])
    spacing = SPACING * near.only(row).distance(centre)
    around = measured(row, centre[:, None] + spacing[:, None] * AROUND)
    np.maximum.at(highest, row, around.max(axis=1))
    first = first_peaks(centre, spacing, around)
    peaks = confirmed(
        lambda active, at: measured(row[active], at), first, target * first.height, np.full(row.size, np.inf)
    )
    best, which = np.full(phi.size, -np.inf), np.full(phi.size, -1)
    scan.best_candidate(row, peaks.height, best, which)
    # Several have climbed the same top: the one that knows it best.
    as_high = peaks.height >= (1.0 - LEVEL) * best[row]
    scan.best_candidate(row, np.where(as_high, -peaks.err_height, -np.inf), np.full(phi.size, -np.inf), which)
    found = peaks.only(which)
    lost = (which < 0) | ~(found.height + found.err_height >= highest)
    found.err_height[lost] = np.inf
    slope = family.derivative_of.get(pose)
    if not locate or slope is None:
        return found
    places = polish_places(lambda active, at: measured(active, at, slope), found.phi, found.err_phi)
    return found._replace(phi=places[0], err_phi=places[1])
