"""A scene with all effects on against the sum of its parts.

`make bench-scene` runs it on 10^5 designs x 360 angles, in chunks as a study does, on one core.
"""

from __future__ import annotations

import os
import sys
import time
from pathlib import Path
from typing import NamedTuple

from studies.accuracy.ordinary import designs
from sweep.effects import applicable, extended
from sweep.evaluation.summaries import design_outputs
from sweep.families import family
from sweep.families.base import Accuracy, Array, Family
from tests.bench.effect_costs import least_time

SAMPLES = 360
CHUNK = 256
PAGE = os.sysconf("SC_PAGE_SIZE") / 2**20


class Scene(NamedTuple):
    """What running a scene took: processor time [s], resident memory before, with the first chunk and at most [MB].

    ``together`` and ``parts`` are least times on the same few designs, brought to the number of all.
    """

    seconds: float
    together: float
    parts: dict[str, float]
    before: float
    first: float
    peak: float


def resident() -> float:
    """Resident memory of this process now [MB]."""
    return int(Path("/proc/self/statm").read_text().split()[1]) * PAGE


def wants(effects: Family | None = None) -> dict[str, tuple[str, ...]]:
    """Per effect of the crank-rocker what a scene may want of it: the largest of each pose output, all of the turn."""
    found = {}
    for placed in applicable(effects or family("rssr")):
        design = tuple(o.name for o in placed.design_outputs)
        of_turn = () if placed.entry.whole_turn else tuple(f"max_abs_{o.name}" for o in placed.pose_outputs)
        found[placed.name] = (*of_turn, *design)
    return found


def everything(n: int, timed: int = CHUNK) -> Scene:
    """All effects of the crank-rocker on n designs x 360 angles, in chunks; each part alone on ``timed`` of them."""
    parts = wants()
    full = extended(family("rssr"), [name for names in parts.values() for name in names])

    def run(matrix: Array, names: tuple[str, ...]) -> None:
        design_outputs(full, matrix, names, Accuracy(samples=SAMPLES))

    whole = tuple(name for names in parts.values() for name in names)
    few = designs(full, timed)
    run(few, whole)
    each = {
        name: least_time(lambda names=names: run(few, names), 2) * n / timed  # type: ignore[misc]
        for name, names in parts.items()
    }
    together = least_time(lambda: run(few, whole), 3) * n / timed
    before, after, start = resident(), [], time.process_time()
    for first in range(0, n, CHUNK):
        run(designs(full, min(CHUNK, n - first), first), whole)
        after.append(resident())
    return Scene(time.process_time() - start, together, each, before, after[0], max(after))


def main() -> None:
    """Print what each part of the scene takes, their sum, and the scene itself."""
    count = int(sys.argv[1]) if len(sys.argv) > 1 else 100_000
    found, poses = everything(count), count * SAMPLES
    together = {"sum of the parts": sum(found.parts.values()), "together, few designs": found.together}
    for name, seconds in (found.parts | together | {"together, all designs": found.seconds}).items():
        print(f"{name:24s} {seconds:10.1f} s {1e9 * seconds / poses:10.0f} ns per pose")
    print(f"{count} designs x {SAMPLES} angles on one core; {count / found.seconds:.0f} designs/s")
    print(
        f"memory {found.before:.0f} MB before, {found.first:.0f} MB with the first chunk, at most {found.peak:.0f} MB"
    )


if __name__ == "__main__":
    main()
