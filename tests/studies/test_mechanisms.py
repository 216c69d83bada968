"""The studies needle51, looper-dwell and crank-rocker-atlas: accepted figures recomputed, optima held, known values.

Tolerances: accepted figures are computed from accepted links, which are stored with all their digits; what hangs on the
optimiser's word (limits met, nothing better nearby) has its promise of 1e-6.
"""

from __future__ import annotations

import importlib.util
import json
import math
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

import sweep
from sweep.chunks.chunk import compute_chunk
from sweep.evaluation.summaries import design_outputs
from sweep.evaluation.tables import design_matrix
from sweep.optimise import minimise
from sweep.optimise.starts.posing import problem_of
from sweep.quantities.limits import meets
from sweep.study import OptimiseSettings, load_study, study_from_data
from sweep.study.study import Limit

STUDIES = Path(__file__).parents[2] / "studies"
OPTIMISED = ("needle51", "looper-dwell")


def accepted(name):
    return load_study(STUDIES / name), json.loads((STUDIES / name / "expected.json").read_text())


def design_of(study, row):
    matrix, _ = design_matrix(study.family, {name: row[name] for name in study.family.parameter_names if name in row})
    return matrix


def widened(limit):
    low, high = limit.minimum, limit.maximum
    return Limit(
        limit.output, None if low is None else low - 1e-6 * abs(low), None if high is None else high + 1e-6 * abs(high)
    )


@pytest.mark.parametrize("name", OPTIMISED)
def test_accepted_figures_are_those_of_the_accepted_links(name):
    study, expected = accepted(name)
    for role in ("optimum", "reference"):
        if role not in expected:
            continue
        found = design_outputs(study.family, design_of(study, expected[role]), study.want, study.accuracy, study.window)
        assert found["status"][0] == 0
        for output in study.want:
            off = float(found[output][0]) - expected[role][output]
            if output.startswith("phi_"):
                off = math.remainder(off, 2.0 * math.pi)
            assert abs(off) <= 1e-9 * (1.0 + abs(expected[role][output])), (role, output)


@pytest.mark.parametrize("name", OPTIMISED)
def test_accepted_optimum_keeps_limits_and_bounds(name):
    study, expected = accepted(name)
    best = expected["optimum"]
    for limit in study.limits:
        assert meets(widened(limit), np.array([best[limit.output]], float))[0], limit
    for axis, (low, high) in study.space.bounds.items():
        if axis not in study.prescribed:
            assert low - 1e-9 <= best[axis] <= high + 1e-9


@pytest.mark.parametrize("name", OPTIMISED)
def test_nothing_nearby_is_better(name):
    study, expected = accepted(name)
    best = design_of(study, expected["optimum"])
    problem = problem_of(study, best)
    rng = np.random.default_rng(3)
    place = problem.scaled(best)[0]
    near = np.clip(place + rng.normal(0.0, 0.01, (4000, place.size)) * rng.integers(0, 2, (4000, place.size)), 0.0, 1.0)
    designs = np.array([problem.placed(best[0], row) for row in near])
    want = [study.objective.output, *(limit.output for limit in study.output_limits)]
    found = design_outputs(study.family, designs, want, study.accuracy, study.window)
    good = found["status"] == 0
    for limit in study.output_limits:
        good &= meets(limit, found[limit.output])
    assert good.sum() > 5, "some neighbours must be feasible"
    assert (found[study.objective.output][good] >= expected["optimum"][study.objective.output] * (1.0 - 1e-6)).all()


def test_optimiser_reaches_the_accepted_needle_drive_again():
    study, expected = accepted("needle51")
    start = design_of(study, expected["reference"])
    problem = problem_of(study, start)
    place = 0.9 * problem.scaled(design_of(study, expected["optimum"]))[0] + 0.05
    found = minimise(problem, problem.placed(start[0], place)[None, :], OptimiseSettings(starts=1))[0]
    assert found.ended == "converged"
    assert found.objective == pytest.approx(expected["optimum"]["max_abs_d2s"], rel=expected["relative_tolerance"])


def test_needle_drive_gains_what_the_page_says():
    _, expected = accepted("needle51")
    gain = 1.0 - expected["optimum"]["max_abs_d2s"] / expected["reference"]["max_abs_d2s"]
    assert gain == pytest.approx(0.169, abs=5e-4)
    for name, value in expected["optimum"].items():
        if name in ("a1", "b1", "c1", "e1", "f1", "g1", "a2", "b2", "e2"):
            assert abs(value / expected["reference"][name] - 1.0) <= 0.1 + 1e-3


def test_looper_dwells_three_times_as_long_as_a_sine():
    study, expected = accepted("looper-dwell")
    assert study.window == (0.99, 1.0)
    assert expected["optimum"]["window_angle"] == pytest.approx(math.radians(80.0), rel=1e-6)
    assert expected["optimum"]["window_angle"] > 3.0 * 2.0 * math.acos(0.98)


@pytest.fixture(scope="module")
def atlas(tmp_path_factory):
    return sweep.load(
        sweep.run(STUDIES / "crank-rocker-atlas", tmp_path_factory.mktemp("atlas") / "designs", smoke=True)
    )


def test_planar_central_designs_follow_the_closed_form():
    # In the plane sin(pressure angle) = sin(swing/2) e/b' (Brodell and Soni), b' the coupler seen along the axes.
    atlas = load_study(STUDIES / "crank-rocker-atlas", smoke=True)
    central = atlas.data["locus"] | {"phi0": "180 deg"}
    planar = atlas.data["design"] | {"alpha": "0 deg"}
    study = study_from_data(atlas.data | {"locus": central, "design": planar}, atlas.path)
    rows = pd.DataFrame(compute_chunk(study, 0, study.space.count).columns)
    assert len(rows) > 100
    seen = np.sqrt(rows.b**2 - (rows.f - rows.g) ** 2)
    flat = np.sin(rows.swing / 2.0) * rows.e / seen
    # Outputs are stored in float32.
    np.testing.assert_allclose(np.cos(rows.max_pressure_angle), seen / rows.b * np.sqrt(1.0 - flat**2), rtol=1e-5)


def test_chart_has_one_row_per_cell_and_the_least_values(atlas):
    spec = importlib.util.spec_from_file_location("figure", STUDIES / "crank-rocker-atlas" / "figure.py")
    figure = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(figure)
    table = figure.atlas(atlas)
    assert not table.duplicated(["alpha", "swing", "phi0"]).any() and set(table.alpha) == {0.0, 90.0}
    assert (table.max_pressure_angle.dropna() <= 45.0 + 1e-4).all()
    # Axes at right angles leave more room: the same swing with a smaller pressure angle.
    both = table.pivot_table(index=["swing", "phi0"], columns="alpha", values="least_pressure_angle").dropna()
    assert (both[90.0] < both[0.0]).mean() > 0.6
    assert isinstance(table, pd.DataFrame) and figure.chart(table).axes


def test_accepted_chart_has_the_symmetry_of_axes_at_right_angles():
    # Reflected and run backwards, a mechanism with axes at right angles keeps its swing and has 360 deg - phi0.
    _, expected = accepted("crank-rocker-atlas")
    angles = expected["least_pressure_angle_deg"]["axes at right angles, swing = 60 deg"]
    for phi0, angle in angles.items():
        assert angle == pytest.approx(angles[str(360 - int(phi0))], rel=0.1)
    planar = expected["least_pressure_angle_deg"]["planar, phi0 = 178 deg"]
    # Above half the swing, the value for phi0 = 180 deg and an endless coupler.
    assert all(angle > float(swing) / 2.0 for swing, angle in planar.items())
