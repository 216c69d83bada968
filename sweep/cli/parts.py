"""The verbs for batch systems: split and merge."""

from __future__ import annotations

import shlex
from pathlib import Path

import click

from sweep.dataset.layout import DESIGNS

STUDY = click.argument("study", type=click.Path(exists=True, path_type=Path))
OUT = click.option(
    "--out", type=click.Path(file_okay=False, path_type=Path), help="Dataset folder; default results/<study>/designs."
)
SMOKE = click.option("--smoke", is_flag=True, help="The tiny version: smoke.toml beside the study.")
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
    from sweep.engine.parts import split as split_study

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
    from sweep.engine.parts import merge as merge_parts

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
    """Return the folder that `sweep run` would take."""
    from sweep.study import load_study

    if out is not None:
        return out
    return Path("results", *(["smoke"] if smoke else []), load_study(study, smoke=smoke).name, DESIGNS)
