"""What a shell completes: names of families, chains of them, effects.  Nothing is imported before a shell asks."""

from __future__ import annotations

import click


def families(context: click.Context, parameter: click.Parameter, incomplete: str) -> list[str]:
    """Return families that begin so; behind a + the next stage of a chain."""
    from sweep.families import NAMES

    before, plus, last = incomplete.rpartition("+")
    return [f"{before}{plus}{name}" for name in NAMES if name.startswith(last)]


def effects(context: click.Context, parameter: click.Parameter, incomplete: str) -> list[str]:
    """Return effects that begin so."""
    from sweep.effects import NAMES

    return [name for name in NAMES if name.startswith(incomplete)]


def outputs(context: click.Context, parameter: click.Parameter, incomplete: str) -> list[str]:
    """Return outputs of the FAMILY given before, behind a comma the next one."""
    from sweep.cli.listing import family_names, main_outputs
    from sweep.errors import LinksweepError
    from sweep.families import family

    # Where an option still lacks its value, click leaves the arguments before it unread.
    given = context.params.get("family") or next(iter(context.args), None)
    if given is None:
        return []
    try:
        entry = family(family_names(given))
    except LinksweepError:
        return []  # a misspelt family is said when the command runs
    names = list(entry.pose_names) if context.command.name == "eval" else main_outputs(entry)
    before, comma, last = incomplete.rpartition(",")
    return [f"{before}{comma}{name}" for name in names if name.startswith(last)]
