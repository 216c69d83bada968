"""Where the files of a dataset lie, and that every reader of a folder of Parquet files sees the same rows."""

from __future__ import annotations

import json
import shutil
from pathlib import Path

import pandas as pd
import pyarrow as pa
import pyarrow.parquet as pq
import pytest
from click.testing import CliRunner

import sweep
import sweep.chunks.plan
from sweep.cli import main
from sweep.dataset import chunk_files, files, store
from sweep.dataset.files import LOCK, OLD, OPTIMUM, PLAN, RUNS, beside, located
from sweep.dataset.lock import locked
from sweep.errors import IncompleteWarning, InputError, LockedError, StoreError
from sweep.study import Study, load_study
from tests.support.engine_study import SMALL_CHUNKS, chunk_bytes, write_study

OPTIMISE = '\n[objective]\nminimise = "max_abs_d2psi"\n[optimise]\nstarts = 1\nseed = 1\n'


@pytest.fixture(scope="module")
def study(tmp_path_factory: pytest.TempPathFactory) -> Study:
    path = write_study(tmp_path_factory.mktemp("study"), keep="feasible", count=40)
    path.write_text(path.read_text() + OPTIMISE)
    return load_study(path)


@pytest.fixture(scope="module")
def made(study: Study, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A dataset of several chunks with an optimum and a report."""
    with pytest.MonkeyPatch.context() as patch:
        for name, value in SMALL_CHUNKS.items():
            patch.setattr(sweep.chunks.plan, name, value)
        folder = sweep.run(study, tmp_path_factory.mktemp("made") / "tiny" / "designs", jobs=1)
    done = CliRunner().invoke(main, ["report", str(folder)])
    assert done.exit_code == 0, done.output
    return folder


@pytest.fixture
def copy(made: Path, tmp_path: Path) -> Path:
    shutil.copytree(made.parent, tmp_path / "copy")
    return tmp_path / "copy" / "designs"


def older(folder: Path, target: Path) -> Path:
    """The same dataset as an earlier version left it: all in one folder, chunks that do not tell their number."""
    target.mkdir()
    for part in chunk_files.parts(folder):
        schema = pq.read_schema(part.path)
        about = json.loads(schema.metadata[chunk_files.METADATA])
        del about["chunks"], about["designs"]
        table = pq.read_table(part.path)
        table = table.replace_schema_metadata({chunk_files.METADATA: json.dumps(about | {"format": 1}).encode()})
        sink = pa.BufferOutputStream()
        pq.write_table(table, sink)
        data = bytes(sink.getvalue())
        (target / f"part-{part.index:06d}-{part.identity}-{chunk_files.content_hash(data)}.parquet").write_bytes(data)
    for name in (PLAN, RUNS, OPTIMUM, LOCK):
        shutil.copy(beside(folder) / name, target / name)
    return target


def test_every_reader_of_a_folder_counts_the_same_rows(made: Path) -> None:
    import dask.dataframe
    import duckdb
    import polars

    rows = len(sweep.load(made))
    assert rows > 1000 and len(chunk_files.parts(made)) > 3
    assert len(pd.read_parquet(made)) == rows
    assert polars.read_parquet(made).height == rows
    assert polars.scan_parquet(made / "*.parquet").collect().height == rows
    assert duckdb.sql(f"select count(*) from '{made}/*.parquet'").fetchall() == [(rows,)]
    assert duckdb.sql(f"select count(*) from '{made}/**/*.parquet'").fetchall() == [(rows,)]
    assert len(dask.dataframe.read_parquet(made)) == rows
    assert pq.read_table(made).num_rows == rows


def test_chunks_lie_alone_and_everything_else_beside_them(made: Path) -> None:
    assert {path.name.split("-")[0] for path in made.iterdir()} == {"part"}
    there = {path.name for path in made.parent.iterdir()}
    assert {PLAN, RUNS, LOCK, OPTIMUM, "_curves.parquet", "_sensitivity.parquet", "report.html", "designs"} <= there
    assert sweep.is_complete(made)


def test_folder_of_another_name_has_its_own_place_for_the_rest(study: Study, tmp_path: Path) -> None:
    one, other = (sweep.run(study, tmp_path / name, jobs=1) for name in ("one", "other"))
    assert {path.name for path in tmp_path.iterdir()} == {"one", "one.meta", "other", "other.meta"}
    assert chunk_bytes(one) == chunk_bytes(other) and (tmp_path / "one.meta" / OPTIMUM).is_file()
    assert sweep.compare(one, other).exit_code == 0


def test_the_folder_that_holds_designs_stands_for_them(study: Study, made: Path, copy: Path) -> None:
    assert located(made.parent) == located(made) == made
    pd.testing.assert_frame_equal(sweep.load(made.parent), sweep.load(made))
    assert sweep.is_complete(made.parent) and sweep.compare(made.parent, copy).exit_code == 0
    assert sweep.run(study, copy.parent, jobs=1) == copy and files.read_runs(copy)[-1]["text"] == "0 chunks computed"


def test_a_link_to_the_folder_is_the_folder(made: Path, copy: Path, tmp_path: Path) -> None:
    (tmp_path / "link").symlink_to(copy)
    assert beside(tmp_path / "link") == copy.parent.resolve() and sweep.is_complete(tmp_path / "link")


def test_dataset_of_an_earlier_version_is_read_and_refused_with_a_clear_word(
    study: Study, made: Path, tmp_path: Path
) -> None:
    old = older(made, tmp_path / "designs")
    pd.testing.assert_frame_equal(sweep.load(old), sweep.load(made))
    before = {path.name for path in old.iterdir()}
    with pytest.raises(InputError, match="take another folder with --out"):
        sweep.run(study, old, jobs=1)
    assert {path.name for path in old.iterdir()} == before
    done = CliRunner().invoke(main, ["report", str(old)])
    assert done.exit_code == 2 and "a dataset folder, with a readable _plan.json" in done.output


def test_forced_new_data_do_not_keep_the_old_report(study: Study, copy: Path, tmp_path: Path) -> None:
    other = write_study(tmp_path / "other", keep="feasible", count=10)
    assert (copy.parent / "report.html").is_file()
    sweep.run(other, copy, jobs=1, force=True)
    assert not (copy.parent / "report.html").exists() and not (copy.parent / OPTIMUM).exists()
    (aside,) = (copy.parent / OLD).iterdir()
    assert {"report.html", OPTIMUM, PLAN} <= {path.name for path in aside.iterdir()}


def test_exchanged_names_are_noticed_by_every_reader(study: Study, copy: Path) -> None:
    """Each file is whole, but lies under the other's index: names without their hashes exchanged."""
    one, other = chunk_files.parts(copy)[:2]
    kept = one.path.read_bytes()
    one.path.unlink()
    one = one.path.with_name(f"part-{one.index:06d}-{one.identity}-{other.digest}.parquet")
    one.write_bytes(other.path.read_bytes())
    other.path.unlink()
    other.path.with_name(other.path.name.replace(other.digest, chunk_files.content_hash(kept))).write_bytes(kept)
    assert not sweep.is_complete(copy)
    for reader in (sweep.load, store.totals, lambda folder: sweep.compare(folder, folder)):
        with pytest.raises(StoreError, match="under the name of chunk 0"):
            reader(copy)
    done = CliRunner().invoke(main, ["report", str(copy)])
    assert done.exit_code == 2 and "run the study again" in done.output
    sweep.run(study, copy, jobs=1)
    assert sweep.is_complete(copy)


def test_a_copy_under_another_identity_is_noticed(copy: Path) -> None:
    part = chunk_files.parts(copy)[2]
    part.path.rename(part.path.with_name(part.path.name.replace(part.identity, "0" * 12)))
    with pytest.raises(StoreError, match="different studies"):
        sweep.load(copy)
    for other in chunk_files.parts(copy):
        if other.index != 2:
            other.path.unlink()
    with pytest.raises(StoreError, match=f"of {part.identity} under the name of chunk 2 of 000000000000"):
        sweep.load(copy)


def test_deleted_chunk_is_said_by_load(made: Path, copy: Path) -> None:
    chunk_files.parts(copy)[-1].path.unlink()
    count = len(chunk_files.parts(made))
    with pytest.warns(
        IncompleteWarning, match=f"incomplete, 1 of {count} chunks are missing .the first is {count - 1}"
    ):
        rows = sweep.load(copy)
    pd.testing.assert_frame_equal(rows, sweep.load(made).iloc[: len(rows)])
    (copy.parent / PLAN).unlink()  # the chunks themselves know how many they are
    with pytest.warns(IncompleteWarning):
        sweep.load(copy)
    assert f"{copy}: not complete" in sweep.compare(made, copy).lines()


@pytest.mark.parametrize("damage", ["cut", "flip", "empty", "zeros", "text"])
def test_damaged_chunk_is_named_by_compare(made: Path, copy: Path, damage: str) -> None:
    victim = chunk_files.parts(copy)[1].path
    data = victim.read_bytes()
    flipped = bytearray(data)
    flipped[len(data) // 3] ^= 16
    bad = {"cut": data[: len(data) // 2], "flip": bytes(flipped), "empty": b"", "zeros": bytes(len(data))}
    victim.write_bytes(bad.get(damage, b"{ not a table"))
    for pair in ((made, copy), (copy, made)):
        with pytest.raises(StoreError, match=victim.name):
            sweep.compare(*pair)


def test_damaged_optimum_is_named_and_made_again(study: Study, made: Path, copy: Path) -> None:
    path = copy.parent / OPTIMUM
    whole = path.read_bytes()
    for bad in (b"", whole[:200], whole[: len(whole) // 2]):
        path.write_bytes(bad)
        with pytest.raises(StoreError, match=OPTIMUM):
            sweep.compare(made, copy)
    path.unlink()
    assert not sweep.is_complete(copy)
    sweep.run(study, copy, jobs=1)
    assert path.read_bytes() == whole


def test_page_checksums_find_flipped_bytes_where_readers_verify_them(made: Path, tmp_path: Path) -> None:
    """Bytes of pages: nearly all of a file; the rest, headers and footer, is for the hash in the name."""
    part = chunk_files.parts(made)[0].path
    data = part.read_bytes()
    target = tmp_path / "part.parquet"
    chunks = pq.read_metadata(part).row_group(0)
    for k in range(chunks.num_columns):
        column = chunks.column(k)
        bad = bytearray(data)
        bad[column.data_page_offset + column.total_compressed_size * 3 // 4 - 1] ^= 1
        target.write_bytes(bytes(bad))
        with pytest.raises((OSError, pa.ArrowException)):
            pd.read_parquet(target, page_checksum_verification=True)


def test_deleted_lock_file_lets_nobody_in(study: Study, copy: Path) -> None:
    with locked(copy):
        (copy.parent / LOCK).unlink()
        with pytest.raises(LockedError, match="another run is writing here"):
            sweep.run(study, copy, jobs=1)
    sweep.run(study, copy, jobs=1)


def test_a_folder_in_the_way_of_temporary_files_stays(study: Study, copy: Path) -> None:
    (copy.parent / "_tmp-mine").mkdir()
    (copy.parent / "_tmp-1-part-000000.parquet").touch()
    sweep.run(study, copy, jobs=1)
    assert (copy.parent / "_tmp-mine").is_dir() and not (copy.parent / "_tmp-1-part-000000.parquet").exists()


def test_chunks_damaged_or_deleted_during_the_run_are_made_again(
    study: Study, made: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    for name, value in SMALL_CHUNKS.items():
        monkeypatch.setattr(sweep.chunks.plan, name, value)
    write, hands = chunk_files.write_chunk, [lambda path: path.write_bytes(path.read_bytes()[:99]), Path.unlink]

    def meddled(*given: object) -> Path:
        path = write(*given)  # type: ignore[arg-type]
        if hands:
            hands.pop()(path)
        return path

    monkeypatch.setattr("sweep.engine.worker.write_chunk", meddled)
    assert chunk_bytes(sweep.run(study, tmp_path / "designs", jobs=1)) == chunk_bytes(made)
    hands += [Path.unlink] * 1000
    with pytest.raises(StoreError, match="somebody removes"):
        sweep.run(study, tmp_path / "other", jobs=1)
