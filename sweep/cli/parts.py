"""The verbs for batch systems: split and merge."""

from __future__ import annotations

import shlex
from pathlib import Path

import click

from sweep.cli.options import OUT, SMOKE, STUDY
from sweep.dataset.files import DESIGNS
from sweep.engine.parts import merge as merge_parts
from sweep.engine.parts import split as split_study
from sweep.study import load_study

INCOMPLETE = 11


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
    found = merge_parts(study, _folder(study, out, smoke), smoke=smoke)
    for path in found.damaged:
        click.echo(f"{path}: damaged, left out; the run of this part computes it anew")
    if found.missing:
        missing = f"{len(found.missing)} are missing (the first is {found.missing[0]})"
    else:
        missing = "all are there; sweep run notes the totals and searches the optimum"
    click.echo(f"{found.folder}: {found.taken} chunks taken over, {missing}")
    click.get_current_context().exit(INCOMPLETE if found.missing else 0)


def _folder(study: Path, out: Path | None, smoke: bool) -> Path:
    """Folder that `sweep run` would take."""
    if out is not None:
        return out
    return Path("results", *(["smoke"] if smoke else []), load_study(study, smoke=smoke).name, DESIGNS)
