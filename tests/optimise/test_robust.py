"""Limits that hold for the wanted share of what is made; equations with a band; tolerances that touch nothing."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest

import sweep
import sweep.optimise.manufacture.robust
import sweep.optimise.study
from sweep.errors import SearchCutShort, StudyError
from sweep.families import family
from sweep.jobs.signals import Deadline
from sweep.optimise import Problem, explore, read_survey
from sweep.optimise.local.model import Model
from sweep.optimise.manufacture.margins import Scatter, prices, with_margins
from sweep.optimise.manufacture.sample import Sampler, manufactured
from sweep.optimise.problem.program import Program
from sweep.study import Limit, OptimiseSettings, Tolerance, load_study, study_from_data
from tests.optimise.test_study import STUDY

STUDIES = Path(__file__).parents[2] / "studies"
ROBUST = STUDY.format(swing=40).replace("samples = 64", "target = 1e-6").replace(
    "[output]\n", '[tolerance]\nlengths = "0.3 mm"\nangles = "0.2 deg"\nrobust = "95 %"\n[output]\n'
)  # fmt: skip


@pytest.fixture(scope="module")
def robust_folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("robust")
    (folder / "study.toml").write_text(ROBUST)
    sweep.run(folder, folder / "designs", jobs=1)
    return folder


@pytest.fixture(scope="module")
def result(robust_folder: Path) -> pd.DataFrame:
    return pd.read_parquet(robust_folder / "_optimum.parquet").set_index("role", drop=False)


def made(row: pd.Series, count: int) -> float:
    """Share of mechanisms within tolerance that keep the limits: drawn and judged here, not by the search."""
    rng = np.random.default_rng(77)
    lengths, angles = ["a", "b", "c", "e", "f", "g"], ["alpha"]
    table = {name: float(row[name]) + rng.normal(0.0, 0.3 / 3.0, count) for name in lengths}
    table |= {name: float(row[name]) + rng.normal(0.0, math.radians(0.2) / 3.0, count) for name in angles}
    found = sweep.summarise(
        "rssr", pd.DataFrame(table | {"branch": np.full(count, float(row["branch"]))}),
        ["rotatable", "swing", "max_pressure_angle"], accuracy=1e-6,
    )  # fmt: skip
    good = (found["status"] == 0) & (found["rotatable"] == 1)
    good &= found["swing"].abs() >= math.radians(40.0)
    good &= found["max_pressure_angle"] <= math.radians(50.0)
    return float(good.mean())


def test_wanted_share_of_what_is_made_keeps_the_limits(result: pd.DataFrame) -> None:
    best, drawing = result.loc["optimum"], result.loc["nominal"]
    # 20 000 mechanisms: 95 % is good to 0.15 %, three of which are allowed; the search's own sample to 0.25 %.
    assert made(best, 20_000) >= 0.95 - 0.006
    assert best["yield"] >= 0.95 and best["yield"] == pytest.approx(made(best, 20_000), abs=0.01)
    # Half of what is made of a drawing at its limit misses it.
    assert drawing["yield"] < 0.75 and drawing["yield"] == pytest.approx(made(drawing, 20_000), abs=0.02)


def test_robust_design_pays_as_little_as_it_can(result: pd.DataFrame) -> None:
    best, drawing = result.loc["optimum"], result.loc["nominal"]
    assert drawing["max_abs_d2psi"] < best["max_abs_d2psi"] < 1.05 * drawing["max_abs_d2psi"]
    # The share is not much larger than asked: room that nobody needs would cost acceleration.
    assert best["yield"] <= 0.965
    assert best["status"] == 0 and best["kkt_residual"] <= 1e-6


LARGE = """
[study]
name = "large"
[mechanism]
family = "rssp"
[scene]
want = ["stroke", "max_abs_d2s"]
[design]
a = { from = 8, to = 14, count = 5, unit = "mm" }
b = { from = 30, to = 60, count = 5, unit = "mm" }
e = { from = -6, to = 6, count = 5, unit = "mm" }
f = "4 mm"
alpha = "20 deg"
[limits]
rotatable = true
max_abs_d2s = { max = 11.6, unit = "mm/rad^2" }
max_pressure_angle = { max = 14, unit = "deg" }
[objective]
maximise = "stroke"
[optimise]
starts = 2
[tolerance]
lengths = "0.05 mm"
angles = "0.1 deg"
robust = "95 %"
"""


def test_table_of_what_is_made_is_that_of_the_design_alone(robust_folder: Path) -> None:
    """It takes what the search has computed of the same mechanisms; bit for bit it is what they give by themselves."""
    best = pd.read_parquet(robust_folder / "_optimum.parquet").set_index("role").loc["optimum"]
    study = load_study(robust_folder)
    sampler = Sampler(study, study.tolerance, study.optimise.seed)
    alone = manufactured(study, best[list(study.family.parameter_names)].to_numpy(np.float64), sampler)
    table = pd.read_parquet(robust_folder / "_made.parquet")
    assert alone is not None and 0.95 <= table["kept"].mean() < 1.0
    np.testing.assert_array_equal(table[alone.output], alone.values)
    np.testing.assert_array_equal(table["kept"], alone.kept)


def test_what_is_to_be_large_gives_up_no_more_than_it_has_to(tmp_path: Path) -> None:
    """Its negative grows towards zero where room is given away: a correction that gains has to be seen as one."""
    (tmp_path / "study.toml").write_text(LARGE)
    out = sweep.run(tmp_path, tmp_path / "designs", jobs=1)
    best = pd.read_parquet(out.parent / "_optimum.parquet").set_index("role").loc["optimum"]
    rng, count = np.random.default_rng(77), 20_000
    table = {name: best[name] + rng.normal(0.0, 0.05 / 3.0, count) for name in "abef"}
    table["alpha"] = best["alpha"] + rng.normal(0.0, math.radians(0.1) / 3.0, count)
    found = sweep.summarise(
        "rssp", table | {"branch": best["branch"]}, ["max_abs_d2s", "max_pressure_angle"], accuracy=1e-6
    )
    share = ((found["max_abs_d2s"] <= 11.6) & (found["max_pressure_angle"] <= math.radians(14.0))).mean()
    # The search's own sample is good to 0.5 %, this one to 0.15 %: three standard deviations of both.
    assert best["status"] == 0 and 0.95 <= best["yield"] <= 0.952
    assert share == pytest.approx(0.95, abs=0.015)


def test_band_narrower_than_its_room_is_missed_and_no_equation() -> None:
    """Were its middle asked for, designs would look good that hardly any mechanism keeps."""
    names = ("a", "b", "c", "e", "f", "g", "alpha")
    design = np.array([0.5, 2.0, 1.5, 2.0, 0.1, 0.1, 0.1])
    given = [{"branch": 1.0} | dict(zip(names, design.tolist(), strict=True))]
    swing = float(sweep.summarise("rssr", pd.DataFrame(given), ["swing"])["swing"].abs()[0])
    band = Limit("swing", swing - 1e-3, swing + 1e-3)
    problem = Problem(family("rssr"), names, design - 0.2, design + 0.2, {"branch": 1.0}, "max_abs_d2psi", (band,))
    start = problem.rows(design)[0]
    for lengths, missed in ((1e-4, False), (0.02, True)):
        drawn_in = with_margins(Scatter(problem, Tolerance(lengths, 1e-3 * lengths, 0.95)), start, {"swing": 2.0}, None)
        low, high = drawn_in.limits[0].minimum, drawn_in.limits[0].maximum
        assert low is not None and high is not None and (low > high) == missed
        model = Model(drawn_in, Program(drawn_in), start, lambda: False)
        state = model.state(drawn_in.scaled(start[None, :])[0])
        assert (state.violation > 1e-4) == missed and not any(state.form.equal)


def test_room_wider_than_a_pressure_limit_is_missed_and_no_error() -> None:
    """The limit cannot be drawn in below 0 degrees: there the search would read it as a positive angle."""
    limits = (Limit("swing", 0.5, 0.6), Limit("max_pressure_angle", None, 0.2 * math.pi / 180.0))
    lever, lower, upper = family("inverted_slider_crank"), np.array([20.0, 80.0]), np.array([45.0, 150.0])
    problem = Problem(lever, ("a", "e"), lower, upper, {"h": 0.1, "branch": 1.0}, "max_abs_d2psi", limits)
    start = problem.rows(np.array([38.0, 140.0]))[0]
    # asin(h/(e - a)) is 0.06 deg, and 0.05 and 1 mm of h are three standard deviations of 0.01 and 0.19 deg.
    for lengths, missed in ((0.05, False), (1.0, True)):
        levels = {"swing": 2.0, "max_pressure_angle": 2.0}
        scatter = Scatter(problem, Tolerance(lengths, 0.0, 0.95))
        drawn_in = with_margins(scatter, start, levels, None)
        model = Model(drawn_in, Program(drawn_in), start, lambda: False)
        state = model.state(drawn_in.scaled(start[None, :])[0])
        assert (state.violation > 1e-4) == missed
        assert set(prices(scatter, start, levels)) == set(levels)


def test_band_of_an_equation_is_two_bounds() -> None:
    study = load_study(STUDIES / "needle51")
    data = study.data | {"limits": {"swing1": "60 +- 0.5 deg", "stroke": "24.5 +- 0.01 mm", "rotatable1": True}}
    limits = {x.output: x for x in study_from_data(data, study.path).limits}
    assert limits["swing1"].minimum == pytest.approx(math.radians(59.5)) and limits["stroke"] == Limit(
        "stroke", 24.5 - 0.01, 24.5 + 0.01
    )


@pytest.mark.parametrize(
    "text", ["40 +- deg", "40 +- -1 deg", "x +- 1 deg", "40 +- 1 mm", "40 deg +- 1", "1 +- nan deg"]
)
def test_band_that_cannot_be_is_refused(text: str) -> None:
    study = load_study(STUDIES / "needle51")
    with pytest.raises(StudyError, match=r"limits\.swing1"):
        study_from_data(study.data | {"limits": {"swing1": text}}, study.path)


def test_tolerances_that_touch_nothing_are_refused() -> None:
    study = load_study(STUDIES / "geared-dwell")
    with pytest.raises(StudyError, match="no lengths that could deviate"):
        study_from_data(study.data | {"tolerance": {"lengths": "0.02 mm"}}, study.path)


def test_robust_search_refuses_equations_and_shares_that_cannot_be() -> None:
    study = load_study(STUDIES / "needle51")
    table = {"lengths": "0.02 mm", "robust": "95 %"}
    limits = study.data["limits"] | {"stroke": {"min": 24.5, "max": 24.5, "unit": "mm"}}
    with pytest.raises(StudyError, match="no mechanism that is made keeps an equation"):
        study_from_data(study.data | {"tolerance": table, "limits": limits}, study.path)
    for share in ("100 %", "0 %", "95"):
        with pytest.raises(StudyError, match=r"tolerance\.robust"):
            study_from_data(study.data | {"tolerance": table | {"robust": share}}, study.path)


def test_no_search_of_a_robust_design_takes_more_evaluations_than_a_start_may(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    budgets: list[float] = []

    def counted(number: int, problem: Problem, start: np.ndarray, stop: Any, budget: float) -> Any:
        budgets.append(budget)
        return search(number, problem, start, stop, budget)

    search = sweep.optimise.manufacture.robust.search
    monkeypatch.setattr(sweep.optimise.manufacture.robust, "search", counted)
    (tmp_path / "study.toml").write_text(ROBUST.replace("[optimise]\n", "[optimise]\nlooks = 100\n"))
    sweep.run(tmp_path, tmp_path / "designs", jobs=1)
    assert max(budgets) == 100


def test_brake_that_is_pulled_after_the_starts_is_told(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def explored(
        problem: Problem, starts: np.ndarray, settings: OptimiseSettings, deadline: Deadline, *rest: Any
    ) -> Any:
        found = explore(problem, starts, settings, deadline, *rest)
        deadline.end = -math.inf
        return found

    monkeypatch.setattr(sweep.optimise.study, "explore", explored)
    (tmp_path / "study.toml").write_text(ROBUST)
    out = tmp_path / "designs"
    with pytest.raises(SearchCutShort, match="not all that follows them"):
        sweep.run(tmp_path, out, jobs=1)
    survey = read_survey(out.parent / "_optimum.parquet")
    assert survey is not None and survey.ended == "time" and survey.late
    assert "not all that follows" in survey.warnings[0]
    # The answer is that of the starts, and no more is claimed.
    table = pd.read_parquet(out.parent / "_optimum.parquet").set_index("role")
    assert table.loc["optimum", "yield"] < 0.75
