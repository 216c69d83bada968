"""A small study for the tests of engine and store, and a program that runs it in its own process."""

from __future__ import annotations

import os
import stat
import sys
import time
from pathlib import Path

import sweep.chunks.plan
from sweep.engine.run import run
from sweep.errors import LinksweepError

# Plan and log are smaller, chunks are larger.
SMALL = 6000

# Settings of `sweep.chunks.plan` for chunks of this many designs, whatever they cost.
CHUNK = 4096
SMALL_CHUNKS = {"CHUNK_SECONDS": 1e-9, "CHUNK_STEP": CHUNK}

ROOT = Path(__file__).resolve().parents[2]

STUDY = """
[study]
name = "tiny"
[mechanism]
family = "rssr"
[scene]
want = ["swing", "max_abs_d2psi"]
[design]
a = {{ from = 10, to = 60, count = 16, unit = "mm" }}
b = {{ from = 50, to = 150, count = 16, unit = "mm" }}
alpha = {{ from = 0, to = 90, count = {count}, unit = "deg" }}
c = {{ value = 60, unit = "mm" }}
e = {{ value = 100, unit = "mm" }}
f = {{ value = 5, unit = "mm" }}
g = {{ value = 10, unit = "mm" }}
branch = {{ values = [1, -1] }}
[limits]
rotatable = true
max_pressure_angle = {{ max = 50, unit = "deg" }}
{limits}
[accuracy]
samples = 64
[output]
keep = "{keep}"
dtype = "{dtype}"
"""


def write_study(folder: Path, *, keep: str = "all", dtype: str = "float64", count: int = 100, limits: str = "") -> Path:
    """Write a study of 512 * count designs and return its path."""
    folder.mkdir(parents=True, exist_ok=True)
    path = folder / "study.toml"
    path.write_text(STUDY.format(keep=keep, dtype=dtype, count=count, limits=limits))
    return path


def chunk_bytes(folder: Path) -> dict[str, bytes]:
    """Return names and contents of all chunks."""
    return {path.name: path.read_bytes() for path in folder.glob("part-*")}


def main(study: str, out: str, jobs: str, backend: str, pause: str) -> None:
    """Run with small chunks and a slow disk, so that signals arrive while chunks are being written."""
    sync = os.fsync

    def slow_sync(descriptor: int) -> None:
        about = os.fstat(descriptor)
        if stat.S_ISREG(about.st_mode) and about.st_size > SMALL:
            time.sleep(float(pause))
        sync(descriptor)

    os.fsync = slow_sync  # type: ignore[assignment]
    vars(sweep.chunks.plan).update(SMALL_CHUNKS)
    try:
        run(study, out, int(jobs), backend)  # type: ignore[arg-type]
    except LinksweepError as error:
        sys.stderr.write(f"{type(error).__name__}: {error}\n")
        sys.exit(error.exit_code)


if __name__ == "__main__":
    main(*sys.argv[1:])
