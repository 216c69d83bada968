"""Full memory: in a chunk and in the program itself it ends with a word of its own, never with a traceback."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest
from click.testing import CliRunner

import sweep
import sweep.engine.worker
from sweep.cli import main
from sweep.errors import WorkerDied
from tests.support.engine_study import ROOT, write_study
from tests.support.selection import mostly_long

FULL_MEMORY = [
    MemoryError(),
    ImportError("libarrow.so: failed to map segment from shared object"),
    RuntimeError("can't start new thread"),
    OSError("Zstd compression failed: Allocation error : not enough memory"),
]


@pytest.fixture
def study(tmp_path: Path) -> Path:
    return write_study(tmp_path / "study", count=20)


@pytest.mark.parametrize("error", FULL_MEMORY)
def test_full_memory_is_no_error_in_the_program(
    study: Path, tmp_path: Path, error: Exception, monkeypatch: pytest.MonkeyPatch
) -> None:
    def full(*given: object) -> None:
        raise error

    monkeypatch.setattr(sweep.engine.worker, "compute_chunk", full)
    with pytest.raises(WorkerDied, match="the memory it may use is full, in chunk 0; fewer jobs need less"):
        sweep.run(study, tmp_path / "designs", jobs=1)


@pytest.mark.parametrize("error", FULL_MEMORY)
def test_full_memory_of_the_program_itself_is_said(
    study: Path, tmp_path: Path, error: Exception, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A run with 780 MB ended with a traceback where its progress began a thread."""

    def full(*given: object) -> None:
        raise error

    said: list[str] = []  # by the last words, which also give up the standard output for good
    monkeypatch.setattr(sys.modules["sweep.cli.main"], "_last_words", said.append)
    monkeypatch.setattr("sweep.dataset.store.finished_chunks", full)
    done = CliRunner().invoke(main, ["run", str(study), "--out", str(tmp_path / "designs")])
    assert done.exit_code == 70 and isinstance(done.exception, SystemExit), done.exception
    assert said == ["sweep: the memory it may use is full; fewer jobs, designs or poses need less"]


@pytest.mark.parametrize("bytes_allowed", mostly_long([8 * 10**8, 12 * 10**8, 16 * 10**8], [12 * 10**8]))
def test_little_memory_ends_with_70_or_suffices(study: Path, tmp_path: Path, bytes_allowed: int) -> None:
    limited = f"import resource, sys; resource.setrlimit(resource.RLIMIT_AS, ({bytes_allowed}, {bytes_allowed})); "
    program = f"{limited}sys.argv = ['sweep', *sys.argv[1:]]; from sweep.__main__ import main; main()"
    done = subprocess.run(
        [sys.executable, "-c", program, "run", str(study), "--out", str(tmp_path / "designs")],
        capture_output=True, text=True, cwd=ROOT, timeout=240, check=False,
    )  # fmt: skip
    assert "Traceback" not in done.stderr
    assert done.returncode == 0 or (done.returncode == 70 and "the memory it may use is full" in done.stderr)
