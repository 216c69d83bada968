"""Hashes of this package's sources, read when this process first imports a module that computes values.

A dataset names the code that computed it.  Sources may be edited while a process that has imported them is running, a
notebook perhaps; its results still come from the sources that were read here.
"""

from __future__ import annotations

import hashlib
from pathlib import Path

_ROOT = Path(__file__).resolve().parent

DIGESTS: dict[str, str] = {
    path.relative_to(_ROOT).as_posix(): hashlib.sha256(path.read_bytes()).hexdigest()
    # a table in a text file makes values too, and the registers name what computes them
    for path in sorted([*_ROOT.rglob("*.py"), *_ROOT.rglob("*.txt"), _ROOT / "families.toml", _ROOT / "effects.toml"])
}
