"""Study files: a question about a mechanism, written as TOML (docs/study-files.md)."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from sweep.study.space import Axis, DesignSpace
from sweep.study.study import (
    Budget,
    Limit,
    Objective,
    OptimiseSettings,
    OutputSettings,
    ParetoSettings,
    ProveSettings,
    Study,
    Tolerance,
)

if TYPE_CHECKING:
    from sweep.study.load import load_study, study_from_data, with_accuracy

__all__ = [
    "Axis",
    "Budget",
    "DesignSpace",
    "Limit",
    "Objective",
    "OptimiseSettings",
    "OutputSettings",
    "ParetoSettings",
    "ProveSettings",
    "Study",
    "Tolerance",
    "load_study",
    "study_from_data",
    "with_accuracy",
]


def __getattr__(name: str) -> Any:
    # Reading a file imports pydantic, which a worker that receives a finished study does not need.
    if name in ("load_study", "study_from_data", "with_accuracy"):
        from sweep.study import load

        return getattr(load, name)
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
