"""Style, palette and saving of the report's figures."""

from __future__ import annotations

import base64
import re
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Literal

from sweep.pages import TEMPLATES

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

OPTIMUM, REFERENCE, LIMIT, QUIET = "#1f5aa6", "#c8551b", "#b3261e", "#8a8f98"
WIDTH = 9.6  # inches, the full text width of the page
NARROW = 4.6  # inches; narrow enough to read bars and their names on a telephone


@contextmanager
def house_style() -> Iterator[None]:
    """Draw in the report's style without changing the caller's settings."""
    import matplotlib as mpl
    from matplotlib import style

    with mpl.rc_context():
        style.use(TEMPLATES / "report.mplstyle")
        yield


def new_figure(width: float, height: float, layout: Literal["constrained"] | None = "constrained") -> Figure:
    """Return an empty figure without a window system; without a layout the caller sets the margins."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    figure = Figure(figsize=(width, height), layout=layout)
    FigureCanvasAgg(figure)
    return figure


def save(figure: Figure, path: Path) -> Path:
    """Write an SVG that depends on nothing but its data, without date and random identifiers; return its path."""
    path.parent.mkdir(parents=True, exist_ok=True)
    figure.savefig(path, format="svg", metadata={"Date": None, "Creator": None, "Format": None, "Type": None})
    path.write_text(smaller(path.read_text("utf-8")), "utf-8")
    return path


def smaller(text: str) -> str:
    """Shorten an SVG: hundredths of a point, no indents, no empty groups, and each style once.

    Text is unchanged: only numbers within tags are rounded.
    """
    text = re.sub(r"<[^>]*>", lambda tag: re.sub(r"(\d\.\d\d)\d+", r"\1", tag[0]), re.sub(r"\n\s+", "\n", text))
    text = re.sub(r'<g id="[^"]*"/>\n| transform="rotate\(-0 [^"]*\)"', "", text)
    styles = {style: f"s{k}" for k, style in enumerate(dict.fromkeys(re.findall(r' style="([^"]*)"', text)))}
    text = re.sub(r' style="([^"]*)"', lambda m: f' class="{styles[m[1]]}"', text)
    rules = " ".join(f".{name} {{{style}}}" for style, name in styles.items())
    return re.sub(r"(<svg[^>]*>)", rf"\1\n<style>{rules}</style>", text, count=1)


def data_uri(path: Path) -> str:
    """Return a saved figure as a data URI for the page."""
    return f"data:image/svg+xml;base64,{base64.b64encode(path.read_bytes()).decode('ascii')}"


def crank_axis(axes: Axes, label: str) -> None:
    """Label an axis with crank angles over one turn, ticked in quarters."""
    axes.set_xlim(0, 360)
    axes.set_xticks(range(0, 361, 90))
    axes.set_xlabel(label)
