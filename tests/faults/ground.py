"""Where faults happen: two studies, what an undisturbed run makes of them, and what is lost or wrong after a fault."""

from __future__ import annotations

import os
import random
import shutil
import subprocess
import sys
import time
from collections.abc import Callable
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import Any

import pyarrow.parquet as pq
import pytest

import sweep.chunks.plan
from sweep.dataset.files import OF_OPTIMUM, OPTIMUM, PARETO, beside
from sweep.engine.run import run
from sweep.errors import LinksweepError
from tests.optimise.test_front import TABLE
from tests.optimise.test_study import STUDY
from tests.support.engine_study import ROOT, SMALL_CHUNKS, write_study

TABLES = (*OF_OPTIMUM, PARETO)
ROBUST = '\n[tolerance]\nlengths = "0.3 mm"\nangles = "0.2 deg"\nrobust = "95 %"\n'
SLOW_DISK = Path(__file__).parent / "slow_disk"
PAUSE = 0.05  # of every write of a chunk or table [s]
SECONDS = 120.0  # for any one program
STAGES = ("sweep", "optimiser", "tolerance", "front", "report")


@dataclass
class Outcome:
    """What one fault has done: how the program ended, its last line, what was lost, what was wrong without a word."""

    code: int | None = None
    said: str = ""
    lost: list[str] = field(default_factory=list)
    wrong: list[str] = field(default_factory=list)


@dataclass(frozen=True)
class Kind:
    """A kind of fault; ``count`` trials of it are a whole run of the suite."""

    name: str
    count: int
    trial: Callable[[Ground, Path, random.Random], Outcome]


def files(designs: Path) -> dict[str, bytes]:
    """Chunks and tables of a dataset by name."""
    tables = [beside(designs) / name for name in TABLES]
    return {path.name: path.read_bytes() for path in [*designs.glob("part-*"), *tables] if path.is_file()}


def last_line(text: str) -> str:
    lines = [line.strip() for line in text.splitlines() if line.strip()]
    return lines[-1] if lines else ""


class Ground:
    """The studies with their undisturbed results: ``plain`` sweeps only, ``rich`` has an optimum and a front too."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self.plain = write_study(folder / "plain", count=60)
        self.rich = folder / "rich" / "study.toml"
        self.rich.parent.mkdir(parents=True)
        self.rich.write_text(STUDY.format(swing=40) + TABLE + ROBUST)
        self.designs = {study: study.parent / "whole" / "designs" for study in (self.plain, self.rich)}
        self._whole: dict[Path, dict[str, bytes]] = {}

    def whole(self, study: Path) -> dict[str, bytes]:
        """What an undisturbed run makes of a study, which is run when it is first asked for."""
        if study not in self._whole:
            self.resume(study, self.designs[study])
            self._whole[study] = files(self.designs[study])
        return self._whole[study]

    @staticmethod
    def resume(study: Path, designs: Path) -> None:
        """Run, or go on, in this process."""
        with pytest.MonkeyPatch.context() as patch:
            for name, value in SMALL_CHUNKS.items():
                patch.setattr(sweep.chunks.plan, name, value)
            run(study, designs, jobs=1)

    def begin(
        self, marks: Path, *words: object, fault: str = "none", pause: float = PAUSE, env: dict[str, str] | None = None,
        **options: Any,
    ) -> subprocess.Popen[str]:  # fmt: skip
        """The command line in a process and a session of its own."""
        command = [sys.executable, "-m", "tests.faults.child", str(marks), fault, *map(str, words)]
        slow = {"PYTHONPATH": f"{SLOW_DISK}{os.pathsep}{ROOT}", "FAULTS_PAUSE": str(pause)}
        return subprocess.Popen(
            command, cwd=ROOT, env=os.environ | slow | (env or {}), text=True, start_new_session=True,
            stdout=subprocess.PIPE, stderr=subprocess.STDOUT, **options,
        )  # fmt: skip

    def swept(self, study: Path, folder: Path, *, without: tuple[str, ...] = ()) -> Path:
        """A copy of the undisturbed dataset without some of its tables, as a run leaves it that has come so far."""
        self.whole(study)
        shutil.copytree(beside(self.designs[study]), folder, dirs_exist_ok=True)
        for name in without:
            (folder / name).unlink(missing_ok=True)
        return folder / "designs"

    @cached_property
    def seconds(self) -> dict[str, float]:
        """How long each stage takes [s]."""
        self.whole(self.rich)
        folder = self.folder / "stages"
        folder.mkdir()
        marks, begun = folder / "marks", dict[str, float]()
        words = ("run", self.rich, "--out", folder / "designs")
        for verb in (words, ("report", self.designs[self.rich])):
            process = self.begin(marks, *verb)
            while process.poll() is None:
                for stage in marks.read_text().split() if marks.is_file() else []:
                    begun.setdefault(stage, time.monotonic())
                time.sleep(0.005)
            assert process.returncode in (0, 4), process.communicate()
            begun.setdefault("end" if verb is words else "over", time.monotonic())
            process.communicate()
        after = {"sweep": "optimiser", "optimiser": "front", "tolerance": "front", "front": "end", "report": "over"}
        return {stage: begun[after[stage]] - begun[stage] for stage in STAGES}

    def settled(
        self, study: Path, designs: Path, before: dict[str, bytes], found: Outcome, damaged: bool = False
    ) -> Outcome:
        """What a fault has left, and what the next run makes of it.

        ``before`` was finished before the fault, which leaves it as it is; the rest is as sound unless it is
        ``damaged`` by the fault itself.
        """
        left = {name: data for name, data in files(designs).items() if not damaged or name in before}
        # A front grows step by step, an optimum gets the shares made in a second step; each version of a file is whole.
        found.lost += [n for n in before if n not in left or (left[n] != before[n] and n not in (OPTIMUM, PARETO))]
        found.wrong += [f"{n} differs" for n in left if n.startswith("part-") and left[n] != self.whole(study).get(n)]
        for name in TABLES:
            try:
                if name in left:
                    pq.read_table(beside(designs) / name, page_checksum_verification=True)
            except Exception as error:  # whatever it is, the table is not whole
                found.wrong.append(f"{name}: {error}")
        written = {path.name: path.stat().st_mtime_ns for path in designs.glob("part-*") if path.name in left}
        try:
            self.resume(study, designs)
        except LinksweepError as error:
            found.wrong.append(f"the next run ended with {error}")
        again = {path.name: path.stat().st_mtime_ns for path in designs.glob("part-*")}
        found.lost += [f"{name} was computed again" for name in written if again.get(name) != written[name]]
        after, whole = files(designs), self.whole(study)
        found.wrong += [f"{n} differs in the end" for n in {*after, *whole} if after.get(n) != whole.get(n)]
        found.wrong += [f"{path.name} is left" for path in beside(designs).glob("_tmp-*")]
        return found


def session(number: int) -> dict[int, bytes]:
    """Command lines of the processes of a session that still run."""
    found = {}
    for entry in Path("/proc").glob("[0-9]*"):
        try:
            about = (entry / "stat").read_text().rpartition(")")[2].split()
            if int(about[3]) == number and about[0] != "Z":
                found[int(entry.name)] = (entry / "cmdline").read_bytes()
        except (FileNotFoundError, ProcessLookupError):  # ended while we looked
            continue
    return found


def alone(number: int) -> bool:
    """Whether all processes of a session end within a few seconds."""
    deadline = time.monotonic() + 10.0
    while time.monotonic() < deadline:
        if not session(number):
            return True
        time.sleep(0.05)
    for process in session(number):
        os.kill(process, 9)
    return False
