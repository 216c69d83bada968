"""Lock of a dataset: one run at a time; the lock is released when its process ends."""

from __future__ import annotations

import contextlib
import errno
import os
import warnings
from collections.abc import Callable, Iterator
from pathlib import Path

from filelock import BaseFileLock, FileLock, SoftFileLock, Timeout, lock_descriptor

from sweep.dataset.files import LOCK, beside, read_runs, store_errors
from sweep.errors import LinksweepWarning, LockedError

# Suffix of a file whose existence is the lock.
SOFT = "-soft"

# Errors of a file system without locks.
UNLOCKABLE = (errno.ENOSYS, errno.EOPNOTSUPP, errno.ENOTSUP, errno.ENOLCK)


@contextlib.contextmanager
def locked(folder: Path) -> Iterator[None]:
    """Lock a dataset for this process; the lock is released when the process ends.

    Both the file ``_lock`` and the folder of the chunks are locked, so that deleting the file does not open the
    dataset.

    Raises
    ------
    LockedError
        if another run holds the lock
    StoreError
        if the folder cannot be made or written to

    Warns
    -----
    LinksweepWarning
        if the file system has no locks: then the existence of a file is the lock.
    """
    with store_errors(folder):
        folder.mkdir(parents=True, exist_ok=True)
        beside(folder).mkdir(parents=True, exist_ok=True)
    with held(folder, beside(folder) / LOCK, lambda: f"another run is writing here ({_holder(folder)})"):
        yield


@contextlib.contextmanager
def held(folder: Path, file: Path, taken: Callable[[], str]) -> Iterator[None]:
    """Lock an existing folder for this process, by the lock of a file and by that of the folder itself.

    Parameters
    ----------
    folder : locked folder; deleting the file does not open it
    file : locked file
    taken : returns the message if another process holds the folder

    Raises
    ------
    LockedError, StoreError
        as for :func:`locked`.
    """
    with contextlib.ExitStack() as locks:
        with store_errors(folder):
            locks.callback(_acquired(folder, file, taken).release)
            _hold(folder, taken, locks)
        yield


def _acquired(folder: Path, path: Path, taken: Callable[[], str]) -> BaseFileLock:
    lock: BaseFileLock = FileLock(path, timeout=0, fallback_to_soft=False)
    try:
        try:
            lock.acquire()
        except OSError as error:
            if error.errno not in UNLOCKABLE or isinstance(error, Timeout):
                raise
            # Another file: the failed lock has left one of the first name.
            path = path.with_name(path.name + SOFT)
            lock = SoftFileLock(path, timeout=0)
            lock.acquire()
            text = f"{folder}: this file system has no locks. The file {path} says that a run is at work here; "
            text += "after a crash on another computer delete it yourself, once you know that nothing runs there"
            warnings.warn(text, LinksweepWarning, stacklevel=3)
    except Timeout:
        raise LockedError(f"{folder}: {taken()}") from None
    return lock


def _hold(folder: Path, taken: Callable[[], str], locks: contextlib.ExitStack) -> None:
    """Lock the folder itself until ``locks`` ends; nothing where the system cannot lock folders."""
    if os.name == "nt":  # Windows opens no folders
        return
    descriptor = os.open(folder, os.O_RDONLY)
    locks.callback(os.close, descriptor)
    with contextlib.suppress(OSError):  # network file systems lock files only
        if not lock_descriptor(descriptor, blocking=False):
            raise LockedError(f"{folder}: {taken()}")


def _holder(folder: Path) -> str:
    starts = [line for line in read_runs(folder) if line.get("event") == "start"]
    if not starts:
        return "it has not said which"
    return f"process {starts[-1].get('pid')} on {starts[-1].get('host')} since {starts[-1].get('time')}"
