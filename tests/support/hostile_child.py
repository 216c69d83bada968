"""Hostile input in a process of its own, which may not have more than 2 GB and says nothing but what went wrong.

``python -m tests.support.hostile_child studies|tables|requests FIRST STOP STEP FOLDER`` prints one JSON object.
``requests`` are tables without the limit: what they compile, machine code of LLVM, has nothing to do with the input.
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
REQUESTS = 150  # of hostile tables, so that a cold cache of kernels has no thousands of them to compile


def study(seed: int, folder: Path) -> str:
    """What becomes of the study file of that seed; what is wrong with it, or one word."""
    end = outcome(mutated(seed), folder, searched=8, drawn=64)
    partial = [path.name for path in folder.rglob("_tmp-*")]
    return f"{partial[0]} is left" if partial else end


def table(seed: int, folder: Path) -> str:
    """What becomes of the table of that seed."""
    with no_longer_than(COMPILING):
        return "; ".join(faults(seed, REQUESTS)) or "answered"


def main() -> None:
    """All seeds of a range."""
    kind, (first, stop, step), place = sys.argv[1], map(int, sys.argv[2:5]), Path(sys.argv[5])
    # Private memory: the address space of an idle process with its libraries is 2 GB already.
    if kind != "requests":
        resource.setrlimit(resource.RLIMIT_DATA, (MOST_BYTES, MOST_BYTES))
    warnings.simplefilter("error")
    ends, wrong = Counter[str](), list[str]()
    for seed in range(first, stop, step):
        folder = place / f"{kind}-{seed}"
        try:
            end = {"studies": study, "tables": table, "requests": table}[kind](seed, folder)
        except Exception as error:  # this is what is looked for
            end = f"{type(error).__name__}: {str(error)[:300]}"
        ends[end if end in ("answered", "refused", "large") else "wrong"] += 1
        if end not in ("answered", "refused", "large"):
            wrong.append(f"seed {seed}: {end}")
        shutil.rmtree(folder, ignore_errors=True)
    # getrusage would count what the process that began this one held.
    (peak,) = (line for line in Path("/proc/self/status").read_text().splitlines() if line.startswith("VmHWM:"))
    most = int(peak.split()[1]) * 1024
    print(json.dumps({"ends": ends, "wrong": wrong, "bytes": most}))


if __name__ == "__main__":
    main()
