"""2000 mutated study files and 2000 hostile tables: an answer or a message of ours, in bounded time and memory."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest

from tests.engine_study import ROOT
from tests.hostile_child import MOST_BYTES
from tests.hostile_tables import FAMILIES, case

COUNT = 2000
SECONDS = 900.0  # with a cold cache of kernels on a busy machine


def told(kind: str, folder: Path) -> dict[str, Any]:
    """What the process says; nothing else comes to its terminal."""
    command = [sys.executable, "-m", "tests.hostile_child", kind, "0", str(COUNT), str(folder)]
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, timeout=SECONDS, check=False)
    assert done.returncode == 0 and done.stderr == "", done.stderr[-3000:]
    (line,) = done.stdout.splitlines()
    return dict(json.loads(line))


@pytest.mark.parametrize("kind", ["studies", "tables"])
def test_hostile_input_ends_in_an_answer_or_a_message_of_ours(kind: str, tmp_path: Path) -> None:
    found = told(kind, tmp_path)
    assert not found["wrong"], "\n".join(found["wrong"])
    assert sum(found["ends"].values()) == COUNT and found["ends"]["answered"] > 200
    assert kind == "tables" or found["ends"]["refused"] > 1000
    assert found["bytes"] < MOST_BYTES
    assert not list(tmp_path.iterdir())


def test_the_requests_of_the_tables_are_of_every_family_and_the_tables_differ() -> None:
    cases = [case(seed, 150) for seed in range(300)]
    assert {str(one[0]) for one in cases} == {str(name) for name in FAMILIES}
    assert [one[2] for one in cases[:150]] == [one[2] for one in cases[150:]]
    assert 20 < sum(one[4] for one in cases) < 80
