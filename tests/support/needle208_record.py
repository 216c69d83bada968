"""The study needle208 without the limits that make it buildable, as its record on paper has it."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from sweep.study import Study, load_study, study_from_data

FOLDER = Path(__file__).parents[2] / "studies" / "needle208"


def record(least: float | None = None, **optimise: Any) -> Study:
    """Return the study on paper: 0.015 mm for the nominal design, links of any length or at least ``least`` [mm]."""
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
