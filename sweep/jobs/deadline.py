"""The emergency deadline of a study's whole search: one clock for samples, starts, neighbours and robust designs."""

from __future__ import annotations

import math
import time
from collections.abc import Callable


class Deadline:
    """Asked often; true once the budget [s] is used up or the caller wants to stop.  ``pulled`` remembers it."""

    def __init__(self, budget: float | None, stop: Callable[[], bool] | None) -> None:
        self.end = math.inf if budget is None else time.monotonic() + budget
        self.stop, self.pulled = stop, False

    def __call__(self) -> bool:
        """Return whether to stop."""
        self.pulled = self.pulled or time.monotonic() >= self.end or (self.stop is not None and self.stop())
        return self.pulled
