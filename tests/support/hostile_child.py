"""Hostile input in its own process, limited to 2 GB, which prints only failures.

``python -m tests.support.hostile_child studies|tables|requests FIRST STOP STEP FOLDER`` prints one JSON object.
``requests`` are tables without the limit, since the memory of compiling is independent of the input.
"""

from __future__ import annotations

import json
import resource
import shutil
import sys
import warnings
from collections import Counter
from pathlib import Path

from tests.study.test_mutations import COMPILING, no_longer_than, outcome
from tests.support.hostile_tables import faults
from tests.support.mutated_studies import mutated

MOST_BYTES = 2 * 2**30
REQUESTS = 150  # per hostile table; more would compile thousands of kernels on a cold cache


def study(seed: int, folder: Path) -> str:
    """Return the outcome of the study file of a seed: a fault, or one word."""
    end = outcome(mutated(seed), folder, searched=8, drawn=64)
    partial = [path.name for path in folder.rglob("_tmp-*")]
    return f"{partial[0]} is left" if partial else end


def table(seed: int, folder: Path) -> str:
    """Return the outcome of the table of a seed."""
    with no_longer_than(COMPILING):
        return "; ".join(faults(seed, REQUESTS)) or "answered"


def main() -> None:
    """Test all seeds of a range."""
    kind, (first, stop, step), place = sys.argv[1], map(int, sys.argv[2:5]), Path(sys.argv[5])
    # Private memory is limited, since the address space of an idle process with its libraries is already 2 GB.
    if kind != "requests":
        resource.setrlimit(resource.RLIMIT_DATA, (MOST_BYTES, MOST_BYTES))
    warnings.simplefilter("error")
    ends, wrong = Counter[str](), list[str]()
    for seed in range(first, stop, step):
        folder = place / f"{kind}-{seed}"
        try:
            end = {"studies": study, "tables": table, "requests": table}[kind](seed, folder)
        except Exception as error:  # the fault that the test seeks
            end = f"{type(error).__name__}: {str(error)[:300]}"
        ends[end if end in ("answered", "refused", "large") else "wrong"] += 1
        if end not in ("answered", "refused", "large"):
            wrong.append(f"seed {seed}: {end}")
        shutil.rmtree(folder, ignore_errors=True)
    # getrusage would include the memory of the parent process.
    (peak,) = (line for line in Path("/proc/self/status").read_text().splitlines() if line.startswith("VmHWM:"))
    most = int(peak.split()[1]) * 1024
    print(json.dumps({"ends": ends, "wrong": wrong, "bytes": most}))


if __name__ == "__main__":
    main()
