"""The folder of the nights: records of nights and studies, ``latest``, the lock, and deletion of old nights."""

from __future__ import annotations

import contextlib
import json
import os
import re
import shutil
import time
from collections.abc import Callable, Iterator, Mapping
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any, Literal

from sweep.dataset.files import store_errors, write_atomically
from sweep.dataset.lock import held

NIGHT, HISTORY = "night.json", "history.jsonl"
LATEST, LOCK = "latest", "_lock"
# Prefix of a night that is being deleted: it is ignored, and the next night completes the deletion.
GOING = "_going-"
_NAME = re.compile(r"\d{4}-\d\d-\d\dT\d\d-\d\d-\d\dZ(\+\d{3})?")
EVENTS, WORDS = "log.jsonl", "log.txt"

RunState = Literal["complete", "cut", "waiting", "failed"]


@dataclass(frozen=True)
class StudyRecord:
    """One study in one night.

    ``state`` is "complete"; "cut" if the time ran out during the run; "waiting" if it ran out before the run began;
    "failed" with the exit code of the run in ``code``.  ``linked`` chunks come from the night ``linked_from``,
    ``computed`` ones are new.  ``seconds`` is the time of the run, None if nothing had to be computed.  ``figures`` are
    the headline figures, with their ``units``.  ``changes`` describes in words the changes since the night
    ``compared_with``, ``changed`` is 0, 10, 11 or 12, and ``moved`` names the changed figures;
    ``edited`` says that the study file was edited, which is then the only change.
    """

    state: RunState
    code: int = 0
    linked_from: str | None = None
    linked: int = 0
    computed: int = 0
    seconds: float | None = None
    figures: Mapping[str, float] = field(default_factory=dict)
    units: Mapping[str, str] = field(default_factory=dict)
    compared_with: str | None = None
    changed: int = 0
    changes: tuple[str, ...] = ()
    moved: tuple[str, ...] = ()
    edited: bool = False
    report: bool = False
    message: str = ""


@dataclass(frozen=True)
class NightRecord:
    """One night; it is ``good`` if all its studies are complete."""

    name: str
    seconds: float
    exit_code: int
    studies: Mapping[str, StudyRecord]

    @property
    def good(self) -> bool:
        """Whether every study is complete, with or without changes."""
        return all(record.state == "complete" for record in self.studies.values())

    @property
    def quiet(self) -> str:
        """Words for a night without changes."""
        first = all(record.compared_with is None for record in self.studies.values())
        return "first night, nothing to compare with" if first else "no change"

    def as_dict(self) -> dict[str, Any]:
        """Return the record as a dict for JSON."""
        return asdict(self) | {"good": self.good}


def write_night(folder: Path, record: NightRecord) -> None:
    """Write the record into the folder of its night, atomically."""
    write_atomically(folder / NIGHT, (json.dumps(record.as_dict(), indent=1) + "\n").encode())


def read_night(folder: Path) -> NightRecord | None:
    """Return the record of a night, or None if the night has not ended."""
    path = folder / NIGHT
    if not path.is_file():
        return None
    with store_errors(path):
        text = path.read_bytes()
    return _record(text)


def append_history(into: Path, record: NightRecord) -> None:
    """Add a night to the history, which remains after the night's folder is deleted."""
    before = read_history(into)
    nights = [*(night for night in before if night.name != record.name), record]
    text = "".join(json.dumps(night.as_dict()) + "\n" for night in nights)
    write_atomically(into / HISTORY, text.encode())


def read_history(into: Path, tell: Callable[[str], None] = lambda words: None) -> list[NightRecord]:
    """Return all nights that have ended, the oldest first.

    Unreadable lines are left out and reported to ``tell``.
    """
    path = into / HISTORY
    if not path.is_file():
        return []
    with store_errors(path):
        lines = path.read_bytes().splitlines()
    read = [_record(line) for line in lines]
    unread = [str(k) for k, night in enumerate(read, 1) if night is None]
    if unread:
        tell(f"{path}: line {', '.join(unread)} cannot be read and is left out")
    return [night for night in read if night is not None]


def _record(text: bytes) -> NightRecord | None:
    from pydantic import TypeAdapter, ValidationError

    try:
        return TypeAdapter(NightRecord).validate_json(text, strict=False)
    except (ValidationError, RecursionError):
        return None


class Journal:
    """Log of a night, written event by event, so that it shows the progress of a killed night.

    Parameters
    ----------
    folder : folder of the night
    say : called with the words of every event
    """

    def __init__(self, folder: Path, say: Callable[[str], None]) -> None:
        self.folder, self.say = folder, say

    def note(self, event: str, words: str, **about: Any) -> None:
        """Log an event; ``about`` is for programs, ``words`` for people."""
        now = time.gmtime()
        entry = {"time": time.strftime("%Y-%m-%dT%H:%M:%SZ", now), "event": event, "words": words} | about
        with store_errors(self.folder):
            with (self.folder / EVENTS).open("a", encoding="utf-8") as file:
                file.write(json.dumps(entry) + "\n")
            with (self.folder / WORDS).open("a", encoding="utf-8") as file:
                file.write(f"{time.strftime('%H:%M:%S', now)}  {words}\n")
        self.say(words)


@contextlib.contextmanager
def one_at_a_time(into: Path) -> Iterator[None]:
    """Hold the lock of the nights' folder, which is released when the process ends.

    Raises
    ------
    LockedError
        if another night holds the lock
    StoreError
        if the folder cannot be created or written.
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
    return [path for path in nights(into) if (record := read_night(path)) is not None and record.good]


def new_night(into: Path) -> Path:
    """Create the folder of a new night, named by the time (UTC); it sorts after all others even if the clock jumps."""
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
    """Let ``latest`` point to a night, by an atomic replacement."""
    fresh = into / f"_tmp-{LATEST}-{os.getpid()}"
    with store_errors(into):
        fresh.unlink(missing_ok=True)
        fresh.symlink_to(night.name, target_is_directory=True)
        fresh.replace(into / LATEST)


def drop_old(into: Path, keep: int) -> list[str]:
    """Delete all but the newest ``keep`` nights; the last good night always stays.

    Returns
    -------
    names of the deleted nights.
    """
    good = good_nights(into)
    retained = {*nights(into)[-keep:], *good[-1:]}
    gone = [path for path in nights(into) if path not in retained]
    with store_errors(into):
        for path in gone:
            path.rename(into / f"{GOING}{path.name}")
        for path in into.glob(f"{GOING}*"):
            shutil.rmtree(path)
    return [path.name for path in gone]
