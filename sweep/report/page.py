"""The page: gathers figures, tables and sentences and sets them with the template."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from datetime import date
from pathlib import Path
from typing import TYPE_CHECKING, Any

from kernels import status as codes
from sweep.errors import StoreError
from sweep.jobs.progress import Say, unsaid
from sweep.report import answer, front, limits, pictures, robust, tables
from sweep.report.curves import motion_caption
from sweep.report.dataset import Dataset, read_dataset
from sweep.report.figures import TEMPLATES, Saved, drawn_before, house_style, save
from sweep.report.files import copy_tables, write_survivors
from sweep.report.groups import groups
from sweep.report.live import live
from sweep.report.mechanisms import mechanism_caption
from sweep.report.scan import Cells, Scan, most_telling, scan
from sweep.report.sections import buildable
from sweep.report.turns import curves, reference_row

if TYPE_CHECKING:
    from sweep.evaluation.joints import Part
    from sweep.study import Study

CELLS_OF_PAIR, CELLS_OF_MANY = 240, 32
STEPS = 4  # of a report: rows, figures, optima and yield, page
DESIGNS_PER_CELL = 3.0


def write(folder: Path, out: Path, say: Say = unsaid) -> Path:
    """Write everything the report consists of into ``out`` and return the path of ``report.html``."""
    say("report", 0, STEPS, "steps")
    data, found, cells = gather(folder)
    several, parts = groups(data), pictures.drawn_parts(data)
    try:
        out.mkdir(parents=True, exist_ok=True)
        with house_style():
            say("report", 1, STEPS, "steps")
            figures = draw(data, found, cells, parts, out / "figures")
            say("report", 2, STEPS, "steps")
            more = buildable(data, several, out / "figures")
        say("report", 3, STEPS, "steps")
        copy_tables(folder, out)
        write_survivors(data.parts, out / "survivors.parquet")
        target = out / "report.html"
        partial = out / "_tmp-report.html"
        own = own_figures(data.study, out / "figures")
        partial.write_text(
            render(
                data,
                found,
                cells,
                figures,
                own,
                more | live(data, cells, several) | {"mechanism": mechanism_caption(parts)},
            ),
            encoding="utf-8",
        )
        partial.replace(target)
    except OSError as error:
        raise StoreError(f"report {out}: cannot be written: {error}") from error
    return target


def gather(folder: Path) -> tuple[Dataset, Scan, list[Cells]]:
    """Read a dataset, go once through its rows, and compute what an optimiser would have left."""
    data = read_dataset(folder)
    cells = divided_axes(data.study, data.counts.get(codes.OK, 0))
    objective = pictures.objective_of(data.study)
    larger = data.study.pareto is not None and data.study.pareto.at_least
    found = scan(data.parts, cells, objective, data.against if objective is not None else None, larger)
    data = replace(data, best=found.best_row or None)
    if data.optima is None:
        data = replace(data, computed_reference=reference_row(data.study))
    if data.curves is None and data.study.output.curves != "none":
        data = replace(data, curves=curves(data.study, pictures.marked(data)))
    return data, found, cells


def divided_axes(study: Study, feasible: int) -> list[Cells]:
    """Return the swept axes, divided into cells: finely if a single map shows them all, else coarsely.

    Axes of a sample are divided so that a cell holds some of the ``feasible`` designs on average.  Left out are signs,
    which make no map, and what [locus] or [fit] makes.
    """
    signs = {p.name for p in study.family.parameters if p.choices is not None}
    left_out = signs.union(study.made, study.rescaled)
    swept = [axis for axis in study.space.axes if axis.varies and axis.name not in left_out]
    most = CELLS_OF_PAIR if len(swept) <= 2 else CELLS_OF_MANY
    if study.space.kind == "sobol":
        # A power of two: a Sobol sequence puts equally many points into such cells.
        sampled = 2 ** min(5, max(2, math.floor(0.5 * math.log2(max(feasible, 1) / DESIGNS_PER_CELL))))
        return [
            Cells.of_range(axis.name, axis.low, axis.high, sampled)
            if axis.values is None
            else Cells.of_values(axis.name, axis.values, most)
            for axis in swept
        ]
    return [Cells.of_values(axis.name, axis.values, most) for axis in swept if axis.values is not None]


def draw(
    data: Dataset, found: Scan, cells: list[Cells], parts: dict[str, list[Part]], folder: Path
) -> dict[str, Saved]:
    """Return every figure the data allow, saved; keys are the names the template knows."""
    made = {
        "map": pictures.design_map(data, found, cells),
        "trade_off": pictures.trade_off(data, found),
        "motion": pictures.motion(data),
        "mechanism": pictures.mechanism(parts),
        "tolerance": pictures.tolerance(data),
        "sensitivity": pictures.sensitivity(data),
    }
    files = {"trade_off": "trade-off"}
    return {
        name: save(figure, folder / f"{files.get(name, name)}.svg")
        for name, figure in made.items()
        if figure is not None
    }


@dataclass(frozen=True)
class OwnFigure:
    """A picture the study draws itself; ``uri`` is None where it has not been drawn."""

    title: str
    caption: str
    file: str
    uri: str | None


def own_figures(study: Study, folder: Path) -> list[OwnFigure]:
    """Return the pictures that ``[report] figures`` names, as far as they lie in the folder."""
    found = []
    for entry in study.data.get("report", {}).get("figures", []):
        path = folder / entry["file"]
        uri = drawn_before(path).uri if path.exists() else None
        found.append(OwnFigure(entry["title"], entry["caption"], entry["file"], uri))
    return found


def render(
    data: Dataset,
    found: Scan,
    cells: list[Cells],
    figures: dict[str, Saved],
    own: list[OwnFigure],
    more: dict[str, Any],
) -> str:
    """Return the HTML text; ``more`` are the sections about what can be built, and what moves."""
    from jinja2 import Environment, FileSystemLoader, StrictUndefined

    environment = Environment(
        loader=FileSystemLoader(TEMPLATES),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    pair = most_telling(found)
    return environment.get_template("report.html").render(
        style="".join((TEMPLATES / name).read_text(encoding="utf-8") for name in ("report.css", "optima.css")),
        study=data.study,
        data=data,
        title=data.study.title or data.study.name,
        figures=figures,
        own_figures=own,
        sentences=answer.answer(data, found, more["further"]),
        limits=limits.limit_states(data),
        outputs=tables.output_rows(data),
        parameters=tables.parameter_rows(data),
        fates=tables.fates(data, found),
        errors=tables.error_rows(data, found),
        provenance=tables.provenance(data),
        front=front.front_rows(data),
        front_names=front.front_names(data),
        front_note=front.front_note(data),
        tolerances=robust.tolerance_rows(data),
        tolerance=robust.tolerance_words(data),
        slopes=robust.slope_rows(data),
        motion=""
        if data.curves is None
        else motion_caption(data.curves, data.study.family.position, answer.rpm(data.study.speed), data.study.window),
        pair=pair or (cells[0].name,) if cells else (),
        axes=len(cells),
        speed=answer.rpm(data.study.speed),
        today=date.today().isoformat(),
        **more,
    )
