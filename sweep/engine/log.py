"""What the log of a dataset says of a run: who, when, where, by which command, with which versions."""

from __future__ import annotations

import os
import platform
import shlex
import socket
import subprocess
import time
from importlib.metadata import version
from pathlib import Path
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from sweep.study import Study

LIBRARIES = ("linksweep", "numpy", "numba", "llvmlite", "scipy", "pandas", "pyarrow", "joblib")


def command(study: Study, folder: Path, smoke: bool, accuracy: float | None, certify: bool | None) -> str:
    """Return the command that makes the dataset again."""
    words = ["sweep", "run", str(study.path), "--out", str(folder), *(["--smoke"] if smoke else [])]
    words += [] if accuracy is None else ["--accuracy", repr(accuracy)]
    return shlex.join([*words, *(["--certify"] if certify else [])])


def circumstances(jobs: int, backend: str) -> dict[str, Any]:
    """Return what may differ between runs that give the same bytes."""
    return {
        "time": time.strftime("%Y-%m-%dT%H:%M:%SZ", time.gmtime()),
        "host": socket.gethostname(),
        "pid": os.getpid(),
        "machine": f"{platform.system()} {platform.machine()}, {os.cpu_count()} cores",
        "python": platform.python_version(),
        "versions": {name: version(name) for name in LIBRARIES},
        "commit": _commit(),
        "jobs": jobs,
        "backend": backend,
    }


def _commit() -> str | None:
    """Return the commit of the sources, None where they are not a git work tree or there is no git."""
    line = ["git", "-C", str(Path(__file__).resolve().parent), "rev-parse", "HEAD"]
    try:
        done = subprocess.run(line, capture_output=True, text=True, check=False, timeout=10)
    except (FileNotFoundError, subprocess.TimeoutExpired):
        return None
    return done.stdout.strip() or None if done.returncode == 0 else None
