"""Two processes that compile for one run: each kernel by one of them, the other waits for it and loads it.

A process claims a kernel by a lock on one byte of a file that has no name.  The system gives a lock free when its
process ends, however it does.  No two processes wait for each other: who waits within a kernel waits for a part of it,
and kernels do not call each other in a circle.
"""

from __future__ import annotations

import os
import threading
import time
import zlib
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from typing import Any

with suppress(ImportError):  # Windows has none, and nothing here is called there
    import fcntl

PATIENCE = 60.0  # with a process that was halted [s]; a kernel takes three seconds, on a busy machine some more
LOOK = 0.005  # between two looks at whether a claim is free [s]

_begin: Callable[[], bool] | None = None
_file: int | None = None
_within = 0  # claims that this process holds
_impatient = False


class Busy(Exception):
    """Another process compiles the kernel that was called."""


def possible() -> bool:
    """Whether this system has what claims are made of."""
    return hasattr(os, "memfd_create")  # Linux


@contextmanager
def on_first(begin: Callable[[], bool]) -> Iterator[None]:
    """Call ``begin`` when the first kernel has to be compiled within this context.

    It is to fork the second process, and says whether there is one; until the context ends kernels are claimed.
    """
    global _begin, _file
    _begin = begin
    try:
        yield
    finally:
        _begin = None
        if _file is not None:
            os.close(_file)
            _file = None


@contextmanager
def impatient() -> Iterator[None]:
    """Raise `Busy` within this context, rather than wait for a kernel that was called from Python."""
    global _impatient
    _impatient = True
    try:
        yield
    finally:
        _impatient = False


@contextmanager
def claimed(name: str, args: tuple[Any, ...]) -> Iterator[bool]:
    """Claim a kernel for types of arguments; whether another process may have compiled it meanwhile."""
    _begin_second()
    if _file is None or not _lock(_file, place := zlib.crc32(f"{name}{args}".encode())):
        yield False
        return
    global _within
    _within += 1
    try:
        yield True
    finally:
        _within -= 1
        fcntl.lockf(_file, fcntl.LOCK_UN, 1, place)


def _begin_second() -> None:
    global _begin, _file
    if _begin is None or threading.current_thread() is not threading.main_thread():
        return
    begin, _begin = _begin, None
    _file = os.memfd_create("linksweep")
    if not begin():
        os.close(_file)
        _file = None


def _lock(file: int, place: int) -> bool:
    """Lock a byte; False where the other process holds it for longer than any kernel takes."""
    end = time.monotonic() + PATIENCE
    while time.monotonic() < end:
        try:
            fcntl.lockf(file, fcntl.LOCK_EX | fcntl.LOCK_NB, 1, place)
            return True
        except (BlockingIOError, PermissionError):
            if _impatient and not _within:
                raise Busy from None
            time.sleep(LOOK)
    return False
