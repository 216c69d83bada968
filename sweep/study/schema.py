"""The JSON schema of study files, built from the models that read them and from the register of families.

Editors use it to complete and check files (docs/study-files.md, In an editor).  It covers the shape of every table and
the parameters of every family; `sweep check` covers conditions between tables.
"""

from __future__ import annotations

from typing import Any, TypeAlias

from pydantic.json_schema import GenerateJsonSchema, JsonSchemaValue

from sweep.effects import input_names
from sweep.families import NAMES, family
from sweep.families.base import Family, Parameter
from sweep.quantities.units import example, internal_unit
from sweep.study.design import FROM, HASH, SampleTable
from sweep.study.file import Section
from sweep.study.limits import LimitEntry, StrokeSection
from sweep.study.parameter import FixedEntry, ListEntry, RangeEntry
from sweep.study.tables import REQUIRED_TABLES, TABLES

Schema: TypeAlias = dict[str, Any]

DRAFT = "http://json-schema.org/draft-07/schema#"  # newest draft that editors for TOML support
ENTRY = {"$ref": "#/definitions/entry"}


def study_schema() -> Schema:
    """Return the schema as a plain dict, identical at every call."""
    definitions: Schema = {"entry": _entry()}
    tables: Schema = {name: _model(t.model, definitions) for name, t in TABLES.items() if t.model is not None}
    tables |= {name: _each(_model(t.each, definitions)) for name, t in TABLES.items() if t.each is not None}
    tables["locus"] = _each(ENTRY)
    tables["design"] = _each({"anyOf": [ENTRY, _each(ENTRY)]}) | {
        "properties": {"sample": _model(SampleTable, definitions)}
    }
    tables["bodies"] = _each({"anyOf": [ENTRY, _each(ENTRY)]})
    # a load is a parameter or varies over the turn; in a machine it may stand in the table of its member
    load = {"anyOf": [ENTRY, tables["loads"]["additionalProperties"]]}
    tables["loads"] = _each({"anyOf": [*load["anyOf"], _each(load)]})
    limit = {"anyOf": [{"const": True}, {"type": "string"}, _model(LimitEntry, definitions)]}
    tables["limits"] = _each({"anyOf": [*limit["anyOf"], _each(limit)]})
    window = {"type": "array", "items": {"type": "string"}, "minItems": 2, "maxItems": 2}
    tables["cyclogram"] = _each({"anyOf": [window, _model(StrokeSection, definitions)]})
    tables["pareto"]["properties"] |= dict.fromkeys(("at_most", "at_least"), ENTRY)
    names = tables["mechanism"]["properties"]
    names["family"]["enum"] = list(NAMES)
    names["chain"]["items"]["enum"] = list(NAMES)
    return {
        "$schema": DRAFT,
        "title": "linksweep study",
        "type": "object",
        "properties": {
            name: {"description": table.about} | tables.get(name, {"type": "object"}) for name, table in TABLES.items()
        },
        "additionalProperties": False,
        "required": list(REQUIRED_TABLES),
        "anyOf": [{"required": ["mechanism"]}, {"required": ["machine"]}],
        "allOf": [_of_family(family(name)) for name in NAMES],
        "definitions": definitions,
    }


def _each(schema: Schema) -> Schema:
    return {"type": "object", "additionalProperties": schema}


def _entry() -> Schema:
    """Return the schema of a parameter: a number, a text with its unit, or one of the three tables."""
    tables = [_model(model, {}) for model in (FixedEntry, ListEntry, RangeEntry)]
    return {"anyOf": [{"type": "number"}, {"type": "string"}, *tables]}


def _of_family(entry: Family) -> Schema:
    """Return the schema of [design] for mechanisms of one family."""
    parameters = {p.name: {"description": _described(p), "allOf": [ENTRY]} for p in entry.parameters}
    keys = [*parameters, *sorted(input_names(entry) - parameters.keys()), "sample", FROM, HASH]
    design = {"properties": parameters, "propertyNames": {"enum": keys}}
    mechanism = {"properties": {"family": {"const": entry.name}}, "required": ["family"]}
    return {
        "if": {"properties": {"mechanism": mechanism}, "required": ["mechanism"]},
        "then": {"properties": {"design": design}},
    }


def _described(p: Parameter) -> str:
    notes = [p.sign] if p.sign else []
    kind = "a whole number" if p.unit == "count" else example(internal_unit(p.unit))
    notes += [p.choice if p.choices else kind]
    notes += [f"{p.default:g} if left out"] if p.default is not None else []
    return f"{p.text} ({'; '.join(notes)})"


def _model(model: type[Section], definitions: Schema) -> Schema:
    """Return the schema of one table by the names that a file uses."""
    template = "#/definitions/{model}"
    schema: Schema = model.model_json_schema(by_alias=True, ref_template=template, schema_generator=_WithoutNull)
    definitions |= schema.pop("$defs", {})
    return schema


class _WithoutNull(GenerateJsonSchema):
    """Schema generator without null: TOML has none, and a value None in a model is omitted from a file."""

    def nullable_schema(self, schema: Any) -> JsonSchemaValue:
        return self.generate_inner(schema["schema"])
