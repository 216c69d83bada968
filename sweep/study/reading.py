"""``Reading``: a study file while its tables are read, one reader after the other."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, TypeVar

from sweep.errors import StudyError
from sweep.families.base import Family
from sweep.study import units
from sweep.study.faults import Faults, Key, S, read_section

T = TypeVar("T")


@dataclass
class Reading:
    """The content of a study file, its faults so far, and what the readers so far have found.

    ``fields`` are those of the :class:`sweep.study.Study` to be.  ``bare`` is the mechanism, None while it is not known
    or where it cannot be; ``family`` is the same with the effects of what is wanted.  ``raw`` are the tables whose keys
    are names of the mechanism, those of them that the file has.  What a reader has to tell later ones is an object of a
    type of its own: ``put`` keeps it, ``get`` finds it by its type.
    """

    data: Mapping[str, Any]
    path: Path
    faults: Faults
    fields: dict[str, Any] = field(default_factory=dict)
    raw: dict[str, dict[str, Any]] = field(default_factory=dict)
    bare: Family | None = None
    _family: Family | None = None
    _found: dict[type, object] = field(default_factory=dict)

    @property
    def mechanism(self) -> Family:
        """The mechanism without effects, for readers that come after it is known."""
        assert self.bare is not None
        return self.bare

    @property
    def family(self) -> Family:
        """The mechanism with the effects of what is wanted, for readers that come after it is known."""
        assert self._family is not None
        return self._family

    @family.setter
    def family(self, family: Family) -> None:
        self._family = family

    def put(self, found: T) -> T:
        """Keep an object for later readers."""
        self._found[type(found)] = found
        return found

    def get(self, kind: type[T]) -> T:
        """Return the object of that very type that an earlier reader has kept."""
        found = self._found[kind]
        assert isinstance(found, kind)
        return found

    def section(self, model: type[S], name: str) -> S:
        """Return the table as its model reads it, kept for later readers;
        all defaults where the file has no such table.
        """
        read = read_section(model, self.data[name], (name,), self.faults) if name in self.data else model()
        return self.put(read)

    def free_table(self, name: str) -> None:
        """Keep a table whose keys are names of the mechanism in ``raw``, as it stands in the file."""
        table = self.data.get(name)
        if isinstance(table, dict):
            self.raw[name] = table
        elif table is not None:
            self.faults.value((name,), table, f"a table [{name}]")

    def texts(self, table: str, key: str) -> list[tuple[int, str]]:
        """Return the texts of a list as it stands in the file, with their places, whatever else is wrong with it."""
        raw = self.data[table].get(key) if isinstance(self.data.get(table), dict) else None
        return [(k, name) for k, name in enumerate(raw) if isinstance(name, str)] if isinstance(raw, list) else []

    def quantity(self, text: str | None, internal: str, key: Key, *, signed: bool = False) -> float | None:
        """Return a text such as "7000 rpm" in the internal unit; positive, or just not zero if it is ``signed``."""
        if text is None:
            return None
        try:
            number, unit = units.split(text, internal)
            value = number * units.factor(unit, internal)
        except units.UnitFault as fault:
            self.faults.value(key, text, str(fault))
            return None
        if not (abs(value) > 0.0 if signed else value > 0.0):
            kind = "non-zero" if signed else "positive"
            self.faults.value(key, text, f"a {kind} number; {units.example(internal)}")
        return value

    def share(self, text: str, key: Key) -> float:
        """Return a text such as "2 %" as a share between 0 and 1, neither of them."""
        share = self.quantity(text, "1", key)
        if share is not None and not share < 1.0:
            self.faults.value(key, text, 'a share below 100 %, as "2 %"')
        return 0.5 if share is None else share

    def raise_faults(self) -> None:
        """Raise an error if there are faults.

        Raises
        ------
        StudyError
            lists all faults found so far.
        """
        if self.faults.lines:
            raise StudyError(str(self.path), self.faults.lines)
