"""The report about a dataset: one HTML file that needs no network, its figures, and the tables behind them."""

from __future__ import annotations

from pathlib import Path


def write_report(folder: str | Path, out: str | Path | None = None) -> Path:
    """Write the report of a dataset.

    Parameters
    ----------
    folder : dataset that ``sweep.run`` left behind, complete
    out : where to write; default ``FOLDER/_report``

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

    folder = Path(folder)
    return write(folder, folder / "_report" if out is None else Path(out))


__all__ = ["write_report"]
