"""The verbs that need no data: families, cache."""

from __future__ import annotations

import shutil
from collections.abc import Iterable, Sequence
from typing import TYPE_CHECKING

import click

from sweep.cli import completion

if TYPE_CHECKING:
    from sweep.families.base import Family


ANGLES = click.option(
    "--angles",
    type=click.Choice(["rad", "deg"]),
    help="Unit of the angles in TABLE; a header such as `alpha [deg]` says it of one column. Default: rad.",
)


def family_names(text: str) -> str | list[str]:
    """Read ``rssr`` as a family, ``rssr+guide`` or ``rssr,guide`` as a chain of two."""
    from sweep.families import chain_names

    names = chain_names(text)
    return list(names) if len(names) > 1 else names[0]


@click.command()
@click.argument("name", required=False, shell_complete=completion.families)
def families(name: str | None) -> None:
    """List the mechanism families, or the parameters and outputs of one (or of a chain: rssr+guide)."""
    from sweep.families import NAMES, family

    if name is None:
        found = [family(known) for known in NAMES]
        rows = [(entry.name, over(entry), entry.title, ", ".join(capability_words(entry))) for entry in found]
        echo_columns([("family", "over", "", "can be asked for"), *rows])
        click.echo("\nchains: any of them in series, such as rssr+guide; `sweep families NAME` shows what one takes")
        return
    for line in describe(family(family_names(name))):
        click.echo(line)


def over(family: Family) -> str:
    """Say in a word or two over what a family is evaluated."""
    domain = family.domain
    return domain.kind if domain.kind != "interval" else f"interval of {domain.name}"


def capability_words(family: Family) -> list[str]:
    """Return what a family can be asked for besides its motion."""
    from sweep.families.capabilities import (
        Assembly,
        CrankRockerLoop,
        GuidedPoint,
        JointRecords,
        LimitLocus,
        OutputLink,
        Points,
        PressureEllipse,
        ProvableLocus,
    )
    from sweep.families.link_tree import LinkTree

    words = [
        (Assembly, "rotatability"),
        (JointRecords, "loads"),
        (LinkTree, "loads"),
        (PressureEllipse, "pressure extrema"),
        (CrankRockerLoop, "proofs"),
        (LimitLocus, "limit locus"),
        (ProvableLocus, "proven optimum"),
        (GuidedPoint, "line fit"),
        (Points, "points"),
        (OutputLink, "tip"),
    ]
    return [word for kind, word in words if family.find(kind) is not None]


def describe(family: Family) -> list[str]:
    """Return parameters, pose outputs and design outputs of a family with their units, one per line."""
    from sweep.evaluation.summaries import output
    from sweep.families.capabilities import Points
    from sweep.quantities.reduction import prefixes

    lines = [f"{family.name}: {family.title}", "", f"over: {over(family)}"]
    if words := capability_words(family):
        lines.append(f"can be asked for: {', '.join(words)}")
    if points := [name for found in family.every(Points) for name in found.at]:
        lines.append(f"points: {', '.join(points)}")
    lines += ["", "parameters (one length unit throughout, angles in rad)"]
    parameters = []
    for p in family.parameters:
        notes = [p.sign] if p.sign else []
        notes += [p.choice] if p.choices else []
        notes += [f"default {p.default:g}"] if p.default is not None else []
        parameters.append((p.name, p.unit, p.text + (f" ({', '.join(notes)})" if notes else "")))
    lines += aligned(parameters)
    lines += ["", "pose outputs (sweep eval)"]
    lines += aligned([(o.name, o.unit, o.text) for o in family.pose_outputs])
    lines += ["", "design outputs (sweep summarise, and [scene] want of a study)"]
    lines += aligned([(o.name, o.unit, o.text) for o in (output(family, n) for n in main_outputs(family))])
    lines += [f"  and of any pose output x: {', '.join(f'{prefix}x' for prefix in prefixes(family.domain))}"]
    return lines


def main_outputs(family: Family) -> list[str]:
    """Return design outputs but for the reductions of every pose output,
    of which only those a designer asks for first.
    """
    from sweep.evaluation.summaries import output_names
    from sweep.families.capabilities import Assembly
    from sweep.families.members import Machine
    from sweep.quantities.reduction import prefixes
    from sweep.reductions.events import event_names

    if isinstance(family, Machine):
        members = [f"{m.name}.{name}" for m in family.members for name in main_outputs(m.family)]
        between = [f"min_{r.outputs[0].name}" for r in family.relations] + [t.name for t in family.timings]
        between += [name for event in family.events for name in event_names(family, event)]
        return [*members, *between]
    general = {f"{prefix}{name}" for prefix in prefixes(family.domain) for name in family.pose_names}
    first = {f"max_abs_{name}" for name in family.derivative_of.values()}
    first |= {f"max_abs_{o.name}" for o in family.pose_outputs if o.windowed}
    first |= {f"max_{loop.pressure_angle}" for loop in family.every(Assembly)}
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


@click.group()
def cache() -> None:
    """Manage the compiled kernels that are kept on disk."""


@cache.command()
def clear() -> None:
    """Remove the compiled kernels of every version; they are compiled anew when needed.

    Files cut short are noticed and made anew; this is the cure for any other damage, and makes room.
    """
    from kernels._cache import cache_root

    root = cache_root()
    if not root.exists():
        click.echo(f"nothing to remove: {root} does not exist")
        return
    shutil.rmtree(root)
    click.echo(f"removed {root}")
