"""Text of a first study of a mechanism or a machine: a start, with two parameters swept, every table explained."""

from __future__ import annotations

import json
import math
import tomllib
from collections.abc import Iterator, Mapping
from functools import lru_cache
from itertools import pairwise
from typing import Any

import numpy as np

from sweep.cli.families import described, main_outputs
from sweep.evaluation.poses import evaluate
from sweep.families.base import Family, Interval, March
from sweep.families.capabilities import Assembly
from sweep.families.machines.machine import Machine
from sweep.families.names import is_flag, parts, stem
from sweep.pages import TEMPLATES, rendered
from sweep.quantities.units import read
from sweep.study.toml import design_entries, toml

# Units by unit word: examples with forces or masses are in SI, the others in any length unit.  Lengths are written in
# mm, masses in g: the factor is that of an example in SI.
SI = {
    "line_mass": "kg/m", "inertia": "kg*m^2", "force": "N", "torque": "N*m", "pressure": "N/m^2", "stiffness": "N/m",
    "damping": "N*s/m", "acceleration": "m/s^2",
}  # fmt: skip
WRITTEN = {"length": ("mm", 1e3), "1/length": ("1/mm", 1e-3), "mass": ("g", 1e3)}
POWER = {"length": 1, "1/length": -1}
OTHERS = {"speed": "rad/s", "angular_acceleration": "rad/s^2", "time": "s", "angle": "deg"}
SPREAD, COUNT = 0.05, 5  # swept range on either side, relative to the example's value, and number of values
SWEPT = 2
APART = 10  # mm between the frames of two members, along z
OF_EACH = 2  # wanted outputs per member
LEAST_SIZE = 20.0  # mm, least length of a member's longest dimension
FIRST = (
    "swing", "stroke", "margin", "max_pressure_angle", "dwell_angle", "dwell_deviation", "stitch_error", "impact_speed",
)  # fmt: skip
# What a designer makes small in families without an acceleration: the error or the variation of a warp tension, the
# load of a bracket, the turn of a thread around an edge.
OWN_GOALS = {
    "backrest": "max_abs_drift", "backrest_closure": "range_K_couple", "backrest_tension": "max_abs_N2_couple",
    "free_cam_friction": "max_wrap",
}  # fmt: skip
# Beginnings of outputs to be made small, the first wanted one.
GOALS = (*OWN_GOALS.values(), "max_abs_d2", "impact_speed", "stroke")
FEWEST_WANTED, MOST_WANTED = 3, 5
WIDTH = 56  # column of the explanations
OFFSETS = 12  # angles tried between the crank of a later stage and the rocker before it, over the turn
POSES = 72  # of each


@lru_cache
def first_designs() -> Mapping[str, Mapping[str, float]]:
    """Read the designs to begin with where a family's example would not do, by family [mm; SI; rad]."""
    tables = tomllib.loads((TEMPLATES / "first_designs.toml").read_text("utf-8"))
    return {
        name: {key: read(x, "rad") if isinstance(x, str) else x for key, x in design.items()}
        for name, design in tables.items()
    }


def study_text(name: str, family: Family, schema: str, drawn: Mapping[str, float] | None = None) -> str:
    """Return a study.toml that passes `sweep check`; ``schema`` is the path of its JSON schema, relative to the file.

    With a design read from a drawing [mm, rad] the study is about that design, which is also its reference.
    """
    if isinstance(family, Machine):
        return _machine_text(name, family, schema)
    wanted = wanted_outputs(family)
    return str(
        rendered(
            "first_study.toml.j2",
            name=name,
            family=family,
            names=_names(family),
            schema=schema,
            mechanism=mechanism_line(family),
            wanted=json.dumps(wanted),
            design=design_lines(family, swept_names(family), drawn),
            limits=limit_lines(family),
            goal=goal_of(wanted),
            march=isinstance(family.domain, March),
            crank=not isinstance(family.domain, Interval),
            reference=drawn and toml({"reference": {"design": design_entries(family, drawn)}}),
        )
    )


def smoke_text(family: Family) -> str:
    """Return the text of the study's tiny version."""
    few = {"count": 2}
    design: dict[str, Any] = dict.fromkeys(swept_names(family), few)
    if isinstance(family, Machine):
        design = {name: dict.fromkeys(names, few) for name, names in _swept_of(family).items()}
    return f"# The same question with few designs.\n{toml({'design': design})}"


def _machine_text(name: str, machine: Machine, schema: str) -> str:
    """Return the study of several mechanisms on one shaft, with one dimension of two of them swept."""
    wanted = {m.name: wanted_outputs(m.family)[-OF_EACH:] for m in machine.members}
    last, relations = machine.members[-1].name, _relations(machine)
    text = rendered(
        "first_machine.toml.j2",
        name=name,
        schema=schema,
        members=machine.members,
        swept=_swept_of(machine),
        mechanism_line=mechanism_line,
        design_lines=design_lines,
        limit_lines=limit_lines,
        apart=APART,
        relations=[line for line, _ in relations],
        wanted=json.dumps(
            [*(x for _, x in relations), *(f"{m}.{x}" for m, outputs in wanted.items() for x in outputs)]
        ),
        last_relation=relations[-1][1],
        goal=f"{last}.{goal_of(wanted[last])}",
    )
    return f"{text}\n"


def _swept_of(machine: Machine) -> dict[str, list[str]]:
    """Return the swept parameters of the first two members, one dimension each."""
    return {m.name: swept_names(m.family)[:1] for m in machine.members[:2]}


def _relations(machine: Machine) -> list[tuple[str, str]]:
    """Return relations and their outputs: a distance between neighbours with points, and the timing of neighbours."""
    relations = []
    for first, second in pairwise(machine.members):
        points = [f"{m.name}.{m.points[-1]}" for m in (first, second) if m.points]
        if len(points) == 2:
            relations.append((f"gap_{second.name} = {{ distance = {json.dumps(points)} }}", f"min_gap_{second.name}"))
        places = json.dumps([f"{m.name}.{_place(m.family)}" for m in (first, second)])
        relations.append((f"lag_{second.name} = {{ timing = {places} }}", f"lag_{second.name}"))
    return relations


def _place(family: Family) -> str:
    """Return the crank angle of the family's largest output, or of its largest acceleration if the follower turns."""
    turns = any(name.startswith("dwell_") for name in wanted_outputs(family))
    return f"phi_max_abs_d2{family.position}" if turns else f"phi_max_{family.position}"


def _names(family: Family) -> list[str]:
    return [stage.family.name for stage in family.stages]


def mechanism_line(family: Family) -> str:
    """Return the family, or the families of a chain."""
    names = _names(family)
    return f'family = "{names[0]}"' if len(names) == 1 else f"chain = {json.dumps(names)}"


def wanted_outputs(family: Family) -> list[str]:
    """Return the main outputs: size of the motion, pressure angle, what is made small; otherwise any outputs."""
    # For a chain the outputs of the whole come first, then those of the stages.
    offered = sorted((name for name in main_outputs(family) if not is_flag(name)), key=lambda name: parts(name).stage)
    dwells = [name for name in offered if parts(name).stem.startswith("dwell_")]
    if dwells:  # a follower with full turns has no limit positions
        offered = dwells + [name for name in offered if parts(name).stem not in (*FIRST, "stroke_ratio")]
    goals = [name for name in offered if name.startswith("max_abs_d2")][:1]
    goals += [OWN_GOALS[family.name]] if family.name in OWN_GOALS else []
    first = [name for name in offered if parts(name).stem in FIRST][: MOST_WANTED - len(goals)]
    chosen = [*first, *goals]
    return chosen + [name for name in offered if name not in chosen][: max(0, FEWEST_WANTED - len(chosen))]


def goal_of(wanted: list[str]) -> str:
    """Return the wanted output that is made small."""
    return next((name for goal in GOALS for name in wanted if parts(name).stem.startswith(goal)), wanted[-1])


def start_of(family: Family) -> Mapping[str, float]:
    """Return the design to begin with: a start, or the example at the size of a machine [mm; SI; rad]."""
    if family.name in first_designs():
        return first_designs()[family.name]
    if len(family.stages) > 1:
        own = {f"{name}{s.number}": x for s in family.stages for name, x in start_of(s.family).items()}
        return own | _offsets(family, own)
    scale, units = _scale(family), {p.name: p.unit for p in family.parameters}
    return {name: x * scale ** POWER.get(units[name], 0) for name, x in family.example.items()}


def _offsets(family: Family, start: Mapping[str, float]) -> dict[str, float]:
    """Return the angles between the stages of a chain whose motion is large, and its pressure angles small."""
    names, tried = [f"offset{s.number}" for s in family.stages[1:]], np.linspace(0.0, 2.0 * np.pi, OFFSETS, False)
    offsets = dict(zip(names, map(np.ravel, np.meshgrid(*[tried] * len(names))), strict=True))
    phi = np.linspace(0.0, 2.0 * np.pi, POSES, False)
    loops = [loop.pressure_angle for loop in family.every(Assembly)]
    poses = evaluate(_names(family), {**start, **offsets}, [family.position, *loops], phi=phi)
    motion, *pressure = (poses[name].to_numpy().reshape(-1, POSES) for name in (family.position, *loops))
    turns = family.pose_output[family.position].wraps
    margin = np.min([np.cos(angles).min(axis=1) ** 2 for angles in pressure], axis=0, initial=1.0)
    score = np.ptp(np.unwrap(motion) if turns else motion, axis=1) * margin
    return {name: float(values[np.nan_to_num(score).argmax()]) for name, values in offsets.items()}


def swept_names(family: Family) -> list[str]:
    """Return the first two swept dimensions: lengths that are not zero, or numbers if there are none."""
    example = family.example
    usable = [p for p in family.parameters if p.choices is None and example.get(p.name)]
    lengths = [p.name for p in usable if p.unit == "length"]
    return (lengths or [p.name for p in usable if p.unit in ("ratio", "none")] or [p.name for p in usable])[:SWEPT]


def design_lines(family: Family, swept: list[str], drawn: Mapping[str, float] | None = None) -> Iterator[str]:
    """Yield every parameter with its meaning: ``swept`` ones as ranges, those with a default as comments.

    Values are those of a start, or of a design ``drawn`` [mm, rad].
    """
    example = start_of(family) if drawn is None else drawn
    in_si = drawn is None and _in_si(family)
    for p in family.parameters:
        value = example.get(p.name, p.default)
        assert value is not None  # an example has every required parameter
        unit, factor = WRITTEN.get(p.unit, ((OTHERS | SI).get(p.unit, ""), 1.0))
        shown = math.degrees(value) if unit == "deg" else value * factor if in_si else value
        if p.name in swept:
            ends = sorted((shown * (1.0 - SPREAD), shown * (1.0 + SPREAD)))
            more = f', unit = "{unit}"' if unit else ""
            entry = f"{p.name} = {{ from = {ends[0]:.6g}, to = {ends[1]:.6g}, count = {COUNT}{more} }}"
        else:
            entry = f"{p.name} = " + (f'"{shown:.6g} {unit}"' if unit else f"{shown:g}")
        left_out = p.name not in example
        yield f"{'# ' if left_out else ''}{entry}".ljust(WIDTH) + f" # {described(p, left_out=' if left out')}"


def _in_si(family: Family) -> bool:
    return not {p.unit for p in family.parameters}.isdisjoint({"mass", "force", "stiffness", "torque"})


def _scale(family: Family) -> float:
    """Return the power of ten that scales the example, which has any unit, to the size of a machine."""
    if _in_si(family):
        return 1.0
    longest = max((abs(family.example.get(p.name, 0.0)) for p in family.parameters if p.unit == "length"), default=0.0)
    return 10.0 ** max(0, math.ceil(math.log10(LEAST_SIZE / longest))) if longest else 1.0


def limit_lines(family: Family) -> list[str]:
    """Return the full rotation as a limit, pressure angles as comments."""
    offered = main_outputs(family)
    flags = [f"{name} = true" for name in offered if is_flag(name)]
    angles = [name for name in offered if stem(name) == "max_pressure_angle"]
    return flags[:1] + [f'# {name} = {{ max = 45, unit = "deg" }}' for name in angles]
