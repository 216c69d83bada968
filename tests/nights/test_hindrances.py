"""Nights that nothing in their folder can stop: earlier plans, pipes, broken studies, wrong records, lost locks."""

from __future__ import annotations

import errno
import json
import os
import shutil
from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from sweep.dataset import chunk_files, files
from sweep.errors import LinksweepWarning, LockedError
from sweep.nights import archive
from sweep.nights.archive import HISTORY, NIGHT, read_history, read_night
from sweep.nights.page import write_page
from sweep.nights.studies import Ended, studies_in
from tests.nights.conftest import called
from tests.nights.test_nightly import night, written
from tests.support.selection import mostly_long

pytestmark = pytest.mark.usefixtures("in_this_process")


@pytest.fixture(scope="module")
def first(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Path]:
    """A study and the folder of its first night."""
    place = tmp_path_factory.mktemp("first")
    study, into = written(place / "one"), place / "nights"
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("sweep.nights.night.call", called)
        record, _ = night(into, [study])
    assert record.exit_code == 0
    return study, into


@pytest.fixture
def after_one(first: tuple[Path, Path], tmp_path: Path) -> tuple[Path, Path]:
    shutil.copytree(first[1], tmp_path / "nights", symlinks=True)
    return first[0], tmp_path / "nights"


@pytest.mark.parametrize(
    "change", mostly_long([{"chunks": "1"}, {"columns": 5}, {"designs": "x"}, {"data": []}], [{"columns": 5}])
)
def test_a_bad_plan_of_an_earlier_night_stops_no_night(after_one: tuple[Path, Path], change: dict[str, Any]) -> None:
    study, into = after_one
    path = archive.nights(into)[0] / "tiny" / files.PLAN
    path.write_text(json.dumps(json.loads(path.read_text()) | change))
    record, _ = night(into, [study])
    own = record.studies["tiny"]
    assert (own.state, own.linked, record.exit_code) == ("complete", 0, 0)
    assert read_night(into / record.name) == record


@pytest.mark.parametrize(
    "make", mostly_long([os.mkfifo, Path.mkdir, lambda path: path.symlink_to("nowhere")], [os.mkfifo])
)
def test_what_stands_in_place_of_a_chunk_is_computed_anew(
    after_one: tuple[Path, Path], make: Callable[[Path], object]
) -> None:
    study, into = after_one
    (part,) = chunk_files.parts(archive.nights(into)[0] / "tiny" / "designs")
    part.path.unlink()
    make(part.path)
    record, _ = night(into, [study])
    assert (record.studies["tiny"].state, record.studies["tiny"].computed, record.exit_code) == ("complete", 1, 0)


def test_broken_studies_fail_by_themselves(tmp_path: Path) -> None:
    sound = written(tmp_path / "sound", name="broken")
    places = [tmp_path / "broken", tmp_path / "more"]
    for place in places:
        place.mkdir()
        (place / "study.toml").write_text("[study")
    (places[1] / "other.toml").write_bytes(b"\xff")
    lost = tmp_path / "lost"
    lost.mkdir()
    (lost / "study.toml").symlink_to("nowhere.toml")
    found = studies_in([places[0], sound, places[1], places[1] / "other.toml", lost], smoke=False)
    assert [(one.name, one.study is not None) for one in found] == [
        ("broken-2", False), ("broken", True), ("more", False), ("other", False), ("lost", False)
    ]  # fmt: skip
    assert all(one.fault for one in found if one.study is None)


@pytest.mark.parametrize(
    "change",
    [
        {"studies": 5},
        {"studies": {"tiny": 5}},
        {"studies": {"tiny": {"state": "complete", "figures": 5}}},
        {"studies": {"tiny": {"state": "well"}}},
        {"studies": {"tiny": {"state": "complete", "changed": "x"}}},
        {"name": 5},
        {"seconds": None},
    ],
)
def test_records_of_wrong_types_are_left_out_and_said(after_one: tuple[Path, Path], change: dict[str, Any]) -> None:
    study, into = after_one
    line = json.loads((into / HISTORY).read_text())
    with (into / HISTORY).open("a") as file:
        file.write(json.dumps(line | change) + "\n")
    last = archive.nights(into)[0]
    (last / NIGHT).write_text(json.dumps(line | change))
    assert read_night(last) is None and len(read_history(into)) == 1
    record, said = night(into, [study])
    assert record.studies["tiny"].state == "complete"
    assert any("line 2 cannot be read" in words for words in said)
    page = (into / "index.html").read_text()
    assert record.name in page and line["name"] in page


@pytest.mark.parametrize("number", mostly_long([errno.ENOLCK, errno.ENOSYS], [errno.ENOLCK]))
def test_a_night_where_the_disk_has_no_locks_is_computed_and_says_so(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, number: int
) -> None:
    def refuse(*_: object) -> None:
        raise OSError(number, os.strerror(number))

    monkeypatch.setattr("fcntl.flock", refuse)
    study, into = written(tmp_path / "one"), tmp_path / "nights"
    for linked in (0, 1):
        with pytest.warns(LinksweepWarning, match="no locks"):
            record, _ = night(into, [study])
        assert (record.exit_code, record.studies["tiny"].linked) == (0, linked)
    with (
        pytest.warns(LinksweepWarning, match="no locks"),
        archive.one_at_a_time(into),
        pytest.raises(LockedError, match="another night"),
    ):
        night(into, [study])


def test_a_deleted_lock_lets_no_second_night_in(tmp_path: Path) -> None:
    into = tmp_path / "nights"
    with archive.one_at_a_time(into):
        (into / archive.LOCK).unlink()
        with pytest.raises(LockedError, match="another night"), archive.one_at_a_time(into):
            pass


def test_an_interrupted_night_says_what_it_kept(
    after_one: tuple[Path, Path], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    study, into = after_one

    def interrupted(*_: object) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr("sweep.nights.night.call", interrupted)
    with pytest.raises(KeyboardInterrupt):
        night(
            into, [study, written(tmp_path / "two", name="two", e=91), written(tmp_path / "three", name="three", e=92)]
        )
    last = archive.nights(into)[-1]
    record = read_night(last)
    assert record is not None and record.exit_code == 130
    assert {name: own.state for name, own in record.studies.items()} == {
        "tiny": "complete", "two": "cut", "three": "waiting"
    }  # fmt: skip
    assert "interrupted at two: tiny kept" in (last / "log.txt").read_text()
    assert last.name in (into / "index.html").read_text()


def test_a_new_title_is_in_the_report_of_the_next_night_though_nothing_is_computed(tmp_path: Path) -> None:
    study = written(tmp_path / "one")
    night(tmp_path / "nights", [study])
    file = study / "study.toml"
    file.write_text(file.read_text().replace('name = "tiny"', 'name = "tiny"\ntitle = "A later title"'))
    second, _ = night(tmp_path / "nights", [study])
    record = second.studies["tiny"]
    assert (record.computed, record.changed) == (0, 0)
    assert "A later title" in (tmp_path / "nights" / second.name / "tiny" / "report.html").read_text()


def test_a_run_that_dies_behind_its_optimum_has_failed(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def dies(words: Sequence[str], log: Path, seconds: float) -> Ended:
        return replace(called(words, log, seconds), code=137, message="Killed")

    monkeypatch.setattr("sweep.nights.night.call", dies)
    record, _ = night(tmp_path / "nights", [written(tmp_path / "one")])
    assert (record.exit_code, record.good, record.studies["tiny"].message) == (70, False, "Killed")


def test_a_disk_that_has_no_room_for_a_report_is_told_by_the_exit_code(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    full = Ended(74, 0.0, "sweep: report.html: No space left on device")
    monkeypatch.setattr(
        "sweep.nights.night.call", lambda words, *rest: full if "report" in words else called(words, *rest)
    )
    record, _ = night(tmp_path / "nights", [written(tmp_path / "one")])
    own = record.studies["tiny"]
    assert (record.exit_code, own.state, own.message) == (74, "failed", "report.html: No space left on device")


def test_a_night_interrupted_behind_its_last_study_says_so(
    after_one: tuple[Path, Path], monkeypatch: pytest.MonkeyPatch
) -> None:
    study, into = after_one
    note = archive.Journal.note

    def interrupted(journal: archive.Journal, event: str, words: str, **about: Any) -> None:
        if event == "study":
            raise KeyboardInterrupt
        note(journal, event, words, **about)

    monkeypatch.setattr(archive.Journal, "note", interrupted)
    with pytest.raises(KeyboardInterrupt):
        night(into, [study])
    assert "interrupted at its end: tiny kept" in (archive.nights(into)[-1] / "log.txt").read_text()


def test_a_study_with_a_program_for_figures_has_them_drawn(tmp_path: Path) -> None:
    study = written(tmp_path / "one")
    (study / "figure.py").write_text("import sys, pathlib\npathlib.Path(sys.argv[1], 'drawn').write_text('')\n")
    record, _ = night(tmp_path / "nights", [study])
    assert (tmp_path / "nights" / record.name / "tiny" / "drawn").is_file()


def test_the_page_speaks_of_a_first_night_of_labels_and_per_cent(first: tuple[Path, Path]) -> None:
    page = write_page(first[1]).read_text()
    assert "<h1>Nights of 1 study</h1>" in page
    assert "no change" not in page and "first night" in page
    assert "100\u00a0%" in page
    assert "max_abs_dP" not in page and "mm" in page


def test_a_study_of_which_no_design_keeps_the_limits_is_complete(tmp_path: Path) -> None:
    """Its run ends with 4, and all files are there; the night said that its process had died."""
    path = written(tmp_path / "studies" / "tiny")
    with (path / "study.toml").open("a", encoding="utf-8") as file:
        file.write('[limits]\nrange_P = "<= 1 um"\n')
    record, _ = night(tmp_path / "nights", [tmp_path / "studies"])
    assert (record.exit_code, record.studies["tiny"].state, record.studies["tiny"].report) == (0, "complete", True)
    again, _ = night(tmp_path / "nights", [tmp_path / "studies"])
    assert again.exit_code == 0 and again.studies["tiny"].linked == record.studies["tiny"].computed
