"""The tables that are left beside the page."""

from __future__ import annotations

import shutil
from collections.abc import Sequence
from pathlib import Path

from sweep.dataset.layout import beside


def copy_tables(folder: Path, out: Path) -> None:
    """Copy the optimum with its curves, sensitivities and tolerances, and the front, where the study has them."""
    for name in ("optimum.parquet", "curves.parquet", "sensitivity.parquet", "tolerance.parquet", "pareto.parquet"):
        source, target = beside(folder) / f"_{name}", out / name
        if source.exists():
            shutil.copyfile(source, target)
        else:
            target.unlink(missing_ok=True)  # of an earlier report on another version of the study


def write_survivors(parts: Sequence[Path], target: Path) -> None:
    """Write the designs within all limits, in the order of the sweep, with the parts' units and definitions."""
    import pyarrow.compute as pc
    import pyarrow.parquet as pq

    if not parts:
        return
    schema = pq.read_schema(parts[0])
    partial = target.with_name(f"_tmp-{target.name}")
    with pq.ParquetWriter(partial, schema, compression="zstd") as writer:
        for part in parts:
            with pq.ParquetFile(part) as source:
                for batch in source.iter_batches():
                    writer.write_batch(batch.filter(pc.equal(batch["status"], 0)).cast(schema))
    partial.replace(target)
