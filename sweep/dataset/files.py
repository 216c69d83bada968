"""Files of a dataset beside its chunks: their places, atomic writing, and checked reading.

Readers of Parquet files differ in which files of a folder they take for data.  So the folder of designs holds
``part-*.parquet`` and nothing else, and all of them read the same rows; all other files lie in a folder beside it.
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

from sweep.errors import StoreError, reason

if TYPE_CHECKING:
    import pandas as pd

PLAN, RUNS, LOCK, BAD, OLD = "_plan.json", "_runs.jsonl", "_lock", "_bad", "_old"
OPTIMUM, CURVES = "_optimum.parquet", "_curves.parquet"
SENSITIVITY, TOLERANCE, MADE = "_sensitivity.parquet", "_tolerance.parquet", "_made.parquet"
PARETO, PROOF = "_pareto.parquet", "_proof.parquet"
OF_OPTIMUM = (OPTIMUM, CURVES, SENSITIVITY, TOLERANCE, MADE)  # files written by one search, the optimum first
SIDE_FILES = (*OF_OPTIMUM, PARETO, PROOF)
SEARCH = "_search.json"  # intermediate results of an unfinished search
TEMPORARY = "_tmp-"

DESIGNS = "designs"
SUFFIX = ".meta"

# Key in ``_plan.json`` of the hashes of the tables that a finished search has written.
TABLES = "tables"

# Errors of a file system that cannot make a (further) link to a file.
UNLINKABLE = (errno.EXDEV, errno.EPERM, errno.EMLINK, errno.ENOTSUP, errno.EOPNOTSUPP)
# Errors that do not go away by running again.
CLOSED = (errno.ELOOP, errno.EACCES, errno.EPERM, errno.ENOTDIR, errno.EROFS, errno.ENAMETOOLONG)

# Key in ``_plan.json`` of the hash of all its other content.
OWN_HASH = "hash"
# Required keys of a plan, and their types.
PLAN_TYPES: Mapping[str, type] = {
    "identity": str, "chunks": int, "chunk_size": int, "name": str, "chunk_data": dict, "optimise": bool,
}  # fmt: skip


def results_folder(name: str, smoke: bool) -> Path:
    """Folder of the designs of a study for which no other is named."""
    return Path("results", *(["smoke"] if smoke else []), name, DESIGNS)


def located(folder: str | Path) -> Path:
    """Folder of designs: the given folder, or the ``designs`` folder inside if the given one has no chunks."""
    place = Path(folder)
    inner = place / DESIGNS
    return inner if inner.is_dir() and not any(place.glob("part-*.parquet")) else place


def beside(folder: Path) -> Path:
    """Folder of plan, log, lock, optimum and report that belongs to a folder of designs.

    It is the parent of a folder called ``designs``, and ``<folder>.meta`` next to any other.
    """
    place = folder.resolve() if folder.is_symlink() or folder.name in ("", "..") else folder
    return place.parent if place.name == DESIGNS else place.with_name(place.name + SUFFIX)


@contextlib.contextmanager
def store_errors(place: Path) -> Iterator[None]:
    """Convert errors of the operating system (disk full, no permission) to a :class:`StoreError`."""
    try:
        yield
    except OSError as error:
        where = error.filename or place
        remedy = "mend that and run again to continue" if error.errno in CLOSED else "run again to continue"
        remedy = "take another folder" if error.errno in (errno.EEXIST, errno.ENOTDIR) else remedy
        if error.errno == errno.EEXIST and Path(where).is_symlink():  # and its target is no folder
            raise StoreError(f"{where}: a link that leads to no folder; remove it, or take another folder") from error
        text = f"{where}: {error.strerror or error}; finished chunks are kept, {remedy}"
        raise StoreError(text) from error


@contextlib.contextmanager
def unwritable(place: Path | str) -> Iterator[None]:
    """Convert errors of the operating system while an exported file is written to a :class:`StoreError`."""
    try:
        yield
    except OSError as error:
        raise StoreError(f"{place}: cannot be written: {reason(error)}") from error


@contextlib.contextmanager
def replacing(path: Path) -> Iterator[Path]:
    """Yield a temporary name beside a file; the file written there replaces the file as a whole, or is deleted."""
    if not path.parent.is_dir():
        raise StoreError(f"{path}: cannot be written: there is no folder {path.parent}")
    partial = path.with_name(f"{TEMPORARY}{os.getpid()}-{path.name}")
    try:
        with unwritable(path):
            yield partial
            partial.replace(path)
    finally:
        with contextlib.suppress(OSError):  # a read-only disk has raised an error already
            partial.unlink(missing_ok=True)


def write_atomically(path: Path, data: bytes, where: Path | None = None) -> None:
    """Write a file under a temporary name, flush it to disk, and rename it.

    Parameters
    ----------
    path : final name
    data : content
    where : folder of the temporary file, on the same disk; default that of ``path``

    Raises
    ------
    StoreError
        if the disk is full or not writable; no partial file is left.
    """
    # Containers of a cluster that share a folder may have equal process ids.
    temporary = (where or path.parent) / f"{TEMPORARY}{os.getpid()}-{os.urandom(4).hex()}-{path.name}"
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
            while to.is_dir() and not to.is_symlink():  # a folder of this name has been set aside before
                count += 1
                to = target / f"{path.name}.{count}"
            path.replace(to)


def link_or_copy(source: Path, target: Path) -> None:
    """Hard-link an immutable file to a second name; it is copied where the file system makes no links."""
    try:
        os.link(source, target)
    except OSError as error:
        if error.errno not in UNLINKABLE:
            raise
        write_atomically(target, source.read_bytes(), target.parent.parent)


def remove_temporary(folder: Path) -> None:
    """Delete temporary files of killed runs; to be called only under the lock."""
    with store_errors(folder):
        for path in beside(folder).glob(f"{TEMPORARY}*"):
            if path.is_file():  # folders are not made by linksweep
                path.unlink(missing_ok=True)


def read_plan(folder: Path) -> dict[str, Any] | None:
    """Read ``_plan.json``; None if it does not exist or is altered."""
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
    is_valid = all(isinstance(data.get(key), kind) for key, kind in PLAN_TYPES.items())
    return data if is_valid and data["chunk_size"] > 0 else None


def trusted_plan(folder: Path) -> dict[str, Any] | None:
    """Read ``_plan.json``; None if it does not exist.

    Raises
    ------
    StoreError
        if it is altered.
    """
    plan = read_plan(folder)
    path = beside(folder) / PLAN
    if plan is None and os.path.lexists(path):
        raise StoreError(f"{path}: not as a run has written it; run the study again, which writes it anew")
    return plan


def write_plan(folder: Path, data: Mapping[str, Any]) -> None:
    """Replace ``_plan.json`` atomically, with its own hash."""
    data = dict(data) | {OWN_HASH: _own_hash(data)}
    write_atomically(beside(folder) / PLAN, (json.dumps(data, indent=1) + "\n").encode())


def _own_hash(data: Mapping[str, Any]) -> str:
    content = {key: value for key, value in data.items() if key != OWN_HASH}
    return hashlib.sha256(json.dumps(content, sort_keys=True).encode()).hexdigest()[:16]


def read_table(path: Path) -> pd.DataFrame:
    """Read a table beside the chunks, such as ``_optimum.parquet``.

    Raises
    ------
    StoreError
        if it is damaged; the checksums of its pages are verified.
    """
    import pandas as pd
    import pyarrow as pa

    try:
        with store_errors(path):
            # Threads of pyarrow may still hold the file when a program ends, and abort it (apache/arrow 34314, 50482).
            return pd.read_parquet(path, page_checksum_verification=True, use_threads=False)
    except (pa.ArrowException, StoreError, KeyError, ValueError, TypeError) as error:
        text = f"{path}: cannot be read ({str(error).splitlines()[0]}); delete it and run the study again"
        raise StoreError(text) from error


def read_runs(folder: Path) -> list[dict[str, Any]]:
    """Read the lines of ``_runs.jsonl``; an incomplete line of a killed run is left out."""
    path = beside(folder) / RUNS
    if not path.is_file():
        return []
    lines = []
    for line in path.read_text(encoding="utf-8", errors="replace").splitlines():
        with contextlib.suppress(ValueError, RecursionError):  # the incomplete line of a killed run
            lines.append(json.loads(line))
    return [line for line in lines if isinstance(line, dict)]


def append_run(folder: Path, event: Mapping[str, Any]) -> None:
    """Append one line to ``_runs.jsonl``: process, time, machine and versions; it determines no value."""
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
    """SHA-256 of the tables that exist, by name."""
    with store_errors(place):
        return {n: hashlib.sha256((place / n).read_bytes()).hexdigest() for n in names if (place / n).is_file()}


def altered(place: Path, note: Mapping[str, Any], names: Iterable[str]) -> list[str]:
    """List the tables that are missing or altered since their search; tables without a noted hash count as unaltered.

    Parameters
    ----------
    place : folder of the tables
    note : content of ``_plan.json``
    names : names of the tables
    """
    recorded, current = note.get(TABLES) or {}, digests(place, names)
    return [name for name in names if name not in current or recorded.get(name, current[name]) != current[name]]


def check_tables(folder: Path, names: Iterable[str]) -> None:
    """Raise if an existing table beside the chunks is altered since its search.

    Raises
    ------
    StoreError
        for the first altered table.
    """
    place = beside(folder)
    for name in altered(place, read_plan(folder) or {}, [name for name in names if (place / name).exists()]):
        text = "not as its search has written it; run the study again to have it searched anew"
        raise StoreError(f"{place / name}: {text}")


def metadata(path: Path) -> dict[bytes, bytes]:
    """Metadata of a table's schema; empty if the table does not exist or is damaged."""
    import pyarrow as pa
    import pyarrow.parquet as pq

    try:
        return dict(pq.read_schema(path).metadata or {}) if path.is_file() else {}
    except (pa.ArrowException, OSError, ValueError):  # Arrow raises OSError for damaged bytes, too
        return {}


class Kept:
    """Finished parts of a search by name, as JSON; without a path they are kept in memory only.

    Parameters
    ----------
    path : path of the file
    key : hash of everything that the search depends on; parts of a search with another key are discarded
    """

    def __init__(self, path: Path | None = None, key: str = "") -> None:
        self.path, self.key, self.parts = path, key, dict[str, Any]()
        try:
            content = json.loads(path.read_bytes()) if path is not None and path.is_file() else {}
            self.parts = content["parts"] if content.get("key") == key else {}
        except (ValueError, KeyError, AttributeError):  # damaged: start again
            self.parts = {}

    def note(self, name: str, part: Any) -> None:
        """Keep a finished part."""
        self.parts[name] = part
        if self.path is not None:
            write_atomically(self.path, json.dumps({"key": self.key, "parts": self.parts}).encode())

    def forget(self) -> None:
        """Remove the file of a finished search."""
        if self.path is not None:
            self.path.unlink(missing_ok=True)
