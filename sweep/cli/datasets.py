"""The verbs about datasets: verify, compare, and for batch systems split and merge."""

from __future__ import annotations

import shlex
from pathlib import Path

import click

from sweep.cli.options import FOLDER, IS_FOLDER, OUT, SMOKE, STUDY
from sweep.dataset.comparison import compare as compare_datasets
from sweep.dataset.files import results_folder
from sweep.dataset.verification import INCOMPLETE
from sweep.dataset.verification import verify as verify_dataset
from sweep.engine.parts import merge as merge_parts
from sweep.engine.parts import split as split_study
from sweep.errors import how_many
from sweep.study import load_study


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
    result = verify_dataset(folder, designs)
    for line in result.lines():
        click.echo(line)
    click.get_current_context().exit(result.exit_code)


@click.command()
@click.argument("old", type=IS_FOLDER)
@click.argument("new", type=IS_FOLDER)
@click.option("--rtol", type=float, default=0.0, help="Relative change of a value that counts as none; default 0.")
@click.option(
    "--slower", type=float, default=1.5, show_default=True, help="How many times as long the new run may take."
)
def compare(old: Path, new: Path, rtol: float, slower: float) -> None:
    """Say what moved between two datasets of one study: values, rows, time.

    Ends with 11 if rows, a status or the pattern of missing values changed, else with 10 if values changed, else with
    12 if the new run was slower; with 0 if nothing moved.
    """
    comparison = compare_datasets(old, new, rtol, slower)
    for line in comparison.lines():
        click.echo(line)
    click.get_current_context().exit(comparison.exit_code)


@click.command()
@STUDY
@click.option("--parts", type=click.IntRange(min=1), required=True, help="How many runs share the chunks.")
@OUT
@SMOKE
def split(study: Path, parts: int, out: Path | None, smoke: bool) -> None:
    """Cut a study into parts that separate jobs compute; prints the command of each.

    The parts are runs of consecutive chunks of one dataset, with folders of their own beside it: parts/0000 ...  When
    they have ended, `sweep merge` brings their chunks together and `sweep run` does the rest.
    """
    for folder in split_study(study, _folder(study, out, smoke), parts, smoke=smoke):
        words = ["sweep", "run", str(study), "--out", str(folder), *(["--smoke"] if smoke else [])]
        click.echo(shlex.join(words))


@click.command()
@STUDY
@OUT
@SMOKE
def merge(study: Path, out: Path | None, smoke: bool) -> None:
    """Bring the finished chunks of all parts of a study together.

    Ends with 11 while chunks are missing; `sweep run` computes those, and the optimum.
    """
    merged = merge_parts(study, _folder(study, out, smoke), smoke=smoke)
    for path in merged.damaged:
        click.echo(f"{path}: damaged, left out; the run of this part computes it anew")
    if merged.missing:
        missing = f"{how_many(len(merged.missing), 'chunk')} missing (the first is {merged.missing[0]})"
    else:
        missing = "all are there; sweep run notes the totals and searches the optimum"
    click.echo(f"{merged.folder}: {how_many(merged.taken, 'chunk')} taken over, {missing}")
    click.get_current_context().exit(INCOMPLETE if merged.missing else 0)


def _folder(study: Path, out: Path | None, smoke: bool) -> Path:
    """Return the folder that `sweep run` uses."""
    return out or results_folder(load_study(study, smoke=smoke).name, smoke)
