"""The verb ``report``."""

from __future__ import annotations

from pathlib import Path

import click

from sweep.cli.options import FOLDER
from sweep.dataset.files import beside, located
from sweep.jobs.progress import Phases
from sweep.report.judged import write_comparison
from sweep.report.page import write_report


@click.command()
@FOLDER
@click.argument("others", nargs=-1, type=click.Path(exists=True, file_okay=False, path_type=Path))
@click.option("--out", type=click.Path(file_okay=False, path_type=Path), help="Default: beside the chunks.")
def report(folder: Path, others: tuple[Path, ...], out: Path | None) -> None:
    """Write report.html, figures and tables about a dataset.

    report.html holds everything in one file and needs no network.  Beside it: figures/, optimum.parquet and
    curves.parquet (if the study optimises), pareto.parquet (if it asks for a front) and survivors.parquet, the designs
    within all limits.

    With OTHERS, folders of the same mechanism, comparison.html instead: all results side by side, dimensions, outputs,
    limits, curves and motion, judged by the study of FOLDER.
    """
    if others:
        click.echo(f"report: {write_comparison([folder, *others], out or beside(located(folder)))}")
        return
    with Phases(show=True) as phases:
        written = write_report(folder, out, phases.say)
    click.echo(f"report: {written}")
