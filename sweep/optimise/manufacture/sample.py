"""Samples of the mechanisms that are made of a design within its tolerances: yield, spread of outputs, costs."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from sweep.chunks.cascade import Dropped, batch_size
from sweep.evaluation.summaries import design_outputs, routes
from sweep.families.base import Array, Columns, Family
from sweep.families.names import is_flag, judged_by
from sweep.optimise.manufacture.tolerance import SIGMAS, tolerances_of
from sweep.optimise.multistart.parallel import spread_over
from sweep.optimise.problem.statement import Problem
from sweep.quantities.limits import Limit, compared, meets
from sweep.study import Study, Tolerance

SAMPLES = 2048  # a power of two: only then is a Sobol sample balanced
BAND = (2.5, 97.5)  # percent
ALL = 1 << 62  # count of mechanisms that no sample has
SPREAD_SECONDS = 10.0  # estimated time of a sample from which it is spread over workers, which take seconds to start


def sampled_designs(
    family: Family, design: Array, tolerance: Tolerance, seed: int, samples: int = SAMPLES, rows: slice = slice(None)
) -> Array:
    """Return designs (samples, P) around a design, with independent normally distributed lengths and angles.

    Parameters
    ----------
    family : family of the design
    design : (P,)
    tolerance : +- of lengths (mm) and angles (rad), three standard deviations
    seed : seed of the scrambled Sobol sequence
    samples : a power of two
    rows : those that are returned
    """
    sigma = tolerances_of(family, design, tolerance) / SIGMAS
    varied = np.flatnonzero(sigma)
    deviates = _deviates(len(varied), seed, samples)[rows]
    designs = np.repeat(design[None, :], len(deviates), axis=0)
    designs[:, varied] += sigma[varied] * deviates
    return designs


@lru_cache(maxsize=2)  # designs of one search have the same sample around them, and tables a smaller one
def _deviates(dimensions: int, seed: int, samples: int) -> Array:
    """Return standard normal deviates (samples, dimensions) from a scrambled Sobol sequence."""
    from scipy.special import ndtri
    from scipy.stats import qmc

    uniform = qmc.Sobol(dimensions, seed=seed).random(samples)
    # A sample at 0 would give an infinite deviation.
    deviates: Array = ndtri(np.maximum(uniform, 0.5 / samples))
    return deviates


@dataclass(frozen=True)
class Sampler:
    """Computes the mechanisms made of designs, block by block.

    Parameters
    ----------
    source : its family, accuracy and window are those of the outputs
    tolerance, seed : see :func:`sampled_designs`
    should_stop : called before every block; if it returns true, `Dropped` is raised
    jobs : number of workers over which a long sample is spread; it changes no value
    tell : called with the number of mechanisms of every finished block
    """

    source: Study | Problem
    tolerance: Tolerance
    seed: int
    should_stop: Callable[[], bool] = lambda: False
    jobs: int = 1
    tell: Callable[[int], None] = lambda _: None

    def designs(self, design: Array, rows: slice = slice(None)) -> Array:
        """Return the mechanisms (n, P) made of a design (P,), or some of them."""
        family = self.source.family
        return sampled_designs(family, design, self.tolerance, self.seed, self.tolerance.samples, rows)

    def outputs(
        self,
        design: Array,
        names: Iterable[str],
        count: int = ALL,
        exact: int | None = None,
        limits: Sequence[Limit] = (),
    ) -> Columns:
        """Return outputs of the mechanisms made of a design (P,), each (n,).

        Parameters
        ----------
        design : (P,)
        names : names of design outputs
        count : number of mechanisms, the first of the sample
        exact : number of a parameter without its tolerance
        limits : limits on the outputs; with them the only result is ``kept``, which mechanisms keep all limits.  Quick
            outputs come first, and what misses a limit goes no further
        """
        source, names = self.source, tuple(dict.fromkeys(names))
        ns = sum(r.ns_per_design for r in routes(source.family, names, source.accuracy, source.window is not None))
        count, size = min(count, self.tolerance.samples), batch_size(ns)
        task = _Block(Sampler(source, self.tolerance, self.seed), design, names, tuple(limits), exact, count, size)
        numbers = list(range(-(-count // size))) if names else []
        blocks = spread_over(
            task, numbers, self.should_stop, self.jobs if 1e-9 * ns * count > SPREAD_SECONDS else 1,
            lambda number, _: self.tell(min(size, count - number * size)),
        )  # fmt: skip
        if len(blocks) < len(numbers):
            raise Dropped
        return {name: np.concatenate([block[name] for block in blocks]) for name in (blocks[0] if blocks else ())}

    def share(self, design: Array, limits: Sequence[Limit]) -> float:
        """Return the share of the mechanisms made of a design (P,) that keep all limits."""
        names = [limit.output for limit in limits]
        return float(self.outputs(design, names, limits=limits)["kept"].mean()) if limits else 1.0

    def planned(self, design: Array, shares: int, tables: int) -> int:
        """Count the mechanisms of as many shares, of `tolerance_rows` of as many designs, and of the costs of one (P,).

        Without shares there are no limits, and nothing has costs.
        """
        samples, toleranced = self.tolerance.samples, tolerances_of(self.source.family, design, self.tolerance)
        costs = min(COSTS, int(np.count_nonzero(toleranced))) * min(COST_SAMPLE, samples) if shares else 0
        return shares * samples + tables * min(SAMPLES, samples) + costs


@dataclass(frozen=True)
class _Block:
    """Task: a block of the ``count`` first mechanisms made of a design, by its number; see `Sampler`."""

    sampler: Sampler
    design: Array
    names: tuple[str, ...]
    limits: tuple[Limit, ...]
    exact: int | None
    count: int
    size: int

    def __call__(self, number: int, should_stop: Callable[[], bool]) -> Columns:
        """Return the outputs of the block; where there are limits, which of its mechanisms keep them."""
        source, low = self.sampler.source, number * self.size
        designs = self.sampler.designs(self.design, slice(low, min(low + self.size, self.count)))
        if self.exact is not None:
            designs[:, self.exact] = self.design[self.exact]
        if not self.limits:
            columns = design_outputs(source.family, designs, self.names, source.accuracy, source.window)
            return {name: columns[name] for name in self.names}
        kept = np.arange(len(designs))
        for route in routes(source.family, self.names, source.accuracy, source.window is not None):
            columns = design_outputs(source.family, designs[kept], route.outputs, source.accuracy, source.window)
            kept = kept[keeping([x for x in self.limits if x.output in route.outputs], columns)]
        return {"kept": np.isin(np.arange(len(designs)), kept)}


def keeping(limits: Sequence[Limit], columns: Columns) -> NDArray[np.bool_]:
    """Tell which mechanisms keep all limits, (n,), by their outputs; a single True without limits."""
    kept: NDArray[np.bool_] = np.logical_and.reduce([meets(limit, columns[limit.output]) for limit in limits])
    return kept


def tolerance_rows(
    sampler: Sampler, design: Array, outputs: Sequence[str], limits: Sequence[Limit]
) -> dict[str, list[Any]]:
    """Return the distribution of design outputs under manufacturing tolerances, from 2048 designs around the given one.

    A tolerance with fewer samples gives fewer designs.

    Parameters
    ----------
    sampler : computes the designs
    design : (P,) nominal design
    outputs : names of design outputs
    limits : limits counted in ``within``, without equations, which no toleranced mechanism keeps

    Returns
    -------
    Rows ``output``, ``nominal``, ``mean``, ``low``, ``high`` (2.5 and 97.5 % of the designs that have the output),
    ``missing`` (share without it), ``within`` (share that keeps its limits; nan without a limit); a last row
    "all limits" has only ``within``.  The share of 2048 designs is accurate to about 1 %.
    """
    source, count = sampler.source, min(SAMPLES, sampler.tolerance.samples)
    limits = [limit for limit in limits if not limit.is_equation]
    exact = design_outputs(source.family, design[None, :], list(outputs), source.accuracy, source.window)
    made = replace(sampler, tolerance=replace(sampler.tolerance, samples=count)).outputs(design, outputs)
    rows: list[tuple[Any, ...]] = []
    for output in outputs:
        values = np.asarray(made[output], np.float64)
        finite = values[np.isfinite(values)]
        low, high = np.percentile(finite, BAND) if len(finite) else (math.nan, math.nan)
        own = [limit for limit in limits if limit.output == output]
        within = float(keeping(own, made).mean()) if own else math.nan
        mean = float(finite.mean()) if len(finite) else math.nan
        missing = 1.0 - len(finite) / count
        rows.append((output, float(exact[output][0]), mean, float(low), float(high), missing, within))
    of_all = [limit for limit in limits if limit.output in outputs]
    rows.append(("all limits", *[math.nan] * 5, float(keeping(of_all, made).mean()) if limits else math.nan))
    names = ("output", "nominal", "mean", "low", "high", "missing", "within")
    return {name: list(column) for name, column in zip(names, zip(*rows, strict=True), strict=True)}


COST_SAMPLE = 512  # mechanisms of the sample used for the cost of each dimension
COSTS = 8  # number of dimensions made exact, one at a time
TELLING_GAIN = 0.004  # share of mechanisms below which 512 of them show no cost of a dimension


class Cost(NamedTuple):
    """Cost of one dimension's tolerance, from the same mechanisms with this dimension exact.

    ``spread`` is its share in the variance of the output whose limit is violated most, ``gain`` the additional share of
    mechanisms that keep the limits.  A design at its limit gains nothing from any single dimension.
    """

    name: str
    text: str
    spread: float
    gain: float


class Manufactured(NamedTuple):
    """Sample of mechanisms of a design: the ``output`` violated most, its ``values`` (n,), and which keep all limits.

    ``costs`` are those of its dimensions, the dearest first.
    """

    output: str
    values: NDArray[np.generic]
    kept: NDArray[np.bool_]
    costs: tuple[Cost, ...]


def limits_of_made(study: Study) -> list[Limit]:
    """Return the inequality limits; a flag is replaced by the number that decides it, since a flag has no scatter."""
    limits = [limit for limit in study.output_limits if not limit.is_equation]
    return [Limit(judged_by(x.output), 0.0, None) if is_flag(x.output) else x for x in limits]


def manufactured(study: Study, design: Array, sampler: Sampler, known: Columns | None = None) -> Manufactured | None:
    """Sample mechanisms of a design (P,); None without a finite design, or an inequality limit.

    ``known`` are outputs of these mechanisms, as far as they have been computed.
    """
    limits, columns = limits_of_made(study), known or {}
    if not limits or not np.isfinite(design).all():
        return None
    columns = columns | sampler.outputs(design, [x.output for x in limits if x.output not in columns])
    worst = min(limits, key=lambda limit: float(meets(limit, columns[limit.output]).mean()))
    subset = {limit.output: columns[limit.output][:COST_SAMPLE] for limit in limits}
    costs = _costs(sampler, limits, worst, design, subset)
    return Manufactured(worst.output, columns[worst.output], keeping(limits, columns), tuple(costs))


def _costs(sampler: Sampler, limits: list[Limit], worst: Limit, design: Array, columns: Columns) -> list[Cost]:
    """Return the dimensions by the cost of their tolerances, the most expensive first.

    Of the first mechanisms the output ``columns`` are known.  The dimensions with the largest share in the variance of
    an output, times the share that violates its limit, are made exact one at a time.  A limit that all these mechanisms
    keep by a standard deviation is kept then, too.
    """
    family, tolerance, baseline = sampler.source.family, sampler.tolerance, float(keeping(limits, columns).mean())
    designs = sampler.designs(design, slice(COST_SAMPLE))
    limits = [x for x in limits if x is worst or _near(x, columns[x.output])]
    variance = _variance(columns, worst)
    costs = []
    varied = np.flatnonzero(tolerances_of(family, design, tolerance))
    importance = np.zeros(len(varied))
    for limit in limits:
        values = compared(limit.output, np.asarray(columns[limit.output], np.float64))
        finite = np.isfinite(values)
        if not finite.any():
            continue  # no mechanism has this output, and no single dimension changes that
        dp, dx = designs[finite][:, varied] - design[varied], values[finite] - values[finite].mean()
        shares = (dx @ dp) ** 2 / (dp**2).sum(axis=0)
        importance += shares / max(shares.sum(), 1e-300) * (1.0 - float(meets(limit, columns[limit.output]).mean()))
    for k in varied[np.argsort(-importance, kind="stable")[:COSTS]]:
        parameter = family.parameters[k]
        columns = sampler.outputs(design, [x.output for x in limits], count=COST_SAMPLE, exact=int(k))
        spread = 1.0 - _variance(columns, worst) / variance if variance > 0.0 else 0.0
        gain = float(keeping(limits, columns).mean()) - baseline
        costs.append(Cost(parameter.name, parameter.text, max(spread, 0.0), gain))
    return sorted(costs, key=lambda cost: (-cost.gain if cost.gain >= TELLING_GAIN else 0.0, -cost.spread))


def _near(limit: Limit, column: NDArray[np.generic]) -> bool:
    """Tell whether a value violates the limit, or is within one standard deviation of it."""
    return not meets(limit.drawn_in(math.sqrt(_variance({limit.output: column}, limit))), column).all()


def _variance(columns: Columns, limit: Limit) -> float:
    values = compared(limit.output, np.asarray(columns[limit.output], np.float64))
    finite = values[np.isfinite(values)]
    return float(finite.var()) if finite.size else 0.0
