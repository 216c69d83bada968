"""[bodies] and [loads]: what the effects of a scene ask for besides the mechanism, and loads over the turn."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

from sweep.effects import curved_inputs, input_names
from sweep.effects.base import LOADS
from sweep.errors import closest
from sweep.families.base import Family
from sweep.families.members import Machine
from sweep.numerics.curves import Curve
from sweep.quantities.names import at_stage
from sweep.study.faults import Key
from sweep.study.loads import is_curve, read_curve
from sweep.study.reading import Reading

OF_SCENE = ("speed", "speed_change")


@dataclass
class Besides:
    """Inputs of effects as they stand in [bodies] and [loads], by name, with the table of each; and the curves.

    ``inlined`` is [loads] with the contents of the files that it names.
    """

    raw: dict[str, Any] = field(default_factory=dict)
    tables: dict[str, str] = field(default_factory=dict)
    curves: dict[str, Curve] = field(default_factory=dict)
    inlined: dict[str, Any] = field(default_factory=dict)


def read(reading: Reading) -> None:
    """Read [bodies]."""
    reading.free_table("bodies")


def read_loads(reading: Reading) -> None:
    """Read [loads]."""
    reading.free_table("loads")


def check(reading: Reading) -> None:
    """Sort the entries of both tables; report names that are no inputs of effects, or stand in the wrong table."""
    found = reading.put(Besides())
    family = reading.mechanism
    known = input_names(family) if "bodies" in reading.raw or "loads" in reading.raw else frozenset()
    homes = {name: home(family, name) for name in known}
    for table in ("bodies", "loads"):
        for name, entry in reading.raw.get(table, {}).items():
            key: Key = (table, name)
            if homes.get(name) != table:
                _misplaced(reading, key, entry, homes)
            elif name in reading.raw.get("design", {}):
                reading.faults.value(key, entry, "either here or in [design]")
            elif table == "loads" and is_curve(entry):
                _curve(reading, found, name, entry)
            else:
                found.raw[name], found.tables[name] = entry, table
    if reading.raw.get("loads"):
        found.inlined = {**reading.raw["loads"], **found.inlined}
    reading.fields["curves"] = found.curves


def home(family: Family, name: str) -> str:
    """Return the table that an input of an effect belongs to;
    the crank's speed is given in [scene] or swept in [design].
    """
    plain = plain_name(family, name)
    return "loads" if plain in LOADS else "design" if plain in OF_SCENE else "bodies"


def plain_name(family: Family, name: str) -> str:
    """Return the name of an effect's input without member and stage."""
    if isinstance(family, Machine):
        member, own = family.split(name) or (None, name)
        return plain_name(member.family, own) if member is not None else name
    stages = [str(stage.number) for stage in getattr(family, "stages", ())]
    return next((plain for number in stages if (plain := at_stage(name, number))), name)


def _misplaced(reading: Reading, key: Key, entry: object, homes: dict[str, str]) -> None:
    table, name = str(key[0]), str(key[1])
    if name in reading.mechanism.parameter_names:
        reading.faults.value(key, entry, "nothing here: it is a parameter of the mechanism and stands in [design]")
    elif name in homes:
        place = {"design": "[scene] or [design]"}.get(homes[name], f"[{homes[name]}]")
        reading.faults.value(key, entry, f"nothing here: it stands in {place}")
    else:
        names = sorted(name for name, place in homes.items() if place == table)
        guess = closest(name, names)  # all of a chain's are hundreds
        names = names if guess is None else [guess]
        reading.faults.unknown(key, names, f"input of the effects of {reading.mechanism.name}")


def _curve(reading: Reading, found: Besides, name: str, entry: dict[str, Any]) -> None:
    if name not in curved_inputs(reading.mechanism):
        reading.faults.value(("loads", name), entry, "one value: it does not change over the turn")
        return
    internal = "N*mm" if "torque" in name.rpartition(".")[2] else "N"
    made = read_curve(entry, internal, reading.path.parent, ("loads", name), reading.faults)
    if made is not None:
        found.curves[name], found.inlined[name] = made
