"""Disks that are full, refuse, or go away."""

from __future__ import annotations

import random
import resource
import shutil
import subprocess
import sys
import time
from functools import partial
from pathlib import Path

from sweep.dataset.files import beside
from tests.faults.ground import SECONDS, Ground, Kind, Outcome, files, last_line
from tests.faults.kills import reached
from tests.support.engine_study import ROOT

KEPT = "run again"


def _ended(ground: Ground, designs: Path, code: int, text: str, before: dict[str, bytes]) -> Outcome:
    """A disk that refuses ends the program with 74 and words about it; nothing half-written stays."""
    found = Outcome(code, last_line(text))
    if code != 74 or KEPT not in found.said or "Traceback" in text:
        found.wrong.append(f"ended with {code}: {text[-1000:]}")
    found.wrong += [f"{path.name} is left" for path in beside(designs).glob("_tmp-*")]
    return ground.settled(ground.plain, designs, before, found)


def limited_files(backend: str, ground: Ground, folder: Path, moments: random.Random) -> Outcome:
    """The system refuses to write a file beyond a size that some of the chunks have and some have not."""
    sizes = sorted(len(data) for data in ground.whole(ground.plain).values())
    most = moments.randint(sizes[0] - 2000, sizes[-1] - 1)
    words = ("run", ground.plain, "--out", folder / "designs", "--backend", backend)
    process = ground.begin(
        folder / "marks", *words,
        preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_FSIZE, (most, most)),
    )  # fmt: skip
    text, _ = process.communicate(timeout=SECONDS)
    return _ended(ground, folder / "designs", process.returncode, text, {})


def _mounted(folder: Path, options: str, script: str) -> subprocess.CompletedProcess[str]:
    """Run a shell script in a name space of its own, where a small file system is mounted at ``folder``."""
    mount = f"mount -t tmpfs -o {options} tmpfs {folder} && {script}"
    command = ["unshare", "--mount", "--user", "--map-root-user", "sh", "-c", mount]
    return subprocess.run(command, cwd=ROOT, capture_output=True, text=True, timeout=SECONDS, check=False)


def _can_mount(folder: Path) -> bool:
    if shutil.which("unshare") is None:
        return False
    return _mounted(folder, "size=64k", "true").returncode == 0


def small_disk(read_only: bool, ground: Ground, folder: Path, moments: random.Random) -> Outcome:
    """A file system with room for some chunks only, or one that becomes read-only; what stands there is copied out."""
    disk, kept = folder / "disk", folder / "kept"
    disk.mkdir()
    kept.mkdir()
    if not _can_mount(disk):
        return Outcome(said="no file system can be mounted here: not tried")
    whole = sum(len(data) for data in ground.whole(ground.plain).values())
    size = whole * 2 if read_only else int(whole * moments.uniform(0.2, 0.9))
    designs = disk / "study" / "designs"
    words = f"{sys.executable} -m tests.faults.child {folder}/marks none run {ground.plain} --out {designs}"
    before = f"mkdir -p {designs} && mount -o remount,ro {disk} && " if read_only else ""
    done = _mounted(disk, f"size={size}", f"{before}{words}; code=$?; cp -r {disk}/study {kept}; exit $code")
    return _ended(ground, kept / "study" / "designs", done.returncode, done.stdout + done.stderr, {})


def vanishing(ground: Ground, folder: Path, moments: random.Random) -> Outcome:
    """Somebody deletes the whole folder while the run goes on: it says so, or computes what is gone again."""
    designs = folder / "study" / "designs"
    process = ground.begin(folder / "marks", "run", ground.plain, "--out", designs)
    reached(process, folder / "marks", "sweep")
    time.sleep(moments.uniform(0.0, ground.seconds["sweep"]))
    shutil.rmtree(folder / "study", ignore_errors=True)
    text, _ = process.communicate(timeout=SECONDS)
    found = Outcome(process.returncode, last_line(text))
    if found.code == 0:
        # Who deletes chunks after the run has looked at all of them for the last time deletes a finished dataset.
        left = files(designs).items()
        found.wrong += [] if left <= ground.whole(ground.plain).items() else ["ended well, but differs"]
    elif found.code != 74 or "Traceback" in text:
        found.wrong.append(f"ended with {found.code}: {text[-1000:]}")
    return ground.settled(ground.plain, designs, {}, found)


DISKS = [
    Kind("files no larger than so many bytes", 5, partial(limited_files, "threading")),
    Kind("the same, processes", 3, partial(limited_files, "loky")),
    Kind("small file system", 5, partial(small_disk, False)),
    Kind("read-only folder", 2, partial(small_disk, True)),
    Kind("vanishing folder", 10, vanishing),
]
