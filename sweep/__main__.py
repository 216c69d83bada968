"""``python -m sweep``: the command line."""

from __future__ import annotations

import gc
import os
import sys

SIGNALLED = (130, 143)

# New objects after which Python looks for garbage among them; its own 700 let a short run spend a tenth of its time on
# looking again and again through what the compiler keeps.
NEW_OBJECTS = 10_000


def main() -> None:
    """Run the command line."""
    gc.set_threshold(NEW_OBJECTS)
    from sweep.cli import main as command_line

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
