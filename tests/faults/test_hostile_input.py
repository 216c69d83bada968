"""Mutated study files and hostile tables: an answer or a message of ours, in bounded time and memory.

100 of each in `make test`, 2000 in `make test-long`.
"""

from __future__ import annotations

import json
import subprocess
import sys
from collections import Counter
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from tests.support.engine_study import ROOT
from tests.support.hostile_child import MOST_BYTES, REQUESTS
from tests.support.hostile_tables import FAMILIES, case

COUNTS = (100, pytest.param(2000, marks=pytest.mark.long))
SECONDS = 900.0  # with a cold cache of kernels on a busy machine


# Where no kernel is compiled yet, each process compiles what so many of the requests need.
PARTS = 3


def begin(kind: str, first: int, stop: int, step: int, folder: Path) -> subprocess.Popen[str]:
    """A process that tries every so many seeds."""
    command = [sys.executable, "-m", "tests.support.hostile_child", kind, str(first), str(stop), str(step), str(folder)]
    return subprocess.Popen(command, cwd=ROOT, text=True, stdout=subprocess.PIPE, stderr=subprocess.PIPE)


@pytest.fixture(scope="module", params=COUNTS)
def count(request: pytest.FixtureRequest) -> int:
    """How many of each; 2000 tables and as many studies take a minute of one core each."""
    return int(request.param)


@pytest.fixture(scope="module")
def studies(count: int, tmp_path_factory: pytest.TempPathFactory) -> Iterator[tuple[subprocess.Popen[str], Path]]:
    """The studies in the background."""
    folder = tmp_path_factory.mktemp("studies")
    process = begin("studies", 0, count, 1, folder)
    yield process, folder
    if process.poll() is None:
        process.kill()
    process.communicate()


def told(process: subprocess.Popen[str]) -> dict[str, Any]:
    """What the process says; nothing else comes to its terminal."""
    out, errors = process.communicate(timeout=SECONDS)
    assert process.returncode == 0 and errors == "", errors[-3000:]
    (line,) = out.splitlines()
    return dict(json.loads(line))


def judged(found: dict[str, Any], folder: Path, count: int) -> Counter[str]:
    """How often each end was met; nothing is wrong, too large, or left over."""
    assert not found["wrong"], "\n".join(found["wrong"])
    assert found["bytes"] < MOST_BYTES
    assert not list(folder.iterdir())
    ends = Counter[str](found["ends"])
    assert ends.total() == count and ends["answered"] > count // 10
    return ends


@pytest.mark.usefixtures("studies")
def test_hostile_tables_end_in_an_answer_or_a_message_of_ours(count: int, tmp_path: Path) -> None:
    for part in range(PARTS):  # so many tables have no other requests than these
        assert not told(begin("requests", part, min(count, REQUESTS), PARTS, tmp_path))["wrong"]
    judged(told(begin("tables", 0, count, 1, tmp_path)), tmp_path, count)


def test_hostile_studies_end_in_an_answer_or_a_message_of_ours(
    studies: tuple[subprocess.Popen[str], Path], count: int
) -> None:
    process, folder = studies
    assert judged(told(process), folder, count)["refused"] > count // 2


def test_the_requests_of_the_tables_are_of_every_family_and_the_tables_differ() -> None:
    cases = [case(seed, REQUESTS) for seed in range(2 * REQUESTS)]
    assert {str(one[0]) for one in cases} == {str(name) for name in FAMILIES}
    assert [one[2] for one in cases[:REQUESTS]] == [one[2] for one in cases[REQUESTS:]]
    assert 20 < sum(one[4] for one in cases) < 80
