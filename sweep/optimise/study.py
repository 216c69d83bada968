"""Optimum of a study: computed from its dataset, written to ``_optimum.parquet`` and the tables beside it."""

from __future__ import annotations

import json
import math
import tomllib
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from dataclasses import asdict, replace
from pathlib import Path
from types import MappingProxyType
from typing import Any

import numpy as np

from kernels import status as st
from sweep.chunks.cascade import Dropped
from sweep.chunks.plan import PARAMETER_UNITS, error_words
from sweep.dataset import files
from sweep.evaluation.curves import joint_curves, motion_curves
from sweep.evaluation.summaries import design_outputs, output
from sweep.evaluation.tables import design_matrix
from sweep.families.base import Angles, Array, Columns, Interval
from sweep.families.names import is_error, without_error
from sweep.jobs.progress import AT_MOST, Say, best_words, unsaid
from sweep.jobs.signals import Deadline
from sweep.optimise.local.kkt import CAVEAT, Result, noted, result_of
from sweep.optimise.local.model import Model
from sweep.optimise.manufacture.margins import inequalities
from sweep.optimise.manufacture.robust import best_yield_first, robust
from sweep.optimise.manufacture.sample import Sampler, keeping, limits_of_made, manufactured, tolerance_rows
from sweep.optimise.manufacture.tolerance import sensitivities
from sweep.optimise.multistart.multistart import explore, listed, with_neighbours
from sweep.optimise.multistart.survey import CUT, Survey, survey_of
from sweep.optimise.problem.program import Program
from sweep.optimise.problem.statement import Problem
from sweep.optimise.starts.posing import problem_and_starts, problem_of, problem_of_dataset
from sweep.optimise.starts.proportions import enclosing, insensitive
from sweep.study import Limit, Study

COLUMNS = Path(__file__).parents[1] / "columns.toml"


def certificates(results: list[Result]) -> dict[str, list[Any]]:
    """Return violation, optimality residual, active limits and ending of each result, as table columns."""
    return {
        "violation": [r.violation for r in results],
        "kkt_residual": [r.kkt_residual for r in results],
        "gap": [r.gap for r in results],
        "active": ["; ".join(r.active) for r in results],
        "relaxation": [r.given_way for r in results],
        "agree": [r.agree for r in results],
        "basin": [r.basin for r in results],
        "ended": [r.ended for r in results],
        "looks": [r.looks for r in results],
        "status": [r.status for r in results],
    }


def outputs(study: Study, designs: Array) -> dict[str, Any]:
    """Return every wanted output of designs (k, P), with its error estimate."""
    columns = design_outputs(study.family, designs, study.want, study.accuracy, study.window)
    return {name: values for name, values in columns.items() if name != "status"}


def write(
    path: Path,
    columns: dict[str, Any],
    study: Study,
    own_texts: Mapping[str, tuple[str, str]] = MappingProxyType({}),
    about: Mapping[str, str] = MappingProxyType({}),
) -> None:
    """Write a table whose field metadata give unit and definition; ``own_texts`` add definitions for this table.

    The metadata of the file name the study and hold ``about``.
    """
    import pyarrow as pa
    import pyarrow.parquet as pq

    family = study.family
    texts: dict[str, Sequence[str]] = {p.name: (PARAMETER_UNITS[p.unit], p.text) for p in family.parameters}
    texts |= tomllib.loads(COLUMNS.read_text(encoding="utf-8"))
    texts |= {o.name: (o.unit.replace("length", "mm"), o.text) for o in family.pose_outputs}
    texts |= own_texts
    for name in columns:
        if name not in texts:
            plain = without_error(name)
            wanted = output(family, plain)
            text = f"{error_words(study, plain)} of {wanted.text}" if is_error(name) else wanted.text
            texts[name] = (wanted.unit.replace("length", "mm"), text)
    arrays = {name: pa.array(np.asarray(values)) for name, values in columns.items()}
    fields = [
        pa.field(name, array.type, metadata={"unit": texts[name][0], "definition": texts[name][1]})
        for name, array in arrays.items()
    ]
    metadata = {"study": study.name, "fingerprint": study.fingerprint, "caveat": CAVEAT} | dict(about)
    schema = pa.schema(fields, metadata=metadata)
    sink = pa.BufferOutputStream()
    table = pa.Table.from_arrays(list(arrays.values()), schema=schema)
    pq.write_table(table, sink, compression="zstd", write_page_checksum=True)
    files.write_atomically(path, bytes(sink.getvalue()))


POSES = 720


def optimise_study(
    study: Study,
    folder: str | Path,
    stop: Callable[[], bool] | None = None,
    jobs: int = 1,
    say: Say = unsaid,
    key: str = "",
) -> Path:
    """Search from diverse good designs of the dataset and write the result beside it.

    Parameters
    ----------
    study : study with an objective and [optimise]
    folder : folder of its dataset; if that has no feasible row, the starts come from a sample within the same bounds
    stop : called often; true ends the search like Ctrl-C
    jobs : number of processes over which the starts are spread; the result does not depend on it
    say : called with the number of finished starts and its maximum, then with the name of each further step
    key : hash of everything that the result depends on; a stopped search with this key continues after its finished
        parts and ends with the same bytes; without a key nothing is kept

    Returns
    -------
    Path of ``_optimum.parquet``, whose metadata hold the survey of the starts, which
    :func:`sweep.optimise.multistart.survey.read_survey` reads.  ``_curves.parquet``, ``_sensitivity.parquet`` and, for
    a study with tolerances, ``_tolerance.parquet`` and ``_made.parquet`` are written beside it.  Each file is written
    as a whole or not at all.

    Raises
    ------
    InputError
        if the study has no objective or no [optimise] section
    StoreError
        if the folder cannot be written
    KeyboardInterrupt
        if the search was stopped, after the best result so far was written.
    """
    dataset = Path(folder)
    results_folder = files.beside(dataset)
    kept = files.Kept(results_folder / files.SEARCH if key else None, key)
    deadline = Deadline(None if study.optimise is None else study.optimise.time_budget, stop)
    problem, results, survey = _nominal_search(study, dataset, deadline, jobs, say, kept)
    nominal, settings = results[0], study.optimise
    sampled: Columns = {}
    if study.tolerance is not None and study.tolerance.robust is not None and settings and survey.ended not in CUT:
        unhurried = replace(settings, time_budget=None)  # one deadline for all following steps
        stored = kept.parts.get("insensitive")
        robust_starts = np.array(stored) if stored else insensitive(study, unhurried, problem, deadline, jobs, say)
        if not deadline():
            kept.note("insensitive", robust_starts.tolist())
        robust_problem = enclosing(study, problem, robust_starts)
        robust_result = robust(
            robust_problem, results, study.tolerance, unhurried, deadline, jobs, robust_starts,
            lambda done, total, best: say("robust design", done, total, f"searches {AT_MOST}{best}"), kept,
        )  # fmt: skip
        if robust_result is not None:
            results, sampled = [robust_result.result, *results], robust_result.outputs
    if deadline.pulled and survey.ended not in CUT:
        survey = replace(survey, ended="time", late=True)
    frame = _table(study, problem, results, nominal)
    about = {"search": json.dumps(asdict(survey)), "summary": "; ".join([survey.words, *survey.warnings])}
    say("tables", 0, 3, "tables")
    write(results_folder / files.OPTIMUM, frame, study, about=about)
    say("tables", 1, 3, "tables")
    write(results_folder / files.CURVES, _curves(study, frame), study)
    say("tables", 2, 3, "tables")
    slopes = _by_role(study, frame, lambda design: sensitivities(study.family, design, study.want, study.window))
    write(results_folder / files.SENSITIVITY, slopes, study)
    for name in (files.TOLERANCE, files.MADE):
        (results_folder / name).unlink(missing_ok=True)
    stopped = survey.ended == "interrupted"
    if study.tolerance is not None and settings is not None and not stopped:
        with suppress(Dropped):
            sampler = Sampler(problem, study.tolerance, settings.seed, stop or (lambda: False), jobs)
            _write_made(study, results_folder, sampler, inequalities(problem), frame, sampled, say)
            write(results_folder / files.OPTIMUM, frame, study, about=about)  # with the yields
    if stopped or (stop is not None and stop()):
        raise KeyboardInterrupt
    if not deadline.pulled:
        kept.forget()
    return results_folder / files.OPTIMUM


def _nominal_search(
    study: Study, dataset: Path, deadline: Deadline, jobs: int, say: Say, kept: files.Kept
) -> tuple[Problem, list[Result], Survey]:
    """Return the problem, the results of the nominal search, best first, and its survey, or those kept by `Kept`."""
    stored = kept.parts.get("drawing")
    if stored is not None:
        problem = problem_of_dataset(study, dataset, np.empty((0, len(study.family.parameters))))
        problem = replace(problem, lower=np.array(stored["lower"]), upper=np.array(stored["upper"]))
        return problem, [result_of(r) for r in stored["results"]], survey_of(stored["survey"])
    problem, groups = problem_and_starts(study, dataset, deadline, jobs)
    assert study.optimise is not None
    settings = replace(study.optimise, time_budget=None)
    unit = "populations" if settings.by_populations else "starts"
    results, survey, problem = explore(
        problem, groups, settings, deadline, jobs,
        lambda done, limit, best: say("search", done, limit, f"{unit} {AT_MOST}{best_words(best)}"),
    )  # fmt: skip
    catalogue = listed(study)
    if catalogue and survey.ended not in CUT:
        say("search in the catalogue", 0, 0, "steps")
        results = with_neighbours(problem, results, catalogue, settings, deadline, jobs)
    if study.tolerance is not None and survey.ended not in CUT:
        tell = _counted(say, "equally good designs", 0)
        with suppress(Dropped):
            sampler = Sampler(problem, study.tolerance, settings.seed, deadline, jobs, tell)
            results = best_yield_first(sampler, problem, results)
    if not deadline.pulled and survey.ended not in CUT:
        bounds = {"lower": problem.lower.tolist(), "upper": problem.upper.tolist()}
        kept.note("drawing", bounds | {"results": [noted(r) for r in results], "survey": asdict(survey)})
    return problem, results, survey


def _table(study: Study, problem: Problem, results: list[Result], nominal: Result) -> dict[str, Any]:
    """Return one row per start, best first, then the reference; a robust design precedes the ``nominal`` best."""
    designs = np.array([r.design for r in results])
    roles = ["nominal" if r is nominal else "start" for r in results[1:]]
    rows: dict[str, list[Any]] = {"role": ["optimum", *roles]}
    rows |= {"start": [r.start for r in results]} | certificates(results)
    if study.reference is not None:
        reference, violation = _reference(study, problem)
        designs = np.concatenate([designs, reference])
        status = st.OK if violation <= 1e-9 else st.LIMIT_EXCEEDED
        reference_row: tuple[Any, ...] = ("reference", -1, violation, np.nan, np.nan, "", "", 1, 0, "", 0, status)
        for name, value in zip(rows, reference_row, strict=True):
            rows[name].append(value)
    if study.tolerance is not None:
        rows["yield"] = [math.nan] * len(designs)
    columns: dict[str, Any] = {name: designs[:, k] for k, name in enumerate(study.family.parameter_names)}
    return {"role": rows.pop("role"), "start": rows.pop("start")} | columns | outputs(study, designs) | rows


def _counted(say: Say, label: str, total: int) -> Callable[[int], None]:
    """Return a function that reports progress by the number of further mechanisms."""
    done = 0

    def tell(mechanisms: int) -> None:
        nonlocal done
        done += mechanisms
        say(label, done, total, "mechanisms")

    return tell


def _write_made(
    study: Study,
    folder: Path,
    sampler: Sampler,
    limits: Sequence[Limit],
    table: dict[str, Any],
    known: Columns,
    say: Say,
) -> None:
    """Sample what is made of the designs of a table, write tables about it, and add their yields to that table.

    ``known`` are outputs of the optimum's mechanisms that have been computed already.
    """
    designs = np.array([table[name] for name in study.family.parameter_names], np.float64).T
    shown = [k for k, role in enumerate(table["role"]) if role != "start"]
    names = [limit.output for limit in (*limits, *limits_of_made(study)) if limit.output not in known]
    total = sampler.planned(designs[0], len(shown) - (not names) if limits else 0, 1 + ("reference" in table["role"]))
    sampler = replace(sampler, tell=_counted(say, "what is made", total))
    columns = known | sampler.outputs(designs[0], names)
    table["yield"][0] = float(keeping(limits, columns).mean())
    for k in shown[1:]:
        table["yield"][k] = sampler.share(designs[k], limits)
    sample = manufactured(study, designs[0], sampler, columns)
    rows = _by_role(study, table, lambda design: tolerance_rows(sampler, design, study.want, study.output_limits))
    write(folder / files.TOLERANCE, rows, study)
    if sample is not None:
        columns = {sample.output: sample.values, "kept": sample.kept}
        write(folder / files.MADE, columns, study, about={"costs": json.dumps(sample.costs)})


def _reference(study: Study, problem: Problem) -> tuple[Array, float]:
    """Return the study's reference design, (1, P), and its violation.

    The reference may lie outside the bounds or off the locus.
    """
    design, _ = design_matrix(study.family, study.reference or {})
    if problem.coordinates is not None:
        problem = problem_of(study, design, on_locus=False)
    model = Model(problem, Program(problem), design[0], lambda: False)
    return design, model.state(problem.scaled(design)[0]).violation


def _curves(study: Study, table: dict[str, Any]) -> dict[str, Any]:
    """Return pose curves of optimum and reference over one turn, one below the other; none if the study wants none."""
    family = study.family
    shown = study.output.curves != "none" and not isinstance(family.domain, Interval)  # an interval has no turn
    selected = [k for k, role in enumerate(table["role"]) if shown and role in ("optimum", "reference")]
    designs = np.column_stack([table[name] for name in family.parameter_names])[selected]
    wanted = [*motion_curves(family), *joint_curves(family)]
    phi: Array = np.arange(POSES, dtype=np.float64) * (2.0 * np.pi / POSES)
    columns = family.poses(designs, Angles.of(phi[None, :]), frozenset(wanted))
    heads = {"role": np.repeat([table["role"][k] for k in selected], POSES), "phi": np.tile(phi, len(selected))}
    return heads | {name: columns[name].ravel() for name in [*wanted, "status"]}


def _by_role(study: Study, table: dict[str, Any], rows_of: Callable[[Array], dict[str, list[Any]]]) -> Any:
    """Return the rows of a table about the optimum, followed by those about the reference."""
    rows: dict[str, list[Any]] = {"role": []}
    for k, role in enumerate(table["role"]):
        if role in ("optimum", "reference"):
            part = rows_of(np.array([table[name][k] for name in study.family.parameter_names], np.float64))
            rows["role"] += [role] * len(part["output"])
            for name, values in part.items():
                rows.setdefault(name, []).extend(values)
    return rows
