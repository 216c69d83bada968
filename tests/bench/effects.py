"""Cost of every effect and output, and of a scene with everything on against the sum of its parts.

`make bench-effects` measures the register anew, writes sweep/effects/measured.py and prints it beside what it was;
`make bench-scene` runs the whole scene on 10^5 designs x 360 angles, in chunks as a study does, on one core.
"""

from __future__ import annotations

import argparse
import os
import time
from pathlib import Path
from typing import NamedTuple

import numpy as np

from sweep.effects import NAMES, applicable, extended, measured
from sweep.effects.costs import MOTION, Cost, costs, designs, least_time
from sweep.evaluation.summaries import design_outputs
from sweep.families import family
from sweep.families.base import Accuracy, Array, Family

SAMPLES = 360
CHUNK = 256
PAGE = os.sysconf("SC_PAGE_SIZE") / 2**20


class Scene(NamedTuple):
    """What running a scene took: processor time [s], resident memory before and at most [MB].

    ``together`` and ``parts`` are least times on the same few designs, brought to the number of all.
    """

    seconds: float
    together: float
    parts: dict[str, float]
    before: float
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
    before, peak, start = resident(), 0.0, time.process_time()
    for first in range(0, n, CHUNK):
        run(designs(full, min(CHUNK, n - first), first), whole)
        peak = max(peak, resident())
    return Scene(time.process_time() - start, together, each, before, peak)


def price_list(rows: list[Cost]) -> dict[str, tuple[float, float]]:
    """Per effect the cost per pose and per design, as sweep/effects/measured.py holds it: two digits."""
    found = {row.effect: [0.0, 0.0] for row in rows}
    for row in rows:
        if row.outputs in ("all", "design outputs"):
            found[row.effect][row.per == "design"] = float(f"{max(row.ns, 1.0):.2g}")
    return {name: (pose, design) for name, (pose, design) in found.items()}


def write(prices: dict[str, tuple[float, float]]) -> None:
    """Replace the figures of sweep/effects/measured.py."""
    path = Path(measured.__file__)
    head = path.read_text().split("COSTS:")[0]
    lines = [f'    "{name}": ({pose:.1f}, {design:.1f}),\n' for name, (pose, design) in prices.items()]
    path.write_text(f"{head}COSTS: dict[str, tuple[float, float]] = {{\n{''.join(lines)}}}\n")


def main() -> None:
    """Print the price list and write it into the register, or run the scene with everything on."""
    parser = argparse.ArgumentParser()
    parser.add_argument("--scene", type=int, metavar="DESIGNS", help="the scene with everything on, instead")
    parser.add_argument("--dry", action="store_true", help="print the prices, write nothing")
    given = parser.parse_args()
    if given.scene:
        found, poses = everything(given.scene), given.scene * SAMPLES
        together = {"sum of the parts": sum(found.parts.values()), "together, few designs": found.together}
        for name, seconds in (found.parts | together | {"together, all designs": found.seconds}).items():
            print(f"{name:24s} {seconds:10.1f} s {1e9 * seconds / poses:10.0f} ns per pose")
        print(f"{given.scene} designs x {SAMPLES} angles on one core; {given.scene / found.seconds:.0f} designs/s")
        print(f"memory {found.before:.0f} MB before, at most {found.peak:.0f} MB")
        return
    rows = costs(each=True)
    for row in rows:
        print(f"{row.effect:26s} {row.outputs:28s} {row.ns:12.1f} ns per {row.per}")
    prices = price_list(rows)
    print(f"\n{'effect':26s} ns per pose (was)   ns per design (was)")
    for name in (MOTION, *NAMES):
        was = measured.COSTS.get(name, (np.nan, np.nan))
        print(f"{name:26s} {prices[name][0]:8.0f} ({was[0]:.0f})   {prices[name][1]:10.0f} ({was[1]:.0f})")
    if not given.dry:
        write(prices)


if __name__ == "__main__":
    main()
