"""A finished dataset folder as the report sees it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any

from sweep.dataset import store
from sweep.errors import InputError
from sweep.evaluation.statuses import meaning
from sweep.optimise import Survey, read_survey
from sweep.quantities.names import is_largest, is_place, stem

if TYPE_CHECKING:
    import pandas as pd

    from sweep.study import Study

Row = Mapping[str, Any]


@dataclass(frozen=True)
class Dataset:
    """Parts, optimum, front and curves of one folder, and the study they answer.

    ``units`` and ``definitions`` come from the field metadata of the Parquet files; ``best`` is the best row of the
    sweep once it has been read, None if no design is feasible; ``computed_reference`` the reference where no optimiser
    has left it in the folder.  ``survey`` is what the starts tell of the search; ``front_steps`` says how far the front
    came that time has cut short.
    """

    folder: Path
    plan: dict[str, Any]
    study: Study
    parts: tuple[Path, ...]
    units: dict[str, str]
    definitions: dict[str, str]
    optima: pd.DataFrame | None
    curves: pd.DataFrame | None
    front: pd.DataFrame | None
    runs: tuple[dict[str, Any], ...]
    survey: Survey | None = None
    front_steps: str | None = None
    best: Row | None = None
    computed_reference: Row | None = None

    @property
    def counts(self) -> dict[int, int]:
        """Designs by status, those that were not kept included."""
        codes = {name: code for code, name in store.STATUS_NAMES.items()}
        return {codes[name]: count for name, count in (self.plan.get("counts") or {}).items() if name in codes}

    @property
    def missed(self) -> dict[str, int]:
        """Designs by the limit they miss first."""
        return {str(name): int(count) for name, count in (self.plan.get("missed") or {}).items()}

    @property
    def designs(self) -> int:
        """Number of designs in the design space."""
        return self.study.space.count

    @cached_property
    def optimum(self) -> Row | None:
        """The optimiser's result."""
        return self._role("optimum")

    @cached_property
    def reference(self) -> Row | None:
        """The design the result is compared with."""
        stored = self._role("reference")
        return self.computed_reference if stored is None else stored

    @property
    def result(self) -> Row | None:
        """The optimum, or without an optimiser the best design of the sweep."""
        return self.optimum if self.optimum is not None else self.best

    @property
    def result_name(self) -> str:
        """What the result is called."""
        return "optimum" if self.optimum is not None else "best of the sweep"

    @property
    def starts(self) -> int:
        """From how many designs the optimiser started."""
        if self.optima is None:
            return 0
        return int(self.optima["role"].isin(["optimum", "start"]).sum())

    @property
    def active(self) -> list[str]:
        """Outputs and parameters whose limits the optimiser calls active; the bounds of its search are no limits."""
        words = "" if self.optimum is None else str(self.optimum.get("active") or "")
        limits = [word.strip() for word in words.split(";") if word.strip() and not word.strip().endswith(" bound")]
        return [word.split()[0].rstrip(":,") for word in limits]

    @property
    def reference_status(self) -> str:
        """Why the reference has no values."""
        code = 0 if self.reference is None else int(self.reference.get("status", 0))
        return meaning(code)

    @cached_property
    def second(self) -> str | None:
        """The criterion set against the objective: that of [pareto], else a deviation, else another maximum.

        None where more of it is better.
        """
        if self.study.pareto is not None:
            return None if self.study.pareto.at_least else self.study.pareto.output
        objective = self.study.objective
        others = [name for name in self.study.want if objective is None or name != objective.output]
        ranked = [name for name in others if "dev" in stem(name) and not is_place(name)]
        ranked += [name for name in others if is_largest(name, magnitude=True)]
        ranked += [name for name in others if is_largest(name)]
        return ranked[0] if ranked else None

    @property
    def against(self) -> str | None:
        """The criterion of the trade-off: that of [pareto], also where more of it is better."""
        return self.study.pareto.output if self.study.pareto is not None else self.second

    def _role(self, role: str) -> Row | None:
        if self.optima is None:
            return None
        rows = self.optima[self.optima["role"] == role]
        return {str(name): value for name, value in rows.iloc[0].items()} if len(rows) else None


def read_dataset(folder: Path) -> Dataset:
    """Read what the report needs, except the rows of the parts.

    Raises
    ------
    InputError
        if the folder is no complete dataset.
    """
    plan = store.read_plan(folder)
    if plan is None:
        allowed = f"a dataset folder, with a readable {store.PLAN} (sweep run makes one)"
        raise InputError("folder", str(folder), allowed, "report")
    if not store.is_complete(folder):
        raise InputError("folder", str(folder), "a complete dataset; run the study again to resume it", "report")
    if not plan.get("complete"):  # killed after the last chunk, before the totals were noted
        counts, missed = store.totals(folder)
        plan |= {"counts": counts, "missed": missed}
    study = study_of(plan, folder)
    optima, curves, front = (store.beside(folder) / name for name in (store.OPTIMUM, store.CURVES, store.PARETO))
    parts = tuple(part.path for part in store.parts(folder))
    units, definitions = field_metadata([path for path in (*parts[:1], optima, curves, front) if path.exists()])
    return Dataset(
        folder=folder,
        plan=plan,
        study=study,
        parts=parts,
        units={o.name: o.unit.replace("length", "mm") for o in study.family.pose_outputs} | units,
        definitions={o.name: o.text for o in study.family.pose_outputs} | definitions,
        optima=store.read_table(optima) if optima.exists() else None,
        curves=store.read_table(curves) if curves.exists() else None,
        front=store.read_table(front) if front.exists() else None,
        runs=tuple(store.read_runs(folder)),
        survey=read_survey(optima),
        front_steps=store.front_cut_short(front),
    )


def study_of(plan: Mapping[str, Any], folder: Path) -> Study:
    """Return the study a dataset answers, from its plan; its title and question stand there under ``about``."""
    from sweep.study.load import study_from_data

    about = plan.get("about", {"name": plan["name"]})
    return study_from_data({**plan["data"], "study": about}, store.beside(folder) / store.PLAN)


def field_metadata(files: Sequence[Path]) -> tuple[dict[str, str], dict[str, str]]:
    """Return units and definitions that stand in the schemas of Parquet files."""
    import pyarrow.parquet as pq

    units: dict[str, str] = {}
    definitions: dict[str, str] = {}
    for file in files:
        for column in pq.read_schema(file):
            about = column.metadata or {}
            if b"unit" in about:
                units.setdefault(column.name, about[b"unit"].decode())
            if b"definition" in about:
                definitions.setdefault(column.name, about[b"definition"].decode())
    return units, definitions
