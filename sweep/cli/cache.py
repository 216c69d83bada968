"""The verb ``cache``: compiled kernels on disk."""

from __future__ import annotations

import shutil

import click

from kernels.cache_folder import cache_root


@click.group()
def cache() -> None:
    """Manage the compiled kernels that are kept on disk."""


@cache.command()
def clear() -> None:
    """Remove the compiled kernels of every version; they are compiled anew when needed.

    Files cut short are noticed and made anew; this is the cure for any other damage, and makes room.
    """
    root = cache_root()
    if not root.exists():
        click.echo(f"nothing to remove: {root} does not exist")
        return
    shutil.rmtree(root)
    click.echo(f"removed {root}")
