"""When Python looks for garbage: not while it compiles, and in a program of our own never among what compiling left.

A compiler makes a million objects that refer to each other, and nearly all live until the process ends.  Python would
look through them after each kernel, which takes a tenth of a first use.
"""

from __future__ import annotations

import gc
from collections.abc import Iterator
from contextlib import contextmanager

# New objects after which Python looks for garbage among them; its own 700 let a short run spend a tenth of its time on
# looking again and again through what the compiler keeps.
NEW_OBJECTS = 10_000
_ours = False


def program_of_our_own() -> None:
    """Take it that nobody else's objects are in this process, so what is there after compiling may stay for good."""
    global _ours
    _ours = True
    gc.set_threshold(NEW_OBJECTS)


@contextmanager
def nobody_looks() -> Iterator[None]:
    """Keep Python from looking for garbage."""
    if not gc.isenabled():
        yield
        return
    gc.disable()
    try:
        yield
    finally:
        if _ours:
            gc.freeze()
        gc.enable()
