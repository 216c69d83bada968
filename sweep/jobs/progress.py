"""Progress of long work: a bar with the remaining time on a terminal, a plain line now and then in a log."""

from __future__ import annotations

import math
import sys
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from typing import TYPE_CHECKING, Never, TextIO, TypeAlias

if TYPE_CHECKING:
    from tqdm import tqdm

FIRST_SECONDS = 2.0  # of silence at the beginning
LINE_SECONDS = 10.0
TICK_SECONDS = 0.5
TICKER = "linksweep: progress"
# Share and number of finished items from which the remaining time is known to a factor of two.
ENOUGH, ALIKE = 0.1, 2
SCALED = 10_000  # numbers from which a bar counts in thousands and millions
BAR = "{desc}: {n_fmt} of {total_fmt}{unit} [{elapsed}]"  # without the remaining time
UNCOUNTED = "{desc}: {n_fmt}{unit} [{elapsed}]"  # without a total
AT_MOST = "at most"  # marks a unit whose total is a maximum, so that neither share nor remaining time is known

Say: TypeAlias = Callable[[str, int, int, str], None]
"""``say(label, done, total, unit)``: name of the work, amount done, and total amount as known by now."""


_stages: ContextVar[tuple[str, ...]] = ContextVar("linksweep_stages", default=())


@contextmanager
def stages(*labels: str) -> Iterator[None]:
    """Show progress of these labels as stage 1/n, 2/n ... within this context; known labels keep an outer numbering."""
    known = _stages.get()
    token = _stages.set(known if set(labels) <= set(known) else labels)
    try:
        yield
    finally:
        _stages.reset(token)


def best_words(value: float) -> str:
    """Words for the best value so far, to follow a unit; empty where there is none."""
    return f", the best {value:.5g}" if math.isfinite(value) else ""


def unsaid(label: str, done: int, total: int, unit: str) -> None:
    """Report no progress."""


class Progress:
    """Progress of designs, or starts; used as a context manager.

    A thread checks twice a second whether a line is due, so that long steps are not silent.  A closed pipe or a lost
    terminal silences the progress and does not stop the sweep.

    Parameters
    ----------
    label : name of the work
    total : number of designs; 0 where nothing can be counted
    done : designs finished by earlier runs
    show : False for a silent one (default of the library)
    unit : what is counted
    quiet : work that takes less than two seconds prints nothing; otherwise its end is always printed
    """

    def __init__(
        self,
        label: str,
        total: int,
        done: int,
        show: bool,
        stream: TextIO | None = None,
        unit: str = "designs",
        quiet: bool = False,
    ) -> None:
        self.label, self.total, self.done, self.unit, self.quiet = label, total, done, unit, quiet
        known = _stages.get()
        self.shown = f"{known.index(label) + 1}/{len(known)} {label}" if label in known else label
        self.stream = sys.stderr if stream is None else stream
        self.show = show and self.stream is not None
        self.begin = self.moved = time.monotonic()
        self.line_time: float | None = None
        self.first = done
        self.bar: tqdm[Never] | None = None
        self.lock, self.over = threading.RLock(), threading.Event()
        self.ticker: threading.Thread | None = None
        if self.show and self.stream.isatty():
            from tqdm import tqdm

            self.bar = tqdm(
                desc=self.shown, bar_format=self._form(), total=total or None, initial=done, unit=f" {unit}",
                unit_scale=total >= SCALED, file=self.stream, delay=FIRST_SECONDS if quiet else 0.0, leave=not quiet,
            )  # fmt: skip

    def __enter__(self) -> Progress:
        if self.show:
            self.ticker = threading.Thread(target=self._tick, name=TICKER, daemon=True)
            self.ticker.start()
        return self

    def __exit__(self, *_: object) -> None:
        self.over.set()
        if self.ticker is not None:
            self.ticker.join()
        with self._listener():
            if self.bar is not None:
                self.bar.close()
            elif self.show and (not self.quiet or self.line_time is not None or self._is_due()):
                self._line()

    @property
    def at_most(self) -> bool:
        """Whether the total is a maximum."""
        return AT_MOST in self.unit

    @property
    def foreseen(self) -> bool:
        """Whether the remaining time is known within a factor of two."""
        done, total = self.done - self.first, self.total - self.first
        return not self.at_most and done >= ALIKE and ENOUGH * total <= done < total

    def _form(self) -> str | None:
        """Format of the bar; None for tqdm's own, with the remaining time."""
        return None if self.foreseen else BAR if self.total else UNCOUNTED

    def advance(self, designs: int) -> None:
        """Add finished designs to the count."""
        with self._listener():
            self.done, self.moved = self.done + designs, time.monotonic()
            if self.bar is not None:
                self.bar.bar_format = self._form()
                self.bar.update(designs)
            else:
                self._line_if_due()

    def expect(self, total: int, unit: str) -> None:
        """Update the total, as known by now, and the unit that is counted."""
        with self._listener():
            self.total, self.unit = total, unit
            if self.bar is not None:
                self.bar.total, self.bar.unit, self.bar.unit_scale = total or None, f" {self.unit}", total >= SCALED
                self.bar.bar_format = self._form()

    def _tick(self) -> None:
        while not self.over.wait(TICK_SECONDS):
            with self._listener():
                if self.bar is not None:
                    self.bar.refresh()
                else:
                    self._line_if_due()

    def _is_due(self) -> bool:
        now = time.monotonic()
        return now - self.begin > FIRST_SECONDS if self.line_time is None else now - self.line_time > LINE_SECONDS

    def _line_if_due(self) -> None:
        if self.show and self._is_due():
            self._line()

    @contextmanager
    def _listener(self) -> Iterator[None]:
        with self.lock:
            try:
                yield
            except OSError:
                self.show, self.bar = False, None

    def _left(self, now: float) -> float:
        """Remaining time [s] at the average speed so far; not positive where the work is late."""
        share = (self.total - self.done) / (self.done - self.first)
        return (self.moved - self.begin) * share - (now - self.moved)

    def _line(self) -> None:
        self.line_time = time.monotonic()
        seconds = self.line_time - self.begin
        text = f"{self.shown}: "
        if self.total:
            share = "" if self.at_most else f" ({self.done / self.total:.0%})"
            unit, comma, more = self.unit.partition(", ")
            text += f"{self.done} of {self.total} {unit}{share}{comma}{more}, "
        elif self.done:
            text += f"{self.done} {self.unit}, "
        text += f"{seconds:.0f} s"
        if self.foreseen and (left := self._left(self.line_time)) > 0.0:
            text += f", {left:.0f} s left"
        self.stream.write(text + "\n")
        self.stream.flush()


class Phases:
    """Progress of successive pieces of work; with ``quiet`` only of those that take more than two seconds.

    It is used as a context manager.
    """

    def __init__(self, show: bool, stream: TextIO | None = None, quiet: bool = True) -> None:
        self.show, self.stream, self.quiet = show, stream, quiet
        self.now: Progress | None = None

    def __enter__(self) -> Phases:
        return self

    def __exit__(self, *_: object) -> None:
        self.end()

    def say(self, label: str, done: int = 0, total: int = 0, unit: str = "steps") -> None:
        """Report the amount done of a piece of work; a new label starts its own count."""
        if self.now is None or self.now.label != label:
            self.end()
            self.now = Progress(label, total, done, self.show, self.stream, unit, self.quiet).__enter__()
            return
        if (total, unit) != (self.now.total, self.now.unit):
            self.now.expect(total, unit)
        if done > self.now.done:
            self.now.advance(done - self.now.done)

    def end(self) -> None:
        """Finish the present piece of work."""
        if self.now is not None:
            self.now.__exit__()
            self.now = None
