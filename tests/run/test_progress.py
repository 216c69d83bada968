"""Progress of long work: silent below two seconds, then lines with the remaining time, also for steps without parts."""

from __future__ import annotations

import io
import os
import re
import sys
import time
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from kernels.boxes.branching import OPEN
from sweep.chunks.plan import pilot
from sweep.engine.run import run
from sweep.jobs.executors import Here
from sweep.jobs.progress import Phases, Progress
from sweep.jobs.signals import Stop
from sweep.proof.question import question_of
from sweep.proof.rounds import Cores, explored
from sweep.report.page import write_report
from sweep.study import load_study
from tests.study.test_words import STUDY
from tests.support.engine_study import write_study


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


def test_work_that_is_always_told_names_its_end() -> None:
    stream = io.StringIO()
    with Phases(True, stream, quiet=False) as phases:
        phases.say("report", 0, 4)
        phases.say("report", 4, 4)
    assert stream.getvalue() == "report: 4 of 4 steps (100%), 0 s\n"


@pytest.mark.parametrize(("total", "shown"), [(40, "3 of 40"), (16_777_216, "3.00 of 16.8M")])
def test_bar_counts_whole_things_and_millions_in_millions(total: int, shown: str) -> None:
    stream = io.StringIO()
    stream.isatty = lambda: True  # type: ignore[method-assign]
    with Phases(True, stream, quiet=False) as phases:
        phases.say("search", 0, 0)  # how many is not known yet
        phases.say("search", 3, total)
    assert f"search: {shown} steps [" in stream.getvalue()


def test_remaining_time_is_that_of_this_run_after_a_resume(monkeypatch: pytest.MonkeyPatch) -> None:
    """60 of 100 were there: 10 more took 20 s, so 30 take another 60 s."""
    now = [1000.0]
    monkeypatch.setattr("sweep.jobs.progress.time.monotonic", lambda: now[0])
    stream = io.StringIO()
    with Progress("x", 100, 60, True, stream) as shown:
        now[0] += 20.0
        shown.advance(10)
        assert stream.getvalue().splitlines()[-1] == "x: 70 of 100 designs (70%), 20 s, 60 s left"


def test_remaining_time_falls_between_two_steps_and_is_not_told_once_they_are_late(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    now = [1000.0]
    monkeypatch.setattr("sweep.jobs.progress.time.monotonic", lambda: now[0])
    stream = io.StringIO()
    with Phases(True, stream) as phases:
        phases.say("front", 0, 4, "searches")
        now[0] += 100.0
        phases.say("front", 2, 4, "searches")
        for seconds, left in ((0.0, ", 100 s left"), (70.0, ", 30 s left"), (40.0, "")):
            now[0] += seconds
            phases.now._line()
            told = f"front: 2 of 4 searches (50%), {now[0] - 1000.0:.0f} s{left}"
            assert stream.getvalue().splitlines()[-1] == told


def test_remaining_time_is_told_when_it_is_known_within_a_factor_of_two(monkeypatch: pytest.MonkeyPatch) -> None:
    now = [1000.0]
    monkeypatch.setattr("sweep.jobs.progress.time.monotonic", lambda: now[0])
    stream = io.StringIO()
    with Progress("x", 40, 0, True, stream) as shown:
        for done in range(1, 6):
            now[0] += 20.0
            shown.advance(1)
            assert stream.getvalue().splitlines()[-1].endswith(" left") == (done >= 4)


def test_remaining_time_follows_what_is_expected_by_now(monkeypatch: pytest.MonkeyPatch) -> None:
    """A hundred of a million in 10 s; then it turns out that two hundred are enough."""
    now = [1000.0]
    monkeypatch.setattr("sweep.jobs.progress.time.monotonic", lambda: now[0])
    stream = io.StringIO()
    with Phases(True, stream) as phases:
        phases.say("proof", 0, 1_000_000, "boxes")
        now[0] += 10.0
        phases.say("proof", 100, 200, "boxes")
        assert stream.getvalue().splitlines()[-1] == "proof: 100 of 200 boxes (50%), 10 s, 10 s left"


def test_proof_expects_no_more_boxes_than_it_comes_to_need(tmp_path: Path) -> None:
    """Of a space that is proven in the first round, later rounds are not expected."""
    told: list[tuple[int, int]] = []
    study = load_study(Path(__file__).parents[2] / "studies" / "crank-rocker-proof", smoke=True)
    question = question_of(study)
    asked = replace(study.optimise.prove, boxes=1_000_000)
    least = question.in_kernel(1e-3)  # far below what any design reaches: proven soon
    leaves, judged, cut, _ = explored(
        question, least, asked, tmp_path, Cores(Here(), 1, Stop()), lambda *t: told.append(t)
    )
    assert not cut and not (leaves.outcome == OPEN).any()
    assert told[-1] == (judged, judged)
    assert max(expected for _, expected in told) < 100 * judged < asked.boxes
    assert [done for done, _ in told] == sorted(done for done, _ in told)


def test_pilot_of_planning_is_told_part_by_part() -> None:
    told: list[tuple[int, int]] = []
    study = load_study(Path(__file__).parents[2] / "studies" / "geared-dwell", smoke=True)
    whole = pilot(study, lambda *t: told.append(t))
    assert told == [(0, 4), (1, 4), (2, 4), (3, 4)]
    again = pilot(study)
    assert np.array_equal(whole.kept, again.kept) and whole._replace(kept=again.kept) == again


def test_pilot_of_a_small_sweep_is_an_eighth_of_it_and_sent_once(tmp_path, monkeypatch) -> None:
    study = load_study(write_study(tmp_path, count=2))
    tried: list[int] = []

    def counted(*given):
        found = pilot(*given)
        tried.append(found.tried)
        return found

    for module in ("sweep.engine.estimate", "sweep.chunks.plan"):
        monkeypatch.setattr(f"{module}.pilot", counted)
    run(study, out=tmp_path / "out", jobs=1, progress=False)
    assert study.space.count == 1024 and tried == [128]


def test_every_part_of_a_run_is_told(tmp_path, quick, monkeypatch, capsys) -> None:
    monkeypatch.setattr("sweep.jobs.progress.FIRST_SECONDS", -1.0)
    monkeypatch.setattr("sweep.jobs.progress.LINE_SECONDS", -1.0)
    (tmp_path / "study.toml").write_text(STUDY + '[tolerance]\nlengths = "0.02 mm"\n', encoding="utf-8")
    folder = run(load_study(tmp_path), out=tmp_path / "out", jobs=1, progress=True)
    with Phases(True) as phases:
        write_report(folder, say=phases.say)
    lines = capsys.readouterr().err.splitlines()
    labels = list(dict.fromkeys(line.split(":")[0] for line in lines))
    parts = ("compiling", "planning", "words", "search", "tables", "what is made", "front")
    numbered = [f"{k}/7 {label}" for k, label in enumerate(parts, 1)]
    assert labels == [
        *numbered[:2], "reading what is there", *numbered[2:4], "equally good designs", *numbered[4:], "report",
    ]  # fmt: skip
    for label, unit in (
        ("1/7 compiling", "steps"),
        ("5/7 tables", "tables"),
        ("6/7 what is made", "mechanisms"),
        ("7/7 front", "steps"),
        ("report", "steps"),
    ):
        counted = [line for line in lines if re.match(rf"{label}: \d+ of \d+ {unit} ", line)]
        assert any(line.endswith(" left") for line in counted), (label, counted)
    told = r"1/7 compiling: \d+ of 4 steps \(\d+%\), \d+ functions? compiled for "
    assert any(re.match(told, line) for line in lines)
    # Of a maximum no share and no remaining time is known, but the best value so far.
    searched = [line for line in lines if line.startswith("4/7 search: 3 of 3 starts at most, the best ")]
    assert searched and not any("%" in line or "left" in line for line in searched)


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
