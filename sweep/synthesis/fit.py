"""The inner fit of a guided four-bar: coupler point, line and scale that a study need not sweep.

For the links of the last stage and the swing of what drives it, the coupler point (xi, eta) and the line (lam, h) with
the smallest largest deviation over the working part follow from a linear problem (kernels/line_fit.py); scaling the
whole stage then gives the wanted stroke.  So a sweep over proportions is a sweep over finished needle mechanisms.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from kernels import status as codes
from kernels.line_fit import line_fit
from sweep.errors import InputError
from sweep.evaluation.summaries import design_outputs
from sweep.families import family as find_family
from sweep.families.base import Accuracy, Angles, Array, Family
from sweep.families.capabilities import GuidedPoint
from sweep.families.chain import Chain, stages_of

# The deviation is a smooth function of the input: 48 Chebyshev points of a swing miss 1e-4 of its extremes, 256 of a
# whole turn 4e-4 at most (48: up to 2e-2), which is far below what the optimiser moves afterwards.
SWING_SAMPLES, TURN_SAMPLES = 48, 256
SWING_ACCURACY = Accuracy(target=1e-6)


@dataclass(frozen=True)
class LineFit:
    """What the fit aims at: ``stroke`` along the line [length] or None to keep the size of the links.

    With ``free_direction`` the line may turn up to 90 degrees away from the given lam, which says where "up" is.
    """

    stroke: float | None
    free_direction: bool

    def parameters(self, family: Family) -> tuple[str, ...]:
        """Return names of the parameters the fit sets, xi2, eta2 ... in a chain; lam only if its direction is free."""
        guided, suffix = _guided(family)
        free = (name for name in guided.fitted if self.free_direction or name != guided.direction)
        return tuple(f"{name}{suffix}" for name in free)

    def rescaled(self, family: Family) -> tuple[str, ...]:
        """Return names of the parameters whose given values are proportions only."""
        guided, suffix = _guided(family)
        return () if self.stroke is None else tuple(f"{name}{suffix}" for name in guided.scaled)


def fit_line(
    family: Family, designs: Array, fit: LineFit, window: tuple[float, float] | None
) -> tuple[Array, NDArray[np.uint8]]:
    """Fit coupler point, line and scale of every design.

    Parameters
    ----------
    family : "guide", or a chain that ends in it
    designs : (n, P) design matrix; the fitted columns are not read, except lam (see :class:`LineFit`)
    fit : what to aim at
    window : working part as fractions of the stroke from its smallest s; None is the whole stroke

    Returns
    -------
    designs : (n, P), a copy with the fitted and scaled columns filled
    status : (n,); OK, the status of the driving stages where they do not swing, NOT_ASSEMBLED, or NOT_CONVERGED where
        the points do not determine a line

    Raises
    ------
    InputError
        if the mechanism has no guided coupler point.
    """
    guided, suffix = _guided(family)
    column = {name: k for k, name in enumerate(family.parameter_names)}
    fitted = designs.copy()
    guide = family.stages[-1].family if isinstance(family, Chain) else family
    angles, status = _input_angles(family, designs)
    alive = np.flatnonzero(status == codes.OK)
    if alive.size == 0:
        return fitted, status
    own = fitted[np.ix_(alive, np.array([column[f"{name}{suffix}"] for name in guide.parameter_names]))]
    wanted = frozenset({"x_b", "y_b", "x_c", "y_c"})
    pins = guide.poses(np.ascontiguousarray(own), Angles.of(angles[alive]), wanted)
    missing = pins["status"] != codes.OK
    parts = [np.where(missing, np.nan, pins[name].astype(np.float64)) for name in ("x_b", "y_b", "x_c", "y_c")]
    values = {name: np.ascontiguousarray(own[:, guide.parameter_names.index(name)]) for name in guided.fitted}
    along, across, direction, offset = values.values()
    deviation, travel, found = np.empty(alive.size), np.empty(alive.size), np.empty(alive.size, np.uint8)
    limits = np.array(window or (0.0, 1.0), dtype=np.float64)
    line_fit(
        parts[0], parts[1], parts[2], parts[3], limits, direction, fit.free_direction,
        along, across, offset, deviation, travel, found,
    )  # fmt: skip
    status[alive] = found
    for name in guided.fitted:
        fitted[alive, column[f"{name}{suffix}"]] = values[name]
    if fit.stroke is not None:
        factor = fit.stroke / travel
        for name in guided.scaled:
            fitted[alive, column[f"{name}{suffix}"]] *= factor
    return fitted, status


def _guided(family: Family) -> tuple[GuidedPoint, str]:
    """Return the guided point, and what follows the names of its stage's parameters: the stage's number in a chain."""
    last = stages_of(family)[-1]
    guided = last.family.find(GuidedPoint)
    if guided is not None:
        return guided, str(last.number) if isinstance(family, Chain) else ""
    raise InputError("fit", family.name, "a guide, or a chain that ends in one", "mechanism")


def _input_angles(family: Family, designs: Array) -> tuple[Array, NDArray[np.uint8]]:
    """Return input angles of the guide over its swing or turn, Chebyshev points, (n, m),
    and the status of what drives it.
    """
    samples = SWING_SAMPLES if isinstance(family, Chain) else TURN_SAMPLES
    share = 0.5 - 0.5 * np.cos(np.linspace(0.0, np.pi, samples))
    if not isinstance(family, Chain):
        return np.tile(2.0 * np.pi * share, (len(designs), 1)), np.zeros(len(designs), np.uint8)
    last = family.stages[-1]
    upstream = find_family([stage.family.name for stage in family.stages[:-1]])
    driving = np.ascontiguousarray(designs[:, : len(upstream.parameters)])
    found = design_outputs(upstream, driving, ("psi_ext", "swing"), SWING_ACCURACY)
    start, swing = found["psi_ext"].astype(np.float64), found["swing"].astype(np.float64)
    psi = start[:, None] + swing[:, None] * share
    assert last.kappa is not None and last.offset is not None
    angles = designs[:, last.kappa, None] * psi + designs[:, last.offset, None]
    return angles, found["status"].astype(np.uint8)
