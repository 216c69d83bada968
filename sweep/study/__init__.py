"""Study files: a question about a mechanism, written as TOML (docs/study-files.md)."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from sweep.study.study import Limit as Limit
from sweep.study.study import OptimiseSettings as OptimiseSettings
from sweep.study.study import ParetoSettings as ParetoSettings
from sweep.study.study import ProveSettings as ProveSettings
from sweep.study.study import Study as Study
from sweep.study.study import Tolerance as Tolerance

if TYPE_CHECKING:
    from sweep.study.load import load_study as load_study
    from sweep.study.load import study_from_data as study_from_data


def __getattr__(name: str) -> Any:
    # Reading a file imports pydantic, which a worker that receives a finished study does not need.
    if name in ("load_study", "study_from_data"):
        from sweep.study import load

        return getattr(load, name)
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
