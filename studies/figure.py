"""Common parts of the studies' figure.py: the folder argument, a table, a chart."""

from __future__ import annotations

import argparse
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING

from sweep.report.figures import house_style, save

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.figure import Figure


def folder_asked(about: str | None) -> Path:
    """Return the folder of results named on the command line; ``about`` is the text of ``--help``."""
    parser = argparse.ArgumentParser(description=about)
    parser.add_argument("folder", type=Path, help="results of the study, with its designs/")
    folder: Path = parser.parse_args().folder
    return folder


def print_table(table: pd.DataFrame, form: str, missing: str = "NaN") -> None:
    """Print a table with numbers in a format such as ``{:.4g}``."""
    print(table.to_string(index=False, float_format=form.format, na_rep=missing))  # noqa: T201


def save_chart(folder: Path, name: str, chart: Callable[[], Figure]) -> None:
    """Write a chart as figures/NAME.svg and print its path."""
    with house_style():
        print(save(chart(), folder / "figures" / f"{name}.svg"))  # noqa: T201
