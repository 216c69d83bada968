"""One run at a time in a dataset: a lock that dies with its process."""

from __future__ import annotations

import contextlib
import errno
import os
import warnings
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING

from sweep.dataset.files import read_runs, store_errors
from sweep.dataset.layout import LOCK, beside
from sweep.errors import LinksweepWarning, LockedError

if TYPE_CHECKING:
    from filelock import BaseFileLock

# What a file system answers that has no locks.
UNLOCKABLE = (errno.ENOSYS, errno.EOPNOTSUPP, errno.ENOTSUP, errno.ENOLCK)


@contextlib.contextmanager
def locked(folder: Path) -> Iterator[None]:
    """Hold a dataset for this process; the lock dies with it.

    Both the file ``_lock`` and the folder of the chunks are locked, so that nobody gets in by deleting the file.

    Raises
    ------
    LockedError
        if another run holds it
    StoreError
        if the folder cannot be made or written to

    Warns
    -----
    LinksweepWarning
        if the file system has no locks: then a file that is there or not takes the place of one.
    """
    with store_errors(folder):
        folder.mkdir(parents=True, exist_ok=True)
        beside(folder).mkdir(parents=True, exist_ok=True)
        lock = _acquired(folder)
        try:
            held = _hold(folder)
        except BaseException:
            lock.release()
            raise
    try:
        yield
    finally:
        if held is not None:
            os.close(held)
        lock.release()


def _acquired(folder: Path) -> BaseFileLock:
    from filelock import FileLock, SoftFileLock, Timeout

    path = beside(folder) / LOCK
    lock: BaseFileLock = FileLock(path, timeout=0, fallback_to_soft=False)
    try:
        try:
            lock.acquire()
        except OSError as error:
            if error.errno not in UNLOCKABLE or isinstance(error, Timeout):
                raise
            lock = SoftFileLock(path, timeout=0)
            lock.acquire()
            text = f"{folder}: this file system has no locks. The file {path} says that a run is at work here; "
            text += "after a crash on another computer delete it yourself, once you know that nothing runs there"
            warnings.warn(text, LinksweepWarning, stacklevel=3)
    except Timeout:
        raise _refused(folder) from None
    return lock


def _hold(folder: Path) -> int | None:
    """Return a descriptor that holds a lock on the folder itself; None where the system locks no folders."""
    try:
        import fcntl
    except ImportError:  # Windows
        return None
    descriptor = os.open(folder, os.O_RDONLY)
    try:
        fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        os.close(descriptor)
        raise _refused(folder) from None
    except OSError:  # network file systems lock files only
        os.close(descriptor)
        return None
    return descriptor


def _refused(folder: Path) -> LockedError:
    return LockedError(f"{folder}: another run is writing here ({_holder(folder)})")


def _holder(folder: Path) -> str:
    starts = [line for line in read_runs(folder) if line.get("event") == "start"]
    if not starts:
        return "it has not said which"
    return f"process {starts[-1].get('pid')} on {starts[-1].get('host')} since {starts[-1].get('time')}"
