"""Manufactured mechanisms of the optimum: yield, cost of tolerances, spread of outputs, slopes of the objective."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from sweep.dataset import files
from sweep.evaluation.cyclogram import event_angles
from sweep.families.base import Array
from sweep.families.names import is_flag, without_minus
from sweep.optimise.manufacture.sample import (
    TELLING_GAIN,
    Cost,
    Manufactured,
    Sampler,
    limits_of_made,
    manufactured,
)
from sweep.quantities import resolve
from sweep.quantities.limits import compared, meets
from sweep.report.dataset import Dataset, records
from sweep.report.quantities import ShownQuantity, number, quantity
from sweep.study import Limit

if TYPE_CHECKING:
    import pandas as pd
    from numpy.typing import NDArray


NOWHERE = (math.nan, math.nan)
BINS = 41
FAR = 2.0  # spreads of the sample beyond which a bound is not drawn, as the histogram would be one bar
STEPS = {"length": (0.1, "0.1\u00a0mm"), "angle": (math.radians(0.1), "0.1°")}


@dataclass(frozen=True)
class Histogram:
    """Histogram of an output over manufactured mechanisms: edges and shares of its bins, and the bounds of its limit.

    Edges and bounds are in the unit shown.  A bound far from all mechanisms is None, like a missing one; ``within``
    counts it.
    """

    shown: ShownQuantity
    edges: Array
    shares: Array
    low: float | None
    high: float | None
    within: float

    @property
    def missing(self) -> NDArray[np.bool_]:
        """Mask of the bins that miss the limit."""
        middle = 0.5 * (self.edges[:-1] + self.edges[1:])
        low, high = (-math.inf if self.low is None else self.low), (math.inf if self.high is None else self.high)
        return (middle < low) | (middle > high)

    @property
    def digits(self) -> int:
        """Number of significant digits by which its ends differ, three at least."""
        low, high = float(self.edges[0]), float(self.edges[-1])
        return 3 + max(0, math.floor(math.log10(max(abs(low), abs(high)) / (high - low))))


class YieldSummary(NamedTuple):
    """Yield of the result, histogram of the limit missed most, and cost of the dimensions' tolerances."""

    share: float
    histogram: Histogram
    costs: tuple[Cost, ...]


def sampler(data: Dataset, samples: int | None = None) -> Sampler | None:
    """Return what samples a dataset's mechanisms, as many as its tolerances say; None without them or a search."""
    study = data.study
    if study.tolerance is None or study.optimise is None:
        return None
    return Sampler(study, replace(study.tolerance, samples=samples or study.tolerance.samples), study.optimise.seed)


def made(data: Dataset) -> YieldSummary | None:
    """Return the yield of the optimum; None without tolerances, an optimum, or an inequality limit."""
    sample = _manufactured(data)
    if sample is None:
        return None
    limits = [limit for limit in limits_of_made(data.study) if limit.output == sample.output]
    worst = min(limits, key=lambda limit: float(meets(limit, sample.values).mean()))
    return YieldSummary(float(sample.kept.mean()), _histogram(data, worst, sample.values), sample.costs)


def _manufactured(data: Dataset) -> Manufactured | None:
    """Read the sample that the search has stored; for a dataset of an earlier version compute it."""
    path = files.beside(data.folder) / files.MADE
    if path.is_file():
        rows, costs = files.read_table(path), json.loads(files.metadata(path)[b"costs"])
        return Manufactured(
            rows.columns[0], rows.iloc[:, 0].to_numpy(), rows["kept"].to_numpy(), tuple(Cost(*x) for x in costs)
        )
    source = sampler(data)
    if source is None or data.optimum is None:
        return None
    return manufactured(data.study, design_of(data, data.optimum), source)


def design_of(data: Dataset, row: Mapping[str, Any]) -> Array:
    """Return the design (P,) of a row."""
    return np.array([float(row[name]) for name in data.study.family.parameter_names])


def made_sentence(result: YieldSummary | None, tolerance: str) -> str:
    """Return a sentence about the yield and the most expensive tolerance, for the answer."""
    if result is None:
        return ""
    text = f"Of what is made within {tolerance}, {number(100.0 * result.share, 3)}\u00a0% keeps all limits"
    most = next(iter(result.costs), None)
    if most is None or result.share == 1.0:
        return f"{text}."
    if most.gain >= TELLING_GAIN:
        gain = number(100.0 * most.gain, 2)
        return f"{text}; the dimension that costs most is {most.name}: were it exact, {gain} points more would."
    share, words = number(100.0 * most.spread, 2), result.histogram.shown.words
    return f"{text}; the dimension that scatters the {words} most is {most.name}, with {share}\u00a0% of its variance."


def histogram(data: Dataset, output: str) -> Histogram | None:
    """Return the histogram of one output over manufactured mechanisms; None without tolerances or an optimum."""
    study, source = data.study, sampler(data)
    if source is None or data.optimum is None:
        return None
    resolve.output(study.family, output)  # raises for an unknown name
    values = source.outputs(design_of(data, data.optimum), [output])[output]
    limits = [x for x in study.output_limits if x.output == output]
    # Of two limits the last one is the tolerance band around a prescribed output.
    return _histogram(data, limits[-1] if limits else Limit(output, None, None), values)


def _histogram(data: Dataset, limit: Limit, column: NDArray[np.generic]) -> Histogram:
    values = compared(limit.output, np.asarray(column, np.float64))
    shown = quantity(limit.output, resolve.output(data.study.family, limit.output).unit)
    finite = values[np.isfinite(values)] * shown.factor
    low, high = np.percentile(finite, (0.1, 99.9)) if finite.size else (0.0, 1.0)
    far = FAR * (high - low) or math.inf
    bounds = [None if x is None else x * shown.factor for x in (limit.minimum, limit.maximum)]
    bounds = [x if x is not None and low - far <= x <= high + far else None for x in bounds]
    ends = [low, high, *(x for x in bounds if x is not None)]
    low, high = min(ends), max(ends)
    room = 0.03 * (high - low) or 1e-9 * max(abs(high), 1.0)
    low, high = low - room, high + room
    width = (high - low) / BINS
    at = next((x for x in bounds if x is not None), low)  # no bin contains a bound in its interior
    first = at - width * np.ceil((at - low) / width)
    edges = first + width * np.arange(BINS + 2)
    edges[np.argmin(np.abs(edges - at))] = at
    counts, _ = np.histogram(np.clip(finite, edges[0], edges[-1]), edges)
    shares = counts / max(values.size, 1)
    return Histogram(shown, edges, shares, bounds[0], bounds[1], float(meets(limit, values).mean()))


class Spread(NamedTuple):
    """Distribution of an output over manufactured mechanisms; ``within`` is the share that keeps its limit, or nan."""

    shown: ShownQuantity
    nominal: float
    low: float
    mean: float
    high: float
    within: float

    @property
    def changes(self) -> tuple[float, float, float] | None:
        """Low end, mean and high end relative to the nominal value in percent; None if that is zero or unknown."""
        if not abs(self.nominal) > 0.0:
            return None
        low, mean, high = (100.0 * (x / self.nominal - 1.0) for x in (self.low, self.mean, self.high))
        return low, mean, high


def spreads(data: Dataset) -> list[Spread]:
    """Return the distributions of the optimum's outputs; empty without tolerances."""
    return [
        Spread(data.shown(str(row["output"])),
               *(float(row[key]) for key in ("nominal", "low", "mean", "high", "within")))
        for row in _optimum_rows(data, files.TOLERANCE)
        if row["output"] != "all limits" and not is_flag(str(row["output"]))
    ]  # fmt: skip


def event_bands(data: Dataset) -> dict[str, tuple[float, float]]:
    """Return the interval of main-shaft angles [deg] with 95 % of the mechanisms' events of the cyclogram, by event."""
    rows = {str(row["output"]): row for row in _optimum_rows(data, files.TOLERANCE)}
    return {
        name: (math.degrees(rows[output]["low"]), math.degrees(rows[output]["high"]))
        for name, output in event_angles(data.study.family).items()
        if output in rows
    }


def with_bands(rows: pd.DataFrame, bands: Mapping[str, tuple[float, float]]) -> pd.DataFrame:
    """Return the cyclogram in degrees with the intervals of manufactured mechanisms' events; unchanged without any."""
    intervals = [bands.get(name, NOWHERE) if kind == "event" else NOWHERE
             for kind, name in zip(rows["kind"], rows["name"], strict=True)]  # fmt: skip
    ends = {"made from [deg]": [low for low, _ in intervals], "made to [deg]": [high for _, high in intervals]}
    return rows.assign(**(ends if bands else {}))


def share_made(data: Dataset) -> float:
    """Return the share of mechanisms that keep all limits, from the largest sample known; nan without one."""
    shares = [float(row["within"]) for row in _optimum_rows(data, files.TOLERANCE) if row["output"] == "all limits"]
    share = float((data.optimum or {}).get("yield", math.nan))
    return share if math.isfinite(share) else next(iter(shares), math.nan)


def tolerance_words(data: Dataset) -> str:
    """Describe the tolerances in words."""
    tolerance = data.study.tolerance
    if tolerance is None:
        return ""
    parts = [f"lengths ±{number(tolerance.lengths)}\u00a0mm"] if tolerance.lengths else []
    parts += [f"angles ±{number(math.degrees(tolerance.angles))}°"] if tolerance.angles else []
    parts += ["tolerances of their own of some dimensions"] if tolerance.own else []
    return " and ".join(parts)


class Slope(NamedTuple):
    """Change of the objective in percent for growth and for shrinkage of a dimension by ``step`` (in words)."""

    name: str
    text: str
    step: str
    growing: float
    shrinking: float

    @property
    def largest(self) -> float:
        """Larger of both changes, by magnitude."""
        return max(abs(self.growing), abs(self.shrinking))


def slopes(data: Dataset) -> list[Slope]:
    """Return the dimensions with their changes of the objective, the largest first."""
    objective = data.objective
    if objective is None:
        return []
    parameters = {p.name: p for p in data.study.family.parameters}
    ranked = []
    for row in _optimum_rows(data, files.SENSITIVITY):
        name, value = str(row["parameter"]), abs(float(row["value"]))
        if row["output"] != objective.name or not value > 0.0 or math.isnan(row["growing"]):
            continue
        step, words = STEPS.get(parameters[name].unit if name in parameters else "", (0.1, "0.1"))
        share = 100.0 * step / value
        share = -share if without_minus(objective.name) else share  # sign of the displayed output for a maximised one
        text = parameters[name].text if name in parameters else ""
        ranked.append(Slope(name, text, words, share * row["growing"], -share * row["shrinking"]))
    return sorted(ranked, key=lambda slope: -slope.largest)


def _optimum_rows(data: Dataset, file: str) -> list[dict[str, Any]]:
    """Return the optimum's rows of a table beside the dataset; empty without that table."""
    path = files.beside(data.folder) / file
    if not path.exists():
        return []
    frame = files.read_table(path)
    return records(frame[frame["role"] == "optimum"])
