"""Fit of a guided four-bar: coupler point, line and scale, which a study then need not sweep.

For the links of the last stage and the swing of its drive, the coupler point (xi, eta) and the line (lam, h) with the
smallest maximum deviation over the working part follow from a linear problem (kernels/linear/line_fit.py); scaling
the whole stage then gives the wanted stroke.  So a sweep over proportions is a sweep over complete needle mechanisms.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from kernels import status as codes
from kernels.linear.line_fit import Straightest, line_fit
from sweep.errors import InputError
from sweep.evaluation.summaries import design_outputs
from sweep.families import family as find_family
from sweep.families.base import Accuracy, Angles, Array, Family, floats
from sweep.families.capabilities import GuidedPoint
from sweep.families.chain import Chain, driven_guide
from sweep.reductions.steps import applying_step

# The deviation is a smooth function of the input: 48 Chebyshev points of a swing usually miss 1e-4 of its extremes,
# 5e-3 at worst, 256 of a whole turn 4e-4 (48: up to 2e-2): far less than the optimiser changes afterwards.
# The end of a window lies between two samples, where the deviation grows fastest: 48 miss 16 to 28 % of it, 256 some 5.
SWING_SAMPLES, DENSE_SAMPLES = 48, 256
SWING_ACCURACY = Accuracy(target=1e-6)
SWING = ("psi_ext", "swing")
BLOCK = 8192  # positions processed together: their fifteen or so arrays (64 kB each) stay in the caches


@dataclass(frozen=True)
class LineFit:
    """Target of the fit: ``stroke`` along the line [length], or None to keep the size of the links.

    With ``free_direction`` the line may turn up to 90 degrees away from the given lam, which defines "up".
    """

    stroke: float | None
    free_direction: bool

    def parameters(self, family: Family) -> tuple[str, ...]:
        """Return the names of the parameters that the fit sets, with the stage's number; lam only if it is free."""
        guided, suffix = _guided(family)
        free = (name for name in guided.fitted if self.free_direction or name != guided.direction)
        return tuple(f"{name}{suffix}" for name in free)

    def rescaled(self, family: Family) -> tuple[str, ...]:
        """Return the names of the parameters whose given values are proportions only."""
        guided, suffix = _guided(family)
        return () if self.stroke is None else tuple(f"{name}{suffix}" for name in guided.scaled)


def fit_line(
    family: Family,
    designs: Array,
    fit: LineFit,
    window: tuple[float, float] | None,
    driven: tuple[Array, Array] | None = None,
) -> tuple[Array, NDArray[np.uint8]]:
    """Fit coupler point, line and scale of every design.

    Parameters
    ----------
    family : "guide", or a chain that ends in it
    designs : (n, P) design matrix; the fitted columns are not read, except lam (see :class:`LineFit`)
    fit : target of the fit
    window : working part as fractions of the stroke from its smallest s; None is the whole stroke
    driven : the `driving_outputs` of every design, (n,) each, if they are known; all must be numbers

    Returns
    -------
    designs : (n, P), a copy with the fitted and scaled columns filled
    status : (n,); OK, the status of the driving stages if they do not swing, NOT_ASSEMBLED, or NOT_CONVERGED if the
        points do not determine a line

    Raises
    ------
    InputError
        if the mechanism has no guided coupler point.
    """
    guided, suffix = _guided(family)
    column = {name: k for k, name in enumerate(family.parameter_names)}
    fitted = designs.copy()
    guide = family.stages[-1].family
    start, swing, status = _driven(family, designs) if driven is None else (*driven, np.zeros(len(designs), np.uint8))
    samples = SWING_SAMPLES if guide is not family and window is None else DENSE_SAMPLES
    chebyshev = 0.5 - 0.5 * np.cos(np.linspace(0.0, np.pi, samples))  # Chebyshev points from 0 to 1
    alive = np.flatnonzero(status == codes.OK)
    link_columns = np.array([column[f"{name}{suffix}"] for name in guide.parameter_names])
    fitted_columns = np.array([column[f"{name}{suffix}"] for name in guided.fitted])
    scaled = np.array([column[f"{name}{suffix}"] for name in guided.scaled])
    limits = np.array(window or (0.0, 1.0), dtype=np.float64)
    links = designs[np.ix_(alive, link_columns)]
    values, travel = np.empty((len(guided.fitted), alive.size)), np.empty(alive.size)
    rows = max(1, BLOCK // chebyshev.size)
    for begin in range(0, alive.size, rows):
        part = slice(begin, begin + rows)
        indices = alive[part]
        angles = _input_angles(family, designs[indices], start[indices, None] + swing[indices, None] * chebyshev)
        values[:, part], travel[part], status[indices] = _fitted(guide, guided, links[part], angles, fit, limits)
    fitted[np.ix_(alive, fitted_columns)] = values.T
    if fit.stroke is not None:
        fitted[np.ix_(alive, scaled)] *= (fit.stroke / travel)[:, None]
    return fitted, status


def _fitted(
    guide: Family, guided: GuidedPoint, links: Array, angles: Array, fit: LineFit, limits: Array
) -> tuple[Array, Array, NDArray[np.uint8]]:
    """Return the fitted parameters (4, n), the travel (n,) and the status of guides at their input angles (n, m)."""
    names = ("x_b", "y_b", "x_c", "y_c")
    pins = guide.poses(links, Angles.of(angles), frozenset(names))
    xy = floats(pins, *names)
    for column in xy:
        column[pins["status"] != codes.OK] = np.nan
    values = np.array([links[:, guide.parameter_names.index(name)] for name in guided.fitted])
    along, across, direction, offset = values
    deviation, travel = np.empty(len(links)), np.empty(len(links))
    line = Straightest(along, across, offset, deviation, travel, np.empty(len(links), np.uint8))
    line_fit(xy[0], xy[1], xy[2], xy[3], limits, direction, fit.free_direction, line)
    return values, travel, line.status


def driving_outputs(family: Family) -> tuple[str, ...]:
    """Return the names of the outputs that describe the guide's drive, if a sweep that has them may pass them on.

    They must equal those that `fit_line` computes, to the last bit: so there are none unless a single step of the first
    of two stages gives both at any accuracy.
    """
    stages = driven_guide(family)
    if stages is None:
        return ()
    step = applying_step(stages[0].family, SWING[0], SWING_ACCURACY)
    if step is None or not {o.name for o in step[0].provides} >= set(SWING):
        return ()
    # A step that also serves a grid ignores the accuracy.
    exact = step[0].applies(Accuracy(samples=SWING_SAMPLES))
    return tuple(f"{name}{stages[0].number}" for name in SWING) if exact else ()


def _guided(family: Family) -> tuple[GuidedPoint, str]:
    """Return the guided point and the suffix of its stage's parameters, the stage's number in a chain."""
    last = family.stages[-1]
    guided = last.family.find(GuidedPoint)
    if guided is not None:
        return guided, last.tail
    raise InputError("fit", family.name, "a guide, or a chain that ends in one", "mechanism")


def _driven(family: Family, designs: Array) -> tuple[Array, Array, NDArray[np.uint8]]:
    """Return start and range of the angle that drives the guide, (n,) each, and the status of its drive."""
    n = len(designs)
    if not isinstance(family, Chain):
        return np.zeros(n), np.full(n, 2.0 * np.pi), np.zeros(n, np.uint8)
    upstream = find_family([stage.family.name for stage in family.stages[:-1]])
    driving = np.ascontiguousarray(designs[:, : len(upstream.parameters)])
    outputs = design_outputs(upstream, driving, SWING, SWING_ACCURACY)
    start, swing = outputs["psi_ext"].astype(np.float64), outputs["swing"].astype(np.float64)
    return start, swing, outputs["status"].astype(np.uint8)


def _input_angles(family: Family, designs: Array, driving: Array) -> Array:
    """Return the input angles of the guide (n, m) from those of its drive."""
    if not isinstance(family, Chain):
        return driving
    last = family.stages[-1]
    assert last.kappa is not None and last.offset is not None
    return designs[:, last.kappa, None] * driving + designs[:, last.offset, None]
