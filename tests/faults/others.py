"""Two runs in one folder, a damaged cache of kernels, a clock that goes back, a kernel that raises."""

from __future__ import annotations

import random
import shutil
import time
from functools import partial
from pathlib import Path

from kernels.cache_folder import CACHE_DIR
from tests.faults.damage import Damage, cut, delete, empty, flip
from tests.faults.ground import SECONDS, Ground, Kind, Outcome, files, last_line
from tests.faults.kills import reached

# A pause of every write that lets another program start meanwhile [s].
LONG = 2.0


def two_runs(ground: Ground, folder: Path, moments: random.Random) -> Outcome:
    """The second one is refused; the first one goes on."""
    designs = folder / "designs"
    first = ground.begin(folder / "marks", "run", ground.plain, "--out", designs, pause=LONG)
    reached(first, folder / "marks", "sweep")
    time.sleep(moments.uniform(0.0, LONG))
    second = ground.begin(folder / "second", "run", ground.plain, "--out", designs)
    text, _ = second.communicate(timeout=SECONDS)
    rest, _ = first.communicate(timeout=SECONDS)
    found = Outcome(second.returncode, last_line(text))
    if second.returncode not in (0, 75) or (second.returncode == 75 and str(first.pid) not in found.said):
        found.wrong.append(f"the second ended with {second.returncode}: {text[-500:]}")
    if first.returncode != 0 or files(designs) != ground.whole(ground.plain):
        found.wrong.append(f"the first ended with {first.returncode}: {rest[-500:]}")
    return ground.settled(ground.plain, designs, files(designs), found)


def damaged_cache(damage: Damage, ground: Ground, folder: Path, moments: random.Random) -> Outcome:
    """Files of compiled kernels are damaged: they are compiled anew, and the numbers are the same."""
    place = folder / "cache" / "linksweep" / "kernels" / CACHE_DIR.name
    for level in (place.parent.parent, place.parent):
        level.mkdir(mode=0o700, parents=True, exist_ok=True)
    shutil.copytree(CACHE_DIR, place, ignore=shutil.ignore_patterns("synthesis", "_lock"))
    compiled = sorted(p for p in place.rglob("*") if p.suffix in (".nbi", ".nbc") and "rssr" in str(p))
    moments.shuffle(compiled)
    for path in compiled[: max(1, len(compiled) // 2)]:
        damage([path], moments)
    process = ground.begin(
        folder / "marks", "run", ground.plain, "--out", folder / "designs",
        env={"XDG_CACHE_HOME": str(folder / "cache")},
    )  # fmt: skip
    text, _ = process.communicate(timeout=SECONDS)
    found = Outcome(process.returncode, last_line(text))
    if process.returncode != 0 or files(folder / "designs") != ground.whole(ground.plain):
        found.wrong.append(f"ended with {process.returncode}: {text[-1000:]}")
    return found


def in_the_program(fault: str, code: int, words: str, ground: Ground, folder: Path, moments: random.Random) -> Outcome:
    """Something in the program itself goes wrong."""
    designs = folder / "designs"
    backend = moments.choice(["threading", "loky"]) if fault == "clock" else "threading"
    words_of_run = ("run", ground.plain, "--out", designs, "--backend", backend)
    process = ground.begin(folder / "marks", *words_of_run, fault=fault)
    text, _ = process.communicate(timeout=SECONDS)
    found = Outcome(process.returncode, last_line(text))
    if found.code != code or words not in (found.said if code else text):
        found.wrong.append(f"ended with {found.code}: {text[-1000:]}")
    return ground.settled(ground.plain, designs, files(designs), found)


OTHERS = [
    Kind("two runs in one folder", 5, two_runs),
    Kind("truncated kernel cache", 2, partial(damaged_cache, cut)),
    Kind("emptied kernel cache", 1, partial(damaged_cache, empty)),
    Kind("flipped kernel cache", 2, partial(damaged_cache, flip)),
    Kind("kernel cache with files gone", 1, partial(damaged_cache, delete)),
    Kind("clock going back", 4, partial(in_the_program, "clock", 0, "dataset:")),
    Kind("kernel that raises", 3, partial(in_the_program, "kernel", 70, "in chunk 5")),
]
