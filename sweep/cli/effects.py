"""The verb ``effects``: the register, one of its entries, or its page of the documentation."""

from __future__ import annotations

import click

from sweep.cli.families import aligned, echo_columns
from sweep.effects import NAMES, effect
from sweep.effects.base import Effect
from sweep.errors import InputError, choices
from sweep.families.base import Output, Parameter
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
    lines = [f"{entry.name} ({entry.key}): {entry.title}", ""]
    kind = "whole turn: it couples the crank angles" if entry.whole_turn else "pointwise in the crank angle"
    lines += aligned(
        [
            ("families", ", ".join(entry.families)),
            ("in a chain", chain_words(entry)),
            ("needs", ", ".join(entry.needs) or "the motion"),
            ("kind", kind),
            ("cost", cost_words(entry)),
            ("units", "of studies and datasets; in tables any consistent set"),
            ("called for", entry.called_for),
            ("negligible", entry.negligible),
        ]
    )
    lines += ["", "equations", *(f"  {formula}" for formula in entry.formulas)]
    if entry.outputs:
        lines += ["", "outputs per pose (and their reductions max_abs_x, max_x, min_x, range_x, rms_x)"]
        lines += aligned(_output_rows(entry.outputs))
    if entry.design_result:
        lines += ["", "outputs per design"]
        lines += aligned(_output_rows(entry.design_result.outputs))
    if entry.inputs:
        lines += ["", "inputs"]
        lines += aligned([(p.name, internal_unit(p.unit), input_words(p)) for p in every_input(entry)])
    return lines


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
    entries = [effect(name) for name in NAMES]
    lines = [
        "# Effects",
        "",
        "Made from the register (`sweep/effects/`) by `make docs`. A scene names what it wants; only the effects that",
        "some wanted name belongs to are computed, with what they need. Equations: Polukhin (1971), chapters I and",
        "III, as corrected, and standard mechanics; what is marked ours the source does not give. A, B, C, D are crank",
        "centre, crank pin, driven joint, rocker centre; (rho_B, tau_B, u) and (rho, tau, k) the triads of crank and",
        "follower, s the unit vector from B to C.",
        "",
        "In a chain inputs and outputs carry the number of their stage (`m_crank2`, `force_c2`), `speed` and",
        "`speed_change` that of the first; a later stage turns as the one before drives it, and its driving torque",
        "loads that one. A negative `speed` turns the crank backwards: friction and piercing forces turn with it,",
        "poses and phi do not; unevenness, lives and frequencies are of its magnitude. A tool (`m_tool` and its",
        "force: docs/tool.md) at the guided point of a `guide`, at the coupler point of a `four_bar`, at the tip of",
        "another rocker or at the working point of a looper loads the joints and the stages before. What is not",
        "listed for a family the theory does not give: geared dwells have no effects, sliders no shaft bearings.",
        "",
        "Units are any consistent set; in studies and datasets mm, t, s, hence N, N mm, MPa. Costs are measured on one",
        "core (`make bench`), each effect alone with all its outputs, the motion it needs not counted.",
        "",
        "| effect | key | families | what | needs | cost |",
        "|---|---|---|---|---|---|",
    ]
    for e in entries:
        needs = ", ".join(e.needs) or "motion"
        lines.append(f"| `{e.name}` | {e.key} | {', '.join(e.families)} | {e.title} | {needs} | {cost_words(e)} |")
    for e in entries:
        kind = "Whole turn: it couples the crank angles." if e.whole_turn else "Pointwise in the crank angle."
        lines += ["", f"## {e.name}", "", f"{e.title[0].upper()}{e.title[1:]}. {kind}", ""]
        lines += [*(f"    {line}" for line in e.formulas), ""]
        lines += [f"Families: {', '.join(e.families)}; in a chain {chain_words(e)}.", ""]
        lines += [f"Called for: {e.called_for}.", "", f"Negligible: {e.negligible}.", ""]
        outputs = [*e.outputs, *(e.design_result.outputs if e.design_result else ())]
        lines += ["| output | unit | definition | equation |", "|---|---|---|---|"]
        per_design = {o.name for o in e.design_result.outputs} if e.design_result else set()
        for o in outputs:
            per = " (per design)" if o.name in per_design else ""
            lines.append(f"| `{o.name}` | {internal_unit(o.unit)} | {_cell(o.text)}{per} | {o.equation} |")
        if e.inputs:
            lines += ["", "| input | unit | definition |", "|---|---|---|"]
            lines += [f"| `{p.name}` | {internal_unit(p.unit)} | {_cell(input_words(p))} |" for p in every_input(e)]
    return "\n".join(lines) + "\n"


def _cell(text: str) -> str:
    return text.replace("|", "\\|")
