"""[scene], [bodies] and [loads]: speed, wanted outputs, window, inputs of effects, and loads over the turn.

A load over the turn is a file of two columns, the same two columns in the study, or a Fourier series.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Annotated, Any

import numpy as np
from pydantic import Field

from sweep.effects import all_inputs, curved_inputs, extended, input_names
from sweep.effects.base import STUDY_LOADS
from sweep.effects.wanted import expanded, names_of_effects
from sweep.errors import InputError, choices, closest, reason
from sweep.evaluation.loads import UNITS, rod
from sweep.families.base import Family
from sweep.families.machines.machine import Machine
from sweep.families.names import at_stage, parts
from sweep.numerics.curves import Curve, SeriesCurve, table_curve
from sweep.quantities import units
from sweep.study.file import Faults, Fraction, Key, Number, Section, Speed, StudyFile, TwoTexts, holds, read_section
from sweep.study.limits import read_output_name
from sweep.study.parameter import read_entry

OF_SCENE = ("speed", "speed_change")
MOST_POINTS = 100_000
FORMS = (
    '{ phi = [0, 90, 180], values = [0, -3, 0], unit = "N" }',
    '{ file = "load.csv", unit = "N" }',
    '{ mean = 1.0, cos = [0.5], sin = [0.2], unit = "N" }',
)
# How inputs of effects begin, by the word of a textbook.
SYMBOLS = {
    "moment_of_inertia": "j",
    "inertia": "j",
    "mass": "m",
    "friction": "mu",
    "centre_of_mass": "com",
    "cog": "com",
}
ROD = '{ material = "steel", section = "6 mm round", inertia = "exact" }'
Numbers = Annotated[list[Number], Field(max_length=MOST_POINTS)]


class CurveSection(Section):
    """Table ``loads.<name>`` of a load that varies over the turn."""

    file: str | None = holds('the name of a CSV or Parquet file beside the study, as "load.csv"')
    columns: TwoTexts | None = holds('two names of columns, as ["angle", "force"]; the first two if left out')
    phi: Numbers | None = holds("a list of rising crank angles within one turn, in the unit of angle")
    angle: str = holds('the unit of the angles, as "deg"', "deg")
    values: Numbers | None = holds("a list of numbers in the unit of unit, one for each angle")
    mean: Number | None = holds("a finite number")
    cos: Numbers | None = holds("a list of numbers: the factors of cos(phi), cos(2 phi) ...")
    sin: Numbers | None = holds("a list of numbers: the factors of sin(phi), sin(2 phi) ...")
    unit: str | None = holds('a unit as a text, as "N"')


TABLE, SERIES = ("phi", "values"), ("mean", "cos", "sin")


@dataclass
class Inputs:
    """Entries of [bodies] and [loads] by name, the table of each, and the curves of loads over the turn.

    ``inlined`` is [loads] with the contents of the files that it names.
    """

    raw: dict[str, Any] = field(default_factory=dict)
    tables: dict[str, str] = field(default_factory=dict)
    curves: dict[str, Curve] = field(default_factory=dict)
    inlined: dict[str, Any] = field(default_factory=dict)


def read_inputs(file: StudyFile, bare: Family) -> Inputs:
    """Read [bodies] and [loads]; report names that are no inputs of effects or stand in the wrong table."""
    inputs = Inputs()
    given = {table: entries for table in ("bodies", "loads") if (entries := file.free_table(table)) is not None}
    tables = {name: table_of(bare, name) for name in (input_names(bare) if given else ())}
    design = file.free_table("design") or {}
    for table, entries in given.items():
        for name, entry in _with_rods(entries, file.faults).items() if table == "bodies" else entries.items():
            key: Key = (table, name)
            if tables.get(name) != table:
                owners = {x: owner for x, owner in tables.items() if x == name or x not in entries}
                _misplaced(bare, key, entry, owners, file.faults)
            elif name in design:
                file.faults.value(key, entry, "either here or in [design]")
            elif table == "loads" and is_curve(entry):
                _read_load(file, bare, inputs, name, entry)
            else:
                inputs.raw[name], inputs.tables[name] = entry, table
    if given.get("loads"):
        inputs.inlined = {**given["loads"], **inputs.inlined}
    return inputs


def _with_rods(entries: Mapping[str, Any], faults: Faults) -> dict[str, Any]:
    """Replace bodies of a material and a section by their columns of :func:`sweep.evaluation.loads.rod`."""
    replaced: dict[str, Any] = {}
    for name, entry in entries.items():
        if not isinstance(entry, dict) or {"material", "section"}.isdisjoint(entry):
            replaced[name] = entry
            continue
        texts = {key: str(value) for key, value in entry.items()}
        try:
            columns = rod(name, **texts)
        except (InputError, TypeError) as error:
            allowed = error.allowed if isinstance(error, InputError) else ROD
            faults.value(("bodies", name), entry, allowed)
            continue
        for column in columns.keys() & entries.keys():
            faults.value(("bodies", column), entries[column], f"nothing beside the material and section of {name}")
        replaced |= {column: f"{value!r} {unit}" for (column, value), unit in zip(columns.items(), UNITS, strict=True)}
    return replaced


def tables_of_inputs(file: StudyFile, bare: Family, family: Family, inputs: Inputs) -> dict[str, str]:
    """Return the table of every input of the effects; a missing input has the table it belongs to."""
    design = file.free_table("design") or {}
    added = [name for name in family.parameter_names if name not in bare.parameter_names and name not in design]
    return {name: inputs.tables.get(name, table_of(bare, name)) for name in added}


def check_unused(file: StudyFile, bare: Family, family: Family, inputs: Inputs) -> None:
    """Report faults of inputs that no wanted effect takes yet."""
    design = file.free_table("design") or {}
    for name, entry in inputs.raw.items():
        if name not in family.parameter_names:
            key: Key = (inputs.tables[name], name)
            read_entry(all_inputs(bare)[name], entry, key, file.faults, sampled="sample" in design)


def table_of(family: Family, name: str) -> str:
    """Return the table that an input of an effect belongs to.

    The speed of the crank is given in [scene] or swept in [design].
    """
    plain = plain_name(family, name)
    return "loads" if plain in STUDY_LOADS else "design" if plain in OF_SCENE else "bodies"


def plain_name(family: Family, name: str) -> str:
    """Remove member and stage from the name of an effect's input."""
    if isinstance(family, Machine):
        member, name_in_member = family.split(name) or (None, name)
        return plain_name(member.family, name_in_member) if member is not None else name
    return next((plain for stage in family.stages if (plain := at_stage(name, stage.tail))), name)


def _misplaced(bare: Family, key: Key, entry: object, owners: dict[str, str], faults: Faults) -> None:
    table, name = str(key[0]), str(key[1])
    if name in bare.parameter_names:
        faults.value(key, entry, "nothing here: it is a parameter of the mechanism and stands in [design]")
    elif name in owners:
        owner = {"design": "[scene] or [design]"}.get(owners[name], f"[{owners[name]}]")
        faults.value(key, entry, f"nothing here: it stands in {owner}")
    else:
        # The inputs of a chain are hundreds: those that begin alike, such as the masses, are meant first.
        known = sorted(name for name, owner in owners.items() if owner == table)
        word = next((word for word in SYMBOLS if name.startswith(f"{word}_")), None)
        meant = SYMBOLS[word] + name.removeprefix(word) if word else name
        alike = [other for other in known if other.startswith(meant.rstrip("0123456789"))] if word else []
        alike = alike or [other for other in known if other.partition("_")[0] == name.partition("_")[0]]
        guess = closest(name, alike) or (None if word and alike else closest(name, known))
        names = alike if guess is None or guess in alike else [*alike, guess]
        faults.unknown(key, names or known, f"input of the effects of {bare.name}")


def _read_load(file: StudyFile, bare: Family, inputs: Inputs, name: str, entry: dict[str, Any]) -> None:
    if name not in curved_inputs(bare):
        file.faults.value(("loads", name), entry, "one value: it does not change over the turn")
        return
    internal = "N*mm" if "torque" in name.rpartition(".")[2] else "N"
    curve = read_curve(entry, internal, file.path.parent, ("loads", name), file.faults)
    if curve is not None:
        inputs.curves[name], inputs.inlined[name] = curve


def is_curve(entry: object) -> bool:
    """Tell whether an entry of [loads] varies over the turn: it has a key that no constant and no axis has."""
    return isinstance(entry, dict) and not {"file", "phi", *SERIES}.isdisjoint(entry)


def read_curve(
    raw: dict[str, Any], internal: str, folder: Path, key: Key, faults: Faults
) -> tuple[Curve, dict[str, Any]] | None:
    """Read the curve in internal units and its entry with the content of its file, or report its faults.

    Parameters
    ----------
    raw : the entry
    internal : internal unit of the load
    folder : where the file is looked for
    """
    before = len(faults.lines)
    section = read_section(CurveSection, raw, key, faults)
    given = [name for name in ("file", *TABLE, *SERIES) if getattr(section, name) is not None]
    kinds = {("file",) if name == "file" else TABLE if name in TABLE else SERIES for name in given}
    factor, angle = (_factor(section, name, unit, key, faults) for name, unit in (("unit", internal), ("angle", "rad")))
    if len(faults.lines) == before and len(kinds) != 1:
        faults.value(key, raw, f"one of {', '.join(FORMS)}")
    if len(faults.lines) > before:
        return None
    if kinds == {SERIES}:
        cos, sin = (tuple(factor * x for x in coefficients or ()) for coefficients in (section.cos, section.sin))
        return SeriesCurve(factor * (section.mean or 0.0), cos, sin), raw
    columns = (section.phi, section.values) if section.file is None else _file(section, folder, key, faults)
    if columns is None:
        return None
    for name, column in zip(TABLE, columns, strict=True):
        if column is None:
            faults.missing((*key, name), str(CurveSection.model_fields[name].description))
    phi, values = columns
    if phi is None or values is None:
        return None
    try:
        curve = table_curve(angle * np.array(phi, np.float64), factor * np.array(values, np.float64))
    except ValueError as error:
        faults.value((*key, "phi" if section.file is None else "file"), section.file or phi, str(error))
        return None
    inline = {"phi": list(phi), "values": list(values), "angle": section.angle, "unit": section.unit}
    return curve, raw if section.file is None else inline


def _factor(section: CurveSection, name: str, internal: str, key: Key, faults: Faults) -> float:
    unit = getattr(section, name)
    if unit is None:
        faults.missing((*key, name), units.example(internal))
        return 1.0
    return faults.factor(unit, internal, (*key, name)) or 1.0


def _file(
    section: CurveSection, folder: Path, key: Key, faults: Faults
) -> tuple[Sequence[float], Sequence[float]] | None:
    """Read the two columns of a file in the folder of the study."""
    import pandas as pd

    name = section.file or ""
    path, place = folder / name, (*key, "file")
    if Path(name).name != name or path.suffix not in (".csv", ".parquet"):
        faults.value(place, name, "the name of a file beside the study, without a folder, ending in .csv or .parquet")
        return None
    try:
        table = pd.read_csv(path) if path.suffix == ".csv" else pd.read_parquet(path)
    except (OSError, ValueError) as error:
        words = reason(error) if isinstance(error, OSError) else str(error).splitlines()[0]
        faults.value(place, name, f"a table that can be read: {words}")
        return None
    columns = [str(column) for column in table.columns]
    for k, column in enumerate(section.columns or ()):
        if column not in columns:
            faults.value((*key, "columns", k), column, f"columns of the file: {choices(column, columns)}")
            return None
    if len(columns) < 2 or len(table) > MOST_POINTS or any(map(units.unquoted, columns)):
        form = "two columns between commas, angle and load, below a line with their names"
        faults.value(place, name, f"{form}, of at most {MOST_POINTS} rows")
        return None
    pair = [table.iloc[:, columns.index(column)] for column in section.columns or columns[:2]]
    try:
        phi, values = ([float(x) for x in column] for column in pair)
    except (TypeError, ValueError):
        faults.value(place, name, "numbers in both columns")
        return None
    return phi, values


class WindowTable(Section):
    """Table ``scene.window``."""

    required = ("from", "to")
    low: Fraction | None = holds("a fraction of the stroke, 0 to 1", alias="from")
    high: Fraction | None = holds("a fraction of the stroke, 0 to 1", alias="to")


class SceneSection(Section):
    """Table [scene]."""

    speed: Speed | None = holds('a speed of rotation as a text, as "7000 rpm"')
    want: list[str] = holds("a list of names of design outputs", [])
    window: WindowTable | None = holds("{ from = 0.0, to = 0.6 }, fractions of the stroke")


def read_window(window: WindowTable | None, faults: Faults) -> tuple[float, float] | None:
    """Read the part of the stroke in which deviations count, as fractions 0 to 1; None if the file has none."""
    if window is None or window.low is None or window.high is None:
        return None
    low, high = window.low, window.high
    if not low < high:
        faults.value(("scene", "window", "to"), high, f"a fraction greater than from = {low:g}")
    return low, high


def with_effects(file: StudyFile, bare: Family, others: Iterable[str], curves: Mapping[str, Curve]) -> Family:
    """Extend the mechanism by the effects of all wanted outputs; wrong names in [scene] are reported.

    Parameters
    ----------
    bare : the mechanism
    others : names of outputs requested by other tables
    curves : the loads over the turn
    """
    wanted = file.texts("scene", "want")
    family = extended(bare, expanded(bare, [*(name for _, name in wanted), *others]), dict(curves))
    effects = names_of_effects(bare)
    for k, name in wanted:
        if name not in effects:
            read_output_name(family, name, ("scene", "want", k), file.faults)
    return family


def speeds(family: Family, speed: float | None) -> dict[str, float]:
    """Return the speed of every crank whose speed an effect takes, from scene.speed [rad/s].

    The crank of a member turns ratio times as fast, backwards if the ratio is negative.
    """
    asking = [p for p in family.parameter_names if parts(p).stem == "speed"]
    if speed is None:
        return {}
    if isinstance(family, Machine):
        ratios = {m.name: m.ratio for m in family.members}
        threads = [p.name for r in family.relations for p in r.parameters if p.unit == "speed"]
        return {p: speed * ratios[parts(p).member] for p in asking} | dict.fromkeys(threads, speed)
    return dict.fromkeys(asking, speed)
