"""One sheet of a design for the shop: views, dimensions with tolerances, hardpoints, limits; as PDF, SVG or DXF."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from sweep.errors import InputError, StoreError
from sweep.exchange.dxf import add_tables
from sweep.exchange.export import export
from sweep.exchange.scene import exists, frames_of, is_spatial, over, pose, shown_name
from sweep.plot.drawing import draw
from sweep.report.dataset import Dataset, chosen, read_dataset, row_of
from sweep.report.figures import house_style, new_figure
from sweep.report.judged import as_result
from sweep.report.quantities import number, quantity, rpm
from sweep.report.tables import limit_states, parameter_rows

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from sweep.evaluation.joints import Part

A3 = (16.54, 11.69)  # inches, lying
POSES = 180  # of the paths of joints
WORDS = {"xy": "front", "zy": "side", "xz": "top"}
DIGITS = 6  # of coordinates: a micrometre in half a metre
ENDINGS = (".pdf", ".svg", ".dxf")


class Table(NamedTuple):
    """A table of the sheet: its title, the heads of its columns, and its lines."""

    title: str
    heads: tuple[str, ...]
    lines: tuple[tuple[str, ...], ...]


def write_sheet(folder: str | Path, design: str | int | None, path: str | Path, phi: float = 0.0) -> Path:
    """Write a sheet about a design of a dataset.

    Parameters
    ----------
    folder, design : as of `sweep export`
    path : a file ending in .pdf, .svg or .dxf; of the latter the tables stand below the views
    phi : crank angle of the drawn position and of the hardpoints [rad]

    Raises
    ------
    InputError
        for another ending, or a mechanism whose joints are not known.
    StoreError
        if the file cannot be written.
    """
    target = Path(path)
    if target.suffix.lower() not in ENDINGS:
        raise InputError("path", target.name, f"a file ending in {', '.join(ENDINGS)}", "export")
    data, found = read_dataset(Path(folder)), chosen(folder, design)
    parts = over(found.family, found.design, phi, POSES)
    if not exists(parts):
        raise InputError("mechanism", found.family.name, "one whose joints are known, docs/frames.md", "export")
    tables = tables_of(as_result(data, row_of(data.study, found.design)), pose(found.family, found.design, phi))
    try:
        if target.suffix.lower() == ".dxf":
            export(found.family, found.design, target, "dxf", phi=phi, angles="rad")
            add_tables(target, tables)
        else:
            _draw(data, parts, tables, target)
    except OSError as error:
        raise StoreError(f"{target}: cannot be written: {error}") from error
    return target


def tables_of(data: Dataset, parts: Sequence[Part]) -> list[Table]:
    """Return dimensions with tolerances, hardpoints of one position, and limits of the result of ``data``."""
    study, tolerance = data.study, data.study.tolerance
    spread = {} if tolerance is None else {"length": tolerance.lengths, "angle": tolerance.angles}
    units = {p.name: p.unit for p in study.family.parameters}
    lines = []
    for row in parameter_rows(data):
        shown = quantity(row.name, {"length": "mm", "angle": "rad"}.get(units[row.name], "1"))
        give = spread.get(units[row.name], 0.0)
        lines.append((row.name, row.value, f"± {shown.show(give, 3)}" if give else "", row.text))
    dimensions = Table("Dimensions", ("name", "value", "tolerance", ""), tuple(lines))
    joints = tuple(
        (_joint(part, name), *(number(_zero(x), DIGITS) for x in path[0].tolist()))
        for part in parts
        for name, path in part.joints.items()
    )
    limits = tuple((x.shown.symbol, x.bound, x.value, x.state) for x in limit_states(data))
    found = (
        dimensions,
        Table("Hardpoints [mm]", ("joint", "x", "y", "z"), joints),
        Table("Limits", ("limit", "required", "design", ""), limits),
    )
    return [t._replace(lines=tuple(tuple(x.replace("\u00a0", " ") for x in line) for line in t.lines)) for t in found]


def _joint(part: Part, name: str) -> str:
    return " ".join(filter(None, [part.member, f"{shown_name(name)}{part.stage}"]))


def _zero(x: float) -> float:
    return 0.0 if abs(x) < 1e-9 else x  # mm: the rounding of zero


def _draw(data: Dataset, parts: Sequence[Part], tables: Sequence[Table], target: Path) -> None:
    frames = frames_of(parts)
    panels = [(frame, view) for frame, same in frames.items() for view in (_views(same))]
    with house_style():
        figure = new_figure(*A3)
        above, below = np.asarray(figure.subfigures(2, 1, height_ratios=[1.0, 1.05])).ravel().tolist()
        for axes, (frame, view) in zip(above.subplots(1, len(panels), squeeze=False)[0], panels, strict=True):
            draw(axes, frames[frame], view, "mm", 1)
            axes.set_title(f"{', '.join(part.label for part in frames[frame])}: {WORDS[view]}")
        widths = [1.5, 1.1, 1.0]
        for axes, table in zip(below.subplots(1, 3, width_ratios=widths), tables, strict=True):
            _set(axes, table)
        speed = f", {rpm(data.study.speed)}" if data.study.speed is not None else ""
        figure.suptitle(f"{data.study.title or data.study.name}{speed}. Lengths in mm, angles in degrees.")
        figure.savefig(target, format=target.suffix[1:].lower(), metadata=_no_date(target))


def _views(parts: Sequence[Part]) -> tuple[str, ...]:
    return ("xy", "zy", "xz") if is_spatial(parts) else ("xy",)


def _no_date(target: Path) -> dict[str, None]:
    """Leave out what would make two files of the same data differ."""
    return {"CreationDate": None} if target.suffix.lower() == ".pdf" else {"Date": None}


def _set(axes: Axes, table: Table) -> None:
    """Set a table, its lines as high as there is room for all of them."""
    from matplotlib.transforms import Bbox

    axes.set_axis_off()
    axes.set_title(table.title, loc="left", fontweight="bold")
    if not table.lines:
        axes.text(0.0, 1.0, "none", va="top")
        return
    rows = len(table.lines) + 1
    high = min(1.0, 0.045 * rows)
    found = axes.table(
        [list(line) for line in table.lines], colLabels=list(table.heads), cellLoc="left", colLoc="left",
        edges="horizontal", bbox=Bbox.from_bounds(0.0, 1.0 - high, 1.0, high),
    )  # fmt: skip
    found.auto_set_font_size(False)
    found.set_fontsize(7.5 * min(1.0, 24 / rows))
    found.auto_set_column_width(list(range(len(table.heads))))
    for cell in found.get_celld().values():
        cell.set_linewidth(0.3)
