"""The answer in words: result against the reference, active limits, what was not reached, what is proven."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from kernels import status as codes
from sweep.dataset import files
from sweep.errors import how_many
from sweep.evaluation.statuses import meaning
from sweep.optimise.local.descent import KKT
from sweep.optimise.local.start import DIFFERS
from sweep.optimise.multistart.survey import Survey, optima_words
from sweep.proof import read_proof
from sweep.proof.study import EVENT, proof_words
from sweep.quantities.dimensions import LINK_RATIO, sizes
from sweep.quantities.limits import compared
from sweep.report import tables
from sweep.report.dataset import Dataset
from sweep.report.front import Front
from sweep.report.quantities import ShownQuantity, change, number, quantity, rpm
from sweep.report.scan import Scan

MISSED = ("missed", "unknown")
NEAREST = 4  # inactive limits named in the answer; the table has them all
BEHIND = 1e-6  # relative difference by which a known design must be better than the optimum
SLIGHTEST = 0.01  # link ratio below which no mechanism is built: a crank of 1 mm at a rod of 100 mm
NO_PROOF = "This is no proof of a global optimum"


def answer(data: Dataset, scanned: Scan, further: Sequence[str] = ()) -> list[str]:
    """Return the sentences that answer the study's question, most important first; ``further`` before the limits."""
    total = data.designs
    if data.result is None:
        stops = max(tables.fates(data)[:-1], key=lambda fate: fate.count, default=None)
        most = [] if stops is None else [f"What stops most of them, {_count(stops.count)}: {stops.text}."]
        return [f"No design of the {_count(total)} in the sweep meets all limits.", *most]
    cut = data.front_steps is not None or (data.survey is not None and data.survey.ended == "time")
    sentences = search_warnings(data) if cut else []
    who = "The optimum" if data.optimum is not None else "The best design of the sweep"
    if data.optimum is not None and int(data.optimum.get("status", 0)) == codes.LIMIT_EXCEEDED:
        sentences.append("No design was found that keeps all limits; what follows is the nearest one found.")
        who = "The nearest design"
    if data.objective is not None:
        sentences.append(_headline(data, who, data.objective))
    second = data.second
    if second is not None and math.isfinite(tables.value_of(data.result, second)):
        sentences.append(_comparison(data, second))
    proven = proof_sentence(data)
    sentences += [f"{proven[0].upper()}{proven[1:]}."] if proven else []
    sentences += further
    sentences += [] if cut else search_warnings(data)
    # A prescribed output is met by construction if [locus] fixes it, and part of the searched space if it is an axis.
    states = [s for s in tables.limit_states(data) if s.shown.name not in data.study.prescribed]
    sentences += _limit_sentences(states, data.optimum is not None and data.study.wanted_yield is not None)
    sentences += [_edge_sentence(data), _sweep_sentence(data, scanned)]
    front = Front.of(data)
    sentences.append(front.sentence() if front else "")
    sentences += _against_reference(data)
    sentences += not_achieved(data, scanned)
    return [s for s in sentences if s]


def _headline(data: Dataset, who: str, shown: ShownQuantity) -> str:
    value, old = tables.value_of(data.result, shown.name), tables.value_of(data.reference, shown.name)
    article = "an" if shown.words[0] in "aeiou" else "a"
    text = f"{who} has {article} {shown.words} of {_with_speed(data, shown, value)}"
    if data.reference is None:
        return f"{text}."
    if math.isnan(old):
        return f"{text}. The reference design has none: {meaning(int(data.reference.get('status', 0)))}."
    difference = change(shown, value, old)
    than = "the same as" if difference == "the same" else f"{difference} than"
    return f"{text}, {than} the reference design with {_with_speed(data, shown, old)}."


def _comparison(data: Dataset, name: str) -> str:
    shown = data.shown(name)
    value, old = tables.value_of(data.result, name), tables.value_of(data.reference, name)
    text = f"Its {shown.words} is {_with_speed(data, shown, value)}"
    difference = change(shown, value, old)
    than = "the same as" if difference == "the same" else f"{difference} than"
    return f"{text}, {than} the {shown.show(old)} of the reference." if difference else f"{text}."


def _with_speed(data: Dataset, shown: ShownQuantity, value: float) -> str:
    fast = shown.at_speed(value, data.study.speed)
    return f"{shown.show(value)} ({fast} at {rpm(data.study.speed)})" if fast else shown.show(value)


def _limit_sentences(states: list[tables.LimitState], robust: bool) -> list[str]:
    """Return sentences about active and inactive limits; a robust design keeps the margin that its tolerances need."""
    active = [f"{s.shown.words} ({s.bound})" for s in states if s.state == "active"]
    met = sorted((s for s in states if s.state == "met" and s.room > tables.ACTIVE), key=lambda s: s.room)
    slack = [f"{s.shown.words} ({s.value}, {s.bound})" for s in met[:NEAREST]]
    slack += [f"{len(met) - NEAREST} more"] if len(met) > NEAREST else []
    words = f"the active limit{'s' if len(active) > 1 else ''}"
    words += ", from which the drawing keeps the distance that what is made needs" if robust else ""
    return [
        f"Held back by {words}: {'; '.join(active)}." if active else "",
        f"Met with room to spare, the nearest first: {'; '.join(slack)}." if slack else "",
    ]


def _edge_sentence(data: Dataset) -> str:
    """Return a sentence about parameters on the edge of the searched space; empty without one, or an objective."""
    edges = "; ".join(f"{row.name} ({row.edge}, {row.value})" for row in tables.parameter_rows(data) if row.edge)
    if not edges or data.study.objective is None:
        return ""
    return f"On the edge of the space that was searched: {edges}. A wider space may hold a better design."


def not_achieved(data: Dataset, scanned: Scan) -> list[str]:
    """Return a sentence about missed limits, and about an optimiser that did not settle or lost a better design."""
    faults = [
        f"{s.shown.words}: {s.value} instead of {s.bound}" for s in tables.limit_states(data) if s.state in MISSED
    ]
    objective = data.objective
    if data.optimum is not None:
        faults += unsettled(data.optimum)
        wanted_yield = data.study.wanted_yield
        share = tables.value_of(data.optimum, "yield")
        if wanted_yield is not None and share < wanted_yield:
            faults.append(f"as it is made: {share_words(share, wanted_yield, str(data.optimum.get('ended')))}")
        if objective is not None and scanned.best_row:
            best, value = scanned.best_row[objective.name], tables.value_of(data.drawing or {}, objective.name)
            if not compared(objective.name, value) <= compared(objective.name, best) + BEHIND * abs(best):
                faults.append(f"the optimiser ended behind the best design of the sweep, {objective.show(best)}")
    return [f"Not achieved: {'; '.join(faults)}."] if faults else []


def unsettled(optimum: Mapping[str, Any]) -> list[str]:
    """Say that the optimiser stopped before the optimality conditions held; nothing where they hold."""
    if float(optimum.get("kkt_residual", math.nan)) <= KKT:
        return []
    return [f"the optimiser {'had no time left to settle' if optimum.get('ended') == 'time' else 'did not settle'}"]


def shortest_link(data: Dataset) -> list[str]:
    """Say that no limit kept the optimum from links of very different lengths; nothing where they are alike."""
    family = data.study.family
    ratio = sizes(family).get(LINK_RATIO.name)
    if ratio is None or data.optimum is None:
        return []
    design = np.array([[tables.value_of(data.optimum, name) for name in family.parameter_names]])
    value = float(ratio.values(family, design)[0])
    words = f"the shortest link of the optimum has {number(value, 2)} of the length of its longest, which nobody builds"
    return [f"{words}: a limit such as link_ratio = {{ min = 0.1 }} excludes that"] if value < SLIGHTEST else []


def share_words(share: float, wanted_yield: float | None, ended: str, agree: int = 1) -> str:
    """Describe the yield of manufactured mechanisms, the wanted yield, and why the wanted one was not reached."""
    text = f"{100.0 * share:.1f} % within all limits"
    if wanted_yield is None:
        return text
    if share < wanted_yield:
        text = f"{math.floor(1e4 * share) / 1e2:.2f} % within all limits, {100.0 * wanted_yield:g} % asked: not reached"
        return f"{text}, its search used up its evaluations before" if ended == "looks" else text
    text += f", {100.0 * wanted_yield:g} % asked"
    return f"{text}, met by {agree} searches" if agree > 1 else text


def _against_reference(data: Dataset) -> list[str]:
    """Return sentences about criteria in which the reference is better, and about limits that it misses."""
    if data.reference is None:
        return []
    criteria = [None if data.objective is None else data.objective.name, data.second]
    worse = []
    for name in filter(None, criteria):
        value, old = tables.value_of(data.result, name), tables.value_of(data.reference, name)
        if compared(name, value) > compared(name, old) + 1e-9 * abs(old):
            worse.append(data.shown(name).words)
    missed = []
    for limit in data.study.limits:
        state = tables.limit_state(limit, data.reference, None, tables.limited(data, limit.output), frozenset())
        if state.state in MISSED:
            missed.append(f"{state.shown.words} ({state.value}, {state.bound})")
    return [
        f"Worse than in the reference: {'; '.join(worse)}." if worse else "",
        f"Limits the reference itself misses: {'; '.join(missed)}." if missed else "",
    ]


def _sweep_sentence(data: Dataset, scanned: Scan) -> str:
    feasible = scanned.feasible
    share = number(100.0 * feasible / max(data.designs, 1), 3)
    text = f"Of {_count(data.designs)} designs in the sweep {_count(feasible)} ({share} %) meet all limits"
    objective = data.objective
    if objective is None or data.optimum is None or not scanned.best_row:
        return f"{text}."
    best = objective.show(scanned.best_row[objective.name])
    source = "" if data.survey is not None and data.survey.populations else ", from where the optimiser went on"
    return f"{text}; the best of them has {objective.symbol} = {best}{source}."


def search_warnings(data: Dataset) -> list[str]:
    """Return warnings about the optimum; the optimiser's own statements are in `searched`."""
    survey, front = data.survey, data.front_steps
    words = shortest_link(data)
    words += [] if survey is None else [*_unconfirmed(data), *survey.shortcomings]
    if survey is not None and survey.doubts and not _is_proven(data):
        of = "population" if survey.populations else "start"
        rare = {1: f"only one {of} reached this optimum", 2: f"only two {of}s reached this optimum"}.get(survey.best)
        words.append(f"{rare}; run more" if rare else f"a better optimum may be left; run more {of}s")
    words += [] if front is None else [f"time ran out: {front} steps of the front"]
    return [f"{text[0].upper()}{text[1:]}." for text in words]


def searched(data: Dataset, scanned: Scan) -> list[str]:
    """Return sentences about the search for the optimum, in the optimiser's own words, and about its uncertainty."""
    doubts = () if data.survey is None or _is_proven(data) else data.survey.doubts
    return [text for text in (search_sentence(data, scanned), *(f"{x[0].upper()}{x[1:]}." for x in doubts)) if text]


def _residual(value: float) -> str:
    return "its KKT residual does not exist" if math.isnan(value) else f"KKT residual {number(value, 3)}"


def search_sentence(data: Dataset, scanned: Scan) -> str:
    """Describe the search for the optimum and, without a proof, state that it is none."""
    if data.result is None or data.study.objective is None:
        return ""
    if data.optimum is None:
        return f"{NO_PROOF}: no optimiser was run, and the best of the sweep is as fine as the spacing of its designs."
    starts = data.starts
    kind = "" if scanned.feasible else "random "
    head = "The" if proof_sentence(data) else f"{NO_PROOF}: the"
    text = f"{head} optimiser started from {how_many(starts, f'{kind}design')}"
    populations = 0 if data.survey is None else data.survey.populations
    most = "most of them " if starts > 2 * populations else ""  # at most two per population, others from the sweep
    text += f", {most}ends of {how_many(populations, 'population')}" if populations else " of the sweep"
    text += "" if data.survey is None else f"; {search_words(data, data.survey)}"
    residual, violation = tables.value_of(data.optimum, "kkt_residual"), tables.value_of(data.optimum, "violation")
    wanted = "" if residual <= KKT else f" where {number(KKT)} is wanted"
    words = "" if math.isnan(residual) and proof_sentence(data) else f"{_residual(residual)}{wanted}, "
    words += f"largest violation of a limit {number(violation, 3)}."
    return f"{text}. {words[0].upper()}{words[1:]}"


def _count(n: float) -> str:
    """Format a count as 1 234 567 with thin no-break spaces."""
    return f"{int(n):,}".replace(",", "\u202f")


def proof_sentence(data: Dataset) -> str:
    """Return the statement of the proof; empty if the study asked for none."""
    proof = read_proof(files.beside(data.folder) / files.PROOF)
    if proof is None:
        return ""
    shown = quantity(proof.objective, data.units.get(proof.objective, proof.unit))
    took = [run["processor_seconds"] for run in data.runs if run.get("event") == EVENT]
    return proof_words(proof, shown.words, shown.show, took[-1] if took else None)


def survey_warnings(data: Dataset, survey: Survey) -> tuple[str, ...]:
    """Return warnings about a search; a proof of the whole space removes the doubts about better designs."""
    return (*_unconfirmed(data), *(survey.shortcomings if _is_proven(data) else survey.warnings))


def search_words(data: Dataset, survey: Survey) -> str:
    """Describe the local optima found; with a proof of the whole space without the chance that one is left."""
    if survey.basins == 0 or not _is_proven(data):
        return survey.words
    return f"{optima_words(survey.basins)} found"


def _is_proven(data: Dataset) -> bool:
    proof = read_proof(files.beside(data.folder) / files.PROOF)
    return proof is not None and proof.settled and not proof.exceptions


def _unconfirmed(data: Dataset) -> tuple[str, ...]:
    """Return warnings if the search used extrema other than the true ones, or ended behind the front."""
    best = data.optimum
    if best is None or best.get("ended") != DIFFERS:
        return _behind_the_front(data)
    gap = f"{100.0 * float(best['gap']):.2g} %"
    text = f"the search took values that are up to {gap} beside the true ones, which are shown: better may be near"
    return (text, *_behind_the_front(data))


def _behind_the_front(data: Dataset) -> tuple[str, ...]:
    """Return a warning if a design of the front keeps all limits and is better than the optimum."""
    study, objective, front, best = data.study, data.objective, data.front, data.optimum
    if study.pareto is None or objective is None or front is None or best is None or study.wanted_yield is not None:
        return ()
    good = (front["status"] == codes.OK) & (front["kkt_residual"] <= KKT)
    for limit in study.limits:  # the front's bounds replace limits on its side
        bound = limit.minimum if study.pareto.at_least else limit.maximum
        if limit.output == study.pareto.output and bound is not None:
            good &= front["bound"] >= bound if study.pareto.at_least else front["bound"] <= bound
    least = float(compared(objective.name, front[objective.name][good].to_numpy()).min(initial=math.inf))
    missed = int(best.get("status", 0)) == codes.LIMIT_EXCEEDED
    value = math.inf if missed else compared(objective.name, tables.value_of(best, objective.name))
    better = math.isfinite(least) and least < value - BEHIND * abs(least)
    words = f"the front has a better design within all limits, {objective.show(least)}: run more starts"
    return (words,) if better else ()
