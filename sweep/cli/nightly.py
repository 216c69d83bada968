"""The verb ``nightly``: computes all studies every night."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import click

from sweep.cli.options import A_FOLDER, BACKEND, IS_THERE, JOBS
from sweep.nights import Settings
from sweep.nights import nightly as run_night
from sweep.quantities.units import one_value


@click.command()
@click.argument("studies", nargs=-1, required=True, type=IS_THERE)
@click.option(
    "--into", type=A_FOLDER, default=Path("nights"), show_default=True,
    help="Folder of the nights.",
)  # fmt: skip
@click.option("--budget", default="6h", show_default=True, help="Time for the whole night, such as 6h or 90 min.")
@click.option("--keep", type=click.IntRange(min=1), default=14, show_default=True, help="Nights that are kept.")
@JOBS
@BACKEND
@click.option("--smoke", is_flag=True, help="The tiny version of every study.")
@click.option("--on-change", metavar="CMD", help="Command to run unless the exit code is 0; the log is its input.")
def nightly(studies: tuple[Path, ...], budget: str, **settings: Any) -> None:
    """Compute all STUDIES into a dated folder, and say what changed since the last good night.

    STUDIES are study files, folders with one, or folders of such folders.  What the last night did not finish comes
    first; what has not changed is linked, not computed again.  nights/latest leads to the last night in which every
    study came to its end, nights/index.html shows all nights.

    Ends with 0 if nothing changed, 11 if rows or statuses changed, 10 if values did, 124 if the time was over, 12 if a
    study was slower twice in a row, 74 if the disk refused; with a study's own code if its run failed.
    """
    seconds = one_value(budget, "s", "--budget", "nightly")
    record = run_night(studies, Settings(budget=seconds, **settings), click.echo)
    click.get_current_context().exit(record.exit_code)
