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


def _finish() -> None:
    gc.freeze()  # all remaining objects live until the end: a last collection took a quarter of a second
    for number in SIGNALS:
        signal.signal(number, signal.SIG_IGN)


def main() -> None:
    """Run the command line."""
    # A subcommand handles signals itself; before and after it a signal may end the process at once.
    for number in SIGNALS:
        signal.signal(number, _leave)
    atexit.register(_finish)  # registered first, so called last
    # Compiling and reading create many objects that live until the end; collecting among them early is a waste.
    gc.set_threshold(NEW_OBJECTS)
    try:
        command_line()
    except SystemExit as leaving:
        code = leaving.code if isinstance(leaving.code, int) else int(leaving.code is not None)
        if code not in SIGNALLED:
            # The output is written: a signal during Python's shutdown ends the process with the same exit code.
            for number in SIGNALS:
                signal.signal(number, lambda *_: os._exit(code))
            raise
        # An interrupted compiler or pool has nothing to clean up, and may hang when it tries.
        sys.stdout.flush()
        sys.stderr.flush()
        os._exit(code)


if __name__ == "__main__":
    main()
