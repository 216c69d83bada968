"""The verb ``families``, and shell completion of families, chains and outputs."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import click

from sweep.errors import LinksweepError
from sweep.evaluation.summaries import output, output_names
from sweep.families import NAMES, capabilities, chain_names, family
from sweep.families.base import Family, Parameter
from sweep.families.link_tree import LinkTree
from sweep.families.machines.machine import Machine
from sweep.families.reduction import prefixes
from sweep.quantities.resolve import event_names

CAPABILITIES = (
    (capabilities.Assembly, "rotatability"),
    (capabilities.JointRecords, "loads"),
    (LinkTree, "loads"),
    (capabilities.PressureEllipse, "pressure extrema"),
    (capabilities.CrankRockerLoop, "proofs"),
    (capabilities.LimitLocus, "limit locus"),
    (capabilities.ProvableLocus, "proven optimum"),
    (capabilities.GuidedPoint, "line fit"),
    (capabilities.OutputLink, "tip"),
)


def family_names(text: str) -> str | list[str]:
    """Return the family of ``rssr``, or the families of a chain: ``rssr+guide`` or ``rssr,guide``."""
    names = chain_names(text)
    return list(names) if len(names) > 1 else names[0]


def complete_families(context: click.Context, parameter: click.Parameter, incomplete: str) -> list[str]:
    """Complete a family, and after a + the next stage of a chain."""
    before, plus, last = incomplete.rpartition("+")
    return [f"{before}{plus}{name}" for name in NAMES if name.startswith(last)]


def complete_outputs(context: click.Context, parameter: click.Parameter, incomplete: str) -> list[str]:
    """Complete an output of the FAMILY given before, and after a comma the next one."""
    # If an option still lacks its value, click leaves the arguments before it unread.
    given = context.params.get("family") or next(iter(context.args), None)
    if given is None:
        return []
    try:
        entry = family(family_names(given))
    except LinksweepError:
        return []  # a misspelt family is reported when the command runs
    names = list(entry.pose_names) if context.command.name == "eval" else main_outputs(entry)
    before, comma, last = incomplete.rpartition(",")
    return [f"{before}{comma}{name}" for name in names if name.startswith(last)]


@click.command()
@click.argument("name", required=False, shell_complete=complete_families)
def families(name: str | None) -> None:
    """List the mechanism families, or the parameters and outputs of one (or of a chain: rssr+guide)."""
    if name is None:
        entries = [family(known) for known in NAMES]
        rows = [(entry.name, domain_words(entry), entry.title, ", ".join(capability_words(entry))) for entry in entries]
        echo_columns([("family", "over", "", "can be asked for"), *rows])
        click.echo("\nchains: any of them in series, such as rssr+guide; `sweep families NAME` shows what one takes")
        return
    for line in describe(family(family_names(name))):
        click.echo(line)


def domain_words(family: Family) -> str:
    """Name the domain over which a family is evaluated."""
    domain = family.domain
    return domain.kind if domain.kind != "interval" else f"interval of {domain.name}"


def capability_words(family: Family) -> list[str]:
    """List in words the capabilities of a family besides its motion."""
    return [*(word for kind, word in CAPABILITIES if family.find(kind) is not None), *["points"] * bool(family.points)]


def describe(family: Family) -> list[str]:
    """Return parameters, pose outputs and design outputs of a family with their units, one per line."""
    words = ", ".join(capability_words(family))
    points = ", ".join(family.points)
    outputs = [output(family, name) for name in main_outputs(family)]
    lines = [f"{family.name}: {family.title}", "", f"over: {domain_words(family)}"]
    lines += [f"can be asked for: {words}"] if words else []
    lines += [f"points: {points}"] if points else []
    lines += ["", "parameters (one length unit throughout, angles in rad)"]
    lines += aligned((p.name, p.unit, described(p, "default ")) for p in family.parameters)
    lines += ["", "pose outputs (sweep eval)"]
    lines += aligned((o.name, o.unit, o.text) for o in family.pose_outputs)
    lines += ["", "design outputs (sweep summarise, and [scene] want of a study)"]
    lines += aligned((o.name, o.unit, o.text) for o in outputs)
    return [*lines, f"  and of any pose output x: {', '.join(f'{prefix}x' for prefix in prefixes(family.domain))}"]


def described(p: Parameter, default: str = "", left_out: str = "") -> str:
    """Describe a parameter and its range; a default is put between the texts ``default`` and ``left_out``."""
    notes = [p.sign, p.choice if p.choices else "", "" if p.default is None else f"{default}{p.default:g}{left_out}"]
    remarks = ", ".join(filter(None, notes))
    return f"{p.text} ({remarks})" if remarks else p.text


def main_outputs(family: Family) -> list[str]:
    """Return the design outputs of a family, with only the main reductions of its pose outputs."""
    if isinstance(family, Machine):
        members = [f"{m.name}.{name}" for m in family.members for name in main_outputs(m.family)]
        between = [f"min_{o.name}" for r in family.relations for o in r.outputs[:1]] + [t.name for t in family.timings]
        between += [name for event in family.events for name in event_names(family, event)]
        return [*members, *between]
    general = {f"{prefix}{name}" for prefix in prefixes(family.domain) for name in family.pose_names}
    first = {f"max_abs_{name}" for name in family.derivative_of.values()}
    first |= {f"max_abs_{o.name}" for o in family.pose_outputs if o.windowed}
    first |= {f"max_{loop.pressure_angle}" for loop in family.every(capabilities.Assembly)}
    return [name for name in output_names(family) if name not in general or name in first]


def aligned(rows: Iterable[Sequence[str]]) -> list[str]:
    """Return rows of words as indented lines with aligned columns."""
    table = [tuple(row) for row in rows]
    if not table:
        return []
    widths = [max(len(row[k]) for row in table) for k in range(len(table[0]))]
    return ["  " + "  ".join(cell.ljust(w) for cell, w in zip(row, widths, strict=True)).rstrip() for row in table]


def echo_columns(rows: Iterable[Sequence[str]]) -> None:
    """Print rows of words as aligned columns."""
    for line in aligned(rows):
        click.echo(line)
