"""The folder of the nights: a dated folder for each, ``latest``, the lock, and which nights are kept."""

from __future__ import annotations

import contextlib
import os
import re
import shutil
import time
from collections.abc import Iterator
from pathlib import Path

from sweep.dataset.files import store_errors
from sweep.dataset.lock import held
from sweep.nights.records import read_night

LATEST, LOCK = "latest", "_lock"
# A night that is being deleted has this before its name: nobody takes it for one, and the next night deletes the rest.
GOING = "_going-"
_NAME = re.compile(r"\d{4}-\d\d-\d\dT\d\d-\d\d-\d\dZ(\+\d{3})?")


@contextlib.contextmanager
def one_at_a_time(into: Path) -> Iterator[None]:
    """Hold the folder of the nights; the lock dies with its process.

    Raises
    ------
    LockedError
        if another night is at work there
    StoreError
        if the folder cannot be made or written to.
    """
    with store_errors(into):
        into.mkdir(parents=True, exist_ok=True)
    with held(into, into / LOCK, lambda: "another night is at work here"):
        yield


def nights(into: Path) -> list[Path]:
    """Return the folders of all nights, ended or not, the oldest first."""
    return sorted(path for path in into.iterdir() if _NAME.fullmatch(path.name) and path.is_dir())


def good_nights(into: Path) -> list[Path]:
    """Return the nights in which every study is complete, the oldest first."""
    found = []
    for path in nights(into):
        record = read_night(path)
        if record is not None and record.good:
            found.append(path)
    return found


def new_night(into: Path) -> Path:
    """Make the folder of a new night, named by the time (UTC); it comes after all others even if the clock jumps."""
    name = time.strftime("%Y-%m-%dT%H-%M-%SZ", time.gmtime())
    before = [path.name for path in nights(into)]
    if before and name <= before[-1]:
        base, _, count = before[-1].partition("+")
        name = f"{base}+{int(count or 0) + 1:03d}"
    folder = into / name
    with store_errors(folder):
        folder.mkdir()
    return folder


def point_latest(into: Path, night: Path) -> None:
    """Let ``latest`` lead to a night; at every moment it leads to the old one or to the new one."""
    fresh = into / f"_tmp-{LATEST}-{os.getpid()}"
    with store_errors(into):
        fresh.unlink(missing_ok=True)
        fresh.symlink_to(night.name, target_is_directory=True)
        fresh.replace(into / LATEST)


def drop_old(into: Path, keep: int) -> list[str]:
    """Delete all but the newest ``keep`` nights; the last good night always stays.

    Returns
    -------
    names of the nights that were deleted.
    """
    good = good_nights(into)
    kept = {*nights(into)[-keep:], *good[-1:]}
    gone = [path for path in nights(into) if path not in kept]
    with store_errors(into):
        for path in gone:
            path.rename(into / f"{GOING}{path.name}")
        for path in into.glob(f"{GOING}*"):
            shutil.rmtree(path)
    return [path.name for path in gone]
