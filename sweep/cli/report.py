"""The verbs that show a dataset or a design: report and draw."""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import click
import pandas as pd

import sweep.plot as plot
from sweep.cli.families import family_names
from sweep.cli.options import A_FILE, A_FOLDER, ANGLES, FOLDER, IS_FILE, IS_FOLDER
from sweep.cli.tables import read_table, refuse_degrees
from sweep.dataset.files import beside, located
from sweep.errors import InputError
from sweep.evaluation.angles import AngleUnit
from sweep.evaluation.cyclogram import cyclogram, table_in_degrees
from sweep.jobs.progress import Phases
from sweep.nights.studies import FIGURE
from sweep.report.dataset import chosen, read_dataset
from sweep.report.figures import house_style, save
from sweep.report.made import event_bands, with_bands
from sweep.report.page import write_comparison, write_report


@click.command()
@FOLDER
@click.argument("others", nargs=-1, type=IS_FOLDER)
@click.option("--out", type=A_FOLDER, help="A folder; default: beside the chunks.")
def report(folder: Path, others: tuple[Path, ...], out: Path | None) -> None:
    """Write report.html, figures and tables about a dataset.

    report.html holds everything in one file and needs no network.  Beside it: figures/, optimum.parquet and
    curves.parquet (if the study optimises), pareto.parquet (if it asks for a front) and survivors.parquet, the designs
    within all limits.

    With OTHERS, folders of the same mechanism, comparison.html instead: all results side by side, dimensions, outputs,
    limits, curves and motion, judged by the study of FOLDER.
    """
    if out is not None and out.suffix == ".html":
        raise InputError("--out", out.name, "a folder, into which the page is written", "command line")
    if others:
        click.echo(f"report: {write_comparison([folder, *others], out or beside(located(folder)))}")
        return
    written(folder, out)


def figure_program(study: Path) -> Path | None:
    """Return the program in a study's folder that draws its own figures, or None if there is none."""
    program = (study if study.is_dir() else study.parent) / FIGURE
    return program if program.exists() else None


def written(folder: Path, out: Path | None, figures: Path | None = None) -> int:
    """Draw a study's own figures and write the report; return the exit code of the program that draws them."""
    code = 0
    with Phases(show=True, quiet=False) as phases:
        if figures is not None:
            phases.say("figures")
            code = subprocess.run([sys.executable, str(figures), str(beside(folder))], check=False).returncode
        page = write_report(folder, out, phases.say)
    click.echo(f"report: {page}")
    return code


OF_DATASETS = ("map", "front", "tolerance", "sensitivity")
OF_DESIGNS = ("motion", "mechanism", "polar_load", "cyclogram")
ENDINGS = (".svg", ".png", ".pdf")


@click.command()
@click.argument("what", type=click.Choice([*OF_DESIGNS, *OF_DATASETS]), metavar="WHAT")
@click.argument("source")
@click.argument("table", required=False, type=IS_FILE)
@click.option("--out", required=True, type=A_FILE, help="A .svg, .png or .pdf file; of cyclogram also a .csv table.")
@click.option(
    "--design",
    help="Design of a dataset: optimum, reference, best, or a number of the column design; for motion several, as a,b.",
)
@click.option("--row", type=click.IntRange(min=0), default=0, show_default=True, help="Row of TABLE to draw.")
@click.option("--want", help="For motion: outputs, separated by commas.")
@click.option("--phi", type=float, default=0.0, show_default=True, help="For mechanism: crank angle [rad].")
@ANGLES
@click.option("--view", help="For mechanism: space, xy, zy or xz.")
@click.option("--positions", type=click.IntRange(min=1), default=1, show_default=True, help="For mechanism: how many.")
@click.option("--output", help="For tolerance: output whose histogram is drawn; without it, all outputs in percent.")
def draw(what: str, source: str, table: Path | None, out: Path, **options: Any) -> None:
    """Draw one picture: WHAT is motion, mechanism, polar_load, cyclogram, map, front, tolerance or sensitivity.

    SOURCE is a FOLDER that `sweep run` left behind, or FAMILY with a TABLE of designs (.parquet or .csv, angles in rad
    unless --angles or a header such as `alpha [deg]` says otherwise), of which --row is drawn.  map, front, tolerance
    and sensitivity are pictures of a folder; motion, mechanism, polar_load and cyclogram of one design.
    """
    if what == "cyclogram" and out.suffix.lower() == ".csv":
        _table(source, table, out, options)
        return
    if out.suffix.lower() not in ENDINGS:
        raise InputError("--out", str(out), f"a file name ending in {' or '.join(ENDINGS)}", "command line")
    if what in OF_DATASETS:
        if table is not None or not Path(source).is_dir():
            raise InputError("SOURCE", source, f"a dataset folder for {what}", "command line")
        drawn: Any = getattr(plot, what)(source, **({"output": options["output"]} if what == "tolerance" else {}))
    else:
        drawn = _of_one(what, source, table, options)
    axes = drawn if what in ("front", "tolerance", "sensitivity", "polar_load", "cyclogram") else drawn[0]
    out.parent.mkdir(parents=True, exist_ok=True)
    with house_style():
        if out.suffix.lower() == ".svg":
            save(axes.figure, out)
        else:
            axes.figure.savefig(out)
    click.echo(f"{what}: {out}")


def _table(source: str, table: Path | None, out: Path, options: Mapping[str, Any]) -> None:
    """Write the cyclogram of one design as a table."""
    mechanism, design = _design(source, table, options["design"], options["row"])
    rows = cyclogram(mechanism, design, angles="rad" if table is None else options["angles"])
    out.parent.mkdir(parents=True, exist_ok=True)
    with_bands(table_in_degrees(rows), _made(source, table, options)).to_csv(out, index=False, float_format="%.4f")
    click.echo(f"cyclogram: {out}")


def _made(source: str, table: Path | None, options: Mapping[str, Any]) -> dict[str, tuple[float, float]]:
    """Return the intervals [deg] of manufactured mechanisms' events by name, known for the optimum of a folder."""
    if table is not None or options["design"] not in (None, "optimum"):
        return {}
    return event_bands(read_dataset(located(source)))


def _of_one(what: str, source: str, table: Path | None, options: Mapping[str, Any]) -> Any:
    """Draw one design of a folder, or of a family and a table."""
    mechanism, design = _design(source, table, options["design"], options["row"], several=what == "motion")
    keywords: dict[str, dict[str, Any]] = {
        "motion": {"want": options["want"]},
        "mechanism": {"phi": options["phi"], "view": options["view"], "positions": options["positions"]},
    }
    if table is None:
        refuse_degrees(mechanism.domain, options["phi"])
    if what == "cyclogram":
        keywords[what] = {"made": _made(source, table, options)}
    unit: AngleUnit | None = "rad" if table is None else options["angles"]
    return getattr(plot, what)(mechanism, design, angles=unit, **keywords.get(what, {}))


def _design(source: str, table: Path | None, design: str | None, row: int, several: bool = False) -> tuple[Any, Any]:
    """Return mechanism and design of a folder, or of a family's name and a row of a table.

    For ``several`` designs, names separated by commas, the design is a table with a row for each.
    """
    if table is None:
        if not Path(source).is_dir():
            raise InputError("SOURCE", source, "a dataset folder, or a family with a table of designs", "command line")
        if not several or design is None or "," not in design:
            selected = chosen(source, design)
            return selected.family, selected.design
        names = [int(name) if name.strip().isdigit() else name.strip() for name in design.split(",")]
        selection = [chosen(source, name) for name in names]
        return selection[0].family, pd.DataFrame([entry.design for entry in selection], index=names)
    designs = read_table(table)
    if row >= len(designs):
        raise InputError("--row", row, f"a row from 0 to {len(designs) - 1}", str(table))
    return family_names(source), {str(name): designs[name].iloc[row] for name in designs}
