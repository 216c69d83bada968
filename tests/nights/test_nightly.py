"""Nights: the second says no change and computes nothing; a changed kernel is found; nothing good is ever dropped."""

from __future__ import annotations

import errno
import json
import os
import shutil
import subprocess
import sys
from collections.abc import Sequence
from pathlib import Path

import pytest

import sweep
from sweep.dataset import files
from sweep.dataset.lock import locked
from sweep.errors import InputError, LockedError
from sweep.nights import Settings, archive, nightly
from sweep.nights.archive import NightRecord, StudyRecord, write_night
from sweep.nights.carry import carry
from sweep.nights.studies import in_order, studies_in
from sweep.study import load_study
from tests.faults.ground import SLOW_DISK
from tests.optimise.test_study import STUDY as OPTIMUM

ROOT = Path(__file__).resolve().parents[2]

STUDY = """
[study]
name = "{name}"
[mechanism]
family = "eyelet"
[scene]
want = ["max_abs_dP", "range_P"]
[design]
a = {{ from = 10, to = 60, count = {count}, unit = "mm" }}
e = "{e} mm"
f = "30 mm"
alpha = "0.5 rad"
Z1 = "-100 mm"
Z2 = "120 mm"
[objective]
minimise = "max_abs_dP"
[accuracy]
samples = 64
[output]
keep = "all"
"""

# The velocity of the eyelet's circle, and one with another constant.
SOURCE = Path("kernels", "families", "eyelet.py")
RIGHT, WRONG = "return place, on_circle(r, -s, c)", "return place, on_circle(r, -1.001 * s, c)"


def written(folder: Path, name: str = "tiny", count: int = 6, e: int = 90) -> Path:
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "study.toml").write_text(STUDY.format(name=name, count=count, e=e))
    return folder


def command(sources: Path, *words: object) -> subprocess.CompletedProcess[str]:
    """A command of the sources in a folder, in a process of its own."""
    line = [sys.executable, "-P", "-m", "sweep", *map(str, words)]
    path = {"PYTHONPATH": str(sources)}
    return subprocess.run(line, env=os.environ | path, capture_output=True, text=True, check=False, timeout=200)


def night(into: Path, studies: Sequence[Path], budget: float = 100.0, keep: int = 14) -> tuple[NightRecord, list[str]]:
    said: list[str] = []
    return nightly(studies, Settings(into, budget, keep, jobs=1), said.append), said


def noted(into: Path, name: str, **studies: StudyRecord) -> Path:
    """A night that has been, by its record alone."""
    folder = into / name
    folder.mkdir(parents=True)
    write_night(folder, NightRecord(name, 1.0, 0, studies))
    return folder


GOOD, CUT = StudyRecord("complete"), StudyRecord("cut", 124)


@pytest.mark.slow
def test_a_changed_constant_in_a_kernel_is_found_with_rows_study_and_outputs(tmp_path: Path) -> None:
    sources = tmp_path / "sources"
    for name in ("kernels", "sweep"):
        shutil.copytree(ROOT / name, sources / name, ignore=shutil.ignore_patterns("__pycache__"))
    into, told = tmp_path / "nights", tmp_path / "told"
    study = written(tmp_path / "one")
    line = ("nightly", study, "--into", into, "--budget", "100 s", "--on-change", f"cat > {told}; exit 3")

    first = command(sources, *line)
    assert (first.returncode, first.stderr) == (0, "")
    assert "first night, nothing to compare with (exit code 0" in first.stdout and "no change" not in first.stdout
    good = (into / "latest").resolve()
    second = command(sources, *line)
    assert second.returncode == 0
    assert "no change (exit code 0" in second.stdout
    assert second.stdout.count("nothing to compute, 1 chunk linked") == 1
    assert not told.exists()
    chunks = [next((place / "tiny" / "designs").glob("part-*")) for place in archive.nights(into)]
    assert chunks[0].stat().st_ino == chunks[1].stat().st_ino

    kernel = sources / SOURCE
    text = kernel.read_text()
    assert text.count(RIGHT) == 1
    kernel.write_text(text.replace(RIGHT, WRONG))
    third = command(sources, *line)
    assert third.returncode == 10
    assert "max_abs_dP: 6 values changed, at most by " in third.stdout
    assert third.stdout.count("; the first: 0, 1, 2, 3, 4, ...)") == 1
    assert "range_P" not in third.stdout
    assert "changed: tiny (10) (exit code 10" in third.stdout
    assert "max_abs_dP: 6 values changed" in told.read_text()
    assert "--on-change ended with 3" in third.stdout
    last = archive.nights(into)[-1]
    assert (into / "latest").resolve() == last.resolve() != good
    events = [json.loads(line) for line in (last / "log.jsonl").read_text().splitlines()]
    assert [event["event"] for event in events] == ["night", "study", "end", "told"]
    assert (events[1]["study"], events[1]["changed"]) == ("tiny", 10)
    assert any("max_abs_dP" in words for words in events[1]["changes"])
    page = (into / "index.html").read_text()
    assert f'href="{last.name}/tiny/report.html"' in page
    assert page.count('class="red"><title>') == 1


def test_what_the_last_night_did_not_finish_comes_first(tmp_path: Path) -> None:
    studies = studies_in([written(tmp_path / name, name) for name in ("a", "b", "c", "d")], smoke=False)
    waiting = StudyRecord("waiting", 124)
    last = noted(tmp_path, "2026-01-01T00-00-00Z", a=GOOD, b=CUT, c=GOOD, d=waiting)
    assert [one.name for one in in_order(studies, [last])] == ["b", "d", "a", "c"]
    assert [one.name for one in in_order(studies, [])] == ["a", "b", "c", "d"]


def test_of_a_killed_night_its_datasets_tell_what_was_not_finished(tmp_path: Path) -> None:
    paths = [written(tmp_path / name, name) for name in ("a", "b")]
    killed = tmp_path / "2026-01-01T00-00-00Z"
    sweep.run(paths[0], killed / "a" / "designs", jobs=1)
    assert [one.name for one in in_order(studies_in(paths, smoke=False), [killed])] == ["b", "a"]


def test_a_night_whose_time_is_over_ends_with_124_and_latest_stays(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = written(tmp_path / "one")
    first, _ = night(tmp_path / "nights", [path])
    assert (first.exit_code, first.good) == (0, True)
    monkeypatch.setenv("PYTHONPATH", str(SLOW_DISK))
    monkeypatch.setenv("FAULTS_PAUSE", "30")  # the run is at work when its time is over, however fast it is
    second, said = night(tmp_path / "nights", [written(tmp_path / "one", count=1000)], budget=0.2)
    assert (second.exit_code, second.good, second.studies["tiny"].state) == (124, False, "cut")
    assert "cut off" in said[1]
    assert (tmp_path / "nights" / "latest").readlink() == Path(first.name)


@pytest.mark.usefixtures("in_this_process")
def test_a_search_that_time_has_cut_short_is_said_and_made_again_the_next_night(tmp_path: Path) -> None:
    study = tmp_path / "small" / "study.toml"
    study.parent.mkdir()
    whole = OPTIMUM.format(swing=40)
    study.write_text(whole.replace("starts = 3\n", 'starts = 3\ntime_budget = "1e-9 s"\n'))
    first, _ = night(tmp_path / "nights", [study])
    record = first.studies["small"]
    assert record.state == "complete" and "0 of 3 starts" in record.message and "time_budget" in record.message
    old = tmp_path / "nights" / first.name
    again = carry(load_study(study), [old], tmp_path / "second" / "small")
    assert again is not None and again.chunks == record.computed and not again.whole
    study.write_text(whole)
    sweep.run(study, tmp_path / "third" / "small" / "designs", jobs=1)
    found = carry(load_study(study), [tmp_path / "third", old], tmp_path / "fourth" / "small")
    assert found is not None and found.whole


def test_the_command_of_the_user_has_the_night_the_code_and_the_log(tmp_path: Path) -> None:
    script = tmp_path / "tell.sh"
    script.write_text(f'echo "$LINKSWEEP_CODE $LINKSWEEP_NIGHT" > {tmp_path}/told; cat >> {tmp_path}/told\n')
    broken = tmp_path / "broken"
    broken.mkdir()
    (broken / "study.toml").write_text("[study")
    said: list[str] = []
    settings = Settings(tmp_path / "nights", 100.0, jobs=1, on_change=f"sh {script}")
    result = nightly([broken], settings, said.append)
    head, *log = (tmp_path / "told").read_text().splitlines()
    assert head == f"2 {(tmp_path / 'nights' / result.name).resolve()}" and result.exit_code == 2
    assert any("broken: failed with 2" in line for line in log)
    assert said[-1].endswith("--on-change ran")


def test_chunks_of_a_night_that_was_cut_off_are_taken_over_and_damaged_ones_are_not(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(sweep.chunks.plan, "CHUNK_SECONDS", 1e-9)
    study = load_study(written(tmp_path / "one", count=1300))
    old = tmp_path / "2026-01-01T00-00-00Z"
    designs = sweep.run(study, old / "tiny" / "designs", jobs=1)
    chunks = sorted(designs.glob("part-*"))
    assert len(chunks) == 3
    chunks[0].unlink()
    damaged = bytearray(chunks[1].read_bytes())
    damaged[100] ^= 1
    chunks[1].write_bytes(damaged)
    target = tmp_path / "new" / "tiny"
    carried = carry(study, [old], target)
    assert carried is not None
    assert (carried.night, carried.chunks, carried.whole) == (old.name, 1, False)
    assert [path.name for path in (target / "designs").iterdir()] == [chunks[2].name]
    sweep.run(study, target / "designs", jobs=1)
    assert files.read_runs(target / "designs")[-1]["text"] == "2 chunks computed"
    assert sweep.verify(target).exit_code == 0
    assert len(files.read_runs(designs)) == 2
    other = load_study(written(tmp_path / "one", count=1301))
    assert carry(other, [old], tmp_path / "another" / "tiny") is None


def test_where_the_disk_makes_no_links_chunks_are_copied(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def refused(*_: object) -> None:
        raise OSError(errno.EXDEV, "no links here")

    monkeypatch.setattr(os, "link", refused)
    study = load_study(written(tmp_path / "one"))
    old = tmp_path / "2026-01-01T00-00-00Z"
    designs = sweep.run(study, old / "tiny" / "designs", jobs=1)
    carried = carry(study, [old], tmp_path / "new" / "tiny")
    assert carried is not None
    assert carried.whole
    copies = tmp_path / "new" / "tiny" / "designs"
    assert [path.read_bytes() for path in copies.iterdir()] == [path.read_bytes() for path in designs.iterdir()]
    assert not any(path.name.startswith("_tmp") for path in (tmp_path / "new").rglob("*"))


@pytest.mark.usefixtures("in_this_process")
def test_a_study_with_faults_fails_by_itself_and_the_others_are_computed(tmp_path: Path) -> None:
    bad = written(tmp_path / "studies" / "bad")
    (bad / "study.toml").write_text("[study]\nname = 3\n")
    written(tmp_path / "studies" / "tiny")
    record, said = night(tmp_path / "nights", [tmp_path / "studies"])
    assert record.exit_code == 2
    assert (record.studies["bad"].state, record.studies["tiny"].state) == ("failed", "complete")
    assert any("bad: failed with 2" in line for line in said)
    assert not (tmp_path / "nights" / "latest").exists()


@pytest.mark.usefixtures("in_this_process")
def test_a_study_that_the_last_good_night_had_and_this_one_has_not_is_named(tmp_path: Path) -> None:
    noted(tmp_path / "nights", "2026-01-01T00-00-00Z", tiny=GOOD, lost=GOOD)
    record, said = night(tmp_path / "nights", [written(tmp_path / "tiny")])
    assert record.good and sum(line.endswith("not among tonight's studies: lost") for line in said) == 1
    _, said = night(tmp_path / "nights", [tmp_path / "tiny"])
    assert not any("not among" in line for line in said)


def test_retention_keeps_the_last_good_night_however_old(tmp_path: Path) -> None:
    names = [f"2026-01-{day:02d}T00-00-00Z" for day in range(1, 8)]
    for name in names:
        noted(tmp_path, name, one=GOOD if name in names[:2] else CUT)
    strange = tmp_path / "notes"
    strange.mkdir()
    (tmp_path / f"{archive.GOING}2025-12-31T00-00-00Z").mkdir()
    assert archive.drop_old(tmp_path, 3) == [names[0], *names[2:4]]
    assert sorted(path.name for path in tmp_path.iterdir()) == [names[1], *names[4:], "notes"]
    noted(tmp_path, "2026-01-08T00-00-00Z", one=GOOD)
    assert archive.drop_old(tmp_path, 1) == [names[1], *names[4:]]


def test_a_night_comes_after_all_others_even_if_the_clock_goes_back(tmp_path: Path) -> None:
    (tmp_path / "2999-01-01T00-00-00Z").mkdir()
    fresh = [archive.new_night(tmp_path) for _ in range(3)]
    assert [path.name for path in fresh] == [f"2999-01-01T00-00-00Z+{k:03d}" for k in (1, 2, 3)]
    assert archive.nights(tmp_path)[1:] == fresh


def test_two_nights_at_once_are_refused(tmp_path: Path) -> None:
    path = written(tmp_path / "one")
    with archive.one_at_a_time(tmp_path / "nights"), pytest.raises(LockedError):
        night(tmp_path / "nights", [path])
    assert archive.nights(tmp_path / "nights") == []


def test_a_study_whose_folder_is_held_by_another_run_fails_with_75(tmp_path: Path) -> None:
    """The lock of the next night's folder cannot be known before; so the run itself is asked."""
    from sweep.nights.studies import call

    path = written(tmp_path / "one")
    with locked(tmp_path / "out" / "designs"):
        ended = call(["run", str(path), "--out", str(tmp_path / "out" / "designs")], tmp_path / "log", 60.0)
    assert ended.code == 75
    assert "another run is writing here" in ended.message


def test_two_studies_of_one_name_and_no_study_are_refused(tmp_path: Path) -> None:
    twice = [written(tmp_path / "one"), written(tmp_path / "two")]
    with pytest.raises(InputError, match="one study of a name"):
        night(tmp_path / "nights", twice)
    (tmp_path / "empty").mkdir()
    with pytest.raises(InputError, match="studies = "):
        night(tmp_path / "nights", [tmp_path / "empty"])
