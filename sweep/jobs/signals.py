"""Stopping on request: the first signal sets a flag, the second ends the process.

A deadline is shared by all parts of a search, which check it where they can stop.
"""

from __future__ import annotations

import math
import os
import signal
import sys
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from types import FrameType

from sweep.errors import Interrupted, LinksweepError

SIGNALS = (signal.SIGINT, signal.SIGTERM)

WATCH, WATCH_SECONDS = "linksweep: is the parent there", 0.5


class Stop:
    """A flag that tasks check, and the signal that set it (None if something else did)."""

    def __init__(self) -> None:
        self._raises = False
        self.event = threading.Event()
        self.signal_number: int | None = None
        self._listeners: list[Callable[[], object]] = []

    def __bool__(self) -> bool:
        return self.event.is_set()

    def set(self) -> None:
        """Set the flag and call the listeners."""
        self.event.set()
        for hear in self._listeners:
            with suppress(OSError):  # a listener that cannot be reached has ended
                hear()

    def tell(self, hear: Callable[[], object]) -> None:
        """Call ``hear`` when the flag is set, perhaps by a signal handler; at once if it is set already."""
        self._listeners.append(hear)
        if self:
            hear()

    def handle(self, number: int, frame: FrameType | None) -> None:
        """Set the flag; a second signal gets the system's default action, which ends the process at once."""
        self.signal_number = number
        self.set()
        signal.signal(number, signal.SIG_DFL)
        _countdown(number)
        if self._raises:
            sys.unraisablehook = _say_nothing
            raise KeyboardInterrupt

    def raise_if_signalled(self, what: object, kept: str) -> None:
        """Raise :class:`Interrupted` if a signal has set the flag; ``what`` was stopped, ``kept`` is kept."""
        if self.signal_number is not None:
            text = f"{what}: stopped by signal {self.signal_number}; {kept} kept, run again to continue"
            raise Interrupted(self.signal_number, text)

    @contextmanager
    def raising(self) -> Iterator[None]:
        """Let a signal also raise KeyboardInterrupt within this context, for work of one process that checks no flag.

        The interruption ends the context silently; the flag says why.  A compiler may swallow the interruption and fail
        later because of it: once the flag is set, any error is a consequence.
        """
        self._raises, hook = True, sys.unraisablehook
        try:
            if not self:
                yield
        except (Exception, KeyboardInterrupt):
            if not self:
                raise
        finally:
            self._raises, sys.unraisablehook = False, hook


@contextmanager
def stop_on_signal() -> Iterator[Stop]:
    """Let SIGINT and SIGTERM set the flag within this context (a handler that raises can hang a pool of workers).

    Outside the main thread Python allows no handlers; then only errors set the flag.
    """
    stop = Stop()
    if threading.current_thread() is not threading.main_thread():
        yield stop
        return
    with _handled(stop.handle):
        yield stop


@contextmanager
def _handled(handler: Callable[[int, FrameType | None], None] | signal.Handlers) -> Iterator[None]:
    """Let ``handler`` receive the signals within this context, then those that received them before."""
    before = {number: signal.signal(number, handler) for number in SIGNALS}
    try:
        yield
    finally:
        for number, earlier in before.items():
            signal.signal(number, earlier)


@contextmanager
def unheard() -> Iterator[None]:
    """Shield processes that are started within this context from signals.

    Ctrl-C reaches the whole process group, also processes that are still starting up.  This process receives pending
    signals as soon as the context ends.
    """
    if threading.current_thread() is not threading.main_thread() or not hasattr(signal, "pthread_sigmask"):
        yield  # Python handles signals in the main thread only
        return
    # A new process inherits ignored signals; blocked signals wait in this process until they are unblocked.
    mask = signal.pthread_sigmask(signal.SIG_BLOCK, SIGNALS)
    try:
        with _handled(signal.SIG_IGN):
            yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, mask)


class Terminated(KeyboardInterrupt):
    """SIGTERM where the program can only exit; ``number`` is the signal's number."""

    number = signal.SIGTERM


# Time that a process has for leaving by itself after a signal [s], and the message if it does not.
_promised: list[tuple[float, str]] = []


@contextmanager
def leaving_within(seconds: float, words: str) -> Iterator[None]:
    """Give the process ``seconds`` to leave after a signal within this context; then it is ended.

    For a program, not for a library: compilers and other people's code check no flag.  Outside of
    :func:`stop_on_signal` a signal raises KeyboardInterrupt, or :class:`Terminated`.
    """
    heard: list[int] = []

    def leave(number: int, frame: FrameType | None) -> None:
        heard.append(number)
        signal.signal(number, signal.SIG_DFL)
        _countdown(number)
        sys.unraisablehook = _say_nothing
        raise _interruption(number)

    if threading.current_thread() is not threading.main_thread():
        yield
        return
    hook = sys.unraisablehook
    _promised.append((seconds, words))
    try:
        with _handled(leave):
            yield
    except Exception as error:
        if heard and not isinstance(error, LinksweepError):  # a compiler swallowed the interruption and failed over it
            raise _interruption(heard[-1]) from None
        raise
    finally:
        _promised.pop()
        sys.unraisablehook = hook


def _interruption(number: int) -> KeyboardInterrupt:
    return Terminated() if number == signal.SIGTERM else KeyboardInterrupt()


def _say_nothing(what: object) -> None:
    """Replace the hook that reports an interruption within a callback; report nothing."""


def _countdown(number: int) -> None:
    if _promised:
        seconds, words = _promised[-1]
        timer = threading.Timer(seconds, _leave, (number, words))
        timer.daemon = True
        timer.start()


def _leave(number: int, words: str) -> None:
    with suppress(OSError):
        os.write(2, f"{words}\n".encode())
    os._exit(128 + number)


def depend_on_parent(parent: int) -> None:
    """Ignore signals in this worker process, since a terminal sends them to the whole group, and exit with its parent.

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


class Deadline:
    """Callable that returns True once the budget [s] is used up or ``stop`` returns True; ``pulled`` remembers it."""

    def __init__(self, budget: float | None, stop: Callable[[], bool] | None) -> None:
        self.end = math.inf if budget is None else time.monotonic() + budget
        self.stop, self.pulled = stop, False

    def __call__(self) -> bool:
        """Whether to stop."""
        self.pulled = self.pulled or time.monotonic() >= self.end or (self.stop is not None and self.stop())
        return self.pulled
