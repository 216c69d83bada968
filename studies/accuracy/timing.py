"""Wall time of a call, undisturbed as far as repeating allows."""

from __future__ import annotations

import time
from collections.abc import Callable


def seconds(call: Callable[[], object], repeats: int = 5, least: float = 2e-3) -> float:
    """Shortest of several timings of one call [s]; the first call, which may compile, is not counted.

    Calls shorter than ``least`` are timed in groups, so that the clock does not show.
    """
    call()
    start = time.perf_counter()
    call()
    group = max(1, round(least / max(time.perf_counter() - start, 1e-7)))
    best = float("inf")
    for _ in range(repeats):
        start = time.perf_counter()
        for _ in range(group):
            call()
        best = min(best, (time.perf_counter() - start) / group)
    return best
