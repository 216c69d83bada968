"""The docs as a site: what is generated for it is complete, and its check of links finds what is wrong."""

from __future__ import annotations

import importlib.util
import re
from pathlib import Path

import pytest
import yaml

import sweep
from sweep.families import NAMES, family

ROOT = Path(__file__).parents[1]


def script(name):
    spec = importlib.util.spec_from_file_location(f"docs_{name}", ROOT / "docs" / "site" / f"{name}.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


hooks, links = script("hooks"), script("links")


def test_reference_has_every_public_name():
    page = hooks.python_page()
    for name in sweep.__all__:
        assert f"heading: sweep.{name}" in page
    assert page.count("heading: sweep.plot.") == len(sweep.plot.__all__)


def test_families_page_has_every_parameter_and_output_of_the_register():
    sections = hooks.families_page().split("\n## ")[1:]
    assert [section.split("\n")[0] for section in sections] == list(NAMES)
    for name, section in zip(NAMES, sections, strict=True):
        for entry in (*family(name).parameters, *family(name).pose_outputs):
            assert f"\n| `{entry.name}` | {entry.unit} | " in section
        rows = [line for line in section.splitlines() if line.startswith("| `")]
        assert all(len(re.split(r"(?<!\\)\|", row)) in (5, 6) for row in rows)


def test_pages_named_in_the_text_become_links_but_not_in_code():
    class Page:
        class file:
            src_uri = "reference/families.md"

    text = "See docs/rssr.md, `docs/rssr.md`,\n\n    docs/rssr.md\n\n```\ndocs/rssr.md\n```\n(docs/guide.md)\n"
    found = hooks.on_page_markdown(text, Page, None, None)
    assert found.startswith("See [Spatial crank-rocker](../rssr.md), `docs/rssr.md`,")
    assert found.count("](../rssr.md)") == 1 and "\n    docs/rssr.md\n" in found and "\ndocs/rssr.md\n" in found
    assert "([Planar four-bar with a guided coupler point](../guide.md))" in found


def test_notebook_becomes_text_code_and_pictures():
    text, pictures = hooks.notebook_page(ROOT / "docs" / "notebooks" / "first-sweep.ipynb")
    assert text.startswith("# First sweep\n") and "```python\n" in text and "```text\n" in text
    assert pictures and all(content.startswith(b"\x89PNG") for content in pictures.values())
    assert all(f"]({name})" in text for name in pictures)


def test_navigation_has_every_page_once():
    settings = (ROOT / "mkdocs.yml").read_text(encoding="utf-8")
    named = re.findall(r": ([\w/-]+\.md)$", settings, flags=re.MULTILINE)
    pages = [path.name for path in (ROOT / "docs").glob("*.md")]
    pages += [f"accuracy/{path.name}" for path in (ROOT / "docs" / "accuracy").glob("*.md")]
    pages += [f"notebooks/{path.stem}.md" for path in (ROOT / "docs" / "notebooks").glob("*.ipynb")]
    assert sorted(named) == sorted([*pages, "reference/python.md", "reference/families.md"])
    assert yaml.safe_load(settings)["strict"] is True and yaml.safe_load(settings)["theme"]["font"] is False


@pytest.mark.parametrize("inside, said", [
    ('<a href="other.html">x</a>', None),
    ('<a href="other.html#there">x</a> <a href="https://example.org/">out</a>', None),
    ('<a href="none.html">x</a>', "index.html: none.html is not there"),
    ('<a href="other.html#nowhere">x</a>', "index.html: other.html#nowhere has no such place"),
    ('<a href="#here">x</a>', "index.html: #here has no such place"),
    ('<img src="none.png">', "index.html: none.png is not there"),
    ('<script src="https://example.org/x.js"></script>', "index.html: fetches https://example.org/x.js"),
    ('<link rel="stylesheet" href="//example.org/x.css">', "index.html: fetches //example.org/x.css"),
])  # fmt: skip
def test_check_of_links_finds_what_leads_nowhere_or_is_fetched(inside, said, tmp_path):
    (tmp_path / "index.html").write_text(f"<html><body>{inside}</body></html>")
    (tmp_path / "other.html").write_text('<html><body><h2 id="there">x</h2></body></html>')
    assert links.faults(tmp_path) == ([] if said is None else [said])


def test_tutorial_shows_what_the_first_study_says():
    from sweep.cli.first_study import study_text

    text = study_text("press", family("slider_crank"), "study.schema.json")
    tutorial = (ROOT / "docs" / "tutorial.md").read_text(encoding="utf-8")
    (block,) = re.findall(r"```toml\n(.*?)```", tutorial, flags=re.DOTALL)
    for line in filter(None, block.splitlines()):
        assert line in text.splitlines()
