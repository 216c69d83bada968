"""Workshop sheet of a design: views and tables of its dimensions, joints and limits; as PDF, SVG or DXF."""

from __future__ import annotations

import itertools
from collections.abc import Iterable, Sequence
from pathlib import Path
from textwrap import shorten
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from sweep.dataset.files import unwritable
from sweep.errors import InputError
from sweep.evaluation.joints import Part
from sweep.exchange.dxf import add_tables
from sweep.exchange.export import export
from sweep.exchange.scene import exists, finite, frames_of, is_spatial, over, pose, shown_name
from sweep.optimise.manufacture.tolerance import tolerances_of
from sweep.plot.drawing import draw, separate_names
from sweep.report.dataset import Dataset, as_result, chosen, cyclogram_of, read_dataset, row_of
from sweep.report.figures import house_style, new_figure
from sweep.report.quantities import number, quantity, rpm
from sweep.report.tables import limit_states, parameter_rows, value_of

if TYPE_CHECKING:
    from matplotlib.axes import Axes


A3 = (16.54, 11.69)  # inches, landscape
VIEWS_HIGH, HEAD_HIGH, LINE_HIGH = 5.7, 0.5, 0.22  # inches, of the views, and of title and lines in a row of tables
LINES = 24  # lines of a table before it continues in the next one
WIDTHS = ((1.5, 1.1, 1.0), (1.0, 1.0))  # shares of the width for the tables of the first row and of the rows below
POSES = 180  # poses of the joints' paths
WORDS = {"xy": "front", "zy": "side, from the left", "xz": "top"}
LETTERS, PAD, LEAST = 23.0, 1.0, 12.0  # letters per inch, in a cell's margin, in the last column
DIGITS = 6  # significant digits of coordinates: a micrometre in half a metre
ZERO = 1e-9  # mm: smaller coordinates are rounding of zero
ENDINGS = (".pdf", ".svg", ".dxf")


class SheetTable(NamedTuple):
    """A table of the sheet: title, column headings and lines."""

    title: str
    heads: tuple[str, ...]
    lines: tuple[tuple[str, ...], ...]


def write_sheet(folder: str | Path, design: str | int | None, path: str | Path, phi: float = 0.0) -> Path:
    """Write a sheet about a design of a dataset.

    Parameters
    ----------
    folder, design : as of `sweep export`
    path : a file ending in .pdf, .svg or .dxf; in a .dxf the tables are below the views
    phi : crank angle of the drawn position and of the hardpoints [rad]

    Raises
    ------
    InputError
        for another ending, or a mechanism without known joints.
    StoreError
        if the file cannot be written.
    """
    target = Path(path)
    if target.suffix.lower() not in ENDINGS:
        raise InputError("path", target.name, f"a file ending in {', '.join(ENDINGS)}", "export")
    data, drawn = read_dataset(Path(folder)), chosen(folder, design)
    parts = over(drawn.family, drawn.design, finite(phi), POSES)
    if not exists(parts):
        raise InputError("mechanism", drawn.family.name, "one whose joints are known, docs/frames.md", "export")
    tables = tables_of(as_result(data, row_of(data.study, drawn.design)), pose(drawn.family, drawn.design, phi))
    with unwritable(target):
        if target.suffix.lower() == ".dxf":
            export(drawn.family, drawn.design, target, "dxf", phi=phi, angles="rad")
            add_tables(target, tables)
        else:
            _draw(data, parts, tables, target)
    return target


def tables_of(data: Dataset, parts: Sequence[Part]) -> list[SheetTable]:
    """Return dimensions with tolerances, hardpoints of one position, limits, cyclogram, and inputs of effects."""
    study, tolerance = data.study, data.study.tolerance
    names = study.family.parameter_names
    design = np.array([value_of(data.result, name) for name in names])
    tolerances = np.zeros(len(names)) if tolerance is None else tolerances_of(study.family, design, tolerance)
    tolerance_of = dict(zip(names, tolerances.tolist(), strict=True))
    units = {p.name: p.unit for p in study.family.parameters}
    mechanism_names = study.bare.parameter_names
    lines: list[tuple[str, ...]] = []
    others: list[tuple[str, ...]] = []
    for row in parameter_rows(data):
        shown = quantity(row.name, {"length": "mm", "angle": "rad"}.get(units[row.name], "1"))
        give = tolerance_of[row.name]
        member = row.name.rpartition(".")[0]
        text = row.text.removeprefix(f"{member}: ")
        line = (row.name, row.value, f"± {shown.show(give, 3)}" if give else "", text)
        (lines if row.name in mechanism_names else others).append(line)
    heads = ("name", "value", "tolerance", "")
    joints = tuple(
        (
            " ".join(filter(None, [part.member, f"{shown_name(name)}{part.stage}"])),
            *(number(0.0 if abs(x) < ZERO else x, DIGITS) for x in path[0].tolist()),
        )
        for part in parts
        for name, path in part.joints.items()
    )
    limits = tuple((x.shown.symbol, x.bound, x.value, x.state) for x in limit_states(data))
    tables = [
        SheetTable("Dimensions", heads, tuple(lines)),
        SheetTable("Hardpoints [mm]", ("joint", "x", "y", "z"), joints),
        SheetTable("Limits", ("limit", "required", "design", ""), limits),
        *_cyclogram(data),
        *([SheetTable("Bodies, loads and scene", heads, tuple(others))] if others else []),
    ]
    return [t._replace(lines=tuple(tuple(x.replace("\u00a0", " ") for x in line) for line in t.lines)) for t in tables]


def _cyclogram(data: Dataset) -> list[SheetTable]:
    turn = cyclogram_of(data)
    if turn is None:
        return []
    events: Iterable[tuple[str, str, str, float, float, float]] = turn.itertuples(index=False, name=None)
    lines = [
        (f"{member} {name}".strip(), kind, f"{number(start, 4)}°", "" if kind == "event" else f"{number(end, 4)}°")
        for member, kind, name, start, end, _ in events
    ]
    return [SheetTable("Cyclogram, by the angle of the main shaft", ("what", "", "from", "to"), tuple(lines))]


def _draw(data: Dataset, parts: Sequence[Part], tables: Sequence[SheetTable], target: Path) -> None:
    frames = frames_of(parts)
    panels = [(frame, view) for frame, same in frames.items() for view in (WORDS if is_spatial(same) else ("xy",))]
    rows = _rows(tables)
    lines = [max(len(table.lines) for table in row) + 1 for row in rows]  # with the headings
    heights = [VIEWS_HIGH, *(HEAD_HIGH + LINE_HIGH * count for count in lines)]
    with house_style():
        figure = new_figure(A3[0], sum(heights))
        above, *below = np.asarray(figure.subfigures(len(heights), 1, height_ratios=heights)).ravel().tolist()
        for axes, (frame, view) in zip(above.subplots(1, len(panels), squeeze=False)[0], panels, strict=True):
            draw(axes, frames[frame], view, "mm", 1)
            labels = ", ".join(part.label for part in frames[frame])
            axes.set_title(WORDS[view] if len(frames) == 1 else f"{labels}: {WORDS[view]}")
        for k, (place, row) in enumerate(zip(below, rows, strict=True)):
            widths = WIDTHS[min(k, 1)]
            for axes, table in itertools.zip_longest(place.subplots(1, len(widths), width_ratios=widths), row):
                _set(axes, table, lines[k])
        speed = f", {rpm(data.study.speed)}" if data.study.speed is not None else ""
        figure.suptitle(f"{data.study.title or data.study.name}{speed}. Lengths in mm, angles in degrees.")
        separate_names(figure)
        form = target.suffix[1:].lower()
        # Without the date files of the same data are equal.
        figure.savefig(target, format=form, metadata={"CreationDate" if form == "pdf" else "Date": None})


def _rows(tables: Sequence[SheetTable]) -> list[list[SheetTable]]:
    """Lay out tables in rows: the beginnings of the first ones in the first row, then all the rest."""
    blocks = [
        table._replace(title=table.title + ", continued" * (k > 0), lines=table.lines[k : k + LINES])
        for table in tables
        for k in range(0, max(1, len(table.lines)), LINES)
    ]
    first = [next(x for x in blocks if x.title == table.title) for table in tables[: len(WIDTHS[0])]]
    rest, wide = [x for x in blocks if x not in first], len(WIDTHS[1])
    return [first, *(rest[k : k + wide] for k in range(0, len(rest), wide))]


def _set(axes: Axes, table: SheetTable | None, most: int) -> None:
    """Draw a table with the line height of all tables; ``most`` lines fill the axes."""
    from matplotlib.transforms import Bbox

    axes.set_axis_off()
    if table is None:
        return
    axes.set_title(table.title, loc="left", fontweight="bold")
    if not table.lines:
        axes.text(0.0, 1.0, "none", va="top")
        return
    high, wide = (len(table.lines) + 1) / most, axes.get_window_extent().width / axes.figure.dpi * LETTERS
    lines, widths = _fitted(table, wide)
    drawn = axes.table(
        lines, colLabels=list(table.heads), cellLoc="left", colLoc="left", colWidths=widths,
        edges="horizontal", bbox=Bbox.from_bounds(0.0, 1.0 - high, 1.0, high),
    )  # fmt: skip
    drawn.auto_set_font_size(False)
    drawn.set_fontsize(7.5)
    for cell in drawn.get_celld().values():
        cell.PAD = PAD / wide
        cell.set_linewidth(0.3)


def _fitted(table: SheetTable, wide: float) -> tuple[list[list[str]], list[float]]:
    """Return lines of a table and shares of its columns, by their longest words; the last column is cut to fit."""
    rows = [table.heads, *table.lines]
    longest = [max(len(row[k]) for row in rows) + 2 * PAD for k in range(len(table.heads))]
    rest = max(wide - sum(longest[:-1]), min(longest[-1], LEAST))
    most = int(rest - 2 * PAD)
    lines = [[*line[:-1], shorten(line[-1], most, placeholder=" …")] for line in table.lines]
    return lines, [x / (sum(longest[:-1]) + rest) for x in (*longest[:-1], rest)]
