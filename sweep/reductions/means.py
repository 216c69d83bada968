"""Root mean square over one turn of any pose output: the trapezoid rule on ever finer uniform grids.

For a smooth periodic curve the rule converges faster than any power of the number of samples, so the change from one
grid to the next, twice as fine, bounds what is left.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from kernels import status as st
from sweep.families.base import Accuracy, Array, Columns, Family
from sweep.reductions.extrema import DESIGN_STATUS, LIMIT, START
from sweep.reductions.sampling import Index, Status, blocks, sample_turn

EPS = 2.0**-53
KINKED = 1e-2  # relative change of a mean from which on its convergence tells kinks from smooth curves
PREFIX = "rms_"


def mean_squares(family: Family, designs: Array, names: Sequence[str], accuracy: Accuracy) -> Columns:
    """Root mean squares over one turn, on samples or on grids doubled until they agree.

    Parameters
    ----------
    family, designs : the (n, P) design matrix of any family
    names : ``rms_x`` of pose outputs x
    accuracy : dense grid, or relative error

    Returns
    -------
    Columns
        the names and ``err_<name>`` (nan on samples), each (n,), and ``status``: as of extrema, NOT_CONVERGED where
        32768 samples do not settle the value, or it settles only as fast as that of a curve with kinks or jumps; the
        value stays, with its error
    """
    poses = [name.removeprefix(PREFIX) for name in names]
    n = len(designs)
    if accuracy.samples is not None:
        found, status = _on_grid(family, designs, np.arange(n), accuracy.samples, poses)
        return _columns(names, found, np.full_like(found, np.nan), status)
    assert accuracy.target is not None
    before, status = _on_grid(family, designs, np.arange(n), START, poses)
    found, err = before.copy(), np.full_like(before, np.nan)
    pending, samples = np.flatnonzero(status == st.OK), 2 * START
    changes = np.full((2, n, len(names)), np.nan)
    while pending.size and samples <= LIMIT:
        now, state = _on_grid(family, designs, pending, samples, poses)
        change = np.abs(now - before[pending])
        found[pending], status[pending] = now, state
        err[pending] = change + 4.0 * EPS * now
        before[pending] = now
        unsettled = change > np.maximum(accuracy.target * now, 16.0 * EPS * now)
        first, second = changes[:, pending]
        # A smooth curve that is settled to a hundredth gains more than a factor of eight per doubling; a kink or jump
        # gains four or two, and twice the last changes bounds what is left of such a series.
        kinked = (first < KINKED * now) & (second > first / 8.0) & (change > second / 8.0)
        with np.errstate(divide="ignore", invalid="ignore"):
            gain = np.clip(np.sqrt(change / first), 0.2, 0.6)
        kinked &= change * gain ** np.log2(LIMIT / samples) > accuracy.target * now  # no hope to get there
        bound = 4.0 * np.maximum(change, np.maximum(0.5 * second, 0.25 * first))
        err[pending] = np.where(kinked & unsettled, bound, err[pending])
        status[pending[(kinked & unsettled).any(axis=1) & (state == st.OK)]] = st.NOT_CONVERGED
        changes[:, pending] = second, change
        pending = pending[(state == st.OK) & unsettled.any(axis=1) & ~(kinked & unsettled).any(axis=1)]
        samples *= 2
    status[pending] = st.NOT_CONVERGED
    lost = (status != st.OK) & (status != st.NOT_CONVERGED)
    found[lost], err[lost] = np.nan, np.nan
    return _columns(names, found, err, status)


def _on_grid(family: Family, designs: Array, rows: Index, samples: int, poses: Sequence[str]) -> tuple[Array, Status]:
    found, status = np.full((rows.size, len(poses)), np.nan), np.empty(rows.size, np.uint8)
    names = list(dict.fromkeys(poses))
    for part in blocks(np.arange(rows.size), samples, len(names)):
        columns, worst, winds = sample_turn(family, designs[rows[part]], samples, names)
        state = np.where((worst == st.OK) & winds, st.NOT_OSCILLATING, DESIGN_STATUS[worst]).astype(np.uint8)
        status[part] = state
        for k, pose in enumerate(poses):
            values = columns[pose]
            mean = np.sqrt(np.einsum("ij,ij->i", values, values) / samples)
            found[part, k] = np.where(state == st.OK, mean, np.nan)
    return found, status


def _columns(names: Sequence[str], found: Array, err: Array, status: Status) -> Columns:
    columns: Columns = {"status": status}
    for k, name in enumerate(names):
        columns[name], columns[f"err_{name}"] = found[:, k], err[:, k]
    return columns
