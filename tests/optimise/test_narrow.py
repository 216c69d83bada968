"""A requirement whose best design lies in a narrow basin: a study whose sweep leaves almost nothing, and a sample."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pyarrow.parquet as pq
import pytest

from sweep.engine.run import run
from sweep.families import family
from sweep.optimise import Problem, optimum, read_survey
from sweep.optimise.starts.posing import problem_and_starts
from sweep.study import Limit, OptimiseSettings, load_study
from tests.support.selection import mostly_long
from tests.support.starts import gathered

NARROW = """
[study]
name = "narrow"
[mechanism]
family = "rssr"
[scene]
want = ["max_abs_d2psi", "max_pressure_angle"]
[locus]
swing = { values = [98.7068371, -98.7068371], unit = "deg" }
phi0 = "159.4038222 deg"
phi_ext = { from = 0, to = 360, unit = "deg" }
[design]
sample = { kind = "sobol", n = 16384, seed = 1 }
e = { from = 1.440830, to = 39.058706, unit = "mm" }
f = { from = -18.151863, to = 18.151863, unit = "mm" }
g = { from = -13.541649, to = 13.541649, unit = "mm" }
alpha = { from = 0.467321, to = 1.397788, unit = "rad" }
[limits]
rotatable = true
max_pressure_angle = { max = 55.7816103, unit = "deg" }
a = { min = 6.365291, max = 38.508389, unit = "mm" }
b = { min = 25.554871, max = 115.152444, unit = "mm" }
c = { min = 18.030126, max = 36.204620, unit = "mm" }
[objective]
minimise = "max_abs_d2psi"
[optimise]
starts = 20
"""
# Found by searches that share no code with this one; the basin beside it ends at 1.36792.
BEST = 1.23899


@pytest.mark.parametrize("seed", mostly_long([1, 2, 3], [1]))
def test_narrow_basin_is_found_though_the_sweep_leaves_few_rows(tmp_path: Path, seed: int) -> None:
    (tmp_path / "study.toml").write_text(NARROW + f"seed = {seed}\n")
    study = load_study(tmp_path)
    folder = run(study, tmp_path / "designs", jobs=1)
    assert sum(pq.ParquetFile(path).metadata.num_rows for path in folder.glob("part-*")) < 4
    table = pq.read_table(folder.parent / "_optimum.parquet").to_pydict()
    assert table["max_abs_d2psi"][0] == pytest.approx(BEST, rel=5e-6)
    assert table["status"][0] == 0 and table["kkt_residual"][0] <= 1e-6
    found = read_survey(folder.parent / "_optimum.parquet")
    assert found is not None and found.starts == 20 and found.basins >= 2


@pytest.mark.parametrize("seed", mostly_long([1, 2, 3], [1]))
def test_narrow_basin_is_found_from_a_sample(seed: int) -> None:
    low = np.array([6.365291, 25.554871, 18.030126, 1.440830, -18.151863, -13.541649, 0.467321])
    high = np.array([38.508389, 115.152444, 36.204620, 39.058706, 18.151863, 13.541649, 1.397788])
    swing, phi0, pressure = np.radians([98.7068371, 159.4038222, 55.7816103]).tolist()
    limits = (Limit("swing", swing, swing), Limit("phi0", phi0, phi0), Limit("max_pressure_angle", None, pressure))
    names = ("a", "b", "c", "e", "f", "g", "alpha")
    problem = Problem(family("rssr"), names, low, high, {}, "max_abs_d2psi", limits)
    found = optimum(problem, [{"branch": 1.0}, {"branch": -1.0}], OptimiseSettings(starts=12, seed=seed))[0]
    assert found.objective == pytest.approx(BEST, rel=5e-6)
    assert found.status == 0 and found.kkt_residual <= 1e-6


def test_starts_are_filled_up_to_the_number_asked_with_both_signs(tmp_path: Path) -> None:
    (tmp_path / "study.toml").write_text(NARROW.replace("starts = 20", "starts = 8"))
    study = load_study(tmp_path)
    folder = run(replace(study, optimise=None, objective=study.objective), tmp_path / "designs", jobs=1)
    problem, groups = problem_and_starts(study, folder)
    starts, _ = gathered(groups)
    assert len(starts) == 8
    assert set(starts[:, problem.family.parameter_names.index("branch")]) == {-1.0, 1.0}
