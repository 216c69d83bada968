"""The verb ``effects``: the register, or one of its entries."""

from __future__ import annotations

import re
from collections.abc import Iterable
from itertools import groupby
from typing import TypeAlias

import click

from sweep.cli.families import aligned, echo_columns
from sweep.effects import NAMES, effect
from sweep.effects.base import Effect
from sweep.errors import InputError, choices
from sweep.families.base import Output, Parameter
from sweep.quantities.units import internal_unit

Rows: TypeAlias = list[tuple[str, str, str]]  # names, unit, definition
COMPONENT = re.compile(r"_[xyz]{1,2}$|[xyz](?=_p$)")  # of a vector or a tensor, or of the point of a coupler
OF_COMPONENT = re.compile(r"^(magnitude: |[xyz]: |[xyz] of (the )?)|: entry of the tensor, - integral [xyz] [xyz] dm")
ALONG = re.compile(r" along [xyz](?= of the fixed axes| per unit|$)")
REDUCED = re.compile(r"(?:(?:phi_)?(?:max_abs|max|min)|range|rms)_(?P<pose>.+)")


def complete_effects(context: click.Context, parameter: click.Parameter, incomplete: str) -> list[str]:
    """Complete the name of an effect."""
    return [name for name in NAMES if name.startswith(incomplete)]


@click.command()
@click.argument("name", required=False, shell_complete=complete_effects)
def effects(name: str | None) -> None:
    """List the effects a scene can call for, or explain one: outputs, inputs, cost, when it matters."""
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
        us = entry.ns_per_design / 1000.0
        words.append(f"{us:.3g} us per design" if us < 1000.0 else f"{us / 1000.0:.3g} ms per design")
    return ", ".join(words)


def chain_words(entry: Effect) -> str:
    """Return the stages of a chain for which the effect is available, in words."""
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
        "outputs per pose (and their reductions max_abs_x, max_x, min_x, range_x, rms_x)": output_rows(entry.outputs),
        "outputs per design": design_rows(entry),
        "inputs": input_rows(every_input(entry) if entry.inputs else ()),
    }
    lines = [f"{entry.name} ({entry.key}): {entry.title}", "", *aligned(about.items())]
    lines += ["", f"equations, {entry.equation}", *(f"  {formula}" for formula in entry.formulas)]
    return lines + [line for title, rows in tables.items() if rows for line in ("", title, *aligned(rows))]


def output_rows(outputs: Iterable[Output]) -> Rows:
    """Return names, unit and definition of outputs, vectors in one row each."""
    return joined((o.name, internal_unit(o.unit), o.text, "") for o in outputs)


def design_rows(entry: Effect) -> Rows:
    """Return the outputs per design, except reductions of outputs per pose."""
    poses = {o.name for o in entry.outputs}
    reduced = {o for o in entry.design_outputs if (found := REDUCED.fullmatch(o.name)) and found["pose"] in poses}
    return output_rows(o for o in entry.design_outputs if o not in reduced)


def input_rows(inputs: Iterable[Parameter]) -> Rows:
    """Return names, unit and definition of inputs with their ranges, vectors in one row each."""
    return joined((p.name, internal_unit(p.unit), p.text, f" ({input_notes(p)})") for p in inputs)


def joined(rows: Iterable[tuple[str, str, str, str]]) -> Rows:
    """Merge the components of a vector or a tensor, which are consecutive rows, into one row.

    Parameters
    ----------
    rows : name, unit, definition and note of each component
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
            signs = "; ".join(", ".join(components) + note for note, components in notes.items())
            out.append((names, unit, f"{text}, off its diagonal - integral x y dm; {signs}"))
    return out


def input_notes(p: Parameter) -> str:
    """Describe the range of an input, and its default."""
    notes = [p.sign] if p.sign else []
    return ", ".join([*notes, f"default {p.default:g}" if p.default is not None else "required"])


def every_input(entry: Effect) -> tuple[Parameter, ...]:
    """Return the inputs of an effect for any family, those of a tool after its own."""
    return tuple(dict.fromkeys((*entry.inputs, *(p for tool in entry.tool_inputs for p in tool))))
