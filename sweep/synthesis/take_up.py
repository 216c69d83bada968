"""Eyelet of a take-up for a wanted P(phi): least squares with the analytic Jacobian; docs/takeup.md, section 6.

The length over the store, P_h, is linear: it is the weighted mean of the remainder and is eliminated.  Parameters that
the wanted points do not determine are named: those in a direction along which the residual stays constant.  For guides
on the line x = e, y = 0 there is always one such direction: the squared distances of the eyelet from them contain seven
parameters in six combinations, (28) of docs/takeup.md.  Fixing e, a or alpha removes it; at alpha = 0 fix f and e.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pandas as pd
from numpy.typing import ArrayLike

from kernels.families import eyelet
from sweep.errors import InputError
from sweep.evaluation.tables import Table, design_matrix, numbers, parameter_units, refuse_rows
from sweep.families import family
from sweep.families.base import Array

# The columns of kernels.families.eyelet.length_sensitivities, in the order of the design matrix.
SOUGHT = ("a", "e", "f", "alpha", "Z1", "Z2", "phi_h")
LENGTHS = ("a", "e", "f", "Z1", "Z2")
STORE = 7
# Relative singular value below which a direction changes P by less than its rounding error.
LEAST_RANK = 1e-7
SHARE = 0.1


@dataclass(frozen=True)
class TakeUpFit:
    """An eyelet fitted to a wanted P(phi).

    ``designs`` has a row per start, the best first: the parameters of the family `eyelet`, ``rms`` and ``largest``
    error of P [length], ``undetermined``: the parameters that the wanted points do not determine, comma-separated.
    """

    designs: pd.DataFrame

    @property
    def best(self) -> dict[str, float]:
        """Parameters of the best eyelet."""
        row = self.designs.iloc[0]
        return {name: float(row[name]) for name in family("eyelet").parameter_names}


def fit_eyelet(
    phi: ArrayLike, P: ArrayLike, starts: Table, weights: ArrayLike | None = None, fixed: tuple[str, ...] = ()
) -> TakeUpFit:
    """Fit an eyelet on a crank to the wanted thread take-up, with the least sum of squared errors of P.

    Parameters
    ----------
    phi, P : wanted points, crank angle [rad] and thread taken up [length]; a constant in P has no influence
    starts : table of initial eyelets, one per row
    weights : weights of the squared errors, one per point, 1 by default
    fixed : parameters that keep their value, among a, e, f, alpha, Z1, Z2, phi_h

    Returns
    -------
    TakeUpFit

    Raises
    ------
    InputError
        for a bad table, points of different numbers, an unknown fixed parameter, or fewer points than unknowns.

    Notes
    -----
    The length itself is fitted, not the weighted difference (27) of the source, which over-weights the points with
    two long parts of the thread.  A mirror image, or an exchange of the guides, is an equally good answer.
    """
    angles, wanted = numbers(phi, "phi", "phi").ravel(), numbers(P, "P", "P").ravel()
    weight = np.ones(angles.size) if weights is None else numbers(weights, "weights", "weights").ravel()
    if not angles.size == wanted.size == weight.size:
        allowed = f"as many values as phi, {angles.size}"
        raise InputError("P", f"{wanted.size} and {weight.size} weights", allowed, "wanted points")
    for name, values in (("phi", angles), ("P", wanted)):
        refuse_rows(~np.isfinite(values), values, name, "a finite number")
    for name in fixed:
        if name not in SOUGHT:
            raise InputError("fixed", name, f"of {', '.join(SOUGHT)}", "fit_eyelet")
    sought = [k for k, name in enumerate(SOUGHT) if name not in fixed]
    if not sought:
        raise InputError("fixed", ", ".join(fixed), f"not all of {', '.join(SOUGHT)}", "fit_eyelet")
    if angles.size <= len(sought):
        raise InputError("phi", f"{angles.size} points", f"more than the {len(sought)} unknowns", "wanted points")
    if not (np.isfinite(weight).all() and (weight >= 0.0).all() and weight.sum() > 0.0):
        raise InputError("weights", weight.min(), "numbers that are not negative, one of them positive", "weights")
    matrix, _ = design_matrix(family("eyelet"), starts)
    given = np.cos(angles)[None], np.sin(angles)[None], wanted, weight / weight.sum()
    rows = [_fitted(start, sought, *given) for start in matrix]
    frame = pd.DataFrame(rows).sort_values("rms", kind="stable", ignore_index=True)
    frame.attrs["units"] = parameter_units(family("eyelet").parameters) | {"rms": "length", "largest": "length"}
    return TakeUpFit(frame)


def _fitted(
    start: Array, sought: list[int], cos: Array, sin: Array, wanted: Array, weights: Array
) -> dict[str, float | str]:
    """Return the eyelet fitted from one start, as a row of the table."""
    from scipy.optimize import least_squares

    unit = float(np.abs(start[[SOUGHT.index(name) for name in LENGTHS]]).max())
    scale = np.array([unit if SOUGHT[k] in LENGTHS else 1.0 for k in sought])
    low = np.array([1e-9 * unit if SOUGHT[k] == "a" else -np.inf for k in sought])
    status = np.empty(cos.shape, np.uint8)

    def design(x: Array) -> Array:
        row = start[None].copy()
        row[0, sought] = x
        return row

    def beside(x: Array) -> Array:
        """Return P less what is wanted; what P_h makes good is in it."""
        length = np.empty(cos.shape)
        eyelet.poses(design(x), cos, sin, status, eyelet.Outputs(None, None, None, length, None, None, None, None))
        return np.asarray(length[0] - wanted)

    def errors(x: Array) -> Array:
        """Return the weighted errors of P, with the best P_h."""
        residuals = beside(x)
        return np.sqrt(weights) * (residuals - weights @ residuals)

    def slopes(x: Array) -> Array:
        jacobian = np.empty((len(SOUGHT), *cos.shape))
        eyelet.length_sensitivities(design(x), cos, sin, jacobian, status)
        rates = jacobian[sought, 0].T
        return np.sqrt(weights)[:, None] * (rates - weights @ rates)

    fit = least_squares(
        errors, start[sought], slopes, x_scale=scale, bounds=(low, np.inf), xtol=1e-15, ftol=1e-15, gtol=1e-15,
        max_nfev=500,
    )  # fmt: skip
    found, residuals = design(fit.x), beside(fit.x)
    found[0, STORE] = weights @ residuals
    residuals = residuals - found[0, STORE]
    _, singular_values, directions = np.linalg.svd(slopes(fit.x) * scale, full_matrices=False)
    weak = directions[singular_values <= LEAST_RANK * singular_values[0]]
    names = [SOUGHT[k] for i, k in enumerate(sought) if (np.abs(weak[:, i]) > SHARE).any()]
    values: dict[str, float | str] = dict(zip(family("eyelet").parameter_names, found[0], strict=True))
    rms = float(np.sqrt(weights @ residuals**2))
    return values | {"rms": rms, "largest": float(np.abs(residuals).max()), "undetermined": ",".join(names)}
