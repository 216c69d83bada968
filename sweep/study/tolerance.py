"""[tolerance]: manufacturing tolerances of the lengths and angles of a mechanism."""

from __future__ import annotations

from collections.abc import Mapping
from fnmatch import fnmatchcase

from sweep.errors import nearest
from sweep.families.base import Family
from sweep.quantities.limits import Limit
from sweep.study.file import Faults, PositiveAngle, PositiveLength, Section, Share, StudyFile, holds
from sweep.study.space import DesignSpace
from sweep.study.study import Tolerance

UNITS = {"length": "mm", "angle": "rad"}
MOST_SAMPLES = 1 << 22  # a machine of a hundred dimensions exceeds the memory beyond this


class ToleranceSection(Section):
    """Table [tolerance]."""

    lengths: PositiveLength | None = holds('a length as a text, as "0.02 mm"')
    angles: PositiveAngle | None = holds('an angle as a text, as "0.05 deg"')
    robust: Share | None = holds('a share as a text, as "95 %"')
    samples: int | None = holds("a power of two: mechanisms that say the share")
    own: dict[str, str] = holds('of what a pattern names, as { "*.key" = "0.1 deg", "*_tilt" = "0 deg" }', {})


def read_tolerance(section: ToleranceSection, file: StudyFile, family: Family) -> Tolerance | None:
    """Read the manufacturing tolerances of a family's mechanisms, or None if the file gives none."""
    if "tolerance" not in file:
        return None
    if "optimise" not in file:
        file.faults.missing(("optimise",), "a table [optimise], as [tolerance] is about the optimum")
    written = file.data["tolerance"]
    if isinstance(written, dict) and not {"lengths", "angles", "own"} & {*written}:
        needed = 'a length as "0.02 mm"; or angles, as "0.05 deg"'
        file.faults.missing(("tolerance", "lengths"), needed, instead="angles")
    samples = Tolerance.samples if section.samples is None else section.samples
    if not 2 <= samples <= MOST_SAMPLES or samples & (samples - 1):
        allowed = f"a power of two, 2 to {MOST_SAMPLES}: only then is a Sobol sample balanced"
        file.faults.value(("tolerance", "samples"), samples, allowed)
    single = tuple(_of_patterns(section.own, file, family).items())
    return Tolerance(section.lengths or 0.0, section.angles or 0.0, section.robust, single, samples)


def _of_patterns(given: Mapping[str, str], file: StudyFile, family: Family) -> dict[str, float]:
    """Return the tolerances of single parameters; of several matching patterns the last holds."""
    tolerances: dict[str, float] = {}
    for pattern, text in given.items():
        named = [p for p in family.parameters if fnmatchcase(p.name, pattern) and p.unit in UNITS and p.choices is None]
        key = ("tolerance", "own", pattern)
        if not named or len({p.unit for p in named}) > 1:
            words = "a pattern of names of lengths, or one of angles, as *.key" + nearest(
                pattern, family.parameter_names
            )
            file.faults.value(key, text, words)
            continue
        width = file.faults.number(text, UNITS[named[0].unit], key)
        if width is not None and not width >= 0.0:
            file.faults.value(key, text, "a tolerance, 0 for what is exact")
        tolerances |= dict.fromkeys((p.name for p in named), width or 0.0)
    return tolerances


def check_tolerance(
    tolerance: Tolerance | None, family: Family, limits: tuple[Limit, ...], space: DesignSpace | None, faults: Faults
) -> None:
    """Report tolerances without effect or as large as a link, and a robust search with equations as limits."""
    if tolerance is None:
        return
    for key, unit, size in (("lengths", "length", tolerance.lengths), ("angles", "angle", tolerance.angles)):
        if size > 0.0 and not any(p.unit == unit and p.choices is None for p in family.parameters):
            allowed = f"nothing: {family.name} has no {key} that could deviate"
            faults.value(("tolerance", key), f"{size:.6g} {UNITS[unit]}", allowed)
    if space is not None:
        _check_links(tolerance, family, space, faults)
    with_room = [x.output for x in limits if x.minimum != x.maximum]
    equations = [x.output for x in limits if x.is_equation and x.output not in with_room]
    if tolerance.robust is not None and equations:
        words = 'limits with room, as swing = "40 +- 0.2 deg": no mechanism that is made keeps an equation'
        faults.value(("tolerance", "robust"), ", ".join(equations), words)


def _check_links(tolerance: Tolerance, family: Family, space: DesignSpace, faults: Faults) -> None:
    """Report a tolerance that leaves nothing of a link, however long it is in the space, by the shortest such link."""
    longest, own = {**space.fixed, **{axis.name: axis.high for axis in space.axes}}, dict(tolerance.own)
    links = [p.name for p in family.parameters if p.positive and p.unit == "length" and p.name in longest]
    for name in sorted(links, key=longest.__getitem__):
        width = own.get(name, tolerance.lengths)
        if width >= longest[name]:
            key = ("tolerance", "own" if name in own else "lengths")
            faults.value(key, f"{width:.6g} mm", f"less than the links: {name} is at most {longest[name]:.6g} mm")
            return
