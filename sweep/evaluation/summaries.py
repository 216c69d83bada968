"""``summarise``: what a whole turn says about given designs, one row per design; docs/extrema.md."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from numbers import Real
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from kernels import status as st
from sweep.effects import extended, input_names
from sweep.errors import InputError
from sweep.evaluation.statuses import meanings
from sweep.evaluation.tables import design_matrix, kept_columns, wanted_names
from sweep.families import family as find_family
from sweep.families.base import Accuracy, Array, Columns, Family, Step
from sweep.families.chain import Stage
from sweep.reductions.catalogue import (
    applying_step,
    check_certifiable,
    general_way,
    is_position,
    output,
    output_names,
    proofs,
)
from sweep.reductions.margins import margin_suffixes
from sweep.reductions.means import mean_squares
from sweep.reductions.precise import sharpen_maxima
from sweep.reductions.sampling import Index
from sweep.reductions.turn import Group, group_ns, limits_and_reductions, margin_group

if TYPE_CHECKING:
    import pandas as pd

    from sweep.evaluation.tables import Table

__all__ = ["Route", "design_outputs", "output", "output_names", "routes", "summarise"]

DEFAULT_TARGET = 1e-8
FINEST_TARGET = 1e-14
MOST_SAMPLES = 2**20
FEWEST_SAMPLES = 8

# With these some outputs are missing or rough, the others are worth having.
PARTIAL = (
    st.OK, st.NOT_OSCILLATING, st.NOT_CONVERGED, st.NO_DWELL, st.JAMMED, st.NOT_LINEAR, st.SINGULAR, st.INVALID_INPUT,
)  # fmt: skip


class Route(NamedTuple):
    """Some design outputs that are computed together, by what, and an estimate of the cost [ns per design]."""

    name: str
    outputs: tuple[str, ...]
    ns_per_design: float


@dataclass(frozen=True)
class _Job:
    """A route and how to run it: a step (of a chain's first stage, perhaps), or the general reductions."""

    name: str
    group: Group | Step
    stage: Stage | None
    outputs: tuple[str, ...]
    ns_per_design: float


def summarise(
    family: str | Sequence[str],
    table: Table,
    want: str | Sequence[str],
    *,
    samples: int | None = None,
    accuracy: float | None = None,
    certify: bool | Sequence[str] = False,
    window: tuple[float, float] | None = None,
    keep: bool | str | Sequence[str] = False,
    status_text: bool = False,
) -> pd.DataFrame:
    """Design outputs of mechanisms, one row per design, in the order of the input.

    Parameters
    ----------
    family : "rssr", "guide", ... or a list of them for a chain
    table : DataFrame or mapping with a column per parameter [one length unit, rad], and per input of the effects that
        ``want`` calls for; missing ``branch`` means +1
    want : names of design outputs: ``rotatable``, ``margin``, ``stroke``, ``max_abs_d2s`` ... (see ``sweep families``),
        ``max_force_d``, ``rms_drive_torque``, ``unevenness`` ... (see ``sweep effects``)
    samples : extrema on a dense grid of so many crank angles
    accuracy : true extrema, refined to this relative error; 1e-8 if neither is given
    certify : prove that no peak of the wanted maxima was missed, or of those named (docs/extrema.md, section 5); their
        ``err_`` are then bounds instead of estimates
    window : ``max_abs_dev`` and the other reductions of ``dev`` count only poses whose position lies between these
        fractions of the stroke, measured from its smallest position; default the whole turn
    keep : columns of the table that the result repeats in front: names, or True for all of them
    status_text : add a column ``status_text``, the meaning of ``status`` in words

    Returns
    -------
    DataFrame
        the wanted columns in order, with ``accuracy`` an ``err_<name>`` for each (estimate of its absolute error, same
        unit), and ``status``; indexed like the table.  Where a value is nan, ``status`` says why (see
        :mod:`kernels.status`); a maximum that ``certify`` could not prove keeps the searched value, with NOT_CONVERGED
        and nan as its error.

    Raises
    ------
    InputError
        for an unknown name or a bad value, with column and row; for ``certify`` with a maximum that cannot be proven.
    """
    import pandas as pd

    bare = find_family(family)
    wanted = wanted_names(want, f"design outputs of {bare.name}")
    mechanism = extended(bare, wanted)
    wanted = [name for name in wanted if name != "status"]
    chosen = _accuracy(samples, accuracy, certify)
    if certify:
        check_certifiable(mechanism, wanted, chosen)
    matrix, _ = design_matrix(mechanism, table, unused=input_names(bare))
    columns = design_outputs(mechanism, matrix, wanted, chosen, window)
    errors = [f"err_{name}" for name in wanted] if chosen.target is not None else []
    index = table.index if isinstance(table, pd.DataFrame) else None
    made: dict[str, Any] = {name: columns[name] for name in [*wanted, *errors, "status"]}
    if status_text:
        made["status_text"] = np.array(meanings(columns["status"]), dtype=object)
    return pd.DataFrame(kept_columns(table, keep, made, len(matrix)) | made, index=index)


def design_outputs(
    family: Family,
    designs: Array,
    wanted: Sequence[str],
    accuracy: Accuracy,
    window: tuple[float, float] | None = None,
) -> Columns:
    """Design outputs of a design matrix, cheapest first; what does not turn is left out of the dear ones.

    Parameters
    ----------
    family : any family or chain
    designs : (n, P) matrix with the columns of ``family.parameters``
    wanted : names of design outputs
    accuracy : dense grid or refined
    window : see `summarise`

    Returns
    -------
    Columns
        each wanted name (n,), its ``err_`` where ``accuracy.target`` is set, and ``status``: of several causes the one
        met first

    Raises
    ------
    InputError
        for an unknown name, or a window that is no part of the stroke.
    """
    _check_window(window)
    n = len(designs)
    status = np.zeros(n, np.uint8)
    columns: Columns = {}
    jobs = _jobs(family, wanted, accuracy)
    kinds = {job.group for job in jobs if not isinstance(job.group, Step)}
    if accuracy.samples is not None and kinds and "margin" not in kinds and margin_suffixes(family):
        # Refinement meets a dead point between samples, a plain grid does not.
        status = margin_group(family, designs, (), accuracy)["status"].astype(np.uint8)
    for job in jobs:
        # A follower that turns fully has no limit positions, or no dwell, but extrema it has; one that jams moves.
        alive = np.flatnonzero(np.isin(status, PARTIAL))
        found = _run(family, job, designs[alive], accuracy, window)
        for name in job.outputs:
            for key in (name, f"err_{name}") if accuracy.target is not None else (name,):
                columns[key] = _spread(found[key], alive, n)
        now = found["status"].astype(np.uint8)
        status[alive] = np.where(status[alive] == st.OK, now, status[alive])
    return {name: columns[name] for name in dict.fromkeys(_with_errors(wanted, accuracy))} | {"status": status}


def routes(family: Family, wanted: Sequence[str], accuracy: Accuracy) -> tuple[Route, ...]:
    """What will be computed and how, cheapest first; each route's outputs can be asked of `design_outputs` alone.

    Raises
    ------
    InputError
        for an unknown name.
    """
    return tuple(Route(job.name, job.outputs, job.ns_per_design) for job in _jobs(family, wanted, accuracy))


def _jobs(family: Family, wanted: Sequence[str], accuracy: Accuracy) -> list[_Job]:
    steps: dict[tuple[str, int], tuple[Step, Stage | None, list[str]]] = {}
    groups: dict[tuple[Group, str], list[str]] = {}
    ways = {name: (applying_step(family, name, accuracy), general_way(family, name)) for name in dict.fromkeys(wanted)}
    # The margin of a whole chain asks all stages: a first one judged by itself would take its designs from the others.
    together = any(
        own is None and way is not None and way.kind == "margin" and not way.suffix for own, way in ways.values()
    )
    for name, (own, way) in ways.items():
        if own is not None and not (together and way is not None and way.kind == "margin"):
            step, stage = own
            steps.setdefault((step.name, stage.number if stage else 0), (step, stage, []))[2].append(name)
        elif way is not None:
            position: Group = "limits" if is_position(family, way.of) else "reductions"
            group: Group = "margin" if way.kind == "margin" else "means" if way.kind == "mean" else position
            # Each effect by itself: one that jams or leaves its range takes nothing from the others.
            effect = family.dear.get(way.of, ("", 0.0))[0]
            groups.setdefault((group, effect), []).append(name)
        else:
            output(family, name)  # unknown names end here, with the nearest known one
            allowed = "another accuracy: this output is only computed " + (
                "with accuracy=, not on samples" if accuracy.samples is not None else "on samples, not with accuracy="
            )
            raise InputError("output", name, allowed, f"design outputs of {family.name}")
    jobs = [
        _Job(f"stage 1: {step.name}" if stage else step.name, step, stage, tuple(names), step.cost(accuracy))
        for step, stage, names in steps.values()
    ]
    jobs += [
        _Job(f"{group} {effect}".rstrip(), group, None, tuple(names), group_ns(family, group, tuple(names), accuracy))
        for (group, effect), names in groups.items()
    ]
    return sorted(jobs, key=lambda job: job.ns_per_design)


def _run(family: Family, job: _Job, designs: Array, accuracy: Accuracy, window: tuple[float, float] | None) -> Columns:
    if job.group == "margin":
        return margin_group(family, designs, job.outputs, accuracy)
    if job.group == "means":
        return mean_squares(family, designs, job.outputs, accuracy)
    if not isinstance(job.group, Step):
        return limits_and_reductions(family, designs, job.outputs, accuracy, window)
    own = {name: name.removesuffix("1") if job.stage else name for name in job.outputs}
    part, mechanism = (job.stage.designs(designs), job.stage.family) if job.stage else (designs, family)
    found = job.group.run(part, frozenset(own.values()), accuracy)
    if accuracy.target is not None:
        for plain in own.values():
            # A step that serves a target promises it; one that estimates its error says so itself.
            found.setdefault(f"err_{plain}", accuracy.target * np.abs(np.asarray(found[plain], np.float64)))
            located = any(o.name == f"phi_{plain}" for o in job.group.provides)
            if plain.startswith("max_abs_") and located and mechanism.precise_poses and not accuracy.certify:
                sharpen_maxima(mechanism, job.group, part, plain, found, accuracy.target)
    return {"status": found["status"]} | {
        key: found[own_key]
        for name, plain in own.items()
        for key, own_key in ((name, plain), (f"err_{name}", f"err_{plain}"))
        if own_key in found
    }


def _spread(values: NDArray[np.generic], rows: Index, n: int) -> NDArray[np.generic]:
    """Values of some rows as a whole column: False or nan in the others."""
    if rows.size == n:
        return values
    whole: NDArray[np.generic] = np.zeros(n, np.bool_) if values.dtype == np.bool_ else np.full(n, np.nan)
    whole[rows] = values
    return whole


def _with_errors(wanted: Sequence[str], accuracy: Accuracy) -> list[str]:
    return [*wanted, *(f"err_{name}" for name in wanted if accuracy.target is not None)]


def _accuracy(samples: int | None, accuracy: float | None, certify: bool | Sequence[str] = False) -> Accuracy:
    if samples is not None and accuracy is not None:
        raise InputError("samples", samples, "either samples= or accuracy=, not both", "summarise")
    if not isinstance(certify, (bool, str)) and not (
        isinstance(certify, Sequence) and all(isinstance(name, str) for name in certify)
    ):
        raise InputError("certify", certify, "True, False, or names of maxima", "summarise")
    if samples is not None and certify:
        raise InputError("certify", certify, "accuracy=, not samples=: a grid proves nothing", "summarise")
    if samples is not None:
        if not (isinstance(samples, Real) and FEWEST_SAMPLES <= samples <= MOST_SAMPLES and int(samples) == samples):
            raise InputError("samples", samples, f"a whole number from {FEWEST_SAMPLES} to {MOST_SAMPLES}", "summarise")
        return Accuracy(samples=int(samples))
    target = DEFAULT_TARGET if accuracy is None else accuracy
    if not (isinstance(target, Real) and FINEST_TARGET <= target <= 0.1):
        raise InputError("accuracy", accuracy, f"a relative error from {FINEST_TARGET:g} to 0.1", "summarise")
    prove, proven = proofs(certify)
    return Accuracy(target=float(target), certify=prove, proven=proven)


def _check_window(window: tuple[float, float] | None) -> None:
    if window is None:
        return
    two = isinstance(window, Sequence) and len(window) == 2 and all(isinstance(x, Real) for x in window)
    if not (two and 0.0 <= window[0] < window[1] <= 1.0):
        raise InputError("window", window, "two fractions of the stroke, 0 <= from < to <= 1", "design outputs")
