"""What manufacturing tolerances do to a design: mean and 95 % band of its outputs, share that keeps each limit."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from sweep.families.base import Accuracy, Array, Family
from sweep.optimise.samples import sobol

if TYPE_CHECKING:
    from sweep.study import Limit, Tolerance

SAMPLES = 2048  # a power of two: a Sobol sample keeps its balance only so
SIGMAS = 3.0  # a tolerance of +-t is three standard deviations
BAND = (2.5, 97.5)  # percent


def touched(family: Family, tolerance: Tolerance) -> Array:
    """Return the tolerance (P,) of every parameter: that of lengths, of angles, zero for all others."""
    widths = {"length": tolerance.lengths, "angle": tolerance.angles}
    return np.array([widths.get(p.unit, 0.0) if p.choices is None else 0.0 for p in family.parameters])


def deviating(family: Family, design: Array, tolerance: Tolerance, seed: int, samples: int = SAMPLES) -> Array:
    """Return designs (samples, P) about one, every length and angle normally distributed, independent of each other.

    Parameters
    ----------
    family : of the design
    design : (P,)
    tolerance : +- of lengths (mm) and angles (rad), three standard deviations
    seed : of the scrambled Sobol sequence
    samples : a power of two
    """
    from scipy.special import ndtri

    sigma = touched(family, tolerance) / SIGMAS
    varied = np.flatnonzero(sigma)
    uniform = sobol(len(varied), seed).random(samples)
    designs = np.repeat(design[None, :], samples, axis=0)
    # A sample at 0 would be infinitely far away.
    designs[:, varied] += sigma[varied] * ndtri(np.maximum(uniform, 0.5 / samples))
    return designs


def tolerance_rows(
    family: Family,
    design: Array,
    outputs: Sequence[str],
    limits: Sequence[Limit],
    tolerance: Tolerance,
    seed: int,
    accuracy: Accuracy,
    window: tuple[float, float] | None = None,
) -> dict[str, list[Any]]:
    """Return the distribution of design outputs under manufacturing tolerances by 2048 designs about the given one.

    Parameters
    ----------
    family, design : (P,) what is made
    outputs : names of design outputs
    limits : those that ``within`` counts; equations are left out, since nothing that is made keeps them
    tolerance, seed : see :func:`deviating`
    accuracy, window : as for ``summarise``

    Returns
    -------
    Rows ``output``, ``nominal``, ``mean``, ``low``, ``high`` (2.5 and 97.5 % of the designs that have the output),
    ``missing`` (share without it), ``within`` (share that keeps its limits; nan without a limit); a last row
    "all limits" has only ``within``.  The share of 2048 designs is good to about 1 %.
    """
    from sweep.chunks.cascade import meets
    from sweep.evaluation.summaries import design_outputs

    limits = [limit for limit in limits if limit.minimum is None or limit.minimum != limit.maximum]
    designs = np.concatenate([design[None, :], deviating(family, design, tolerance, seed)])
    columns: dict[str, Any] = design_outputs(family, designs, list(outputs), accuracy, window)
    rows: dict[str, list[Any]] = {
        name: [] for name in ("output", "nominal", "mean", "low", "high", "missing", "within")
    }
    everything = np.ones(len(designs) - 1, dtype=np.bool_)
    for output in outputs:
        values = np.asarray(columns[output], np.float64)
        known = values[1:][np.isfinite(values[1:])]
        low, high = np.percentile(known, BAND) if len(known) else (math.nan, math.nan)
        own = [meets(limit, values[1:]) for limit in limits if limit.output == output]
        for kept in own:
            everything &= kept
        within = float(np.logical_and.reduce(own).mean()) if own else math.nan
        mean = float(known.mean()) if len(known) else math.nan
        missing = 1.0 - len(known) / len(everything)
        row = (output, float(values[0]), mean, float(low), float(high), missing, within)
        for name, value in zip(rows, row, strict=True):
            rows[name].append(value)
    last = ("all limits", *[math.nan] * 5, float(everything.mean()) if limits else math.nan)
    for name, value in zip(rows, last, strict=True):
        rows[name].append(value)
    return rows
