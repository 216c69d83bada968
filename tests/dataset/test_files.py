"""The files of a dataset: what stands in a chunk, how its name proves it, what the readers refuse."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pyarrow.parquet as pq
import pytest

from sweep.chunks.chunk import ChunkResult
from sweep.chunks.plan import Column, Plan
from sweep.dataset.chunk_files import METADATA, content_hash, encode, is_whole, parts, write_chunk
from sweep.dataset.files import append_run, read_runs, write_atomically
from sweep.dataset.store import finished_chunks, is_complete, load, totals
from sweep.errors import InputError, StoreError

PLAN = Plan(
    name="tiny",
    study="a" * 64,
    code="b" * 16,
    designs=2500,
    chunk_size=1000,
    columns=(
        Column("design", "int64", "1", "index", "index"),
        Column("a", "float64", "mm", "crank", "parameter"),
        Column("swing", "float32", "rad", "swing of the rocker", "output"),
        Column("status", "uint8", "1", "0 = ok", "status"),
    ),
    repetitive=("a",),
    chunk_data={"mechanism": {"family": "rssr"}},
)


def rows(start: int, stop: int) -> ChunkResult:
    index = np.arange(start, stop, dtype=np.int64)
    columns = {
        "design": index,
        "a": 10.0 + index % 7,
        "swing": np.sin(index).astype(np.float32),
        "status": (index % 3 == 0).astype(np.uint8) * np.uint8(5),
    }
    counts = np.bincount(columns["status"])
    return ChunkResult(
        columns, {int(code): int(counts[code]) for code in np.flatnonzero(counts)}, {"swing": int(counts[5])}
    )


def fill(folder: Path) -> list[Path]:
    return [write_chunk(folder, PLAN, k, rows(*PLAN.bounds(k))) for k in range(PLAN.chunks)]


def test_chunk_says_units_definitions_and_what_determined_it(tmp_path: Path) -> None:
    schema = pq.read_schema(fill(tmp_path)[1])
    assert schema.field("a").metadata == {b"unit": b"mm", b"definition": b"crank"}
    assert schema.field("swing").metadata == {b"unit": b"rad", b"definition": b"swing of the rocker"}
    about = json.loads(schema.metadata[METADATA])
    assert (about["study"], about["code"], about["identity"]) == (PLAN.study, PLAN.code, PLAN.identity)
    assert (about["chunk"], about["start"], about["stop"]) == (1, 1000, 2000)
    assert about["counts"] == {"OK": 667, "LIMIT_EXCEEDED": 333}
    assert about["data"] == PLAN.chunk_data


def test_encodings_are_dictionary_for_axes_and_byte_streams_for_results(tmp_path: Path) -> None:
    group = pq.ParquetFile(fill(tmp_path)[0]).metadata.row_group(0)
    columns = {group.column(k).path_in_schema: group.column(k) for k in range(group.num_columns)}
    assert {column.compression for column in columns.values()} == {"ZSTD"}
    assert "RLE_DICTIONARY" in columns["a"].encodings and "RLE_DICTIONARY" in columns["status"].encodings
    assert "BYTE_STREAM_SPLIT" in columns["swing"].encodings
    assert "RLE_DICTIONARY" not in columns["swing"].encodings
    assert "DELTA_BINARY_PACKED" in columns["design"].encodings


def test_name_is_index_identity_and_hash_of_the_bytes(tmp_path: Path) -> None:
    path = fill(tmp_path)[2]
    assert path.name == f"part-000002-{PLAN.identity}-{content_hash(path.read_bytes())}.parquet"
    assert encode(PLAN, 2, rows(2000, 2500)) == path.read_bytes()
    (part,) = [part for part in parts(tmp_path) if part.index == 2]
    assert is_whole(part)
    path.write_bytes(path.read_bytes()[:-1])
    assert not is_whole(part)


def test_identity_changes_with_everything_that_determines_a_chunk() -> None:
    from dataclasses import replace

    column = replace(PLAN.columns[2], dtype="float64")
    others = [
        replace(PLAN, study="c" * 64),
        replace(PLAN, code="c" * 16),
        replace(PLAN, designs=2501),
        replace(PLAN, chunk_size=1001),
        replace(PLAN, columns=(*PLAN.columns[:2], column, PLAN.columns[3])),
    ]
    assert len({plan.identity for plan in [PLAN, *others]}) == 6


def test_load_is_in_design_order_and_counts_add_up(tmp_path: Path) -> None:
    for index in (2, 0, 1):
        write_chunk(tmp_path, PLAN, index, rows(*PLAN.bounds(index)))
    assert load(tmp_path)["design"].tolist() == list(range(2500))
    assert totals(tmp_path) == ({"OK": 1666, "LIMIT_EXCEEDED": 834}, {"swing": 834})


def test_parquet_file_that_is_no_chunk_is_refused(tmp_path: Path) -> None:
    path = fill(tmp_path)[0]
    path.with_name("_mine.parquet").write_bytes(path.read_bytes())
    assert len(parts(tmp_path)) == 3
    path.with_name("mine.parquet").write_bytes(path.read_bytes())
    with pytest.raises(InputError, match=r"mine\.parquet"):
        parts(tmp_path)


def test_two_different_chunks_of_one_index_are_an_error(tmp_path: Path) -> None:
    fill(tmp_path)
    write_chunk(tmp_path, PLAN, 1, rows(1000, 1999))
    with pytest.raises(StoreError, match="two different chunks 1"):
        finished_chunks(tmp_path, PLAN)


def test_load_without_chunks_is_an_error(tmp_path: Path) -> None:
    for folder in (tmp_path, tmp_path / "nowhere"):
        with pytest.raises(InputError, match="folder"):
            load(folder)
        assert not is_complete(folder)


def test_failed_write_leaves_nothing(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def full(descriptor: int) -> None:
        raise OSError(28, "No space left on device")

    target = tmp_path / "part.bin"
    target.write_bytes(b"old")
    monkeypatch.setattr("os.fsync", full)
    with pytest.raises(StoreError, match="No space left on device"):
        write_atomically(target, b"new")
    assert target.read_bytes() == b"old"
    assert [path.name for path in tmp_path.iterdir()] == ["part.bin"]


def test_log_survives_a_torn_line(tmp_path: Path) -> None:
    append_run(tmp_path, {"event": "start", "n": 1})
    with (tmp_path / "_runs.jsonl").open("ab") as file:
        file.write(b'{"event": "en')
    append_run(tmp_path, {"event": "start", "n": 2})
    assert [line["n"] for line in read_runs(tmp_path)] == [1, 2]
