"""The verb that checks a dataset: verify."""

from __future__ import annotations

from pathlib import Path

import click


@click.command()
@click.argument("folder", type=click.Path(exists=True, file_okay=False, path_type=Path))
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
    from sweep.dataset.verification import verify as verify_dataset

    found = verify_dataset(folder, designs)
    for line in found.lines():
        click.echo(line)
    click.get_current_context().exit(found.exit_code)
