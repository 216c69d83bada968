"""Final output of ``sweep run`` in the terminal: the answer in a few lines, and the next command."""

from __future__ import annotations

import math
import shlex
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from kernels import status as codes
from sweep.chunks.plan import spread_designs
from sweep.dataset.reading import best
from sweep.errors import INFEASIBLE, grouped, how_many
from sweep.evaluation.statuses import meaning
from sweep.evaluation.summaries import design_outputs
from sweep.families.base import Angles, Interval
from sweep.families.capabilities import Assembly
from sweep.optimise.local.descent import KKT
from sweep.optimise.multistart.survey import optima_words
from sweep.quantities.limits import compared
from sweep.report.answer import proof_sentence, search_words, share_words, shortest_link, survey_warnings, unsettled
from sweep.report.dataset import Dataset, read_dataset
from sweep.report.front import Front
from sweep.report.tables import bound_words, limit_states, limited, parameter_rows
from sweep.study import Limit
from sweep.synthesis.fit import fit_line

TURN = np.arange(360, dtype=np.float64) * (2.0 * math.pi / 360)
LOOKED_AT = 1024  # designs of a space among which the nearest miss is sought without an optimiser
WIDER = "for others sweep wider, or give them in [limits]"
KEPT = 1e-9  # share of its bound by which a kept limit may be missed
NONE_KEPT = "no design keeps all limits; nearest is the one whose largest miss, as a share of its limit, is least"


@dataclass(frozen=True)
class Ending:
    """Lines to print, exit code (0, or 4 if no design keeps all limits), and next command."""

    lines: tuple[str, ...]
    exit_code: int
    next: str


def ending(folder: Path) -> Ending:
    """Return the answer of a complete dataset in a few lines.

    Parameters
    ----------
    folder : dataset with its optimum, if the study asks for one

    Raises
    ------
    InputError
        if the folder is no complete dataset.
    """
    data = read_dataset(folder)
    feasible = data.counts.get(codes.OK, 0)
    swept = f"{data.study.name}: {how_many(data.designs, 'design')}"
    lines = [f"{swept}, {grouped(feasible)} within all limits{_best_of_sweep(data, feasible)}"]
    optimum = data.optimum
    if optimum is not None:
        missed = int(optimum.get("status", 0)) == codes.LIMIT_EXCEEDED
        lines += _nearest(data) if missed else _optimum(data)
        if (survey := data.survey) is not None:
            lines.append(f"search: {how_many(survey.starts, 'start')}, {search_words(data, survey)}")
            kinds = [f"{words}: {how_many(n, 'start')}, {optima_words(b)}" for words, n, b in survey.kinds]
            lines += [f"by listed values: {'; '.join(kinds)}"] if kinds else []
            lines += [f"warning: {text}" for text in survey_warnings(data, survey)]
        lines += [sentence] if (sentence := proof_sentence(data)) else []
    else:
        missed = feasible == 0
        lines += _nearest_of_space(data) if missed else []
    if (front := Front.of(data)) and (sentence := front.sentence()):
        lines.append(f"front: {sentence[0].lower()}{sentence[1:].rstrip('.')}")
    if data.front_steps is not None:
        lines.append(f"warning: time ran out: {data.front_steps} steps of the front")
    # No-break spaces keep values with their units on a page; tools of a shell expect plain ones.
    lines = [line.replace("\u00a0", " ") for line in lines]
    return Ending(tuple(lines), INFEASIBLE if missed else 0, f"next: sweep report {shlex.quote(str(folder))}")


def _best_of_sweep(data: Dataset, feasible: int) -> str:
    objective = data.objective
    if objective is None or not feasible:
        return ""
    first = best(data.folder, objective.name, 1)[objective.name]
    if not len(first):
        return ""
    return f", the best with {objective.words} {objective.show(compared(objective.name, float(first[0])))}"


def _optimum(data: Dataset) -> list[str]:
    objective = data.objective
    assert objective is not None and data.optimum is not None
    value = float(data.optimum[objective.name])
    fast = objective.at_speed(value, data.study.speed)
    active = [s for s in limit_states(data) if s.state == "active"]
    held = [f"{s.shown.words} ({s.bound})" for s in active]
    words = [w.strip() for w in str(data.optimum.get("active") or "").split(";")]
    edges = [w for w in words if w.endswith(" bound") and w.split()[0] not in {s.shown.name for s in active}]
    held += edges
    made = {*data.study.made, *data.study.rescaled}
    follow = [name for name in dict.fromkeys(w.split()[0] for w in edges) if name in made]
    ends = ", ".join(f"{name} = {limited(data, name).show(float(data.optimum[name]))}" for name in follow)
    share = float(data.optimum.get("yield", math.nan))
    ended, agree = str(data.optimum.get("ended")), int(data.optimum.get("agree", 1))
    kept = share_words(share, data.study.wanted_yield, ended, agree) if math.isfinite(share) else ""
    return [
        f"optimum: {objective.words} {objective.show(value)}{f' ({fast})' if fast else ''}",
        f"held back by: {held_back(held, ended, settled=not unsettled(data.optimum))}",
        *([f"bounds that follow from the designs of the sweep: {ends}; {WIDER}"] if ends else []),
        *([f"as it is made: {kept}"] if kept else []),
        *(f"warning: {words}" for words in (*unsettled(data.optimum), *shortest_link(data))),
    ]


def held_back(held: list[str], ended: str, *, settled: bool) -> str:
    """Name what limits the objective of an optimum: limits and bounds, or the ending of its search."""
    if ended == "looks":
        held = [*held, "the number of evaluations (optimise.looks), which ended its search"]
    return "; ".join(held) or ("nothing: an optimum in the open" if settled else "not known, the search did not settle")


def _nearest(data: Dataset) -> list[str]:
    """Name the limits that the nearest design misses, with their relaxations."""
    assert data.optimum is not None
    residual = float(data.optimum.get("kkt_residual", math.nan))
    # Only if the optimality conditions of the smallest relaxation hold is the missing amount the smallest one.
    open_end = [] if residual <= KKT else ["the search did not settle there: less may have to give way than it says"]
    apart = _cannot_meet(data)
    return [NONE_KEPT, *_give_way(data, data.optimum, "the nearest design found"), *apart, *open_end]


def _cannot_meet(data: Dataset) -> list[str]:
    """Name the links that meet at no crank angle, for the design that comes nearest; empty if all links meet."""
    family, loops = data.study.family, data.study.family.every(Assembly)
    if not loops or isinstance(family.domain, Interval):
        return []
    assert data.optima is not None
    designs = data.optima.loc[data.optima["role"] != "reference", [*family.parameter_names]].to_numpy(np.float64)
    with np.errstate(all="ignore"):
        poses = family.poses(
            designs, Angles.of(np.asarray(TURN[None, :], np.float64)), frozenset(loop.discriminant for loop in loops)
        )
        # A stage behind one that does not assemble has unknown margins.
        reach = [np.max(poses[x.discriminant] / np.reshape(x.scale(designs), (-1, 1)), axis=1) for x in loops]
    nearest = int(np.argmax(np.nanmin(np.nan_to_num(reach, nan=math.inf), axis=0)))
    lines = []
    for loop, value in zip(loops, [float(values[nearest]) for values in reach], strict=True):
        if value < 0.0:
            member, _, stage = loop.stage.rpartition(".")
            links = [p.name for p in family.parameters if p.unit == "length" and p.name.startswith(member)]
            words = ", ".join(
                f"{n} = {designs[nearest, family.parameter_names.index(n)]:.4g}" for n in links if n.endswith(stage)
            )
            lines.append(f"  links that cannot meet at any crank angle: {words}; the margin is {value:.3g} at best")
    return lines


def _nearest_of_space(data: Dataset) -> list[str]:
    """Describe the nearest miss among designs of the space, or without limits the most frequent failure."""
    study = data.study
    if not study.limits:
        status, count = max(((s, n) for s, n in data.counts.items() if s != codes.OK), key=lambda item: item[1])
        return [f"no design has all that is wanted; {grouped(count)} of {grouped(data.designs)}: {meaning(status)}"]
    designs = spread_designs(study, LOOKED_AT)
    if study.fit is not None and len(designs):
        designs, made = fit_line(study.family, designs, study.fit, study.window)
        designs = designs[made == codes.OK]
    if not len(designs):
        return ["no design keeps all limits, and none of a sample could be made at all"]
    names = study.family.parameter_names
    outputs = [limit.output for limit in study.limits if limit.output not in names]
    columns: dict[str, Any] = design_outputs(study.family, designs, outputs, study.accuracy, study.window)
    columns |= {name: designs[:, k] for k, name in enumerate(names)}
    shares = [_shortfall(limit, columns[limit.output])[1] for limit in study.limits]
    row = {name: values[int(np.argmin(np.max(shares, axis=0)))] for name, values in columns.items()}
    keep = [int((share <= KEPT).sum()) for share in shares]
    alone = [f"kept by {count or 'none'} of these designs" for count in keep]
    return [NONE_KEPT, *_give_way(data, row, f"the nearest of {how_many(len(designs), 'design')} of the space", alone)]


def _give_way(data: Dataset, row: Mapping[str, Any], who: str, alone: Sequence[str] = ()) -> list[str]:
    """Name a design and the limits that it misses; ``alone`` says of each limit which designs keep it."""
    lines = []
    for k, limit in enumerate(data.study.limits):
        shown = limited(data, limit.output)
        if limit.output not in row:
            continue
        short, share = (float(x[0]) for x in _shortfall(limit, np.array([row[limit.output]], np.float64)))
        if share <= KEPT:
            continue
        bound = bound_words(limit, shown)
        if math.isnan(short):
            words = f"{shown.words} ({bound}): it has none"
        elif shown.words.startswith("rotatable"):
            words = f"{shown.words}: {bound}"
        else:
            value = shown.show(float(compared(limit.output, float(row[limit.output]))))
            words = f"{shown.words} must give way by {shown.show(short, 3)}: {value} instead of {bound}"
        lines.append(f"  {words}{f' ({alone[k]})' if alone else ''}")
    together = f"{len(lines)} limits, which must give way together" if len(lines) > 1 else "1 limit"
    swept = {p.name: p.value for p in parameter_rows(data, row) if p.name in data.study.space.bounds}
    design = ", ".join(f"{name} = {value}" for name, value in swept.items())
    return [f"{who}, {design}, misses {together}:" if design else f"{who} misses {together}:", *lines] if lines else []


def _shortfall(limit: Limit, values: Any) -> tuple[Any, Any]:
    """Return the violation of a limit, in its unit and relative to its bound; large for missing values."""
    x = compared(limit.output, np.asarray(values, np.float64))
    low, high = limit.ends
    short = np.maximum(np.maximum(low - x, x - high), 0.0)
    size = max(abs(limit.minimum or 0.0), abs(limit.maximum or 0.0)) or 1.0
    return short, np.nan_to_num(short / size, nan=1e6)
