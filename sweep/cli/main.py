"""The group of verbs, and the conversion of errors to messages and exit codes.

A verb's module is imported when the verb is called, so that ``sweep --help`` and the completion of verbs are fast.
"""

from __future__ import annotations

import errno
import os
import signal
import sys
import warnings
from contextlib import suppress
from importlib import import_module
from pathlib import Path
from typing import Any

import click
from click.shell_completion import CompletionItem

from sweep import errors
from sweep.jobs.signals import leaving_within

SIGNALLED = 128  # plus the number of the signal: the exit code that a shell expects of an interrupted command

# A signal ends the program within two seconds, even while it compiles or gathers processes.
SECONDS_TO_LEAVE = 1.6
WORDS = "sweep: interrupted at work that cannot be stopped half way; what was finished is kept, run again to continue"


# Module and command of each verb, and its words in the list of verbs.
VERBS = {
    "cache": ("kernels:cache", "Manage the compiled kernels that are kept on disk."),
    "check": ("plan:check", "Validate a study and print what running it would compute and cost."),
    "compare": ("datasets:compare", "Say what moved between two datasets of one study: values, rows, time."),
    "draw": ("report:draw", "Draw one picture."),
    "effects": ("effects:effects", "List the effects a scene can call for, or explain one."),
    "eval": ("tables:evaluate_table", "Compute pose outputs of the designs in TABLE, one row per pose."),
    "explore": (
        "explore:explore",
        "Take a design in hand: sliders for its dimensions; mechanism, curves, outputs and limits follow.",
    ),
    "export": ("points:export", "Write one design of a dataset to a file that other programs read."),
    "families": ("families:families", "List the mechanism families, or the parameters and outputs of one."),
    "init": ("init:init", "Write a first study of a mechanism or a machine."),
    "merge": ("datasets:merge", "Bring the finished chunks of all parts of a study together."),
    "nightly": ("nightly:nightly", "Compute all STUDIES into a dated folder, and say what changed."),
    "points": ("points:points", "Find the dimensions of FAMILY from the points of a drawing."),
    "report": ("report:report", "Write report.html, figures and tables about a dataset."),
    "run": ("run:run", "Run or resume a study."),
    "schema": ("init:schema", "Write the JSON schema of study files, by which editors complete and check them."),
    "split": ("datasets:split", "Cut a study into parts that separate jobs compute."),
    "summarise": ("tables:summarise_table", "Compute design outputs of the designs in TABLE, one row per design."),
    "task": ("points:task", "Answer the [task] table of FILE: mechanisms, the best first."),
    "verify": ("datasets:verify", "Check a dataset: every byte against its hash, every row against the plan."),
    "warm": (
        "kernels:warm",
        "Compile what studies or families need, before they are run: for images, clusters and nights.",
    ),
}


class Verbs(click.Group):
    """Command group that shows an error of this package as a message and exit code, any other with its traceback."""

    def list_commands(self, ctx: click.Context) -> list[str]:
        """Return the names of the verbs."""
        return list(VERBS)

    def get_command(self, ctx: click.Context, cmd_name: str) -> click.Command | None:
        """Import the command of a verb, or return None for an unknown name."""
        if cmd_name not in VERBS:
            return None
        module, name = VERBS[cmd_name][0].split(":")
        command: click.Command = getattr(import_module(f"sweep.cli.{module}"), name)
        return command

    def resolve_command(
        self, ctx: click.Context, args: list[str]
    ) -> tuple[str | None, click.Command | None, list[str]]:
        """Find the called verb; for an unknown one the error names the closest."""
        word = args[0]
        if word not in VERBS and not word.startswith("-"):
            from sweep.study.tables import TABLES

            hint = f"; [{word}] is a table of a study, which `sweep run STUDY` obeys" if word in TABLES else ""
            ctx.fail(f"No such command '{word}'{errors.nearest(word, VERBS) or hint}")
        return super().resolve_command(ctx, args)

    def format_commands(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        """Write the list of verbs without importing them."""
        with formatter.section("Commands"):
            formatter.write_dl([(name, words) for name, (_, words) in VERBS.items()])

    def shell_complete(self, ctx: click.Context, incomplete: str) -> list[CompletionItem]:
        """Return matching verbs without importing them, and options."""
        verbs = [CompletionItem(name, help=words) for name, (_, words) in VERBS.items() if name.startswith(incomplete)]
        return verbs + click.Command.shell_complete(self, ctx, incomplete)

    def invoke(self, ctx: click.Context) -> Any:
        """Run the verb."""
        try:
            with leaving_within(SECONDS_TO_LEAVE, WORDS), warnings.catch_warnings():
                warnings.showwarning = _show_warning
                return super().invoke(ctx)
        except errors.LinksweepError as error:
            if isinstance(error, errors.ProgramFault):
                click.echo(error.trace, err=True)
            click.echo(f"sweep: {error}", err=True)
            ctx.exit(error.exit_code)
        except KeyboardInterrupt as error:
            click.echo("sweep: interrupted", err=True)
            ctx.exit(SIGNALLED + getattr(error, "number", signal.SIGINT))
        except (OSError, MemoryError, ImportError, RuntimeError) as error:
            if errors.is_memory_full(error):
                _last_words("sweep: the memory it may use is full; fewer jobs, designs or poses need less")
                ctx.exit(errors.WorkerDied.exit_code)
            if not isinstance(error, OSError) or error.errno == errno.EPIPE:  # click handles a closed pipe
                raise
            words = errors.reason(error)
            if isinstance(error, FileNotFoundError) and not _is_here():
                words = "the folder it was started in is not there any more; go to another one"
            _last_words(f"sweep: {words}")
            ctx.exit(errors.StoreError.exit_code)


def _last_words(text: str) -> None:
    """Print a final message and discard later output, which a full disk would refuse at exit as well."""
    with suppress(OSError):
        click.echo(text, err=True)
    sys.stdout = Path(os.devnull).open("w", encoding="utf-8")  # noqa: SIM115


def _show_warning(message: Warning | str, category: type[Warning], *where: Any, **_: Any) -> None:
    """Print a warning of this package in one line, any other in Python's format."""
    if issubclass(category, errors.LinksweepWarning):
        click.echo(f"sweep: {message}", err=True)
    else:
        sys.stderr.write(warnings.formatwarning(message, category, *where[:2]))


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
