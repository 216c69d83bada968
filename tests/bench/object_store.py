"""A dataset by way of an object store: parts go up, are read there, come down, and are merged; as docs/cluster.md says.

Start a server first, such as ``moto_server -p 5005``, and name its address.
"""

from __future__ import annotations

import argparse
import sys
import tempfile
import time
from pathlib import Path

import pyarrow.dataset as ds
import pyarrow.fs as fs

import sweep
import sweep.chunks.plan
from sweep.engine.parts import merge, split
from tests.support.engine_study import SMALL_CHUNKS, chunk_bytes, write_study

LOCAL = fs.LocalFileSystem()


def upload(designs: Path, store: fs.FileSystem, place: str) -> int:
    """Copy the chunks of a folder; what is there already stays, as a chunk's name holds the hash of its bytes."""
    store.create_dir(place)
    there = {info.base_name for info in store.get_file_info(fs.FileSelector(place))}
    new = [path for path in designs.glob("part-*.parquet") if path.name not in there]
    for path in new:
        fs.copy_files(str(path), f"{place}/{path.name}", source_filesystem=LOCAL, destination_filesystem=store)
    return len(new)


def download(store: fs.FileSystem, place: str, designs: Path) -> int:
    """Copy the chunks of a place into a folder that has none of them yet."""
    designs.mkdir(parents=True, exist_ok=True)
    found = [info for info in store.get_file_info(fs.FileSelector(place)) if info.base_name.startswith("part-")]
    for info in found:
        fs.copy_files(info.path, str(designs / info.base_name), source_filesystem=store, destination_filesystem=LOCAL)
    return len(found)


def main() -> None:
    """Two machines without a common folder, a third that reads and merges."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("address", help="host:port of the server")
    store = fs.S3FileSystem(
        endpoint_override=parser.parse_args().address, scheme="http", access_key="none", secret_key="none",
        region="us-east-1", allow_bucket_creation=True,
    )  # fmt: skip
    with tempfile.TemporaryDirectory() as name:
        folder, place = Path(name), f"sweeps/{time.strftime('%Y%m%d-%H%M%S')}"
        store.create_dir("sweeps")
        vars(sweep.chunks.plan).update(SMALL_CHUNKS)
        study = write_study(folder / "study", count=60)
        whole = sweep.run(study, folder / "whole" / "designs", jobs=1)
        out = folder / "parted" / "designs"
        for part in split(study, out, 2):  # each on a machine of its own
            sweep.run(study, part, jobs=1)
            print(
                f"part {part.parent.name}: {upload(part, store, place)} chunks up, {upload(part, store, place)} again"
            )
            for path in part.glob("part-*"):
                path.unlink()
        rows = ds.dataset(place, filesystem=store, format="parquet").to_table(columns=["design", "status"])
        print(f"read in the store: {rows.num_rows} rows")
        begin = time.monotonic()
        count = download(store, place, folder / "parted" / "parts" / "0000" / "designs")
        print(f"{count} chunks down in {time.monotonic() - begin:.2f} s")
        merge(study, out)
        same = chunk_bytes(whole) == chunk_bytes(out)
        print("the bytes are those of a run in one place" if same else "THE BYTES DIFFER")
        sys.exit(0 if same else 1)


if __name__ == "__main__":
    main()
