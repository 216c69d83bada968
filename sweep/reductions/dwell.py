"""How long the follower stays in a part of its stroke: the dwell of a given tolerance, in crank angle."""

from __future__ import annotations

import numpy as np

from sweep.families.base import Array, Family
from sweep.reductions.density import denser
from sweep.reductions.refine import EPS
from sweep.reductions.sampling import TWO_PI, blocks, sample_turn
from sweep.reductions.window import Window, edges

# The follower may pass a level twice between two of these; what lies between counts only if the stay is longer.
SAMPLES = 512


def window_angle(family: Family, designs: Array, window: Window) -> tuple[Array, Array]:
    """Return the crank angle over which the position lies in the window, of every design, and its error,
    each (n,) [rad].

    Parameters
    ----------
    family, designs : the (n, P) design matrix of any family whose crank turns fully
    window : positions of every design; nan gives nan

    Notes
    -----
    The angle above a level is the sum of the angles where the follower goes down through it, less those where it goes
    up, plus a turn if it starts above.  Between two levels it is what is above the lower and not above the upper one.
    Every crossing is refined to rounding; two crossings less than 360/512 degrees apart may be missed.
    """
    angle, err = np.full(len(designs), np.nan), np.full(len(designs), np.nan)
    open_end = np.full(len(designs), np.inf)
    names = (family.position, family.derivative_of[family.position])
    samples, known = SAMPLES * denser(family, designs), np.isfinite(window.err)
    every = (rows for m in np.unique(samples[known]) for rows in blocks(np.flatnonzero(known & (samples == m)), int(m)))
    for rows in every:
        columns, _, _ = sample_turn(family, designs[rows], int(samples[rows[0]]), names)
        above, own = np.zeros((2, rows.size)), np.zeros(rows.size)
        for side, level in enumerate((window.low, window.high)):
            start = columns[family.position][:, 0] >= level[rows]
            found = edges(family, designs, rows, Window(level, open_end, window.err), columns, names[1])
            above[side] = TWO_PI * start
            np.subtract.at(above[side], found.row, np.sign(found.values) * found.phi)
            size = window.err[rows[found.row]] + 8.0 * EPS * np.abs(level[rows[found.row]])
            np.add.at(own, found.row, size / np.abs(found.values) + 4.0 * EPS * TWO_PI)
        angle[rows], err[rows] = above[0] - above[1], own
    return angle, err
