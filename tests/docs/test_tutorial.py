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
PRESS, LOOPER = TEXT.split("## 7. Your own looper")
LINES = [line[4:] for line in PRESS.splitlines() if line.startswith("    ")]
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


@pytest.mark.browser
def test_looper_gets_from_an_empty_folder_to_the_drawing(tmp_path, monkeypatch):
    from tests.support.browser import DRAWS, launcher
    from tests.support.explorer import explored

    monkeypatch.chdir(tmp_path)
    commands = [line[4:] for line in LOOPER.splitlines() if line.startswith("    sweep ")]
    init, run, explore, again, *others = commands
    assert typed(init).exit_code == 0
    study = tmp_path / "looper" / "study.toml"
    text = study.read_text(encoding="utf-8")
    study.write_text(text.replace("\n# [optimise]", "\n[optimise]").replace("\n# starts", "\nstarts"), encoding="utf-8")
    assert typed(run).exit_code == 0
    assert explore == "sweep explore results/looper"
    with launcher() as launch, explored(tmp_path / "results" / "looper") as address:
        page = launch(*DRAWS).new_page()
        page.goto(address)
        page.get_by_label("c1 may vary").check()
        page.click("#pin")
        page.click("#improve")
        page.get_by_text("evaluations").filter(has_text="after").wait_for(timeout=120_000)
        assert page.evaluate("design.c1") != page.evaluate("page.first.c1")
        with page.expect_download() as found:
            page.select_option("#save", "study")
        found.value.save_as(tmp_path / "looper" / "better.toml")
    assert typed(again).exit_code == 0
    for command in others:
        done = typed(command)
        assert done.exit_code == 0, done.output
    compared = (tmp_path / "results" / "looper" / "comparison.html").read_text(encoding="utf-8")
    assert "looper and looper-in-hand" in compared
    exported = {path.suffix for path in (tmp_path / "results" / "looper-in-hand" / "export").iterdir()}
    assert exported == {".pdf", ".dxf", ".xlsx"}
