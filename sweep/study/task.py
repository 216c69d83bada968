"""[task]: a task of the engineering method in a study file, every quantity with its unit."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import MISSING, fields
from pathlib import Path
from typing import Annotated, Any, TypeGuard

from pydantic import BeforeValidator, Field, conlist, create_model
from pydantic_core import PydanticCustomError

from sweep.effects import extended
from sweep.errors import InputError, StudyError, choices
from sweep.families import family
from sweep.families.base import Parameter
from sweep.quantities import units
from sweep.study.file import QUANTITY, Faults, Number, Section, StudyFile, TwoLengths, quantity, read_section
from sweep.study.toml import key_lines, read_toml, toml_text
from sweep.synthesis import tasks
from sweep.synthesis.tasks.driven import SlotPosition
from sweep.synthesis.tasks.positions import Position
from sweep.synthesis.tasks.problem import SynthesisTask
from sweep.synthesis.tasks.task3 import Setting

KINDS: Mapping[str, Any] = {"engineering": tasks.EngineeringMethod} | {
    f"task{number}": getattr(tasks, f"Task{number}") for number in range(1, 9)
}
# Mechanisms that solve each task; the second stage of task 5 is no family.
CHAINS: Mapping[str, tuple[str, ...]] = {
    "engineering": ("rssr",), "task1": ("rssr",), "task2": ("rssr",), "task3": ("rssr",), "task4": ("rssr",),
    "task6": ("rssr", "guide"), "task7": ("rssr", "rssp"), "task8": ("rssr", "rssp"),
}  # fmt: skip
RECORDS: Mapping[str, Any] = {"task1": Position, "task2": Position, "task3": Setting, "task5": SlotPosition}

# Kinds of the numbers of tasks, by name; all others are lengths.  A range has the name of its quantity.
ANGLES = ("swing", "phi0", "alpha", "alpha2", "max_pressure_angle", "dwell", "dphi", "dpsi", "start_direction",
          "end_direction")  # fmt: skip
RATIOS = ("ratio", "coupler", "offset", "f2_ratio", "size")
WORDS = ("objective", "adjusted", "limit", "kappa", "branch", "second")
BEARINGS = ("min_theta1_reserve", "min_theta1_reserve_rolling")


def _range(internal: str, of: str = "") -> BeforeValidator:
    """Return a validator that converts a range with its unit to its ends; ``of`` says in a message what is a range."""

    def read(value: object) -> tuple[float, float]:
        table = value if isinstance(value, dict) else {}
        low, high = table.get("from"), table.get("to")
        if not {*table} <= {"from", "to", "unit"} or not _is_number(low) or not _is_number(high):
            raise ValueError("no range")
        try:
            factor = units.factor(str(table.get("unit", "1")), internal)
        except units.UnitFault as fault:
            raise PydanticCustomError(QUANTITY, "{words}", {"words": f"{of}{fault}"}) from None
        return float(low) * factor, float(high) * factor

    return BeforeValidator(read)


def _is_number(raw: object) -> TypeGuard[float]:
    """Tell whether a value is a finite number of at most 1e100; nan is none."""
    return isinstance(raw, int | float) and not isinstance(raw, bool) and -1e100 <= raw <= 1e100


LengthBounds = dict[str, Annotated[tuple[float, float], _range("mm", "bounds are those of lengths of the result: ")]]


def load_task(path: str | Path) -> SynthesisTask:
    """Read the problem in the [task] table of a file.

    Parameters
    ----------
    path : a TOML file, a study file perhaps, or the folder of a study; ``kind`` is "engineering" or "task1" to "task8",
        the other keys are those of the task's class in docs/tasks.md: numbers as texts with their units, ranges as
        ``{ from = ..., to = ..., unit = "..." }``

    Raises
    ------
    StudyError
        lists every fault with file, line, key, value and what is allowed.
    """
    file = Path(path)
    file = file / "study.toml" if file.is_dir() else file
    data = read_toml(file)
    faults = Faults({str(file): data}, {str(file): key_lines(toml_text(file))})
    if not {"mechanism", "machine"} & set(data):  # the other tables of a study are checked by the study
        for name in data:
            if name not in ("task", "study"):
                faults.unknown((name,), ("task", "study"))
    problem = read_task(data.get("task"), faults)
    if problem is None or faults.lines:
        raise StudyError(str(file), faults.lines)
    return problem


def read_task(raw: object, faults: Faults) -> SynthesisTask | None:
    """Read the problem of a table [task], or return None with its faults."""
    before = len(faults.lines)
    if not isinstance(raw, dict):
        needed = "a table [task] with kind and what is given"
        if raw is None:
            faults.missing(("task",), needed)
        else:
            faults.value(("task",), raw, needed)
        return None
    kind = raw.get("kind")
    if not isinstance(kind, str) or kind not in KINDS:
        faults.value(("task", "kind"), kind, choices(str(kind), KINDS))
        return None
    given = read_section(task_model(kind), raw, ("task",), faults).model_dump(exclude_unset=True, exclude={"kind"})
    if len(faults.lines) > before:
        return None
    for name, value in given.items():
        if name in ("positions", "settings"):
            given[name] = tuple(RECORDS[kind](**{"swing": None} | row if kind == "task3" else row) for row in value)
        elif isinstance(value, list):
            given[name] = tuple(value)
    try:
        problem: SynthesisTask = KINDS[kind](**given)
    except InputError as error:
        faults.value(("task", error.name), error.value, error.allowed)
        return None
    return problem


def read_study_task(file: StudyFile, mechanism: object) -> SynthesisTask | None:
    """Read the task of a study, whose mechanisms are the starts of the study's search.

    A task of other mechanisms than the study's is a fault, unless the study's ``mechanism`` is unknown, None.
    """
    task = read_task(file.data["task"], file.faults)
    if "optimise" not in file:
        needed = "a table [optimise]: the mechanisms that do a [task] are where its search begins"
        file.faults.missing(("optimise",), needed)
    if task is None or mechanism is None:
        return task
    kind = file.data["task"]["kind"]
    chain = ("rssr", task.second) if isinstance(task, tasks.Task6) else CHAINS.get(kind)
    if chain is None:
        file.faults.value(("task", "kind"), kind, f"{', '.join(CHAINS)}; {kind} is answered by `sweep task` alone")
    elif mechanism != chain:
        wanted = f'family = "{chain[0]}"' if len(chain) == 1 else f"chain = {list(chain)}"
        allowed = f"in this study a task of its mechanism; {kind} is about {wanted}"
        file.faults.value(("task", "kind"), kind, allowed)
    return task


def task_model(kind: str) -> type[Section]:
    """Return the model of [task] for one kind of task, with a key for each field of the task's class."""
    keys = [f for f in fields(KINDS[kind]) if f.init]
    needed = [f.name for f in keys if f.default is MISSING and f.default_factory is MISSING]
    return _table(kind, {"kind": (Any, "")} | {f.name: _key(kind, f.name) for f in keys}, needed)


def _table(name: str, keys: Mapping[str, tuple[Any, str]], required: Iterable[str] = ()) -> type[Section]:
    """Return the model of a table with the given keys, each with its type and the description of its values."""
    hints: dict[str, Any] = {key: (kind | None, Field(None, description=words)) for key, (kind, words) in keys.items()}
    model = create_model(name, __base__=Section, **hints)
    model.required = tuple(required)
    return model


def _key(kind: str, name: str) -> tuple[Any, str]:
    """Return the type of a key of a task and the description of its values."""
    unit = _unit(name)
    if name in WORDS:
        return Any, "a word, see docs/tasks.md"
    if name in ("positions", "settings"):
        record = RECORDS[kind]
        needed = () if record is Setting else record._fields
        return conlist(_table(name, {x: _number(_unit(x)) for x in record._fields}, needed)), "a list of tables"
    if name == "drive":
        return _inputs(name, family("rssr").parameters), "a table with the parameters of rssr"
    if name == "bearings":
        return _inputs(name, extended(family("rssr"), BEARINGS).parameters), "a table with inputs of the bearings"
    if name == "bounds":
        return LengthBounds, 'a table of { from = ..., to = ..., unit = "mm" }'
    if name.endswith("_range"):
        words = f'{{ from = ..., to = ..., unit = "{unit}" }}: {units.example(unit)}'
        return Annotated[tuple[float, float], _range(unit)], words
    if name in ("start", "end"):
        return TwoLengths, 'two lengths, as ["0 mm", "12 mm"]'
    return _number(unit)


def _unit(name: str) -> str:
    base = name.removesuffix("_range")
    return "rad" if base in ANGLES else "1" if base in RATIOS else "mm"


def _number(unit: str) -> tuple[Any, str]:
    return Number if unit == "1" else Annotated[float, quantity(unit)], units.example(unit)


def _inputs(name: str, parameters: Iterable[Parameter]) -> type[Section]:
    return _table(name, {p.name: _number(units.internal_unit(p.unit)) for p in parameters})
