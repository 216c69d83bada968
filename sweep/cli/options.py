"""Arguments and options that several verbs share."""

from __future__ import annotations

from pathlib import Path

import click

# Paths that must exist, and paths that may be created.
IS_FILE = click.Path(exists=True, dir_okay=False, path_type=Path)
IS_FOLDER = click.Path(exists=True, file_okay=False, path_type=Path)
IS_THERE = click.Path(exists=True, path_type=Path)
A_FILE = click.Path(dir_okay=False, path_type=Path)
A_FOLDER = click.Path(file_okay=False, path_type=Path)

STUDY = click.argument("study", type=IS_THERE)
FOLDER = click.argument("folder", type=IS_FOLDER)
OUT = click.option("--out", type=A_FOLDER, help="Dataset folder; default results/<study>/designs.")
JOBS = click.option("--jobs", type=click.IntRange(min=1), default=2, show_default=True, help="Workers.")
BACKEND = click.option(
    "--backend",
    default="threading",
    show_default=True,
    help="threading, loky (processes), dask (processes of a local cluster) or dask=tcp://HOST:8786 (docs/cluster.md).",
)
SMOKE = click.option("--smoke", is_flag=True, help="The tiny version: smoke.toml beside the study.")
DESIGN = click.option(
    "--design", help="optimum, reference, best, or a number of the column design; default: optimum, else best."
)
ANGLES = click.option(
    "--angles",
    type=click.Choice(["rad", "deg"]),
    help="Unit of the angles in TABLE; a header such as `alpha [deg]` says it of one column. Default: rad.",
)
