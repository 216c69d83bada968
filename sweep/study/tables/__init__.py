"""The tables of a study file, one module for each table or pair of tables, and the order in which they are read.

``READERS`` has a row for every reader: the table that it is about, and a function of the
:class:`sweep.study.reading.Reading`.  A new table is a module here, its name in ``TABLES`` and a row in ``READERS``.
Faults are reported in the order of the rows.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import TypeAlias

from sweep.study.reading import Reading
from sweep.study.tables import (
    about,
    accuracy,
    bodies,
    design,
    fit,
    limits,
    locus,
    mechanism,
    objective,
    optimise,
    output,
    pareto,
    report,
    scene,
    task,
    thread,
    tolerance,
)

Reader: TypeAlias = Callable[[Reading], None]

# As messages list them.
TABLES = (
    "study",
    "mechanism",
    "machine",
    "relations",
    "thread",
    "scene",
    "design",
    "bodies",
    "loads",
    "locus",
    "fit",
    "limits",
    "objective",
    "accuracy",
    "optimise",
    "task",
    "pareto",
    "tolerance",
    "reference",
    "output",
    "budget",
    "report",
)
REQUIRED_TABLES = ("study", "design")

READERS: tuple[tuple[str, Reader], ...] = (
    # The shape of each table.
    ("study", about.read),
    ("scene", scene.read),
    ("optimise", optimise.read),
    ("output", output.read),
    ("budget", output.read_budget),
    ("report", report.read),
    ("objective", objective.read),
    ("accuracy", accuracy.read),
    ("design", design.read),
    ("bodies", bodies.read),
    ("loads", bodies.read_loads),
    ("locus", locus.read),
    ("limits", limits.read),
    ("reference", design.read_compared),
    ("thread", thread.read),
    ("mechanism", mechanism.read),
    # Values, and what one table asks of another.
    ("scene", scene.read_values),
    ("optimise", optimise.read_values),
    ("tolerance", tolerance.read),
    ("budget", output.read_amounts),
    ("pareto", pareto.read),
    ("pareto", pareto.check_optimised),
    ("optimise", optimise.check_objective),
    ("task", task.read),
    ("scene", scene.check_wanted),
    # What the mechanism has to do with it.
    ("mechanism", mechanism.demand),
    ("bodies", bodies.check),
    ("scene", scene.extend),
    ("locus", locus.check),
    ("limits", limits.check),
    ("optimise", optimise.check),
    ("task", task.check),
    ("objective", objective.check),
    ("optimise", optimise.check_steady),
    ("pareto", pareto.check),
    ("fit", fit.check),
    ("design", design.check),
    ("tolerance", tolerance.check),
    ("reference", design.check_compared),
    ("report", report.check),
    ("scene", scene.collect),
    ("accuracy", accuracy.check),
)
