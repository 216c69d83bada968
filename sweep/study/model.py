"""The shape of a study file, table by table; what each key may hold is its ``description``, which messages quote."""

from __future__ import annotations

from typing import Annotated, Any, ClassVar, Literal

from pydantic import BaseModel, ConfigDict, Field, PlainValidator

from sweep.quantities.names import negative

Number = Annotated[float, Field(allow_inf_nan=False, ge=-1e100, le=1e100)]
Count = Annotated[int, Field(ge=1, le=1_000_000)]
Seed = Annotated[int, Field(ge=0, lt=2**63)]
Fraction = Annotated[float, Field(ge=0.0, le=1.0)]


def _proofs(value: object) -> object:
    # Not by the type: of a union of types pydantic reports each one's complaint.
    if isinstance(value, bool) or (isinstance(value, list) and all(isinstance(name, str) for name in value)):
        return value
    raise ValueError("neither a truth value nor names")


Proofs = Annotated[bool | list[str], PlainValidator(_proofs, json_schema_input_type=bool | list[str])]


class Section(BaseModel):
    """A table of the file.  ``required`` keys are optional to pydantic, so that the others are read all the same."""

    model_config = ConfigDict(extra="forbid", strict=True, frozen=True, populate_by_name=False)
    required: ClassVar[tuple[str, ...]] = ()


class StudySection(Section):
    """[study]"""

    required = ("name",)
    name: str | None = Field(
        None, pattern="^[a-z0-9][a-z0-9-]*$", max_length=64, description="a plain word of a-z, 0-9 and '-'"
    )
    title: str = Field("", description="a text")
    question: str = Field("", description="a text")


class MechanismSection(Section):
    """[mechanism]"""

    family: str | None = Field(None, description="the name of a family")
    chain: Annotated[list[str], Field(min_length=1)] | None = Field(None, description="a list of names of families")


class WindowTable(Section):
    """scene.window"""

    required = ("from", "to")
    low: Fraction | None = Field(None, alias="from", description="a fraction of the stroke, 0 to 1")
    high: Fraction | None = Field(None, alias="to", description="a fraction of the stroke, 0 to 1")


class SceneSection(Section):
    """[scene]"""

    speed: str | None = Field(None, description='a speed of rotation as a text, as "7000 rpm"')
    want: list[str] = Field([], description="a list of names of design outputs")
    window: WindowTable | None = Field(None, description="{ from = 0.0, to = 0.6 }, fractions of the stroke")


class SampleTable(Section):
    """design.sample"""

    required = ("kind", "n")
    kind: Literal["sobol"] | None = Field(None, description='"sobol"')
    n: Annotated[int, Field(ge=1, le=2**40)] | None = Field(None, description="a whole number, 1 to 2^40")
    seed: Seed = Field(0, description="a whole number, 0 or greater")


class RangeEntry(Section):
    """design.x = { from, to, count, unit, scale }"""

    required = ("from", "to")
    low: Number | None = Field(None, alias="from", description="a finite number, its unit in the key unit")
    high: Number | None = Field(None, alias="to", description="a finite number, its unit in the key unit")
    count: Count | None = Field(None, description="a whole number, 1 to 1000000")
    unit: str | None = Field(None, description='a unit as a text, as "mm"')
    scale: Literal["linear", "log"] = Field("linear", description='"linear" or "log"')


class ListEntry(Section):
    """design.x = { values, unit }"""

    values: Annotated[list[Number], Field(min_length=1, max_length=1_000_000)] | None = Field(
        None, description="a list of 1 to 1000000 finite numbers, their unit in the key unit"
    )
    unit: str | None = Field(None, description='a unit as a text, as "mm"')


class FixedEntry(Section):
    """design.x = { value, unit }"""

    value: Number | None = Field(None, description="a finite number, its unit in the key unit")
    unit: str | None = Field(None, description='a unit as a text, as "mm"')


class LimitEntry(Section):
    """limits.x = { min, max, unit }"""

    min: Number | None = Field(None, description="a finite number, its unit in the key unit")
    max: Number | None = Field(None, description="a finite number, its unit in the key unit")
    unit: str | None = Field(None, description='a unit as a text, as "deg"')


class FitSection(Section):
    """[fit]"""

    stroke: str | None = Field(None, description='a length as a text, as "24.5 mm"')
    direction: Literal["free", "given"] = Field("free", description='"free" or "given"')


class ObjectiveSection(Section):
    """[objective]"""

    minimise: str | None = Field(None, description="the name of a design output")
    maximise: str | None = Field(None, description="the name of a design output")

    @property
    def goal(self) -> str | None:
        """The output that is made small: of one to be made large its negative."""
        return self.minimise or (self.maximise and negative(self.maximise))


class AccuracySection(Section):
    """[accuracy]"""

    target: Annotated[float, Field(ge=1e-14, le=0.1)] | None = Field(None, description="a relative error, 1e-14 to 0.1")
    samples: Annotated[int, Field(ge=8, le=2**20)] | None = Field(
        None, description="a whole number of crank angles, 8 to 1048576"
    )
    certify: Proofs = Field(False, description="true or false, or a list of the wanted maxima to prove")


class ProveTable(Section):
    """optimise.prove"""

    required = ("gap",)
    gap: str | None = Field(None, description='a share as a text, as "1 %"')
    boxes: Annotated[int, Field(ge=64, le=10**9)] = Field(1_000_000, description="a whole number, 64 to 10^9")
    smallest: str = Field("0.00001 %", description='a share of every range as a text, as "0.1 %"')
    time: str | None = Field(None, description='a time as a text, as "60 s"')


class OptimiseSection(Section):
    """[optimise]"""

    starts: Annotated[int, Field(ge=1, le=100_000)] = Field(20, description="a whole number, 1 to 100000")
    seed: Seed = Field(0, description="a whole number, 0 or greater")
    unseen: str = Field("2 %", description='a share as a text, as "2 %"')
    looks: Annotated[int, Field(ge=100, le=10_000_000)] = Field(20_000, description="a whole number, 100 to 10000000")
    time_budget: str | None = Field(None, description='a time as a text, as "60 s"')
    variables: Literal["parameters", "locus"] | None = Field(None, description='"parameters" or "locus"')
    globally: Literal["none", "proportions"] = Field("none", alias="global", description='"none" or "proportions"')
    populations: Annotated[int, Field(ge=1, le=10_000)] = Field(40, description="a whole number, 1 to 10000")
    prove: ProveTable | None = Field(None, description='{ gap = "1 %", boxes = 1000000, time = "10 min" }')


class ParetoSection(Section):
    """[pareto]; at_most and at_least are read like parameters"""

    required = ("output",)
    output: str | None = Field(None, description="the name of a design output, not the objective")
    at_most: Any = None
    at_least: Any = None
    points: Annotated[int, Field(ge=2, le=64)] | None = Field(None, description="a whole number, 2 to 64")
    starts: Annotated[int, Field(ge=0, le=1000)] = Field(2, description="a whole number, 0 to 1000")
    time_budget: str | None = Field(None, description='a time as a text, as "60 s"')


class ToleranceSection(Section):
    """[tolerance]"""

    lengths: str | None = Field(None, description='a length as a text, as "0.02 mm"')
    angles: str | None = Field(None, description='an angle as a text, as "0.05 deg"')
    robust: str | None = Field(None, description='a share as a text, as "95 %"')


class ReferenceSection(Section):
    """[reference]"""

    required = ("design",)
    design: dict[str, Any] | None = Field(None, description="a table of the parameters of one design")


class OutputSection(Section):
    """[output]"""

    keep: Literal["feasible", "all"] = Field("feasible", description='"feasible" or "all"')
    dtype: Literal["float32", "float64"] = Field("float64", description='"float32" or "float64"')
    curves: Literal["optimum", "none"] = Field("optimum", description='"optimum" or "none"')


class BudgetSection(Section):
    """[budget]"""

    disk: str = Field("20 GB", description='a size as a text, as "20 GB"')
    time: str = Field("1 h", description='a time as a text, as "60 s"')


class CurveTable(Section):
    """report.curves"""

    required = ("label", "x", "y", "points")
    label: str | None = Field(None, description="a text")
    x: str | None = Field(None, description="the name of a swept parameter")
    y: str | None = Field(None, description="the name of a swept parameter")
    points: Annotated[list[Annotated[list[Number], Field(min_length=2, max_length=2)]], Field(min_length=2)] | None = (
        Field(None, description="a list of two or more points [x, y] in the units of the two axes")
    )


class FigureTable(Section):
    """report.figures"""

    required = ("file", "title", "caption")
    file: str | None = Field(None, description="the name of an SVG file without a folder")
    title: str | None = Field(None, description="a text")
    caption: str | None = Field(None, description="a text")


class ReportSection(Section):
    """[report]"""

    curves: list[CurveTable] = Field(
        [], description='a list of { label = "...", x = "k", y = "a", points = [[1, 1], [9, 9]] }'
    )
    figures: list[FigureTable] = Field(
        [], description='a list of { file = "atlas.svg", title = "...", caption = "..." }'
    )
