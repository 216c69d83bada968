"""What is no sound TOML: said with the line, and where something stands twice with both."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from sweep.errors import StudyError
from sweep.study.toml import DEEPEST, read_toml


def said(text: str, folder: Path) -> str:
    (folder / "study.toml").write_text(text)
    with pytest.raises(StudyError) as caught:
        read_toml(folder / "study.toml")
    (fault,) = caught.value.faults
    place, _, words = fault.partition(": ")
    line = re.search(r"line (\d+)", words)
    assert line is None or place == f"{folder}/study.toml:{line[1]}"  # where an editor jumps to
    return words


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("[limits]\na = 1\nb = 2\na = 3\n", "limits.a is given twice (at line 4, column 6), first in line 2"),
        (
            "[x]\na = 1\n[limits]\na = 1\nb = [\n1]\na = 2",
            "limits.a is given twice (at line 7, column 6, the end of the file), first in line 4",
        ),
        ("x = 1\nx = 2\n", "x is given twice (at line 2, column 6), first in line 1"),
        ('[a]\n"b" = 1\nb = 2\n', "a.b is given twice (at line 3, column 6), first in line 2"),
        ("[x]\na = 1\n[y]\n[x]\nb = 2\n", "the table [x] stands twice (at line 4, column 3), first in line 1"),
        ("[d]\nx = { a = 1, a = 2 }\n", "Duplicate inline table key 'a' (at line 2, column 19)"),
        ("a = 1\nb = " + "9" * 5000, "a number of thousands of digits; allowed: numbers up to 1e100"),
        ("a = " + "[" * 3000 + "]" * 3000, f"tables or lists within each other too often; allowed: {DEEPEST} levels"),
        (
            "b = 1\na = " + "[" * 40 + "]" * 40,
            f"a: tables or lists within each other too often; allowed: {DEEPEST} levels",
        ),
        (f"[{'.'.join('a' * 4000)}]\n", f"a: tables or lists within each other too often; allowed: {DEEPEST} levels"),
    ],
)
def test_fault_is_said_with_its_line(text: str, words: str, tmp_path: Path) -> None:
    assert said(text, tmp_path) == words


def test_what_is_sound_is_read(tmp_path: Path) -> None:
    (tmp_path / "study.toml").write_bytes(b"\xef\xbb\xbf[a]\nb = { c = [[1, 2]] }\n[a.d]\nb = 1\n")
    assert read_toml(tmp_path / "study.toml") == {"a": {"b": {"c": [[1, 2]]}, "d": {"b": 1}}}
    with pytest.raises(StudyError, match="cannot be read"):
        read_toml(tmp_path / "nowhere.toml")
