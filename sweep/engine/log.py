"""What the log of a dataset says of a run: who, when, where, by which command, with which versions."""

from __future__ import annotations

import os
import platform
import shlex
import socket
import subprocess
import time
import uuid
from collections.abc import Iterator
from contextlib import contextmanager
from importlib.metadata import version
from pathlib import Path
from typing import Any

from sweep.dataset import store
from sweep.errors import StoreError
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


@contextmanager
def logged(folder: Path, said: str, jobs: int, backend: str) -> Iterator[list[str]]:
    """Log the start of a run and its end: the error that ended it, or what the caller appends to the list."""
    head = {"run": uuid.uuid4().hex[:12]}
    begin = time.monotonic()
    store.append_run(folder, head | {"event": "start", "command": said} | circumstances(jobs, backend))
    words: list[str] = []
    try:
        yield words
    except Exception as error:
        if not isinstance(error, StoreError):  # the log stands on the disk that has just refused
            store.append_run(folder, head | _end(begin, type(error).__name__, str(error)))
        raise
    store.append_run(folder, head | _end(begin, "complete", "; ".join(words)))


def _end(begin: float, outcome: str, text: str) -> dict[str, Any]:
    return {"event": "end", "outcome": outcome, "seconds": round(time.monotonic() - begin, 3), "text": text}
