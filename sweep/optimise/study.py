"""A study's optimum: from its dataset to ``_optimum.parquet`` and ``_curves.parquet``."""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import asdict, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from kernels import status as st
from sweep.dataset import store
from sweep.dataset.tables import metadata
from sweep.errors import InputError
from sweep.evaluation.curves import joint_curves, motion_curves
from sweep.evaluation.tables import design_matrix
from sweep.families.base import Angles, Array, Parameter
from sweep.families.domain import Interval
from sweep.jobs.progress import Say, unsaid
from sweep.optimise.brake import Brake
from sweep.optimise.candidates import ranking
from sweep.optimise.certificate import Result
from sweep.optimise.coordinates import LocusCoordinates
from sweep.optimise.discrete import listed, with_neighbours
from sweep.optimise.filling import filled
from sweep.optimise.form import Program
from sweep.optimise.globally import Begun, insensitive, proportion_starts
from sweep.optimise.model import Model
from sweep.optimise.problem import Problem
from sweep.optimise.robust import robust, yields
from sweep.optimise.sensitivity import sensitivities
from sweep.optimise.solve import explore
from sweep.optimise.starts import ALIKE, best_rows, diverse, drawn, of_task
from sweep.optimise.survey import CUT, Survey, later
from sweep.optimise.tolerance import tolerance_rows
from sweep.optimise.written import certificates, outputs, write

if TYPE_CHECKING:
    from sweep.study import OptimiseSettings, Study

POSES = 720
WHOLE_TURN = 2.0 * np.pi - 1e-9
SHORTEST = 0.02  # of its upper limit is a length without a lower one
TAILS = (2.0, 98.0)  # percent; beyond are needles that hardly moved and were scaled up to the stroke


def problem_of(study: Study, designs: Array, on_locus: bool | None = None) -> Problem:
    """Return the optimisation problem of a study.

    Swept steady parameters vary between the ends of their axes, those that [locus] or [fit] sets or scales as far as
    ``designs`` (k, P) reach and half their size beyond; limits on parameters narrow both.  An angle swept over a whole
    turn may go on for half a turn.  Parameters given as lists of values are not varied: each start keeps its own.

    On the locus, what it prescribes is varied instead of the links: fixed values hold by construction, axes are bounds,
    limits on links stay limits.  Otherwise what is prescribed becomes limits: equations where it is fixed.

    Parameters
    ----------
    study : with an objective
    designs : (k, P) from its space
    on_locus : None leaves it to ``optimise.variables``, and without that to whether [locus] fixes swing, stroke or phi0

    Raises
    ------
    InputError
        if the study has no objective, or nothing that can change.
    """
    if study.objective is None:
        raise InputError("objective", None, "[objective] minimise = an output", str(study.path))
    coordinates = (
        LocusCoordinates(study.locus) if study.locus and (_wanted(study) if on_locus is None else on_locus) else None
    )
    follows, given = ((), ()) if coordinates is None else (coordinates.made, coordinates.given)
    chosen = listed(study)
    bounds = {
        name: None if name in chosen else _bounds(study, name, designs)
        for name in (*study.family.parameter_names, *given)
    }
    varied = {name: ends for name, ends in bounds.items() if ends is not None and name not in follows}
    held = {name: ends[0] for name, ends in varied.items() if ends[0] == ends[1]}
    names = tuple(name for name in varied if name not in held)
    own = [name for name in (*study.family.parameter_names, *given) if name not in follows]
    fixed = {name: abs(x) if name in given else x for name, x in study.space.fixed.items() if name in own}
    limits = [limit for limit in study.output_limits if limit.output not in given]
    limits += [limit for limit in study.parameter_limits if limit.output in (*follows, *chosen)]
    if not names:
        allowed = "a parameter that changes steadily beside the listed ones; the sweep has tried them all"
        raise InputError("optimise", ", ".join(chosen), allowed, str(study.path))
    return Problem(
        study.family, names, np.array([varied[n][0] for n in names]), np.array([varied[n][1] for n in names]),
        fixed | held, study.objective.output, tuple(limits), study.window, study.accuracy, coordinates,
    )  # fmt: skip


def _wanted(study: Study) -> bool:
    """Return whether the search goes along the locus: as the study says, or where that spares it an equation."""
    if study.optimise is not None and study.optimise.variables is not None:
        return study.optimise.variables == "locus"
    return any(limit.output in study.prescribed and limit.minimum == limit.maximum for limit in study.limits)


def _bounds(study: Study, name: str, designs: Array) -> tuple[float, float] | None:
    """Return the bounds between which a parameter or a prescribed output may vary;
    None where it is given, or a sign.
    """
    names = study.family.parameter_names
    parameter = next(p for p in (*study.family.parameters, *_prescribed(study)) if p.name == name)
    if parameter.choices is not None:
        return None
    ends = _limited(study, name)
    if name in study.rescaled and ends is not None:
        return ends
    if name in (*study.made, *study.rescaled):
        low, high = (float(end) for end in np.percentile(designs[:, names.index(name)], TAILS))
        reach = 0.5 * max(abs(low), abs(high)) if parameter.unit == "length" else 0.5
        low, high = (0.2 * low if parameter.positive else low - reach), high + reach
    elif name in study.space.bounds:
        low, high = study.space.bounds[name]
        if name not in names and not name.startswith("phi"):
            low, high = sorted((abs(low), abs(high)))  # the branch tells the sign of swing and stroke
        elif parameter.unit == "angle" and high - low >= WHOLE_TURN:
            low, high = low - np.pi, high + np.pi
    else:
        return None
    for limit in study.parameter_limits:
        if limit.output == name:
            low = low if limit.minimum is None else max(low, limit.minimum)
            high = high if limit.maximum is None else min(high, limit.maximum)
    return low, high


def _limited(study: Study, name: str) -> tuple[float, float] | None:
    """Return ends of a length of a guide whose proportions are searched globally:
    its limits, not what the sweep reached.
    """
    limits = [x for x in study.parameter_limits if x.output == name and x.maximum is not None]
    if study.optimise is None or study.optimise.globally != "proportions" or not limits:
        return None
    high = min(x.maximum for x in limits if x.maximum is not None)
    return max((x.minimum for x in limits if x.minimum is not None), default=SHORTEST * high), high


def _prescribed(study: Study) -> tuple[Parameter, ...]:
    return () if study.locus is None else study.locus.prescribed


def problem_and_starts(
    study: Study, folder: Path, stop: Callable[[], bool] = lambda: False, jobs: int = 1, say: Say = unsaid
) -> tuple[OptimiseSettings, Begun]:
    """Return settings, problem and starts: the diverse best of the dataset, filled up from samples if too few.

    Where no row of the dataset is feasible, the first starts are the best of random designs.  The mechanisms that do
    the study's [task] come before all others.  With ``optimise.global = "proportions"`` five of six starts come from
    the search over proportions instead, in ``jobs`` processes; ``stop`` ends it early.
    """
    settings, begun = _problem_and_starts(study, folder, stop, jobs, say)
    first = of_task(study, settings.starts, settings.seed)
    count = max(len(begun.starts), len(first))
    origins = None if begun.origins is None else ((-1,) * len(first) + begun.origins)[:count]
    return settings, Begun(begun.problem, np.concatenate([first, begun.starts])[:count], origins)


def _problem_and_starts(
    study: Study, folder: Path, stop: Callable[[], bool], jobs: int, say: Say
) -> tuple[OptimiseSettings, Begun]:
    if study.optimise is None or study.objective is None:
        raise InputError("optimise", None, "an [optimise] section and an objective", str(study.path))
    settings = study.optimise
    count, seed = settings.starts, settings.seed
    designs, merit = best_rows(study.family, study.objective.output, folder)
    if settings.globally == "proportions":
        known = designs if len(designs) else drawn(study, count, seed)
        return settings, proportion_starts(study, settings, problem_of(study, known), known, merit, stop, jobs, say)
    if len(designs):
        problem = problem_of(study, designs)
        own = diverse(problem, designs, merit, count, ALIKE)
        return settings, Begun(problem, filled(study, problem, own, count, seed))
    designs = drawn(study, count, seed)
    if not len(designs):
        allowed = "at least one design that [locus] and [fit] can make"
        raise InputError("design space", study.space.count, allowed, str(study.path))
    problem = problem_of(study, designs)
    # Half of them from the space itself: a sample of the problem's variables may miss what [locus] or [fit] makes.
    own = diverse(problem, designs, ranking(problem, designs), -(-count // 2), ALIKE)
    return settings, Begun(problem, filled(study, problem, own, count, seed))


def optimise_study(
    study: Study,
    folder: str | Path,
    stop: Callable[[], bool] | None = None,
    jobs: int = 1,
    say: Say = unsaid,
) -> Path:
    """Search from diverse best designs of the dataset and write the result beside it.

    Parameters
    ----------
    study : with an objective and [optimise]
    folder : its dataset; where it has no feasible row, the starts come from a sample of the same bounds
    stop : asked often; true ends the search as Ctrl-C does
    jobs : processes the starts are spread over; the result does not depend on it
    say : called with the number of starts that are done and the most there will be, then with what else is worked on

    Returns
    -------
    Path of ``_optimum.parquet``, whose metadata hold what the starts tell of the search (:func:`read_survey`);
    ``_curves.parquet``, ``_sensitivity.parquet`` and, where the study has tolerances, ``_tolerance.parquet`` stand
    beside it.  Each is written as a whole or not at all.

    Raises
    ------
    InputError
        if the study has no objective or no [optimise] section
    StoreError
        if the folder cannot be written
    KeyboardInterrupt
        if the search was stopped, after the best so far was written.
    """
    place = Path(folder)
    brake = Brake(None if study.optimise is None else study.optimise.time_budget, stop)
    settings, (problem, starts, origins) = problem_and_starts(study, place, brake, jobs, say)
    settings = replace(settings, time_budget=None)  # one brake for all that follows
    results, found = explore(
        problem, starts, settings, brake, jobs, lambda done, most: say("optimum", done, most, "starts"), origins
    )
    catalogue = listed(study)
    if catalogue and found.ended not in CUT:
        say("neighbours in the catalogue", 0, 0, "steps")
        results = with_neighbours(problem, results, catalogue, settings, brake, jobs)
    nominal = results[0]
    if study.tolerance is not None and study.tolerance.robust is not None and found.ended not in CUT:
        whole, more = insensitive(study, settings, problem, brake, jobs, say)
        made = robust(
            whole, results, study.tolerance, settings, brake, jobs, more,
            lambda done, total: say("robust design", done, total, "searches"),
        )  # fmt: skip
        results = results if made is None else [made.result, *results]
    if brake.pulled and found.ended not in CUT:
        found = later(found)
    side = store.beside(place)
    parts = 3 if study.tolerance is None else 4
    after = "curves, sensitivities" if study.tolerance is None else "yield, curves, sensitivities, tolerances"
    say(after, 0, parts, "tables")
    frame = _table(study, problem, results, nominal)
    about = {"search": json.dumps(asdict(found)), "summary": "; ".join([found.words, *found.warnings])}
    write(side / store.OPTIMUM, frame, study, about=about)
    say(after, 1, parts, "tables")
    write(side / store.CURVES, _curves(study, frame), study)
    say(after, 2, parts, "tables")
    write(side / store.SENSITIVITY, _by_role(study, frame, _sensitivity), study)
    say(after, 3, parts, "tables")
    if study.tolerance is None:
        (side / store.TOLERANCE).unlink(missing_ok=True)
    else:
        write(side / store.TOLERANCE, _by_role(study, frame, _tolerance), study)
    if found.ended == "interrupted" or (stop is not None and stop()):
        raise KeyboardInterrupt
    return side / store.OPTIMUM


def read_survey(path: Path) -> Survey | None:
    """Return what the starts told of the search that a ``_optimum.parquet`` comes from;
    None where there is no such file.
    """
    noted = metadata(path).get(b"search")
    if noted is None:
        return None
    content = json.loads(noted)
    return Survey(**content | {"kinds": tuple(tuple(kind) for kind in content["kinds"])})


def _table(study: Study, problem: Problem, results: list[Result], nominal: Result) -> dict[str, Any]:
    """Return one row per start, best first, then the reference; a robust design stands before the ``nominal`` best."""
    designs = np.array([r.design for r in results])
    roles = ["nominal" if r is nominal else "start" for r in results[1:]]
    rows: dict[str, list[Any]] = {"role": ["optimum", *roles]}
    rows |= {"start": [r.start for r in results]} | certificates(results)
    if study.reference is not None:
        reference, violation = _reference(study, problem)
        designs = np.concatenate([designs, reference])
        status = st.OK if violation <= 1e-9 else st.LIMIT_EXCEEDED
        last: tuple[Any, ...] = ("reference", -1, violation, np.nan, np.nan, "", "", 1, 0, "", 0, status)
        for name, value in zip(rows, last, strict=True):
            rows[name].append(value)
    if study.tolerance is not None:
        shown = [k for k, role in enumerate(rows["role"]) if role != "start"]
        share = np.full(len(designs), np.nan)
        share[shown] = yields(problem, designs[shown], study.tolerance, _seed(study))
        rows["yield"] = share.tolist()
    columns: dict[str, Any] = {name: designs[:, k] for k, name in enumerate(study.family.parameter_names)}
    return {"role": rows.pop("role"), "start": rows.pop("start")} | columns | outputs(study, designs) | rows


def _seed(study: Study) -> int:
    return 0 if study.optimise is None else study.optimise.seed


def _reference(study: Study, problem: Problem) -> tuple[Array, float]:
    """Return the study's reference design (1, P), which may lie outside the bounds or off the locus,
    and its violation.
    """
    design, _ = design_matrix(study.family, study.reference or {})
    if problem.coordinates is not None:
        problem = problem_of(study, design, on_locus=False)
    model = Model(problem, Program(problem), design[0], lambda: False)
    return design, model.state(problem.scaled(design)[0]).violation


def _curves(study: Study, table: dict[str, Any]) -> dict[str, Any]:
    """Return pose curves of optimum and reference over one turn; no rows where the study wants none."""
    family = study.family
    wanted = [*motion_curves(family), *joint_curves(family)]
    shown = [k for k, role in enumerate(table["role"]) if role in ("optimum", "reference")]
    if study.output.curves == "none" or isinstance(family.domain, Interval):  # there is no turn over an interval
        shown = []
    designs = np.array([[table[name][k] for name in family.parameter_names] for k in shown])
    phi: Array = np.arange(POSES, dtype=np.float64) * (2.0 * np.pi / POSES)
    columns = family.poses(
        designs.reshape(len(shown), len(family.parameters)), Angles.of(phi[None, :]), frozenset(wanted)
    )
    head = {"role": np.repeat([table["role"][k] for k in shown], POSES), "phi": np.tile(phi, len(shown))}
    return head | {name: columns[name].ravel() for name in [*wanted, "status"]}


def _by_role(study: Study, table: dict[str, Any], rows_of: Callable[[Study, Array], dict[str, list[Any]]]) -> Any:
    """Return rows about the optimum and about the reference, one below the other."""
    rows: dict[str, list[Any]] = {"role": []}
    for k, role in enumerate(table["role"]):
        if role != "start":
            own = rows_of(study, np.array([table[name][k] for name in study.family.parameter_names], np.float64))
            rows["role"] += [role] * len(own["output"])
            for name, values in own.items():
                rows.setdefault(name, []).extend(values)
    return rows


def _sensitivity(study: Study, design: Array) -> dict[str, list[Any]]:
    return sensitivities(study.family, design, study.want, study.window)


def _tolerance(study: Study, design: Array) -> dict[str, list[Any]]:
    if study.tolerance is None or study.optimise is None:
        return {}
    return tolerance_rows(
        study.family, design, study.want, study.output_limits, study.tolerance, study.optimise.seed, study.accuracy,
        study.window,
    )  # fmt: skip
