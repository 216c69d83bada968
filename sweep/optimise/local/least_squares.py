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


def row_and_null_space(rows: Array, tolerance: float) -> tuple[Array, Array]:
    """Return orthonormal bases of the row space (k, n) and of the null space (n - k, n) of rows (m, n)."""
    if not len(rows):
        return np.empty((0, rows.shape[1])), np.eye(rows.shape[1])
    _, singular, axes = np.linalg.svd(rows)
    rank = int((singular > tolerance * singular.max(initial=1e-300)).sum())
    return axes[:rank], axes[rank:]


LEAST_CURVATURE = 1e-6  # of the quadratic model; the objective is about 1, the variables run from 0 to 1
ADDED_CURVATURE = 1e-4  # of t and of the violation, which have none; it changes multipliers by 1e-4 of the step


def quadratic_step(
    curvature: Array, gradients: Array, rows: Array, form: Form, box: tuple[Array, Array, float], price: float
) -> tuple[Array, Array]:
    """Return the step (d, t) that minimises t + d'Hd/2 + price v, where v relaxes the linear row of every limit.

    It is a least-distance problem, solved by non-negative least squares (Lawson and Hanson 1974, chapter 23): in the
    eigenvectors of the curvature, which is positive, the objective is the distance from a point.

    Parameters
    ----------
    curvature : (n, n) H, symmetric; eigenvalues below FLAT are raised to FLAT
    gradients : (R, n + 1) gradients of the rows by the variables and by t
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
    stiffness = np.concatenate([np.maximum(values, 0.5 * LEAST_CURVATURE), [ADDED_CURVATURE, ADDED_CURVATURE]])
    transform = np.zeros((n + 2, n + 2))
    transform[:n, :n], transform[n, n], transform[n + 1, n + 1] = axes, 1.0, 1.0
    transform /= np.sqrt(stiffness)
    centre = transform.T @ np.concatenate([np.zeros(n), [1.0, price]])
    relaxed = np.array([label.side != "objective" for label in form.labels], dtype=np.float64)
    linear = np.column_stack([gradients, relaxed])
    opposite = np.column_stack([-gradients, relaxed])[form.equal]
    low, high, floor = box
    identity = np.eye(n + 2)
    sides = np.concatenate([linear, opposite, identity[:n], -identity[:n], identity[n:]])
    bounds = np.concatenate([rows, -rows[form.equal], -low, high, [-floor, 0.0]])
    finite = np.isfinite(bounds)
    original, bounds = sides[finite], bounds[finite]
    sides = original @ transform
    # minimise |y| subject to sides @ (y - centre) + bounds >= 0
    norms = np.sqrt((sides * sides).sum(axis=1))
    norms[norms == 0.0] = 1.0
    sides, targets = sides / norms[:, None], (sides @ centre - bounds) / norms
    target = np.zeros(n + 3)
    target[-1] = 1.0
    matrix = np.concatenate([sides.T, targets[None, :]])
    duals = non_negative(matrix, target)
    residual = matrix @ duals - target
    if not abs(residual[-1]) > 1e-300:
        return np.zeros(n + 1), np.zeros(len(rows))
    step = transform @ (-residual[:-1] / residual[-1] - centre)
    multipliers = np.zeros(len(finite))
    multipliers[finite] = duals / norms / -residual[-1]
    weights = multipliers[: len(rows)].copy()
    weights[form.equal] -= multipliers[len(rows) : len(rows) + len(opposite)]
    # A straightness of 0.01 mm on links of 100 mm has slopes of 1e4: active rows must hold to the last digit.
    original, offsets = original[duals > 0.0], bounds[duals > 0.0]
    for _ in range(2):
        step -= least_squares(original, original @ step + offsets, 1e-13)
    return np.asarray(step[: n + 1], np.float64), weights
