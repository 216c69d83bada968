"""Kills and signals at random moments of every stage."""

from __future__ import annotations

import os
import random
import signal
import subprocess
import time
from functools import partial
from pathlib import Path

from sweep.dataset.files import PARETO, beside
from tests.faults.ground import PAUSE, SECONDS, TABLES, Ground, Kind, Outcome, alone, files, last_line, session

LEAVE_SECONDS = 2.0 + 1.5  # promised, and what a busy machine may take beyond


def prepared(ground: Ground, stage: str, folder: Path) -> tuple[Path, Path]:
    """The study, and a dataset that has come as far as the stage before."""
    if stage == "sweep":
        return ground.plain, folder / "designs"
    missing = {"optimiser": TABLES, "tolerance": TABLES, "front": (PARETO,), "report": ()}[stage]
    designs = ground.swept(ground.rich, folder, without=missing)
    return ground.rich, designs


def reached(process: subprocess.Popen[str], marks: Path, stage: str) -> bool:
    """Wait for a stage; False if the program ends before."""
    deadline = time.monotonic() + SECONDS
    while not (marks.is_file() and stage in marks.read_text().split()):
        if process.poll() is not None:
            return False
        assert time.monotonic() < deadline, f"no {stage} after {SECONDS:g} s"
        time.sleep(0.005)
    return True


def _await_chunk(process: subprocess.Popen[str], designs: Path) -> None:
    while process.poll() is None and not list(designs.glob("part-*")):
        time.sleep(0.005)


def strike(process: subprocess.Popen[str], whom: str, number: int) -> None:
    """Send a signal to the group, the parent or one of its workers, if there is one."""
    if whom == "group":
        os.killpg(process.pid, number)
    elif whom == "parent":
        process.send_signal(number)
    else:
        mark = b"popen_loky" if whom == "worker" else b"spawn_main"
        deadline = time.monotonic() + 20.0
        while process.poll() is None and time.monotonic() < deadline:
            workers = [pid for pid, command in session(process.pid).items() if mark in command]
            if workers:
                os.kill(min(workers), number)
                return
            time.sleep(0.01)


def struck(
    stage: str, whom: str, number: int, backend: str, codes: tuple[int, ...], words: str,
    ground: Ground, folder: Path, moments: random.Random,
) -> Outcome:  # fmt: skip
    """One kill or signal at a random moment of a stage.

    Parameters
    ----------
    stage, whom, number, backend : of the program that is hit
    codes : it may end with; 0 and 4 too, where it was through already
    words : with which its last line then tells what to do
    """
    study, designs = prepared(ground, stage, folder)
    marks = folder / "marks"
    verb = ("report", designs) if stage == "report" else ("run", study, "--out", designs, "--backend", backend)
    process = ground.begin(marks, *verb)
    if reached(process, marks, stage) and backend == "dask":  # its processes come up meanwhile
        _await_chunk(process, designs)
    time.sleep(moments.uniform(0.0, ground.seconds[stage] if backend != "dask" else 2.0 * PAUSE))
    before = files(designs)
    begin = time.monotonic()
    strike(process, whom, number)
    text, _ = process.communicate(timeout=SECONDS)
    took = time.monotonic() - begin
    found = Outcome(process.returncode, last_line(text))
    if not alone(process.pid):
        found.wrong.append("a process stays behind")
    if found.code in (0, 4):
        found.wrong += [] if stage == "report" or files(designs) == ground.whole(study) else ["ended well, but differs"]
    elif found.code not in codes:
        found.wrong.append(f"ended with {found.code}: {text[-2000:]}")
    elif words not in found.said:
        found.wrong.append(f"said {found.said!r}, not {words!r}")
    elif number != signal.SIGKILL and took > LEAVE_SECONDS:
        found.wrong.append(f"left after {took:.1f} s")
    if stage == "report":
        _report_again(ground, designs, found)
    return ground.settled(study, designs, before, found)


def _report_again(ground: Ground, designs: Path, found: Outcome) -> None:
    torn = list(beside(designs).glob("_tmp-*"))
    page = beside(designs) / "report.html"
    if page.is_file() and not page.read_text().rstrip().endswith("</html>"):
        found.wrong.append("report.html is half a page")
    process = ground.begin(beside(designs) / "again", "report", designs)
    text, _ = process.communicate(timeout=SECONDS)
    if process.returncode != 0 or not page.is_file():
        found.wrong.append(f"no report after {torn}: {text[-500:]}")


def _kind(name: str, count: int, stage: str, whom: str, number: int = signal.SIGKILL, backend: str = "threading",
          codes: tuple[int, ...] = (-signal.SIGKILL,), words: str = "") -> Kind:  # fmt: skip
    return Kind(f"{name}, {stage}", count, partial(struck, stage, whom, int(number), backend, codes, words))


def _signals(stage: str, words: str) -> list[Kind]:
    return [
        _kind("Ctrl-C to the group", 4, stage, "group", signal.SIGINT, codes=(130,), words=words),
        _kind("SIGTERM to the parent", 4, stage, "parent", signal.SIGTERM, codes=(143,), words=words),
    ]


AGAIN, DIED = "run again", (70,)

KILLS = [
    _kind("kill -9 of the group", 25, "sweep", "group"),
    _kind("kill -9 of the parent", 15, "sweep", "parent", backend="loky"),
    _kind("kill -9 of a worker", 20, "sweep", "worker", backend="loky", codes=DIED, words=AGAIN),
    _kind("kill -9 of a Dask worker", 5, "sweep", "dask", backend="dask", codes=DIED, words=AGAIN),
    _kind("kill -9 of the group", 15, "optimiser", "group"),
    _kind("kill -9 of the parent", 10, "optimiser", "parent"),
    _kind("kill -9 of a worker", 15, "optimiser", "worker", codes=DIED, words=AGAIN),
    _kind("kill -9 of the group", 10, "tolerance", "group"),
    _kind("kill -9 of the group", 10, "front", "group"),
    _kind("kill -9 of a worker", 10, "front", "worker", codes=DIED, words=AGAIN),
    _kind("kill -9 of the group", 15, "report", "group"),
]

SIGNALS = [
    *_signals("sweep", AGAIN), *_signals("optimiser", AGAIN), *_signals("front", AGAIN), *_signals("report", ""),
]  # fmt: skip
