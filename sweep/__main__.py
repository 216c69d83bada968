"""``python -m sweep``: the command line."""

from __future__ import annotations

import gc
import os
import sys

from sweep.cli import main as command_line

SIGNALLED = (130, 143)
NEW_OBJECTS = 10_000  # after which Python looks for garbage among them; its own 700 took a tenth of a short run


def main() -> None:
    """Run the command line."""
    # Compiling and reading make many objects that live until the end; looking through them early is a waste.
    gc.set_threshold(NEW_OBJECTS)
    try:
        command_line()
    except SystemExit as leaving:
        if leaving.code not in SIGNALLED:
            raise
        # Whoever was interrupted half way (a compiler, a pool) has nothing to tidy up, and may hang when it tries.
        sys.stdout.flush()
        sys.stderr.flush()
        os._exit(int(leaving.code))


if __name__ == "__main__":
    main()
