"""[scene]: speed, wanted design outputs and the window of the stroke."""

from __future__ import annotations

from collections.abc import Iterable, Mapping

from pydantic import Field

from sweep.effects import extended
from sweep.effects.wanted import expanded, names_of_effects
from sweep.families.base import Family
from sweep.families.machines import Machine
from sweep.families.names import parts
from sweep.numerics.curves import Curve
from sweep.study.file import Faults, Fraction, Section, Speed, StudyFile
from sweep.study.limits import read_output_name


class WindowTable(Section):
    """Table ``scene.window``."""

    required = ("from", "to")
    low: Fraction | None = Field(None, alias="from", description="a fraction of the stroke, 0 to 1")
    high: Fraction | None = Field(None, alias="to", description="a fraction of the stroke, 0 to 1")


class SceneSection(Section):
    """Table [scene]."""

    speed: Speed | None = Field(None, description='a speed of rotation as a text, as "7000 rpm"')
    want: list[str] = Field([], description="a list of names of design outputs")
    window: WindowTable | None = Field(None, description="{ from = 0.0, to = 0.6 }, fractions of the stroke")


def read_window(window: WindowTable | None, faults: Faults) -> tuple[float, float] | None:
    """Read the part of the stroke in which deviations count, from 0 to 1; None where the file has none."""
    if window is None:
        return None
    low, high = window.low, window.high
    if low is None or high is None:
        faults.missing(("scene", "window", "from" if low is None else "to"), "a fraction of the stroke, 0 to 1")
        return None
    if not low < high:
        faults.value(("scene", "window", "to"), high, f"a fraction greater than from = {low:g}")
    return low, high


def with_effects(file: StudyFile, bare: Family, others: Iterable[str], curves: Mapping[str, Curve]) -> Family:
    """Add the effects of all that is wanted to the mechanism; wrong names in [scene] are reported.

    Parameters
    ----------
    bare : the mechanism
    others : names of outputs that other tables ask for
    curves : the loads over the turn
    """
    asked = file.texts("scene", "want")
    family = extended(bare, expanded(bare, [*(name for _, name in asked), *others]), dict(curves))
    effects = names_of_effects(bare)
    for k, name in asked:
        if name not in effects:
            read_output_name(family, name, ("scene", "want", k), file.faults)
    return family


def speeds(family: Family, speed: float | None) -> dict[str, float]:
    """Find what scene.speed gives where an effect asks for the speed of a crank.

    A member turns ratio times as fast, backwards where that is negative.
    """
    asking = [p for p in family.parameter_names if parts(p).stem == "speed"]
    if speed is None:
        return {}
    if isinstance(family, Machine):
        ratios = {m.name: m.ratio for m in family.members}
        threads = [p.name for r in family.relations for p in r.parameters if p.unit == "speed"]
        return {p: speed * ratios[parts(p).member] for p in asking} | dict.fromkeys(threads, speed)
    return dict.fromkeys(asking, speed)
