"""A study's front: its file, going on after a stop with the same bytes, what it leaves alone, faults of [pareto]."""

from __future__ import annotations

import itertools
import math
import shutil
import sys
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd
import pyarrow.parquet as pq
import pytest

import sweep.engine.run
from sweep.dataset.files import OPTIMUM, PARETO, TABLES, beside, read_plan, write_plan
from sweep.dataset.store import is_complete
from sweep.engine.run import run
from sweep.errors import Interrupted, StudyError
from sweep.optimise import front_study
from sweep.optimise.front.study import saved
from sweep.optimise.starts.dataset import best_rows
from sweep.report.dataset import read_dataset
from sweep.report.front import Front
from sweep.report.page import write_report
from sweep.study import Limit, ParetoSettings, Study, load_study
from tests.optimise.test_study import STUDY

TABLE = """
[pareto]
output = "max_pressure_angle"
at_most = { from = 30, to = 50, count = 3, unit = "deg" }
starts = 1
"""


def written(folder: Path, table: str = TABLE) -> Study:
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "study.toml").write_text(STUDY.format(swing=40) + table)
    return load_study(folder)


@pytest.fixture(scope="module")
def whole(tmp_path_factory: pytest.TempPathFactory) -> tuple[Study, Path]:
    study = written(tmp_path_factory.mktemp("front"))
    return study, run(study, tmp_path_factory.mktemp("out") / "designs", jobs=1)


def copied(folder: Path, target: Path) -> Path:
    shutil.copytree(folder.parent, target)
    return target / folder.name


def test_file_holds_the_front_with_units(whole: tuple[Study, Path]) -> None:
    study, folder = whole
    assert study.pareto == ParetoSettings("max_pressure_angle", tuple(np.radians([30.0, 40.0, 50.0])), False, 1, None)
    table = pd.read_parquet(beside(folder) / PARETO)
    np.testing.assert_allclose(np.degrees(table["bound"]), [50.0, 40.0, 30.0], rtol=1e-14)
    assert (table["max_pressure_angle"] <= table["bound"] + 1e-8).all()
    assert (table["status"] == 0).all() and (table["kkt_residual"] <= 1e-6).all()
    assert table["max_abs_d2psi"].is_monotonic_increasing
    # The study's own limit is 50 degrees: the loosest bound is the optimum.
    optimum = pd.read_parquet(beside(folder) / OPTIMUM).iloc[0]
    assert table["max_abs_d2psi"][0] <= optimum["max_abs_d2psi"] * (1.0 + 1e-9)
    schema = pq.read_schema(beside(folder) / PARETO)
    assert schema.field("bound").metadata == {b"unit": b"rad", b"definition": b"upper bound on max_pressure_angle"}
    assert schema.field("a").metadata[b"unit"] == b"mm"
    assert schema.metadata[b"output"] == b"max_pressure_angle" and schema.metadata[b"side"] == b"at most"
    assert is_complete(folder)


def stop_after(calls: int) -> Callable[[], bool]:
    count = itertools.count()
    return lambda: next(count) >= calls


@pytest.mark.parametrize("calls", [3, 60, 200])
def test_stopped_front_goes_on_to_the_same_bytes(whole: tuple[Study, Path], tmp_path: Path, calls: int) -> None:
    study, folder = whole
    expected = (beside(folder) / PARETO).read_bytes()
    key = pq.read_schema(beside(folder) / PARETO).metadata[b"key"].decode()
    again = copied(folder, tmp_path / "again")
    (beside(again) / PARETO).unlink()
    assert not is_complete(again)
    with pytest.raises(KeyboardInterrupt):
        front_study(study, again, key, stop_after(calls))
    begun = saved(beside(again) / PARETO, key)
    assert begun is not None and not begun.complete and not is_complete(again)
    assert len(pd.read_parquet(beside(again) / PARETO)) >= 1
    taken = begun.taken
    front_study(study, again, key)
    assert (beside(again) / PARETO).read_bytes() == expected
    assert taken < 7


def test_finished_steps_are_not_searched_again(
    whole: tuple[Study, Path], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    study, folder = whole

    def refuse(*_: object) -> None:
        raise AssertionError("searched again")

    monkeypatch.setattr(sys.modules["sweep.optimise.front.pareto"], "minimise", refuse)
    run(study, folder, jobs=1)
    assert study.pareto is not None
    other = replace(study, pareto=replace(study.pareto, bounds=study.pareto.bounds[:2]))
    with pytest.raises(AssertionError, match="searched again"):
        run(other, copied(folder, tmp_path / "other"), jobs=1)


def test_a_front_that_is_flat_before_all_its_points_is_finished(whole: tuple[Study, Path], tmp_path: Path) -> None:
    """Its run ended with "stopped by signal 2", each time anew."""
    study, folder = whole
    assert study.pareto is not None
    flat = replace(study, pareto=replace(study.pareto, bounds=(1.5, 1.55), points=5))
    path = beside(run(flat, copied(folder, tmp_path / "flat"), jobs=1)) / PARETO
    front = saved(path, pq.read_schema(path).metadata[b"key"].decode())
    assert front is not None and front.filled and front.complete and len(front.bounds) == 2


def test_other_bounds_keep_designs_and_optimum(whole: tuple[Study, Path], tmp_path: Path) -> None:
    study, folder = whole
    again = copied(folder, tmp_path / "again")
    before = {path.name: path.stat().st_mtime_ns for path in again.parent.rglob("*.parquet") if path.name != PARETO}
    assert study.pareto is not None
    run(replace(study, pareto=replace(study.pareto, bounds=(0.7,))), again, jobs=1)
    assert {
        path.name: path.stat().st_mtime_ns for path in again.parent.rglob("*.parquet") if path.name != PARETO
    } == before
    assert pd.read_parquet(beside(again) / PARETO)["bound"].tolist() == [0.7]
    run(replace(study, pareto=None), again, jobs=1)
    assert not (beside(again) / PARETO).exists() and is_complete(again)


def test_interrupted_run_says_so_and_keeps_the_optimum(
    whole: tuple[Study, Path], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    study, folder = whole
    again = copied(folder, tmp_path / "again")
    (beside(again) / PARETO).unlink()

    def stopped(*_: object) -> None:
        raise KeyboardInterrupt

    with monkeypatch.context() as patched:
        patched.setattr("sweep.optimise.front_study", stopped)
        with pytest.raises(Interrupted, match="front"):
            sweep.engine.run.run(study, again, jobs=1)
    assert (beside(again) / OPTIMUM).read_bytes() == (beside(folder) / OPTIMUM).read_bytes()
    assert not is_complete(again)


def test_looks_of_the_optimum_are_those_of_the_front(tmp_path: Path) -> None:
    (tmp_path / "study.toml").write_text(
        (STUDY.format(swing=40) + TABLE).replace("[optimise]", "[optimise]\nlooks = 700"), encoding="utf-8"
    )
    study = load_study(tmp_path)
    assert study.optimise is not None and study.pareto is not None
    assert study.optimise.looks == study.pareto.looks == 700


def test_starts_lie_within_their_bound(whole: tuple[Study, Path]) -> None:
    study, folder = whole
    rows = pd.concat(pd.read_parquet(path) for path in sorted(folder.glob("part-*")))
    assert study.pareto is not None
    bounds = (0.6, 0.8)
    limits = [*(Limit("max_pressure_angle", None, bound) for bound in bounds), Limit("max_pressure_angle", 0.8, None)]
    *below, (above, _) = best_rows(study.family, "max_abs_d2psi", folder, limits)
    for bound, (designs, merit) in zip(bounds, below, strict=True):
        inside = rows[rows["max_pressure_angle"] <= bound]
        assert len(designs) == len(inside) and merit.min() == inside["max_abs_d2psi"].min()
    assert len(above) == (rows["max_pressure_angle"] >= 0.8).sum()
    ((few, merit),) = best_rows(study.family, "max_abs_d2psi", folder, limits[1:2], 3)
    within = rows.loc[rows["max_pressure_angle"] <= bounds[1], "max_abs_d2psi"]
    assert len(few) == 3 and merit.max() == within.nsmallest(3).max()


def test_starts_of_a_front_of_swings_are_the_smallest_by_magnitude(whole: tuple[Study, Path]) -> None:
    """The sign of a swing is the branch: by the signed value the largest negative swings came first."""
    study, folder = whole
    rows = pd.concat(pd.read_parquet(path) for path in sorted(folder.glob("part-*")))
    within = Limit("max_pressure_angle", None, 0.8)
    swings = rows.loc[rows["max_pressure_angle"] <= 0.8, "swing"]
    assert swings.min() < 0.0 < swings.max()
    ((designs, merit),) = best_rows(study.family, "swing", folder, [within], 3)
    assert sorted(merit) == sorted(swings.abs().nsmallest(3))
    found = rows.set_index(list(study.family.parameter_names))["swing"]
    np.testing.assert_array_equal(np.abs([found.loc[tuple(row)] for row in designs]), merit)
    # so is a bound on it
    middle = float(rows["swing"].abs().median())
    ((designs, _),) = best_rows(study.family, "max_abs_d2psi", folder, [Limit("swing", None, middle)])
    assert len(designs) == (rows["swing"].abs() <= middle).sum()


def test_report_shows_the_front(whole: tuple[Study, Path], tmp_path: Path) -> None:
    _, folder = whole
    page = write_report(folder, tmp_path / "report").read_text(encoding="utf-8")
    for bound in ("at most 50°", "at most 40°", "at most 30°"):
        assert bound in page
    tight = pd.read_parquet(beside(folder) / PARETO)["max_abs_d2psi"].iloc[-1]
    assert f"{tight:.5g}" in page
    assert "this bound" in page and "settled" in page
    assert (tmp_path / "report" / "pareto.parquet").read_bytes() == (beside(folder) / PARETO).read_bytes()


def test_points_are_placed_and_the_report_says_so(whole: tuple[Study, Path], tmp_path: Path) -> None:
    study = written(tmp_path / "study", TABLE.replace("count = 3", "count = 2") + "points = 4\n")
    folder = copied(whole[1], tmp_path / "copy")
    state: list[tuple[int, int]] = []
    front_study(study, folder, "k", say=lambda label, done, total, unit: state.append((done, total)))
    table = pd.read_parquet(beside(folder) / PARETO)
    assert len(table) == 4 and table["bound"].is_monotonic_decreasing and state[-1] == (6, 6)
    assert np.degrees(table["bound"].iloc[[0, -1]]).tolist() == pytest.approx([50.0, 30.0])
    assert table["max_abs_d2psi"].is_monotonic_increasing
    front = saved(beside(folder) / PARETO, "k")
    assert front is not None and front.complete and front.given == 2 and len(front.bounds) == 4
    write_plan(folder, (read_plan(folder) or {}) | {TABLES: {}})  # the front is not that of the study that was run
    data = replace(read_dataset(folder), study=study)
    assert "2 of the bounds were placed where the front bends" in Front.of(data).note()


@pytest.mark.parametrize(
    ("table", "message"),
    [
        ("[pareto]\nat_most = 1\n", "pareto.output is missing"),
        ('[pareto]\noutput = "swing"\n', "pareto.at_most is missing"),
        ('[pareto]\noutput = "swing"\nat_most = "40 deg"\nat_least = "30 deg"\n', "not both"),
        ('[pareto]\noutput = "swing"\nat_most = 40\n', "an angle with its unit"),
        ('[pareto]\noutput = "swing"\nat_most = { from = 30, to = 50, unit = "deg" }\n', "count"),
        ('[pareto]\noutput = "max_abs_d2psi"\nat_most = 1.0\n', "another output than the objective"),
        ('[pareto]\noutput = "swig"\nat_most = "40 deg"\n', "did you mean 'swing'"),
        ('[pareto]\noutput = "rotatable"\nat_least = 1\n', "changes steadily"),
        ('[pareto]\noutput = "max_pressure_angle"\nat_most = "95 deg"\n', "between 0 and 90 deg"),
        ('[pareto]\noutput = "swing"\nat_most = "40 deg"\nstart = 2\n', "did you mean 'starts'"),
        ('[pareto]\noutput = "swing"\nat_most = "40 deg"\ntime_budget = "0 s"\n', "positive"),
        (TABLE + "points = 3\n", "more than the 3 bounds given"),
        ('[pareto]\noutput = "swing"\nat_most = "40 deg"\npoints = 4\n', "there must be two or more"),
        ('[pareto]\noutput = "swing"\nat_most = { values = [39, 45], unit = "deg" }\n', "minimum of swing in .limits"),
        (TABLE.replace("most", "least").replace("50", "51"), "maximum of max_pressure_angle in .limits"),
        ('[pareto]\noutput = "swing"\nat_most = { from = 1, to = 9, count = 65, unit = "deg" }\n', "at most 64"),
    ],
)
def test_faults_are_named(tmp_path: Path, table: str, message: str) -> None:
    with pytest.raises(StudyError, match=message):
        written(tmp_path, table)


def test_front_needs_an_optimiser(tmp_path: Path) -> None:
    text = STUDY.format(swing=40).replace("[optimise]\nstarts = 3\nseed = 1\n", "") + TABLE
    (tmp_path / "study.toml").write_text(text)
    with pytest.raises(StudyError, match="optimise is missing"):
        load_study(tmp_path)


def test_bounds_in_other_units_are_the_same_front(tmp_path: Path) -> None:
    bound = repr(math.radians(40.0))
    one = written(tmp_path / "one", '[pareto]\noutput = "swing"\nat_least = "40 deg"\n')
    other = written(
        tmp_path / "other", f'[pareto]\noutput = "swing"\nat_least = {{ values = [{bound}], unit = "rad" }}\n'
    )
    assert one.pareto == other.pareto and one.fingerprint == other.fingerprint
    assert one.fingerprint != replace(one, pareto=None).fingerprint
