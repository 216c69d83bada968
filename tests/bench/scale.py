"""Time and memory of sweeps from 10^5 to 10^9 samples and to 10^8 designs, and of reading them: ``docs/scale.md``.

Each size runs in a process of its own, so that its peak of memory is its own.
"""

from __future__ import annotations

import argparse
import json
import os
import platform
import resource
import shutil
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

ANGLES = 500
START = 4  # power of ten of a run that is all start
STUDY = """
[study]
name = "scale"
[mechanism]
family = "rssr"
[scene]
want = ["swing", "max_abs_d2psi", "max_pressure_angle"]
[design]
a = {a}
b = {b}
c = {c}
alpha = {alpha}
e = "100 mm"
f = "5 mm"
g = "10 mm"
branch = {branch}
[limits]
rotatable = true
[accuracy]
{accuracy}
[output]
keep = "all"
"""
# Ends of the four axes; every design is kept and computed as far as its limits let it come.
AXES = {"a": (10, 40, "mm"), "b": (60, 150, "mm"), "c": (40, 90, "mm"), "alpha": (0, 90, "deg")}
HEAD = "| {} | chunks | wall [s] | processor [s] | ns per {} | peak of memory [MB] | on disk [MB] |"
RULE = "|---|---|---|---|---|---|---|"


def axis(count: int, ends: tuple[float, float, str]) -> str:
    """One axis of the lattice; a single value is its middle."""
    low, high, unit = ends
    if count == 1:
        return f'"{0.5 * (low + high):g} {unit}"'
    return f'{{ from = {low}, to = {high}, count = {count}, unit = "{unit}" }}'


def written(kind: str, power: int, folder: Path) -> Path:
    """A study of 10^power samples, 500 angles each, or of 10^power designs with true extrema."""
    tens = power - 3 if kind == "samples" else power
    counts = [10 ** (tens // 4 + (k < tens % 4)) for k in range(4)]
    axes = {name: axis(count, ends) for (name, ends), count in zip(AXES.items(), counts, strict=True)}
    accuracy = f"samples = {ANGLES}" if kind == "samples" else "target = 1e-8"
    path = folder / "study.toml"
    branch = "{ values = [1, -1] }" if kind == "samples" else "1"
    path.write_text(STUDY.format(accuracy=accuracy, branch=branch, **axes))
    return path


def peak() -> float:
    """Largest resident memory of this process [MB]."""
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024.0


def one(kind: str, power: int, folder: Path) -> dict[str, Any]:
    """Run one size in this process."""
    import sweep
    from sweep.dataset.chunk_files import parts

    path = written(kind, power, folder)
    wall, processor = time.perf_counter(), time.process_time()
    designs = sweep.run(path, folder / "designs", jobs=2, force=True)
    took = time.perf_counter() - wall, time.process_time() - processor
    chunks = parts(designs)
    disk = sum(part.path.stat().st_size for part in chunks) / 1e6
    return {"wall": took[0], "processor": took[1], "chunks": len(chunks), "disk": disk, "peak": peak()}


def reading(name: str, folder: Path) -> dict[str, Any]:
    """Read a dataset in this process."""
    from sweep.dataset import reading as rows

    designs = folder / "designs"
    ways: dict[str, Callable[[], Any]] = {
        "best": lambda: rows.best(designs, "max_abs_d2psi", 100),
        "pareto": lambda: rows.pareto(designs, "max_pressure_angle", "max_abs_d2psi"),
        "histogram": lambda: rows.histogram(designs, "swing", 100)[0].sum(),
    }
    wall = time.perf_counter()
    found = ways[name]()
    rows_found = len(found) if name in ("best", "pareto") else int(found)
    return {"wall": time.perf_counter() - wall, "peak": peak(), "rows": rows_found}


def in_process(*words: object) -> dict[str, Any]:
    """What this program prints in a process of its own."""
    command = [sys.executable, "-m", "tests.bench.scale", *map(str, words)]
    done = subprocess.run(command, check=True, stdout=subprocess.PIPE, text=True)
    return dict(json.loads(done.stdout.splitlines()[-1]))


def curve(kind: str, most: int, folder: Path, keep: Path | None = None) -> list[str]:
    """Lines of a table; the dataset of the largest size stays in ``keep``."""
    place = folder / f"{kind}-start"
    place.mkdir()
    in_process("--one", kind, START, place)  # compiles what is missing
    shutil.rmtree(place)
    place.mkdir()
    start = in_process("--one", kind, START, place)["processor"]
    lines = [HEAD.format(kind, kind.removesuffix("s")), RULE]
    for power in range(5, most + 1):
        place = keep if keep is not None and power == most else folder / f"{kind}-{power}"
        place.mkdir(parents=True)
        r = in_process("--one", kind, power, place)
        own = r["processor"] - start
        rate = f"{1e9 * own / 10**power:.3g}" if own > 0.1 * start else "start only"
        figures = f"{r['chunks']} | {r['wall']:.1f} | {r['processor']:.1f} | {rate}"
        lines.append(f"| 10^{power} | {figures} | {r['peak']:.0f} | {r['disk']:.1f} |")
        print(lines[-1], file=sys.stderr, flush=True)
        if place != keep:
            shutil.rmtree(place)
    return lines


def read_back(folder: Path) -> list[str]:
    """Lines of the table about reading."""
    words = {
        "best": "`best(folder, \"max_abs_d2psi\", 100)`",
        "pareto": "`pareto(folder, \"max_pressure_angle\", \"max_abs_d2psi\")`",
        "histogram": "`histogram(folder, \"swing\", 100)`",
    }  # fmt: skip
    lines = ["| | wall [s] | peak of memory [MB] | rows |", "|---|---|---|---|"]
    for name, text in words.items():
        r = in_process("--read", name, folder)
        lines.append(f"| {text} | {r['wall']:.1f} | {r['peak']:.0f} | {r['rows']} |")
        print(lines[-1], file=sys.stderr, flush=True)
    return lines


def main() -> None:
    """All sizes; or one, for the processes that this one starts."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--one", nargs=3, metavar=("KIND", "POWER", "FOLDER"))
    parser.add_argument("--read", nargs=2, metavar=("WAY", "FOLDER"))
    parser.add_argument("--samples", type=int, default=9, help="power of ten of the largest number of samples")
    parser.add_argument("--designs", type=int, default=8, help="power of ten of the largest number of designs")
    parser.add_argument("--out", type=Path, help="page to write; default: print it")
    options = parser.parse_args()
    if options.one:
        print(json.dumps(one(options.one[0], int(options.one[1]), Path(options.one[2]))))
        return
    if options.read:
        print(json.dumps(reading(options.read[0], Path(options.read[1]))))
        return
    with tempfile.TemporaryDirectory(prefix="linksweep-scale-") as name:
        folder = Path(name)
        samples = curve("samples", options.samples, folder)
        designs = curve("designs", options.designs, folder, folder / "kept")
        page = PAGE.format(
            samples="\n".join(samples), designs="\n".join(designs), read="\n".join(read_back(folder / "kept")),
            power=options.designs, angles=ANGLES, cores=os.cpu_count(), machine=platform.machine(),
        )  # fmt: skip
    if options.out is None:
        print(page)
    else:
        options.out.write_text(page)


PAGE = """# Scale

This page shows time, memory and disk of large sweeps (`make bench-scale`). Each row is a run in its own process with
two threads, on {cores} cores ({machine}). Other work on the machine lengthens the wall time, so the processor time
counts. The start (imports, compiled kernels from the cache, the plan) is subtracted from the time per sample or
design, not from the other columns.

## Samples

The study is a crank-rocker with rotatability, swing, largest pressure angle and largest acceleration on {angles} crank
angles; every design becomes a row.

{samples}

## Designs

The outputs are the same with `accuracy = 1e-8`, so with true extrema instead of a grid.

{designs}

## Memory

Memory depends on the chunks in work, not on the sweep. A chunk takes two seconds of computing, 32 MB before it is
encoded, or a sixteenth of all designs, whichever is least. So memory grows with a small sweep, but not beyond about
10^7 designs: sweeps of 10^8 or 10^12 of these designs have chunks of the same size. Each further job adds a chunk.

## Reading 10^{power} rows

The rows are read in batches of 131072, one file after the other (`sweep.dataset.reading`): first the columns that
decide, of all rows within the limits, then all columns of the kept rows. pandas never holds more than one batch.

{read}
"""

if __name__ == "__main__":
    main()
