"""docs/export.md runs as it stands, and writes the files that it names."""

from __future__ import annotations

import re
from pathlib import Path

PAGE = Path(__file__).parents[2] / "docs" / "export.md"


def test_code_of_the_page_writes_the_files_it_names(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    blocks = re.findall(r"```python\n(.*?)```", PAGE.read_text(encoding="utf-8"), flags=re.DOTALL)
    names = {}
    for block in blocks:
        exec(block, names)
    named = set(re.findall(r'"([a-z]+\.(?:glb|dxf|csv|svg))"', "".join(blocks)))
    assert {path.name for path in tmp_path.iterdir()} == named and len(named) == 5
    assert all(path.stat().st_size > 1000 for path in tmp_path.iterdir())
