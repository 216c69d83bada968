"""The sources of this package as they were when this process imported the first one that makes a value.

A dataset names the code that made it.  Sources may be edited while a process that has imported them goes on, a notebook
perhaps; what it computes then is still what was read here.
"""

from __future__ import annotations

import hashlib
from pathlib import Path

_ROOT = Path(__file__).resolve().parent

DIGESTS: dict[str, str] = {
    path.relative_to(_ROOT).as_posix(): hashlib.sha256(path.read_bytes()).hexdigest()
    for path in sorted(_ROOT.rglob("*.py"))
}
