"""The text of a first study of a machine: several mechanisms on one shaft, a dimension of two of them swept."""

from __future__ import annotations

from collections.abc import Mapping
from itertools import pairwise

from sweep.cli.first_study import design_lines, limit_lines, mechanism_line, swept_names, wanted_outputs
from sweep.families.base import Family
from sweep.families.machines import Machine

APART = 10  # mm between the frames of two members, along z
OF_EACH = 2  # outputs of a member that are asked for


def machine_text(name: str, machine: Machine, schema: str) -> str:
    """Return a study.toml that passes `sweep check`; ``schema`` is where its JSON schema lies, seen from the file."""
    members = {m.name: m.family for m in machine.members}
    wanted = {member: wanted_outputs(family)[-OF_EACH:] for member, family in members.items()}
    last = machine.members[-1].name
    goal = next((w for w in wanted[last] if w.startswith("max_abs_d2")), wanted[last][-1])
    relations, between = _relations(machine)
    asked = [*between, *(f"{member}.{output}" for member, outputs in wanted.items() for output in outputs)]
    lines = [
        f"#:schema {schema}",
        f"# A first study of a machine: {', '.join(members)} on one main shaft.",
        f"# sweep check {name}          what it will compute, and what that costs",
        f"# sweep run {name}            results/{name}/designs",
        f"# sweep report results/{name}/designs",
        "# What members and relations may say: docs/machines.md.  What may stand elsewhere: docs/study-files.md",
        "",
        "[study]",
        f'name = "{name}"',
        f'title = "First look at {" and ".join(members)}"',
        'question = "What do small changes of a dimension of two members do?"',
        "",
        *_members(members),
        "# What members have with each other: distance, speed, timing, event, value, torque, shaking.",
        "[relations]",
        *relations,
        "",
        "[scene]",
        '# speed = "3000 rpm"                       # of the main shaft: for accelerations in time, and for loads',
        f"want = [{', '.join(_quoted(w) for w in asked)}]",
        "",
        "# One value as a text with its unit; several as { values = [...], unit = ... } or { from, to, count, unit }.",
    ]
    for member, family in members.items():
        lines += [f"[design.{member}]", *design_lines(family, swept_of(members, member)), ""]
    lines.append("# Designs beyond a limit are counted and dropped: { min = ..., max = ..., unit = ... }, or true.")
    lines += [
        f'# {between[-1]} = {{ min = -30, max = 30, unit = "deg" }}   # in [limits], as all that has no member',
        "",
    ]
    for member, family in members.items():
        lines += [f"[limits.{member}]", *limit_lines(family), ""]
    lines += [
        "[objective]",
        f'minimise = "{last}.{goal}"',
        "",
        "[accuracy]",
        "target = 1e-8                              # relative error of extrema over the turn",
        "",
        "# Search the best design between the swept ones, from this many of them:",
        "# [optimise]",
        "# starts = 12",
    ]
    return "\n".join(lines) + "\n"


def machine_smoke_text(machine: Machine) -> str:
    """Return the tiny version beside it."""
    members = {m.name: m.family for m in machine.members}
    lines = ["# The same question with few designs."]
    for member in members:
        names = swept_of(members, member)
        lines += [f"[design.{member}]", *(f"{name} = {{ count = 2 }}" for name in names)] if names else []
    return "\n".join(lines) + "\n"


def swept_of(members: Mapping[str, Family], member: str) -> list[str]:
    """Return what is swept of a member: a dimension each of the first two."""
    return swept_names(members[member])[:1] if member in list(members)[:2] else []


def _members(members: Mapping[str, Family]) -> list[str]:
    lines = []
    for k, (member, family) in enumerate(members.items()):
        place = f'place = {{ at = ["0 mm", "0 mm", "{k * APART} mm"], axis = [0, 0, 1], zero = [1, 0, 0] }}'
        lines += [
            f"[machine.{member}]  # {family.title}",
            mechanism_line(family),
            f"{place}   # origin, z and x of its frame in the machine's",
            '# offset = "180 deg"                       # its crank angle where the main shaft stands at 0',
            "# ratio = 2                                # whole turns of its crank for one of the main shaft",
            "",
        ]
    return lines


def _relations(machine: Machine) -> tuple[list[str], list[str]]:
    """Lines of the table and the outputs that they give: a distance where two neighbours have points, their timing."""
    lines, outputs = [], []
    for one, other in pairwise(machine.members):
        points = [f"{m.name}.{m.points[-1]}" for m in (one, other) if m.points]
        if len(points) == 2:
            lines.append(f"gap_{other.name} = {{ distance = [{', '.join(map(_quoted, points))}] }}")
            outputs.append(f"min_gap_{other.name}")
        places = [f"{m.name}.{_place(m.family)}" for m in (one, other)]
        lines.append(f"lag_{other.name} = {{ timing = [{', '.join(map(_quoted, places))}] }}")
        outputs.append(f"lag_{other.name}")
    return lines, outputs


def _place(family: Family) -> str:
    """Crank angle at which the family's output is largest; of what turns on and on, its acceleration."""
    turns = any(name.startswith("dwell_") for name in wanted_outputs(family))
    return f"phi_max_abs_d2{family.position}" if turns else f"phi_max_{family.position}"


def _quoted(text: str) -> str:
    return f'"{text}"'
