"""Chunk files of a dataset: Parquet files named by content, written once, checked when they are read.

A chunk is written beside the folder of designs, flushed to disk, renamed into the folder, and never changed.  Its name

    part-<index>-<identity of study, code, cut and columns>-<hash of the file>.parquet

says what it holds and whether it is whole, so the folder needs no manifest and survives a kill at any moment.  The
file's metadata repeat index and identity, so a file under another chunk's name is noticed.
"""

from __future__ import annotations

import hashlib
import json
import re
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from kernels import status as codes
from sweep.dataset.files import beside, located, read_plan, store_errors, write_atomically
from sweep.errors import InputError, StoreError

if TYPE_CHECKING:
    import pandas as pd
    import pyarrow as pa
    import pyarrow.parquet as pq

    from sweep.chunks.chunk import ChunkResult
    from sweep.chunks.plan import Plan

METADATA = b"linksweep"
MOST_BYTES = 2**30  # largest size of a chunk; chunks are planned to have a thirtieth of it
ROWS_PER_BATCH = 262_144  # rows that are read at a time, at most
REMEDY = "run the study again to have it computed anew"

# Required metadata of a chunk, and their types.
ABOUT_TYPES = {"chunk": int, "identity": str, "start": int, "stop": int, "counts": dict, "missed": dict}

_PART = re.compile(r"part-(\d{6,})-([0-9a-f]{12})-([0-9a-f]{16})\.parquet")

STATUS_NAMES = {value: name for name, value in vars(codes).items() if name.isupper() and isinstance(value, int)}


@dataclass(frozen=True)
class ChunkFile:
    """A chunk file, described by its name."""

    path: Path
    index: int
    identity: str
    digest: str

    def read(self) -> tuple[pq.ParquetFile, dict[str, Any]]:
        """Read the whole file, check its hash, and return the opened Parquet file and its metadata (see `about`).

        Raises
        ------
        StoreError
            if the file is damaged, or holds another chunk than its name says.
        """
        import pyarrow as pa

        self.check_file()
        with store_errors(self.path):
            data = self.path.read_bytes()
        if content_hash(data) != self.digest:
            raise StoreError(f"{self.path}: damaged chunk; {REMEDY}")
        return _opened(self, pa.BufferReader(data))

    def opened(self) -> tuple[pq.ParquetFile, dict[str, Any]]:
        """Open the file, and return it with its metadata (see `about`); its rows are not read.

        Raises
        ------
        StoreError
            if the metadata cannot be read, or belong to another chunk than the name says.
        """
        self.check_file()
        return _opened(self, self.path)

    def rows(self) -> pd.DataFrame:
        """Return all rows, after the checks of `read`."""
        rows: pd.DataFrame = self.read()[0].read().to_pandas()
        return rows

    def check_file(self) -> None:
        """Check that the path is a file of plausible size before it is opened: reading a pipe would never end.

        Raises
        ------
        StoreError
            if it is a folder, a pipe or a broken link, or too large.
        """
        with store_errors(self.path):
            sound = self.path.is_file() and self.path.stat().st_size <= MOST_BYTES
        if not sound:
            raise StoreError(f"{self.path}: damaged chunk; {REMEDY}")


def about(part: ChunkFile) -> dict[str, Any]:
    """Read the metadata of a chunk: study, code, identity, index, range of designs, counts.

    Raises
    ------
    StoreError
        if the metadata cannot be read, or belong to another chunk than the name says.
    """
    return part.opened()[1]


def _opened(part: ChunkFile, source: Path | pa.BufferReader) -> tuple[pq.ParquetFile, dict[str, Any]]:
    import pyarrow as pa
    import pyarrow.parquet as pq

    try:
        with store_errors(part.path):
            file = pq.ParquetFile(source)
        metadata = json.loads(file.metadata.metadata[METADATA])
        stated = metadata["chunk"], metadata["identity"]
        for key, kind in ABOUT_TYPES.items():
            if not isinstance(metadata[key], kind):
                raise TypeError(key)
        if not all(isinstance(metadata.get(key, 0), int) for key in ("chunks", "designs")):
            raise TypeError("chunks")
    except (pa.ArrowException, ValueError, KeyError, TypeError) as error:
        raise StoreError(f"{part.path}: damaged chunk; {REMEDY}") from error
    if stated != (part.index, part.identity):
        names = f"chunk {stated[0]} of {stated[1]} under the name of chunk {part.index} of {part.identity}"
        raise StoreError(f"{part.path}: {names}; {REMEDY}")
    return file, metadata


def content_hash(data: bytes) -> str:
    """Hash at the end of a chunk's file name."""
    return hashlib.sha256(data).hexdigest()[:16]


def parts(folder: Path) -> list[ChunkFile]:
    """List the chunk files of a folder in design order.

    Raises
    ------
    InputError
        if the folder holds other files, which Parquet readers would take for data.
    """
    chunks, strangers = listing(folder)
    strangers = [path for path in strangers if not path.name.startswith("_")]  # pandas and pyarrow ignore these
    if strangers:
        names = ", ".join(path.name for path in strangers[:3])
        allowed = "chunks named part-<index>-<identity>-<hash>.parquet"
        if (folder / "study.toml").exists():
            allowed += "; this is the folder of a study, and sweep run writes its dataset elsewhere"
        raise InputError("file", names, allowed, str(folder))
    return chunks


def required_parts(folder: str | Path, verb: str) -> tuple[Path, list[ChunkFile]]:
    """Return the folder of designs of a dataset, and its chunk files as :func:`parts` lists them.

    Raises
    ------
    InputError
        also if there are none.
    """
    place = located(folder)
    if not (chunks := parts(place)):
        raise InputError("folder", str(folder), "a folder with part-*.parquet written by sweep run", verb)
    return place, chunks


def listing(folder: Path) -> tuple[list[ChunkFile], list[Path]]:
    """List the chunks of a folder in design order, and all other entries; no file is opened.

    Hidden files are ignored.
    """
    with store_errors(folder):
        entries = sorted(path for path in folder.iterdir() if path.name[0] != ".") if folder.is_dir() else []
    named = {path: match for path in entries if (match := _PART.fullmatch(path.name)) is not None}
    chunks = {path: ChunkFile(path, int(match[1]), match[2], match[3]) for path, match in named.items()}
    ordered = sorted(chunks.values(), key=lambda part: (part.index, part.path.name))
    return ordered, [path for path in entries if path not in chunks]


def is_whole(part: ChunkFile) -> bool:
    """Whether the file is undamaged and holds the chunk that its name says."""
    try:
        part.read()
    except StoreError as error:
        if isinstance(error.__cause__, OSError):  # a read error of the disk says nothing about the chunk
            raise
        return False
    return True


def batches(paths: Iterable[Path], columns: list[str] | None = None) -> Iterator[pa.RecordBatch]:
    """Yield all rows of chunks, or some columns of them, in order.

    Columns are read without threads, which would take longer than the reading for chunks of the usual size.
    """
    import pyarrow.parquet as pq

    for path in paths:
        with pq.ParquetFile(path) as source:
            yield from source.iter_batches(batch_size=ROWS_PER_BATCH, columns=columns, use_threads=False)


def check_columns(chunks: Sequence[ChunkFile], schemas: Iterable[pa.Schema] = ()) -> None:
    """Check that all chunks have the columns of the first one; ``schemas`` are those of the chunks, if known.

    Raises
    ------
    StoreError
        for the first chunk that cannot be opened or has other columns; the message names those that differ.
    """
    expected: list[str] = []
    for part, schema in zip(chunks, schemas or (part.opened()[0].schema_arrow for part in chunks), strict=True):
        columns = schema.names
        expected = expected or columns
        if columns != expected:
            part.read()  # a damaged file is reported as such
            differing = ", ".join(sorted({*expected} ^ {*columns})) or "their order"
            raise StoreError(
                f"{part.path}: other columns than {chunks[0].path.name} ({differing}); move it away, then run again"
            )


def missing_chunks(folder: Path, chunks: list[ChunkFile]) -> list[int]:
    """List the indices of missing chunks; their number is taken from the first chunk, or from the plan."""
    plan = read_plan(folder) or {}
    count = about(chunks[0]).get("chunks") if chunks else None
    return sorted(set(range(plan.get("chunks", 0) if count is None else count)) - {part.index for part in chunks})


def encode(plan: Plan, index: int, result: ChunkResult) -> bytes:
    """Encode a chunk as a Parquet file; equal input gives equal bytes.

    Parameters that repeat (lattice axes, fixed values) are dictionary-encoded, all other columns byte-stream-split, all
    compressed by zstd.  The file's metadata hold all that determined the values, the fields' metadata unit and
    definition.  Every page has a checksum, which readers verify on request.
    """
    import pyarrow as pa
    import pyarrow.parquet as pq

    start, stop = plan.bounds(index)
    metadata = {
        "format": plan.format, "name": plan.name, "study": plan.study, "code": plan.code, "identity": plan.identity,
        "chunk": index, "chunks": plan.chunks, "start": start, "stop": stop, "designs": plan.designs,
        "counts": named_counts(result.counts_by_status), "missed": result.missed_by_limit, "data": plan.chunk_data,
    }  # fmt: skip
    fields = [
        pa.field(c.name, pa.from_numpy_dtype(c.dtype), metadata={"unit": c.unit, "definition": c.text})
        for c in plan.columns
    ]
    schema = pa.schema(fields, metadata={METADATA: json.dumps(metadata, sort_keys=True).encode()})
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
    """Write one chunk atomically: its final name never holds an incomplete file."""
    data = encode(plan, index, result)
    path = folder / f"part-{index:06d}-{plan.identity}-{content_hash(data)}.parquet"
    write_atomically(path, data, beside(folder))
    return path


def named_counts(counts: Mapping[int, int]) -> dict[str, int]:
    """Replace status codes by their names in a count by status."""
    return {STATUS_NAMES.get(code, str(code)): number for code, number in sorted(counts.items())}


def noted(schema: pa.Schema, key: bytes = b"unit") -> dict[str, str]:
    """Units or definitions of columns, from the metadata of the fields that have one."""
    return {field.name: field.metadata[key].decode() for field in schema if key in (field.metadata or {})}
