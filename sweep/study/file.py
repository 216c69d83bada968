"""A study file while it is read: its tables, and all its faults with file, line, key, value and what is allowed."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path
from types import MappingProxyType
from typing import Any, TypeAlias

from sweep.errors import StudyError, choices, closest, shown
from sweep.quantities import units

Key: TypeAlias = tuple[str | int, ...]

_LONGEST_VALUE = 60


class Faults:
    """The list of faults, and the files in which keys are looked up, the last one first.

    A key that is missing because it is misspelt is one fault, so unknown keys are reported before missing ones.
    ``places`` are the lines of keys by file (:func:`sweep.study.toml.key_lines`); a missing key has that of its table.
    """

    def __init__(
        self, files: Mapping[str, Mapping[str, Any]], places: Mapping[str, Mapping[str, int]] = MappingProxyType({})
    ) -> None:
        self.lines: list[str] = []
        self._files, self._places = files, places
        self._misspelt: set[Key] = set()

    def value(self, key: Key, value: object, allowed: str) -> None:
        """Report a value that may not stand there."""
        written = str(value).lower() if isinstance(value, bool) else shown(value)
        written = written if len(written) <= _LONGEST_VALUE else written[: _LONGEST_VALUE - 3] + "..."
        self._add(key, f"{spelled(key)} = {written}; allowed: {allowed}")

    def missing(self, key: Key, needed: str, instead: str = "") -> None:
        """Report a key that must be there, or another one instead."""
        if not self.misspelt(key) and not self.misspelt((*key[:-1], instead)):
            self._add(key, f"{spelled(key)} is missing; needed: {needed}")

    def misspelt(self, key: Key) -> bool:
        """Tell whether a key that is missing stands there with a spelling mistake, which was reported."""
        return key in self._misspelt

    def unknown(self, key: Key, known: Iterable[str], what: str = "key") -> None:
        """Report a key that nobody reads, with the nearest right one."""
        names = list(known)
        guess = closest(str(key[-1]), names)
        if guess is not None:
            self._misspelt.add((*key[:-1], guess))
        self.unknown_name(key, what, choices(str(key[-1]), names))

    def unknown_name(self, key: Key, what: str, allowed: str) -> None:
        """Report a key that should be the name of something."""
        self._add(key, f"{spelled(key)}: unknown {what}; allowed: {allowed}")

    def number(self, text: str, internal: str, key: Key) -> float | None:
        """Read a text such as "7000 rpm" in the internal unit; None with a fault for what is no such quantity."""
        try:
            number, unit = units.split(text, internal)
            return number * units.factor(unit, internal)
        except units.UnitFault as fault:
            self.value(key, text, str(fault))
            return None

    def factor(self, unit: str, internal: str, key: Key) -> float | None:
        """Find the multiplier from a written unit to the internal one; None with a fault for a unit of another kind."""
        try:
            return units.factor(unit, internal)
        except units.UnitFault as fault:
            self.value(key, unit, str(fault))
            return None

    def _add(self, key: Key, text: str) -> None:
        file = self._file_of(key)
        places = self._places.get(file, {})
        known = (places.get(spelled(key[:depth])) for depth in range(len(key), 0, -1))
        number = next((number for number in known if number is not None), None)
        line = f"{file}: {text}" if number is None else f"{file}:{number}: {text}"
        if line not in self.lines:
            self.lines.append(line)

    def _file_of(self, key: Key) -> str:
        names = list(self._files)
        for depth in range(len(key), 0, -1):
            for name in reversed(names) if depth == len(key) else names:
                if _holds(self._files[name], key[:depth]):
                    return name
        return names[0]


@dataclass(frozen=True)
class StudyFile:
    """The content of a study file, where it lies, and its faults so far."""

    data: Mapping[str, Any]
    path: Path
    faults: Faults

    def __contains__(self, table: str) -> bool:
        """Tell whether the file has a table."""
        return table in self.data

    def free_table(self, name: str) -> dict[str, Any] | None:
        """Return a table whose keys are names of the mechanism, as it stands in the file; None where there is none."""
        table = self.data.get(name)
        if table is not None and not isinstance(table, dict):
            self.faults.value((name,), table, f"a table [{name}]")
        return table if isinstance(table, dict) else None

    def texts(self, table: str, key: str) -> list[tuple[int, str]]:
        """Return the texts of a list as it stands in the file, with their places, whatever else is wrong with it."""
        raw = self.data[table].get(key) if isinstance(self.data.get(table), dict) else None
        return [(k, name) for k, name in enumerate(raw) if isinstance(name, str)] if isinstance(raw, list) else []

    def quantity(self, text: str | None, internal: str, key: Key, *, signed: bool = False) -> float | None:
        """Read a text such as "7000 rpm" in the internal unit; positive, or just not zero if it is ``signed``."""
        value = None if text is None else self.faults.number(text, internal, key)
        if value is not None and not (abs(value) > 0.0 if signed else value > 0.0):
            kind = "non-zero" if signed else "positive"
            self.faults.value(key, text, f"a {kind} number; {units.example(internal)}")
        return value

    def share(self, text: str, key: Key) -> float:
        """Read a text such as "2 %" as a share between 0 and 1, neither of them."""
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


def spelled(key: Key) -> str:
    """Write a key path as people do: scene.want[2]."""
    text = "".join(f"[{part}]" if isinstance(part, int) else f".{part}" for part in key)
    return text.removeprefix(".")


def _holds(table: Any, key: Key) -> bool:
    for part in key:
        try:
            table = table[part]
        except (KeyError, IndexError, TypeError):
            return False
    return True
