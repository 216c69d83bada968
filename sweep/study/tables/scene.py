"""[scene]: speed, wanted design outputs and the window of the stroke."""

from __future__ import annotations

from dataclasses import dataclass

from sweep.effects import extended
from sweep.effects.wanted import expanded, names_of_effects
from sweep.families.base import Family
from sweep.families.members import Machine
from sweep.quantities.names import parts
from sweep.study.faults import Faults
from sweep.study.limits import read_output_name
from sweep.study.model import ObjectiveSection, ParetoSection, SceneSection
from sweep.study.reading import Reading
from sweep.study.tables.bodies import Besides
from sweep.study.tables.locus import Prescribed


@dataclass(frozen=True)
class Given:
    """Parameters whose values [scene] gives."""

    values: dict[str, float]


def read(reading: Reading) -> None:
    """Read the table."""
    reading.section(SceneSection, "scene")


def read_values(reading: Reading) -> None:
    """Read speed and window."""
    scene = reading.get(SceneSection)
    reading.fields["speed"] = reading.quantity(scene.speed, "rad/s", ("scene", "speed"), signed=True)
    reading.fields["window"] = _window(scene, reading.faults)


def check_wanted(reading: Reading) -> None:
    """Report a study that asks for nothing."""
    if not reading.get(SceneSection).want and not reading.raw.get("limits") and _goal(reading) is None:
        reading.faults.missing(("scene", "want"), "design outputs to compute, here or in [limits] or [objective]")


def extend(reading: Reading) -> None:
    """Add the effects of all that is wanted to the mechanism, then check the wanted names."""
    asked = reading.texts("scene", "want")
    others = [name for name in (_goal(reading), reading.get(ParetoSection).output) if name]
    wanted = [*(name for _, name in asked), *reading.raw.get("limits", {}), *others]
    wanted = expanded(reading.mechanism, wanted)
    reading.family = extended(reading.mechanism, wanted, reading.get(Besides).curves)
    speed = reading.fields["speed"]
    reading.put(Given({} if speed is None else speeds(reading.family, speed)))
    effects = names_of_effects(reading.mechanism)
    for k, name in asked:
        if name in effects:
            continue
        read_output_name(reading.family, name, ("scene", "want", k), reading.faults)


def collect(reading: Reading) -> None:
    """Collect all design outputs that are computed:
    wanted, prescribed, limited, to be made small, or set against that.
    """
    wanted = [*expanded(reading.mechanism, reading.get(SceneSection).want), *reading.get(Prescribed).entries]
    wanted += [limit.output for limit in reading.fields["limits"]]
    goal, front = _goal(reading), reading.fields["pareto"]
    wanted += [goal] if goal else []
    wanted += [front.output] if front else []
    own = reading.family.parameter_names
    reading.fields["want"] = tuple(name for name in dict.fromkeys(wanted) if name not in own)


def speeds(family: Family, speed: float) -> dict[str, float]:
    """Return what scene.speed gives where an effect asks for the speed of a crank:
    a member turns ratio times as fast, backwards where that is negative.
    """
    if isinstance(family, Machine):
        ratios = {m.name: m.ratio for m in family.members}
        return {p: speed * ratios[parts(p).member] for p in family.parameter_names if parts(p).stem == "speed"}
    return {p: speed for p in family.parameter_names if parts(p).stem == "speed"}


def _goal(reading: Reading) -> str | None:
    return reading.get(ObjectiveSection).goal


def _window(scene: SceneSection, faults: Faults) -> tuple[float, float] | None:
    if scene.window is None:
        return None
    low, high = scene.window.low, scene.window.high
    if low is None or high is None:
        faults.missing(("scene", "window", "from" if low is None else "to"), "a fraction of the stroke, 0 to 1")
        return None
    if not low < high:
        faults.value(("scene", "window", "to"), high, f"a fraction greater than from = {low:g}")
    return low, high
