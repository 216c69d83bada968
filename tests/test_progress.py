"""Progress of long work: silent below two seconds, then lines with the remaining time, also for steps without parts."""

from __future__ import annotations

import io
import os
import re
import sys
import time

import pytest

from sweep.engine.run import run
from sweep.jobs.progress import Phases, Progress
from sweep.report import write_report
from sweep.study import load_study
from tests.test_study_words import STUDY


@pytest.fixture
def quick(monkeypatch: pytest.MonkeyPatch) -> None:
    for name, seconds in (("FIRST_SECONDS", 0.05), ("LINE_SECONDS", 0.2), ("TICK_SECONDS", 0.01)):
        monkeypatch.setattr(f"sweep.jobs.progress.{name}", seconds)


def test_step_without_parts_is_told_while_it_lasts(quick: None) -> None:
    stream = io.StringIO()
    with Phases(True, stream) as phases:
        phases.say("planning")
        time.sleep(0.15)
        assert stream.getvalue() == "planning: 0 s\n"
    assert stream.getvalue() == "planning: 0 s\n" * 2  # and its end


def test_short_work_is_not_told() -> None:
    stream = io.StringIO()
    with Phases(True, stream) as phases:
        phases.say("compiling", 0, 3)
        phases.say("compiling", 3, 3)
        phases.say("planning")
    assert stream.getvalue() == ""


def test_remaining_time_is_that_of_this_run_after_a_resume(monkeypatch: pytest.MonkeyPatch) -> None:
    """60 of 100 were there: 10 more took 20 s, so 30 take another 60 s."""
    now = [1000.0]
    monkeypatch.setattr("sweep.jobs.progress.time.monotonic", lambda: now[0])
    stream = io.StringIO()
    with Progress("x", 100, 60, True, stream) as shown:
        now[0] += 20.0
        shown.advance(10)
        assert stream.getvalue().splitlines()[-1] == "x: 70 of 100 designs (70%), 20 s, 60 s left"


def test_every_part_of_a_run_is_told(tmp_path, quick, monkeypatch, capsys) -> None:
    monkeypatch.setattr("sweep.jobs.progress.FIRST_SECONDS", -1.0)
    monkeypatch.setattr("sweep.jobs.progress.LINE_SECONDS", -1.0)
    (tmp_path / "study.toml").write_text(STUDY + '[tolerance]\nlengths = "0.02 mm"\n', encoding="utf-8")
    folder = run(load_study(tmp_path), out=tmp_path / "out", jobs=1, progress=True)
    with Phases(True) as phases:
        write_report(folder, say=phases.say)
    lines = capsys.readouterr().err.splitlines()
    labels = list(dict.fromkeys(line.split(":")[0] for line in lines))
    after = "yield, curves, sensitivities, tolerances"
    assert labels == ["compiling", "planning", "reading what is there", "words", "optimum", after, "front", "report"]
    for label, unit in (
        ("compiling", "steps"),
        (after, "tables"),
        ("front", "steps"),
        ("report", "steps"),
    ):
        counted = [line for line in lines if re.match(rf"{label}: \d+ of \d+ {unit} ", line)]
        assert any(line.endswith(" left") for line in counted), (label, counted)
    assert any(line.startswith("optimum: 3 of 3 starts (100%)") for line in lines)


def test_progress_that_nobody_reads_any_more_does_not_stop_the_sweep(monkeypatch: pytest.MonkeyPatch) -> None:
    for name in ("FIRST_SECONDS", "LINE_SECONDS"):
        monkeypatch.setattr(f"sweep.jobs.progress.{name}", -1.0)
    reading, writing = os.pipe()
    stream = os.fdopen(writing, "w", buffering=1)
    with Progress("x", 3, 0, True, stream) as shown:
        shown.advance(1)
        assert os.read(reading, 100).startswith(b"x: 1 of 3 designs (33%)")
        os.close(reading)
        shown.advance(1)
        assert not shown.show
        shown.advance(1)
    with pytest.raises(BrokenPipeError):
        stream.close()
    monkeypatch.setattr(sys, "stderr", None)
    with Progress("x", 1, 0, True) as shown:
        shown.advance(1)
