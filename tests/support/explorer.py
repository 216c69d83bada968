"""A running `sweep explore` as seen by another program: a process, an address, requests."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any
from urllib.request import Request, urlopen

ROOT = Path(__file__).parents[2]
PATIENCE = 120  # seconds for a request on a busy machine


@contextmanager
def explored(source: str | Path) -> Iterator[str]:
    """Yield the address of a server that ends by SIGINT like Ctrl-C; it has to end without errors."""
    command = [sys.executable, "-m", "sweep", "explore", str(source)]
    environment = os.environ | {"PYTHONPATH": str(ROOT)}
    process = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, env=environment)
    assert process.stdout is not None and process.stderr is not None
    line = process.stdout.readline()
    assert line.startswith("explore: http://127.0.0.1:"), line + process.stderr.read()
    try:
        yield line.removeprefix("explore: ").strip()
    finally:
        process.send_signal(signal.SIGINT)
        _, said = process.communicate(timeout=30)
    # with kernels that no test has compiled before, the page tells its progress
    assert process.returncode == 0 and all(line.startswith("compiling") for line in said.splitlines()), said


def asked(address: str, what: str, content: object, **headers: str) -> Any:
    """Return the JSON answer of the server."""
    with urlopen(Request(address + what, json.dumps(content).encode(), headers), timeout=PATIENCE) as reply:
        return json.load(reply)
