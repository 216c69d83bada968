"""The tables of a study file: the subject of each, and the models of tables with fixed keys."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from sweep.study.accuracy import AccuracySection
from sweep.study.design import ReferenceSection
from sweep.study.file import Section, StudyFile, fields, read_table
from sweep.study.loads import CurveSection, SceneSection
from sweep.study.locus import FitSection
from sweep.study.mechanism import MechanismSection, MemberSection, RelationSection, ShaftSection, ToolSection
from sweep.study.objective import ObjectiveSection, OptimiseSection, ParetoSection
from sweep.study.report import BudgetSection, OutputSection, ReportSection, StudySection
from sweep.study.thread import ThreadSection
from sweep.study.tolerance import ToleranceSection

REQUIRED_TABLES = ("study", "design")


@dataclass(frozen=True)
class TableModel:
    """Subject of a table, its model, and the model of the entries under its names."""

    about: str
    model: type[Section] | None = None
    each: type[Section] | None = None


MACHINE = "Members on one main shaft, and what they are to each other."
DESIGNS = "The designs of the study, and one design to compare them with."
INPUTS = "What the effects of a scene ask for besides the mechanism, and loads over the turn."
COSTS = "What is stored, and what a run may cost."

# Messages and the schema list the tables in this order.
TABLES: Mapping[str, TableModel] = {
    "study": TableModel("Name, title and question.", StudySection),
    "mechanism": TableModel("What the study is about.", MechanismSection),
    "machine": TableModel(MACHINE, each=MemberSection),
    "shafts": TableModel("Axes that turn with the main shaft, which cranks of members sit on.", each=ShaftSection),
    "tools": TableModel("Needles and blades, which gaps and moments are about.", each=ToolSection),
    "relations": TableModel(MACHINE, each=RelationSection),
    "thread": TableModel(
        "The threads of a machine, each from its tensioner over points and take-ups to the stitch.", each=ThreadSection
    ),
    "scene": TableModel("Speed, wanted design outputs and the window of the stroke.", SceneSection),
    "design": TableModel(DESIGNS),
    "bodies": TableModel(INPUTS),
    "loads": TableModel(INPUTS, each=CurveSection),
    "locus": TableModel("Limit positions of the first stage, from which its links follow."),
    "fit": TableModel("The line that a guided point is fitted to.", FitSection),
    "limits": TableModel("Bounds of design outputs and of parameters."),
    "cyclogram": TableModel("When events of a machine happen and its members stroke: limits of crank angles."),
    "objective": TableModel("The design output to be made small, or large.", ObjectiveSection),
    "accuracy": TableModel(
        "A relative error of the extrema, or a grid of crank angles; and what is to be proven.", AccuracySection
    ),
    "optimise": TableModel("How the optimiser searches.", OptimiseSection),
    "task": TableModel("A task of the engineering method, whose mechanisms are where the study's search begins."),
    "pareto": TableModel("A second output and the bounds on it, each given once, in its unit.", ParetoSection),
    "tolerance": TableModel("How far the lengths and angles of a mechanism that is made may be off.", ToleranceSection),
    "reference": TableModel(DESIGNS, ReferenceSection),
    "output": TableModel(COSTS, OutputSection),
    "budget": TableModel(COSTS, BudgetSection),
    "report": TableModel("Figures and curves of the report.", ReportSection),
}


@dataclass(frozen=True)
class Sections:
    """Tables of a file as read by their models; a missing table has all its defaults."""

    study: StudySection
    mechanism: MechanismSection
    scene: SceneSection
    fit: FitSection
    objective: ObjectiveSection
    accuracy: AccuracySection
    optimise: OptimiseSection
    pareto: ParetoSection
    tolerance: ToleranceSection
    reference: ReferenceSection
    output: OutputSection
    budget: BudgetSection
    report: ReportSection


def read_sections(file: StudyFile) -> Sections:
    """Read every table by its model; report unknown and missing tables, unknown keys and wrong values."""
    models = {name: table.model for name, table in TABLES.items() if table.model is not None}
    homes = {key: f"; {key} is a key of [{name}]" for name, model in models.items() for key in fields(model)}
    file.faults.homes = homes | {name: f"; {name} is a table of its own, [{name}]" for name in TABLES}
    for name in file.data:
        if name not in TABLES:
            file.faults.unknown((name,), [table for table in TABLES if table not in file], "table")
    for name in REQUIRED_TABLES:
        if name not in file:
            file.faults.missing((name,), f"a table [{name}]")
    for name in ("design", "bodies", "loads", "locus", "limits", "cyclogram"):
        file.free_table(name)
    read: dict[str, Any] = {name: read_table(model, name, file) for name, model in models.items()}
    return Sections(**read)
