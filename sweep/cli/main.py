"""The group of verbs, and how errors reach the shell."""

from __future__ import annotations

from typing import Any

import click

from sweep.cli.draw import draw
from sweep.cli.effects import effects
from sweep.cli.exchange import export, points
from sweep.cli.listing import cache, families
from sweep.cli.studies import check, compare, report, run
from sweep.cli.tables import evaluate_table, summarise_table
from sweep.errors import LinksweepError

SIGNALLED = 130  # 128 + SIGINT, what a shell expects of an interrupted command


class Verbs(click.Group):
    """A group in which an error raised on purpose is one message and an exit code; any other shows its traceback."""

    def invoke(self, ctx: click.Context) -> Any:
        """Run the verb."""
        try:
            return super().invoke(ctx)
        except LinksweepError as error:
            click.echo(f"sweep: {error}", err=True)
            ctx.exit(error.exit_code)
        except KeyboardInterrupt:
            click.echo("sweep: interrupted", err=True)
            ctx.exit(SIGNALLED)


@click.group(cls=Verbs, context_settings={"help_option_names": ["-h", "--help"], "max_content_width": 110})
@click.version_option(package_name="linksweep")
def main() -> None:
    """Parameter sweeps and optimum design of the linkages of textile and sewing machines.

    STUDY is a study.toml or the folder that holds one, FOLDER a dataset that `sweep run` left behind, FAMILY a name
    from `sweep families` or a chain of them such as rssr+guide.

    Exit codes: 0 ok, 2 bad input, 3 over budget, 10 values changed, 11 rows changed, 12 slower (compare), 70 worker
    died, 74 I/O or disk full, 75 folder locked, 124 time budget used up (run again to resume), 130 and 143 stopped by a
    signal.
    """


for verb in (
    run,
    check,
    evaluate_table,
    summarise_table,
    families,
    effects,
    report,
    compare,
    cache,
    points,
    export,
    draw,
):
    main.add_command(verb)
