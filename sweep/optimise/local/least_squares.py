"""Least-squares problems of the search, and the step that minimises a quadratic model under linear constraints."""

from __future__ import annotations

import numpy as np

from sweep.families.base import Array
from sweep.optimise.problem.rows import Form

EXCHANGES = 10  # exchanges per column after which non-negative least squares stops


def least_squares(a: Array, b: Array, tolerance: float) -> Array:
    """Return the shortest least-squares solution of a x = b; ``tolerance`` is the relative cut of singular values."""
    if not a.size:
        return np.zeros(a.shape[1])
    return np.asarray(np.linalg.lstsq(a, b, rcond=tolerance)[0], np.float64)


def non_negative(a: Array, b: Array) -> Array:
    """Return the x >= 0 that minimises ``|a x - b|``; zero if no active set is found."""
    from scipy.optimize import nnls

    if not a.size:
        return np.zeros(a.shape[1])
    try:
        return np.asarray(nnls(a, b, maxiter=EXCHANGES * a.shape[1])[0], np.float64)
    except RuntimeError:  # nearly dependent columns may be exchanged without end
        return np.zeros(a.shape[1])


def split(rows: Array, tolerance: float) -> tuple[Array, Array]:
    """Return orthonormal bases of the row space (k, n) and of the null space (n - k, n) of rows (m, n)."""
    if not len(rows):
        return np.empty((0, rows.shape[1])), np.eye(rows.shape[1])
    _, sizes, axes = np.linalg.svd(rows)
    rank = int((sizes > tolerance * sizes.max(initial=1e-300)).sum())
    return axes[:rank], axes[rank:]


FLAT = 1e-6  # smallest curvature of the quadratic model; the objective is about 1, the variables run from 0 to 1
BEND = 1e-4  # curvature given to t and to the violation, which have none; it changes multipliers by 1e-4 of the step


def quadratic_step(
    curvature: Array, full: Array, rows: Array, form: Form, box: tuple[Array, Array, float], price: float
) -> tuple[Array, Array]:
    """Return the step (d, t) that minimises t + d'Hd/2 + price v, where v relaxes the linear row of every limit.

    It is a least-distance problem, solved by non-negative least squares (Lawson and Hanson 1974, chapter 23): in the
    eigenvectors of the curvature, which is positive, the objective is the distance from a point.

    Parameters
    ----------
    curvature : (n, n) H, symmetric; eigenvalues below FLAT are raised to FLAT
    full : (R, n + 1) gradients of the rows by the variables and by t
    rows : (R,) their values, to become at least zero, or zero for equations of ``form``
    form : labels of the rows; only limits may be relaxed
    box : lower and upper ends of d, and lower end of the step in t
    price : price of a unit of v

    Returns
    -------
    Step (n + 1,) and multipliers of the rows (R,).
    """
    n = len(curvature)
    values, axes = np.linalg.eigh(curvature)
    stiffness = np.concatenate([np.maximum(values, 0.5 * FLAT), [BEND, BEND]])
    back = np.zeros((n + 2, n + 2))
    back[:n, :n], back[n, n], back[n + 1, n + 1] = axes, 1.0, 1.0
    back /= np.sqrt(stiffness)
    centre = back.T @ np.concatenate([np.zeros(n), [1.0, price]])
    gives = np.array([label.side != "objective" for label in form.labels], dtype=np.float64)
    linear = np.column_stack([full, gives])
    twice = np.column_stack([-full, gives])[form.equal]
    low, high, floor = box
    unit = np.eye(n + 2)
    sides = np.concatenate([linear, twice, unit[:n], -unit[:n], unit[n:]])
    bounds = np.concatenate([rows, -rows[form.equal], -low, high, [-floor, 0.0]])
    known = np.isfinite(bounds)
    original, bounds = sides[known], bounds[known]
    sides = original @ back
    # minimise |y| subject to sides @ (y - centre) + bounds >= 0
    size = np.sqrt((sides * sides).sum(axis=1))
    size[size == 0.0] = 1.0
    sides, needs = sides / size[:, None], (sides @ centre - bounds) / size
    target = np.zeros(n + 3)
    target[-1] = 1.0
    matrix = np.concatenate([sides.T, needs[None, :]])
    held = non_negative(matrix, target)
    left = matrix @ held - target
    if not abs(left[-1]) > 1e-300:
        return np.zeros(n + 1), np.zeros(len(rows))
    step = back @ (-left[:-1] / left[-1] - centre)
    every = np.zeros(len(known))
    every[known] = held / size / -left[-1]
    weights = every[: len(rows)].copy()
    weights[form.equal] -= every[len(rows) : len(rows) + len(twice)]
    # A straightness of 0.01 mm on links of 100 mm has slopes of 1e4: active rows must hold to the last digit.
    original, offsets = original[held > 0.0], bounds[held > 0.0]
    for _ in range(2):
        step -= least_squares(original, original @ step + offsets, 1e-13)
    return np.asarray(step[: n + 1], np.float64), weights
