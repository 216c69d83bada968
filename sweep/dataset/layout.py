"""Where the files of a dataset lie: chunks alone in one folder, everything else in a folder beside it.

Every reader of Parquet files has its own idea of which files in a folder are data.  So the folder of designs holds
``part-*.parquet`` and nothing else, and they all read the same rows.
"""

from __future__ import annotations

from pathlib import Path

PLAN, RUNS, LOCK, BAD, OLD = "_plan.json", "_runs.jsonl", "_lock", "_bad", "_old"
OPTIMUM, CURVES = "_optimum.parquet", "_curves.parquet"
SENSITIVITY, TOLERANCE, PARETO = "_sensitivity.parquet", "_tolerance.parquet", "_pareto.parquet"
PROOF = "_proof.parquet"
TEMPORARY = "_tmp-"

DESIGNS = "designs"
SUFFIX = ".meta"


def located(folder: str | Path) -> Path:
    """Return the folder of designs that a user means:
    the given one, or the ``designs`` in it where it holds no chunks.
    """
    place = Path(folder)
    inner = place / DESIGNS
    return inner if inner.is_dir() and not any(place.glob("part-*.parquet")) else place


def beside(folder: Path) -> Path:
    """Return the folder of plan, log, lock, optimum and report of a folder of designs: see `outside`.

    A dataset of an earlier version keeps these files where it has them, among the chunks.
    """
    return folder if is_older(folder) else outside(folder)


def outside(folder: Path) -> Path:
    """Return the parent of a folder called ``designs``, and ``<folder>.meta`` next to any other."""
    place = folder.resolve() if folder.is_symlink() or folder.name in ("", "..") else folder
    return place.parent if place.name == DESIGNS else place.with_name(place.name + SUFFIX)


def is_older(folder: Path) -> bool:
    """Return whether an earlier version wrote this dataset, with its plan among the chunks."""
    return (folder / PLAN).is_file()
