"""Least squares of the search, and the step that makes a quadratic model small under linear rows."""

from __future__ import annotations

import numpy as np

from sweep.families.base import Array
from sweep.optimise.problem.rows import Form

EXCHANGES = 10  # per column after which non-negative least squares are given up


def least_squares(a: Array, b: Array, tolerance: float) -> Array:
    """Shortest x with the least ``|a x - b|``; singular values below ``tolerance`` of the largest are zero."""
    if not a.size:
        return np.zeros(a.shape[1])
    return np.asarray(np.linalg.lstsq(a, b, rcond=tolerance)[0], np.float64)


def non_negative(a: Array, b: Array) -> Array:
    """Smallest ``|a x - b|`` with x >= 0; zero where no active set is found."""
    from scipy.optimize import nnls

    if not a.size:
        return np.zeros(a.shape[1])
    try:
        return np.asarray(nnls(a, b, maxiter=EXCHANGES * a.shape[1])[0], np.float64)
    except RuntimeError:  # nearly dependent columns exchange each other without end
        return np.zeros(a.shape[1])


def split(rows: Array, tolerance: float) -> tuple[Array, Array]:
    """Orthonormal directions (k, n) that rows (m, n) span, and those (n - k, n) that all of them leave alone."""
    if not len(rows):
        return np.empty((0, rows.shape[1])), np.eye(rows.shape[1])
    _, sizes, axes = np.linalg.svd(rows)
    rank = int((sizes > tolerance * sizes.max(initial=1e-300)).sum())
    return axes[:rank], axes[rank:]


FLAT = 1e-6  # smallest curvature of the quadratic model: the objective is about 1, the variables run from 0 to 1
BEND = 1e-4  # curvature lent to t and to the violation, which have none; it changes multipliers by 1e-4 of the step


def quadratic_step(
    curvature: Array, full: Array, rows: Array, form: Form, box: tuple[Array, Array, float], price: float
) -> tuple[Array, Array]:
    """Return the step (d, t) that makes t + d'Hd/2 + price v small; every limit's linear row may be missed by v.

    A least-distance problem, solved by non-negative least squares (Lawson and Hanson 1974, chapter 23): in the axes of
    the curvature, which is positive, the objective is the distance from a point.

    Parameters
    ----------
    curvature : (n, n) H, symmetric; what is less than FLAT is taken for FLAT
    full : (R, n + 1) gradients of the rows by the variables and by t
    rows : (R,) their values, to become at least zero, or zero where ``form`` says so
    form : labels of the rows: those of limits may be missed
    box : lower and upper ends of d, and lower end of the step in t
    price : of a unit of v

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
    # sides @ (y - centre) + bounds >= 0, |y| smallest
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
    # A straightness of 0.01 mm on links of 100 mm has slopes of 1e4: the rows that hold must hold to the last digit.
    original, offsets = original[held > 0.0], bounds[held > 0.0]
    for _ in range(2):
        step -= least_squares(original, original @ step + offsets, 1e-13)
    return np.asarray(step[: n + 1], np.float64), weights
