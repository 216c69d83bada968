"""What the README shows is run: its Python example, its Parquet one-liner, its make targets and the pages it names."""

from __future__ import annotations

import re
import subprocess
import sys
import tomllib
from pathlib import Path

import sweep
from sweep.study import load_study, study_from_data

ROOT = Path(__file__).parents[2]
TEXT = (ROOT / "README.md").read_text()


def blocks(language):
    return re.findall(rf"```{language}\n(.*?)```", TEXT, flags=re.DOTALL)


def run(code, folder):
    return subprocess.run(
        [sys.executable, "-c", code], cwd=folder, capture_output=True, text=True, timeout=300, check=False
    )


def test_python_example_prints_a_row_per_design_and_no_warning(tmp_path):
    (code,) = blocks("python")
    done = run(code, tmp_path)
    assert done.returncode == 0, done.stderr
    assert done.stderr == ""
    assert "err_max_abs_d2psi" in done.stdout
    assert done.stdout.count("\n") >= 6 + 5


def test_parquet_one_liner_reads_the_folder_of_the_study(tmp_path):
    (command,) = [line for block in blocks("sh") for line in block.splitlines() if "read_parquet" in line]
    code = re.search(r'-c "(.*)"', command)[1]
    study = load_study(ROOT / "studies" / "needle208", smoke=True)
    data = {key: value for key, value in study.data.items() if key not in ("optimise", "tolerance")}
    data["design"] = data["design"] | {"sample": data["design"]["sample"] | {"n": 16384}}
    sweep.run(study_from_data(data, study.path), out=tmp_path / "results" / "needle208" / "designs")
    done = run(code, tmp_path)
    assert done.returncode == 0, done.stderr
    assert "max_abs_d2s" in done.stdout


def test_make_targets_and_pages_exist():
    makefile = (ROOT / "Makefile").read_text()
    for target in re.findall(r"`?make ([a-z0-9-]+)", TEXT):
        study = target.removeprefix("study-")
        known = re.search(rf"^{re.escape(target)}:", makefile, flags=re.MULTILINE)
        assert known or (ROOT / "studies" / study / "study.toml").exists(), target
    for page in re.findall(r"docs/[\w-]+\.(?:md|svg|png)", TEXT):
        assert (ROOT / page).exists(), page


def test_what_make_does_for_a_user_stands_on_the_page_without_make() -> None:
    """Every call of the program in a recipe that is no bench and no test."""
    recipes = (ROOT / "Makefile").read_text(encoding="utf-8")
    page = (ROOT / "docs" / "command-line.md").read_text(encoding="utf-8")
    calls = re.findall(r"^\t\$\(SWEEP\) (.*)$", recipes, flags=re.MULTILINE)
    assert len(calls) >= 5
    for call in calls:
        words = call.replace("$*", "NAME").replace("$(NIGHTS)", "nights")
        assert f"sweep {words}" in page, words


def test_version_is_the_same_everywhere() -> None:
    """What sources without history or tags are called is the release that the pages name."""
    versions = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["tool"]["versioningit"]
    version = versions["default-version"]
    assert versions["vcs"]["default-tag"] == f"v{version}"
    assert f"\nversion: {version}\n" in (ROOT / "CITATION.cff").read_text(encoding="utf-8")
    assert f"\n## {version}" in (ROOT / "CHANGELOG.md").read_text(encoding="utf-8")
