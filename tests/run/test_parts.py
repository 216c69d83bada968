"""A study in parts: disjoint, together everything, and after the merge the bytes of a run that was never split."""

from __future__ import annotations

import shlex
from pathlib import Path

import pytest
from click.testing import CliRunner

import sweep
import sweep.chunks.plan
from sweep.cli import main
from sweep.dataset import files, store
from sweep.engine.parts import merge, split
from sweep.errors import InputError
from tests.support.engine_study import SMALL_CHUNKS, chunk_bytes, write_study


@pytest.fixture(autouse=True)
def small_chunks(monkeypatch: pytest.MonkeyPatch) -> None:
    for name, value in SMALL_CHUNKS.items():
        monkeypatch.setattr(sweep.chunks.plan, name, value)


@pytest.fixture
def study(tmp_path: Path) -> Path:
    """Five chunks."""
    return write_study(tmp_path / "study", count=40)


def test_merged_parts_have_the_bytes_of_an_unsplit_run(study: Path, tmp_path: Path) -> None:
    out = tmp_path / "data" / "designs"
    parts = split(study, out, 3)
    assert len(parts) == 3
    for folder in reversed(parts):
        sweep.run(study, folder)
        assert not store.is_complete(folder)
    sizes = [len(chunk_bytes(folder)) for folder in parts]
    assert (sum(sizes), max(sizes) - min(sizes)) == (5, 1)
    found = merge(study, out)
    assert (found.taken, found.missing, found.damaged) == (5, (), ())
    assert merge(study, out).taken == 0
    sweep.run(study, out)
    assert files.read_runs(out)[-1]["text"] == "0 chunks computed"
    whole = sweep.run(study, tmp_path / "whole" / "designs")
    assert chunk_bytes(out) == chunk_bytes(whole)
    assert (out.parent / "_plan.json").read_bytes() == (whole.parent / "_plan.json").read_bytes()
    assert sweep.verify(out).exit_code == 0


def test_missing_and_damaged_chunks_of_a_part_are_left_to_the_run(study: Path, tmp_path: Path) -> None:
    out = tmp_path / "data" / "designs"
    first, second = split(study, out, 2)
    sweep.run(study, second)
    damaged = next(second.glob("part-000003-*"))
    damaged.write_bytes(damaged.read_bytes()[:-1])
    found = merge(study, out)
    assert (found.taken, found.missing, found.damaged) == (2, (0, 1, 3), (damaged,))
    assert list(first.iterdir()) == []
    sweep.run(study, second)
    assert merge(study, out).missing == (0, 1)
    sweep.run(study, out)
    assert sweep.verify(out).exit_code == 0


def test_there_are_no_more_parts_than_chunks_and_splitting_again_changes_nothing(study: Path, tmp_path: Path) -> None:
    out = tmp_path / "data" / "designs"
    parts = split(study, out, 99)
    assert len(parts) == 5
    sweep.run(study, parts[0])
    before = chunk_bytes(parts[0])
    assert split(study, out, 99) == parts
    assert chunk_bytes(parts[0]) == before
    with pytest.raises(InputError, match="cut in this way"):
        split(study, out, 2)
    with pytest.raises(InputError, match="parts = 0"):
        split(study, out, 0)


def test_parts_of_other_sources_are_refused(study: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    out = tmp_path / "data" / "designs"
    parts = split(study, out, 2)
    with monkeypatch.context() as patch:
        patch.setattr(sweep.chunks.plan, "code_hash", lambda: "other")
        with pytest.raises(InputError, match="other sources"):
            sweep.run(study, parts[0])
    sweep.run(study, parts[0])
    monkeypatch.setattr(sweep.chunks.plan, "code_hash", lambda: "other")
    with pytest.raises(InputError, match="the chunk part-00000"):
        merge(study, out)


@pytest.mark.parametrize("register", ["families.toml", "effects.toml"])
def test_registers_are_part_of_the_code(register: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """They name what computes a family or an effect: with another entry the values are others."""
    imported = sweep.chunks.plan.code_hash()
    monkeypatch.setitem(sweep.chunks.plan.DIGESTS, register, "edited")
    assert sweep.chunks.plan.code_hash.__wrapped__() != imported


def test_the_printed_commands_compute_the_parts(study: Path, tmp_path: Path) -> None:
    out = tmp_path / "data" / "designs"
    shell = CliRunner()
    lines = shell.invoke(main, ["split", str(study), "--parts", "2", "--out", str(out)]).output.splitlines()
    assert len(lines) == 2
    assert shell.invoke(main, shlex.split(lines[0])[1:]).exit_code == 0
    merged = shell.invoke(main, ["merge", str(study), "--out", str(out)])
    assert (merged.exit_code, "3 chunks missing (the first is 2)" in merged.output) == (11, True)
    assert shell.invoke(main, shlex.split(lines[1])[1:]).exit_code == 0
    merged = shell.invoke(main, ["merge", str(study), "--out", str(out)])
    assert (merged.exit_code, "3 chunks taken over, all are there" in merged.output) == (0, True)
    assert shell.invoke(main, ["merge", str(study), "--out", str(tmp_path / "none")]).exit_code == 2
