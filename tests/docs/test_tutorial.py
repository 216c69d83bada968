"""The tutorial as a new user follows it: the commands stand there as they are typed, the answers as they come."""

from __future__ import annotations

import re
import shlex
from pathlib import Path

import pytest
from click.testing import CliRunner

from sweep.cli import main

ROOT = Path(__file__).parents[2]
TEXT = (ROOT / "docs" / "tutorial.md").read_text(encoding="utf-8")
LINES = [line[4:] for line in TEXT.splitlines() if line.startswith("    ")]
COMMANDS = [line for line in LINES if line.startswith("sweep ")]
ANSWERS = [line for line in LINES if not line.startswith("sweep ")]


def typed(command: str):
    return CliRunner().invoke(main, shlex.split(command)[1:])


@pytest.mark.slow
def test_tutorial_gives_the_answers_it_shows(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    init, check, run, report, *others = COMMANDS
    said = typed(init).output + typed(check).output
    assert "25 designs" in said
    study = tmp_path / "press" / "study.toml"
    text = study.read_text(encoding="utf-8")
    for mark in ("[optimise]", "starts = ", "[tolerance]", "lengths = "):
        assert f"\n# {mark}" in text
        text = text.replace(f"\n# {mark}", f"\n{mark}")
    study.write_text(text, encoding="utf-8")
    said += typed(run).output + typed(report).output
    assert (tmp_path / "results" / "press" / "report.html").is_file()
    (limit,) = [line for line in ANSWERS if line.startswith("stroke = ")]
    study.write_text(text.replace("[limits]\n", f"[limits]\n{limit}\n"), encoding="utf-8")
    assert typed(run).exit_code == 2  # the folder holds the first answer
    said += typed(f"{run} --force").output
    for command in others:
        done = typed(command)
        assert done.exit_code == 0, done.output
    names = {}
    for code in re.findall(r"```python\n(.*?)```", TEXT, flags=re.DOTALL):
        exec(code, names)
    study.write_text(re.sub(r"(?m)^b = .*$", "b = 40.0", text), encoding="utf-8")
    said += typed(check).output
    for line in ANSWERS:
        assert line in said or line == limit, line
