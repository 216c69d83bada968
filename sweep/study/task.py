"""[task]: one of the tasks of the engineering method as a file says it, every quantity in its unit."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import MISSING, fields
from pathlib import Path
from typing import Any

from sweep.effects import extended
from sweep.errors import InputError, StudyError, choices
from sweep.families import family
from sweep.quantities import units
from sweep.study.file import Faults, Key, StudyFile
from sweep.study.toml import key_lines, read_toml, toml_text
from sweep.synthesis import tasks
from sweep.synthesis.tasks.driven import SlotPosition
from sweep.synthesis.tasks.positions import Position
from sweep.synthesis.tasks.problem import SynthesisTask
from sweep.synthesis.tasks.task3 import Setting

KINDS: Mapping[str, Any] = {"engineering": tasks.EngineeringMethod} | {
    f"task{number}": getattr(tasks, f"Task{number}") for number in range(1, 9)
}
# What the mechanisms that do a task are; the second stage of task 5 is no family.
CHAINS: Mapping[str, tuple[str, ...]] = {
    "engineering": ("rssr",), "task1": ("rssr",), "task2": ("rssr",), "task3": ("rssr",), "task4": ("rssr",),
    "task6": ("rssr", "guide"), "task7": ("rssr", "rssp"), "task8": ("rssr", "rssp"),
}  # fmt: skip
RECORDS: Mapping[str, Any] = {"task1": Position, "task2": Position, "task3": Setting, "task5": SlotPosition}

# What the numbers of the tasks are, by name; all others are lengths. A range is called as what it is a range of.
ANGLES = ("swing", "phi0", "alpha", "alpha2", "max_pressure_angle", "dwell", "dphi", "dpsi", "start_direction",
          "end_direction")  # fmt: skip
RATIOS = ("ratio", "coupler", "offset", "f2_ratio", "size")
WORDS = ("objective", "adjusted", "limit", "kappa", "branch", "second")


def load_task(path: str | Path) -> SynthesisTask:
    """Read the problem of a file's [task] table.

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
    faults = Faults({file.name: data}, {file.name: key_lines(toml_text(file))})
    if not {"mechanism", "machine"} & set(data):  # a study checks its other tables itself
        for name in data:
            if name not in ("task", "study"):
                faults.unknown((name,), ("task", "study"))
    problem = read_task(data.get("task"), faults)
    if problem is None or faults.lines:
        raise StudyError(str(file), faults.lines)
    return problem


def read_task(raw: object, faults: Faults) -> SynthesisTask | None:
    """Read the problem of a table [task], or None with its faults."""
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
    known = {f.name: f for f in fields(KINDS[kind]) if f.init}
    for name in raw:
        if name not in known and name != "kind":
            faults.unknown(("task", name), known)
    given = {name: _entry(kind, name, raw[name], ("task", name), faults) for name in known if name in raw}
    for name, field in known.items():
        if name not in raw and field.default is MISSING and field.default_factory is MISSING:
            faults.missing(("task", name), _needed(name))
    if len(faults.lines) > before:
        return None
    try:
        problem: SynthesisTask = KINDS[kind](**given)
    except InputError as error:
        faults.value(("task", error.name), error.value, error.allowed)
        return None
    return problem


def read_study_task(file: StudyFile, mechanism: object) -> SynthesisTask | None:
    """Read the task of a study, which asks for the search that begins at the task's mechanisms.

    It is a fault if these are not those of the study, unless its ``mechanism`` is unknown, None.
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


def _needed(name: str) -> str:
    if name in ("positions", "settings"):
        return "a list of tables"
    if name == "drive":
        return "a table with the parameters of rssr"
    if name in WORDS:
        return "a word, see docs/tasks.md"
    unit = _unit(name)
    form = f'{{ from = ..., to = ..., unit = "{unit}" }}: ' if name.endswith("_range") else ""
    return form + units.example(unit)


def _unit(name: str) -> str:
    base = name.removesuffix("_range")
    if base in ANGLES:
        return "rad"
    return "1" if base in RATIOS else "mm"


def _entry(kind: str, name: str, raw: object, key: Key, faults: Faults) -> Any:
    if name in WORDS:
        return raw
    if name in ("positions", "settings"):
        return _records(RECORDS[kind], raw, key, faults)
    if name == "drive":
        unit_of = {p.name: units.internal_unit(p.unit) for p in family("rssr").parameters}
        table = _table(raw, key, unit_of, faults)
        return {k: _number(v, unit_of[k], (*key, k), faults) for k, v in table.items()}
    if name == "bearings":
        known = extended(family("rssr"), ["min_theta1_reserve", "min_theta1_reserve_rolling"]).parameters
        unit_of = {p.name: units.internal_unit(p.unit) for p in known}
        return {k: _number(v, unit_of[k], (*key, k), faults) for k, v in _table(raw, key, unit_of, faults).items()}
    if name == "bounds":
        if not isinstance(raw, dict):
            faults.value(key, raw, 'a table of { from = ..., to = ..., unit = "mm" }')
            return {}
        return {k: _range(v, "mm", (*key, k), faults) for k, v in raw.items()}
    if name.endswith("_range"):
        return _range(raw, _unit(name), key, faults)
    if name in ("start", "end"):
        if not isinstance(raw, list) or len(raw) != 2:
            faults.value(key, raw, 'two lengths, as ["0 mm", "12 mm"]')
            return (0.0, 0.0)
        return tuple(_number(x, "mm", (*key, k), faults) for k, x in enumerate(raw))
    return _number(raw, _unit(name), key, faults)


def _records(record: Any, raw: object, key: Key, faults: Faults) -> tuple[Any, ...]:
    if not isinstance(raw, list):
        faults.value(key, raw, f"a list of tables with {', '.join(record._fields)}")
        return ()
    found = []
    for k, one in enumerate(raw):
        place = (*key, k)
        table = _table(one, place, record._fields, faults)
        values = {n: _number(x, _unit(n), (*place, n), faults) for n, x in table.items()}
        if record is Setting:
            values.setdefault("swing", None)
        for name in record._fields:
            if name not in values and name not in record._field_defaults:
                faults.missing((*place, name), units.example(_unit(name)))
                values[name] = 0.0
        found.append(record(**values))
    return tuple(found)


def _table(raw: object, key: Key, known: Any, faults: Faults) -> dict[str, Any]:
    if not isinstance(raw, dict):
        faults.value(key, raw, f"a table with {', '.join(known)}")
        return {}
    for name in raw:
        if name not in known:
            faults.unknown((*key, name), known)
    return {name: value for name, value in raw.items() if name in known}


def _range(raw: object, internal: str, key: Key, faults: Faults) -> tuple[float, float]:
    table = _table(raw, key, ("from", "to", "unit"), faults)
    if set(table) - {"unit"} != {"from", "to"} or not all(_plain(table[end]) for end in ("from", "to")):
        faults.value(key, raw, f'{{ from = ..., to = ..., unit = "{internal}" }} with two numbers')
        return (0.0, 0.0)
    factor = faults.factor(str(table.get("unit", "1")), internal, (*key, "unit"))
    if factor is None:
        return (0.0, 0.0)
    return float(table["from"]) * factor, float(table["to"]) * factor


def _number(raw: object, internal: str, key: Key, faults: Faults) -> Any:
    if isinstance(raw, str):
        return faults.number(raw, internal, key) or 0.0
    if not _plain(raw) or internal != "1":
        faults.value(key, raw, units.example(internal))
        return 0.0
    return float(raw)  # type: ignore[arg-type]


def _plain(raw: object) -> bool:
    """Tell whether it is a number that a float holds with room to spare; nan is none."""
    return isinstance(raw, int | float) and not isinstance(raw, bool) and -1e100 <= raw <= 1e100
