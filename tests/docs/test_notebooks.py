"""The notebooks of the docs: they run as they are, and what they show was made by running them."""

from __future__ import annotations

import importlib.util
import re
from pathlib import Path

import nbformat
import pytest

ROOT = Path(__file__).parents[2]
NOTEBOOKS = sorted((ROOT / "docs" / "notebooks").glob("*.ipynb"))
spec = importlib.util.spec_from_file_location("docs_notebooks", ROOT / "docs" / "site" / "notebooks.py")
runner = importlib.util.module_from_spec(spec)
spec.loader.exec_module(runner)


def kinds(book):
    """What each cell gave: printed text, or the kind of its value."""
    return [[output.get("name") or list(output["data"]) for output in cell.get("outputs", ())] for cell in book.cells]


def test_there_are_three():
    names = ["first-sweep", "reading-a-night", "requirement-to-drawing"]
    assert [path.stem for path in NOTEBOOKS] == names and runner.notebooks() == NOTEBOOKS


# One of them is run by `make test`, all three by `make test-long`.
LATER = [pytest.param(path, marks=pytest.mark.long) for path in NOTEBOOKS[1:]]


@pytest.mark.slow
@pytest.mark.parametrize("path", [NOTEBOOKS[0], *LATER], ids=lambda path: path.stem)
@pytest.mark.filterwarnings("ignore::DeprecationWarning")  # of the client of the kernels
def test_notebook_runs_and_shows_what_running_it_gives(path):
    kept = nbformat.read(path, as_version=4)
    fresh = runner.executed(path)
    assert kinds(fresh) == kinds(kept)
    assert any("image/png" in kind for cell in kinds(kept) for kind in cell)


@pytest.mark.parametrize("path", NOTEBOOKS, ids=lambda path: path.stem)
def test_notebook_names_no_place_of_a_machine_and_is_small(path):
    text = path.read_text(encoding="utf-8")
    book = nbformat.reads(text, as_version=4)
    shown = re.sub(r'"image/png": "[^"]*"', "", text)
    assert not re.search(r"/(?:home|root|tmp|work|Users)/|[A-Z]:\\\\", shown)
    assert len(text) < 200_000
    code = [cell for cell in book.cells if cell.cell_type == "code"]
    assert [cell.execution_count for cell in code] == list(range(1, len(code) + 1))  # run from the top, in order
    assert not any(
        output.output_type == "error" or output.get("name") == "stderr" for cell in code for output in cell.outputs
    )
