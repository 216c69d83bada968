"""The text of a first study of a mechanism: its own example, two parameters swept, every table explained."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping

from sweep.cli.families import main_outputs
from sweep.families.base import Family, Parameter
from sweep.families.chain import Chain, stages_of
from sweep.families.domain import March
from sweep.families.names import is_flag, parts, stem
from sweep.study.written import design_entries, toml

# Units of the examples by unit word.  Those with forces or masses are in SI, the others in any length unit.
SI = {
    "length": "m", "1/length": "1/m", "mass": "kg", "line_mass": "kg/m", "inertia": "kg*m^2", "force": "N",
    "torque": "N*m", "pressure": "N/m^2", "stiffness": "N/m", "damping": "N*s/m", "acceleration": "m/s^2",
}  # fmt: skip
LENGTHS = {"length": "mm", "1/length": "1/mm"}
POWER = {"length": 1, "1/length": -1}
OTHERS = {"speed": "rad/s", "angular_acceleration": "rad/s^2", "time": "s", "angle": "deg"}
PURE = ("ratio", "sign", "count", "none", "choice")
SPREAD, COUNT = 0.05, 5  # of the swept parameters: part of the example's value to either side, values
SWEPT = 2
LEAST_SIZE = 20.0  # mm, of the longest dimension of what stands in a machine
FIRST = ("swing", "stroke", "margin", "max_pressure_angle", "dwell_angle", "dwell_deviation")
FEWEST_WANTED, MOST_WANTED = 3, 5
WIDTH = 56  # column of the explanations


def study_text(name: str, family: Family, schema: str, drawn: Mapping[str, float] | None = None) -> str:
    """Return a study.toml that passes `sweep check`; ``schema`` is where its JSON schema lies, seen from the file.

    With the design of a drawing [mm, rad] it is about that design, and the design is its reference.
    """
    wanted = wanted_outputs(family)
    goal = next((w for w in wanted if w.startswith("max_abs_d2")), wanted[-1])
    lines = [
        f"#:schema {schema}",
        f"# A first study of {family.name}: {family.title}.",
        f"# sweep check {name}          what it will compute, and what that costs",
        f"# sweep run {name}            results/{name}/designs",
        f"# sweep report results/{name}/designs",
        "# What may stand here: docs/study-files.md.  What the mechanism can be asked: "
        f"sweep families {'+'.join(_names(family))}",
        "",
        "[study]",
        f'name = "{name}"',
        f'title = "First look at {family.name}"',
        'question = "What do small changes of two dimensions do?"',
        "",
        "[mechanism]",
        mechanism_line(family),
        "",
        "[scene]",
        '# speed = "3000 rpm"                       # for accelerations in time, and for loads',
        f"want = [{', '.join(f'{w!r}' for w in wanted)}]".replace("'", '"'),
        "",
        "# One value as a text with its unit; several as { values = [...], unit = ... } or { from, to, count, unit }.",
        "[design]",
        *design_lines(family, swept_names(family), drawn),
        "",
        "# Designs beyond a limit are counted and dropped: { min = ..., max = ..., unit = ... }, or true.",
        "[limits]",
        *limit_lines(family),
        "",
        "[objective]",
        f'minimise = "{goal}"',
        "",
        "[accuracy]",
        *(
            ["samples = 720                              # crank angles; this mechanism has a history, so no accuracy"]
            if isinstance(family.domain, March)
            else ["target = 1e-8                              # relative error of extrema over the turn"]
        ),
        "",
        "# Search the best design between the swept ones, from this many of them:",
        "# [optimise]",
        "# starts = 12",
        "",
        "# What making it inaccurately does to the optimum:",
        "# [tolerance]",
        '# lengths = "0.02 mm"',
    ]
    reference = {} if drawn is None else {"reference": {"design": design_entries(family, drawn)}}
    return "\n".join([*lines, "", toml(reference)] if reference else [*lines, ""])


def smoke_text(family: Family) -> str:
    """Return the tiny version beside it."""
    return "# The same question with few designs.\n[design]\n" + "".join(
        f"{name} = {{ count = 2 }}\n" for name in swept_names(family)
    )


def _names(family: Family) -> list[str]:
    return [stage.family.name for stage in stages_of(family)]


def mechanism_line(family: Family) -> str:
    """Return the family, or the families of a chain."""
    names = _names(family)
    if len(names) == 1:
        return f'family = "{names[0]}"'
    return f"chain = [{', '.join(f'{name!r}' for name in names)}]".replace("'", '"')


def _example(family: Family) -> dict[str, float]:
    """Return the examples of the stages under the names of the chain."""
    stages = stages_of(family)
    if not isinstance(family, Chain):
        return dict(family.example)
    return {f"{name}{stage.number}": value for stage in stages for name, value in stage.family.example.items()}


def wanted_outputs(family: Family) -> list[str]:
    """List what a designer asks first: size of the motion, pressure angle, greatest acceleration; else any output."""
    # Of a chain first what it does as a whole, then the stages.
    offered = sorted((name for name in main_outputs(family) if not is_flag(name)), key=lambda name: parts(name).stage)
    dwells = [name for name in offered if parts(name).stem.startswith("dwell_")]
    if dwells:  # what turns on and on has no limit positions
        offered = dwells + [name for name in offered if parts(name).stem not in (*FIRST, "stroke_ratio")]
    bends = [name for name in offered if name.startswith("max_abs_d2")][:1]
    first = [name for name in offered if parts(name).stem in FIRST][: MOST_WANTED - len(bends)]
    chosen = [*first, *bends]
    return chosen + [name for name in offered if name not in chosen][: max(0, FEWEST_WANTED - len(chosen))]


def swept_names(family: Family) -> list[str]:
    """Return the first two dimensions: lengths that are not zero, or any numbers where there are none."""
    example = _example(family)
    usable = [p for p in family.parameters if p.choices is None and example.get(p.name)]
    lengths = [p.name for p in usable if p.unit == "length"]
    return (lengths or [p.name for p in usable if p.unit in ("ratio", "none")] or [p.name for p in usable])[:SWEPT]


def design_lines(family: Family, swept: list[str], drawn: Mapping[str, float] | None = None) -> Iterator[str]:
    """Yield every parameter with its meaning: ``swept`` ones as ranges, those with a default as comments.

    Values are those of the example, or of a design that was ``drawn`` [mm, rad].
    """
    example = _example(family) if drawn is None else drawn
    given = {p.unit for p in family.parameters}
    si = bool(given & {"mass", "force", "stiffness", "torque"})
    units = OTHERS | (SI if si else LENGTHS)
    scale = 1.0 if si or drawn is not None else _scale(family, example)
    for p in family.parameters:
        value = example.get(p.name, p.default)
        assert value is not None  # an example has every parameter that must be given
        unit = units.get(p.unit, "")
        shown = math.degrees(value) if unit == "deg" else value * scale ** POWER.get(p.unit, 0)
        if p.name in swept:
            ends = sorted((shown * (1.0 - SPREAD), shown * (1.0 + SPREAD)))
            more = f', unit = "{unit}"' if unit else ""
            entry = f"{p.name} = {{ from = {ends[0]:.6g}, to = {ends[1]:.6g}, count = {COUNT}{more} }}"
        else:
            entry = f"{p.name} = " + (f'"{shown:.6g} {unit}"' if unit else f"{shown:g}")
        left_out = p.name not in example
        yield f"{'# ' if left_out else ''}{entry}".ljust(WIDTH) + f" # {_words(p)}"


def _scale(family: Family, example: Mapping[str, float]) -> float:
    """Return the power of ten by which the example, which is in any unit, becomes as large as a machine's."""
    longest = max((abs(example.get(p.name, 0.0)) for p in family.parameters if p.unit == "length"), default=0.0)
    return 10.0 ** max(0, math.ceil(math.log10(LEAST_SIZE / longest))) if longest else 1.0


def _words(p: Parameter) -> str:
    notes = [p.sign] if p.sign else []
    notes += [p.choice] if p.choices else []
    notes += [f"{p.default:g} if left out"] if p.default is not None else []
    return p.text + (f" ({', '.join(notes)})" if notes else "")


def limit_lines(family: Family) -> list[str]:
    """Return the full rotation as a limit, pressure angles as comments."""
    offered = main_outputs(family)
    flags = [f"{name} = true" for name in offered if is_flag(name)]
    angles = [name for name in offered if stem(name) == "max_pressure_angle"]
    return flags[:1] + [f'# {name} = {{ max = 45, unit = "deg" }}' for name in angles]
