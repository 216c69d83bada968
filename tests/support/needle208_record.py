"""The study needle208 without what makes it buildable: the limits under which its record on paper stands."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from sweep.study import Study, load_study, study_from_data

FOLDER = Path(__file__).parents[2] / "studies" / "needle208"


def record(least: float | None = None, **optimise: Any) -> Study:
    """The study on paper: 0.015 mm of the drawing alone, links of any length or at least so long [mm]."""
    study = load_study(FOLDER)
    links = {
        name: {"max": study.data["limits"][name]["max"], "unit": "mm"} | ({} if least is None else {"min": least})
        for name in ("a2", "b2", "c2", "e2")
    }
    limits = study.data["limits"] | links
    limits |= {"stroke": {"min": 24.495, "max": 24.505, "unit": "mm"}, "max_abs_dev": {"max": 0.015, "unit": "mm"}}
    tolerance = {name: value for name, value in study.data["tolerance"].items() if name != "robust"}
    data = study.data | {"limits": limits, "tolerance": tolerance, "optimise": study.data["optimise"] | optimise}
    return study_from_data(data, study.path)
