"""The command line in a process to which faults happen: small chunks, and marks of the stage it is in.

``python -m tests.faults.child MARKS FAULT VERB ...``; FAULT is ``none`` or one of `FAULTS`.
"""

from __future__ import annotations

import functools
import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import sweep.chunks.plan
import sweep.engine.run
import sweep.engine.searches
import sweep.engine.worker
import sweep.optimise.multistart.multistart
import sweep.optimise.study
import sweep.report.page
from sweep.__main__ import main
from tests.support.engine_study import SMALL_CHUNKS


def marked(module: Any, name: str, stage: str, marks: Path) -> None:
    """Note in a file that a function begins."""
    function = getattr(module, name)

    @functools.wraps(function)
    def wrapper(*arguments: Any, **options: Any) -> Any:
        with marks.open("a") as file:
            file.write(f"{stage}\n")
        return function(*arguments, **options)

    setattr(module, name, wrapper)


def clock_back() -> None:
    """The clock of the machine goes back by an hour whenever it is asked for the third time."""
    clock, asked = time.time, [0]

    def jumping(seconds: float | None = None) -> float:
        asked[0] += 1
        return clock() - 3600.0 * (asked[0] // 3)

    def local(function: Callable[..., time.struct_time]) -> Callable[..., time.struct_time]:
        return lambda seconds=None: function(jumping() if seconds is None else seconds)

    time.gmtime, time.localtime = local(time.gmtime), local(time.localtime)  # type: ignore[assignment]
    time.time = jumping  # type: ignore[assignment]
    strftime = time.strftime
    time.strftime = lambda text, when=None: strftime(text, time.gmtime() if when is None else when)  # type: ignore[assignment]


def raising_kernel() -> None:
    compute = sweep.engine.worker.compute_chunk

    def broken(study: Any, start: int, stop: int, *more: Any) -> Any:
        if start // (stop - start) == 5:
            raise ZeroDivisionError("division by zero in a kernel")
        return compute(study, start, stop, *more)

    sweep.engine.worker.compute_chunk = broken


FAULTS: dict[str, Callable[[], None]] = {
    "none": lambda: None, "clock": clock_back, "kernel": raising_kernel,
}  # fmt: skip


if __name__ == "__main__":
    place = Path(sys.argv[1])
    marked(sweep.engine.run, "_compute", "sweep", place)
    marked(sweep.engine.searches, "_optimise", "optimiser", place)
    marked(sweep.engine.searches, "_front", "front", place)
    marked(sweep.optimise.study, "robust", "tolerance", place)
    marked(sweep.report.page, "write_report", "report", place)
    vars(sweep.chunks.plan).update(SMALL_CHUNKS)
    sweep.optimise.multistart.multistart.SERIAL_EVALUATIONS = 0  # every start goes to a process
    FAULTS[sys.argv[2]]()
    del sys.argv[1:3]
    main()
