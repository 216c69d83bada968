"""What a designer reads where a number alone would not tell him enough: sentences, where they stand."""

from __future__ import annotations

import re
from pathlib import Path
from types import SimpleNamespace

import pytest
from click.testing import CliRunner

import sweep
from sweep.cli import main
from sweep.cli.plan import _optimiser
from sweep.families import NAMES, family
from sweep.report.answer import search_warnings
from sweep.study.study import OptimiseSettings

DOCS = Path(__file__).parents[2] / "docs"


@pytest.mark.parametrize("name", ["rssr", "rssp", "four_bar", "slider_crank", "guide"])
def test_margin_says_what_it_is_and_when_the_linkage_jams(name):
    text = CliRunner().invoke(main, ["families", name]).output
    (line,) = [line for line in text.splitlines() if line.split()[:1] == ["margin"]]
    assert "cos^2 of the worst pressure angle" in line and "below 0 the linkage jams" in line


def test_page_on_study_files_says_how_maximised_outputs_are_stored():
    page = (DOCS / "study-files.md").read_text(encoding="utf-8")
    assert "Maximised outputs are stored negated, as `minus_<output>`" in page


def has_box(name):
    try:
        sweep.summarise(name, family(name).example, ["box_x"], samples=16)
    except sweep.InputError:
        return False
    return True


def test_page_on_ready_limits_names_the_families_that_have_a_box():
    """It gave cams none and the feed one; it is the other way round."""
    page = (DOCS / "ready-limits.md").read_text(encoding="utf-8")
    sentence = page.split("* **Box.**")[1].split(".")[0]
    assert set(re.findall(r"`(\w+)`", sentence)) == set(filter(has_box, NAMES))


def test_page_on_extrema_names_the_families_whose_branch_decides_which_end_is_extended():
    """It said so of all, but a slotted link, a cam's lever and Kim and Dison's rocker are extended where farthest."""
    page = (DOCS / "extrema.md").read_text(encoding="utf-8")
    modes = page.split("* **Extended**")[1].split("**Folded**")[0].split("assembly mode -1")[1]
    named = set(re.findall(r"`(\w+)`", modes)) - {"branch", "branch1"}
    assert named == {name for name in NAMES if family(name).outward}


def test_files_that_pages_name_are_there():
    """Two pages named files that had been renamed."""
    root = DOCS.parent
    pages = [page for page in DOCS.rglob("*.md") if not page.name.startswith("how-to-add")]  # files to be made
    for page in [*pages, root / "README.md", *root.glob("studies/*/README.md")]:
        for path in re.findall(r"`((?:kernels|sweep|tests|studies)/[\w/.-]+\.\w+)", page.read_text(encoding="utf-8")):
            assert (root / path).exists(), f"{page.name}: {path}"


def test_plan_says_when_a_search_ends():
    (line,) = _optimiser(SimpleNamespace(optimise=OptimiseSettings()))
    assert (
        "fewer once the best local optimum was found from 3 starts and another start finds a new one with a chance "
        "under 2 %" in line
    )


@pytest.mark.parametrize(("best", "words"), [(1, "Only one start reached"), (2, "Only two starts reached")])
def test_an_optimum_that_few_starts_reached_asks_for_more(tmp_path, best, words):
    survey = SimpleNamespace(shortcomings=[], doubts=True, populations=0, best=best)
    study = SimpleNamespace(tolerance=None, pareto=None, family=family("backrest"))
    beside = {"study": study, "objective": None, "front": None, "front_steps": None}
    data = SimpleNamespace(survey=survey, folder=tmp_path / "designs", optimum={}, **beside)
    assert f"{words} this optimum; run more." in search_warnings(data)
