"""A slow disk for a program and all processes that it starts: every chunk takes FAULTS_PAUSE seconds to reach it.

Python imports a module of this name at its start if it stands in the search path.
"""

import os
import stat
import time

SMALL = 6000  # plan and log are smaller
sync = os.fsync


def slow(descriptor: int) -> None:
    """Wait, then bring a file to the disk."""
    about = os.fstat(descriptor)
    if stat.S_ISREG(about.st_mode) and about.st_size > SMALL:
        time.sleep(float(os.environ.get("FAULTS_PAUSE", "0")))
    sync(descriptor)


os.fsync = slow  # type: ignore[assignment]
