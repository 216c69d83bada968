"""``Section``: the shape of a table as a pydantic model, and a table of the file read by it."""

from __future__ import annotations

from collections.abc import Container, Mapping
from typing import Annotated, Any, ClassVar, TypeVar, get_args

from pydantic import BaseModel, ConfigDict, Field, ValidationError

from sweep.study.file import Faults, Key, StudyFile

Number = Annotated[float, Field(allow_inf_nan=False, ge=-1e100, le=1e100)]
Count = Annotated[int, Field(ge=1, le=1_000_000)]
Seed = Annotated[int, Field(ge=0, lt=2**63)]
Fraction = Annotated[float, Field(ge=0.0, le=1.0)]


class Section(BaseModel):
    """A table of the file; what each key may hold is its ``description``, which messages quote.

    ``required`` keys are optional to pydantic, so that the others are read all the same.
    """

    model_config = ConfigDict(extra="forbid", strict=True, frozen=True, populate_by_name=False)
    required: ClassVar[tuple[str, ...]] = ()


S = TypeVar("S", bound=Section)


def read_table(model: type[S], name: str, file: StudyFile) -> S:
    """Read a table of the file by its model; all defaults where the file has no such table."""
    return read_section(model, file.data[name], (name,), file.faults) if name in file else model()


def read_section(model: type[S], raw: object, key: Key, faults: Faults) -> S:
    """Read a table by its model; faulty keys are reported and left at their defaults."""
    if not isinstance(raw, dict):
        faults.value(key, raw, f"a table with the keys {', '.join(_names(model))}")
        return model()
    section = _validated(model, raw, key, faults)
    missing_keys(model, raw, key, faults)
    return section


def missing_keys(model: type[Section], given: Container[str], key: Key, faults: Faults) -> None:
    """Report the required keys that are not among the given ones."""
    for name in model.required:
        if name not in given:
            faults.missing((*key, name), _described(model, (name,)))


def _validated(model: type[S], raw: Mapping[str, Any], key: Key, faults: Faults) -> S:
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
    """Find the description of the innermost named key at this place."""
    named = [k for k, part in enumerate(place) if isinstance(part, str)]
    inner = _model_at(model, place[: named[-1]])
    return str(_field(inner, place[named[-1]]).description)


def _model_at(model: type[Section], place: Key) -> type[Section]:
    """Find the model of the table at this place: the one named in the annotation of each key on the way."""
    for part in place:
        if isinstance(part, str):
            model = _table_in(_field(model, part).annotation)
    return model


def _table_in(annotation: Any) -> type[Section]:
    stack = [annotation]
    while stack:
        candidate = stack.pop()
        if isinstance(candidate, type) and issubclass(candidate, Section):
            return candidate
        stack += get_args(candidate)
    raise TypeError(f"{annotation!r} holds no table")
