"""Faults of study files as files: TOML, encoding, a file that is missing, the one of two that a fault stands in."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from sweep.errors import StudyError
from sweep.study import load_study
from sweep.study.file import Faults, read_section
from sweep.study.mechanism import RelationSection
from tests.study.test_faults import RIGHT, faults_of


@pytest.mark.parametrize(
    ("text", "place"),
    [
        ("[study]\nname = ", "(at line 2, column 8, the end of the file)"),
        ('[study]\nname = "a"\nname = "b"\n', "line 3, column 11"),
        ('[study\nname = "a"\n', "(at line 1, column 7)"),
        ('[design]\na = "10 mm"\nb = 3 mm\n', "(at line 3, column 7)"),
    ],
)
def test_toml_faults_name_line_and_column(text: str, place: str, tmp_path: Path) -> None:
    (message,) = faults_of(text, tmp_path)
    assert re.match(r"study\.toml:\d: ", message)
    assert place in message


@pytest.mark.parametrize(
    ("title", "line"), [('"Press', 3), ("'Press", 3), ('"""Press\nit', 3), ("'''Press\nit", 3), ('["a",\n"b]', 4)]
)
def test_a_quote_that_is_not_closed_is_told_with_its_line(title: str, line: int, tmp_path: Path) -> None:
    text = f'[study]  # "quoted\nname = ""\ntitle = {title}\n[scene]\nwant = 1\n'
    (message,) = faults_of(text, tmp_path)
    assert message.startswith(f"study.toml:{line}: a text without its closing quote; allowed: ")


@pytest.mark.parametrize(
    ("line", "place"), [("title = crank-rocker, 110 off", "line 2, column 9"), ("b = 3 mm", "line 2, column 7")]
)
def test_words_and_units_without_quotes_are_told_where_quotes_go(line: str, place: str, tmp_path: Path) -> None:
    (message,) = faults_of(f"[design]\n{line}\n", tmp_path)
    assert place in message and message.endswith('stands between quotes, as in b = "3 mm"')


@pytest.mark.parametrize(
    ("line", "remedy"),
    [
        ("rotatable = True", "true and false have small letters"),
        ("a = { from = 1,\n to = 2 }", "a table between braces stands in one line and has no comma at its end"),
    ],
)
def test_what_python_would_take_is_told_as_toml_has_it(line: str, remedy: str, tmp_path: Path) -> None:
    (message,) = faults_of(f"[design]\n{line}\n", tmp_path)
    assert message.startswith("study.toml:2: ") and message.endswith(remedy)


def test_a_file_that_is_no_text(tmp_path: Path) -> None:
    (tmp_path / "study.toml").write_bytes(b"[study]\nname = '\xff'\n")
    with pytest.raises(StudyError, match="line 2 is no UTF-8 text"):
        load_study(tmp_path)


def test_a_missing_file(tmp_path: Path) -> None:
    with pytest.raises(StudyError, match=r"study\.toml: cannot be read: No such file"):
        load_study(tmp_path)
    (tmp_path / "study.toml").write_text(RIGHT)
    with pytest.raises(StudyError, match=r"smoke\.toml is missing; needed: a file beside study.toml with the keys"):
        load_study(tmp_path, smoke=True)


def test_a_fault_is_told_of_the_file_it_stands_in(tmp_path: Path) -> None:
    (tmp_path / "study.toml").write_text(RIGHT.replace("starts = 10", "starts = 0"))
    (tmp_path / "smoke.toml").write_text("[design]\nc = { count = 0 }\nh = 3\n")
    with pytest.raises(StudyError) as caught:
        load_study(tmp_path, smoke=True)
    places = [" ".join(fault.split()[:2]).rstrip(":") for fault in caught.value.faults]
    line = RIGHT.count("\n", 0, RIGHT.index("starts = 10")) + 1
    expected = [f"study.toml:{line}: optimise.starts", "smoke.toml:3: design.h", "smoke.toml:2: design.c.count"]
    assert places == [f"{tmp_path}/{place}" for place in expected]


def test_a_fault_under_a_name_of_the_users_is_told_by_the_key_above_it() -> None:
    wrong = {"fields": {"slow": 1}}
    faults = Faults({"study.toml": {"relations": {"a": wrong}}})
    read_section(RelationSection, wrong, ("relations", "a"), faults)
    (line,) = faults.lines
    assert line.startswith("study.toml: relations.a.fields.slow = 1; allowed: of a take, the least and most rise")
