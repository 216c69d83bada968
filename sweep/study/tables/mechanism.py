"""[mechanism], or [machine] and [relations]: what the study is about."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from sweep.errors import InputError, StudyError, closest, nearest
from sweep.families import NAMES
from sweep.families import family as find_family
from sweep.families.base import Family
from sweep.study.faults import Faults, Key
from sweep.study.machine import read_machine
from sweep.study.model import MechanismSection
from sweep.study.reading import Reading
from sweep.study.tables.thread import Threads


def read(reading: Reading) -> None:
    """Find the family, chain or machine; where it cannot be, its faults are reported."""
    data, faults = reading.data, reading.faults
    if "machine" not in data:
        if "mechanism" not in data:
            faults.missing(("mechanism",), "a table [mechanism]")
        if "relations" in data:
            faults.value(("relations",), data["relations"], "nothing here: relations are those of a [machine]")
        names = _families(reading.section(MechanismSection, "mechanism"), data, faults)
        reading.fields["mechanism"] = names
        reading.bare = _family(names, data, faults)
        return
    if "mechanism" in data:
        faults.value(("mechanism",), data["mechanism"], "either [mechanism] or [machine.NAME], not both")
    for table in ("locus", "fit"):
        if table in data:
            faults.value((table,), data[table], "nothing here: it finishes the links of a [mechanism] alone")
    found = read_machine(data, faults, reading.get(Threads).relations)
    reading.fields["mechanism"], reading.bare = ((), None) if found is None else found


def demand(reading: Reading) -> None:
    """Raise an error where there is no mechanism: nothing else can be checked."""
    if reading.bare is None:
        raise StudyError(str(reading.path), reading.faults.lines)


def _families(section: MechanismSection, data: Mapping[str, Any], faults: Faults) -> tuple[str, ...]:
    raw = data.get("mechanism")
    if isinstance(raw, dict) and "family" in raw and "chain" in raw:
        faults.value(("mechanism", "chain"), raw["chain"], "either family or chain, not both")
    if isinstance(raw, dict) and "family" not in raw and "chain" not in raw:
        faults.missing(("mechanism", "family"), f"one of {', '.join(NAMES)}; or chain, a list of them", instead="chain")
    if section.family is not None:
        return (section.family,)
    return tuple(section.chain or ())


def _family(names: tuple[str, ...], data: Mapping[str, Any], faults: Faults) -> Family | None:
    """Return the mechanism, or None with a fault for each unknown name, or for a chain that cannot be.

    A misspelt family is a fault, but the rest is checked against the nearest one, so that no second round is needed.
    """
    single = "family" in data.get("mechanism", {}) if names else False
    unknown = [k for k, name in enumerate(names) if name not in NAMES]
    for k in unknown:
        key: Key = ("mechanism", "family") if single else ("mechanism", "chain", k)
        faults.value(key, names[k], f"one of {', '.join(NAMES)}{nearest(names[k], NAMES)}")
    guessed = tuple(closest(name, NAMES) if name not in NAMES else name for name in names)
    if not guessed or None in guessed:
        return None
    try:
        return find_family([name for name in guessed if name is not None])
    except InputError as error:
        faults.value(("mechanism", "chain"), list(names), error.allowed)
        return None
