"""The report about a dataset: one HTML file that needs no network, its figures, and the tables behind them."""

from __future__ import annotations

from pathlib import Path

from sweep.dataset.layout import beside, is_older, located
from sweep.jobs.progress import Say, unsaid


def write_report(folder: str | Path, out: str | Path | None = None, say: Say = unsaid) -> Path:
    """Write the report of a dataset.

    Parameters
    ----------
    folder : dataset that ``sweep.run`` left behind, complete
    out : where to write; default beside the chunks, ``results/<name>`` for ``results/<name>/designs``
    say : called with how many of the report's steps are done

    Returns
    -------
    Path
        of ``report.html``.  Beside it: ``figures/*.svg``, ``survivors.parquet`` (the designs within all limits) and,
        if the study optimises, the tables the optimiser left (``optimum.parquet``, ``curves.parquet`` ...).

    Raises
    ------
    InputError
        if the folder is no complete dataset.
    StoreError
        if the report cannot be written.
    """
    from sweep.report.page import write

    place = located(folder)
    return write(place, _default(place) if out is None else Path(out), say)


def _default(folder: Path) -> Path:
    return folder / "_report" if is_older(folder) else beside(folder)


__all__ = ["write_report"]
