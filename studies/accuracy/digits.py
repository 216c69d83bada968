"""What one more digit costs the optimiser: how far it has come after so many looks at the mechanism."""

from __future__ import annotations

import math
import time
from typing import TYPE_CHECKING

import numpy as np

from studies.accuracy.reference import RSSR
from sweep.families.base import Accuracy, Array

if TYPE_CHECKING:
    import pandas as pd

    from sweep.optimise import Problem

DIGITS = (1, 2, 4, 8, 12)
FREE, START = ("a", "b", "c", "f"), ([0.2, 0.5, 0.6, -0.2], [0.35, 0.9, 1.0, 0.2])
LOW, HIGH = [0.05, 0.3, 0.3, -1.0], [0.9, 2.0, 2.0, 1.0]
FIXED = {"e": 1.0, "g": 0.0, "alpha": 0.5, "branch": -1.0}
TARGETS = (1e-3, 1e-12)
FEASIBLE = 1e-9


def optimiser_digits(starts: int, every: int = 1) -> pd.DataFrame:
    """Return looks and time until the objective stays within 10^-digits of its end:
    medians over the starts that converge.

    Least acceleration for a swing of 45 degrees and a pressure angle of at most 45 degrees, four variables.  Each
    search is run again and again, ended ``every`` looks later each time; what it then has as its best design counts.
    """
    import pandas as pd

    histories = [_history(first, every) for first in _starts(_problem(Accuracy(target=1e-12)), starts)]
    found = [history for history in histories if history is not None]
    looks, seconds = (np.median([[pair[k] for pair in one] for one in found], axis=0) for k in (0, 1))
    return pd.DataFrame(
        {"digits": DIGITS, "looks": looks, "milliseconds": 1e3 * seconds, "starts": starts, "converged": len(found)}
    )


def optimiser_targets(starts: int) -> pd.DataFrame:
    """Return the same searches with ``accuracy`` coarse and fine:
    time per start and relative difference of the optimum.
    """
    import pandas as pd

    from sweep.optimise import minimise
    from sweep.study import OptimiseSettings

    rows = []
    for target in TARGETS:
        problem = _problem(Accuracy(target=target))
        first = _starts(problem, starts)
        start = time.process_time()
        best = minimise(problem, first, OptimiseSettings(starts=starts))[0].objective
        rows.append({"accuracy": target, "ms_per_start": 1e3 * (time.process_time() - start) / starts, "best": best})
    for row in rows:
        row["difference_from_finest"] = abs(row["best"] / rows[-1]["best"] - 1.0)
    return pd.DataFrame(rows)


def _problem(accuracy: Accuracy) -> Problem:
    from sweep.optimise import Problem
    from sweep.study import Limit

    limits = (
        Limit("swing", math.radians(45.0), math.radians(45.0)),
        Limit("max_pressure_angle", None, math.radians(45.0)),
    )
    low, high = np.array(LOW), np.array(HIGH)
    return Problem(RSSR, FREE, low, high, FIXED, "max_abs_d2psi", limits, accuracy=accuracy)


def _starts(problem: Problem, count: int) -> Array:
    return problem.rows(np.random.default_rng(3).uniform(*START, (count, len(FREE))))


def _history(first: Array, every: int) -> list[tuple[int, float]] | None:
    """Return (looks, seconds) per number of digits, or None where the search finds no feasible optimum."""
    from sweep.optimise import minimise
    from sweep.study import OptimiseSettings

    def run(limit: float) -> tuple[float, int, float]:
        clock = _Clock(limit)
        start = time.process_time()
        (result,) = minimise(_problem(Accuracy(target=1e-12)), first[None, :], OptimiseSettings(starts=1), clock)
        took = time.process_time() - start
        return (result.objective if result.violation <= FEASIBLE else math.inf), clock.looks, took

    run(math.inf)
    end, looks, _ = run(math.inf)
    if not math.isfinite(end):
        return None
    steps = [run(limit) for limit in (*range(every, looks, every), math.inf)]
    off = np.array([abs(objective / end - 1.0) for objective, _, _ in steps])
    # the first run from which on the objective stays that near; the last one is the whole search
    since = [int(np.flatnonzero(~(off <= 10.0**-d)).max(initial=-1)) + 1 for d in DIGITS]
    return [steps[k][1:] for k in since]


class _Clock:
    """Says stop after so many questions: the optimiser asks before each look at the mechanism."""

    def __init__(self, limit: float) -> None:
        self.limit, self.looks = limit, 0

    def __call__(self) -> bool:
        self.looks += 1
        return self.looks > self.limit
