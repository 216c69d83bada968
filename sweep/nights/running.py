"""A study's run and report in processes of their own: a crash there ends neither the night nor the other studies."""

from __future__ import annotations

import os
import subprocess
import sys
import time
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from sweep.dataset.files import store_errors

RUN_LOG = "run.log"
# For a run to leave once it is told that the time is over [s]; it promises two.
GRACE = 10.0
# The same, where the night itself was told to leave and has promised two.
HURRY = 1.2
# So long a command of the user's may take [s].
COMMAND_SECONDS = 60.0


@dataclass(frozen=True)
class Ended:
    """How a process ended: exit code (that of the time limit is 124), time [s], and its last line."""

    code: int
    seconds: float
    message: str


def call(words: Sequence[str], log: Path, seconds: float) -> Ended:
    """Run a verb of the command line; what it says goes to the end of ``log``.

    Parameters
    ----------
    words : the verb and its arguments
    log : file
    seconds : after so long it is told to leave
    """
    home = str(Path(__file__).resolve().parents[2])
    path = os.pathsep.join([home, *filter(None, [os.environ.get("PYTHONPATH")])])
    # -P: a folder that happens to be the current one adds no modules.
    command = [sys.executable, "-P", "-m", "sweep", *words]
    begin = time.monotonic()
    with store_errors(log):
        log.parent.mkdir(parents=True, exist_ok=True)
        with log.open("ab") as file:
            start = file.tell()
            process = subprocess.Popen(
                command, stdin=subprocess.DEVNULL, stdout=file, stderr=subprocess.STDOUT,
                env=os.environ | {"PYTHONPATH": path}, start_new_session=True,
            )  # fmt: skip
            code = _wait(process, seconds)
        with log.open("rb") as read:
            read.seek(start)
            lines = [line for line in read.read().decode(errors="replace").splitlines() if line.strip()]
    return Ended(code, time.monotonic() - begin, lines[-1].strip() if lines else "")


def _wait(process: subprocess.Popen[bytes], seconds: float) -> int:
    """Return the exit code as a shell has it; 124 where the time was over."""
    try:
        code = process.wait(timeout=max(seconds, 0.0))
    except subprocess.TimeoutExpired:
        _end(process, GRACE)
        return 124
    except BaseException:
        _end(process, HURRY)
        raise
    return code if code >= 0 else 128 - code


def _end(process: subprocess.Popen[bytes], grace: float) -> None:
    process.terminate()
    try:
        process.wait(timeout=grace)
    except subprocess.TimeoutExpired:
        process.kill()
        process.wait()


def notify(command: str, night: Path, code: int, text: str) -> str:
    """Run the user's command in a shell; the summary is its input.  Returns what went wrong, or nothing.

    The command finds the folder of the night in LINKSWEEP_NIGHT, the exit code in LINKSWEEP_CODE.
    """
    about = {"LINKSWEEP_NIGHT": str(night.resolve()), "LINKSWEEP_CODE": str(code)}
    try:
        done = subprocess.run(
            command, shell=True, input=text, text=True, check=False, timeout=COMMAND_SECONDS, capture_output=True,
            env=os.environ | about,
        )  # fmt: skip
    except subprocess.TimeoutExpired:
        return f"took longer than {COMMAND_SECONDS:g} s"
    lines = done.stderr.strip().splitlines()
    return f"ended with {done.returncode}{': ' + lines[-1] if lines else ''}" if done.returncode else ""
