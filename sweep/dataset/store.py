"""The dataset folder: immutable Parquet chunks that prove themselves, a plan, a log of runs, and a lock.

A chunk is written under a name that pandas ignores, brought to the disk, renamed, and never touched again.  Its name

    part-<index>-<identity of study, code, cut and columns>-<hash of the file>.parquet

says what it holds and whether it is whole, so the folder needs no manifest and survives a kill at any moment.
"""

from __future__ import annotations

import contextlib
import hashlib
import json
import os
import re
from collections import Counter
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from kernels import status as codes
from sweep.errors import InputError, LockedError, StoreError

if TYPE_CHECKING:
    import pandas as pd

    from sweep.chunks.chunk import ChunkResult
    from sweep.chunks.plan import Plan

PLAN, RUNS, LOCK, BAD, OLD = "_plan.json", "_runs.jsonl", "_lock", "_bad", "_old"
OPTIMUM, CURVES = "_optimum.parquet", "_curves.parquet"
SENSITIVITY, TOLERANCE, PARETO = "_sensitivity.parquet", "_tolerance.parquet", "_pareto.parquet"
TEMPORARY = "_tmp-"
PLAN_KEYS = {"identity", "chunks", "chunk_size", "name", "chunk_data", "optimise"}
METADATA = b"linksweep"

_PART = re.compile(r"part-(\d{6,})-([0-9a-f]{12})-([0-9a-f]{16})\.parquet")

STATUS_NAMES = {value: name for name, value in vars(codes).items() if name.isupper() and isinstance(value, int)}


@dataclass(frozen=True)
class Part:
    """A chunk file by its name."""

    path: Path
    index: int
    identity: str
    digest: str


@contextlib.contextmanager
def store_errors(place: Path) -> Iterator[None]:
    """Turn what the operating system reports (disk full, no permission) into a :class:`StoreError`."""
    try:
        yield
    except OSError as error:
        where = error.filename or place
        text = f"{where}: {error.strerror or error}; finished chunks are kept, run again to continue"
        raise StoreError(text) from error


@contextlib.contextmanager
def locked(folder: Path) -> Iterator[None]:
    """Hold the folder for this process; the lock dies with it.

    Raises
    ------
    LockedError
        if another run holds it
    StoreError
        if the folder cannot be made or written to
    """
    from filelock import FileLock, Timeout

    with store_errors(folder):
        folder.mkdir(parents=True, exist_ok=True)
        lock = FileLock(folder / LOCK, timeout=0)
        try:
            lock.acquire()
        except Timeout:
            raise LockedError(f"{folder}: another run is writing here ({_holder(folder)})") from None
    try:
        yield
    finally:
        lock.release()


def _holder(folder: Path) -> str:
    starts = [line for line in read_runs(folder) if line.get("event") == "start"]
    if not starts:
        return "it has not said which"
    return f"process {starts[-1]['pid']} on {starts[-1]['host']} since {starts[-1]['time']}"


def encode(plan: Plan, index: int, result: ChunkResult) -> bytes:
    """The Parquet file of a chunk; equal input gives equal bytes.

    Parameters that repeat (lattice axes, fixed values) are dictionary-encoded, everything else byte-stream-split,
    all under zstd.  The file's metadata say what determined the values, the fields' metadata unit and definition.
    """
    import pyarrow as pa
    import pyarrow.parquet as pq

    start, stop = plan.bounds(index)
    about = {
        "format": 1, "name": plan.name, "study": plan.study, "code": plan.code, "identity": plan.identity,
        "chunk": index, "start": start, "stop": stop, "counts": named_counts(result.counts_by_status),
        "missed": result.missed_by_limit,
        "data": plan.chunk_data,
    }  # fmt: skip
    fields = [
        pa.field(c.name, pa.from_numpy_dtype(c.dtype), metadata={"unit": c.unit, "definition": c.text})
        for c in plan.columns
    ]
    schema = pa.schema(fields, metadata={METADATA: json.dumps(about, sort_keys=True).encode()})
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
    )
    return bytes(sink.getvalue())


def write_chunk(folder: Path, plan: Plan, index: int, result: ChunkResult) -> Path:
    """Write one chunk so that at every moment its final name holds either nothing or the whole file."""
    data = encode(plan, index, result)
    path = folder / f"part-{index:06d}-{plan.identity}-{content_hash(data)}.parquet"
    write_atomically(path, data)
    return path


def write_atomically(path: Path, data: bytes) -> None:
    """Write under a temporary name, bring it to the disk, rename.

    Raises
    ------
    StoreError
        if the disk is full or refuses; nothing half-written is left.
    """
    temporary = path.with_name(f"{TEMPORARY}{os.getpid()}-{path.name}")
    with store_errors(path):
        try:
            with temporary.open("wb") as file:
                file.write(data)
                file.flush()
                os.fsync(file.fileno())
            temporary.replace(path)
        except BaseException:
            temporary.unlink(missing_ok=True)
            raise
        _sync_folder(path.parent)


def _sync_folder(folder: Path) -> None:
    descriptor = os.open(folder, os.O_RDONLY)
    try:
        os.fsync(descriptor)
    finally:
        os.close(descriptor)


def content_hash(data: bytes) -> str:
    """The hash that stands at the end of a chunk's name."""
    return hashlib.sha256(data).hexdigest()[:16]


def named_counts(counts: Mapping[int, int]) -> dict[str, int]:
    """Designs by the name of their status."""
    return {STATUS_NAMES.get(code, str(code)): number for code, number in sorted(counts.items())}


def parts(folder: Path) -> list[Part]:
    """The chunk files by their names, in design order.

    Raises
    ------
    InputError
        if the folder holds a Parquet file that is no chunk: pandas would read it as part of the data.
    """
    found = []
    for path in sorted(folder.glob("[!_.]*.parquet")):
        match = _PART.fullmatch(path.name)
        if match is None:
            raise InputError("file", path.name, "chunks named part-<index>-<identity>-<hash>.parquet", str(folder))
        found.append(Part(path, int(match[1]), match[2], match[3]))
    return found


def is_whole(part: Part) -> bool:
    """Whether the file is what its name says."""
    with store_errors(part.path):
        return content_hash(part.path.read_bytes()) == part.digest


def finished_chunks(folder: Path, plan: Plan) -> dict[int, Part]:
    """Chunks of the plan that need not be computed again; damaged ones are moved to ``_bad/``.

    Raises
    ------
    InputError
        if a chunk belongs to another study or another version of the code.
    """
    finished: dict[int, Part] = {}
    for part in parts(folder):
        if part.identity != plan.identity or part.index >= plan.chunks:
            raise foreign(folder, f"the chunk {part.path.name}", plan)
        if not is_whole(part):
            set_aside(folder, [part.path], BAD)
        elif part.index in finished:
            raise StoreError(f"{folder}: two different chunks {part.index}, {finished[part.index].path.name} and "
                             f"{part.path.name}; remove the one you do not trust")  # fmt: skip
        else:
            finished[part.index] = part
    return finished


def foreign(folder: Path, found: str, plan: Plan) -> InputError:
    """The error for data of another study or code; they are never mixed."""
    allowed = (
        f"chunks of study {plan.study[:12]} and code {plan.code[:12]} only (identity {plan.identity}); "
        "choose another folder with --out, or set the old data aside with --force"
    )
    return InputError("dataset", found, allowed, str(folder))


def set_aside(folder: Path, paths: list[Path], where: str) -> None:
    """Move files into a subfolder that begins with an underscore, where pandas does not see them."""
    with store_errors(folder):
        (folder / where).mkdir(parents=True, exist_ok=True)
        for path in paths:
            path.replace(folder / where / path.name)


def remove_temporary(folder: Path) -> None:
    """Delete what killed runs left behind; only under the lock."""
    with store_errors(folder):
        for path in folder.glob(f"{TEMPORARY}*"):
            path.unlink(missing_ok=True)


def read_plan(folder: Path) -> dict[str, Any] | None:
    """Content of ``_plan.json``; None if there is none or it is damaged."""
    path = folder / PLAN
    if not path.is_file():
        return None
    with store_errors(path):
        text = path.read_bytes()
    try:
        data = json.loads(text)
    except ValueError:
        return None
    whole = isinstance(data, dict) and data.keys() >= PLAN_KEYS and isinstance(data["chunk_size"], int)
    return data if whole and data["chunk_size"] > 0 else None


def write_plan(folder: Path, data: Mapping[str, Any]) -> None:
    """Replace ``_plan.json`` as a whole."""
    write_atomically(folder / PLAN, (json.dumps(data, indent=1) + "\n").encode())


def read_runs(folder: Path) -> list[dict[str, Any]]:
    """Lines of ``_runs.jsonl``; a line torn by a kill is left out."""
    path = folder / RUNS
    if not path.is_file():
        return []
    lines = []
    for line in path.read_text(encoding="utf-8", errors="replace").splitlines():
        with contextlib.suppress(ValueError):  # the torn line of a killed run says nothing
            lines.append(json.loads(line))
    return lines


def append_run(folder: Path, event: Mapping[str, Any]) -> None:
    """Add one line to ``_runs.jsonl``: who ran when, where, with which versions; nothing that determines a value."""
    path = folder / RUNS
    with store_errors(path), path.open("ab+") as file:
        if file.tell() > 0:
            file.seek(-1, os.SEEK_END)
            if file.read(1) != b"\n":
                file.write(b"\n")
        file.write(json.dumps(event).encode() + b"\n")
        file.flush()
        os.fsync(file.fileno())


def totals(folder: Path) -> tuple[dict[str, int], dict[str, int]]:
    """Designs by the name of their status, and by the limit they miss, over all chunks, from the chunks' metadata."""
    import pyarrow.parquet as pq

    counts: Counter[str] = Counter()
    missed: Counter[str] = Counter()
    for part in parts(folder):
        with store_errors(part.path):
            about = json.loads(pq.read_metadata(part.path).metadata[METADATA])
        counts.update(about["counts"])
        missed.update(about["missed"])
    return {name: counts[name] for name in STATUS_NAMES.values() if name in counts}, dict(missed)


def is_complete(folder: str | Path) -> bool:
    """Whether every chunk of the folder's plan is there and whole, and the optimum too if the study asks for one."""
    place = Path(folder)
    plan = read_plan(place)
    if plan is None:
        return False
    whole = {part.index for part in parts(place) if part.identity == plan["identity"] and is_whole(part)}
    optimum = plan.get("optimised") is not None and (place / OPTIMUM).is_file()
    front = not plan.get("pareto") or _front_is_complete(place / PARETO)
    return whole == set(range(plan["chunks"])) and ((optimum and front) or not plan["optimise"])


def _front_is_complete(path: Path) -> bool:
    import pyarrow.parquet as pq

    about = (pq.read_schema(path).metadata or {}) if path.is_file() else {}
    return about.get(b"complete") == b"true" or about.get(b"ended") == b"time"


def front_cut_short(path: Path) -> str | None:
    """``5 of 28`` steps of a front whose search time has cut short; None for a whole one, or where there is none."""
    import pyarrow.parquet as pq

    about = (pq.read_schema(path).metadata or {}) if path.is_file() else {}
    return None if about.get(b"complete") != b"false" else about.get(b"steps", b"").decode() or None


def load(folder: str | Path) -> pd.DataFrame:
    """The finished part of a dataset, in design order.

    Parameters
    ----------
    folder : what ``sweep run`` wrote

    Returns
    -------
    DataFrame
        ``design``, parameters [mm, rad], outputs, ``status``; units and definitions stand in the Parquet field
        metadata and in ``_plan.json``.

    Raises
    ------
    InputError
        if the folder holds no chunks
    StoreError
        if a chunk is damaged.
    """
    import pandas as pd

    place = Path(folder)
    chunks = parts(place) if place.is_dir() else []
    if not chunks:
        raise InputError("folder", str(folder), "a folder with part-*.parquet written by sweep run", "load")
    frames = []
    for part in chunks:
        if not is_whole(part):
            raise StoreError(f"{part.path}: damaged chunk; run the study again to have it computed anew")
        frames.append(pd.read_parquet(part.path))
    return pd.concat(frames, ignore_index=True)
