"""The verb ``task``: a task of the engineering method, from a file to mechanisms."""

from __future__ import annotations

from pathlib import Path

import click
import pandas as pd

from sweep.cli.tables import write_table
from sweep.study.task import load_task
from sweep.synthesis.tasks import solve

NOTHING = 4  # as of `sweep run`: no design within the limits


@click.command()
@click.argument("file", type=click.Path(path_type=Path))
@click.option("--candidates", default=4096, show_default=True, type=click.IntRange(min=16), help="Points tried first.")
@click.option(
    "--starts", default=6, show_default=True, type=click.IntRange(min=1), help="Of them, how many are refined."
)
@click.option("--seed", default=0, show_default=True, type=click.IntRange(min=0), help="Of the points.")
@click.option("--out", type=click.Path(path_type=Path), help="The mechanisms as a table: .csv or .parquet.")
def task(file: Path, candidates: int, starts: int, seed: int, out: Path | None) -> None:
    """Answer the [task] table of FILE (docs/tasks.md): mechanisms, the best first, lengths in mm, angles in rad."""
    solutions = solve(load_task(file), candidates=candidates, starts=starts, seed=seed)
    for solution in solutions:
        click.echo(str(solution))
    if not solutions:
        click.echo("no candidate was a mechanism at all")
    if out is not None:
        rows = [s.mechanism | {"objective": s.objective, "feasible": s.feasible} for s in solutions]
        write_table(pd.DataFrame(rows), out)
    if not any(s.feasible for s in solutions):
        raise click.exceptions.Exit(NOTHING)
