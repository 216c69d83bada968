"""A study's optimum from its dataset: files, reference, starts where nothing is feasible, interruption."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pandas as pd
import pyarrow.parquet as pq
import pytest

from sweep.dataset.files import beside
from sweep.engine.run import run
from sweep.errors import InputError
from sweep.optimise import optimise_study
from sweep.optimise.starts.dataset import best_rows
from sweep.optimise.starts.posing import problem_of
from sweep.study import Study, load_study

STUDY = """
[study]
name = "small"
[mechanism]
family = "rssr"
[scene]
want = ["swing", "max_abs_d2psi", "max_pressure_angle"]
[design]
a = {{ from = 10, to = 40, count = 8, unit = "mm" }}
b = {{ from = 60, to = 150, count = 8, unit = "mm" }}
c = {{ from = 40, to = 90, count = 8, unit = "mm" }}
alpha = {{ from = 0, to = 90, count = 4, unit = "deg" }}
e = {{ value = 100, unit = "mm" }}
f = {{ value = 5, unit = "mm" }}
g = {{ value = 10, unit = "mm" }}
branch = {{ values = [1, -1] }}
[limits]
rotatable = true
swing = {{ min = {swing}, unit = "deg" }}
max_pressure_angle = {{ max = 50, unit = "deg" }}
[objective]
minimise = "max_abs_d2psi"
[accuracy]
samples = 64
[optimise]
starts = 3
seed = 1
[reference.design]
a = "25 mm"
b = "100 mm"
c = "60 mm"
e = "100 mm"
f = "5 mm"
g = "10 mm"
alpha = "20 deg"
[output]
keep = "feasible"
curves = "optimum"
"""


def small(folder: Path, swing: float = 40.0) -> Study:
    path = folder / "study.toml"
    path.write_text(STUDY.format(swing=swing))
    return load_study(path)


@pytest.fixture(scope="module")
def dataset(tmp_path_factory: pytest.TempPathFactory) -> tuple[Study, Path]:
    folder = tmp_path_factory.mktemp("study")
    study = small(folder)
    return study, run(study, folder / "out", jobs=1)


def test_optimum_is_better_than_every_row_and_keeps_the_limits(dataset):
    study, folder = dataset
    found, rows = pd.read_parquet(beside(folder) / "_optimum.parquet"), pd.read_parquet(folder)
    assert list(found.role) == ["optimum", "start", "start", "reference"]
    best = found.iloc[0]
    assert best.status == 0 and best.ended == "converged" and best.kkt_residual <= 1e-6 and best.violation <= 1e-9
    # 64 samples may miss a peak by 1e-3; the optimiser's own extrema are exact.
    assert best.max_abs_d2psi < rows.max_abs_d2psi.min()
    assert abs(best.swing) >= math.radians(40) - 1e-3 and best.max_pressure_angle <= math.radians(50) + 1e-3
    for name, (low, high) in study.space.bounds.items():
        assert low - 1e-12 <= best[name] <= high + 1e-12
    assert "swing at its minimum" in best.active


def test_reference_is_the_given_design_unchanged(dataset):
    _, folder = dataset
    reference = pd.read_parquet(beside(folder) / "_optimum.parquet").iloc[-1]
    assert reference.alpha == pytest.approx(math.radians(20), rel=1e-15)
    assert (reference.a, reference.b, reference.c) == (25.0, 100.0, 60.0)
    assert math.isfinite(reference.max_abs_d2psi) and math.isnan(reference.kkt_residual)


def test_curves_show_optimum_and_reference_over_one_turn(dataset):
    _, folder = dataset
    curves, found = (
        pd.read_parquet(beside(folder) / "_curves.parquet"),
        pd.read_parquet(beside(folder) / "_optimum.parquet"),
    )
    assert curves.role.value_counts().to_dict() == {"optimum": 720, "reference": 720}
    assert {"phi", "psi", "dpsi", "d2psi", "d3psi", "pressure_angle", "x_b", "z_c", "status"} <= set(curves.columns)
    for role in ("optimum", "reference"):
        largest = curves[curves.role == role].d2psi.abs().max()
        assert largest == pytest.approx(found[found.role == role].max_abs_d2psi.item(), rel=1e-2)


def test_fields_carry_unit_and_definition_and_the_caveat_stands_in_the_file(dataset):
    _, folder = dataset
    for name in ("_optimum.parquet", "_curves.parquet"):
        schema = pq.read_schema(beside(folder) / name)
        assert b"no proof of a global optimum" in schema.metadata[b"caveat"]
        assert all({b"unit", b"definition"} <= set(field.metadata) for field in schema)
    schema = pq.read_schema(beside(folder) / "_optimum.parquet")
    assert schema.field("a").metadata[b"unit"] == b"mm" and schema.field("swing").metadata[b"unit"] == b"rad"


def test_same_dataset_gives_the_same_bytes(dataset):
    study, folder = dataset
    before = [(beside(folder) / name).read_bytes() for name in ("_optimum.parquet", "_curves.parquet")]
    optimise_study(study, folder)
    assert before == [(beside(folder) / name).read_bytes() for name in ("_optimum.parquet", "_curves.parquet")]


def test_best_rows_are_the_feasible_ones(dataset):
    study, folder = dataset
    ((designs, merit),) = best_rows(study.family, "max_abs_d2psi", folder)
    rows = pd.read_parquet(folder)
    assert len(designs) == len(rows) and merit.min() == rows.max_abs_d2psi.min()
    assert problem_of(study, designs).variables == ("a", "b", "c", "alpha")
    # the sign of a swing is that of its branch; what is small is its magnitude
    ((_, merit),) = best_rows(study.family, "swing", folder)
    assert merit.min() == rows.swing.abs().min()


def test_study_without_a_feasible_row_is_answered_with_a_relaxation(tmp_path):
    study = small(tmp_path, swing=150.0)
    folder = run(study, tmp_path / "out", jobs=1)
    found = pd.read_parquet(beside(folder) / "_optimum.parquet").iloc[0]
    assert len(pd.read_parquet(folder)) == 0
    assert found.status == 5 and found.ended == "infeasible" and found.violation > 1e-3
    assert "swing by" in found.relaxation or "max_pressure_angle by" in found.relaxation


def test_stopped_study_leaves_the_best_so_far_and_says_so(dataset, tmp_path):
    study, folder = dataset
    copy = tmp_path / "copy"
    copy.mkdir()
    for path in folder.glob("part-*"):
        (copy / path.name).write_bytes(path.read_bytes())
    with pytest.raises(KeyboardInterrupt):
        optimise_study(study, copy, stop=lambda: True)
    found = pd.read_parquet(beside(copy) / "_optimum.parquet")
    assert found.iloc[0].ended == "time" and np.isfinite(found.iloc[0].max_abs_d2psi)
    assert not list(beside(copy).glob("_tmp-*"))


def test_study_without_optimise_is_refused(dataset, tmp_path):
    text = STUDY.format(swing=40.0).replace("[optimise]\nstarts = 3\nseed = 1\n", "")
    path = tmp_path / "study.toml"
    path.write_text(text)
    with pytest.raises(InputError, match="optimise"):
        optimise_study(load_study(path), tmp_path)
