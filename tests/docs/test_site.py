"""The docs as a site: what is generated for it is complete, and its check of links finds what is wrong."""

from __future__ import annotations

import importlib.util
import re
from pathlib import Path
from xml.etree import ElementTree

import pytest
import yaml

import sweep
from sweep.families import NAMES, family

ROOT = Path(__file__).parents[2]


def script(name):
    spec = importlib.util.spec_from_file_location(f"docs_{name}", ROOT / "docs" / "site" / f"{name}.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


hooks, links, equations = script("hooks"), script("links"), script("equations")


def mathml(text):
    """The MathML of an equation without spaces and attributes, parsed and written again: it is well-formed."""
    tree = ElementTree.fromstring(equations.expression(text))
    for element in tree.iter():
        element.attrib.clear()
    return ElementTree.tostring(tree, encoding="unicode").replace("<mspace />", "")


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
    pages += [
        f"{room}/{path.name}" for room in ("accuracy", "internals") for path in (ROOT / "docs" / room).glob("*.md")
    ]
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


@pytest.mark.parametrize(
    ("text", "wanted"),
    [
        ("a g sa/c", "<mi>a</mi><mi>g</mi><mfrac><mrow><mi>sa</mi></mrow><mrow><mi>c</mi></mrow></mfrac>"),
        ("K/(2c)", "<mfrac><mrow><mi>K</mi></mrow><mrow><mn>2</mn><mi>c</mi></mrow></mfrac>"),
        ("psi'^2", "<msup><mrow><mi>ψ</mi><mo>′</mo></mrow><mrow><mn>2</mn></mrow></msup>"),
        ("G_phipsi", "<msub><mi>G</mi><mi>φψ</mi></msub>"),
        ("sqrt(Delta)", "<msqrt><mrow><mi>Δ</mi></mrow></msqrt>"),
        ("-|w||f|", "<mo>−</mo><mo>|</mo><mrow><mi>w</mi></mrow><mo>|</mo><mo>|</mo><mrow><mi>f</mi></mrow><mo>|</mo>"),
        ("d1 x d2", "<msub><mi>d</mi><mi>1</mi></msub><mo>×</mo><msub><mi>d</mi><mi>2</mi></msub>"),
        ("x C + y S", "<mi>x</mi><mi>C</mi><mo>+</mo><mi>y</mi><mi>S</mi>"),
        ("e^{-i lam}", "<msup><mrow><mi>e</mi></mrow><mrow><mo>−</mo><mi>i</mi><mi>λ</mi></mrow></msup>"),
        ("sin^2(t/2)", "<msup><mi>sin</mi><mrow><mn>2</mn></mrow></msup><mrow><mo>(</mo><mfrac><mrow><mi>t</mi></mrow>"
                       "<mrow><mn>2</mn></mrow></mfrac><mo>)</mo></mrow>"),
        ("least of max_abs_d2psi", "<mtext>least of</mtext><mtext>max_abs_d2psi</mtext>"),
        ("mid-stroke", "<mtext>mid-stroke</mtext>"),
        ("psi-phi", "<mi>ψ</mi><mo>−</mo><mi>φ</mi>"),
        ("sum (a)/r", "<mo>∑</mo><mfrac><mrow><mi>a</mi></mrow><mrow><mi>r</mi></mrow></mfrac>"),
        ("by swing/2", "<mtext>by</mtext><mfrac><mrow><mtext>swing</mtext></mrow><mrow><mn>2</mn></mrow></mfrac>"),
        ("the rack's speed", "<mtext>the rack's speed</mtext>"),
    ],
)  # fmt: skip
def test_equation_is_set_as_it_is_meant(text, wanted):
    assert mathml(text) == f"<mrow>{wanted}</mrow>"


@pytest.mark.parametrize("text", ["(a + b", "a + b)", "a /", "a ~ b", "|a"])
def test_equation_that_is_not_understood_is_refused(text):
    with pytest.raises(equations.NotUnderstood):
        equations.expression(text)


def test_every_numbered_equation_of_the_pages_is_set_and_no_program_is():
    number = re.compile(r"^    \S.*\s{2,}\(\d+\s?[a-z]?\*?\)$", re.MULTILINE)
    numbered = 0
    for page in sorted((ROOT / "docs").glob("*.md")):
        text = page.read_text(encoding="utf-8")
        made = equations.typeset(text)
        assert not number.search(made), page.name
        numbered += len(number.findall(text))
        assert made.count("<math") == made.count("</math>")
        for block in re.findall(r'<div class="equations".*?\n</div>', made, re.DOTALL):
            ElementTree.fromstring(block)
            assert "import" not in block and "sweep run" not in block, page.name
    assert numbered > 200
    assert "    sweep init press" in equations.typeset((ROOT / "docs" / "tutorial.md").read_text(encoding="utf-8"))
