"""The report's pages: figures, tables and sentences of a dataset in a template, and several results side by side."""

from __future__ import annotations

import shutil
from collections.abc import Mapping, Sequence
from dataclasses import replace
from datetime import date
from pathlib import Path
from typing import Any

from markupsafe import Markup

from kernels import status as codes
from sweep.dataset.chunk_files import ROWS_PER_BATCH, batches
from sweep.dataset.files import OF_OPTIMUM, PARETO, beside, located, replacing, unwritable
from sweep.errors import InputError
from sweep.evaluation.statuses import meaning
from sweep.jobs.progress import Say, unsaid
from sweep.optimise.manufacture.sample import COST_SAMPLE, TELLING_GAIN
from sweep.pages import rendered
from sweep.report import answer, tables
from sweep.report.dataset import Dataset, Row, as_result, chosen, cyclogram_of, read_dataset, read_rows, row_of
from sweep.report.figures import data_uri, design_map, house_style, save, trade_off
from sweep.report.front import Front, is_missed, search_state
from sweep.report.live import embedded, live, moving, scripts_of
from sweep.report.made import (
    event_bands,
    made,
    made_sentence,
    share_made,
    slopes,
    spreads,
    tolerance_words,
    with_bands,
)
from sweep.report.optima import CARDS, Shown, groups, optima, optima_sentence
from sweep.report.quantities import number, rpm
from sweep.report.scan import Cells, Scan, most_telling
from sweep.report.sewing import diagram_of_dataset, sewn, threads_figure
from sweep.report.sketch import bars, dimensioned, drawn_parts, sketch
from sweep.study import Study

COMPARISON = "comparison.html"
STEPS = 4  # steps of a report: rows, figures, optima and yield, page
MOST_VALUES = 9  # dimensions shown in the sketch with their values; with more only the names


def write_report(folder: str | Path, out: str | Path | None = None, say: Say = unsaid) -> Path:
    """Write the report of a dataset.

    Parameters
    ----------
    folder : complete dataset that ``sweep.run`` has written
    out : output folder; by default beside the chunks, ``results/<name>`` for ``results/<name>/designs``
    say : called with the number of finished steps of the report

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
    folder = located(folder)
    out = beside(folder) if out is None else Path(out)
    data = read_dataset(folder)  # a folder without a dataset is refused before any progress is shown
    say("report", 0, STEPS, "steps")
    data, scanned, cells = read_rows(data)
    several = groups(data)
    with unwritable(f"report {out}"):
        out.mkdir(parents=True, exist_ok=True)
        say("report", 1, STEPS, "steps")
        figures = draw(data, scanned, cells, out / "figures")
        say("report", 2, STEPS, "steps")
        as_made = _as_made(data)
        events = event_bands(data)
        strokes = _cyclogram(data, events, out)
        say("report", 3, STEPS, "steps")
        copy_tables(folder, out)
        write_survivors(data.parts, out / "survivors.parquet")
        figures |= _threads(data, out)
        stitch = sewn(data)
        further = (stitch.sentence if stitch else "", optima_sentence(data, several), as_made["made_words"])
        text = rendered(
            "report.html",
            study=data.study,
            data=data,
            title=data.study.title or data.study.name,
            sketch=answer_sketch(data),
            figures=figures,
            own_figures=own_figures(data.study, out / "figures"),
            sentences=answer.answer(data, scanned, further),
            searched=answer.searched(data, scanned),
            limits=tables.limit_states(data),
            outputs=tables.output_rows(data),
            parameters=tables.parameter_rows(data),
            bars=bars(data),
            fates=tables.fates(data),
            errors=tables.error_rows(data, scanned),
            provenance=tables.provenance(data),
            front=Front.of(data),
            is_missed=is_missed,
            search_state=search_state,
            optima=optima(data, several),
            optima_left=max(len(several) - CARDS, 0),
            sewn=stitch,
            cyclogram=strokes,
            events=events,
            number=number,
            pair=most_telling(scanned) or (cells[0].name,) if cells else (),
            axes=len(cells),
            speed=rpm(data.study.speed),
            today=date.today().isoformat(),
            **as_made,
            **live(data, cells, several),
        )
        with replacing(out / "report.html") as partial:
            partial.write_bytes(text.encode())
        say("report", STEPS, STEPS, "steps")
    return out / "report.html"


def _as_made(data: Dataset) -> dict[str, Any]:
    """Return the template's variables about manufactured mechanisms of the optimum."""
    result, within = made(data), tolerance_words(data)
    return {
        "made": result, "made_words": made_sentence(result, within), "tolerance": within, "spreads": spreads(data),
        "costs": [x for x in result.costs if max(x.spread, x.gain) >= TELLING_GAIN] if result else [],
        "share_made": share_made(data), "slopes": slopes(data), "single": COST_SAMPLE,
    }  # fmt: skip


def _threads(data: Dataset, out: Path) -> dict[str, str]:
    """Write and draw the diagram of a machine's threads; empty without threads."""
    turn = diagram_of_dataset(data)
    if turn is None:
        return {}
    turn.to_csv(out / "threads.csv", index=False, float_format="%.6g")
    with house_style():
        return {"threads": data_uri(save(threads_figure(turn), out / "figures" / "threads.svg"))}


def draw(data: Dataset, scanned: Scan, cells: list[Cells], folder: Path) -> dict[str, str]:
    """Save the available figures of the design space and return them as data URIs, by names of the template."""
    if not (len(cells) and scanned.feasible) and data.front is None:
        return {}
    with house_style():
        drawn = {"map": design_map(data, scanned, cells), "trade-off": trade_off(data, scanned)}
        return {
            name.replace("-", "_"): data_uri(save(figure, folder / f"{name}.svg"))
            for name, figure in drawn.items()
            if figure is not None
        }


def answer_sketch(data: Dataset) -> Markup | None:
    """Draw the result with its dimensions; None if the study wants no curves, or there are no joints."""
    row = data.result
    placed = [] if row is None or data.study.output.curves == "none" else drawn_parts(data.study.family, row)
    if row is None or not placed:
        return None
    ends = dimensioned(data.study.family, row, placed)
    rows = tables.parameter_rows(data, digits=5)
    free = [r for r in rows if r.space != "fixed"] or rows
    shown = {r.name: r.value for r in free if r.name in ends}
    words = {k if len(shown) > MOST_VALUES else f"{k} = {value}": ends[k] for k, value in shown.items()}
    return sketch(placed, f"{data.result_name} with its dimensions", words)


def _cyclogram(data: Dataset, events: Mapping[str, tuple[float, float]], out: Path) -> list[tuple[Any, ...]]:
    """Write and return the cyclogram of a machine's result; empty for any other mechanism.

    The file also has the intervals of the ``events`` of manufactured mechanisms.
    """
    rows = cyclogram_of(data)
    if rows is None:
        return []
    with_bands(rows, events).to_csv(out / "cyclogram.csv", index=False, float_format="%.4f")
    return list(rows.itertuples(index=False, name=None))


def own_figures(study: Study, folder: Path) -> list[dict[str, Any]]:
    """Return the figures that ``[report] figures`` names; ``uri`` is None for one that has not been drawn."""
    figures = []
    for entry in study.data.get("report", {}).get("figures", []):
        path = folder / entry["file"]
        figures.append({**entry, "uri": data_uri(path) if path.exists() else None})
    return figures


def copy_tables(folder: Path, out: Path) -> None:
    """Copy the optimum with its tables, and the front, if the study has them."""
    for name in (*OF_OPTIMUM, PARETO):
        source, target = beside(folder) / name, out / name.removeprefix("_")
        if source.exists():
            shutil.copyfile(source, target)
        else:
            target.unlink(missing_ok=True)  # written by an earlier report on another version of the study


def write_survivors(parts: Sequence[Path], target: Path) -> None:
    """Write the designs within all limits, in the order of the sweep, with the units and definitions of the parts."""
    import pyarrow as pa
    import pyarrow.compute as pc
    import pyarrow.parquet as pq

    if not parts:
        return
    schema = pq.read_schema(parts[0])
    with replacing(target) as partial, pq.ParquetWriter(partial, schema, compression="zstd") as writer:
        kept: list[pa.RecordBatch] = []
        for batch in batches(parts):
            kept.append(batch.filter(pc.equal(batch["status"], 0)))
            if sum(map(len, kept)) >= ROWS_PER_BATCH:  # a row group for each small chunk would take twice as long
                writer.write_table(pa.Table.from_batches(kept, schema))
                kept = []
        writer.write_table(pa.Table.from_batches(kept, schema))


def judged(data: Dataset, rows: Sequence[Row], names: Sequence[str]) -> dict[str, Any]:
    """Return the page's data of designs by name: the current one first, then those compared with it."""
    results = [replace(as_result(data, row), computed_reference=rows[0]) for row in rows]
    roles = ["result", *(f"pin pin-{k}" for k in range(1, len(rows)))]
    shown = [Shown(name, role, status_words(row), row) for name, role, row in zip(names, roles, rows, strict=True)]
    outputs, limits = [tables.output_rows(one) for one in results], [tables.limit_states(one) for one in results]
    motion = moving(data, shown)
    return {
        "status": [status_words(row) for row in rows],
        "motion": motion and motion | {"ghosts": list(range(1, len(rows)))},
        "outputs": [
            {"name": same[0].name, "symbol": same[0].symbol, "text": same[0].text,
             "values": [one.value for one in same], "fast": [one.fast for one in same],
             "changes": ["", *(one.change for one in same[1:])]}
            for same in zip(*outputs, strict=True)
        ],
        "limits": [
            {"name": same[0].shown.name, "symbol": same[0].shown.symbol, "bound": same[0].bound,
             "values": [one.value for one in same], "states": [one.state for one in same],
             "slack": [one.slack for one in same]}
            for same in zip(*limits, strict=True)
        ],
    }  # fmt: skip


def status_words(row: Row) -> str:
    """Return the reason why a design has no values; empty if it has them."""
    code = int(row.get("status", codes.OK))
    return "" if code == codes.OK else meaning(code)


def write_comparison(folders: Sequence[Path], out: Path) -> Path:
    """Write a page with the results of several datasets side by side, all evaluated by the study of the first.

    Raises
    ------
    InputError
        for datasets of other mechanisms, or without a result.
    StoreError
        if the page cannot be written.
    """
    data = read_dataset(folders[0])
    names = _names([read_dataset(folder).study.name for folder in folders], folders)
    designs = [chosen(folder) for folder in folders]
    # Mechanisms of one kind have parameters of the same names and meanings: a slider-crank has the names of rssr.
    meanings = {parameter.name: parameter.text for parameter in data.study.bare.parameters}
    parameters = tuple(meanings)
    for folder, entry in zip(folders, designs, strict=True):
        if not meanings.items() <= {p.name: p.text for p in entry.family.parameters}.items():
            allowed = f"a dataset of the mechanism of {folders[0]}, with the parameters {', '.join(parameters)}"
            raise InputError("folder", str(folder), allowed, "report")
    first = designs[0].design
    rows = [row_of(data.study, first | {name: entry.design[name] for name in parameters}) for entry in designs]
    compared = judged(data, rows, names)
    lines = zip(*(tables.parameter_rows(as_result(data, row)) for row in rows), strict=True)
    dimensions = [(same[0].name, same[0].text, [row.value for row in same]) for same in lines]
    text = rendered(
        COMPARISON,
        names=names,
        folders=[str(folder) for folder in folders],
        study=data.study,
        dimensions=sorted(dimensions, key=lambda line: len(set(line[2])) == 1),
        motion_data=embedded(compared["motion"]) if compared["motion"] else "",
        axis=compared["motion"]["axis"] if compared["motion"] else "",
        scripts=scripts_of(compared["motion"]),
        **{key: compared[key] for key in ("outputs", "limits", "status")},
    )
    with unwritable(f"report {out}"):
        out.mkdir(parents=True, exist_ok=True)
    with replacing(out / COMPARISON) as partial:
        partial.write_bytes(text.encode())
    return out / COMPARISON


def _names(studies: Sequence[str], folders: Sequence[Path]) -> list[str]:
    """Name results by their studies, or by their folders if study names coincide."""
    if len({*studies}) == len(studies):
        return list(studies)
    return [str(folder.parent.name if folder.name == "designs" else folder.name) for folder in folders]
