"""Execute the notebooks of docs/notebooks in place: ``make notebooks``.

Of what a cell gives only text and pictures are kept, so that a notebook says nothing about the machine it ran on.
"""

from __future__ import annotations

import os
import sys
import tempfile
from pathlib import Path
from typing import Any

import nbformat
from nbclient import NotebookClient

ROOT = Path(__file__).resolve().parents[2]
KEPT = ("image/png", "text/plain")  # the first one there
SECONDS = 120  # for one cell; kernels may have to be compiled first


def notebooks() -> list[Path]:
    """Return all of them."""
    return sorted((ROOT / "docs" / "notebooks").glob("*.ipynb"))


def executed(path: Path) -> Any:
    """Return the notebook with fresh outputs, run in an empty folder against the sources of this project."""
    book = nbformat.read(path, as_version=4)
    os.environ["PYTHONPATH"] = str(ROOT)
    with tempfile.TemporaryDirectory() as place:
        client = NotebookClient(
            book,
            timeout=SECONDS,
            record_timing=False,
            coalesce_streams=True,  # what is printed comes in pieces as chance has it
            resources={"metadata": {"path": place}},
        )
        client.execute()
    for cell in book.cells:
        cell.metadata = {}
        for output in cell.get("outputs", ()):
            kind = next((kind for kind in KEPT if kind in output.get("data", {})), None)
            if kind is not None:
                output.data, output.metadata = {kind: output.data[kind]}, {}
    book.metadata = {"kernelspec": book.metadata["kernelspec"], "language_info": {"name": "python"}}
    return book


if __name__ == "__main__":
    for path in notebooks():
        nbformat.write(executed(path), path)
        sys.stdout.write(f"{path}\n")
