"""Files that appear as a whole or not at all, and those beside the chunks: the plan and the log of runs."""

from __future__ import annotations

import contextlib
import errno
import json
import os
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

from sweep.dataset.layout import PLAN, RUNS, TEMPORARY, beside
from sweep.errors import StoreError

if TYPE_CHECKING:
    import pandas as pd

# What a file system answers that makes no (more) links to a file.
UNLINKABLE = (errno.EXDEV, errno.EPERM, errno.EMLINK, errno.ENOTSUP, errno.EOPNOTSUPP)
PLAN_KEYS = {"identity", "chunks", "chunk_size", "name", "chunk_data", "optimise"}


@contextlib.contextmanager
def store_errors(place: Path) -> Iterator[None]:
    """Turn what the operating system reports (disk full, no permission) into a :class:`StoreError`."""
    try:
        yield
    except OSError as error:
        where = error.filename or place
        text = f"{where}: {error.strerror or error}; finished chunks are kept, run again to continue"
        raise StoreError(text) from error


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
            path.replace(target / path.name)


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
    """Return the content of ``_plan.json``; None if there is none or it is damaged."""
    path = beside(folder) / PLAN
    if not path.is_file():
        return None
    with store_errors(path):
        text = path.read_bytes()
    try:
        data = json.loads(text)
    except (ValueError, RecursionError):
        return None
    whole = isinstance(data, dict) and data.keys() >= PLAN_KEYS and isinstance(data["chunk_size"], int)
    return data if whole and data["chunk_size"] > 0 else None


def write_plan(folder: Path, data: Mapping[str, Any]) -> None:
    """Replace ``_plan.json`` as a whole."""
    write_atomically(beside(folder) / PLAN, (json.dumps(data, indent=1) + "\n").encode())


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
        with contextlib.suppress(ValueError):  # the torn line of a killed run says nothing
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
