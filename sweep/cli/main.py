"""The group of verbs, and how errors reach the shell."""

from __future__ import annotations

import signal
import sys
import warnings
from pathlib import Path
from typing import Any, TextIO

import click

from sweep.cli.begin import init, schema
from sweep.cli.draw import draw
from sweep.cli.effects import effects
from sweep.cli.exchange import export, points
from sweep.cli.listing import cache, families
from sweep.cli.nightly import nightly
from sweep.cli.parts import merge, split
from sweep.cli.studies import check, compare, report, run
from sweep.cli.tables import evaluate_table, summarise_table
from sweep.cli.task import task
from sweep.cli.verify import verify
from sweep.errors import LinksweepError, LinksweepWarning, ProgramFault, StoreError
from sweep.jobs.signals import leaving_within

SIGNALLED = 128  # and the number of the signal: what a shell expects of an interrupted command

# A signal is obeyed within two seconds, also by who compiles or has processes to gather.
SECONDS_TO_LEAVE = 1.6
WORDS = "sweep: interrupted at work that cannot be stopped half way; what was finished is kept, run again to continue"


class Verbs(click.Group):
    """A group in which an error raised on purpose is one message and an exit code; any other shows its traceback."""

    def invoke(self, ctx: click.Context) -> Any:
        """Run the verb."""
        try:
            with leaving_within(SECONDS_TO_LEAVE, WORDS), warnings.catch_warnings():
                warnings.showwarning = _said
                return super().invoke(ctx)
        except LinksweepError as error:
            if isinstance(error, ProgramFault):
                click.echo(error.trace, err=True)
            click.echo(f"sweep: {error}", err=True)
            ctx.exit(error.exit_code)
        except KeyboardInterrupt as error:
            click.echo("sweep: interrupted", err=True)
            ctx.exit(SIGNALLED + getattr(error, "number", signal.SIGINT))
        except FileNotFoundError:
            if _is_here():
                raise
            click.echo("sweep: the folder it was started in is not there any more; go to another one", err=True)
            ctx.exit(StoreError.exit_code)


def _said(
    message: Warning | str,
    category: type[Warning],
    filename: str,
    lineno: int,
    file: TextIO | None = None,
    line: str | None = None,
) -> None:
    """Print a warning of our own in one line; others are for whoever programs."""
    if issubclass(category, LinksweepWarning):
        click.echo(f"sweep: {message}", err=True)
    else:
        sys.stderr.write(warnings.formatwarning(message, category, filename, lineno, line))


def _is_here() -> bool:
    try:
        Path.cwd()
    except FileNotFoundError:
        return False
    return True


@click.group(cls=Verbs, context_settings={"help_option_names": ["-h", "--help"], "max_content_width": 110})
@click.version_option(package_name="linksweep")
def main() -> None:
    """Parameter sweeps and optimum design of the linkages of textile and sewing machines.

    STUDY is a study.toml or the folder that holds one, FOLDER a dataset that `sweep run` left behind, FAMILY a name
    from `sweep families` or a chain of them such as rssr+guide.

    Exit codes: 0 ok, 2 bad input, 3 over budget, 4 no design within the limits (run), 10 values changed, 11 rows
    changed or missing, 12 slower (compare, nightly, verify), 70 worker died, 74 I/O, damaged data or disk full, 75
    folder locked, 124 time budget used up (run again to resume), 130 and 143 stopped by a signal.
    """


for verb in (
    init,
    run,
    check,
    evaluate_table,
    summarise_table,
    families,
    effects,
    report,
    compare,
    verify,
    nightly,
    split,
    merge,
    cache,
    points,
    export,
    draw,
    task,
    schema,
):
    main.add_command(verb)
