"""[locus] and [fit]: limit positions that determine the links of a stage, and the fitted line of a guided point."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Literal

import numpy as np

from sweep.errors import InputError
from sweep.families.base import Family, Parameter
from sweep.families.capabilities import LimitLocus
from sweep.families.chain import Chain
from sweep.quantities.limits import Limit
from sweep.study.file import Faults, PositiveLength, Section, StudyFile, holds
from sweep.study.parameter import Entry, missing_parameter, read_entry
from sweep.study.space import Axis
from sweep.synthesis.fit import LineFit
from sweep.synthesis.locus import LOCI, OnLocus

# Two names of phi0/(2 pi - phi0): as the ratio of the times of both strokes, and as the design output.
RATIOS = ("time_ratio", "stroke_ratio")
WHOLE_TURN = 2.0 * np.pi * (1.0 - 1e-12)


def read_locus(file: StudyFile, bare: Family) -> tuple[OnLocus | None, dict[str, Entry]]:
    """Find the stage that [locus] describes, and its prescribed outputs as fixed values or axes."""
    raw = file.free_table("locus")
    locus = None if raw is None else _stage(bare, file.faults)
    if raw is None or locus is None:
        return None, {}
    sampled = "sample" in (file.free_table("design") or {})
    return locus, _prescribed(locus, raw, file.faults, sampled)


def _stage(family: Family, faults: Faults) -> OnLocus | None:
    first = family.stages[0]
    if first.family.find(LimitLocus) is None:
        families = tuple(dict.fromkeys(way.family for way in LOCI))
        faults.value(("locus",), first.family.name, f"a mechanism that is or begins with {' or '.join(families)}")
        return None
    return OnLocus(first.family.name, first.tail)


def _prescribed(locus: OnLocus, raw: Mapping[str, Any], faults: Faults, sampled: bool) -> dict[str, Entry]:
    """Read the prescribed outputs as fixed values or axes; report and omit faulty ones."""
    names = [p.name for p in locus.prescribed]
    ratios, phi0 = [f"{name}{locus.number}" for name in RATIOS], f"phi0{locus.number}"
    ratio = next((name for name in ratios if name in raw), ratios[0])
    names.insert(names.index(phi0) + 1, ratio)
    for name in raw:
        if name not in names:
            redundant = {phi0, ratio} if {phi0, ratio} & set(raw) else set()  # either of both gives phi0
            faults.unknown(("locus", name), [k for k in names if k not in raw and k not in redundant] or names)
    entries: dict[str, Entry] = {}
    for p in locus.prescribed:
        if p.name == phi0 and ratio in raw:
            angle = _angle_of_ratio(phi0, raw, ratio, faults, sampled)
            entries |= {} if angle is None else {phi0: angle}
            continue
        if p.name not in raw:
            instead = ratio if p.name == phi0 else ""
            other = f"; or {ratio}, the time there over the time back, as 1.1" if instead else ""
            faults.missing(("locus", p.name), missing_parameter(p) + other, instead=instead)
            continue
        entry = read_entry(p, raw[p.name], ("locus", p.name), faults, sampled)
        if entry is None:
            continue
        allowed = locus.allowed(p.name, _values(entry))
        if allowed is not None:
            faults.value(("locus", p.name), raw[p.name], allowed)
        entries[p.name] = entry
    return entries


def _angle_of_ratio(phi0: str, raw: Mapping[str, Any], ratio: str, faults: Faults, sampled: bool) -> Entry | None:
    """Read phi0 from the ratio of stroke times, phi0/(2 pi - phi0), for a crank of constant speed."""
    key = ("locus", ratio)
    if phi0 in raw:
        faults.value(key, raw[ratio], f"{phi0} or {ratio}, not both: they say the same")
        return None
    text = "time from the extended to the folded position over the time back"
    entry = read_entry(Parameter(ratio, "ratio", text, positive=True), raw[ratio], key, faults, sampled)
    if entry is None or not isinstance(entry, Axis):
        return None if entry is None else float(_angle(entry))
    if entry.values is None:
        return Axis.sampled(phi0, (float(_angle(entry.low)), float(_angle(entry.high))), "rad")
    return Axis.listed(phi0, _angle(entry.values), "rad")


def _angle(ratio: Any) -> Any:
    return 2.0 * np.pi * ratio / (1.0 + ratio)


def prescribed_limits(entries: Mapping[str, Entry]) -> tuple[Limit, ...]:
    """Return the prescribed outputs as limits: values as equations, axes as bounds.

    An output swept over a whole turn has no limit.
    """
    limits = []
    for name, entry in entries.items():
        ends = _values(entry)
        if isinstance(entry, Axis) and float(np.ptp(ends)) >= WHOLE_TURN:
            continue
        sizes = np.abs(ends)
        limits.append(Limit(name, float(sizes.min()), float(sizes.max())))
    return tuple(limits)


def _values(entry: Entry) -> np.ndarray[tuple[int], np.dtype[np.float64]]:
    if not isinstance(entry, Axis):
        return np.array([entry])
    return np.array([entry.low, entry.high]) if entry.values is None else np.asarray(entry.values)


class FitSection(Section):
    """Table [fit]."""

    stroke: PositiveLength | None = holds('a length as a text, as "24.5 mm"')
    direction: Literal["free", "given"] = holds('"free" or "given"', "free")


def read_fit(section: FitSection, file: StudyFile, family: Family) -> LineFit | None:
    """Read the line fit of the mechanism's guided point, or None if the file has no [fit]."""
    if "fit" not in file:
        return None
    fit = LineFit(section.stroke, section.direction == "free")
    try:
        fit.parameters(family)
    except InputError as error:
        file.faults.value(("fit",), family.name, error.allowed)
        return None
    if "optimise" in file and fit.stroke is not None:
        _check_stroke(fit.stroke, family, file.free_table("limits") or {}, file.faults)
    return fit


def _check_stroke(stroke: float, family: Family, limits: dict[str, object], faults: Faults) -> None:
    """Report an optimisation without bounds on the stroke: [fit] scales only designs of the sweep."""
    names = ("stroke", f"stroke{len(family.stages)}") if isinstance(family, Chain) else ("stroke",)
    if not any(name in limits for name in names):
        words = f'{{ min = {stroke * 0.999:g}, max = {stroke * 1.001:g}, unit = "mm" }}'
        faults.missing(("limits", "stroke"), f"bounds near fit.stroke that [optimise] must keep, as {words}")
