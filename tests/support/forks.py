"""Python processes that start with numba imported, for tests whose own part of a process is short."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from typing import Any

# Nothing of this package is imported here: a fork finds kernels, caches and environment like a new process.
SERVER = """
import json, os, sys, traceback

import numba

numba.njit(lambda x: x + 1.0)(1.0)  # the first function takes as long as the import
for line in sys.stdin:
    program, path, folder, environment = json.loads(line)
    read, write = os.pipe()
    child = os.fork()
    if child == 0:
        code = 1
        try:
            os.dup2(write, 1)
            os.close(read)
            os.close(write)
            os.chdir(folder)
            os.environ.update(environment)
            sys.path.insert(0, path)
            exec(program, {"__name__": "__main__"})
            code = 0
        except BaseException:
            traceback.print_exc()
        sys.stdout.flush()
        os._exit(code)
    os.close(write)
    with os.fdopen(read) as said:
        text = said.read()
    print(json.dumps([os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]), text]), flush=True)
"""


class Forks:
    """A process that forks itself for each program, half a second faster than a new process."""

    def __enter__(self) -> Forks:
        own = os.environ | {"PYTHONPATH": "", "PYTHONDONTWRITEBYTECODE": "", "NUMBA_DISABLE_JIT": "0"}
        command = [sys.executable, "-c", SERVER]
        self._server = subprocess.Popen(
            command, cwd="/", env=own, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
        )
        return self

    def __exit__(self, *_: object) -> None:
        self._server.communicate(timeout=60)

    def run(self, program: str, path: str, folder: str, environment: dict[str, str]) -> tuple[int, str]:
        """Return exit code and standard output of a program in ``folder`` that imports from ``path`` first."""
        assert self._server.stdin is not None and self._server.stdout is not None
        self._server.stdin.write(json.dumps([program, path, folder, environment]) + "\n")
        self._server.stdin.flush()
        found: Any = json.loads(self._server.stdout.readline())
        return found[0], found[1]
