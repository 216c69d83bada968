"""When the engine asks for the optimum, and when it takes the one that is there."""

from __future__ import annotations

import os
import signal
import time
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import pyarrow as pa
import pyarrow.parquet as pq
import pytest

import sweep.chunks.plan
from sweep.dataset.files import OPTIMUM, beside, read_runs
from sweep.dataset.store import is_complete
from sweep.engine.run import run
from sweep.errors import Interrupted
from sweep.study import OptimiseSettings, Study, load_study
from sweep.study.study import Objective
from tests.support.engine_study import chunk_bytes, write_study


class Optimiser:
    """Stands for the optimiser: notes its calls, writes a file, can be slow."""

    def __init__(self) -> None:
        self.calls: list[OptimiseSettings | None] = []
        self.begin: Callable[[], None] = lambda: None

    def __call__(
        self,
        study: Study,
        folder: Path,
        stop: Callable[[], bool],
        jobs: int,
        tell: Callable[[int, int], None],
        key: str,
    ) -> Path:
        self.calls.append(study.optimise)
        self.begin()
        path = beside(folder) / OPTIMUM
        pq.write_table(pa.table({"role": ["optimum"]}), path)
        tell(3, 3)
        deadline = time.monotonic() + 0.3
        while time.monotonic() < deadline:
            if stop():
                raise KeyboardInterrupt
            time.sleep(0.01)
        return path


@pytest.fixture
def optimiser(monkeypatch: pytest.MonkeyPatch) -> Optimiser:
    stand_in = Optimiser()
    monkeypatch.setattr("sweep.optimise.optimise_study", stand_in)
    return stand_in


@pytest.fixture
def study(tmp_path: Path) -> Study:
    plain = load_study(write_study(tmp_path / "study", count=10))
    return replace(plain, objective=Objective("max_abs_d2psi"), optimise=OptimiseSettings(starts=3))


def test_optimum_is_sought_once(study: Study, optimiser: Optimiser, tmp_path: Path) -> None:
    out = run(study, tmp_path / "out")
    assert is_complete(out)
    run(study, out)
    assert optimiser.calls == [study.optimise]
    (beside(out) / OPTIMUM).unlink()
    assert not is_complete(out)
    run(study, out)
    assert len(optimiser.calls) == 2 and is_complete(out)


def test_other_settings_of_the_optimiser_keep_the_designs(study: Study, optimiser: Optimiser, tmp_path: Path) -> None:
    out = run(study, tmp_path / "out")
    before = chunk_bytes(out)
    other = replace(study, optimise=OptimiseSettings(starts=4))
    run(other, out)
    assert chunk_bytes(out) == before
    assert read_runs(out)[-1]["text"] == "0 chunks computed"
    assert optimiser.calls == [study.optimise, other.optimise]


def test_change_of_the_optimisers_sources_seeks_the_optimum_anew(
    study: Study, optimiser: Optimiser, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    out = run(study, tmp_path / "out")
    monkeypatch.setattr(sweep.chunks.plan, "optimiser_hash", lambda: "0123456789abcdef")
    run(study, out)
    assert len(optimiser.calls) == 2


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_interrupted_search_is_not_taken_for_the_whole(
    study: Study, optimiser: Optimiser, tmp_path: Path, number: int
) -> None:
    out = run(replace(study, optimise=OptimiseSettings(starts=2)), tmp_path / "out")
    before = signal.getsignal(number)
    optimiser.begin = lambda: os.kill(os.getpid(), number)
    with pytest.raises(Interrupted) as caught:
        run(study, out)
    assert caught.value.exit_code == 128 + number
    assert signal.getsignal(number) is before
    assert (beside(out) / OPTIMUM).is_file() and not is_complete(out)
    optimiser.begin = lambda: None
    run(study, out)
    assert is_complete(out) and len(optimiser.calls) == 3
