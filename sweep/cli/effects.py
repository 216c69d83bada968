"""The verb ``effects``: the register, one of its entries, or its page of the documentation."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import click

from sweep.cli.families import aligned, echo_columns
from sweep.effects import NAMES, effect
from sweep.effects.base import Effect
from sweep.errors import InputError, choices
from sweep.families.base import Output, Parameter
from sweep.pages import rendered
from sweep.quantities.units import internal_unit


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
    result = entry.design_result.outputs if entry.design_result else ()
    tables: dict[str, Iterable[Sequence[str]]] = {
        "outputs per pose (and their reductions max_abs_x, max_x, min_x, range_x, rms_x)": _output_rows(entry.outputs),
        "outputs per design": _output_rows(result),
        "inputs": [
            (p.name, internal_unit(p.unit), input_words(p)) for p in (every_input(entry) if entry.inputs else ())
        ],
    }
    lines = [f"{entry.name} ({entry.key}): {entry.title}", "", *aligned(about.items())]
    lines += ["", "equations", *(f"  {formula}" for formula in entry.formulas)]
    return lines + [line for title, rows in tables.items() if rows for line in ("", title, *aligned(rows))]


def _output_rows(outputs: tuple[Output, ...]) -> list[tuple[str, str, str, str]]:
    return [(o.name, internal_unit(o.unit), o.text, o.equation) for o in outputs]


def input_words(p: Parameter) -> str:
    """Return the definition of an input with what it may be."""
    notes = [p.sign] if p.sign else []
    notes += [f"{p.default:g} if left out" if p.default is not None else "required"]
    return f"{p.text} ({', '.join(notes)})"


def every_input(entry: Effect) -> tuple[Parameter, ...]:
    """Return inputs of an effect for whatever family, those of a tool behind its own."""
    return tuple(dict.fromkeys((*entry.inputs, *(p for tool in entry.tool_inputs for p in tool))))


def page() -> str:
    """Return docs/effects.md, made from the register."""
    return str(
        rendered(
            "effects.md.j2",
            entries=[effect(name) for name in NAMES],
            unit=internal_unit,
            cost=cost_words,
            in_chain=chain_words,
            every_input=every_input,
            input_words=input_words,
        )
    )
