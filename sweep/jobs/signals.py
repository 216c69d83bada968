"""Stopping on request: the first signal sets a flag, the second ends the process."""

from __future__ import annotations

import os
import signal
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from types import FrameType

SIGNALS = (signal.SIGINT, signal.SIGTERM)

WATCH, WATCH_SECONDS = "linksweep: is the parent there", 0.5


class Stop:
    """A flag that tasks look at, and the signal that set it (None if something else did)."""

    def __init__(self) -> None:
        self.event = threading.Event()
        self.signal_number: int | None = None
        self._listeners: list[Callable[[], object]] = []

    def __bool__(self) -> bool:
        return self.event.is_set()

    def set(self) -> None:
        """Set the flag and tell whom it concerns."""
        self.event.set()
        for hear in self._listeners:
            with suppress(OSError):  # who cannot be told any more is not there any more
                hear()

    def tell(self, hear: Callable[[], object]) -> None:
        """Call this when the flag is set, by a signal handler perhaps; at once if it is set already."""
        self._listeners.append(hear)
        if self:
            hear()

    def handle(self, number: int, frame: FrameType | None) -> None:
        """Set the flag; whoever asks a second time gets the system's own way, which stops at once."""
        self.signal_number = number
        self.set()
        signal.signal(number, signal.SIG_DFL)


@contextmanager
def stop_on_signal() -> Iterator[Stop]:
    """Within this context SIGINT and SIGTERM set the flag (a handler that raises can hang a pool of workers).

    Outside the main thread Python allows no handlers; then the flag is set by errors only.
    """
    stop = Stop()
    if threading.current_thread() is not threading.main_thread():
        yield stop
        return
    before = {number: signal.signal(number, stop.handle) for number in SIGNALS}
    try:
        yield stop
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)


@contextmanager
def unheard() -> Iterator[None]:
    """Processes begun within do not hear signals: Ctrl-C reaches the whole group, also who is still starting up."""
    if threading.current_thread() is not threading.main_thread():
        yield  # Python lets no other thread decide on signals
        return
    before = {number: signal.signal(number, signal.SIG_IGN) for number in SIGNALS}
    try:
        yield
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)


def depend_on_parent(parent: int) -> None:
    """In a worker process: leave signals, which a terminal sends to the whole group, to the parent, and die with it.

    Without its parent a worker holds no lock on the folder and would wait for work for minutes.
    """
    if threading.current_thread() is threading.main_thread():
        for number in SIGNALS:
            signal.signal(number, signal.SIG_IGN)
    if WATCH not in [thread.name for thread in threading.enumerate()]:
        threading.Thread(target=_end_with, args=(parent,), name=WATCH, daemon=True).start()


def _end_with(parent: int) -> None:
    while os.getppid() == parent:
        time.sleep(WATCH_SECONDS)
    os._exit(1)
