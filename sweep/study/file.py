"""Reading of a study file: tables as pydantic models, and faults with file, line, key, value and rule."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path
from types import MappingProxyType
from typing import Annotated, Any, ClassVar, TypeAlias, TypeVar, get_args

from pydantic import (
    BaseModel,
    BeforeValidator,
    ConfigDict,
    Discriminator,
    Field,
    Tag,
    ValidationError,
    WithJsonSchema,
)  # fmt: skip
from pydantic_core import PydanticCustomError

from sweep.errors import StudyError, choices, closest, shown
from sweep.quantities import units

Key: TypeAlias = tuple[str | int, ...]

_LONGEST_VALUE = 60


class Faults:
    """Faults found so far, and the files in which their keys are looked up, the last file first.

    A key that is missing because it is misspelt is one fault, so unknown keys are reported before missing ones.
    ``places`` are the lines of keys by file (:func:`sweep.study.toml.key_lines`); a missing key has the line of its
    table.
    """

    def __init__(
        self, files: Mapping[str, Mapping[str, Any]], places: Mapping[str, Mapping[str, int]] = MappingProxyType({})
    ) -> None:
        self.lines: list[str] = []
        self._files, self._places = files, places
        self._misspelt: set[Key] = set()
        self._known: int | None = None  # faults that were there before a mechanism was guessed
        self.homes: dict[str, str] = {}  # words on where a key belongs, for one that stands in another table
        self._fits = True

    def guess(self) -> None:
        """Mark all further faults as those of a mechanism that is guessed, since its name is misspelt."""
        self._known = len(self.lines)

    @property
    def told(self) -> list[str]:
        """The faults to be printed: without those of a guessed mechanism whose names are not those of the file."""
        return self.lines if self._fits else self.lines[: self._known]

    def value(self, key: Key, value: object, allowed: str) -> None:
        """Report a value that is not allowed."""
        text = str(value).lower() if isinstance(value, bool) else shown(value)
        text = text if len(text) <= _LONGEST_VALUE else text[: _LONGEST_VALUE - 3] + "..."
        self._add(key, f"{spelled(key)} = {text}; allowed: {allowed}")

    def missing(self, key: Key, needed: str, instead: str = "") -> None:
        """Report a missing key, unless it or the key ``instead`` was reported as misspelt."""
        if not self.misspelt(key) and not self.misspelt((*key[:-1], instead)):
            self._fits &= self._known is None
            self._add(key, f"{spelled(key)} is missing; needed: {needed}")

    def misspelt(self, key: Key) -> bool:
        """Tell whether a missing key, or its table, was reported as misspelt."""
        return any(key[:k] in self._misspelt for k in range(1, len(key) + 1))

    def excuse(self, key: Key) -> None:
        """Suppress the report of a missing key whose absence follows from a reported fault."""
        self._misspelt.add(key)

    def unknown(self, key: Key, known: Iterable[str], what: str = "key") -> None:
        """Report an unknown key, with the closest known one."""
        names, word = list(known), str(key[-1])
        guess = closest(word, names)
        if guess is not None:
            self._misspelt.add((*key[:-1], guess))
        self.unknown_name(key, what, choices(word, names) + ("" if guess or len(key) > 2 else self.homes.get(word, "")))

    def unknown_name(self, key: Key, what: str, allowed: str) -> None:
        """Report a key that should name a known item."""
        self._fits &= self._known is None
        self._add(key, f"{spelled(key)}: unknown {what}; allowed: {allowed}")

    def number(self, text: str, internal: str, key: Key) -> float | None:
        """Convert a text such as "7000 rpm" to the internal unit; None, with a fault, if it is not one."""
        try:
            return units.read(text, internal)
        except units.UnitFault as fault:
            self.value(key, text, str(fault))
            return None

    def factor(self, unit: str, internal: str, key: Key) -> float | None:
        """Return the factor from a written unit to the internal one; None, with a fault, for a unit of another kind."""
        try:
            return units.factor(unit, internal)
        except units.UnitFault as fault:
            self.value(key, unit, str(fault))
            return None

    def within_turn(self, key: Key, written: float, unit: str | None) -> None:
        """Report a number in rad that is beyond one turn: it was meant in degrees."""
        if unit == "rad" and abs(written) > 2.0 * math.pi:
            self.value(key, written, f'an angle within one turn if the unit is rad; {written:g} with the unit "deg"?')

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
    """Content of a study file, its path, and its faults so far."""

    data: Mapping[str, Any]
    path: Path
    faults: Faults

    def __contains__(self, table: str) -> bool:
        """Tell whether the file has a table."""
        return table in self.data

    def free_table(self, name: str) -> dict[str, Any] | None:
        """Return a table whose keys are names of the mechanism, as written in the file; None if it is missing."""
        table = self.data.get(name)
        if table is not None and not isinstance(table, dict):
            self.faults.value((name,), table, f"a table [{name}]")
        return table if isinstance(table, dict) else None

    def texts(self, table: str, key: str) -> list[tuple[int, str]]:
        """Return the texts of a list as written in the file, with their indices, even if other items are faulty."""
        raw = self.data[table].get(key) if isinstance(self.data.get(table), dict) else None
        return [(k, name) for k, name in enumerate(raw) if isinstance(name, str)] if isinstance(raw, list) else []

    def raise_faults(self) -> None:
        """Raise an error if there are faults.

        Raises
        ------
        StudyError
            lists all faults found so far.
        """
        if self.faults.lines:
            raise StudyError(str(self.path), self.faults.told)


def copied_table(data: Mapping[str, Any], key: tuple[str, ...]) -> dict[str, Any] | None:
    """Replace a table of the file by a copy that may be changed, and return the copy; None if it does not exist."""
    table: Any = data
    for part in key:
        if not isinstance(table, dict) or not isinstance(table.get(part), dict):
            return None
        table[part] = dict(table[part])
        table = table[part]
    return table if isinstance(table, dict) else None


def spelled(key: Key) -> str:
    """Write a key path as messages show it: scene.want[2]."""
    text = "".join(f"[{part}]" if isinstance(part, int) else f".{part}" for part in key)
    return text.removeprefix(".")


def _holds(table: Any, key: Key) -> bool:
    for part in key:
        try:
            table = table[part]
        except (KeyError, IndexError, TypeError):
            return False
    return True


def quantity(internal: str, allowed: Callable[[float], bool] = lambda x: True, kind: str = "") -> BeforeValidator:
    """Return a validator that reads a text such as "7000 rpm" in the internal unit; ``kind`` states the range."""

    def read(value: object) -> float:
        if not isinstance(value, str):
            raise ValueError("no text")
        try:
            number = units.read(value, internal)
        except units.UnitFault as fault:
            raise PydanticCustomError(QUANTITY, "{words}", {"words": str(fault)}) from None
        if not allowed(number):
            raise PydanticCustomError(
                QUANTITY, "{words}", {"words": kind if internal == "1" else f"{kind}; {units.example(internal)}"}
            )
        return number

    return BeforeValidator(read)


def _positive(internal: str) -> BeforeValidator:
    return quantity(internal, lambda x: x > 0.0, "a positive number")


QUANTITY, TEXT = "quantity", WithJsonSchema({"type": "string"})
Number = Annotated[float, Field(allow_inf_nan=False, ge=-1e100, le=1e100)]
Count = Annotated[int, Field(ge=1, le=1_000_000)]
Seed = Annotated[int, Field(ge=0, lt=2**63)]
Fraction = Annotated[float, Field(ge=0.0, le=1.0)]
Length = Annotated[float, quantity("mm"), TEXT]
Angle = Annotated[float, quantity("rad"), TEXT]
PositiveLength = Annotated[float, _positive("mm"), TEXT]
PositiveAngle = Annotated[float, _positive("rad"), TEXT]
Seconds = Annotated[float, _positive("s"), TEXT]
Bytes = Annotated[float, _positive("B"), TEXT]
Speed = Annotated[float, quantity("rad/s", lambda x: x != 0.0, "a non-zero number"), TEXT]
Share = Annotated[float, quantity("1", lambda x: 0.0 < x < 1.0, 'a share above 0 and below 100 %, as "2 %"'), TEXT]
Three = Annotated[list[Number], Field(min_length=3, max_length=3)]
TwoTexts = Annotated[list[str], Field(min_length=2, max_length=2)]
TwoLengths = Annotated[list[Length], Field(min_length=2, max_length=2)]
ThreeLengths = Annotated[list[Length], Field(min_length=3, max_length=3)]

# A discriminator keeps pydantic from reporting one error for each member of a union.
ONE, WORD, LIST, TABLE = "<one>", "<word>", "<list>", "<table>"
KIND = Discriminator(
    lambda value: LIST if isinstance(value, list) else TABLE if isinstance(value, dict | Section) else ONE
)
Place = Annotated[Annotated[str, Tag(ONE)] | Annotated[ThreeLengths, Tag(LIST)], KIND]
LengthOrPlace = Annotated[Annotated[Length, Tag(ONE)] | Annotated[ThreeLengths, Tag(LIST)], KIND]
Lengths = Annotated[Annotated[Length, Tag(ONE)] | Annotated[list[Length], Tag(LIST)], KIND]
TruthOrNames = Annotated[Annotated[bool, Tag(ONE)] | Annotated[list[str], Tag(LIST)], KIND]
TextOrNumber = Annotated[
    Annotated[str, Tag(WORD)] | Annotated[Number, Tag(ONE)],
    Discriminator(lambda value: WORD if isinstance(value, str) else ONE),
]


def holds(words: str, default: Any = None, **more: Any) -> Any:
    """Declare an optional key and describe its values; ``more`` is passed to pydantic's ``Field``."""
    return Field(default, description=words, **more)


def _as_written(schema: dict[str, Any], model: type[Section]) -> None:
    """Add the required keys to the JSON schema of a table; remove titles, docstrings and empty defaults."""
    schema.pop("title", None)
    schema.pop("description", None)
    schema |= {"required": list(model.required)} if model.required else {}
    for key in schema.get("properties", {}).values():
        key.pop("title", None)
        if key.get("default") in (None, [], ""):
            key.pop("default", None)


class Section(BaseModel):
    """Base of the models of tables; the ``description`` of a key states its values and is quoted in messages.

    ``required`` keys are optional to pydantic, so that a missing key does not hide the faults of other keys.
    """

    model_config = ConfigDict(
        extra="forbid", strict=True, frozen=True, populate_by_name=False, json_schema_extra=_as_written
    )
    required: ClassVar[tuple[str, ...]] = ()


S = TypeVar("S", bound=Section)


def read_table(model: type[S], name: str, file: StudyFile) -> S:
    """Read a table of the file by its model; return the defaults if the table does not exist."""
    return read_section(model, file.data[name], (name,), file.faults) if name in file else model()


def read_section(model: type[S], raw: object, key: Key, faults: Faults) -> S:
    """Read a table by its model; report faulty keys and leave them at their defaults."""
    if not isinstance(raw, dict):
        faults.value(key, raw, f"a table with the keys {', '.join(fields(model))}")
        return model()
    section = _validated(model, raw, key, faults)
    _missing_keys(model, raw, key, faults)
    return section


def _missing_keys(model: type[Section], raw: Mapping[str, Any], key: Key, faults: Faults) -> None:
    """Report the required keys missing in a table and in the tables within it."""
    for name in model.required:
        if name not in raw:
            faults.missing((*key, name), _reached(model, (name,))[1])
    for name, value in raw.items():
        inner = _reached(model, (name,))[0]
        for k, table in enumerate(value) if isinstance(value, list) else [(None, value)]:
            if isinstance(table, dict):
                _missing_keys(inner, table, (*key, name) if k is None else (*key, name, k), faults)


def _validated(model: type[S], raw: Mapping[str, Any], key: Key, faults: Faults) -> S:
    try:
        return model.model_validate(raw)
    except ValidationError as error:
        bad: set[str | int] = set()
        for item in error.errors(include_url=False):
            place = tuple(part for part in item["loc"] if part not in (ONE, WORD, LIST, TABLE))
            bad.add(place[0])
            if item["type"] == "extra_forbidden":
                faults.unknown((*key, *place), fields(_reached(model, place[:-1])[0]))
            else:
                words = _reached(model, place)[1] + units.unquoted(item["input"], item["type"])
                faults.value((*key, *place), item["input"], item["ctx"]["words"] if item["type"] == QUANTITY else words)
        return model.model_validate({name: value for name, value in raw.items() if name not in bad})


def fields(model: type[Section]) -> dict[str, Any]:
    """Return the fields of a model by their names in the file."""
    return {field.alias or name: field for name, field in model.model_fields.items()}


def _reached(model: type[Section], place: Key) -> tuple[type[Section], str]:
    """Find the model of the table at a place, and the description of the innermost key known to a model.

    A place under names chosen by the user, or outside any table, has the model without keys.
    """
    words = ""
    for part in place:
        if isinstance(part, str):
            field = fields(model).get(part)
            model = Section if field is None else _table_in(field.annotation)
            words = words if field is None else str(field.description)
    return model, words


def _table_in(annotation: Any) -> type[Section]:
    """Find the model named in an annotation, or the model without keys if there is none."""
    stack = [annotation]
    while stack:
        candidate = stack.pop()
        if isinstance(candidate, type) and issubclass(candidate, Section):
            return candidate
        stack += get_args(candidate)
    return Section
