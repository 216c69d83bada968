"""Errors of ours keep what they say on the way from a worker process, and know their exit codes."""

from __future__ import annotations

import pickle

import pytest

from sweep.errors import InputError, Interrupted, LinksweepError, ProgramFault, StudyError


@pytest.mark.parametrize(
    "error",
    [
        InputError("a", -1.0, "a positive length", "row 3"),
        StudyError("study.toml", ["x", "y"]),
        Interrupted(2, "bye"),
        ProgramFault("chunk 3", "trace"),
    ],
)
def test_errors_come_back_whole_from_a_worker_process(error: LinksweepError) -> None:
    again = pickle.loads(pickle.dumps(error))
    assert type(again) is type(error) and str(again) == str(error) and vars(again) == vars(error)


def test_interrupted_knows_its_exit_code() -> None:
    assert (Interrupted(2, "").exit_code, Interrupted(15, "").exit_code) == (130, 143)
