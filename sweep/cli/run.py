"""The verb ``run``."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import click

from sweep.cli.options import BACKEND, JOBS, OUT, SMOKE, STUDY
from sweep.errors import InputError, SearchCutShort, StoreError
from sweep.jobs.progress import stages


@click.command()
@STUDY
@OUT
@JOBS
@BACKEND
@click.option(
    "--accuracy", type=click.FloatRange(1e-14, 0.1),
    help="Relative error of the extrema, instead of the study's own target.",
)  # fmt: skip
@click.option("--certify", is_flag=True, help="Prove that no peak of the wanted maxima is missed.")
@SMOKE
@click.option(
    "--force",
    is_flag=True,
    help="No budget: start and go on whatever it costs; set data of another study in the folder aside.",
)
@click.option("--report", is_flag=True, help="Then draw the study's own figures (its figure.py) and write report.html.")
def run(study: Path, out: Path | None, certify: bool, smoke: bool, report: bool, **options: Any) -> None:
    """Run or resume a study.

    An interrupted run is resumed by the same command.  Finished chunks are never computed twice, and the result is the
    same, bit for bit, with any number of workers.  The answer comes last; where no design keeps all limits, it says
    which of them have to give way, and the exit code is 4.
    """
    from sweep.cli.ending import ending
    from sweep.engine.opening import is_part  # the engine takes a second to import, which --help avoids
    from sweep.engine.run import run as run_study
    from sweep.engine.searches import stages_of
    from sweep.study import load_study

    cut_short: SearchCutShort | None = None
    model = load_study(study, smoke=smoke)
    after: list[str] = []
    if report:
        from sweep.cli.report import figure_program, written  # pandas and everything that draws

        figures = figure_program(study)
        after = ["report"] if figures is None else ["figures", "report"]
    with stages(*stages_of(model), *after):
        try:
            folder = run_study(model, out, smoke=smoke, certify=certify or None, progress=True, **options)
        except SearchCutShort as error:
            cut_short, folder = error, error.folder
        if is_part(folder):  # the answer is for the whole dataset, after the parts are merged
            click.echo(f"part: {folder}")
            return
        with _read_back(folder):
            answer = ending(folder)
            for line in (*answer.lines, *([] if report else [answer.next])):
                click.echo(line)
            click.echo(f"dataset: {folder}")
            code = written(folder, None, figures) if report else 0
    if cut_short is not None:
        raise cut_short
    click.get_current_context().exit(answer.exit_code or code)


@contextmanager
def _read_back(folder: Path) -> Iterator[None]:
    """Tell what this run has just written, and finds no more, as a fault of the disk, not of the input."""
    try:
        yield
    except InputError as error:
        raise StoreError(f"{folder}: removed or changed since this run wrote it; run again") from error
