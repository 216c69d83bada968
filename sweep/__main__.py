"""``python -m sweep``: the command line."""

from __future__ import annotations

import os
import sys

SIGNALLED = (130, 143)


def main() -> None:
    """Run the command line."""
    from kernels._garbage import program_of_our_own
    from sweep.cli import main as command_line

    program_of_our_own()

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
