"""Time of a call, undisturbed as far as repeating allows."""

from __future__ import annotations

import time
from collections.abc import Callable


def seconds(
    call: Callable[[], object],
    repeats: int = 5,
    least: float = 2e-3,
    clock: Callable[[], float] = time.process_time,
) -> float:
    """Return the shortest of several timings of one call [s]; the first call, which may compile, is not counted.

    Calls shorter than ``least`` are timed in groups, so that the clock does not show.  Processor time, which other work
    on the machine disturbs least; what runs in several threads needs ``time.perf_counter``.
    """
    call()
    start = clock()
    call()
    group = max(1, round(least / max(clock() - start, 1e-7)))
    best = float("inf")
    for _ in range(repeats):
        start = clock()
        for _ in range(group):
            call()
        best = min(best, (clock() - start) / group)
    return best
