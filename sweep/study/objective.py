"""[objective], [optimise] and [pareto]: what is minimised or maximised, how it is searched, and against what."""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import suppress
from typing import Any, Literal, cast

from sweep.errors import InputError
from sweep.families.base import Family, Output, Parameter, Unit
from sweep.families.chain import driven_guide
from sweep.families.names import is_flag, negative, without_minus
from sweep.quantities.limits import Limit
from sweep.quantities.measures import measure
from sweep.quantities.resolve import output
from sweep.study.file import Faults, Key, Seconds, Section, Seed, Share, StudyFile, holds
from sweep.study.limits import read_output_name
from sweep.study.parameter import read_entry
from sweep.study.space import Axis
from sweep.study.study import OptimiseSettings, ParetoSettings, ProveSettings


class ObjectiveSection(Section):
    """Table [objective]."""

    minimise: str | None = holds("the name of a design output")
    maximise: str | None = holds("the name of a design output")

    @property
    def goal(self) -> str | None:
        """Output to be minimised; for ``maximise`` the negative of its output."""
        return self.minimise or (self.maximise and negative(self.maximise))

    @property
    def named(self) -> tuple[tuple[str, str], ...]:
        """Given keys and the outputs that they name."""
        goals = (("minimise", self.minimise), ("maximise", self.maximise))
        return tuple((key, name) for key, name in goals if name is not None)


def check_goal(section: ObjectiveSection, file: StudyFile) -> None:
    """Report an objective that names no output, or two, and [optimise] without an objective."""
    written = file.data.get("objective")
    if isinstance(written, dict) and not {"minimise", "maximise"} & set(written):
        needed = "the name of a design output; or maximise, the name of one to be made large"
        file.faults.missing(("objective", "minimise"), needed, instead="maximise")
    if section.minimise is not None and section.maximise is not None:
        allowed = "minimise or maximise, not both: bound the other output in [limits], or set it against in [pareto]"
        file.faults.value(("objective", "maximise"), section.maximise, allowed)
    if "optimise" in file and "objective" not in file:
        needed = "a table [objective] with minimise = a design output, as [optimise] is given"
        file.faults.missing(("objective",), needed)


def check_objective(section: ObjectiveSection, family: Family, faults: Faults) -> None:
    """Report an objective that is no output of the mechanism."""
    for key, name in section.named:
        read_output_name(family, name, ("objective", key), faults)


def check_steady(file: StudyFile, family: Family, objective: ObjectiveSection, limits: tuple[Limit, ...]) -> None:
    """Report objectives and limits that are piecewise constant, whose gradients are zero.

    A wanted output may jump, since it needs no sensitivities.
    """
    if "optimise" not in file:
        return
    written = file.free_table("limits") or {}
    checked = [(("objective", key), name, name) for key, name in objective.named]
    checked += [(("limits", limit.output), limit.output, written.get(limit.output, limit.output)) for limit in limits]
    for key, name, given in checked:
        with suppress(InputError):  # an unknown name is reported where it stands
            flag = key[0] == "objective" and is_flag(name)
            if flag or (name not in family.parameter_names and output(family, name).jumps):
                allowed = (
                    f"a quantity that changes steadily; {name} is constant in pieces, so no slope leads to it: ask for "
                    "it in scene.want, or leave out [optimise] and let the sweep alone decide"
                )
                file.faults.value(key, given, allowed)
    for limit in limits:
        with suppress(InputError):
            if allowed := measure(family, limit.output).refused(limit.minimum, limit.maximum):
                given = written.get(limit.output, limit.output)
                file.faults.value(("limits", limit.output), given, f"{allowed}, as [optimise] is given")


class ProveTable(Section):
    """Table ``optimise.prove``."""

    gap: Share = holds('a share as a text, as "1 %"', 0.01, json_schema_extra={"default": "1 %"})
    boxes: int = holds("a whole number, 64 to 10^9", 1_000_000, ge=64, le=10**9)
    smallest: Share = holds(
        'a share of every range as a text, as "0.1 %"', 1e-7, json_schema_extra={"default": "0.00001 %"}
    )
    time: Seconds | None = holds('a time as a text, as "60 s"')


class OptimiseSection(Section):
    """Table [optimise]."""

    starts: int = holds("a whole number, 1 to 100000", 20, ge=1, le=100_000)
    seed: Seed = holds("a whole number, 0 or greater", 0)
    unseen: Share | None = holds('a share as a text, as "2 %"')
    looks: int = holds("a whole number, 100 to 10000000", 20_000, ge=100, le=10_000_000)
    time_budget: Seconds | None = holds('a time as a text, as "60 s"')
    variables: Literal["parameters", "locus"] | None = holds('"parameters" or "locus"')
    globally: Literal["none", "proportions"] = holds('"none" or "proportions"', "none", alias="global")
    populations: int = holds("a whole number, 1 to 10000", 40, ge=1, le=10_000)
    prove: ProveTable | None = holds('{ gap = "1 %", boxes = 1000000, time = "10 min" }')


def read_optimise(section: OptimiseSection) -> OptimiseSettings:
    """Return the settings of the search."""
    table = section.prove
    prove = None if table is None else ProveSettings(table.gap, table.boxes, table.smallest, table.time)
    return OptimiseSettings(**section.model_dump(exclude={"prove"}), prove=prove)


def check_search(section: OptimiseSection, file: StudyFile, bare: Family) -> None:
    """Report a search over a missing locus, or over proportions of a mechanism without linear variables."""
    if section.variables == "locus" and file.free_table("locus") is None:
        file.faults.value(("optimise", "variables"), "locus", '"parameters", or a table [locus]')
    if section.globally == "proportions" and driven_guide(bare) is None:
        file.faults.value(("optimise", "global"), "proportions", '"none", or the chain ["rssr", "guide"]')


MOST_BOUNDS = 64
SIDES = ("at_most", "at_least")


class ParetoSection(Section):
    """Table [pareto]; at_most and at_least are read like parameters."""

    required = ("output",)
    output: str | None = holds("the name of a design output, not the objective")
    at_most: Any = None
    at_least: Any = None
    points: int | None = holds("a whole number, 2 to 64", ge=2, le=64)
    starts: int = holds("a whole number, 0 to 1000", 2, ge=0, le=1000)
    time_budget: Seconds | None = holds('a time as a text, as "60 s"')


def read_pareto(
    section: ParetoSection,
    file: StudyFile,
    family: Family,
    objective: ObjectiveSection,
    search: OptimiseSection,
    limits: Sequence[Limit],
) -> ParetoSettings | None:
    """Read the settings of the front, or None if something is faulty (all faults are reported).

    Parameters
    ----------
    section : [pareto]
    family : mechanism with the effects that the second output needs
    objective, search : [objective] and [optimise]
    limits : limits of the study; one on the other side of the second output holds along the whole front
    """
    raw, faults = file.data.get("pareto"), file.faults
    if "pareto" in file and "optimise" not in file:
        faults.missing(("optimise",), "a table [optimise], as [pareto] begins at the optimum")
    if not isinstance(raw, dict):
        return None
    given = [side for side in SIDES if side in raw]
    if len(given) == 2:
        faults.value(("pareto", "at_least"), raw["at_least"], "either at_most or at_least, not both")
    elif not given:
        faults.missing(("pareto", "at_most"), "bounds on the output; or at_least", instead="at_least")
    if section.output is None:
        return None
    place: Key = ("pareto", "output")
    output = read_output_name(family, section.output, place, faults)
    if output is None or len(given) != 1:
        return None
    goal = objective.goal or ""
    if output.name in (goal, without_minus(goal)):
        faults.value(place, output.name, "another output than the objective")
        return None
    key: Key = ("pareto", given[0])
    bounds = _bounds(output, raw[given[0]], key, faults)
    if bounds is None or not _searchable(family, output, bounds, given[0], faults):
        return None
    lower = given[0] == "at_least"
    ends = [limit.maximum if lower else limit.minimum for limit in limits if limit.output == output.name]
    if any(bound > end if lower else bound < end for end in ends if end is not None for bound in bounds):
        side = "maximum" if lower else "minimum"
        faults.value(key, raw[given[0]], f"bounds that leave room to the {side} of {output.name} in [limits]")
        return None
    if section.points is not None and not 2 <= len(set(bounds)) < section.points:
        allowed = f"more than the {len(set(bounds))} bounds given, of which there must be two or more"
        faults.value(("pareto", "points"), section.points, allowed)
        return None
    return ParetoSettings(output.name, bounds, lower, section.starts, section.time_budget, section.points, search.looks)


def _bounds(output: Output, raw: object, key: Key, faults: Faults) -> tuple[float, ...] | None:
    # Bounds are written like the values of a parameter, in any unit of the output's kind.
    word = cast(Unit, "angle" if output.unit == "rad" else output.unit)
    entry = read_entry(Parameter(output.name, word, output.text), raw, key, faults, sampled=False)
    if entry is None:
        return None
    bounds = (entry,) if not isinstance(entry, Axis) or entry.values is None else tuple(entry.values.tolist())
    if len(bounds) > MOST_BOUNDS:
        faults.value(key, f"{len(bounds)} bounds", f"at most {MOST_BOUNDS}: each is a search of its own")
        return None
    return tuple(float(bound) for bound in bounds)


def _searchable(family: Family, output: Output, bounds: tuple[float, ...], side: str, faults: Faults) -> bool:
    """Tell whether the optimiser can keep these bounds on the second output."""
    try:
        measured = measure(family, output.name)
    except InputError as error:
        faults.value(("pareto", "output"), output.name, error.allowed)
        return False
    if measured.inner == "rotatable" or output.jumps:
        faults.value(("pareto", "output"), output.name, "a quantity that changes steadily")
        return False
    ends = [(bound, None) if side == "at_least" else (None, bound) for bound in bounds]
    allowed = next((words for low, high in ends if (words := measured.refused(low, high))), "")
    if allowed:
        faults.value(("pareto", side), list(bounds), allowed)
    return not allowed
