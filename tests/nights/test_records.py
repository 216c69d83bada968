"""Records of nights: what two slow nights say, the exit code, what is read back from files."""

from __future__ import annotations

from pathlib import Path

import pytest

from sweep.nights.archive import NightRecord, StudyRecord, append_history, read_history, read_night, write_night
from sweep.nights.changes import slower
from sweep.nights.night import exit_code
from tests.nights.test_nightly import CUT, GOOD


def times(*seconds: float) -> list[NightRecord]:
    return [NightRecord(str(k), s, 0, {"one": StudyRecord("complete", seconds=s)}) for k, s in enumerate(seconds)]


@pytest.mark.parametrize(
    ("before", "now", "code"),
    [
        ((10, 11, 9), 30, 0),  # one slow night
        ((10, 11, 9, 10, 30), 30, 12),  # the second
        ((10, 11, 9, 10, 30), 11, 0),  # over again
        ((10, 30), 30, 0),  # too few nights to tell
        ((1, 1, 1, 1, 4), 4, 0),  # too short to tell
    ],
)
def test_slower_is_what_two_nights_in_a_row_say(before: tuple[float, ...], now: float, code: int) -> None:
    assert slower("one", now, times(*before)).code == code


@pytest.mark.parametrize(
    ("records", "code"),
    [
        ([GOOD], 0),
        ([StudyRecord("complete", changed=10), StudyRecord("complete", changed=11), CUT], 11),
        ([StudyRecord("complete", changed=10), StudyRecord("complete", changed=12)], 10),
        ([StudyRecord("complete", changed=12), StudyRecord("waiting", 124)], 124),
        ([StudyRecord("complete", changed=12), GOOD], 12),
        ([StudyRecord("failed", 2), StudyRecord("failed", 74), StudyRecord("complete", changed=11)], 74),
    ],
)
def test_the_gravest_of_the_studies_decides_the_exit_code(records: list[StudyRecord], code: int) -> None:
    assert exit_code({str(k): record for k, record in enumerate(records)}) == code


def test_a_record_passes_through_its_files_and_torn_lines_are_left_out(tmp_path: Path) -> None:
    record = NightRecord("n", 2.5, 10, {"one": StudyRecord("complete", figures={"x": 1 / 3}, changes=("a",))})
    write_night(tmp_path, record)
    assert read_night(tmp_path) == record
    append_history(tmp_path, record)
    with (tmp_path / "history.jsonl").open("a") as file:
        file.write('{"name": "torn", "sec')
    assert read_history(tmp_path) == [record]
