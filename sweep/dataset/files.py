"""The files of a dataset beside its chunks: where they lie, written as a whole or not at all, and read back.

Every reader of Parquet files has its own idea of which files in a folder are data.  So the folder of designs holds
``part-*.parquet`` and nothing else, and they all read the same rows; everything else lies in a folder beside it.
"""

from __future__ import annotations

import contextlib
import errno
import hashlib
import json
import os
from collections.abc import Iterable, Iterator, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

from sweep.errors import StoreError

if TYPE_CHECKING:
    import pandas as pd

PLAN, RUNS, LOCK, BAD, OLD = "_plan.json", "_runs.jsonl", "_lock", "_bad", "_old"
OPTIMUM, CURVES = "_optimum.parquet", "_curves.parquet"
SENSITIVITY, TOLERANCE, MADE = "_sensitivity.parquet", "_tolerance.parquet", "_made.parquet"
PARETO, PROOF = "_pareto.parquet", "_proof.parquet"
OF_OPTIMUM = (OPTIMUM, CURVES, SENSITIVITY, TOLERANCE, MADE)  # what one search writes, the optimum first
SIDE_FILES = (*OF_OPTIMUM, PARETO, PROOF)
SEARCH = "_search.json"  # what a search that is not over has found
TEMPORARY = "_tmp-"

DESIGNS = "designs"
SUFFIX = ".meta"

# Where ``_plan.json`` keeps the hashes of the tables that a finished search has written.
TABLES = "tables"

# What a file system answers that makes no (more) links to a file.
UNLINKABLE = (errno.EXDEV, errno.EPERM, errno.EMLINK, errno.ENOTSUP, errno.EOPNOTSUPP)
# What a system answers where running again alone does not help.
CLOSED = (errno.ELOOP, errno.EACCES, errno.EPERM, errno.ENOTDIR, errno.EROFS, errno.ENAMETOOLONG)

# The key under which a plan carries the hash of everything else that it says.
OWN_HASH = "hash"
# What a plan says at least, and as what.
PLAN_TYPES: Mapping[str, type] = {
    "identity": str, "chunks": int, "chunk_size": int, "name": str, "chunk_data": dict, "optimise": bool,
}  # fmt: skip


def located(folder: str | Path) -> Path:
    """Folder of designs that a user means: the given one, or the ``designs`` in it where it holds no chunks."""
    place = Path(folder)
    inner = place / DESIGNS
    return inner if inner.is_dir() and not any(place.glob("part-*.parquet")) else place


def beside(folder: Path) -> Path:
    """Return the folder of plan, log, lock, optimum and report of a folder of designs.

    It is the parent of a folder called ``designs``, and ``<folder>.meta`` next to any other.
    """
    place = folder.resolve() if folder.is_symlink() or folder.name in ("", "..") else folder
    return place.parent if place.name == DESIGNS else place.with_name(place.name + SUFFIX)


@contextlib.contextmanager
def store_errors(place: Path) -> Iterator[None]:
    """Turn what the operating system reports (disk full, no permission) into a :class:`StoreError`."""
    try:
        yield
    except OSError as error:
        where = error.filename or place
        remedy = "mend that and run again to continue" if error.errno in CLOSED else "run again to continue"
        if error.errno == errno.EEXIST and Path(where).is_symlink():  # and what it leads to is no folder
            raise StoreError(f"{where}: a link that leads to no folder; remove it, or take another folder") from error
        text = f"{where}: {error.strerror or error}; finished chunks are kept, {remedy}"
        raise StoreError(text) from error


@contextlib.contextmanager
def unwritable(place: Path | str) -> Iterator[None]:
    """Turn what the operating system reports of a file for other programs into a :class:`StoreError`."""
    try:
        yield
    except OSError as error:
        raise StoreError(f"{place}: cannot be written: {error}") from error


@contextlib.contextmanager
def replacing(path: Path) -> Iterator[Path]:
    """Yield a name beside a file: what is written there takes the file's name as a whole, or nothing is left."""
    partial = path.with_name(f"{TEMPORARY}{os.getpid()}-{path.name}")
    try:
        with unwritable(path):
            yield partial
            partial.replace(path)
    finally:
        with contextlib.suppress(OSError):  # a disk that can only be read has refused already
            partial.unlink(missing_ok=True)


def write_atomically(path: Path, data: bytes, where: Path | None = None) -> None:
    """Write under a temporary name, bring it to the disk, rename.

    Parameters
    ----------
    path : final name
    data : content
    where : folder of the temporary file, on the same disk; default that of ``path``

    Raises
    ------
    StoreError
        if the disk is full or refuses; nothing half-written is left.
    """
    # Containers of a cluster that share a folder may share process numbers too.
    temporary = (
        path.parent if where is None else where
    ) / f"{TEMPORARY}{os.getpid()}-{os.urandom(4).hex()}-{path.name}"
    with store_errors(path):
        temporary.parent.mkdir(parents=True, exist_ok=True)
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


def set_aside(folder: Path, paths: list[Path], where: str) -> None:
    """Move files of a dataset into a folder beside the chunks."""
    target = beside(folder) / where
    with store_errors(folder):
        target.mkdir(parents=True, exist_ok=True)
        for path in paths:
            to, count = target / path.name, 0
            while to.is_dir() and not to.is_symlink():  # a folder in place of a chunk, set aside before
                count += 1
                to = target / f"{path.name}.{count}"
            path.replace(to)


def link_or_copy(source: Path, target: Path) -> None:
    """Give a file that is never written into a second name; where the file system makes no links it is copied."""
    try:
        os.link(source, target)
    except OSError as error:
        if error.errno not in UNLINKABLE:
            raise
        write_atomically(target, source.read_bytes(), target.parent.parent)


def remove_temporary(folder: Path) -> None:
    """Delete what killed runs left behind; only under the lock."""
    with store_errors(folder):
        for path in beside(folder).glob(f"{TEMPORARY}*"):
            if path.is_file():  # a folder is somebody else's
                path.unlink(missing_ok=True)


def read_plan(folder: Path) -> dict[str, Any] | None:
    """Return the content of ``_plan.json``; None if there is none, or it is not as it was written."""
    path = beside(folder) / PLAN
    if not path.is_file():
        return None
    with store_errors(path):
        text = path.read_bytes()
    try:
        data = json.loads(text)
    except (ValueError, RecursionError):
        return None
    if not isinstance(data, dict) or data.pop(OWN_HASH, None) not in (None, _own_hash(data)):
        return None
    whole = all(isinstance(data.get(key), kind) for key, kind in PLAN_TYPES.items())
    return data if whole and data["chunk_size"] > 0 else None


def trusted_plan(folder: Path) -> dict[str, Any] | None:
    """Return the content of ``_plan.json``, None where there is none.

    Raises
    ------
    StoreError
        if it is not as it was written.
    """
    plan = read_plan(folder)
    path = beside(folder) / PLAN
    if plan is None and os.path.lexists(path):
        raise StoreError(f"{path}: not as a run has written it; run the study again, which writes it anew")
    return plan


def write_plan(folder: Path, data: Mapping[str, Any]) -> None:
    """Replace ``_plan.json`` as a whole; it carries its own hash."""
    data = dict(data) | {OWN_HASH: _own_hash(data)}
    write_atomically(beside(folder) / PLAN, (json.dumps(data, indent=1) + "\n").encode())


def _own_hash(data: Mapping[str, Any]) -> str:
    rest = {key: value for key, value in data.items() if key != OWN_HASH}
    return hashlib.sha256(json.dumps(rest, sort_keys=True).encode()).hexdigest()[:16]


def read_table(path: Path) -> pd.DataFrame:
    """Return a table beside the chunks, such as ``_optimum.parquet``.

    Raises
    ------
    StoreError
        if it is damaged; the checksums of its pages are verified.
    """
    import pandas as pd
    import pyarrow as pa

    try:
        with store_errors(path):
            return pd.read_parquet(path, page_checksum_verification=True)
    except (pa.ArrowException, StoreError, KeyError, ValueError, TypeError) as error:
        text = f"{path}: cannot be read ({str(error).splitlines()[0]}); delete it and run the study again"
        raise StoreError(text) from error


def read_runs(folder: Path) -> list[dict[str, Any]]:
    """Return lines of ``_runs.jsonl``; a line torn by a kill is left out."""
    path = beside(folder) / RUNS
    if not path.is_file():
        return []
    lines = []
    for line in path.read_text(encoding="utf-8", errors="replace").splitlines():
        with contextlib.suppress(ValueError, RecursionError):  # the torn line of a killed run says nothing
            lines.append(json.loads(line))
    return [line for line in lines if isinstance(line, dict)]


def append_run(folder: Path, event: Mapping[str, Any]) -> None:
    """Add one line to ``_runs.jsonl``: who ran when, where, with which versions; nothing that determines a value."""
    path = beside(folder) / RUNS
    with store_errors(path):
        path.parent.mkdir(parents=True, exist_ok=True)
        with path.open("ab+") as file:
            if file.tell() > 0:
                file.seek(-1, os.SEEK_END)
                if file.read(1) != b"\n":
                    file.write(b"\n")
            file.write(json.dumps(event).encode() + b"\n")
            file.flush()
            os.fsync(file.fileno())


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


def check_tables(folder: Path, names: Iterable[str]) -> None:
    """Refuse tables beside the chunks of a dataset that are there, and not as their search has written them.

    Raises
    ------
    StoreError
        for the first such table.
    """
    place = beside(folder)
    for name in altered(place, read_plan(folder) or {}, [name for name in names if (place / name).exists()]):
        text = "not as its search has written it; run the study again to have it searched anew"
        raise StoreError(f"{place / name}: {text}")


def metadata(path: Path) -> dict[bytes, bytes]:
    """Return what a table says of itself; empty where there is none, or it is damaged."""
    import pyarrow as pa
    import pyarrow.parquet as pq

    try:
        return dict(pq.read_schema(path).metadata or {}) if path.is_file() else {}
    except (pa.ArrowException, OSError, ValueError):  # Arrow says OSError, too, of bytes that make no sense
        return {}
