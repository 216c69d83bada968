"""The sections about what can be built: different optima, yield; as the page's template takes them."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from sweep.report.dataset import Dataset
from sweep.report.figures import save
from sweep.report.groups import Group
from sweep.report.made import TELLING, made, made_sentence
from sweep.report.made_figures import histogram_figure
from sweep.report.optima import MOST, optima, optima_sentence
from sweep.report.robust import tolerance_words

COSTS = 8  # dimensions that are shown


def buildable(data: Dataset, several: list[Group], folder: Path) -> dict[str, Any]:
    """Return names of the template with what they stand for;
    pictures are saved in ``folder``, in the style in force.
    """
    make, within = made(data), tolerance_words(data)
    costs = (
        ()
        if make is None
        else tuple(cost for cost in make.costs if cost.spread >= TELLING or cost.gain >= TELLING)[:COSTS]
    )
    return {
        "optima": optima(data, several, folder),
        "optima_left": max(len(several) - MOST, 0),
        "made": make,
        "made_words": made_sentence(make, within),
        "made_histogram": "" if make is None else save(histogram_figure(make.histogram), folder / "yield.svg").uri,
        "made_costs": costs,
        "further": [text for text in (optima_sentence(data, several), made_sentence(make, within)) if text],
    }
