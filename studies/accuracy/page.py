"""The pages: docs/accuracy.md with those behind it, and all of them as one HTML; from the measured tables alone."""

from __future__ import annotations

import shutil
from pathlib import Path

from studies.accuracy.crank_rocker_page import crank_rocker_page
from studies.accuracy.effects_page import effects_page
from studies.accuracy.families_page import families_page
from studies.accuracy.front import front
from studies.accuracy.marks_page import marks_page
from studies.accuracy.measured import Measured
from studies.accuracy.tables import html_body
from sweep.report.figures import Saved

MAKERS = {
    "accuracy.md": front,
    "accuracy/families.md": families_page,
    "accuracy/effects.md": effects_page,
    "accuracy/crank-rocker.md": crank_rocker_page,
    "accuracy/marks.md": marks_page,
}


def pages(m: Measured) -> dict[str, str]:
    """Text of every page by its place in docs."""
    return {path: "\n".join(make(m)) + "\n" for path, make in MAKERS.items()}


def write(written: dict[str, str], figures: list[Saved], docs: Path) -> None:
    """Put pages and figures into a folder of documents."""
    for path, text in written.items():
        (docs / path).parent.mkdir(parents=True, exist_ok=True)
        (docs / path).write_text(text, encoding="utf-8")
    (docs / "figures").mkdir(exist_ok=True)
    for figure in figures:
        if figure.path.parent != docs / "figures":
            shutil.copy(figure.path, docs / "figures" / figure.path.name)


def html(written: dict[str, str], figures: list[Saved]) -> str:
    """All pages with their diagrams in one, self-contained."""
    images = {figure.path.name: figure.uri for figure in figures}
    style = "body{font:15px/1.45 system-ui,sans-serif;max-width:1350px;margin:2em auto;padding:0 1em;color:#222}" \
        "table{border-collapse:collapse;margin:.6em 0}td,th{padding:.15em .5em;border-bottom:1px solid #e4e7eb;" \
        "text-align:left;font-variant-numeric:tabular-nums}td:nth-child(n+3){white-space:nowrap}" \
        "img{max-width:100%}code{background:#f3f4f6}"  # fmt: skip
    head = (
        f'<!doctype html><html lang="en"><meta charset="utf-8"><title>Accuracy and time</title><style>{style}</style>'
    )
    return head + "<hr>".join(html_body(text, images) for text in written.values()) + "</html>\n"
