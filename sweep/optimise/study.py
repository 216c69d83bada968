"""A study's optimum: from its dataset to ``_optimum.parquet`` and ``_curves.parquet``."""

from __future__ import annotations

import re
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from kernels import status as st
from sweep import store
from sweep.errors import InputError
from sweep.families.base import Angles, Array
from sweep.optimise.certificate import CAVEAT, Result
from sweep.optimise.descent import Descent
from sweep.optimise.form import Program
from sweep.optimise.problem import Problem
from sweep.optimise.solve import minimise
from sweep.optimise.starts import from_dataset, from_sample, sign_choices
from sweep.tables import design_matrix

if TYPE_CHECKING:
    from sweep.study import Study

POSES = 720
_DRAWN = re.compile(r"(pressure_angle|[xyz]_[a-z])\d*")

TEXTS = {
    "role": ("", "optimum (the best start's result), start (another start's), or reference"),
    "start": ("", "number of the start, best candidate first; -1 for the reference"),
    "violation": ("1", "largest violation of a limit, relative to the limit; cos^2 for pressure angles"),
    "kkt_residual": ("1", "residual of the optimality conditions, variables scaled to their bounds"),
    "gap": ("1", "difference of the maximum the search worked with and the verified one, relative"),
    "active": ("", "limits and bounds that hold the result back"),
    "relaxation": ("", "where infeasible: by how much each limit would have to give way, in its internal unit"),
    "agree": ("", "number of starts whose objective is within 1e-4 of the best; 1 for those that are not"),
    "ended": ("", "converged, stalled, infeasible, time or interrupted"),
    "status": ("", "see kernels.status"),
}


def problem_of(study: Study) -> Problem:
    """The optimisation problem of a study: its swept steady parameters between the ends of their axes.

    Raises
    ------
    InputError
        if the study has no objective, or nothing that can change.
    """
    if study.objective is None:
        raise InputError("objective", None, "[objective] minimise = an output", str(study.path))
    steady = {p.name for p in study.family.parameters if p.choices is None}
    bounds = {name: ends for name, ends in study.space.bounds.items() if name in steady and ends[0] < ends[1]}
    held = {name: ends[0] for name, ends in study.space.bounds.items() if name in steady and ends[0] == ends[1]}
    names = tuple(name for name in study.family.parameter_names if name in bounds)
    return Problem(
        study.family, names, np.array([bounds[n][0] for n in names]), np.array([bounds[n][1] for n in names]),
        dict(study.space.fixed) | held, study.objective.output, study.limits, study.window, study.accuracy,
    )  # fmt: skip


def optimise_study(study: Study, folder: str | Path, stop: Callable[[], bool] | None = None) -> Path:
    """Search from diverse best designs of the dataset and write the result beside it.

    Parameters
    ----------
    study : with an objective and [optimise]
    folder : its dataset; where it has no feasible row, the starts come from a sample of the same bounds
    stop : asked often; true ends the search, the best so far is written

    Returns
    -------
    Path of ``_optimum.parquet``; ``_curves.parquet`` stands beside it.  Both are written as a whole or not at all.

    Raises
    ------
    InputError
        if the study has no objective or no [optimise] section
    StoreError
        if the folder cannot be written
    KeyboardInterrupt
        again, after the best so far was written.
    """
    place = Path(folder)
    if study.optimise is None:
        raise InputError("optimise", None, "an [optimise] section", str(study.path))
    problem = problem_of(study)
    starts = from_dataset(problem, place, study.optimise.starts)
    if not len(starts):
        starts = from_sample(problem, sign_choices(study), study.optimise.starts, study.optimise.seed)
    results = minimise(problem, starts, study.optimise, stop)
    frame = _table(study, problem, results)
    _write(place / store.OPTIMUM, frame, study)
    _write(place / store.CURVES, _curves(study, frame), study)
    if any(result.ended == "interrupted" for result in results):
        raise KeyboardInterrupt
    return place / store.OPTIMUM


def _table(study: Study, problem: Problem, results: list[Result]) -> dict[str, Any]:
    """One row per start, best first, then the reference."""
    designs = np.array([r.design for r in results])
    rows: dict[str, list[Any]] = {
        "role": ["optimum", *("start" for _ in results[1:])],
        "start": [r.start for r in results],
        "violation": [r.violation for r in results],
        "kkt_residual": [r.kkt_residual for r in results],
        "gap": [r.gap for r in results],
        "active": ["; ".join(r.active) for r in results],
        "relaxation": ["; ".join(f"{k} by {v:.6g}" for k, v in r.relaxation.items()) for r in results],
        "agree": [r.agree for r in results],
        "ended": [r.ended for r in results],
        "status": [r.status for r in results],
    }
    if study.reference is not None:
        reference, violation = _reference(study, problem)
        designs = np.concatenate([designs, reference])
        status = st.OK if violation <= 1e-9 else st.LIMIT_EXCEEDED
        last: tuple[Any, ...] = ("reference", -1, violation, np.nan, np.nan, "", "", 1, "", status)
        for name, value in zip(rows, last, strict=True):
            rows[name].append(value)
    columns: dict[str, Any] = {name: designs[:, k] for k, name in enumerate(study.family.parameter_names)}
    return {"role": rows.pop("role"), "start": rows.pop("start")} | columns | _outputs(study, designs) | rows


def _reference(study: Study, problem: Problem) -> tuple[Array, float]:
    """The study's reference design (1, P), which may lie outside the bounds, and its largest violation."""
    design, _ = design_matrix(study.family, study.reference or {})
    descent = Descent(problem, Program(problem), design[0], lambda: False)
    return design, descent.state(problem.scaled(design)[0]).violation


def _outputs(study: Study, designs: Array) -> dict[str, Any]:
    from sweep.summaries import design_outputs

    columns = design_outputs(study.family, designs, study.want, study.accuracy, study.window)
    return {name: values for name, values in columns.items() if name != "status"}


def _curves(study: Study, table: dict[str, Any]) -> dict[str, Any]:
    """Pose curves of optimum and reference over one turn; no rows where the study wants none."""
    family = study.family
    motion = [family.position, *(f"d{n}{family.position}" for n in ("", "2", "3")), "dev"]
    wanted = [name for name in family.pose_names if name in motion or _DRAWN.fullmatch(name)]
    shown = [k for k, role in enumerate(table["role"]) if role in ("optimum", "reference")]
    if study.output.curves == "none":
        shown = []
    designs = np.array([[table[name][k] for name in family.parameter_names] for k in shown])
    phi = np.arange(POSES) * (2.0 * np.pi / POSES)
    columns = family.poses(
        designs.reshape(len(shown), len(family.parameters)), Angles.of(phi[None, :]), frozenset(wanted)
    )
    head = {"role": np.repeat([table["role"][k] for k in shown], POSES), "phi": np.tile(phi, len(shown))}
    return head | {name: columns[name].ravel() for name in [*wanted, "status"]}


def _write(path: Path, columns: dict[str, Any], study: Study) -> None:
    import pyarrow as pa
    import pyarrow.parquet as pq

    from sweep.plan import PARAMETER_UNITS
    from sweep.summaries import output

    family = study.family
    texts = (
        {p.name: (PARAMETER_UNITS[p.unit], p.text) for p in family.parameters} | TEXTS | {"phi": ("rad", "crank angle")}
    )
    texts |= {o.name: (o.unit.replace("length", "mm"), o.text) for o in family.pose_outputs}
    for name in columns:
        if name not in texts:
            wanted = output(family, name.removeprefix("err_"))
            text = f"error estimate of {wanted.text}" if name.startswith("err_") else wanted.text
            texts[name] = (wanted.unit.replace("length", "mm"), text)
    arrays = {name: pa.array(_plain(values)) for name, values in columns.items()}
    fields = [
        pa.field(name, array.type, metadata={"unit": texts[name][0], "definition": texts[name][1]})
        for name, array in arrays.items()
    ]
    schema = pa.schema(fields, metadata={"study": study.name, "fingerprint": study.fingerprint, "caveat": CAVEAT})
    sink = pa.BufferOutputStream()
    pq.write_table(pa.Table.from_arrays(list(arrays.values()), schema=schema), sink, compression="zstd")
    store.write_atomically(path, bytes(sink.getvalue()))


def _plain(values: Any) -> Any:
    array = np.asarray(values)
    return array.tolist() if array.dtype.kind == "U" else array
