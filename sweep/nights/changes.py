"""Changes of a study since the last good night, and its headline figures."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from statistics import median
from typing import TYPE_CHECKING, Any

import numpy as np

from sweep.dataset import files
from sweep.dataset.comparison import LEAST_SECONDS, ROWS_CHANGED, SLOWER, VALUES_CHANGED, compare
from sweep.dataset.reading import best
from sweep.dataset.store import differences
from sweep.nights.archive import NightRecord
from sweep.study import Study

if TYPE_CHECKING:
    import pandas as pd


# Tolerance of a study that samples its extrema, without an accuracy: rounding may differ between versions.
ROUNDING = {"float64": 1e-12, "float32": 1e-6}
# Relative changes within which a search repeats: of the objective, and of dimensions in a flat valley.
OBJECTIVE_RTOL, DIMENSION_RTOL = 1e-6, 1e-4
# Bounds that a front places depend on the designs and repeat like dimensions, here relative to the range of bounds; a
# gap that gets one is 1/256 wide (`sweep.optimise.front.pareto.LEAST_WIDTH`), so bounds cannot be confused.  A study is
# slower if it takes this multiple of the median of earlier nights, twice in a row, with enough nights.
SLOWER_FACTOR, LEAST_NIGHTS, MOST_NIGHTS = 1.5, 3, 7

DESIGNS, WITHIN, SHARE = "designs", "designs within all limits", "share within all limits"


@dataclass(frozen=True)
class Changes:
    """Changes between two nights: exit code of ``sweep compare``, words, changed figures, an edited study."""

    code: int
    lines: tuple[str, ...]
    moved: tuple[str, ...] = ()
    edited: bool = False


def figures(study: Study, folder: Path) -> tuple[dict[str, float], dict[str, str]]:
    """Return the headline figures of a complete dataset and their units: designs, feasible designs, best objective.

    The best objective is that of the optimum, or without an optimisation that of the best design of the sweep.
    """
    plan = files.read_plan(folder) or {}
    counts = plan.get("counts") or {}
    number, within = sum(counts.values()), counts.get("OK", 0)
    values: dict[str, float] = {DESIGNS: number, WITHIN: within, SHARE: within / number if number else 0.0}
    units = {DESIGNS: "", WITHIN: "", SHARE: ""}
    if study.objective is None:
        return values, units
    name = study.objective.output
    optimum = _role(files.beside(folder) / files.OPTIMUM, "optimum")
    if optimum is not None:
        value = float(optimum[name])
    else:
        rows = best(folder, name, 1)
        value = float(rows[name].iloc[0]) if len(rows) else math.nan
    if math.isfinite(value):
        values[name] = value
        units[name] = next((c["unit"] for c in plan.get("columns", []) if c["name"] == name), "")
    return values, units


def _asked(plan: Mapping[str, Any]) -> list[str]:
    """Fingerprints of a study: without what follows the sweep, and the whole one if an optimum follows."""
    # the key of an optimum is identity, fingerprint and sources (`sweep.engine.searches.optimum_key`)
    return [str(plan.get("study")), *str(plan.get("optimised") or "").split("-")[1:2]]


def changes(study: Study, old: Path, new: Path) -> Changes:
    """Compare a study's dataset with that of an earlier night.

    Values are compared design by design within the study's accuracy, optimum and front within the accuracy of their
    searches.

    Parameters
    ----------
    study : tonight's study
    old, new : folders of the chunks, both complete
    """
    plans = [files.read_plan(folder) or {} for folder in (old, new)]
    if _asked(plans[0]) != _asked(plans[1]):
        words = differences(plans[0].get("data") or {}, plans[1].get("data") or {})
        edit = f"the study itself was edited: {'; '.join(words) or 'its fixed tables'}"
        return Changes(ROWS_CHANGED, (edit,), edited=True)
    rtol = study.accuracy.target or ROUNDING[study.output.dtype]
    comparison = compare(old, new, rtol)
    # The optimum and the reference have tolerances of their own.
    comparison.moved = {name: moved for name, moved in comparison.moved.items() if moved.kind == "design"}
    comparison.seconds = None
    code = ROWS_CHANGED if comparison.rows_changed else VALUES_CHANGED if comparison.values_changed else 0
    moved = [name for name, column in comparison.moved.items() if column.changed or column.missing]
    lines = comparison.lines() if code else []
    for further, names in (_counts(plans), _optimum(study, old, new), _front(study, old, new)):
        lines += further
        moved += names
        code = code or (VALUES_CHANGED if further else 0)
    return Changes(code, tuple(lines), tuple(dict.fromkeys(moved)))


def _counts(plans: Sequence[Mapping[str, Any]]) -> tuple[list[str], list[str]]:
    old, new = (plan.get("counts") or {} for plan in plans)
    if old == new:
        return [], []
    words = [f"{n} {old.get(n, 0)} -> {new.get(n, 0)}" for n in sorted({*old, *new}) if old.get(n, 0) != new.get(n, 0)]
    names = [WITHIN, SHARE] if old.get("OK", 0) != new.get("OK", 0) else []
    return [f"designs by status moved: {', '.join(words)}"], names


def _optimum(study: Study, old: Path, new: Path) -> tuple[list[str], list[str]]:
    before, after = (_role(files.beside(folder) / files.OPTIMUM, "optimum") for folder in (old, new))
    if before is None or after is None or study.objective is None:
        return [], []
    name, lines = study.objective.output, []
    both_missing = math.isnan(before[name]) and math.isnan(after[name])
    if not both_missing and not math.isclose(before[name], after[name], rel_tol=OBJECTIVE_RTOL):
        lines.append(f"optimum moved: {name} {before[name]:.10g} -> {after[name]:.10g}")
    sizes = {p.name: max(abs(before[p.name]), abs(after[p.name])) for p in study.family.parameters}
    # A length near zero is compared relative to the longest one.
    largest = max((sizes[p.name] for p in study.family.parameters if p.unit == "length"), default=0.0)
    dimensions = []
    for p in study.family.parameters:
        scale = largest if p.unit == "length" else max(sizes[p.name], 1.0)
        if not abs(before[p.name] - after[p.name]) <= DIMENSION_RTOL * scale:
            dimensions.append(f"{p.name} {before[p.name]:.8g} -> {after[p.name]:.8g}")
    if dimensions:
        lines.append(f"optimum moved in its dimensions: {', '.join(dimensions)}")
    return lines, [name] if lines else []


def _front(study: Study, old: Path, new: Path) -> tuple[list[str], list[str]]:
    paths = [files.beside(folder) / files.PARETO for folder in (old, new)]
    if study.objective is None or study.pareto is None or not all(path.is_file() for path in paths):
        return [], []
    name, bound = study.objective.output, study.pareto.output
    tables = [files.read_table(path).drop_duplicates("bound").sort_values("bound") for path in paths]
    at, values = (tables[0][column].to_numpy() for column in ("bound", name))
    now, then = (tables[1][column].to_numpy() for column in ("bound", name))
    if not (at.size and now.size):
        return ([f"front: {at.size} bounds before, {now.size} now"] if at.size != now.size else []), []
    nearest = np.abs(now - at[:, None]).argmin(axis=1)
    distance = np.abs(now[nearest] - at)
    pairs = distance <= DIMENSION_RTOL * np.ptp(at)
    lines = []
    if not len(at) == len(now) == pairs.sum():
        lines.append(f"front: {len(at)} bounds before, {len(now)} now, {pairs.sum()} of them the same")
    # Between neighbouring bounds a front is no steeper than to its neighbours; for equal bounds this allows nothing.
    slopes = np.nan_to_num(np.abs(np.diff(values) / np.diff(at)))
    steepest = np.maximum(np.append(slopes, 0.0), np.append(0.0, slopes))
    allowed = OBJECTIVE_RTOL * np.fmax(np.abs(values), np.abs(then[nearest])) + steepest * distance
    moved = np.abs(then[nearest] - values)
    far = np.flatnonzero(pairs & ~(moved <= allowed) & ~(np.isnan(values) & np.isnan(then[nearest])))
    if far.size:
        worst = far[np.nan_to_num(moved[far], nan=np.inf).argmax()]
        lines.append(
            f"front moved at {far.size} of {pairs.sum()} bounds, most at {bound} = {at[worst]:g}: "
            f"{name} {values[worst]:.8g} -> {then[nearest[worst]]:.8g}"
        )
    return lines, []


def slower(name: str, seconds: float, history: Sequence[NightRecord]) -> Changes:
    """Report a study whose run takes longer than the recent median allows, twice in a row.

    Parameters
    ----------
    name : name of the study
    seconds : time of tonight's run, in which every chunk was computed
    history : earlier nights, the oldest first; runs that linked chunks are left out
    """
    times = [
        night.studies[name].seconds
        for night in history
        if name in night.studies and night.studies[name].state == "complete" and not night.studies[name].linked
    ]
    measured = [time for time in times if time is not None]
    before, last = measured[:-1][-MOST_NIGHTS:], measured[-1:]
    if len(before) < LEAST_NIGHTS or seconds < LEAST_SECONDS:
        return Changes(0, ())
    allowed = SLOWER_FACTOR * median(before)
    if seconds <= allowed or last[0] <= allowed:
        return Changes(0, ())
    words = f"slower twice in a row: {last[0]:.3g} s and {seconds:.3g} s, the median before is {median(before):.3g} s"
    return Changes(SLOWER, (words,))


def _role(path: Path, role: str) -> pd.Series[Any] | None:
    """Return the row of a role in the optimiser's table, or None."""
    if not path.is_file():
        return None
    table = files.read_table(path)
    rows = table[table["role"] == role]
    return rows.iloc[0] if len(rows) else None
