"""What the page needs to move: numbers as JSON, and the scripts that read them."""

from __future__ import annotations

import json
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

from sweep.report.alternatives import shown_designs
from sweep.report.figures import TEMPLATES
from sweep.report.moving import moving
from sweep.report.parallel import parallel

if TYPE_CHECKING:
    from sweep.report.dataset import Dataset
    from sweep.report.groups import Group
    from sweep.report.scan import Cells

LIVE = TEMPLATES / "live"
SPATIAL, PLANE = ("three.min.js", "view.js"), ("charts.js", "lines.js", "page.js")


def live(data: Dataset, cells: Sequence[Cells], different: Sequence[Group]) -> dict[str, Any]:
    """Return variables of the template:
    the data of both moving sections as JSON, empty where there is nothing to show.
    """
    shown = shown_designs(data, different)
    motion = moving(data, shown)
    lines = parallel(data, cells, shown)
    spatial = motion is not None and motion["size"] > 0.0
    scripts = [*(SPATIAL if spatial else ()), *PLANE]
    return {
        "shown": shown,
        "motion_data": "" if motion is None else _json(motion),
        "axis": "" if motion is None else motion["axis"],
        "sides": motion is not None and len({tuple(part["shift"]) for part in motion["designs"][0]["parts"]}) > 1,
        "lines_data": "" if lines is None else _json(lines),
        "lines_axes": [] if lines is None else [_head(axis) for axis in lines["axes"]],
        "scripts": [(LIVE / name).read_text(encoding="utf-8") for name in scripts] if motion or lines else [],
        "live_style": (LIVE / "live.css").read_text(encoding="utf-8"),
    }


def _head(axis: dict[str, str]) -> str:
    return f"{axis['symbol']} [{axis['unit']}]" if axis["unit"] else axis["symbol"]


def _json(values: dict[str, Any]) -> str:
    """Return JSON as it may stand within a script element: no character of it can end the element."""
    return json.dumps(values, ensure_ascii=False, allow_nan=False, separators=(",", ":")).replace("<", "\\u003c")
