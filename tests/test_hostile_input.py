"""2000 mutated study files and 2000 hostile tables: an answer or a message of ours, in bounded time and memory."""

from __future__ import annotations

import json
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from tests.engine_study import ROOT
from tests.hostile_child import MOST_BYTES
from tests.hostile_tables import FAMILIES, case

COUNT = 2000
SECONDS = 900.0  # with a cold cache of kernels on a busy machine


@pytest.fixture(scope="module")
def begun(tmp_path_factory: pytest.TempPathFactory) -> Iterator[dict[str, tuple[subprocess.Popen[str], Path]]]:
    """Both processes at once: each takes a minute of one core."""
    found = {}
    for kind in ("studies", "tables"):
        folder = tmp_path_factory.mktemp(kind)
        command = [sys.executable, "-m", "tests.hostile_child", kind, "0", str(COUNT), str(folder)]
        pipes = {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE}
        found[kind] = subprocess.Popen(command, cwd=ROOT, text=True, **pipes), folder
    yield found
    for process, _ in found.values():
        if process.poll() is None:
            process.kill()
        process.communicate()


def told(process: subprocess.Popen[str]) -> dict[str, Any]:
    """What the process says; nothing else comes to its terminal."""
    out, errors = process.communicate(timeout=SECONDS)
    assert process.returncode == 0 and errors == "", errors[-3000:]
    (line,) = out.splitlines()
    return dict(json.loads(line))


@pytest.mark.parametrize("kind", ["studies", "tables"])
def test_hostile_input_ends_in_an_answer_or_a_message_of_ours(
    kind: str, begun: dict[str, tuple[subprocess.Popen[str], Path]]
) -> None:
    process, folder = begun[kind]
    found = told(process)
    assert not found["wrong"], "\n".join(found["wrong"])
    assert sum(found["ends"].values()) == COUNT and found["ends"]["answered"] > 200
    assert kind == "tables" or found["ends"]["refused"] > 1000
    assert found["bytes"] < MOST_BYTES
    assert not list(folder.iterdir())


def test_the_requests_of_the_tables_are_of_every_family_and_the_tables_differ() -> None:
    cases = [case(seed, 150) for seed in range(300)]
    assert {str(one[0]) for one in cases} == {str(name) for name in FAMILIES}
    assert [one[2] for one in cases[:150]] == [one[2] for one in cases[150:]]
    assert 20 < sum(one[4] for one in cases) < 80
