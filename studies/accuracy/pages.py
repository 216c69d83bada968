"""The pages docs/accuracy.md and below, with their figures, from the measured tables only."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from string import Template

from studies.accuracy.effects_page import effects_parts
from studies.accuracy.families_page import crank_rocker_parts, families_parts
from studies.accuracy.front import front_parts
from studies.accuracy.measured import Measured
from studies.accuracy.price_figures import draw_prices
from studies.accuracy.tables import Parts, pipe_table

TEMPLATES = Path(__file__).parent


def marks_parts(m: Measured) -> Parts:
    """Return the table of the marks: target, measured value, and whether it was met."""
    rows = [[mark, asked, measured, "yes" if met else "**no**"] for mark, asked, measured, met in m.marks.to_numpy()]
    return {"marks": pipe_table(["mark", "asked", "measured", "met"], rows)}


MAKERS: dict[str, Callable[[Measured], Parts]] = {
    "accuracy.md": front_parts,
    "accuracy/families.md": families_parts,
    "accuracy/effects.md": effects_parts,
    "accuracy/crank-rocker.md": crank_rocker_parts,
    "accuracy/marks.md": marks_parts,
}


def pages(m: Measured) -> dict[str, str]:
    """Return the text of every page by its path in docs: the template of the same name, with measured values."""
    return {path: _filled(TEMPLATES / Path(path).name, make(m)) for path, make in MAKERS.items()}


def _filled(template: Path, parts: Parts) -> str:
    text = Template(template.read_text(encoding="utf-8"))
    return text.substitute({name: "\n".join(lines) for name, lines in parts.items()})


def publish(m: Measured, docs: Path) -> None:
    """Write the pages into a folder of documents, and draw their figures."""
    for path, text in pages(m).items():
        (docs / path).parent.mkdir(parents=True, exist_ok=True)
        (docs / path).write_text(text, encoding="utf-8")
    draw_prices(m, docs / "figures")
