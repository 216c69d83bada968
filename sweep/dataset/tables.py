"""The tables beside the chunks: which are there as they were written, and what their metadata say."""

from __future__ import annotations

import hashlib
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

from sweep.dataset.files import store_errors

# Where ``_plan.json`` keeps the hashes of the tables that a finished search has written.
TABLES = "tables"


def digests(place: Path, names: Iterable[str]) -> dict[str, str]:
    """Return SHA-256 of those of the tables that are there."""
    with store_errors(place):
        return {n: hashlib.sha256((place / n).read_bytes()).hexdigest() for n in names if (place / n).is_file()}


def altered(place: Path, note: Mapping[str, Any], names: Iterable[str]) -> list[str]:
    """Return the tables that are not as their search has written them, or not there; an older plan notes no hashes.

    Parameters
    ----------
    place : folder of the tables
    note : content of ``_plan.json``
    names : of the tables
    """
    known, found = note.get(TABLES) or {}, digests(place, names)
    return [name for name in names if name not in found or known.get(name, found[name]) != found[name]]


def metadata(path: Path) -> dict[bytes, bytes]:
    """Return what a table says of itself; empty where there is none, or it is damaged."""
    import pyarrow as pa
    import pyarrow.parquet as pq

    try:
        return dict(pq.read_schema(path).metadata or {}) if path.is_file() else {}
    except (pa.ArrowException, OSError, ValueError):  # Arrow says OSError, too, of bytes that make no sense
        return {}
