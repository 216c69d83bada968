"""Faults of a study file: all are collected, each with file, key, value and what is allowed there."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from types import MappingProxyType
from typing import TYPE_CHECKING, Any, TypeVar

from sweep.errors import closest, nearest

if TYPE_CHECKING:
    from sweep.study.model import Section

Key = tuple[str | int, ...]
S = TypeVar("S", bound="Section")

_LONGEST_VALUE = 60


class Faults:
    """The list of faults, and the files in which keys are looked up, the last one first.

    A key that is missing because it is misspelt is one fault, so unknown keys are reported before missing ones.
    ``places`` are the lines of keys by file (:func:`sweep.study.lines.key_lines`); a missing key has that of its table.
    """

    def __init__(
        self, files: Mapping[str, Mapping[str, Any]], places: Mapping[str, Mapping[str, int]] = MappingProxyType({})
    ) -> None:
        self.lines: list[str] = []
        self._files, self._places = files, places
        self._misspelt: set[Key] = set()

    def value(self, key: Key, value: object, allowed: str) -> None:
        """Report a value that may not stand there."""
        shown = str(value).lower() if isinstance(value, bool) else repr(value)
        shown = shown if len(shown) <= _LONGEST_VALUE else shown[: _LONGEST_VALUE - 3] + "..."
        self._add(key, f"{spelled(key)} = {shown}; allowed: {allowed}")

    def missing(self, key: Key, needed: str, instead: str = "") -> None:
        """Report a key that must be there, or another one instead."""
        if not self.misspelt(key) and not self.misspelt((*key[:-1], instead)):
            self._add(key, f"{spelled(key)} is missing; needed: {needed}")

    def misspelt(self, key: Key) -> bool:
        """Return whether a key that is missing stands there with a spelling mistake, which was reported."""
        return key in self._misspelt

    def unknown(self, key: Key, known: Iterable[str], what: str = "key") -> None:
        """Report a key that nobody reads, with the nearest right one."""
        names = list(known)
        guess = closest(str(key[-1]), names)
        if guess is not None:
            self._misspelt.add((*key[:-1], guess))
        self.unknown_name(key, what, f"{', '.join(names)}{nearest(str(key[-1]), names)}")

    def unknown_name(self, key: Key, what: str, allowed: str) -> None:
        """Report a key that should be the name of something."""
        self._add(key, f"{spelled(key)}: unknown {what}; allowed: {allowed}")

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


def spelled(key: Key) -> str:
    """Return a key path as one writes it: scene.want[2]."""
    text = "".join(f"[{part}]" if isinstance(part, int) else f".{part}" for part in key)
    return text.removeprefix(".")


def read_section(model: type[S], raw: object, key: Key, faults: Faults) -> S:
    """Return the table as the model reads it; faulty keys are reported and left at their defaults."""
    if not isinstance(raw, dict):
        faults.value(key, raw, f"a table with the keys {', '.join(_names(model))}")
        return model()
    section = _validated(model, raw, key, faults)
    for name in model.required:
        if name not in raw:
            faults.missing((*key, name), _described(model, (name,)))
    return section


def _validated(model: type[S], raw: Mapping[str, Any], key: Key, faults: Faults) -> S:
    from pydantic import ValidationError

    try:
        return model.model_validate(raw)
    except ValidationError as error:
        bad: set[str | int] = set()
        for item in error.errors(include_url=False):
            place = item["loc"]
            bad.add(place[0])
            if item["type"] == "extra_forbidden":
                faults.unknown((*key, *place), _names(_model_at(model, place[:-1])))
            else:
                faults.value((*key, *place), item["input"], _described(model, place))
        return model.model_validate({name: value for name, value in raw.items() if name not in bad})


def _names(model: type[Section]) -> list[str]:
    return [field.alias or name for name, field in model.model_fields.items()]


def _field(model: type[Section], name: str | int) -> Any:
    return next((f for attribute, f in model.model_fields.items() if (f.alias or attribute) == name), None)


def _described(model: type[Section], place: Key) -> str:
    """Return the description of the innermost named key at this place."""
    named = [k for k, part in enumerate(place) if isinstance(part, str)]
    inner = _model_at(model, place[: named[-1]])
    return str(_field(inner, place[named[-1]]).description)


def _model_at(model: type[Section], place: Key) -> type[Section]:
    """Return the model of the table at this place: the one named in the annotation of each key on the way."""
    for part in place:
        if isinstance(part, str):
            model = _table_in(_field(model, part).annotation)
    return model


def _table_in(annotation: Any) -> type[Section]:
    from typing import get_args

    from sweep.study.model import Section

    stack = [annotation]
    while stack:
        candidate = stack.pop()
        if isinstance(candidate, type) and issubclass(candidate, Section):
            return candidate
        stack += get_args(candidate)
    raise TypeError(f"{annotation!r} holds no table")


def _holds(table: Any, key: Key) -> bool:
    for part in key:
        try:
            table = table[part]
        except (KeyError, IndexError, TypeError):
            return False
    return True
