"""Verbs of a night in the process of the tests, for those that are not about processes."""

from __future__ import annotations

import time
from collections.abc import Sequence
from pathlib import Path

import pytest
from click.testing import CliRunner

from sweep.cli import main
from sweep.nights.studies import Ended


def called(words: Sequence[str], log: Path, seconds: float) -> Ended:
    """What `sweep.nights.studies.call` does, without the second or two that a process takes to begin."""
    begin = time.monotonic()
    done = CliRunner().invoke(main, list(words))
    log.parent.mkdir(parents=True, exist_ok=True)
    with log.open("a", encoding="utf-8") as file:
        file.write(done.output)
    lines = done.output.strip().splitlines()
    return Ended(done.exit_code, time.monotonic() - begin, lines[-1].strip() if lines else "")


@pytest.fixture
def in_this_process(monkeypatch: pytest.MonkeyPatch) -> None:
    """Let nights call verbs here."""
    monkeypatch.setattr("sweep.nights.night.call", called)
