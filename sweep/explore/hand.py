"""State of the interactive page: a study, its dimensions with their ranges, and the results of any design."""

from __future__ import annotations

import math
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property, lru_cache
from pathlib import Path
from typing import Any

from kernels import status as codes
from sweep.chunks.plan import PARAMETER_UNITS
from sweep.errors import InputError, known_keys, number
from sweep.evaluation.tables import design_matrix
from sweep.families.base import Family, Parameter
from sweep.families.machines.machine import Machine
from sweep.families.names import is_flag
from sweep.optimise.starts.dataset import random_designs
from sweep.report.dataset import Dataset, Row, chosen, read_dataset, reference_of, row_of, without_rows
from sweep.report.page import judged
from sweep.report.quantities import quantity
from sweep.study import Study
from sweep.study.load import study_from_data
from sweep.study.loads import speeds
from sweep.study.toml import design_entries, toml

Design = Mapping[str, float]
"""Dimensions in internal units by name; missing inputs of effects have the study's values."""

REACH = 0.5  # range of a dimension that no study sweeps, on either side, relative; for an angle in rad
KEPT = 256  # designs whose outputs are cached: pins and undone steps
COUNT, SAMPLE = 25, 65_536  # of a saved study: values on each of two axes, designs over more axes
STEADY = "at least one ticked dimension that changes steadily"
TABLES = ("fit", "locus", "task", "pareto", "reference", "report")  # not in a saved study of plain dimensions
STARTS = 12
MOST_LETTERS = 64  # largest length of a study's name
PINS = 3


@dataclass(frozen=True)
class PageDimension:
    """A dimension of the page; ``factor`` converts the stored value to ``unit``; ``swept`` if the study sweeps it.

    ``positive`` says that it may not be negative.  ``group`` is the heading under which it stands.
    """

    name: str
    text: str
    unit: str
    factor: float
    low: float
    high: float
    choices: tuple[float, ...]
    swept: bool
    positive: bool
    group: str


class Hand:
    """A study with a first design that evaluates any other design of the same mechanism."""

    def __init__(self, data: Dataset, folder: Path | None, first: Design, pins: Mapping[str, Design]) -> None:
        # Curves are shown even if the report of the study has none.
        study = replace(data.study, output=replace(data.study.output, curves="optimum"))
        self.data, self.folder, self.first, self.pins = replace(data, study=study), folder, first, pins
        self._row = lru_cache(KEPT)(self._computed)

    @property
    def study(self) -> Study:
        """The study that evaluates the designs."""
        return self.data.study

    @property
    def family(self) -> Family:
        """The mechanism with the effects that the study needs."""
        return self.study.family

    @cached_property
    def own(self) -> list[str]:
        """Parameters of the mechanism without effects, except the speeds that the scene gives."""
        given = speeds(self.family, self.study.speed)
        return [name for name in self.study.bare.parameter_names if name not in given]

    @cached_property
    def ranges(self) -> list[PageDimension]:
        """Dimensions of the mechanism, and inputs of effects that the study gives."""
        given = {*self.own, *self.study.written} - {*self.study.curves}
        return [self._range(p) for p in self.family.parameters if p.name in given]

    def _range(self, p: Parameter) -> PageDimension:
        shown = quantity(p.name, self.data.units.get(p.name, PARAMETER_UNITS[p.unit]))
        value, swept = self.first[p.name], p.name in self.study.space.bounds
        reach = REACH * (abs(value) or 1.0) if p.unit != "angle" else math.pi
        positive = p.positive or p.not_negative
        ends = (0.0 if positive else value - reach, value + reach)
        low, high = self.study.space.bounds.get(p.name, ends)
        low, high = (min(low, value), max(high, value)) if low < high else ends
        low = value * (1.0 - REACH) if p.positive and low <= 0.0 else low
        return PageDimension(
            p.name, p.text, shown.unit, shown.factor, low, high, tuple(p.choices or ()),
            swept and low < high, positive, self._group(p.name),
        )  # fmt: skip

    def _group(self, name: str) -> str:
        """Return the member that has a dimension, with the inputs of effects apart."""
        member, dot, _ = name.partition(".")
        words = [member] if dot else ["machine"] if isinstance(self.study.bare, Machine) else []
        return ", ".join(words if name in self.own else [*words, "masses and loads"]) or "mechanism"

    def design(self, given: Mapping[str, object]) -> dict[str, float]:
        """Return the complete design for the dimensions that a page sends, in internal units.

        Raises
        ------
        InputError
            for an unknown dimension, or a value that is not a number or out of range.
        """
        if not isinstance(given, Mapping):
            raise InputError("design", given, "dimensions by their names", "explore")
        known_keys(given, [*self.first], "explore", "a dimension: ")
        design = {**self.first, **{name: number(name, value, "explore") for name, value in given.items()}}
        try:
            design_matrix(self.family, design)
        except InputError as error:  # the page has no columns and rows
            raise InputError(error.name, error.value, error.allowed, "explore") from None
        return design

    def answer(self, designs: Sequence[Mapping[str, object]], names: Sequence[str]) -> dict[str, Any]:
        """Return all data that the page shows for a design and the pinned ones, as JSON."""
        return judged(self.data, [self._row(tuple(self.design(one).items())) for one in designs], names)

    def _computed(self, design: tuple[tuple[str, float], ...]) -> Row:
        return row_of(self.study, dict(design))

    def page(self) -> dict[str, Any]:
        """Return the initial data of the page."""
        feasible = 0 if self.folder is None else self.data.counts.get(codes.OK, 0)
        stored = [axis.name for axis in self.study.space.axes if axis.varies] if feasible else []
        outputs = [name for name in self.study.want if not is_flag(name)] if feasible else []
        return {
            "title": self.study.title or self.study.name,
            "ranges": [vars(one) for one in self.ranges],
            "first": dict(self.first),
            "pins": [{"name": name, "design": dict(design)} for name, design in self.pins.items()][:PINS],
            "most": PINS,
            "columns": [*dict.fromkeys([*outputs, *stored])],  # a prescribed output of [locus] is a dimension
            "swept": stored,
            "empty": self.folder is not None and not feasible,
            "objective": None if self.study.objective is None else self.study.objective.output,
        }

    def saved(self, given: Mapping[str, object], swept: Mapping[str, Sequence[float]]) -> str:
        """Return a study around a design: ``swept`` dimensions vary between two ends, all others keep their values.

        Raises
        ------
        InputError, StudyError
            if a search has nothing to vary, or the study does not allow plain dimensions.
        """
        design = self.design(given)
        entries: dict[str, Any] = dict(design_entries(self.family, design))
        axes = [p for p in self.family.parameters if p.name in swept and p.choices is None]
        for p in axes:
            low, high = swept[p.name]
            entries[p.name] = {"from": low, "to": high, "unit": PARAMETER_UNITS[p.unit]}
            entries[p.name] |= {"count": COUNT} if len(axes) <= 2 else {}
        old, mechanism_names, curves = self.study.data, self.own, self.study.curves
        if not axes and "optimise" in old:
            raise InputError("dimensions", "none", STEADY, "explore")
        data: dict[str, Any] = {name: table for name, table in old.items() if name not in TABLES}
        for table in ("bodies", "loads", "design"):
            rest = {name: entry for name, entry in old.get(table, {}).items() if name != "sample"}
            data |= {table: {n: x if n in curves else entries.get(n, x) for n, x in rest.items()}} if rest else {}
        data["design"] = {name: entries[name] for name in mechanism_names} | data["design"]
        if len(axes) > 2:
            data["design"]["sample"] = {"kind": "sobol", "n": SAMPLE}
        data["limits"] = {name: limit for name, limit in old.get("limits", {}).items() if name not in mechanism_names}
        data["study"] = {**old["study"], "name": f"{self.study.name}-in-hand"[:MOST_LETTERS]}
        data["reference"] = {"design": self._reference_entries(design, swept)}
        data |= {"optimise": {"starts": STARTS}} if "optimise" in old else {}
        study_from_data(data, "study.toml")
        return toml(data)

    def reference(self, given: Mapping[str, object]) -> str:
        """Return the table [reference.design] of a study."""
        return toml({"reference": {"design": self._reference_entries(self.design(given), ())}})

    def _reference_entries(self, design: Design, swept: Collection[str]) -> dict[str, str | float]:
        """Return the entries of a reference design: the mechanism, and inputs of effects that differ from the study."""
        fixed = self.study.space.fixed
        names = {*self.own, *swept, *(r.name for r in self.ranges if design[r.name] != fixed.get(r.name))}
        return design_entries(self.family, {name: value for name, value in design.items() if name in names})


def of_study(study: Study) -> Hand:
    """Return the page state of a study before its run: with its reference design, otherwise one from its space.

    Raises
    ------
    InputError
        if [locus] or [fit] make no design.
    """
    names, space = study.family.parameter_names, study.space
    if pins := _reference(study):
        return Hand(without_rows(study), None, pins["reference"], pins)
    if study.made:
        designs = random_designs(study, 1, 0)
        if not len(designs):
            allowed = "one with a design that [locus] and [fit] can make"
            raise InputError("design space", space.count, allowed, "explore")
        return Hand(without_rows(study), None, dict(zip(names, designs[0].tolist(), strict=True)), {})
    middle = {x.name: 0.5 * (x.low + x.high) if x.values is None else float(x.values[x.count // 2]) for x in space.axes}
    return Hand(without_rows(study), None, {name: {**space.fixed, **middle}[name] for name in names}, {})


def of_results(folder: Path) -> Hand:
    """Return the page state of a dataset: with its result, or a design of its study; the reference design is pinned."""
    data = read_dataset(folder)
    empty = data.optimum is None and not data.counts.get(codes.OK, 0)
    first = of_study(data.study).first if empty else chosen(folder).design
    return Hand(data, data.folder, first, _reference(data.study))


def _reference(study: Study) -> dict[str, Design]:
    """Return the study's reference design under its name, or an empty dict."""
    return {} if study.reference is None else {"reference": reference_of(study)}
