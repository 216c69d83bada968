"""Price list of the families: error and time of their measure by every available method, region by region."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import TYPE_CHECKING

import numpy as np

from studies.accuracy.regions import Region, regions
from studies.accuracy.subjects import MOVES, measure, regions_of, subjects
from studies.accuracy.timing import per_design
from studies.accuracy.witness import Known, reference
from sweep.costs import nanoseconds
from sweep.errors import InputError
from sweep.evaluation.summaries import design_outputs
from sweep.families import chain_names, family
from sweep.families.base import Accuracy, Array, Family, March
from sweep.reductions.steps import check_certifiable

if TYPE_CHECKING:
    import pandas as pd

SAMPLES, TARGETS, PROVEN = (90, 360, 3600), (1e-3, 1e-6, 1e-9, 1e-12), 1e-8
SMOKE_SAMPLES, SMOKE_TARGETS = (360,), (1e-3, 1e-9)
GRID, REFINED, CERTIFIED = "grid", "accuracy=", "certified, accuracy="
JUDGED = 1e-2  # error of a reference above which it is not used
# Designs per region by the time of a pose [ns]: slow families are measured on few.
COUNTS = ((100.0, (48, 48, 16)), (2000.0, (16, 16, 8)), (float("inf"), (3, 3, 2)))
SMOKE_COUNTS, SMOKE_EVERY = (2, 0, 0), 6
EACH, SMOKE_EACH, SEED = 100, 4, 1  # crank-rockers in each of their own regions


def family_prices(smoke: bool) -> pd.DataFrame:
    """Return one row per family or chain, region and method; smoke runs take every sixth row and two designs each."""
    import pandas as pd

    rows: list[dict[str, object]] = []
    for name in subjects()[:: SMOKE_EVERY if smoke else 1]:
        rows += prices_of(family(name), regions_of(name, SMOKE_COUNTS if smoke else counts(name)), smoke)
    return pd.DataFrame(rows)


def crank_rocker_prices(smoke: bool) -> pd.DataFrame:
    """Return rows of the crank-rocker in its own regions, each with its text."""
    import pandas as pd

    found = regions(SMOKE_EACH if smoke else EACH, SEED)
    table = pd.DataFrame(prices_of(family("rssr"), found, smoke))
    return table.assign(text=table["region"].map({region.name: region.text for region in found}))


def counts(name: str) -> tuple[int, int, int]:
    """Return the number of designs of each region on which a family is measured."""
    ns = sum(nanoseconds("poses", part) for part in chain_names(name))
    return next(found for limit, found in COUNTS if ns < limit)


def prices_of(mechanism: Family, regions: Iterable[Region], smoke: bool = False) -> list[dict[str, object]]:
    """Return the rows of one family."""
    rows = []
    for region in regions:
        known = reference(mechanism, region.designs)
        head = {"family": mechanism.name, "domain": mechanism.domain.kind, "measure": measure(mechanism)}
        for method, setting, accuracy in methods(mechanism, smoke):
            row = {"region": region.name, "method": method, "setting": setting, "designs": len(region.designs)}
            rows.append(head | row | _priced(mechanism, region.designs, accuracy, known))
    return rows


def methods(mechanism: Family, smoke: bool) -> Sequence[tuple[str, float, Accuracy]]:
    """Return name, setting and accuracy of every method that the family's domain allows."""
    samples, targets = (SMOKE_SAMPLES, SMOKE_TARGETS) if smoke else (SAMPLES, TARGETS)
    found = [(GRID, float(n), Accuracy(samples=n)) for n in samples]
    if isinstance(mechanism.domain, March):
        return found
    found += [(REFINED, target, Accuracy(target=target)) for target in targets]
    proof = Accuracy(target=PROVEN, certify=True)
    try:
        check_certifiable(mechanism, [measure(mechanism)], proof)
    except InputError:  # this family supports no proof of maxima
        return found
    return [*found, (CERTIFIED, PROVEN, proof)]


def _priced(mechanism: Family, designs: Array, accuracy: Accuracy, known: Known) -> dict[str, object]:
    columns = design_outputs(mechanism, designs, [measure(mechanism)], accuracy)
    value = np.asarray(columns[measure(mechanism)], np.float64)
    answered = np.isfinite(value) & np.isin(columns["status"], MOVES)
    size = np.where(known.value != 0.0, np.abs(known.value), 1.0)
    error, sure = np.abs(value - known.value) / size, known.error / size
    judged = answered & (sure <= JUDGED)
    return {
        "largest_error": float(error[judged].max()) if judged.any() else float("nan"),
        "median_error": float(np.median(error[judged])) if judged.any() else float("nan"),
        "reference_error": float(sure[judged].max()) if judged.any() else float("nan"),
        "unanswered": int((~answered).sum()),
        "unjudged": int((answered & ~judged).sum()),
        **per_design(lambda some: design_outputs(mechanism, some, [measure(mechanism)], accuracy), designs),
    }
