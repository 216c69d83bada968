"""What a run finds missing of its kernels: once one step had to be compiled, those behind it are in processes."""

from __future__ import annotations

import re
from collections.abc import Iterator
from contextlib import nullcontext
from pathlib import Path
from typing import Any

import pytest
from click.testing import CliRunner
from numba import njit

from kernels.descent.descents import descend, initial_merits
from sweep.chunks.chunk import asked_outputs
from sweep.chunks.plan import Pilot, pilot
from sweep.cli.plan import check
from sweep.engine import run as engine
from sweep.jobs.progress import Phases
from sweep.study import load_study
from tests.support.engine_study import ROOT, write_study


@pytest.mark.parametrize(
    ("name", "compiled_at", "jobs", "spread"),
    [
        ("needle208-loads", 0, 2, True),
        ("needle208-loads", 1, 2, True),
        ("needle208-loads", None, 2, False),
        ("needle208-loads", 0, 1, False),
        ("needle208-loads", 5, 2, False),  # few steps are left
        ("needle208", 3, 2, True),  # and the descents
    ],
)
def test_what_is_missing_is_compiled_side_by_side(
    monkeypatch: pytest.MonkeyPatch, name: str, compiled_at: int | None, jobs: int, spread: bool
) -> None:
    study = load_study(ROOT / "studies" / name)
    count = engine.KernelStep(study).count
    here: list[int] = []
    elsewhere: list[int] = []

    class Processes:
        def outcomes(self, task: object, numbers: Iterator[int], jobs: int, stop: object) -> Iterator[int]:
            elsewhere.extend(numbers)
            return iter(elsewhere)

    def listening(event: str, compiled: engine.Compiled) -> nullcontext[None]:
        compiled.functions = int(len(here) == compiled_at)
        return nullcontext()

    monkeypatch.setattr(engine.KernelStep, "__call__", lambda step, number: here.append(number))
    monkeypatch.setattr(engine, "install_listener", listening)
    monkeypatch.setattr(engine, "executor", lambda name, jobs: Processes())
    monkeypatch.setattr(engine.os, "cpu_count", lambda: 2)
    with Phases(False) as phases:
        engine._compile(study, jobs, phases)
    assert here == list(range(count))  # this process has them all in the end
    assert elsewhere == (list(range(count - 1, compiled_at or 0, -1)) if spread else [])


def test_what_the_search_for_starts_needs_is_compiled_too() -> None:
    study = load_study(ROOT / "studies" / "needle208")
    step = engine.KernelStep(study)
    assert step.count == len(asked_outputs(study)) + 1
    step(step.count - 1)
    assert descend.nopython_signatures and initial_merits.nopython_signatures


def test_check_tells_what_it_compiles(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A pilot that compiles is no longer told as planning; the first two seconds are not waited for."""
    monkeypatch.setattr("sweep.jobs.progress.FIRST_SECONDS", -1.0)

    def compiling(*given: Any) -> Pilot:
        njit(lambda x: 2.0 * x)(1.0)
        return pilot(*given)

    monkeypatch.setattr("sweep.cli.plan.pilot", compiling)
    done = CliRunner().invoke(check, [str(write_study(tmp_path))], catch_exceptions=False)
    assert done.exit_code == 0
    assert any(re.match(r"compiling: \d+ functions, \d+ s", line) for line in done.output.splitlines()), done.output
