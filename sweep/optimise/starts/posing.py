"""The optimisation problem of a study, and the designs from which its search starts."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np

from sweep.errors import InputError, MissingInput, how_many
from sweep.families.base import Array
from sweep.optimise.multistart.multistart import listed
from sweep.optimise.multistart.survey import StartGroup
from sweep.optimise.problem.on_locus import LocusCoordinates
from sweep.optimise.problem.statement import Problem
from sweep.optimise.starts.dataset import best_rows, random_designs, swept_and_sampled
from sweep.optimise.starts.proportions import descend_once, enclosing, from_populations
from sweep.quantities.limits import Limit, tightest
from sweep.study import Study

WHOLE_TURN = 2.0 * np.pi - 1e-9
SHORTEST = 0.02  # lower bound of a length without a lower limit, relative to its upper limit
TAILS = (2.0, 98.0)  # percent; designs beyond had hardly any motion and were scaled up to the stroke


def problem_of(study: Study, designs: Array, on_locus: bool | None = None) -> Problem:
    """Return the optimisation problem of a study.

    Swept continuous parameters vary between the ends of their axes, those that [locus] or [fit] sets or scales over the
    range of ``designs`` (k, P) widened by half its size; limits on parameters narrow both.  An angle swept over a whole
    turn may continue for half a turn.  Parameters given as lists of values are not varied: each start keeps its own.

    On the locus, the prescribed outputs are varied instead of the links: fixed values hold by construction, axes are
    bounds, limits on links stay limits.  Otherwise prescribed outputs become limits: equations if they are fixed.

    Parameters
    ----------
    study : with an objective
    designs : (k, P) from its space
    on_locus : None follows ``optimise.variables``, by default the locus if [locus] fixes swing, stroke or phi0

    Raises
    ------
    InputError
        if the study has no objective, or nothing that can change.
    """
    if study.objective is None:
        raise MissingInput("objective", "[objective] minimise = an output", str(study.path))
    use_locus = _uses_locus(study) if on_locus is None else on_locus
    coordinates = LocusCoordinates(study.locus) if study.locus and use_locus else None
    follows, given = ((), ()) if coordinates is None else (coordinates.made, coordinates.given)
    catalogue = listed(study)
    bounds = {
        name: None if name in catalogue else _bounds(study, name, designs)
        for name in (*study.family.parameter_names, *given)
    }
    varied = {name: ends for name, ends in bounds.items() if ends is not None and name not in follows}
    constant = {name: ends[0] for name, ends in varied.items() if ends[0] == ends[1]}
    names = tuple(name for name in varied if name not in constant)
    parameters = [name for name in (*study.family.parameter_names, *given) if name not in follows]
    fixed = {name: abs(x) if name in given else x for name, x in study.space.fixed.items() if name in parameters}
    limits = [limit for limit in study.output_limits if limit.output not in given or limit in study.bands]
    limits += [limit for limit in study.parameter_limits if limit.output in (*follows, *catalogue)]
    if not names:
        allowed = "a parameter that changes steadily beside the listed ones; the sweep has tried them all"
        raise InputError("optimise", ", ".join(catalogue), allowed, str(study.path))
    return Problem(
        study.family, names, np.array([varied[n][0] for n in names]), np.array([varied[n][1] for n in names]),
        fixed | constant, study.objective.output, tuple(limits), study.window, study.accuracy, coordinates,
    )  # fmt: skip


def _uses_locus(study: Study) -> bool:
    """Tell whether the search uses the locus: as the study says, by default if that eliminates an equation."""
    if study.optimise is not None and study.optimise.variables is not None:
        return study.optimise.variables == "locus"
    return any(limit.output in study.prescribed and limit.minimum == limit.maximum for limit in study.limits)


def _bounds(study: Study, name: str, designs: Array) -> tuple[float, float] | None:
    """Return the bounds of a parameter or of a prescribed output; None if it is fixed, or a sign."""
    names = study.family.parameter_names
    prescribed = () if study.locus is None else study.locus.prescribed
    parameter = next(p for p in (*study.family.parameters, *prescribed) if p.name == name)
    if parameter.choices is not None:
        return None
    ends = _length_bounds(study, name)
    if name in study.rescaled and ends is not None:
        return ends
    if name in (*study.made, *study.rescaled):
        low, high = (float(end) for end in np.percentile(designs[:, names.index(name)], TAILS))
        widening = 0.5 * max(abs(low), abs(high)) if parameter.unit == "length" else 0.5
        low, high = (0.2 * low if parameter.positive else low - widening), high + widening
    elif name in study.space.bounds:
        low, high = study.space.bounds[name]
        if name not in names and not name.startswith("phi"):
            low, high = sorted((abs(low), abs(high)))  # the branch gives the sign of swing and stroke
        elif parameter.unit == "angle" and high - low >= WHOLE_TURN:
            low, high = low - np.pi, high + np.pi
    else:
        return None
    swept_low, swept_high, width = low, high, high - low
    low, high = tightest([Limit(name, low, high), *study.parameter_limits], name)
    if name in (*study.made, *study.rescaled):  # perhaps no design of [locus] or [fit] comes near the limits
        if high <= swept_low:
            low = max(high - width, SHORTEST * high) if parameter.positive else high - width
        elif low >= swept_high:
            high = low + width
    return low, high


def _length_bounds(study: Study, name: str) -> tuple[float, float] | None:
    """Return the limits of a guide's length, which are its bounds in a global search over proportions."""
    low, high = tightest(study.parameter_limits, name)
    if study.optimise is None or not study.optimise.by_populations or math.isinf(high):
        return None
    return SHORTEST * high if math.isinf(low) else low, high


def problem_and_starts(
    study: Study, folder: Path, stop: Callable[[], bool] = lambda: False, jobs: int = 1
) -> tuple[Problem, Iterator[StartGroup]]:
    """Return the problem of a study and an iterator of its groups of starts, each made when requested.

    With ``optimise.global = "proportions"`` they are ends of populations, whose descents run in ``jobs`` threads;
    otherwise they come from the dataset and from samples.  ``stop`` ends the iteration early.
    """
    if study.optimise is None:
        raise MissingInput("optimise", "an [optimise] section", str(study.path))
    designs, merit, problem = _designs_and_problem(study, folder)
    if study.optimise.by_populations:
        return problem, from_populations(study, problem, designs, merit, stop, jobs)
    return problem, swept_and_sampled(study, problem, designs, merit, listed(study), stop)


def compile_descents(study: Study) -> None:
    """Compile or load the kernels of a study's search over proportions, with a few designs of its space."""
    designs = random_designs(study, 1, 0)
    if len(designs):  # otherwise the search reports the fault
        descend_once(study, problem_of(study, designs))


def problem_of_dataset(study: Study, folder: Path, ends: Array) -> Problem:
    """Return the problem of a study whose search is finished, without searching for starts again.

    Parameters
    ----------
    study : study with an objective
    folder : folder of its dataset
    ends : designs (k, P) of the search, which the bounds must contain if they depend on such designs

    Raises
    ------
    InputError
        if nothing can change, or neither rows nor a sample give a design.
    """
    problem = _designs_and_problem(study, folder)[2]
    by_populations = study.optimise is not None and study.optimise.by_populations
    return enclosing(study, problem, ends) if by_populations else problem


def _designs_and_problem(study: Study, folder: Path) -> tuple[Array, Array, Problem]:
    """Return the best designs of a dataset, their objectives, and the problem.

    Without a feasible row the designs are random ones without an objective.
    """
    if study.objective is None:
        raise MissingInput("objective", "[objective] minimise = an output", str(study.path))
    ((designs, merit),) = best_rows(study.family, study.objective.output, folder)
    if not len(designs) and study.optimise is not None:
        designs = random_designs(study, study.optimise.starts, study.optimise.seed)
    if not len(designs):
        allowed = "at least one mechanism that [locus] and [fit] can make: none was found, so give wider ranges"
        raise InputError("design space", how_many(study.space.count, "design"), allowed, str(study.path))
    return designs, merit, problem_of(study, designs)
