"""A complete dataset folder as read by the report, and single designs of it."""

from __future__ import annotations

from collections.abc import Container, Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any

from kernels import status as codes
from sweep.chunks.plan import PARAMETER_UNITS
from sweep.dataset import chunk_files, files, store
from sweep.dataset.files import check_tables
from sweep.dataset.reading import of_number
from sweep.errors import InputError
from sweep.evaluation.cyclogram import cyclogram, table_in_degrees
from sweep.evaluation.summaries import design_outputs, output
from sweep.evaluation.tables import design_matrix
from sweep.families.base import Family
from sweep.families.machines.machine import Machine
from sweep.families.names import is_largest, is_place, stem
from sweep.optimise import Survey, read_survey
from sweep.quantities.kinds import is_windowed
from sweep.quantities.resolve import find
from sweep.report.quantities import ShownQuantity, quantity
from sweep.report.scan import Cells, Scan, divided_axes, scan
from sweep.study import Study
from sweep.study.load import study_of

if TYPE_CHECKING:
    import pandas as pd


Row = Mapping[str, Any]


@dataclass(frozen=True)
class Dataset:
    """Parts, optimum, front and curves of one folder, and their study.

    ``units`` and ``definitions`` come from the field metadata of the Parquet files; ``best`` is the best row of the
    sweep after it has been read, None if no design is feasible; ``computed_reference`` is the reference if no optimiser
    has stored it in the folder.  ``survey`` describes the starts of the search; ``front_steps`` is the progress of a
    front that ran out of time.
    """

    folder: Path
    plan: dict[str, Any]
    study: Study
    parts: tuple[Path, ...]
    units: dict[str, str]
    definitions: dict[str, str]
    optima: pd.DataFrame | None = None
    curves: pd.DataFrame | None = None
    front: pd.DataFrame | None = None
    runs: tuple[dict[str, Any], ...] = ()
    survey: Survey | None = None
    front_steps: str | None = None
    best: Row | None = None
    computed_reference: Row | None = None

    def shown(self, name: str) -> ShownQuantity:
        """Return a column's display form."""
        form, family = quantity(name, self.units.get(name, "")), self.study.family
        asked = None if self.study.window is None else find(family, name)
        if asked is not None and is_windowed(family, asked):
            return replace(form, words=f"{form.words} in the window")
        return form

    @property
    def objective(self) -> ShownQuantity | None:
        """Display form of the objective; None without an objective."""
        return None if self.study.objective is None else self.shown(self.study.objective.output)

    def design(self, row: Row) -> dict[str, float]:
        """Return the parameters of a row's mechanism."""
        return {name: float(row[name]) for name in self.study.family.parameter_names}

    @property
    def counts(self) -> dict[int, int]:
        """Number of designs by status, including those that were not kept."""
        codes = {name: code for code, name in chunk_files.STATUS_NAMES.items()}
        return {codes[name]: count for name, count in (self.plan.get("counts") or {}).items() if name in codes}

    @property
    def missed(self) -> dict[str, int]:
        """Number of designs by the first limit that they miss."""
        return {str(name): int(count) for name, count in (self.plan.get("missed") or {}).items()}

    @property
    def designs(self) -> int:
        """Number of designs in the design space."""
        return self.study.space.count

    @cached_property
    def optimum(self) -> Row | None:
        """Row of the optimiser's result."""
        return self._role("optimum")

    @cached_property
    def drawing(self) -> Row | None:
        """Row of the best drawing: the optimum, or what it is without the distance that what is made needs."""
        return self._role("nominal") or self.optimum

    @cached_property
    def reference(self) -> Row | None:
        """Row of the design with which the result is compared."""
        stored = self._role("reference")
        return self.computed_reference if stored is None else stored

    @property
    def result(self) -> Row | None:
        """Optimum if there is one, otherwise the best design of the sweep, or without an objective its first one."""
        return self.optimum if self.optimum is not None else self.best

    @property
    def result_name(self) -> str:
        """Name of the result; without an objective no design is better than another."""
        if self.optimum is not None:
            return "optimum"
        return "first of the sweep" if self.study.objective is None else "best of the sweep"

    @property
    def starts(self) -> int:
        """Number of designs from which the optimiser started."""
        if self.optima is None:
            return 0
        return int(self.optima["role"].isin(["optimum", "start"]).sum())

    @property
    def active(self) -> list[str]:
        """Outputs and parameters whose limits the optimiser reports as active, without bounds of its search."""
        words = "" if self.optimum is None else str(self.optimum.get("active") or "")
        limits = [word.strip() for word in words.split(";") if word.strip() and not word.strip().endswith(" bound")]
        return [word.split()[0].rstrip(":,") for word in limits]

    @cached_property
    def second(self) -> str | None:
        """Second criterion besides the objective: that of [pareto], otherwise a deviation, otherwise another maximum.

        None if larger values of it are better.
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
        """Criterion of the trade-off: that of [pareto], also if larger values are better."""
        return self.study.pareto.output if self.study.pareto is not None else self.second

    def _role(self, role: str) -> Row | None:
        rows = [] if self.optima is None else records(self.optima[self.optima["role"] == role])
        return next(iter(rows), None)


def read_dataset(folder: Path) -> Dataset:
    """Read the data of the report, except the rows of the parts.

    Raises
    ------
    InputError
        if the folder is no complete dataset.
    """
    import pyarrow.parquet as pq

    folder = files.located(folder)
    plan = files.trusted_plan(folder)
    if plan is None:
        needed = f"a dataset folder, with a readable {files.PLAN} in {files.beside(folder)} (sweep run makes one)"
        raise InputError("folder", str(folder), needed, "report")
    if not store.is_complete(folder):
        raise InputError("folder", str(folder), "a complete dataset; run the study again to resume it", "report")
    if not plan.get("complete"):  # killed after the last chunk, before the totals were written
        counts, missed = store.totals(folder)
        plan |= {"counts": counts, "missed": missed}
    study = study_of(plan, files.beside(folder) / files.PLAN)
    optima, curves, front = (files.beside(folder) / name for name in (files.OPTIMUM, files.CURVES, files.PARETO))
    check_tables(folder, (*files.OF_OPTIMUM, files.PARETO))
    chunks = chunk_files.parts(folder)
    chunk_files.check_columns(chunks)
    parts = tuple(part.path for part in chunks)
    schemas = [pq.read_schema(path) for path in (front, curves, optima, *parts[:1]) if path.exists()]
    units, definitions = (
        {name: text for schema in schemas for name, text in chunk_files.noted(schema, key).items()}
        for key in (b"unit", b"definition")
    )
    return Dataset(
        folder=folder,
        plan=plan,
        study=study,
        parts=parts,
        units={o.name: o.unit.replace("length", "mm") for o in study.family.pose_outputs} | units,
        definitions={o.name: o.text for o in study.family.pose_outputs} | definitions,
        optima=_with_defaults(study, files.read_table(optima)) if optima.exists() else None,
        curves=files.read_table(curves) if curves.exists() else None,
        front=_with_defaults(study, files.read_table(front)) if front.exists() else None,
        runs=tuple(files.read_runs(folder)),
        survey=read_survey(optima),
        front_steps=store.front_cut_short(front),
    )


def without_rows(study: Study) -> Dataset:
    """Return the data of the report for a study that has not been run."""
    family = study.family
    outputs = [*family.pose_outputs, *(output(family, name) for name in study.want)]
    return Dataset(
        folder=study.path.parent,
        plan={},
        study=study,
        parts=(),
        units={p.name: PARAMETER_UNITS[p.unit] for p in family.parameters}
        | {o.name: o.unit.replace("length", "mm") for o in outputs},
        definitions={o.name: o.text for o in outputs},
    )


def _with_defaults(study: Study, rows: pd.DataFrame) -> pd.DataFrame:
    """Add parameters that an earlier version did not have, with the values that leave their feature out."""
    return rows.assign(**_absent(study, rows))


def _absent(study: Study, known: Container[str]) -> dict[str, float]:
    """Return the optional parameters that are not among the known ones, with their defaults."""
    # In a dataset of an earlier version an option of later versions was not used.
    defaults = {p.name: 0.0 if p.unless else p.default for p in study.family.parameters if p.name not in known}
    return {name: value for name, value in defaults.items() if value is not None}


ROLES = ("optimum", "reference", "best")


@dataclass(frozen=True)
class ChosenDesign:
    """A design with its mechanism; ``speed`` is that of the study's scene [rad/s]."""

    family: Family
    design: dict[str, float]
    speed: float | None


def chosen(folder: str | Path, design: str | int | None = None) -> ChosenDesign:
    """Return a design of a dataset.

    Parameters
    ----------
    folder : folder that `sweep run` has written
    design : "optimum", "reference", "best" (of the sweep) or a number of the column ``design``; by default the optimum,
        or the best design if nothing was optimised

    Raises
    ------
    InputError
        for a folder that is no complete dataset, or has no such design.
    """
    path = files.located(folder)
    if isinstance(design, int) or (isinstance(design, str) and design.lstrip("-").isdigit()):
        data = read_dataset(path)
        return _chosen(data, records(_with_defaults(data.study, of_number(path, int(design))))[0])
    if design is not None and design not in ROLES:
        raise InputError("design", design, f"{', '.join(ROLES)}, or a number of the column design", str(folder))
    data = read_dataset(path)
    if design == "best" or (design == "reference" and data.optima is None) or (design is None and data.optimum is None):
        data, _, _ = gather(path)  # reads all rows
    row = {"optimum": data.optimum, "reference": data.reference, "best": data.best, None: data.result}[design]
    if row is None and design is None:
        allowed = "at least one; or name a design: reference, or a number of the column design"
        raise InputError("designs within all limits", 0, allowed, str(folder))
    if row is None:
        allowed = f"one this dataset has, of {', '.join(ROLES)}, or a number of the column design"
        raise InputError("design", design, allowed, str(folder))
    return _chosen(data, row)


def _chosen(data: Dataset, row: Row) -> ChosenDesign:
    return ChosenDesign(data.study.family, data.design(row), data.study.speed)


def as_result(data: Dataset, row: Row) -> Dataset:
    """Return the dataset with a design in place of its result."""
    return replace(data, best=row, optima=None, computed_reference=None)


def records(frame: pd.DataFrame) -> list[dict[str, Any]]:
    """Return the rows of a table as dicts by column name."""
    return [{str(name): value for name, value in row.items()} for row in frame.to_dict("records")]


def cyclogram_of(data: Dataset) -> pd.DataFrame | None:
    """Return the cyclogram of a machine's result, angles in degrees; None for any other mechanism."""
    if data.result is None or not isinstance(data.study.family, Machine):
        return None
    return table_in_degrees(cyclogram(data.study.family, data.design(data.result), angles="rad"))


def marked(data: Dataset) -> dict[str, Any]:
    """Return the designs that are marked in the figures of the design space."""
    rows = {} if data.study.objective is None else {data.result_name: data.result}
    return rows | {"reference": data.reference}


def gather(folder: Path) -> tuple[Dataset, Scan, list[Cells]]:
    """Read a dataset and all its rows."""
    return read_rows(read_dataset(folder))


def read_rows(data: Dataset) -> tuple[Dataset, Scan, list[Cells]]:
    """Read all rows of a dataset once, and compute a reference that no optimiser has stored."""
    feasible = data.counts.get(codes.OK, 0)
    cells = divided_axes(data.study, feasible)
    objective = None if data.objective is None else data.objective.name
    larger = data.study.pareto is not None and data.study.pareto.at_least
    second = data.against if objective is not None else None
    total = sum(data.counts.values()) if data.study.output.keep == "all" else feasible
    scanned = scan(data.parts, cells, objective, second, larger, total)
    scanned.best_row |= _absent(data.study, scanned.best_row) if scanned.best_row else {}
    data = replace(data, best=scanned.best_row or None)
    if data.optima is None and data.study.reference is not None:
        data = replace(data, computed_reference=row_of(data.study, reference_of(data.study)))
    return data, scanned, cells


def reference_of(study: Study) -> dict[str, float]:
    """Return the reference design of a study that has one, with what it leaves out."""
    matrix, _ = design_matrix(study.family, study.reference or {})
    return dict(zip(study.family.parameter_names, matrix[0].tolist(), strict=True))


def row_of(study: Study, design: Mapping[str, float]) -> Row:
    """Return a design with the outputs that a study wants, computed like those of its sweep."""
    matrix, _ = design_matrix(study.family, design)
    outputs = design_outputs(study.family, matrix, study.want, study.accuracy, study.window)
    return dict(design) | {name: float(values[0]) for name, values in outputs.items()}
