"""How far a sweep is: a bar with the remaining time on a terminal, a plain line now and then in a log."""

from __future__ import annotations

import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from types import TracebackType
from typing import Never, TextIO

from tqdm import tqdm

LINE_SECONDS = 10.0


class Progress:
    """Counts designs, or starts; used as a context.

    Nobody to tell (a closed pipe, a lost terminal) silences it, not the sweep.

    Parameters
    ----------
    label : what is swept
    total : designs in all
    done : designs finished by earlier runs
    show : False for a silent one (the library's way unless asked)
    unit : what is counted
    """

    def __init__(
        self, label: str, total: int, done: int, show: bool, stream: TextIO | None = None, unit: str = "designs"
    ) -> None:
        self.label, self.total, self.done, self.unit = label, total, done, unit
        self.stream = sys.stderr if stream is None else stream
        self.show = show and self.stream is not None
        self.begin = self.said = time.monotonic()
        self.first = done
        self.bar: tqdm[Never] | None = None
        if self.show and self.stream.isatty():
            self.bar = tqdm(desc=label, total=total, initial=done, unit=f" {unit}", unit_scale=True, file=self.stream)

    def __enter__(self) -> Progress:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        with self._listener():
            if self.bar is not None:
                self.bar.close()
            elif self.show:
                self._line()

    def advance(self, designs: int) -> None:
        """So many more designs are finished."""
        self.done += designs
        with self._listener():
            if self.bar is not None:
                self.bar.update(designs)
            elif self.show and time.monotonic() - self.said > LINE_SECONDS:
                self._line()

    @contextmanager
    def _listener(self) -> Iterator[None]:
        try:
            yield
        except OSError:
            self.show, self.bar = False, None

    def _line(self) -> None:
        self.said = time.monotonic()
        seconds = self.said - self.begin
        text = f"{self.label}: {self.done} of {self.total} {self.unit} ({self.done / max(self.total, 1):.0%})"
        text += f", {seconds:.0f} s"
        if self.first < self.done < self.total:
            text += f", {seconds * (self.total - self.done) / (self.done - self.first):.0f} s left"
        self.stream.write(text + "\n")
        self.stream.flush()
