"""Time of a call, with other work on the machine excluded as far as repetition allows."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np

from sweep.families.base import Array

REPEATS = 5
ENOUGH, MANY = 0.02, 4096  # seconds of a call over designs, and largest number of its designs
LONG = 1.0  # s; a longer call is timed once


class Spread(NamedTuple):
    """Median and quartiles of the times of one call [s]."""

    median: float
    lower: float
    upper: float

    @classmethod
    def of(cls, times: Sequence[float]) -> Spread:
        """Return the spread of given times."""
        lower, median, upper = np.percentile(times, [25.0, 50.0, 75.0])
        return cls(float(median), float(lower), float(upper))

    def columns(self, units: int, per: str) -> dict[str, float]:
        """Return table columns in ns per unit: the median, and both quartiles."""
        names = (f"ns_per_{per}", f"ns_per_{per}_lower", f"ns_per_{per}_upper")
        return {name: 1e9 * took / units for name, took in zip(names, self, strict=True)}


def seconds(
    call: Callable[[], object],
    repeats: int = REPEATS,
    least: float = 2e-3,
    clock: Callable[[], float] = time.process_time,
) -> float:
    """Return the shortest of several timings of one call [s], see :func:`timings`."""
    return min(timings(call, repeats, least, clock))


def spread(call: Callable[[], object], repeats: int = REPEATS, least: float = 2e-3) -> Spread:
    """Return median and quartiles of several timings of one call, see :func:`timings`."""
    return Spread.of(timings(call, repeats, least))


def per_design(run: Callable[[Array], object], designs: Array) -> dict[str, float]:
    """Return columns of the time per design, with the designs repeated to make the call's own overhead negligible."""
    start = time.process_time()
    run(designs)
    took = time.process_time() - start
    if took > LONG:
        return Spread.of([took]).columns(len(designs), "design")
    again = max(1, min(MANY // len(designs), round(ENOUGH / max(took, 1e-6))))
    many = np.tile(designs, (again, 1))
    return spread(lambda: run(many)).columns(len(many), "design")


def timings(
    call: Callable[[], object],
    repeats: int,
    least: float,
    clock: Callable[[], float] = time.process_time,
) -> list[float]:
    """Return processor times of one call [s]; the first call, which may compile, is not counted.

    Calls shorter than ``least`` are timed in groups, to make the clock's resolution negligible.  Processor time is
    disturbed least by other work on the machine; calls with several threads need ``time.perf_counter``.
    """
    call()
    start = clock()
    call()
    group = max(1, round(least / max(clock() - start, 1e-7)))
    found = []
    for _ in range(repeats):
        start = clock()
        for _ in range(group):
            call()
        found.append((clock() - start) / group)
    return found
