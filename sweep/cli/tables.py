"""The verbs for a table of designs: eval and summarise."""

from __future__ import annotations

import math
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import click
import numpy as np
import pandas as pd
from pyarrow import csv
from pyarrow.types import is_binary

from sweep.cli.families import complete_families, complete_outputs, family_names
from sweep.cli.options import A_FILE, ANGLES, IS_FILE
from sweep.dataset.files import replacing
from sweep.errors import InputError, MissingInput, listed
from sweep.evaluation.angles import AngleUnit, is_plausible
from sweep.evaluation.poses import evaluate
from sweep.evaluation.summaries import summarise
from sweep.families import family as find_family
from sweep.families.base import Domain, Interval

FORMATS = (".parquet", ".csv")
FAMILY = click.argument("family", shell_complete=complete_families)
TABLE = click.argument("table", type=IS_FILE)
WANT = click.option(
    "--want",
    multiple=True,
    required=True,
    shell_complete=complete_outputs,
    help="Outputs, separated by commas; see `sweep families FAMILY`.",
)
OUT = click.option("--out", type=A_FILE, help="A .parquet or .csv file; default: CSV to stdout.")
KEEP = click.option(
    "--keep",
    multiple=True,
    help="Columns of TABLE to repeat in the result, separated by commas; "
    "`all` for every one but those that are named like a result.",
)
TEXT = click.option("--status-text", is_flag=True, help="Add a column that says in words what the status means.")


@click.command("eval")
@FAMILY
@TABLE
@WANT
@click.option(
    "--poses", type=click.IntRange(min=1), help="Equally spaced crank angles over one turn, for every design."
)
@ANGLES
@KEEP
@TEXT
@OUT
def evaluate_table(
    family: str,
    table: Path,
    want: tuple[str, ...],
    poses: int | None,
    angles: AngleUnit | None,
    keep: tuple[str, ...],
    status_text: bool,
    out: Path | None,
) -> None:
    """Compute pose outputs of the designs in TABLE (.parquet or .csv), one row per pose.

    TABLE has a column for each parameter of FAMILY, in one length unit, ANGLES IN RAD unless --angles or a header such
    as `alpha [deg]` says otherwise, and a column phi (then each row is one pose) unless --poses is given (then each row
    is a design); of a family over an interval a column of its variable, such as rho.  FAMILY is a family or a chain
    such as rssr+guide.  A value that is nan has a status that says why.
    """
    out = checked_format(out, table)
    mechanism, chosen = find_family(family_names(family)), kept(keep)
    variable = mechanism.domain.name
    turns = not isinstance(mechanism.domain, Interval)
    if poses is not None and not turns:
        raise InputError("--poses", poses, f"a column {variable}: the ends are those of each design", "command line")
    full_turn = 2.0 * np.pi if angles != "deg" else 360.0
    phi = None if poses is None else np.arange(poses) * (full_turn / poses)
    designs = read_table(table)
    names = [str(name).split("[")[0].strip() for name in designs.columns]
    if poses is None and variable not in names:
        needed = f"a column {variable}{' [rad], or --poses N for N crank angles over the turn' if turns else ''}"
        raise MissingInput(variable, f"{needed}; found {listed(names)}", str(table))
    if poses is not None and variable in names:
        raise InputError(
            "--poses", poses, f"either --poses or a column {variable} in {table}, not both", "command line"
        )
    wants = wanted(want)
    with _naming(table):
        result = evaluate(mechanism, designs, wants, phi, keep=chosen, status_text=status_text, angles=angles)
    write_table(result, out)


@click.command("summarise")
@FAMILY
@TABLE
@WANT
@click.option("--samples", type=int, help="Extrema on a grid of this many crank angles.")
@click.option(
    "--accuracy", type=float, help="Extrema refined to this relative error (default 1e-8), with err_ columns."
)
@click.option("--certify", is_flag=True, help="Prove that no peak is missed: err_ columns of maxima are bounds then.")
@click.option(
    "--window",
    type=(float, float),
    metavar="FROM TO",
    help="Part of the stroke that max_abs_dev covers, two fractions such as 0 0.6.",
)
@ANGLES
@KEEP
@TEXT
@OUT
def summarise_table(
    family: str, table: Path, want: tuple[str, ...], keep: tuple[str, ...], out: Path | None, **options: Any
) -> None:
    """Compute design outputs of the designs in TABLE (.parquet or .csv), one row per design.

    TABLE has a column for each parameter of FAMILY, in one length unit, ANGLES IN RAD unless --angles or a header such
    as `alpha [deg]` says otherwise.  FAMILY is a family or a chain such as rssr+guide.  A value that is nan has a
    status that says why.
    """
    out = checked_format(out, table)
    designs = read_table(table)
    with _naming(table):  # the other options are those of `sweep.summarise`
        result = summarise(family_names(family), designs, wanted(want), keep=kept(keep), **options)
    write_table(result, out)


@contextmanager
def _naming(table: Path) -> Iterator[None]:
    """Put the name of the file in front of what is said of its columns and rows."""
    try:
        yield
    except InputError as error:
        if error.place.startswith(("table", "column")):
            rows = " (its first row is 0)" if ", row " in error.place else ""
            error.args = (f"{table}{rows}: {error}",)
        raise


def refuse_degrees(domain: Domain, phi: float) -> None:
    """Refuse a crank angle for a folder's design that looks like degrees, since a folder is in rad."""
    if domain.unit == "rad" and not is_plausible(abs(phi), True):
        raise InputError("--phi", phi, f"an angle in rad; {phi:g} deg is {math.radians(phi):.6g}", "command line")


def wanted(texts: tuple[str, ...]) -> list[str]:
    """Return the names in ``--want x,y --want z``, without repetition; there has to be one."""
    if not (names := _names(texts)):
        raise MissingInput("--want", "the name of an output; `sweep families FAMILY` lists them", "command line")
    return names


def kept(texts: tuple[str, ...]) -> bool | list[str]:
    """Return the argument ``keep`` of the API for ``--keep``."""
    names = _names(texts)
    return True if names == ["all"] else names


def _names(texts: tuple[str, ...]) -> list[str]:
    names = [name.strip() for text in texts for name in text.split(",")]
    return list(dict.fromkeys(name for name in names if name))


def checked_format(out: Path | None, table: Path | None = None) -> Path | None:
    """Refuse an output file that could not be written, or is the table itself, before the computation."""
    if out is None:
        return None
    if table is not None and out.resolve() == table.resolve():
        raise InputError("--out", str(out), "a file of its own: this one is TABLE", "command line")
    if out.suffix.lower() not in FORMATS:
        raise InputError("--out", str(out), f"a file name ending in {' or '.join(FORMATS)}", "command line")
    if not out.resolve().parent.is_dir():
        raise InputError("--out", str(out), "a file in a folder that exists", "command line")
    return out


def read_table(path: Path) -> pd.DataFrame:
    """Read designs from Parquet or CSV; any other file is an :class:`InputError`."""
    suffix = path.suffix.lower()
    if suffix not in FORMATS:
        raise InputError("table", path.name, f"a file name ending in {' or '.join(FORMATS)}", str(path))
    try:
        if suffix == ".parquet":
            return pd.read_parquet(path)
        with path.open("rb") as file:
            head = file.readline()
        if b"," not in head and (b";" in head or b"\t" in head):
            line = head.decode("utf-8", "replace").strip()
            raise InputError("first line", line, "values between commas, with decimal points", str(path))
        # The parser of pandas up to version 2 was off by an ulp for some numbers by default.
        table = csv.read_csv(path)
        foreign = [field.name for field in table.schema if is_binary(field.type)]
        if foreign:
            raise InputError("column", foreign[0], "text in UTF-8", str(path))
        frame: pd.DataFrame = table.rename_columns([name.strip() for name in table.column_names]).to_pandas()
        return frame
    except InputError:
        raise
    except Exception as error:  # damaged metadata can raise any exception in pandas
        first = next(iter(str(error).splitlines()), type(error).__name__)  # a schema may follow
        form = "parquet" if suffix == ".parquet" else "csv in UTF-8 with the names of the columns in its first line"
        raise InputError("table", path.name, f"readable {form} ({first})", str(path)) from error


def write_table(frame: pd.DataFrame, out: Path | None) -> None:
    """Write a table; a file appears under its name only when it is complete."""
    if out is None:
        click.echo(frame.to_csv(index=False), nl=False)
        return
    with replacing(out) as partial:
        if out.suffix.lower() == ".parquet":
            frame.to_parquet(partial, index=False)
        else:
            frame.to_csv(partial, index=False)
