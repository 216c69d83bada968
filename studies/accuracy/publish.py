"""Where the page goes in the tree: docs/accuracy.md with its figures, and the marks in the README."""

from __future__ import annotations

import re
import shutil
from pathlib import Path
from typing import TYPE_CHECKING

from studies.accuracy.page import marks_table

if TYPE_CHECKING:
    from studies.accuracy.page import Measured
    from sweep.report.figures import Saved

BEGIN, END = "<!-- marks: written by make study-accuracy -->", "<!-- end of marks -->"


def publish(found: Measured, page: str, figures: list[Saved], root: Path) -> None:
    """Write the page and its figures into docs, and the table of marks between the two comments of the README."""
    (root / "docs" / "accuracy.md").write_text(page, encoding="utf-8")
    for figure in figures:
        shutil.copy(figure.path, root / "docs" / "figures" / figure.path.name)
    readme = root / "README.md"
    readme.write_text(with_marks(readme.read_text(encoding="utf-8"), marks_table(found.marks)), encoding="utf-8")


def with_marks(text: str, table: list[str]) -> str:
    """The text with everything between its two comments replaced by the table."""
    block = "\n".join([BEGIN, "", *table, "", END])
    replaced, count = re.subn(f"{re.escape(BEGIN)}.*?{re.escape(END)}", lambda _: block, text, flags=re.DOTALL)
    if count != 1:
        raise ValueError(f"{count} places between {BEGIN!r} and {END!r}; allowed: one")
    return replaced
