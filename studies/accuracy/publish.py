"""Where the page goes in the tree: docs/accuracy.md with its figures."""

from __future__ import annotations

import shutil
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from sweep.report.figures import Saved


def publish(page: str, figures: list[Saved], root: Path) -> None:
    """Write the page and its figures into docs."""
    (root / "docs" / "accuracy.md").write_text(page, encoding="utf-8")
    for figure in figures:
        shutil.copy(figure.path, root / "docs" / "figures" / figure.path.name)
