"""The verb ``effects``: the register, one of its entries, or its page of the documentation."""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence
from itertools import groupby, takewhile
from typing import TypeAlias

import click

from sweep.cli.families import aligned, echo_columns
from sweep.effects import NAMES, effect
from sweep.effects.base import Effect
from sweep.errors import InputError, choices
from sweep.families.base import Output, Parameter
from sweep.pages import rendered
from sweep.quantities.units import internal_unit

Rows: TypeAlias = list[tuple[str, str, str]]  # names, unit, definition
COMPONENT = re.compile(r"_[xyz]{1,2}$")  # of a vector or a tensor
OF_COMPONENT = re.compile(r"^(?:magnitude|[xyz]): |: entry of the tensor, - integral [xyz] [xyz] dm")
ALONG = re.compile(r" along [xyz](?= of the fixed axes)")
REDUCED = re.compile(r"(?:(?:phi_)?(?:max_abs|max|min)|range|rms)_(?P<pose>.+)")


def complete_effects(context: click.Context, parameter: click.Parameter, incomplete: str) -> list[str]:
    """Complete an effect."""
    return [name for name in NAMES if name.startswith(incomplete)]


@click.command()
@click.argument("name", required=False, shell_complete=complete_effects)
@click.option("--markdown", is_flag=True, help="The whole register as docs/effects.md.")
def effects(name: str | None, markdown: bool) -> None:
    """List the effects a scene can call for, or explain one: outputs, inputs, cost, when it matters."""
    if markdown:
        click.echo(page(), nl=False)
        return
    if name is None:
        rows = [(e.name, e.key, "+".join(e.families), cost_words(e), e.title) for e in map(effect, NAMES)]
        echo_columns([("effect", "key", "families", "cost", ""), *rows])
        click.echo("\nwhat a scene wants of them, it names: a reduction such as max_force_c or rms_drive_torque, or a")
        click.echo("design output such as unevenness; `sweep effects NAME` lists outputs and inputs")
        return
    if name not in NAMES:
        raise InputError("effect", name, f"one of {choices(name, NAMES)}", "sweep effects")
    for line in explain(effect(name)):
        click.echo(line)


def cost_words(entry: Effect) -> str:
    """Return the measured cost in words."""
    words = [f"{entry.ns_per_pose:.0f} ns per pose"] if entry.ns_per_pose else []
    if entry.design_result:
        words.append(f"{entry.ns_per_design / 1000.0:.3g} us per design")
    return ", ".join(words)


def chain_words(entry: Effect) -> str:
    """Return which stages of a chain the effect can be asked of."""
    stages = "the first stage" if entry.even_crank else "any stage"
    return f"{stages}; the load of the stages behind it enters" if entry.takes_load else stages


def explain(entry: Effect) -> list[str]:
    """Return one effect in full, line by line."""
    about = {
        "families": ", ".join(entry.families),
        "in a chain": chain_words(entry),
        "needs": ", ".join(entry.needs) or "the motion",
        "kind": "whole turn: it couples the crank angles" if entry.whole_turn else "pointwise in the crank angle",
        "cost": cost_words(entry),
        "units": "of studies and datasets; in tables any consistent set",
        "called for": entry.called_for,
        "negligible": entry.negligible,
    }
    tables = {
        "outputs per pose (and their reductions max_abs_x, max_x, min_x, range_x, rms_x)": _output_rows(entry.outputs),
        "outputs per design": _design_rows(entry),
        "inputs": _input_rows(every_input(entry) if entry.inputs else ()),
    }
    lines = [f"{entry.name} ({entry.key}): {entry.title}", "", *aligned(about.items())]
    lines += ["", f"equations, {entry.equation}", *(f"  {formula}" for formula in entry.formulas)]
    return lines + [line for title, rows in tables.items() if rows for line in ("", title, *aligned(rows))]


def _output_rows(outputs: Iterable[Output]) -> Rows:
    return joined((o.name, internal_unit(o.unit), o.text, "") for o in outputs)


def _design_rows(entry: Effect) -> Rows:
    """Return outputs per design, but for reductions of outputs per pose."""
    poses = {o.name for o in entry.outputs}
    reduced = {o for o in entry.design_outputs if (found := REDUCED.fullmatch(o.name)) and found["pose"] in poses}
    return _output_rows(o for o in entry.design_outputs if o not in reduced)


def _input_rows(inputs: Iterable[Parameter]) -> Rows:
    return joined((p.name, internal_unit(p.unit), p.text, f" ({input_notes(p)})") for p in inputs)


def joined(rows: Iterable[tuple[str, str, str, str]]) -> Rows:
    """Make one row of the components of a vector or a tensor, which stand one below the other.

    Parameters
    ----------
    rows : name, unit, definition and what is said behind it
    """

    def vector(row: tuple[str, str, str, str]) -> tuple[str, str, str]:
        words = ALONG.sub(" along x, y, z", OF_COMPONENT.sub("", row[2]))
        return COMPONENT.sub("", row[0]), row[1], words

    out: Rows = []
    for (stem, unit, text), group in groupby(rows, key=vector):
        first, *others = group
        names = ", ".join([first[0], *(row[0].removeprefix(stem) for row in others)])
        notes: dict[str, list[str]] = {}
        for row in (first, *others):
            notes.setdefault(row[3], []).append(row[0].removeprefix(stem))
        if len(notes) == 1:
            out.append((names, unit, (text if others else first[2]) + first[3]))
        else:  # the entries of a tensor: those off its diagonal may have either sign
            said = "; ".join(", ".join(own) + note for note, own in notes.items())
            out.append((names, unit, f"{text}, off its diagonal - integral x y dm; {said}"))
    return out


def input_notes(p: Parameter) -> str:
    """Return what an input may be, and what it is where it is left out."""
    notes = [p.sign] if p.sign else []
    return ", ".join([*notes, f"{p.default:g} if left out" if p.default is not None else "required"])


def every_input(entry: Effect) -> tuple[Parameter, ...]:
    """Return inputs of an effect for whatever family, those of a tool behind its own."""
    return tuple(dict.fromkeys((*entry.inputs, *(p for tool in entry.tool_inputs for p in tool))))


def grouped(entries: Iterable[Effect]) -> list[list[Effect]]:
    """Gather the effects that are one and the same for several families: same equations, same reason to ask for it."""
    groups: dict[tuple[object, ...], list[Effect]] = {}
    for entry in entries:
        groups.setdefault((entry.formulas, entry.called_for, entry.negligible), []).append(entry)
    return list(groups.values())


def heading(group: Sequence[Effect]) -> str:
    """Return the words that the names of a group end with, or all its names."""
    names = [entry.name.split("_")[::-1] for entry in group]
    alike = takewhile(lambda words: len(set(words)) == 1, zip(*names, strict=False))
    return "_".join([words[0] for words in alike][::-1]) or ", ".join(entry.name for entry in group)


def parts(group: Sequence[Effect]) -> list[tuple[str, list[str], Rows]]:
    """Return the tables of a group: the kind, of whom (empty: of all its effects), and the rows.

    Inputs that an effect has from one that it needs are not said again.
    """
    known = [{p for name in entry.needs for p in every_input(effect(name))} for entry in group]
    kinds = {
        "output": [_output_rows(entry.outputs) for entry in group],
        "output per design": [_design_rows(entry) for entry in group],
        "input": [
            _input_rows(p for p in every_input(entry) if p not in old) for entry, old in zip(group, known, strict=True)
        ],
    }
    out: list[tuple[str, list[str], Rows]] = []
    for kind, tables in kinds.items():
        common = [row for row in tables[0] if all(row in table for table in tables)]
        out.append((kind, [], common))
        for entry, table in zip(group, tables, strict=True):
            out.append((kind, [entry.name], [row for row in table if row not in common]))
    return [part for part in out if part[2]]


def page() -> str:
    """Return docs/effects.md, made from the register."""
    entries = [effect(name) for name in NAMES]
    return str(
        rendered(
            "effects.md.j2",
            entries=entries,
            groups=grouped(entries),
            heading=heading,
            parts=parts,
            cost=cost_words,
            in_chain=chain_words,
        )
    )
