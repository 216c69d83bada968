"""The page: gathers figures, tables and sentences and sets them with the template."""

from __future__ import annotations

import shutil
from collections.abc import Sequence
from dataclasses import dataclass
from datetime import date
from pathlib import Path
from typing import TYPE_CHECKING, Any

from sweep.dataset.files import beside, is_older, located
from sweep.errors import StoreError
from sweep.jobs.progress import Say, unsaid
from sweep.report import answer, front, maps, mechanisms, robust, tables
from sweep.report.curves import motion, motion_caption
from sweep.report.cyclogram import cyclogram_figure, of_dataset, table_in_degrees
from sweep.report.dataset import Dataset, gather
from sweep.report.figures import TEMPLATES, Saved, drawn_before, house_style, save
from sweep.report.live import live
from sweep.report.made import COSTS, TELLING, histogram_figure, made, made_sentence
from sweep.report.optima import CARDS, Group, groups, optima, optima_sentence
from sweep.report.robust import tolerance_words
from sweep.report.scan import Cells, Scan, most_telling
from sweep.report.sewing import sewn, sewn_figure

if TYPE_CHECKING:
    from sweep.evaluation.joints import Part
    from sweep.study import Study


STEPS = 4  # of a report: rows, figures, optima and yield, page


def write_report(folder: str | Path, out: str | Path | None = None, say: Say = unsaid) -> Path:
    """Write the report of a dataset.

    Parameters
    ----------
    folder : dataset that ``sweep.run`` left behind, complete
    out : where to write; default beside the chunks, ``results/<name>`` for ``results/<name>/designs``
    say : called with how many of the report's steps are done

    Returns
    -------
    Path
        of ``report.html``.  Beside it: ``figures/*.svg``, ``survivors.parquet`` (the designs within all limits) and,
        if the study optimises, the tables the optimiser left (``optimum.parquet``, ``curves.parquet`` ...).

    Raises
    ------
    InputError
        if the folder is no complete dataset.
    StoreError
        if the report cannot be written.
    """
    place = located(folder)
    return _write(place, _default(place) if out is None else Path(out), say)


def _write(folder: Path, out: Path, say: Say) -> Path:
    """Write everything the report consists of into ``out``."""
    say("report", 0, STEPS, "steps")
    data, found, cells = gather(folder)
    several, parts = groups(data), mechanisms.drawn_parts(data)
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
        if (rows := of_dataset(data)) is not None:
            table_in_degrees(rows).to_csv(out / "cyclogram.csv", index=False, float_format="%.4f")
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
                more | live(data, cells, several) | {"mechanism": mechanisms.mechanism_caption(parts)},
            ),
            encoding="utf-8",
        )
        partial.replace(target)
    except OSError as error:
        raise StoreError(f"report {out}: cannot be written: {error}") from error
    return target


def draw(
    data: Dataset, found: Scan, cells: list[Cells], parts: dict[str, list[Part]], folder: Path
) -> dict[str, Saved]:
    """Every figure the data allow, saved; keys are the names the template knows."""
    made = {
        "map": maps.design_map(data, found, cells),
        "trade_off": maps.trade_off(data, found),
        "motion": motion(data),
        "mechanism": mechanisms.mechanism(parts),
        "cyclogram": None if (rows := of_dataset(data)) is None else cyclogram_figure(rows),
        "tolerance": robust.tolerance(data),
        "sensitivity": robust.sensitivity(data),
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
    """Pictures that ``[report] figures`` names, as far as they lie in the folder."""
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
        searched=answer.search_sentence(data, found),
        limits=tables.limit_states(data),
        outputs=tables.output_rows(data),
        parameters=tables.parameter_rows(data),
        fates=tables.fates(data, found),
        errors=tables.error_rows(data, found),
        provenance=tables.provenance(data),
        front=front.front_rows(data),
        front_names=front.front_names(data),
        front_note=front.front_note(data),
        tolerances=robust.tolerance_rows(data),
        tolerance=tolerance_words(data),
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


def copy_tables(folder: Path, out: Path) -> None:
    """Copy the optimum with its curves, sensitivities and tolerances, and the front, where the study has them."""
    for name in ("optimum.parquet", "curves.parquet", "sensitivity.parquet", "tolerance.parquet", "pareto.parquet"):
        source, target = beside(folder) / f"_{name}", out / name
        if source.exists():
            shutil.copyfile(source, target)
        else:
            target.unlink(missing_ok=True)  # of an earlier report on another version of the study


def write_survivors(parts: Sequence[Path], target: Path) -> None:
    """Write the designs within all limits, in the order of the sweep, with the parts' units and definitions."""
    import pyarrow.compute as pc
    import pyarrow.parquet as pq

    if not parts:
        return
    schema = pq.read_schema(parts[0])
    partial = target.with_name(f"_tmp-{target.name}")
    with pq.ParquetWriter(partial, schema, compression="zstd") as writer:
        for part in parts:
            with pq.ParquetFile(part) as source:
                for batch in source.iter_batches():
                    writer.write_batch(batch.filter(pc.equal(batch["status"], 0)).cast(schema))
    partial.replace(target)


def buildable(data: Dataset, several: list[Group], folder: Path) -> dict[str, Any]:
    """Names of the template with what they stand for; pictures are saved in ``folder``, in the style in force."""
    make, within, sews = made(data), tolerance_words(data), sewn(data)
    costs = (
        ()
        if make is None
        else tuple(cost for cost in make.costs if cost.spread >= TELLING or cost.gain >= TELLING)[:COSTS]
    )
    return {
        "optima": optima(data, several, folder),
        "optima_left": max(len(several) - CARDS, 0),
        "made": make,
        "made_words": made_sentence(make, within),
        "made_histogram": "" if make is None else save(histogram_figure(make.histogram), folder / "yield.svg").uri,
        "made_costs": costs,
        "sewn": sews,
        "sewn_curve": "" if sews is None else save(sewn_figure(sews), folder / "sewing.svg").uri,
        "further": [text for text in (optima_sentence(data, several), made_sentence(make, within)) if text],
    }


def _default(folder: Path) -> Path:
    return folder / "_report" if is_older(folder) else beside(folder)
