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
NEW_OBJECTS = 10_000  # after which Python looks for garbage among them; its own 700 took a tenth of a short run


def _leave(number: int, frame: FrameType | None) -> None:
    os._exit(128 + number)


def _finish() -> None:
    gc.freeze()  # what is left lives until the end: to look through it for garbage once more took a quarter of a second
    for number in SIGNALS:
        signal.signal(number, signal.SIG_IGN)


def main() -> None:
    """Run the command line."""
    # A verb obeys signals itself.  Before and after it there is nothing to tidy, and at the very end nothing to stop.
    for number in SIGNALS:
        signal.signal(number, _leave)
    atexit.register(_finish)  # the first to be registered is the last to be called
    # Compiling and reading make many objects that live until the end; looking through them early is a waste.
    gc.set_threshold(NEW_OBJECTS)
    try:
        command_line()
    except SystemExit as leaving:
        code = leaving.code if isinstance(leaving.code, int) else int(leaving.code is not None)
        if code not in SIGNALLED:
            # The answer is out: a signal while Python tidies up ends that, and the exit code stays the answer's.
            for number in SIGNALS:
                signal.signal(number, lambda *_: os._exit(code))
            raise
        # Whoever was interrupted half way (a compiler, a pool) has nothing to tidy up, and may hang when it tries.
        sys.stdout.flush()
        sys.stderr.flush()
        os._exit(code)


if __name__ == "__main__":
    main()
