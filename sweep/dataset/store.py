"""The dataset: immutable Parquet chunks that prove themselves, and how they are read back.

A chunk is written beside the folder of designs, brought to the disk, renamed into it, and never touched again.
Its name

    part-<index>-<identity of study, code, cut and columns>-<hash of the file>.parquet

says what it holds and whether it is whole, so the folder needs no manifest and survives a kill at any moment.
Index and identity stand in the file's metadata too, so a file under another chunk's name is noticed.
"""

from __future__ import annotations

import json
import warnings
from collections import Counter
from collections.abc import Callable, Mapping
from itertools import pairwise
from pathlib import Path
from typing import TYPE_CHECKING

from sweep.dataset.files import (
    BAD,
    CURVES,
    DESIGNS,
    LOCK,
    OLD,
    OPTIMUM,
    PARETO,
    PLAN,
    PROOF,
    RUNS,
    SEARCH,
    SENSITIVITY,
    TEMPORARY,
    TOLERANCE,
    append_run,
    beside,
    is_older,
    located,
    metadata,
    read_plan,
    read_runs,
    read_table,
    remove_temporary,
    set_aside,
    store_errors,
    trusted_plan,
    write_atomically,
    write_plan,
)
from sweep.dataset.lock import locked
from sweep.dataset.parts import (
    METADATA,
    REMEDY,
    STATUS_NAMES,
    Part,
    about,
    check_columns,
    content_hash,
    is_whole,
    listing,
    missing_chunks,
    part_of,
    parts,
)
from sweep.errors import IncompleteWarning, InputError, StoreError

if TYPE_CHECKING:
    import pandas as pd

    from sweep.chunks.chunk import ChunkResult
    from sweep.chunks.plan import Plan

__all__ = [
    "BAD",
    "CURVES",
    "DESIGNS",
    "LOCK",
    "METADATA",
    "OLD",
    "OPTIMUM",
    "PARETO",
    "PLAN",
    "PROOF",
    "REMEDY",
    "RUNS",
    "SEARCH",
    "SENSITIVITY",
    "STATUS_NAMES",
    "TEMPORARY",
    "TOLERANCE",
    "Part",
    "about",
    "append_run",
    "beside",
    "check_columns",
    "content_hash",
    "encode",
    "finished_chunks",
    "foreign",
    "front_is_complete",
    "is_complete",
    "is_older",
    "is_whole",
    "listing",
    "load",
    "located",
    "locked",
    "missing_chunks",
    "named_counts",
    "part_of",
    "parts",
    "read_plan",
    "read_runs",
    "read_table",
    "remove_temporary",
    "set_aside",
    "store_errors",
    "totals",
    "trusted_plan",
    "write_atomically",
    "write_chunk",
    "write_plan",
]


def encode(plan: Plan, index: int, result: ChunkResult) -> bytes:
    """Return the Parquet file of a chunk; equal input gives equal bytes.

    Parameters that repeat (lattice axes, fixed values) are dictionary-encoded, everything else byte-stream-split,
    all under zstd.  The file's metadata say what determined the values, the fields' metadata unit and definition.
    Every page carries a checksum, which readers verify if they are asked to.
    """
    import pyarrow as pa
    import pyarrow.parquet as pq

    start, stop = plan.bounds(index)
    own = {
        "format": plan.format, "name": plan.name, "study": plan.study, "code": plan.code, "identity": plan.identity,
        "chunk": index, "chunks": plan.chunks, "start": start, "stop": stop, "designs": plan.designs,
        "counts": named_counts(result.counts_by_status), "missed": result.missed_by_limit, "data": plan.chunk_data,
    }  # fmt: skip
    fields = [
        pa.field(c.name, pa.from_numpy_dtype(c.dtype), metadata={"unit": c.unit, "definition": c.text})
        for c in plan.columns
    ]
    schema = pa.schema(fields, metadata={METADATA: json.dumps(own, sort_keys=True).encode()})
    table = pa.Table.from_arrays([pa.array(result.columns[c.name]) for c in plan.columns], schema=schema)
    dictionary = [*plan.repetitive, "status"]
    split = {c.name: "BYTE_STREAM_SPLIT" for c in plan.columns if c.name not in dictionary}
    sink = pa.BufferOutputStream()
    pq.write_table(
        table,
        sink,
        compression="zstd",
        use_dictionary=dictionary,
        column_encoding=split | {"design": "DELTA_BINARY_PACKED"},
        write_page_checksum=True,
    )
    return bytes(sink.getvalue())


def write_chunk(folder: Path, plan: Plan, index: int, result: ChunkResult) -> Path:
    """Write one chunk so that at every moment its final name holds either nothing or the whole file."""
    data = encode(plan, index, result)
    path = folder / f"part-{index:06d}-{plan.identity}-{content_hash(data)}.parquet"
    write_atomically(path, data, beside(folder))
    return path


def named_counts(counts: Mapping[int, int]) -> dict[str, int]:
    """Return designs by the name of their status."""
    return {STATUS_NAMES.get(code, str(code)): number for code, number in sorted(counts.items())}


def finished_chunks(folder: Path, plan: Plan, tell: Callable[[int, int], None] = lambda _, __: None) -> dict[int, Part]:
    """Return chunks of the plan that need not be computed again; damaged ones are moved to ``_bad/``.

    ``tell`` is called with how many were read, and how many there are.

    Raises
    ------
    InputError
        if a chunk belongs to another study or another version of the code.
    """
    finished: dict[int, Part] = {}
    there = parts(folder)
    for k, part in enumerate(there):
        tell(k, len(there))
        if part.identity != plan.identity or part.index >= plan.chunks:
            raise foreign(folder, f"the chunk {part.path.name}", plan)
        if not is_whole(part):
            set_aside(folder, [part.path], BAD)
        elif part.index in finished:
            raise _twice(folder, finished[part.index], part)
        else:
            finished[part.index] = part
    return finished


def _twice(folder: Path, one: Part, other: Part) -> StoreError:
    names = f"{one.path.name} and {other.path.name}"
    return StoreError(f"{folder}: two different chunks {one.index}, {names}; remove the one you do not trust")


def foreign(folder: Path, found: str, plan: Plan) -> InputError:
    """Return the error for data of another study or code; they are never mixed."""
    allowed = (
        f"data of this study, as its file is now, and of this version of the program (identity {plan.identity}); "
        "take another folder with --out, or set what is there aside with --force"
    )
    return InputError("dataset", found, allowed, str(folder))


def totals(folder: Path) -> tuple[dict[str, int], dict[str, int]]:
    """Designs by the name of their status, and by the limit they miss, from the metadata of all chunks."""
    counts: Counter[str] = Counter()
    missed: Counter[str] = Counter()
    for part in parts(folder):
        found = about(part)
        counts.update(found["counts"])
        missed.update(found["missed"])
    return {name: counts[name] for name in STATUS_NAMES.values() if name in counts}, dict(missed)


def is_complete(folder: str | Path) -> bool:
    """Whether every chunk of the dataset's plan is there and whole, and the optimum too if the study asks for one.

    Parameters
    ----------
    folder : what ``sweep run`` wrote

    Returns
    -------
    bool
        False as well for a folder that is no dataset

    Examples
    --------
    >>> import sweep
    >>> sweep.is_complete("results/press/designs"), sweep.is_complete("results/none")
    (True, False)
    """
    place = located(folder)
    plan = read_plan(place)
    if plan is None:
        return False
    whole = {part.index for part in parts(place) if part.identity == plan["identity"] and is_whole(part)}
    optimum = plan.get("optimised") is not None and (beside(place) / OPTIMUM).is_file()
    front = not plan.get("pareto") or front_is_complete(beside(place) / PARETO)
    return whole == set(range(plan["chunks"])) and ((optimum and front) or not plan["optimise"])


def front_is_complete(path: Path) -> bool:
    """Return whether the search of the front in this file has ended."""
    about = metadata(path)
    return about.get(b"complete") == b"true" or about.get(b"ended") == b"time"


def front_cut_short(path: Path) -> str | None:
    """Tell how much of a front its search time cut short, as ``5 of 28``; None for a whole one, or for none."""
    about = metadata(path)
    return None if about.get(b"complete") != b"false" else about.get(b"steps", b"").decode() or None


def load(folder: str | Path, units: bool = False) -> pd.DataFrame:
    """Return the finished part of a dataset, in design order.

    Parameters
    ----------
    folder : what ``sweep run`` wrote
    units : whether the columns carry their units, ``alpha1 [rad]``

    Returns
    -------
    DataFrame
        ``design``, parameters [mm, rad], outputs, ``status``; ``attrs["units"]`` names the unit of each column.  Units
        and definitions stand in the Parquet field metadata and in ``_plan.json``, too.

    Raises
    ------
    InputError
        if the folder holds no chunks
    StoreError
        if a chunk is damaged, lies under another chunk's name, or is there twice.

    Warns
    -----
    IncompleteWarning
        if chunks are missing.

    Examples
    --------
    >>> import sweep
    >>> rows = sweep.load("results/press/designs")
    >>> len(rows), rows.attrs["units"]["max_pressure_angle"]
    (25, 'rad')
    >>> rows.nsmallest(1, "max_abs_d2s")[["a", "b", "max_abs_d2s"]].round(4).values.tolist()
    [[9.5, 31.5, 12.4546]]
    >>> [name for name in sweep.load("results/press/designs", units=True) if name.startswith(("a", "max_p"))]
    ['a [mm]', 'max_pressure_angle [rad]']
    """
    import pandas as pd

    place = located(folder)
    chunks = parts(place) if place.is_dir() else []
    if not chunks:
        raise InputError("folder", str(folder), "a folder with part-*.parquet written by sweep run", "load")
    for one, other in pairwise(chunks):
        if one.identity != other.identity:
            names = f"{one.path.name} and {other.path.name}"
            raise StoreError(f"{place}: chunks of different studies or sources, {names}; they are not one table")
        if one.index == other.index:
            raise _twice(place, one, other)
    frames = [part.rows() for part in chunks]
    check_columns(chunks)
    missing = missing_chunks(place, chunks)
    if missing:
        text = f"{place}: incomplete, {len(missing)} of {len(missing) + len(chunks)} chunks are missing"
        text += f" (the first is {missing[0]}); run the study again to have them computed"
        warnings.warn(text, IncompleteWarning, stacklevel=2)
    found = pd.concat(frames, ignore_index=True)
    named = units_of(chunks[0])
    if units:
        found = found.rename(
            columns={name: f"{name} [{unit}]" for name, unit in named.items() if unit not in ("", "1")}
        )
    found.attrs["units"] = named
    return found


def units_of(part: Part) -> dict[str, str]:
    """Return the unit of every column of a chunk that has one, as its field metadata say."""
    import pyarrow.parquet as pq

    schema = pq.read_schema(part.path)
    return {field.name: field.metadata[b"unit"].decode() for field in schema if b"unit" in (field.metadata or {})}
