"""The verb ``check``: what a study would compute, how, and at what cost."""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path

import click
import numpy as np

from kernels.status import NOT_CONVERGED
from sweep.chunks.cascade import ordered_routes
from sweep.chunks.plan import PARAMETER_UNITS, Pilot, feasible_designs, pilot, spread_designs, spread_rows
from sweep.cli.families import aligned, main_outputs
from sweep.cli.options import SMOKE, STUDY
from sweep.effects.advice import findings, left_out, tree
from sweep.effects.loads import POINT
from sweep.engine.estimate import (
    LEAST_KEPT,
    Estimate,
    check_budget,
    compiling,
    duration,
    estimate,
    other_accuracies,
    searches,
    size,
)
from sweep.errors import grouped, how_many
from sweep.evaluation.statuses import meaning
from sweep.evaluation.summaries import design_outputs, output
from sweep.families.base import Angles, Array, Family
from sweep.families.curve_features import Crossing
from sweep.families.machines.machine import Machine
from sweep.families.names import parts, without_minus
from sweep.jobs.progress import Phases
from sweep.report.quantities import number, quantity
from sweep.report.tables import accuracy_words, bound_words
from sweep.study import Study, load_study
from sweep.study.loads import speeds
from sweep.study.space import Axis

# Poses per design for the shares of the effects, and number of designs on which their rules are tested.
POSES = 100.0
ADVISED = 64
TRIED = 12  # designs whose outputs are computed, as a design with effects may take 0.1 s
TURN = np.arange(720.0) * (2.0 * math.pi / 720)  # crank angles at which a tool is compared with the fabric
NAMED = 24  # largest number of uncomputed outputs that are listed
SECONDS_PER_BOX = 20e-6  # of a proof, docs/proof.md


@click.command()
@STUDY
@click.option("--jobs", type=click.IntRange(min=1), default=2, show_default=True, help="Workers to plan for.")
@SMOKE
def check(study: Path, jobs: int, smoke: bool) -> None:
    """Validate a study and print what running it would compute and cost; nothing is written.

    A study over its budget ends with exit code 3.
    """
    model = load_study(study, smoke=smoke)
    if model.optimise is not None and model.optimise.prove is not None:
        # Optimiser and proof are imported on demand: scipy's minimisers take as long as numpy.
        from sweep.proof.question import question_of

        question_of(model)  # raises if the proof is not supported
    with Phases(show=True) as phases, compiling(phases):
        sample = pilot(model, lambda done, of: phases.say("planning", done, of))
        cost = estimate(model, jobs, known=sample)
        others = other_accuracies(model, jobs, lambda done, of: phases.say("other accuracies", done, of), sample)
        phases.say("what follows the sweep")
        lines = _searches(cost, searches(model, jobs, sample))
        phases.say("what matters")
        lines = plan_lines(model, cost, others, sample) + lines
    for line in lines:
        click.echo(line)
    check_budget(model, cost)


def plan_lines(study: Study, cost: Estimate, others: Sequence[tuple[str, float]], sample: Pilot) -> list[str]:
    """Return the plan of a study, line by line.

    Parameters
    ----------
    study : checked study
    cost : its estimate
    others : time with other accuracies [s], in words
    sample : the pilot run of both estimates
    """
    kind = "every combination" if study.space.kind == "product" else "Sobol sample"
    large = without_minus(study.objective.output) if study.objective is not None else None
    costs = [
        ("chunks", f"{grouped(cost.chunks)} of {how_many(min(cost.chunk_size, cost.designs), 'design')}"),
        ("rows kept", f"{_kept(cost)} ({study.output.keep}, {study.output.dtype})"),
        ("memory", size(cost.memory_bytes)),
        ("disk", f"{size(cost.disk_bytes)}, allowed {size(study.budget.disk_bytes)}"),
        (
            "time",
            f"{duration(cost.seconds)} with {how_many(cost.jobs, 'worker')}, allowed {duration(study.budget.seconds)}",
        ),
        *((words, f"{duration(seconds)}, {_times(seconds / cost.seconds)}") for words, seconds in others),
    ]
    title = f"{study.name}: {study.title}" if study.title else study.name
    lines = [title, *_mechanism(study.family), *_speed(study)]
    of = f"{kind} of" if study.space.axes else "nothing is swept"
    lines += ["", f"{how_many(study.space.count, 'design')}, {of}"]
    lines += aligned([(axis.name, _axis(axis)) for axis in study.space.axes])
    lines += [*_computed(study), *_before_and_between(study), *_effects(study, sample), *_left_out(study)]
    if study.objective is not None:
        lines += ["", f"to be made large: {large}" if large else f"to be made small: {study.objective.output}"]
    lines += [*_optimiser(study), *_proof(study), *_front(study)]
    return [*lines, "", "estimated cost, without the first compilation of the kernels", *aligned(costs)]


def section(heading: str, rows: Sequence[str]) -> list[str]:
    """Return rows under their heading, after an empty line; nothing without rows."""
    return ["", heading, *rows] if rows else []


def _speed(study: Study) -> list[str]:
    """Give the speed of the scene, and the speeds among a family's own parameters, which it does not set."""
    if study.speed is None:
        return []
    own = {p.name for p in study.family.parameters if p.unit == "speed"} - speeds(study.family, study.speed).keys()
    fixed = {name: value for name, value in study.space.fixed.items() if name in own and value != study.speed}
    words = ", ".join(f"{name} = {value:g} rad/s" for name, value in fixed.items())
    return [
        f"speed {study.speed * 30.0 / math.pi:g} rpm ({study.speed:.6g} rad/s)",
        *([f"  which does not set {words}"] if fixed else []),
    ]


def _optimiser(study: Study) -> list[str]:
    """Describe the largest number of starts and the stopping rule of the optimiser."""
    if study.optimise is None:
        return []
    from sweep.optimise.multistart.survey import CONFIRMATIONS, wanted

    settings = study.optimise
    share = 100.0 * wanted(settings)
    each = f"with at most {how_many(settings.looks, 'evaluation')} of a design from each start"
    most, source = f"{how_many(settings.starts, 'start')}, {each}", "start"
    if settings.by_populations:
        most = f"{how_many(settings.populations, 'population')} (evolutionary searches of their own), {each}"
        source = "population"
    unlikely = f" and another {source} finds a new one with a chance under {share:g} %" if share < 100.0 else ""
    enough = f"fewer once the best local optimum was found from {CONFIRMATIONS} {source}s{unlikely}"
    return [f"optimiser: at most {most}; {enough}{_brake(settings.time_budget)}"]


def _brake(seconds: float | None) -> str:
    return "" if seconds is None else f"; emergency brake after {duration(seconds)}"


def _searches(cost: Estimate, rows: Sequence[tuple[str, float, float]]) -> list[str]:
    """Describe the steps after the sweep with their time, then the whole run."""
    least = cost.seconds + sum(typical for _, typical, _ in rows)
    most = cost.seconds + sum(end for _, _, end in rows)
    all_of_it = (*rows, ("the whole run", least, most)) if rows else ()
    words = [(name, f"about {duration(typical)}, at most {duration(end)}") for name, typical, end in all_of_it]
    return section("what follows the sweep, by timed evaluations of a design of this study", aligned(words))


def _mechanism(family: Family) -> list[str]:
    if not isinstance(family, Machine):
        return [f"mechanism {family.name} ({family.title})"]
    rows = [(m.name, m.family.name, m.family.title) for m in family.members]
    return [f"machine of {how_many(len(rows), 'member')}", *aligned(rows)]


def _left_out(study: Study) -> list[str]:
    names = [name for name in main_outputs(study.family) if name not in study.want]
    further = len(names) - NAMED
    text = ", ".join(names[:NAMED]) + (f" and {further} more, see sweep families" if further > 0 else "")
    return section("will not be computed, because nothing asks for it", [f"  {text}"] if names else [])


def _computed(study: Study) -> list[str]:
    """Return the routes of the sweep in their order, with cost, outputs and limits."""
    limits: dict[str, list[str]] = {}  # [cyclogram] and [limits] may bound the same output
    for limit in study.output_limits:
        shown = quantity(limit.output, output(study.family, limit.output).unit)
        limits.setdefault(limit.output, []).append(bound_words(limit, shown))
    selected, rows = ordered_routes(study), list[tuple[str, str, str]]()
    between = "only designs within the limits so far go on to the next line"
    lines = ["", f"will be computed, extrema {accuracy_words(study)}; {between}"]
    for k, route in enumerate(selected, 1):
        outputs = ", ".join(
            name + (f" ({' and '.join(limits[name])})" if name in limits else "") for name in route.outputs
        )
        rows.append((f"{k}. {route.name}", f"{duration(1e-9 * route.ns_per_design)} per design", outputs))
    return [*lines, *aligned(rows)]


def _before_and_between(study: Study) -> list[str]:
    """Describe parameters that follow from others, before the sweep's routes or between them, and their limits."""
    lines = []
    if study.locus is not None:
        made, given = ", ".join(study.locus.made), ", ".join(study.prescribed)
        lines += ["", f"made before all that from {given}: {made}"]
    if study.fit is not None:
        aim = "" if study.fit.stroke is None else f", scaled to a stroke of {study.fit.stroke:g} mm"
        names = ", ".join(study.fit.parameters(study.family))
        lines += ["", f"fitted to the straightest line{aim}, as soon as no earlier stage is left to test: {names}"]
    if study.parameter_limits:
        units = {p.name: PARAMETER_UNITS[p.unit] for p in study.family.parameters}
        words = [f"{x.output} {bound_words(x, quantity(x.output, units[x.output]))}" for x in study.parameter_limits]
        lines += ["", f"limits on parameters: {'; '.join(words)}"]
    return lines


def _kept(cost: Estimate) -> str:
    words = f"{100.0 * cost.kept:.3g} % of all designs"
    return f"none of a pilot's designs, {words} assumed" if cost.kept <= LEAST_KEPT else words


def _times(ratio: float) -> str:
    return "as much" if abs(ratio - 1.0) < 0.005 else f"{ratio:.3g} times that"


def _front(study: Study) -> list[str]:
    """Describe the front of [pareto]: outputs, range of bounds and number of searches."""
    if study.pareto is None:
        return []
    from sweep.optimise.front.pareto import searches

    name, bounds = study.pareto.output, study.pareto.bounds
    shown = quantity(name, output(study.family, name).unit)
    ends = f"{number(min(bounds) * shown.factor)} to {shown.show(max(bounds))}"
    side = "at least" if study.pareto.at_least else "at most"
    count = how_many(searches(study.pareto), "search", "es")
    return [
        f"front: the same with {name} {side} {ends}, {how_many(len(bounds), 'bound')}; "
        f"up to {count} besides those of the optimiser{_brake(study.pareto.time_budget)}"
    ]


def _proof(study: Study) -> list[str]:
    """Describe the requested proof: gap, space and budget."""
    if study.optimise is None or study.optimise.prove is None:
        return []
    from sweep.proof.question import question_of

    settings, question = study.optimise.prove, question_of(study)
    unused = f"; no use is made of the limits on {', '.join(question.left_out)}" if question.left_out else ""
    return [
        f"proof: that no design is better than the optimum by more than {100.0 * settings.gap:g} %, over "
        f"{', '.join(question.names)}; at most {how_many(settings.boxes, 'box', 'es')}, "
        f"{duration(settings.boxes * SECONDS_PER_BOX)} of processor time{_brake(settings.seconds)}{unused}"
    ]


def _effects(study: Study, sample: Pilot) -> list[str]:
    """Describe the effects of the scene: computed ones, others, and the rules of negligibility that hold."""
    bare = study.bare
    others = left_out(bare, study.want)
    if not others and bare is study.family:
        return []
    shares = aligned(tree(bare, study.want, POSES)) if bare is not study.family else []
    lines = section("effects, with their share of the cost at equal numbers of poses", shares)
    lines += section("effects not computed, because nothing asks for them", _listed(others))
    designs, tried = spread_rows(sample.kept, ADVISED), sample.tried
    if not len(designs):
        designs, tried = feasible_designs(study, ADVISED)
    which = f"by {how_many(len(designs), 'design')} within all limits"
    if not len(designs):
        designs = spread_designs(study, ADVISED)
        which = f"by {how_many(len(designs), 'design')} spread over the space: none of {tried} tried keeps all limits"
    rods = [p.name for p in study.family.parameters if p.unless and study.space.fixed.get(p.name) == 1.0]
    lines += section("bodies without centre and inertia are slender rods between their joints", _listed(rods))
    lines += section("bodies taken without mass, as none is given: they cause no force", _listed(_massless(study)))
    lines += section("masses in the joints of their bodies, as centre and inertia are 0", _listed(_points(study)))
    lines += section("fabric that the tool does not enter on its way", _piercing(study, designs))
    lines += section("values that miss the accuracy asked", _late(study))
    advice = [f"  {finding.words}" for finding in findings(bare, study.family, designs, study.want)]
    return lines + section(f"what matters here, {which}; the choice is yours", advice)


def _listed(names: Sequence[str]) -> list[str]:
    """Return names in one row of a section, if there are any."""
    return [f"  {', '.join(names)}"] if names else []


def _late(study: Study) -> list[str]:
    """Say how many of a few designs of the whole space miss the accuracy asked, as speeds do under jumping loads."""
    designs = spread_designs(study, TRIED)
    status = design_outputs(study.family, designs, study.want, study.accuracy, study.window)["status"]
    late = np.count_nonzero(status == NOT_CONVERGED)
    words = f"{late} of {how_many(len(designs), 'design')} spread over the space: {meaning(NOT_CONVERGED)}"
    return [f"  {words}"] if late else []


def _piercing(study: Study, designs: Array) -> list[str]:
    """Name the tools that do not enter the fabric along their way, since they are above or inside it all the time."""
    names, angles, lines = study.family.parameter_names, Angles.of(np.asarray(TURN[None], np.float64)), list[str]()
    for known in study.family.every(Crossing):
        member, dot, position = known.passing.rpartition(".")
        at, sense = (f"{member}{dot}pierce_{word}{parts(position).stage}" for word in ("at", "sense"))
        pierced = designs[known.matters(designs)]
        way = np.asarray(study.family.poses(pierced, angles, frozenset([known.passing]))[known.passing], np.float64)
        level, turns = known.level(pierced), np.isfinite(way).all(axis=1)
        inside = pierced[:, names.index(sense), None] * (way - level[:, None]) > 0.0
        for which, effect in ((~inside.any(axis=1), "does not act"), (inside.all(axis=1), "acts on the whole way in")):
            if (some := which & turns).any():
                places = " to ".join(dict.fromkeys(f"{x:.4g}" for x in (level[some].min(), level[some].max())))
                ends = f"{way[some].min():.4g} to {way[some].max():.4g} mm"
                count = f"{some.sum()} of {how_many(len(designs), 'design')}"
                lines.append(f"  {at} = {places} mm is outside {known.passing} = {ends} of {count}: the force {effect}")
    return lines


def _massless(study: Study) -> list[str]:
    """Name the masses that are 0, also by length; a tool often has none."""
    fixed = study.space.fixed
    masses = [p.name for p in study.family.parameters if p.unit == "mass" and fixed.get(p.name) == 0.0]
    links = [name for name in masses if not name.rpartition(".")[2].startswith("m_tool")]
    return [name for name in links if not fixed.get("line_mass_".join(name.rsplit("m_", 1)), 0.0)]


def _points(study: Study) -> list[str]:
    """Name the point masses: without centre and inertia, on bodies without a second joint that would make them rods."""
    names, fixed = study.family.parameter_names, study.space.fixed

    def entries(mass: str) -> list[str]:
        place, dot, parameter = mass.rpartition(".")
        body = parameter.removeprefix("m_")
        stage = "" if f"{place}{dot}com_{body}_x" in names else body[-1]
        heads = tuple(f"{place}{dot}{head}_{body.removesuffix(stage)}_" for head in ("com", "j"))
        return [name for name in names if name.startswith(heads) and name.endswith(stage)]

    return [
        p.name for p in study.family.parameters
        if POINT in p.text and fixed.get(p.name) != 0.0 and all(fixed.get(name) == 0.0 for name in entries(p.name))
    ]  # fmt: skip


def _axis(axis: Axis) -> str:
    unit = "" if axis.unit == "1" else f" {axis.unit}"
    low, high = axis.low / axis.factor, axis.high / axis.factor
    count = "" if axis.values is None else f", {how_many(axis.count, 'value')}"
    return f"{low:g} to {high:g}{unit}{count}{', log' if axis.scale == 'log' else ''}"
