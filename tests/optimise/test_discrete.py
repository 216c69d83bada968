"""Listed values in the optimiser: kept, chosen among neighbours; multipliers against measured changes; relaxations."""

from __future__ import annotations

import itertools
import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pyarrow.parquet as pq
import pytest

from kernels import status as st
from sweep.engine.run import run
from sweep.errors import StudyError
from sweep.families import family
from sweep.optimise import Problem, Result, minimise, on_locus, optimum
from sweep.optimise.multistart.multistart import listed, with_neighbours
from sweep.study import Limit, OptimiseSettings, load_study
from tests.optimise.test_study import STUDY
from tests.support.optimise_family import FAMILY

LISTED = STUDY.format(swing=40).replace(
    "alpha = { from = 0, to = 90, count = 4, unit = \"deg\" }\n", 'alpha = "20 deg"\n'
).replace("e = { value = 100, unit = \"mm\" }", 'e = { values = [80, 100, 130, 160], unit = "mm" }')  # fmt: skip


def test_answer_has_a_listed_value_and_no_neighbour_is_better(tmp_path: Path) -> None:
    (tmp_path / "study.toml").write_text(LISTED)
    study = load_study(tmp_path)
    assert listed(study)["e"].tolist() == [80.0, 100.0, 130.0, 160.0]
    folder = run(study, tmp_path / "designs", jobs=1)
    table = pq.read_table(folder.parent / "_optimum.parquet").to_pydict()
    ends = [k for k, role in enumerate(table["role"]) if role != "reference"]
    assert {table["e"][k] for k in ends} <= {80.0, 100.0, 130.0, 160.0}
    assert table["status"][0] == 0 and table["kkt_residual"][0] <= 1e-6
    alone = []
    for e in (80, 100, 130, 160):
        (tmp_path / "study.toml").write_text(LISTED.replace("[80, 100, 130, 160]", f"[{e}]"))
        single = run(load_study(tmp_path), tmp_path / f"e{e}" / "designs", jobs=1)
        best = pq.read_table(single.parent / "_optimum.parquet").to_pydict()
        alone.append(best["max_abs_d2psi"][0] if best["status"][0] == 0 else math.inf)
    assert table["max_abs_d2psi"][0] <= min(alone) * (1.0 + 1e-9)


# A thousand combinations of listed values, of which a sweep of 512 designs has few good ones.
MANY = """
[study]
name = "many"
[mechanism]
family = "guide"
[design]
sample = { kind = "sobol", n = 512, seed = 3 }
a = { values = [8, 12, 16, 20], unit = "mm" }
b = { values = [30, 42.5, 55, 67.5, 80], unit = "mm" }
c = { values = [25, 33.75, 42.5, 51.25, 60], unit = "mm" }
e = { values = [30, 42.5, 55, 67.5, 80], unit = "mm" }
xi = { from = 10, to = 60, unit = "mm" }
eta = { from = -20, to = 20, unit = "mm" }
lam = "28.8 deg"
h = "0 mm"
branch = { values = [-1, 1] }
[limits]
max_pressure_angle = { min = 0.7951, max = 0.82755, unit = "rad" }
[objective]
minimise = "max_abs_d2s"
[optimise]
seed = 3
starts = 12
"""
BEST_OF_MANY = 4.745563818132876  # by differential evolution over all eight, listed values rounded


def test_good_combinations_of_listed_values_are_found_beyond_those_of_the_sweep(tmp_path: Path) -> None:
    (tmp_path / "study.toml").write_text(MANY)
    folder = run(load_study(tmp_path), tmp_path / "designs", jobs=1)
    table = pq.read_table(folder.parent / "_optimum.parquet").to_pydict()
    assert table["status"][0] == 0 and table["max_abs_d2s"][0] <= BEST_OF_MANY * (1.0 + 1e-9)


def test_study_of_lists_alone_has_nothing_to_optimise(tmp_path: Path) -> None:
    text = LISTED.replace("{ from = 10, to = 40, count = 8, ", "{ values = [20, 30], ")
    text = text.replace("{ from = 60, to = 150, count = 8, ", "{ values = [90, 100], ")
    text = text.replace("{ from = 40, to = 90, count = 8, ", "{ values = [60, 70], ")
    (tmp_path / "study.toml").write_text(text)
    with pytest.raises(StudyError, match="optimise"):
        load_study(tmp_path)


def test_neighbours_lead_to_the_best_value_of_a_catalogue() -> None:
    # ((p - 1)^2 + (q + 2)^2 + 1) cos phi with q from a list: -2.2 is the best of it, four steps from the start.
    problem = Problem(FAMILY, ("p",), np.array([-4.0]), np.array([4.0]), {}, "max_abs_bowl")
    catalogue = {"q": np.array([-3.5, -2.2, -1.0, 0.5, 2.0, 3.0])}
    settings = OptimiseSettings(starts=1)
    first = minimise(problem, np.array([[0.0, 3.0, 0.0, 1.0]]), settings)
    best = with_neighbours(problem, first, catalogue, settings, None, 1)[0]
    assert best.design[1] == -2.2 and best.objective == pytest.approx(1.04, rel=1e-9)
    assert best.design[0] == pytest.approx(1.0, abs=1e-6)


def crank_rocker(c_least: float, pressure: float = 0.7) -> Problem:
    names = ("a", "b", "c", "f", "g")
    low, high = np.array([0.1, 0.5, 0.3, -1.0, -1.0]), np.array([3.0, 6.0, 4.0, 1.0, 1.0])
    limits = (
        Limit("swing", 0.9, 0.9), Limit("phi0", 3.0, 3.0), Limit("max_pressure_angle", None, pressure),
        Limit("c", c_least, 4.0),
    )  # fmt: skip
    low[2] = c_least
    return Problem(family("rssr"), names, low, high, {"alpha": 0.4, "e": 1.0}, "max_abs_d2psi", limits[:3])


def test_multipliers_of_limits_on_links_are_the_measured_changes() -> None:
    name = "c"
    problem = on_locus(crank_rocker(0.3))
    assert problem.coordinates is not None
    settings = OptimiseSettings(starts=2, seed=1)
    best = optimum(crank_rocker(0.3), [{"branch": 1.0}], settings)[0]
    assert best.status == st.OK
    value = float(best.design[problem.family.parameter_names.index(name)])
    # A two-sided limit just above where the free optimum is: it holds, with a bound far away on the other side.
    bound = 1.05 * value
    tight = replace(problem, limits=tuple(limit for limit in problem.limits if limit.output != name))
    assert name in tight.made or name in tight.variables

    def solved(least: float) -> tuple[float, dict[str, float]]:
        own = replace(tight, limits=(*tight.limits, Limit(name, least, 10.0)))
        found = minimise(own, best.design[None, :], settings)[0]
        assert found.status == st.OK and found.kkt_residual <= 1e-6
        return found.objective, found.multipliers

    step = 1e-4
    up, down = solved(bound * (1.0 + step))[0], solved(bound * (1.0 - step))[0]
    objective, words = solved(bound)
    assert words[f"{name} at its minimum"] == pytest.approx((up - down) / (2.0 * step * objective), rel=1e-3)


SLIDER = Problem(
    family("rssp"), ("a", "b", "e", "f", "alpha"), np.array([5.0, 20.0, -30.0, -20.0, 0.0]),
    np.array([20.0, 80.0, 30.0, 20.0, np.pi / 3.0]), {"branch": 1.0}, "max_abs_d2s",
)  # fmt: skip
SLIDER_START = [19.0, 75.0, -28.0, -15.0, 0.9]
ROCKER = Problem(
    family("rssr"), ("a", "b", "c", "f", "g", "alpha"), np.array([4.0, 15.0, 8.0, -60.0, -30.0, 0.5]),
    np.array([20.0, 90.0, 40.0, 40.0, 30.0, np.pi / 2.0]), {"e": 30.0, "branch": 1.0}, "max_abs_d2psi",
)  # fmt: skip
STROKE, RATIO = Limit("stroke", 24.4, None), Limit("stroke_ratio", 1.15, None)


@pytest.mark.parametrize(
    ("problem", "start", "limits"),
    [
        # Stroke ratio and transmission angle are searched as phi0 and as sin^2, a distance as its square.
        (SLIDER, SLIDER_START, (STROKE, RATIO, Limit("least_transmission_angle", np.radians(50.0), None))),
        (replace(SLIDER, objective="stroke_ratio"), SLIDER_START, (STROKE, Limit("max_abs_d2s", None, 13.0))),
        (
            ROCKER, [6.0, 46.0, 11.0, -30.0, 1.0, 1.5],
            (Limit("swing", np.radians(50.0), None), Limit("pivot_distance", None, 45.0)),
        ),
    ],
)  # fmt: skip
def test_multipliers_are_the_measured_changes_of_what_is_searched_in_other_terms(
    problem: Problem, start: list[float], limits: tuple[Limit, ...]
) -> None:
    def solved(changed: tuple[Limit, ...], design: list[float]) -> Result:
        own = replace(problem, limits=changed)
        found = minimise(own, own.rows([design]), OptimiseSettings())[0]
        assert found.status == st.OK
        return found

    best, step = solved(limits, start), 1e-3
    names = problem.family.parameter_names
    place = [float(best.design[names.index(name)]) for name in problem.variables]
    assert len(best.multipliers) >= len(limits)
    for k, limit in enumerate(limits):
        side = "minimum" if limit.maximum is None else "maximum"
        value = getattr(limit, side)
        ends = [
            solved((*limits[:k], replace(limit, **{side: value * (1.0 + sign * step)}), *limits[k + 1 :]), place)
            for sign in (1.0, -1.0)
        ]
        measured = (ends[0].objective - ends[1].objective) / (2.0 * step * best.objective)
        # The objective bends over the step: a central difference is good to its square.
        assert best.multipliers[f"{limit.output} at its {side}"] == pytest.approx(abs(measured), rel=1e-3)


def test_smaller_of_the_two_relaxations_comes_first() -> None:
    impossible = crank_rocker(0.3, pressure=0.15)
    results = optimum(impossible, [{"branch": 1.0}], OptimiseSettings(starts=2, seed=1))
    assert results[0].status == st.LIMIT_EXCEEDED
    assert all(a.violation <= b.violation for a, b in itertools.pairwise(results))
    assert len({r.start for r in results}) == len(results) > 3
    best = results[0]
    # The smallest relaxation is itself an optimum: its conditions hold, and the limits that hold it share its price.
    assert best.kkt_residual <= 1e-5 and best.multipliers and sum(best.multipliers.values()) > 0.5
    along = on_locus(impossible)
    start = along.placed(best.design, np.clip(along.scaled(best.design[None, :])[0], 0.0, 1.0))
    assert minimise(along, start, OptimiseSettings(starts=1))[0].violation >= best.violation * (1.0 - 1e-6)
