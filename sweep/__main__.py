"""``python -m sweep``: the command line."""

from __future__ import annotations

import atexit
import gc
import os
import signal
import sys
from types import FrameType

from sweep.cli import main as command_line
from sweep.jobs.signals import SIGNALS

SIGNALLED = (130, 143)
NEW_OBJECTS = 10_000  # threshold of the garbage collector; the default of 700 took a tenth of a short run


def _leave(number: int, frame: FrameType | None) -> None:
    os._exit(128 + number)


def _flush() -> None:
    for stream in (sys.stdout, sys.stderr):
        if stream is not None:  # the caller may have closed it: sweep ... >&-
            stream.flush()


class ProcessEnd:
    """The end of the process, after everything that Python calls at exit.

    It skips the destructors of libraries: threads of pyarrow may still hold a file, which aborts the program
    (apache/arrow 34314).  Output that cannot be written is left to Python, which says so.
    """

    def __init__(self) -> None:
        self.code: int | None = None  # None: an error of the program ends it

    def __call__(self) -> None:
        """End the process with the exit code."""
        for number in SIGNALS:
            signal.signal(number, signal.SIG_IGN)
        if self.code is None:
            return
        try:
            _flush()
        except (OSError, ValueError):  # a full disk, or a stream that is closed
            return
        os._exit(self.code)


def main() -> None:
    """Run the command line."""
    # A subcommand handles signals itself; before and after it a signal may end the process at once.
    for number in SIGNALS:
        signal.signal(number, _leave)
    ending = ProcessEnd()
    atexit.register(ending)  # registered first, so called last
    # Compiling and reading create many objects that live until the end; collecting among them early is a waste.
    gc.set_threshold(NEW_OBJECTS)
    try:
        command_line()
    except SystemExit as leaving:
        code = leaving.code if isinstance(leaving.code, int) else int(leaving.code is not None)
        ending.code = code
        if code not in SIGNALLED:
            # The output is written: a signal during Python's shutdown ends the process with the same exit code.
            for number in SIGNALS:
                signal.signal(number, lambda *_: os._exit(code))
            raise
        # An interrupted compiler or pool has nothing to clean up, and may hang when it tries.
        _flush()
        os._exit(code)


if __name__ == "__main__":
    main()
