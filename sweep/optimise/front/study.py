"""Front of a study: computed from its dataset and its optimum, written to ``_pareto.parquet`` in resumable steps."""

from __future__ import annotations

import json
import time
from collections.abc import Callable
from dataclasses import asdict, replace
from pathlib import Path
from typing import Any

import numpy as np

from sweep.dataset import files
from sweep.dataset.files import metadata
from sweep.errors import MissingInput, SearchCutShort
from sweep.evaluation.summaries import output
from sweep.families.base import Array
from sweep.jobs.progress import Say, unsaid
from sweep.optimise.front.pareto import FrontSearch, advance
from sweep.optimise.local.kkt import noted, result_of
from sweep.optimise.problem.statement import Problem
from sweep.optimise.starts.dataset import best_rows
from sweep.optimise.starts.populations import diverse
from sweep.optimise.starts.posing import problem_of_dataset
from sweep.optimise.study import certificates, outputs, write
from sweep.quantities.units import internal_unit
from sweep.study import Limit, ParetoSettings, Study

KEPT = 2048  # best rows of the dataset within each bound from which starts are chosen
KEY, STATE = b"key", b"state"


def front_study(
    study: Study,
    folder: str | Path,
    key: str,
    stop: Callable[[], bool] | None = None,
    jobs: int = 1,
    say: Say = unsaid,
) -> Path:
    """Minimise the objective for each bound of [pareto] and write the front beside the optimum after every step.

    A front in the folder with the same key is resumed, and ends with the bytes of an uninterrupted one.

    Parameters
    ----------
    study : study with [pareto]
    folder : folder of its dataset, with ``_optimum.parquet``
    key : hash of everything that the result depends on
    stop : called often; true ends the search like Ctrl-C
    jobs : number of processes over which the starts are spread; the result does not depend on it
    say : called with the numbers of finished steps and of all steps of the front

    Returns
    -------
    Path of ``_pareto.parquet``.

    Raises
    ------
    InputError
        if the study has no [pareto] section
    StoreError
        if the folder cannot be written
    KeyboardInterrupt
        if the search was stopped, after the best so far was written
    SearchCutShort
        if ``pareto.time_budget`` stopped it, likewise.
    """
    if study.pareto is None:
        raise MissingInput("pareto", "a [pareto] section", str(study.path))
    dataset = Path(folder)
    settings, path = study.pareto, files.beside(dataset) / files.PARETO
    front = saved(path, key) or FrontSearch.of(settings)
    if front.complete and path.exists():
        return path
    total = front.steps
    say("front", front.taken, total, "steps")
    ends, optimum = _search_ends(study, dataset)
    problem = problem_of_dataset(study, dataset, ends)
    starts = _starts(study, settings, problem, dataset, optimum)
    last_whole, started = front, time.monotonic()
    for best in advance(problem, settings, front, starts, stop, jobs):
        last_whole = best if best.complete or best.taken > last_whole.taken else last_whole
        say("front", last_whole.taken, total, "steps")
        _write(path, study, settings, best, key, last_whole)
    timed_out = settings.time_budget is not None and time.monotonic() - started >= settings.time_budget
    if not last_whole.complete and (not timed_out or (stop is not None and stop())):
        raise KeyboardInterrupt
    if not last_whole.complete:
        _write(path, study, settings, best, key, last_whole, "time")
        done = f"{last_whole.taken} of {last_whole.steps} steps of the front"
        raise SearchCutShort(dataset, f"{path}: time ran out: {done}; run again to continue the front")
    return path


def saved(path: Path, key: str) -> FrontSearch | None:
    """Return the front that a file holds, or None if there is no file or its key differs."""
    about = metadata(path)
    if about.get(KEY) != key.encode():
        return None
    try:
        state = json.loads(about[STATE])
        return FrontSearch(
            tuple(state["bounds"]), tuple(r and result_of(r) for r in state["results"]), tuple(state["found"]),
            state["taken"], state["given"], state["points"], state["filled"],
        )  # fmt: skip
    except (ValueError, KeyError, TypeError):  # damaged: start again
        return None


def _write(
    path: Path,
    study: Study,
    settings: ParetoSettings,
    best: FrontSearch,
    key: str,
    last_whole: FrontSearch,
    ended: str = "",
) -> None:
    """Write ``best`` as rows; the search resumes from ``last_whole``, the front after its last finished step."""
    bounds, results = (list(column) for column in zip(*best.known(), strict=True))
    designs = np.array([r.design for r in results])
    columns: dict[str, Any] = {"bound": bounds}
    columns |= {name: designs[:, k] for k, name in enumerate(study.family.parameter_names)}
    columns |= outputs(study, designs) | certificates(results)
    side = "lower" if settings.at_least else "upper"
    unit = internal_unit(output(study.family, settings.output).unit)
    texts = {"bound": (unit, f"{side} bound on {settings.output}")}
    state = asdict(replace(last_whole, results=())) | {"results": [r and noted(r) for r in last_whole.results]}
    about = {"output": settings.output, "side": "at least" if settings.at_least else "at most"}
    about |= {"complete": str(best.complete).lower(), "steps": f"{last_whole.taken} of {last_whole.steps}"}
    about |= {"ended": ended} if ended else {}
    about |= {KEY.decode(): key, STATE.decode(): json.dumps(state)}
    write(path, columns, study, texts, about)


def _search_ends(study: Study, folder: Path) -> tuple[Array, Array]:
    """Return the designs at which the search for the optimum ended, (k, P), and the optimum (1, P)."""
    rows = files.read_table(files.beside(folder) / files.OPTIMUM)
    designs = rows[list(study.family.parameter_names)].to_numpy(np.float64)
    return designs[rows["role"] != "reference"], designs[rows["role"] == "optimum"]


def _starts(study: Study, settings: ParetoSettings, problem: Problem, folder: Path, optimum: Array) -> list[Array]:
    """Return the starts for each bound, the loosest bound first.

    These are ``optimum`` and diverse good designs of the dataset within the bound.
    """
    assert study.objective is not None
    bounds = FrontSearch.of(settings).bounds
    limits = [Limit(settings.output, *((b, None) if settings.at_least else (None, b))) for b in bounds]
    chosen = []
    for designs, merit in best_rows(study.family, study.objective.output, folder, limits, KEPT):
        good = diverse(problem, designs, merit, settings.starts) if settings.starts else designs[:0]
        chosen.append(np.concatenate([optimum, good]))
    return chosen
