"""Time of a first use: from an empty cache of kernels to the first number: ``python -m tests.bench.first_use``.

Three programs, each in a process of its own with a cache folder of its own: the README's ``summarise``; the tiny
version of the study needle208; every effect of the crank-rocker in one scene.  Each runs twice, with the cache empty
and full.
Processor time of the process and of those that it begins, imports included, and wall time: where one process compiles
ahead of the other, a study takes more of the first than of the second.  ``--against FOLDER`` takes turns with another
checkout, in the same environment, and prints how many times as long ours takes; a program that the other does not know
is left out.  The byte code of both is made beforehand, so Python's own compiling does not count.
"""

from __future__ import annotations

import argparse
import compileall
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
PROGRAMS = {
    "first number of summarise": SUMMARISE,
    "tiny version of needle208": NEEDLE,
    "scene with every effect": SCENE,
}


class Use(NamedTuple):
    """Processor time and wall time [s], and largest resident memory [MB], of a process."""

    seconds: float
    wall: float
    memory: float


def used(program: str, cache: Path, root: Path = ROOT) -> Use:
    """Run a program of the checkout ``root`` with this cache folder."""
    environment = os.environ | {"XDG_CACHE_HOME": str(cache), "PYTHONPATH": str(root)}
    begin = time.monotonic()
    with (
        tempfile.TemporaryDirectory() as out,
        subprocess.Popen(
            [sys.executable, "-c", program, out], cwd=root, env=environment,
            stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL,
        ) as running,
    ):  # fmt: skip
        _, status, usage = os.wait4(running.pid, 0)
        wall = time.monotonic() - begin
        running.returncode = os.waitstatus_to_exitcode(status)
    if running.returncode:
        raise RuntimeError(f"the program ended with exit code {running.returncode}: {program}")
    return Use(usage.ru_utime + usage.ru_stime, wall, usage.ru_maxrss / 1024.0)


class Uses(NamedTuple):
    """First use of a program from an empty and from a full cache, and how many kernels and parts it leaves there."""

    cold: Use
    warm: Use
    kept: int


def first_and_second(program: str, root: Path = ROOT) -> Uses:
    """Run a program of a checkout twice, with a cache folder of its own."""
    with tempfile.TemporaryDirectory() as folder:
        cold = used(program, Path(folder), root)
        kept = sum(1 for _ in Path(folder).rglob("*.nbc"))
        return Uses(cold, used(program, Path(folder), root), kept)


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--against", type=Path, help="another checkout, to take turns with")
    other = parser.parse_args().against
    for root in (ROOT, *([other] if other else [])):
        for package in ("kernels", "sweep", "studies"):
            compileall.compile_dir(root / package, quiet=1)
    heads = f"{'empty':>14}{'full':>14}{'kernels and parts':>19}{'memory, empty':>15}"
    print(f"{'processor time / wall time [s]':32}{heads}")
    for name, program in PROGRAMS.items():
        own = first_and_second(program)
        times = "".join(f"{f'{use.seconds:.1f} / {use.wall:.1f}':>14}" for use in (own.cold, own.warm))
        print(f"{name:32}{times}{own.kept:19}{own.cold.memory:12.0f} MB")
        if other is None:
            continue
        try:
            theirs = first_and_second(program, other.resolve())
        except RuntimeError:
            print(f"{'':32}{'unknown there':>14}")
            continue
        pairs = zip((own.cold, own.warm), (theirs.cold, theirs.warm), strict=True)
        print(f"{'  times that of the other':32}" + "".join(f"{a.seconds / b.seconds:14.2f}" for a, b in pairs))


if __name__ == "__main__":
    main()
