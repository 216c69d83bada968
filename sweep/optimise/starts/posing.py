"""What a study asks of the optimiser: its problem, and the designs that the search starts from."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from sweep.errors import InputError, MissingInput
from sweep.families.base import Array, Parameter
from sweep.optimise.multistart.multistart import listed
from sweep.optimise.multistart.survey import Group
from sweep.optimise.problem.on_locus import LocusCoordinates
from sweep.optimise.problem.statement import Problem
from sweep.optimise.starts.dataset import best_rows, drawn, swept_and_sampled
from sweep.optimise.starts.global_starts import descend_once, from_populations, holding

if TYPE_CHECKING:
    from sweep.study import Study

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
        raise MissingInput("objective", "[objective] minimise = an output", str(study.path))
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
    limits = [limit for limit in study.output_limits if limit.output not in given or limit in study.bands]
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
    """Return the bounds of a parameter or of a prescribed output; None where it is given, or a sign."""
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
    least, most, width = low, high, high - low
    for limit in study.parameter_limits:
        if limit.output == name:
            low = low if limit.minimum is None else max(low, limit.minimum)
            high = high if limit.maximum is None else min(high, limit.maximum)
    if name in (*study.made, *study.rescaled):  # of what is made perhaps no design comes near the limits
        if high <= least:
            low = max(high - width, SHORTEST * high) if parameter.positive else high - width
        elif low >= most:
            high = low + width
    return low, high


def _limited(study: Study, name: str) -> tuple[float, float] | None:
    """Return the limits of a guide's length, which are its bounds where proportions are searched globally."""
    limits = [x for x in study.parameter_limits if x.output == name and x.maximum is not None]
    if not _by_populations(study) or not limits:
        return None
    high = min(x.maximum for x in limits if x.maximum is not None)
    return max((x.minimum for x in limits if x.minimum is not None), default=SHORTEST * high), high


def _prescribed(study: Study) -> tuple[Parameter, ...]:
    return () if study.locus is None else study.locus.prescribed


def problem_and_starts(
    study: Study, folder: Path, stop: Callable[[], bool] = lambda: False, jobs: int = 1
) -> tuple[Problem, Iterator[Group]]:
    """Return the problem of a study and its starts, group by group, each of which is made when it is asked for.

    With ``optimise.global = "proportions"`` they are ends of populations, whose descents run in ``jobs`` threads;
    otherwise they come from the dataset and from samples.  ``stop`` ends it early.
    """
    if study.optimise is None:
        raise MissingInput("optimise", "an [optimise] section", str(study.path))
    designs, merit, problem = _known(study, folder)
    if study.optimise.by_populations:
        return problem, from_populations(study, problem, designs, merit, stop, jobs)
    return problem, swept_and_sampled(study, problem, designs, merit, listed(study), stop)


def compile_descents(study: Study) -> None:
    """Compile or load what the search over proportions of a study runs, on a few designs of its space."""
    designs = drawn(study, 1, 0)
    if len(designs):  # otherwise the search will say what is wrong
        descend_once(study, problem_of(study, designs))


def problem_of_dataset(study: Study, folder: Path, found: Array) -> Problem:
    """Return the problem of a study whose search is done, without searching for starts again.

    Parameters
    ----------
    study : with an objective
    folder : its dataset
    found : designs (k, P) that the search found, which the bounds hold where they follow from such designs

    Raises
    ------
    InputError
        if nothing can change, or neither rows nor a sample give a design.
    """
    problem = _known(study, folder)[2]
    return holding(study, problem, found) if _by_populations(study) else problem


def _known(study: Study, folder: Path) -> tuple[Array, Array, Problem]:
    """Return the best designs of a dataset, their objectives, and the problem.

    Where no design is feasible they are random ones without an objective.
    """
    if study.objective is None:
        raise MissingInput("objective", "[objective] minimise = an output", str(study.path))
    designs, merit = best_rows(study.family, study.objective.output, folder)
    if not len(designs) and study.optimise is not None:
        designs = drawn(study, study.optimise.starts, study.optimise.seed)
    if not len(designs):
        allowed = "at least one design that [locus] and [fit] can make"
        raise InputError("design space", study.space.count, allowed, str(study.path))
    return designs, merit, problem_of(study, designs)


def _by_populations(study: Study) -> bool:
    return study.optimise is not None and study.optimise.by_populations
