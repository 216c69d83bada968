"""The page of the nights: a red dot where a figure moved, links to what is still there, words of users as words."""

from __future__ import annotations

from pathlib import Path

from sweep.nights.archive import NightRecord, StudyRecord, append_history
from sweep.nights.page import HEIGHT, WIDTH, study_rows, write_page


def record(value: float, *moved: str, **about: object) -> StudyRecord:
    code = 10 if moved else 0
    changes = tuple(f"{name} moved" for name in moved)
    own = StudyRecord("complete", seconds=3.0, figures={"swing": value}, units={"swing": "rad"}, compared_with="before")
    return StudyRecord(**vars(own) | {"changed": code, "changes": changes, "moved": moved} | about)  # type: ignore[arg-type]


def night(day: int, own: StudyRecord, code: int = 0) -> NightRecord:
    return NightRecord(f"2026-01-{day:02d}T00-00-00Z", 5.0, code, {"needle": own})


def test_the_moved_figure_is_red_at_its_night_only(tmp_path: Path) -> None:
    nights = [night(1, record(1.0)), night(2, record(1.0)), night(3, record(1.2, "swing")), night(4, record(1.2))]
    rows = study_rows("needle", nights, tmp_path)
    swing = rows.trends[0]
    assert [dot.red for dot in swing.dots] == [False, False, True, False]
    assert (swing.red, rows.red, rows.state) == (False, False, "no change")
    assert swing.value == "68.7549°"
    assert swing.dots[0].y > swing.dots[2].y
    assert all(0 < dot.x < WIDTH and 0 < dot.y < HEIGHT for dot in swing.dots)
    last = study_rows("needle", nights[:3], tmp_path)
    assert (last.trends[0].red, last.red, last.state, last.words) == (True, True, "values changed", ("swing moved",))


def test_an_edited_study_is_not_called_one_whose_rows_changed(tmp_path: Path) -> None:
    for name, own in (("edited", record(1.0, changed=11, edited=True)), ("moved", record(1.0, changed=11))):
        append_history(tmp_path / name, night(1, own, code=11))
    edited, moved = (write_page(tmp_path / name).read_text() for name in ("edited", "moved"))
    assert "study file edited" in edited and "rows changed" not in edited
    assert "study file edited" not in moved and "rows changed" in moved


def test_a_report_that_was_deleted_is_not_linked(tmp_path: Path) -> None:
    nights = [night(1, record(1.0, report=True)), night(2, record(1.0, report=True))]
    assert study_rows("needle", nights, tmp_path).report is None
    page = tmp_path / nights[0].name / "needle" / "report.html"
    page.parent.mkdir(parents=True)
    page.write_text("")
    assert study_rows("needle", nights, tmp_path).report == f"{nights[0].name}/needle/report.html"


def test_words_that_look_like_markup_stay_words_and_one_night_is_a_page(tmp_path: Path) -> None:
    append_history(tmp_path, night(1, StudyRecord("failed", 2, message="<script>alert(1)</script>"), code=2))
    text = write_page(tmp_path).read_text()
    assert "<script>" not in text
    assert "&lt;script&gt;" in text
    assert "failed (2)" in text


def test_a_study_that_was_left_out_of_the_last_night_says_so(tmp_path: Path) -> None:
    other = NightRecord("2026-01-02T00-00-00Z", 5.0, 0, {"other": record(2.0)})
    rows = study_rows("needle", [night(1, record(1.0)), other], tmp_path)
    assert rows.state == "not in the last night; no change on 2026-01-01T00-00-00Z"
