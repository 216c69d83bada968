"""What a night says of a study's results and of those of the last good night: edits, optimum, front."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path

import pandas as pd
import pytest

import sweep
from sweep.dataset import files
from sweep.nights.changes import changes
from sweep.study import ParetoSettings, load_study
from tests.nights.test_nightly import written


def test_an_edited_study_is_said_with_its_edit(tmp_path: Path) -> None:
    old = sweep.run(written(tmp_path / "one"), tmp_path / "old" / "designs", jobs=1)
    path = written(tmp_path / "one", e=91)
    found = changes(load_study(path), old, sweep.run(path, tmp_path / "new" / "designs", jobs=1))
    assert found.code == 11 and found.edited
    assert "the study itself was edited: design.e 90 mm -> 91 mm" in found.lines


def test_an_edit_of_what_follows_the_sweep_is_said_too(tmp_path: Path) -> None:
    folders = []
    for lengths in (0.02, 0.03):
        path = written(tmp_path / "one") / "study.toml"
        after = f'[optimise]\nstarts = 1\n[tolerance]\nsamples = 64\nlengths = "{lengths} mm"\n'
        path.write_text(path.read_text() + after)
        folders.append(sweep.run(path, tmp_path / f"{lengths}" / "designs", jobs=1))
    found = changes(load_study(path), *folders)
    assert found.code == 11 and found.edited
    assert "the study itself was edited: tolerance.lengths 0.02 mm -> 0.03 mm" in found.lines


def test_optimum_and_dimension_that_moved_are_named(tmp_path: Path) -> None:
    study = load_study(written(tmp_path / "one"))
    places = [sweep.run(study, tmp_path / name / "designs", jobs=1) for name in ("old", "new")]
    row = sweep.load(places[0]).iloc[[2]].assign(role="optimum")
    row.to_parquet(tmp_path / "old" / "_optimum.parquet")
    row.assign(a=row["a"] * (1 + 1e-7)).to_parquet(tmp_path / "new" / "_optimum.parquet")
    assert changes(study, *places).code == 0
    row.assign(a=row["a"] * 1.01, max_abs_dP=row["max_abs_dP"] * 1.02).to_parquet(tmp_path / "new" / "_optimum.parquet")
    found = changes(study, *places)
    assert (found.code, found.moved) == (10, ("max_abs_dP",))
    assert [line.split(":")[0] for line in found.lines] == ["optimum moved", "optimum moved in its dimensions"]
    assert found.lines[1].split(": ")[1].startswith("a 30 -> 30.3")
    row.assign(max_abs_dP=math.inf).to_parquet(tmp_path / "new" / "_optimum.parquet")
    assert changes(study, *places).moved == ("max_abs_dP",)
    row.assign(status=5).to_parquet(tmp_path / "new" / "_optimum.parquet")
    assert changes(study, *places).code == 11


def front_lines(folder: Path, old: dict[float, float], new: dict[float, float]) -> tuple[str, ...]:
    """What a night says of two fronts, each the objective by its bounds."""
    study = load_study(written(folder / "one"))
    places = [sweep.run(study, folder / name / "designs", jobs=1) for name in ("old", "new")]
    for place, front in zip(places, (old, new), strict=True):
        pd.DataFrame(front.items(), columns=["bound", "max_abs_dP"]).to_parquet(files.beside(place) / files.PARETO)
    return changes(replace(study, pareto=ParetoSettings("range_P", (1.0, 2.0))), *places).lines


BETWEEN = 1.5 + 1e-7  # a placed bound follows what its neighbours reach


@pytest.mark.parametrize(
    ("new", "said"),
    [
        ({1.0: 4.0, BETWEEN: 3.0 - 1e-7, 2.0: 2.0}, []),  # on the same front
        ({1.0: 4.0, BETWEEN: 3.1, 2.0: 2.0}, ["front moved at 1 of 3 bounds, most at range_P = 1.5"]),
        ({1.0: 4.0, 1.5: 3.0 + 1e-5, 2.0: math.nan}, ["front moved at 2 of 3 bounds, most at range_P = 2"]),
        ({1.0: 4.0, 1.6: 2.8, 2.0: 2.0}, ["front: 3 bounds before, 3 now, 2 of them the same"]),
        ({1.0: 4.0, 2.0: 2.0}, ["front: 3 bounds before, 2 now, 2 of them the same"]),
        ({}, ["front: 3 bounds before, 0 now"]),
    ],
)
def test_fronts_are_compared_at_bounds_that_differ_as_little_as_searches_do(
    tmp_path: Path, new: dict[float, float], said: list[str]
) -> None:
    lines = front_lines(tmp_path, {1.0: 4.0, 1.5: 3.0, 2.0: 2.0}, new)
    assert [line.split(": max_abs_dP")[0] for line in lines] == said
