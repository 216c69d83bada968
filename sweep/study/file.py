"""A study file while it is read: its tables as pydantic models, and its faults with file, line, key, value and rule."""

from __future__ import annotations

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
        """Tell whether a missing key, or its table, stands there with a spelling mistake, which was reported."""
        return any(key[:k] in self._misspelt for k in range(1, len(key) + 1))

    def excuse(self, key: Key) -> None:
        """Let a key be missing: that it is follows from a fault that was reported."""
        self._misspelt.add(key)

    def unknown(self, key: Key, known: Iterable[str], what: str = "key") -> None:
        """Report an unknown key, with the nearest known one."""
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
            return units.read(text, internal)
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


def quantity(internal: str, allowed: Callable[[float], bool] = lambda x: True, kind: str = "") -> BeforeValidator:
    """Return what reads a text such as "7000 rpm" in the internal unit; ``kind`` says in words what is allowed."""

    def read(value: object) -> float:
        if not isinstance(value, str):
            raise ValueError("no text")
        try:
            number = units.read(value, internal)
        except units.UnitFault as fault:
            raise PydanticCustomError(QUANTITY, "{words}", {"words": str(fault)}) from None
        if not allowed(number):
            raise PydanticCustomError(QUANTITY, "{words}", {"words": f"{kind}; {units.example(internal)}"})
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
Size = Annotated[float, _positive("mm"), TEXT]
Width = Annotated[float, _positive("rad"), TEXT]
Seconds = Annotated[float, _positive("s"), TEXT]
Bytes = Annotated[float, _positive("B"), TEXT]
Speed = Annotated[float, quantity("rad/s", lambda x: x != 0.0, "a non-zero number"), TEXT]
Share = Annotated[float, quantity("1", lambda x: 0.0 < x < 1.0, 'a share above 0 and below 100 %, as "2 %"'), TEXT]
Three = Annotated[list[Number], Field(min_length=3, max_length=3)]
TwoTexts = Annotated[list[str], Field(min_length=2, max_length=2)]
TwoLengths = Annotated[list[Length], Field(min_length=2, max_length=2)]
ThreeLengths = Annotated[list[Length], Field(min_length=3, max_length=3)]

# Of a plain union of types pydantic reports the complaints of each one.
ONE, WORD, LIST, TABLE = "<one>", "<word>", "<list>", "<table>"
KIND = Discriminator(
    lambda value: LIST if isinstance(value, list) else TABLE if isinstance(value, dict | Section) else ONE
)
Place = Annotated[Annotated[str, Tag(ONE)] | Annotated[ThreeLengths, Tag(LIST)], KIND]
LengthOrPlace = Annotated[Annotated[Length, Tag(ONE)] | Annotated[ThreeLengths, Tag(LIST)], KIND]
Lengths = Annotated[Annotated[Length, Tag(ONE)] | Annotated[list[Length], Tag(LIST)], KIND]
TextOrNumber = Annotated[
    Annotated[str, Tag(WORD)] | Annotated[Number, Tag(ONE)],
    Discriminator(lambda value: WORD if isinstance(value, str) else ONE),
]


def holds(words: str, default: Any = None, **more: Any) -> Any:
    """Declare a key that may be left out, and say what it may hold; ``more`` is as of pydantic's ``Field``."""
    return Field(default, description=words, **more)


def _as_written(schema: dict[str, Any], model: type[Section]) -> None:
    """Give the JSON schema of a table the keys that it must have, and leave out titles, docstrings, empty defaults."""
    schema.pop("title", None)
    schema.pop("description", None)
    schema |= {"required": list(model.required)} if model.required else {}
    for key in schema.get("properties", {}).values():
        key.pop("title", None)
        if key.get("default") in (None, [], ""):
            key.pop("default", None)


class Section(BaseModel):
    """A table of the file; what each key may hold is its ``description``, which messages quote.

    ``required`` keys are optional to pydantic, so that the others are read all the same.
    """

    model_config = ConfigDict(
        extra="forbid", strict=True, frozen=True, populate_by_name=False, json_schema_extra=_as_written
    )
    required: ClassVar[tuple[str, ...]] = ()


S = TypeVar("S", bound=Section)


def read_table(model: type[S], name: str, file: StudyFile) -> S:
    """Read a table of the file by its model; all defaults where the file has no such table."""
    return read_section(model, file.data[name], (name,), file.faults) if name in file else model()


def read_section(model: type[S], raw: object, key: Key, faults: Faults) -> S:
    """Read a table by its model; faulty keys are reported and left at their defaults."""
    if not isinstance(raw, dict):
        faults.value(key, raw, f"a table with the keys {', '.join(_keys(model))}")
        return model()
    section = _validated(model, raw, key, faults)
    _missing_keys(model, raw, key, faults)
    return section


def _missing_keys(model: type[Section], raw: Mapping[str, Any], key: Key, faults: Faults) -> None:
    """Report the required keys that a table and the tables within it have not."""
    for name in model.required:
        if name not in raw:
            faults.missing((*key, name), _reached(model, (name,))[1])
    for name, value in raw.items():
        inner = _reached(model, (name,))[0]
        for k, one in enumerate(value) if isinstance(value, list) else [(None, value)]:
            if isinstance(one, dict):
                _missing_keys(inner, one, (*key, name) if k is None else (*key, name, k), faults)


def _validated(model: type[S], raw: Mapping[str, Any], key: Key, faults: Faults) -> S:
    try:
        return model.model_validate(raw)
    except ValidationError as error:
        bad: set[str | int] = set()
        for item in error.errors(include_url=False):
            place = tuple(part for part in item["loc"] if part not in (ONE, WORD, LIST, TABLE))
            bad.add(place[0])
            if item["type"] == "extra_forbidden":
                faults.unknown((*key, *place), _keys(_reached(model, place[:-1])[0]))
            else:
                own = item.get("ctx", {}) if item["type"] == QUANTITY else {}
                faults.value((*key, *place), item["input"], own.get("words") or _reached(model, place)[1])
        return model.model_validate({name: value for name, value in raw.items() if name not in bad})


def _keys(model: type[Section]) -> dict[str, Any]:
    """Return the fields of a model by the keys that a file has for them."""
    return {field.alias or name: field for name, field in model.model_fields.items()}


def _reached(model: type[Section], place: Key) -> tuple[type[Section], str]:
    """Find the model of the table at a place, and the description of the innermost key that a model knows.

    What stands under names of the user's, or is no table, has the model without keys.
    """
    words = ""
    for part in place:
        if isinstance(part, str):
            field = _keys(model).get(part)
            model = Section if field is None else _table_in(field.annotation)
            words = words if field is None else str(field.description)
    return model, words


def _table_in(annotation: Any) -> type[Section]:
    """Find the model that an annotation names; the one without keys if it names none."""
    stack = [annotation]
    while stack:
        candidate = stack.pop()
        if isinstance(candidate, type) and issubclass(candidate, Section):
            return candidate
        stack += get_args(candidate)
    return Section
