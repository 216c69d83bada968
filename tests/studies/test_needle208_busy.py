"""The main study ends at the same bits beside two busy processes and with another number of jobs."""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pandas as pd
import pytest

from sweep.dataset.files import OF_OPTIMUM, beside
from sweep.engine.run import run
from sweep.study import load_study

FOLDER = Path(__file__).parents[2] / "studies" / "needle208"


@contextmanager
def busy(count: int) -> Iterator[None]:
    """So many processes that compute without end meanwhile."""
    others = [subprocess.Popen([sys.executable, "-c", "while True: pass"]) for _ in range(count)]
    try:
        yield
        assert all(other.poll() is None for other in others)
    finally:
        for other in others:
            other.kill()
            other.wait()


@pytest.mark.long
@pytest.mark.parametrize("smoke", [True, False])
def test_needle208_ends_at_the_same_bits_beside_two_busy_processes(smoke: bool, tmp_path: Path) -> None:
    study = load_study(FOLDER, smoke=smoke)
    quiet = run(study, out=tmp_path / "quiet" / "designs", jobs=2, progress=False)
    with busy(2):
        disturbed = run(study, out=tmp_path / "disturbed" / "designs", jobs=1, progress=False)
    assert sorted(p.name for p in quiet.glob("part-*")) == sorted(p.name for p in disturbed.glob("part-*"))
    for name in OF_OPTIMUM:
        tables = [pd.read_parquet(beside(folder) / name) for folder in (quiet, disturbed)]
        pd.testing.assert_frame_equal(*tables, check_exact=True)
