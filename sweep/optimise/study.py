"""A study's optimum: from its dataset to ``_optimum.parquet`` and ``_curves.parquet``."""

from __future__ import annotations

import re
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from kernels import status as st
from sweep import store
from sweep.chunk import parameter_matrix
from sweep.errors import InputError
from sweep.families.base import Angles, Array
from sweep.fit import fit_line
from sweep.optimise.certificate import CAVEAT, Result
from sweep.optimise.form import Program
from sweep.optimise.model import Model
from sweep.optimise.problem import Problem
from sweep.optimise.solve import minimise
from sweep.optimise.starts import from_dataset, from_sample, sign_choices
from sweep.tables import design_matrix

if TYPE_CHECKING:
    from sweep.study import Study

POSES = 720
PILOT, PILOT_RUNS, PILOT_TAILS = 256, 64, (5.0, 95.0)
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
    bounds |= _fitted_bounds(study)
    for limit in study.parameter_limits:
        low, high = bounds.get(limit.output, (-np.inf, np.inf))
        low = low if limit.minimum is None else max(low, limit.minimum)
        high = high if limit.maximum is None else min(high, limit.maximum)
        if limit.output in bounds:
            bounds[limit.output] = low, high
    held = {name: ends[0] for name, ends in study.space.bounds.items() if name in steady and ends[0] == ends[1]}
    names = tuple(name for name in study.family.parameter_names if name in bounds)
    return Problem(
        study.family, names, np.array([bounds[n][0] for n in names]), np.array([bounds[n][1] for n in names]),
        dict(study.space.fixed) | held, study.objective.output, study.output_limits, study.window, study.accuracy,
    )  # fmt: skip


def _fitted_bounds(study: Study) -> dict[str, tuple[float, float]]:
    """Where [fit] sets or scales parameters they become variables: bounds from what it made of designs of the space."""
    if study.fit is None:
        return {}
    length = min(PILOT, study.space.count)
    starts = sorted({k * (study.space.count - length) // PILOT_RUNS for k in range(PILOT_RUNS + 1)})
    pilot = np.concatenate([parameter_matrix(study, start, start + length) for start in starts])
    fitted, status = fit_line(study.family, pilot, study.fit, study.window)
    fitted = fitted[status == st.OK]
    names = {*study.fit.parameters(study.family), *study.fit.rescaled(study.family)}
    columns = {name: fitted[:, study.family.parameter_names.index(name)] for name in sorted(names)}
    # The tails belong to needles that hardly move and were scaled up to the stroke.
    found = {name: np.percentile(values, PILOT_TAILS) for name, values in columns.items() if values.size}
    return {name: (float(low), float(high)) for name, (low, high) in found.items() if low < high}


def optimise_study(study: Study, folder: str | Path, stop: Callable[[], bool] | None = None) -> Path:
    """Search from diverse best designs of the dataset and write the result beside it.

    Parameters
    ----------
    study : with an objective and [optimise]
    folder : its dataset; where it has no feasible row, the starts come from a sample of the same bounds
    stop : asked often; true ends the search as Ctrl-C does

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
        if the search was stopped, after the best so far was written.
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
    if any(result.ended == "interrupted" for result in results) or (stop is not None and stop()):
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
    model = Model(problem, Program(problem), design[0], lambda: False)
    return design, model.state(problem.scaled(design)[0]).violation


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
    phi: Array = np.arange(POSES, dtype=np.float64) * (2.0 * np.pi / POSES)
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
