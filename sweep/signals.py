"""Stopping on request: the first signal sets a flag, the second ends the process."""

from __future__ import annotations

import signal
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from types import FrameType

SIGNALS = (signal.SIGINT, signal.SIGTERM)


class Stop:
    """A flag that tasks look at, and the signal that set it (None if something else did)."""

    def __init__(self) -> None:
        self.event = threading.Event()
        self.signal_number: int | None = None

    def __bool__(self) -> bool:
        return self.event.is_set()

    def handle(self, number: int, frame: FrameType | None) -> None:
        """Set the flag; whoever asks a second time gets the system's own way, which stops at once."""
        self.signal_number = number
        self.event.set()
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


def leave_to_parent() -> None:
    """In a worker process: a signal sent to the whole group is the parent's affair."""
    for number in SIGNALS:
        signal.signal(number, signal.SIG_IGN)
