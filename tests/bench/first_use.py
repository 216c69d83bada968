"""Time of a first use: from an empty cache of kernels to the first number: ``python -m tests.bench.first_use``.

Three programs, each in a process of its own with a cache folder of its own: the README's ``summarise``; the tiny
version of the study needle208; every effect of the crank-rocker in one scene.  Each runs twice, with the cache empty
and full.
Processor time of the process and of those that it begins, imports included, and wall time: where one process compiles
ahead of the other, a study takes more of the first than of the second.
"""

from __future__ import annotations

import os
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from typing import NamedTuple

ROOT = Path(__file__).resolve().parents[2]
SUMMARISE = """
import numpy as np, pandas as pd, sweep
table = pd.DataFrame({"a": np.linspace(5, 15, 6), "b": 40.0, "c": 25.0, "e": 35.0, "f": 5.0, "g": -3.0, "alpha": 1.0})
sweep.summarise("rssr", table, ["margin", "max_pressure_angle", "swing", "max_abs_d2psi"], accuracy=1e-8)
"""
NEEDLE = """
import runpy, sys
sys.argv = ["sweep", "run", "studies/needle208", "--smoke", "--force", "--out", sys.argv[1] + "/designs"]
runpy.run_module("sweep", run_name="__main__")
"""
SCENE = """
from sweep.effects import extended
from studies.accuracy.ordinary import designs
from sweep.evaluation.summaries import design_outputs
from sweep.families import family
from sweep.families.base import Accuracy
from tests.bench.effects import wants
names = tuple(name for names in wants().values() for name in names)
full = extended(family("rssr"), names)
design_outputs(full, designs(full, 4), names, Accuracy(samples=360))
"""
# What each may take from an empty cache [s of processor time].
PROGRAMS = {
    "first number of summarise": (SUMMARISE, 8.0),
    "tiny version of needle208": (NEEDLE, 15.0),
    "scene with every effect": (SCENE, 25.0),
}


class Use(NamedTuple):
    """Processor time and wall time [s], and largest resident memory [MB], of a process."""

    seconds: float
    wall: float
    memory: float


def used(program: str, cache: Path) -> Use:
    """Run a program with this cache folder."""
    environment = os.environ | {"XDG_CACHE_HOME": str(cache)}
    begin = time.monotonic()
    with (
        tempfile.TemporaryDirectory() as out,
        subprocess.Popen(
            [sys.executable, "-c", program, out], cwd=ROOT, env=environment,
            stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL,
        ) as running,
    ):  # fmt: skip
        _, status, usage = os.wait4(running.pid, 0)
        wall = time.monotonic() - begin
        running.returncode = os.waitstatus_to_exitcode(status)
    if running.returncode:
        raise RuntimeError(f"the program ended with exit code {running.returncode}: {program}")
    return Use(usage.ru_utime + usage.ru_stime, wall, usage.ru_maxrss / 1024.0)


def main() -> None:
    """Print the table."""
    heads = f"{'asked':>6}{'empty':>14}{'full':>14}{'kernels and parts':>19}{'memory, empty':>15}"
    print(f"{'processor time / wall time [s]':32}{heads}")
    for name, (program, asked) in PROGRAMS.items():
        with tempfile.TemporaryDirectory() as folder:
            cold = used(program, Path(folder))
            kept = sum(1 for _ in Path(folder).rglob("*.nbc"))
            warm = used(program, Path(folder))
        times = "".join(f"{f'{use.seconds:.1f} / {use.wall:.1f}':>14}" for use in (cold, warm))
        print(f"{name:32}{asked:6.0f}{times}{kept:19}{cold.memory:12.0f} MB")


if __name__ == "__main__":
    main()
