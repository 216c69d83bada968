"""Earlier studies, whose questions are answered elsewhere, and whose optima test the code."""

from __future__ import annotations

import shutil
from pathlib import Path

from sweep.study import load_study
from sweep.study.study import Study

EARLIER = Path(__file__).parents[1] / "studies" / "earlier"
NEEDLE208 = Path(__file__).parents[2] / "studies" / "needle208"


def beside_needle208(name: str, folder: Path) -> Study:
    """Load an earlier study from a folder beside needle208, from which it takes its needle drive."""
    shutil.copytree(EARLIER / name, folder / name)
    (folder / "needle208").mkdir()
    shutil.copy(NEEDLE208 / "expected.json", folder / "needle208")
    return load_study(folder / name)
