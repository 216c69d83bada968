"""Datasets of many rows in bounded memory: ``scan`` for pushdown, best designs, Pareto front, histograms."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from sweep.dataset import chunk_files, store
from sweep.errors import InputError, nearest, whole
from sweep.quantities.limits import compared

if TYPE_CHECKING:
    import pandas as pd
    import pyarrow.dataset as ds

# Rows per batch in memory.
BATCH_ROWS = 131_072
MOST_BEST = 100_000
MOST_BINS = 100_000


def scan(folder: str | Path) -> ds.Dataset:
    """Return a dataset as an Arrow dataset: columns and filters are applied while the files are read.

    ``sweep.scan(folder).to_table(columns=["design", "swing"], filter=(pc.field("status") == 0)).to_pandas()`` reads
    two columns of the rows within all limits; ``.scanner(...).to_batches()`` reads them batch by batch.

    Parameters
    ----------
    folder : folder written by ``sweep run``

    Returns
    -------
    pyarrow.dataset.Dataset
        the chunks in design order.  Name and metadata of every chunk are checked; its bytes are checked by
        ``sweep.verify`` and ``sweep.load`` only.

    Raises
    ------
    InputError
        if the folder holds no chunks
    StoreError
        if a chunk lies under another chunk's name, is there twice, or belongs to other data.

    Examples
    --------
    >>> import sweep
    >>> source = sweep.scan("results/press/designs")
    >>> source.count_rows(), source.schema.field("stroke").metadata[b"unit"]
    (25, b'mm')
    """
    import pyarrow.dataset as ds

    _, chunks = store.parts_of_one_table(folder, "scan")
    chunk_files.check_columns(chunks)
    return ds.dataset([str(part.path) for part in chunks], format="parquet")


def best(folder: str | Path, output: str, count: int = 10) -> pd.DataFrame:
    """Find the designs within all limits with the smallest output, best first; swing and stroke by magnitude.

    Parameters
    ----------
    folder : folder written by ``sweep run``
    output : column to be minimised
    count : number of rows at most, up to 100000

    Raises
    ------
    InputError, StoreError
        as :func:`scan`; also for an unknown output or a count out of range.
    """
    whole("count", count, "best", 1, MOST_BEST)

    def first(rows: pd.DataFrame) -> NDArray[np.intp]:
        order: NDArray[np.intp] = np.argsort(compared(output, rows[output].to_numpy()), kind="stable")
        return order[:count]

    return _chosen(folder, [output], "best", first)


def of_number(folder: str | Path, number: int) -> pd.DataFrame:
    """Read the row of a design, by its number in the column ``design``.

    Parameters
    ----------
    folder : folder written by ``sweep run``
    number : number of the design, as in :func:`sweep.load`, the report and the pictures

    Raises
    ------
    InputError, StoreError
        as :func:`scan`; also for a number that no row has.
    """
    import pyarrow.compute as pc

    source = scan(folder)
    row: pd.DataFrame = source.to_table(filter=pc.field("design") == number).to_pandas()
    if row.empty:
        ends = pc.min_max(source.to_table(columns=["design"]).column("design")).as_py()
        allowed = f"a number of the column design; the designs kept are some of {ends['min']} to {ends['max']}"
        raise InputError("design", number, allowed, str(folder))
    return _with_units(row, source)


def pareto(folder: str | Path, first: str, second: str) -> pd.DataFrame:
    """Find the Pareto-optimal designs within all limits, ordered by the first output; both are minimised.

    Parameters
    ----------
    folder : folder written by ``sweep run``
    first, second : columns to be minimised; swing and stroke by magnitude

    Returns
    -------
    DataFrame
        all columns of these rows; of rows equal in both outputs the first.  Memory holds one batch and the front.

    Raises
    ------
    InputError, StoreError
        as :func:`scan`; also for an unknown output.
    """

    def front(rows: pd.DataFrame) -> NDArray[np.intp]:
        # Designs are read in their order, so that of rows equal in both outputs the first one stays.
        return non_dominated(*(compared(name, rows[name].to_numpy()) for name in (first, second)))

    return _chosen(folder, [first, second], "pareto", front)


def non_dominated(x: NDArray[np.float64], y: NDArray[np.float64]) -> NDArray[np.intp]:
    """Return the indices of non-dominated points, sorted by x; smaller is better, of equal points the first counts."""
    order: NDArray[np.intp] = np.lexsort((y, x))
    return order[np.diff(np.minimum.accumulate(y[order]), prepend=np.inf) < 0.0]


def _chosen(
    folder: str | Path, names: list[str], place: str, choose: Callable[[pd.DataFrame], NDArray[np.intp]]
) -> pd.DataFrame:
    """Read the designs that ``choose`` selects by their outputs, from a batch and those selected before, in order."""
    import pandas as pd

    source = scan(folder)
    _check_outputs(source, names, place)
    best = pd.DataFrame({name: [] for name in dict.fromkeys(["design", *names])})
    for batch in _feasible(source, list(best.columns)):
        finite = batch[np.isfinite(batch[names].to_numpy()).all(axis=1)]
        merged = finite if best.empty else pd.concat([best, finite], ignore_index=True)
        best = merged.iloc[choose(merged)]
    return _all_columns(source, best["design"].to_numpy(np.int64))


def _with_units(rows: pd.DataFrame, source: Any) -> pd.DataFrame:
    """Attach the units in the schema to the rows."""
    rows.attrs["units"] = chunk_files.noted(source.schema)
    return rows


def histogram(
    folder: str | Path, output: str, bins: int = 100, ends: tuple[float, float] | None = None
) -> tuple[NDArray[np.int64], NDArray[np.float64]]:
    """Count the designs within all limits in equal bins of an output; return the counts and the bin edges.

    Parameters
    ----------
    folder : folder written by ``sweep run``
    output : column
    bins : number of bins, up to 100000
    ends : lowest and highest edge; if missing, the rows are read twice, first for the smallest and largest value

    Returns
    -------
    counts (bins,), edges (bins + 1,); missing values and values outside ``ends`` are not counted.

    Raises
    ------
    InputError, StoreError
        as :func:`scan`; also for an unknown output, or where no design within the limits has a value.
    """
    whole("bins", bins, "histogram", 1, MOST_BINS)
    source = scan(folder)
    _check_outputs(source, [output], "histogram")
    low, high = _ends(source, output) if ends is None else ends
    if not (math.isfinite(low) and math.isfinite(high) and low <= high):
        raise InputError("ends", (low, high), "two finite numbers, the smaller one first", "histogram")
    edges = np.histogram_bin_edges(np.empty(0), bins, (low, high))
    counts = np.zeros(bins, np.int64)
    for batch in _feasible(source, [output]):
        counts += np.histogram(batch[output].to_numpy(), edges)[0]
    return counts, edges


def _ends(source: Any, output: str) -> tuple[float, float]:
    low, high = math.inf, -math.inf
    for batch in _feasible(source, [output]):
        values = batch[output].to_numpy()
        values = values[np.isfinite(values)]
        if values.size:
            low, high = min(low, float(values.min())), max(high, float(values.max()))
    if low > high:
        raise InputError("output", output, "a column with a value in some design within the limits", "histogram")
    return low, high


def _feasible(source: Any, names: Sequence[str]) -> Iterator[pd.DataFrame]:
    """Yield the rows with status 0, batch by batch.

    The files are read one after the other, so that only a few batches are in memory.
    """
    import pyarrow.compute as pc

    scanner = source.scanner(
        columns=list(names), filter=pc.field("status") == 0, batch_size=BATCH_ROWS, batch_readahead=1,
        fragment_readahead=1, use_threads=False,
    )  # fmt: skip
    for batch in scanner.to_batches():
        if batch.num_rows:
            yield batch.to_pandas()


def _all_columns(source: Any, designs: NDArray[np.int64]) -> pd.DataFrame:
    """Read all columns of the given designs, in the given order.

    Of files without any of these designs only the statistics are read.
    """
    import pyarrow.compute as pc

    wanted = pc.field("design").isin(designs) & (pc.field("status") == 0)
    scanner = source.scanner(filter=wanted, batch_size=BATCH_ROWS, batch_readahead=1, fragment_readahead=1)
    rows: pd.DataFrame = scanner.to_table().to_pandas()
    return _with_units(rows.set_index("design", drop=False).loc[designs].reset_index(drop=True), source)


def _check_outputs(source: Any, names: Sequence[str], place: str) -> None:
    for name in names:
        if name not in source.schema.names:
            columns = ", ".join(source.schema.names)
            raise InputError("output", name, f"a column: {columns}{nearest(name, source.schema.names)}", place)
