"""The studies of a night: selection, order, and each run in a process of its own.

A crash of a run ends neither the night nor the other studies.
"""

from __future__ import annotations

import os
import subprocess
import sys
import time
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from sweep.dataset import files, store
from sweep.dataset.files import store_errors
from sweep.errors import InputError, LinksweepError
from sweep.nights.archive import read_night
from sweep.study import Study, load_study

FILE, FIGURE = "study.toml", "figure.py"
RUN_LOG = "run.log"
# Time for a run to end after it is told that the time is over [s]; it promises two seconds.
GRACE = 10.0
# The same if the night itself was told to end and has promised two seconds.
HURRY = 0.9
# Largest time of a user's command [s].
COMMAND_SECONDS = 60.0


@dataclass(frozen=True)
class StudyEntry:
    """A study of the night; ``study`` is None if its file has faults, which ``fault`` lists."""

    name: str
    path: Path
    study: Study | None
    fault: str = ""


def studies_in(places: Iterable[Path], smoke: bool) -> list[StudyEntry]:
    """Return the studies of some places: study files, folders with one, or folders of such folders.

    Raises
    ------
    InputError
        if there is no study, or two have the same name: each has a folder of its name in the night.
    """
    places = list(places)
    selected: list[StudyEntry] = []
    for path in [path for place in places for path in files_of(place)]:
        try:
            study = load_study(path, smoke=smoke)
        except (LinksweepError, OSError) as error:
            selected.append(StudyEntry("", path, None, str(error)))
            continue
        twin = next((other for other in selected if other.name == study.name), None)
        if twin is not None:
            raise InputError("study", study.name, f"one study of a name, {twin.path} has it already", str(path))
        selected.append(StudyEntry(study.name, path, study))
    for k, one in enumerate(selected):
        if one.study is None:
            name = one.path.parent.name if one.path.name == FILE else one.path.stem
            names = (name, *(f"{name}-{count}" for count in range(2, len(selected) + 2)))
            taken = [other.name for other in selected]
            selected[k] = replace(one, name=next(free for free in names if free not in taken))
    if not selected:
        raise InputError("studies", ", ".join(map(str, places)), f"study files, or folders with a {FILE}", "nightly")
    return selected


def files_of(place: Path) -> list[Path]:
    """Return the study files of a place; a broken link counts as a file, with a fault."""
    if not place.is_dir():
        return [place]
    return [place / FILE] if os.path.lexists(place / FILE) else sorted(place.glob(f"*/{FILE}"))


def in_order(studies: Sequence[StudyEntry], earlier: Sequence[Path]) -> list[StudyEntry]:
    """Sort the studies: those cut off or not begun in the last night come first, the rest in the given order.

    Parameters
    ----------
    studies : studies of this night
    earlier : folders of nights, the newest first; a killed night has no record and is judged by its datasets
    """
    if not earlier:
        return list(studies)
    last = earlier[0]
    record = read_night(last)

    def late(one: StudyEntry) -> bool:
        if record is not None:
            return one.name in record.studies and record.studies[one.name].state in ("cut", "waiting")
        return not store.is_complete(last / one.name / files.DESIGNS)

    return sorted(studies, key=lambda one: not late(one))


@dataclass(frozen=True)
class Ended:
    """Ending of a process: exit code (124 for the time limit), time [s], and its last line."""

    code: int
    seconds: float
    message: str


def call(words: Sequence[str], log: Path, seconds: float) -> Ended:
    """Run a verb of the command line; its output is appended to ``log``.

    Parameters
    ----------
    words : the verb and its arguments
    log : path of the log file
    seconds : time after which the process is told to end
    """
    return _process(["-m", "sweep", *words], log, seconds)


def draw(figure: Path, folder: Path, log: Path, seconds: float) -> Ended:
    """Draw a study's own figures by its program; parameters as for :func:`call`."""
    return _process([str(figure.resolve()), str(folder.resolve())], log, seconds)


def _process(words: Sequence[str], log: Path, seconds: float) -> Ended:
    home = str(Path(__file__).resolve().parents[2])
    path = os.pathsep.join([home, *filter(None, [os.environ.get("PYTHONPATH")])])
    # -P: the current folder adds no modules.
    command = [sys.executable, "-P", *words]
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
    """Return the exit code as a shell has it; 124 if the time ran out."""
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
    """Run the user's command in a shell with the summary as its input; return its error, or an empty text.

    The command finds the folder of the night in LINKSWEEP_NIGHT, the exit code in LINKSWEEP_CODE.
    """
    about = {"LINKSWEEP_NIGHT": str(night.resolve()), "LINKSWEEP_CODE": str(code)}
    try:
        process = subprocess.run(
            command, shell=True, input=text, text=True, check=False, timeout=COMMAND_SECONDS, capture_output=True,
            env=os.environ | about,
        )  # fmt: skip
    except subprocess.TimeoutExpired:
        return f"took longer than {COMMAND_SECONDS:g} s"
    lines = process.stderr.strip().splitlines()
    return f"ended with {process.returncode}{': ' + lines[-1] if lines else ''}" if process.returncode else ""
