"""The verbs that check datasets: verify, compare."""

from __future__ import annotations

from pathlib import Path

import click

from sweep.cli.options import FOLDER
from sweep.dataset.comparison import compare as compare_datasets
from sweep.dataset.verification import verify as verify_dataset


@click.command()
@FOLDER
@click.option(
    "--designs",
    type=click.IntRange(min=0),
    default=32,
    show_default=True,
    help="How many designs are computed again and compared to the bit.",
)
def verify(folder: Path, designs: int) -> None:
    """Check a dataset: every byte against its hash, every row against the plan, some designs computed again.

    Nothing is written.  Each finding says what the next `sweep run` will do about it.  Ends with 74 if something is
    damaged or wrong, else with 11 if chunks or the optimum are missing, with 0 if all is well.
    """
    found = verify_dataset(folder, designs)
    for line in found.lines():
        click.echo(line)
    click.get_current_context().exit(found.exit_code)


@click.command()
@click.argument("old", type=click.Path(exists=True, file_okay=False, path_type=Path))
@click.argument("new", type=click.Path(exists=True, file_okay=False, path_type=Path))
@click.option(
    "--rtol", type=float, default=0.0, help="Relative change of a value that counts as none; default: any bit."
)
@click.option(
    "--slower", type=float, default=1.5, show_default=True, help="How many times as long the new run may take."
)
def compare(old: Path, new: Path, rtol: float, slower: float) -> None:
    """Say what moved between two datasets of one study: values, rows, time.

    Ends with 11 if rows, a status or the pattern of missing values changed, else with 10 if values changed, else with
    12 if the new run was slower; with 0 if nothing moved.
    """
    found = compare_datasets(old, new, rtol, slower)
    for line in found.lines():
        click.echo(line)
    click.get_current_context().exit(found.exit_code)
