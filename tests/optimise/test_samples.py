"""Samples that starts come from: several that know nothing of each other, each of which reaches the bounds."""

from __future__ import annotations

import itertools
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from sweep.engine.run import run
from sweep.families import family
from sweep.optimise import Problem, on_locus, optimum
from sweep.optimise.multistart.survey import GROUP_SIZE
from sweep.optimise.starts import ranked as sampling
from sweep.optimise.starts.dataset import sample_seconds
from sweep.optimise.starts.populations import Members, population
from sweep.optimise.starts.posing import problem_and_starts
from sweep.optimise.starts.ranked import OUTSIDE, Ranked
from sweep.study import Limit, OptimiseSettings, load_study
from tests.support.starts import from_sample, gathered

BRANCHES = [{"branch": 1.0}, {"branch": -1.0}]
# The best design stands at the lower bounds of e and f and near the upper one of alpha; of 800 000 designs between the
# bounds one or none keeps the limits there.  The basin beside it is 0.14 % worse, and a thousand times as large.
CORNER = Problem(
    family("rssr"), ("a", "b", "c", "e", "f", "g", "alpha"),
    np.array([0.145436, 0.830086, 0.636441, 0.293012, -1.101328, -0.981645, 0.210784]),
    np.array([0.535226, 2.897126, 1.343083, 1.927138, 0.989255, 1.438629, 1.31103]), {}, "max_abs_d2psi",
    (
        Limit("swing", 0.707859, 0.707859), Limit("phi0", 3.027439, 3.027439),
        Limit("max_pressure_angle", None, 1.004165),
    ),
)  # fmt: skip
BEST = 0.356066
PLACE = np.array([0.0, 0.0, 0.705, 0.945, 0.706])  # of the best one between the bounds on the locus
STUDY = """
[study]
name = "corner"
[mechanism]
family = "rssr"
[scene]
want = ["max_abs_d2psi", "max_pressure_angle"]
[locus]
swing = { values = [0.707859, -0.707859], unit = "rad" }
phi0 = "3.027439 rad"
phi_ext = { from = 0, to = 360, unit = "deg" }
[design]
sample = { kind = "sobol", n = 65536, seed = 1 }
e = { from = 0.293012, to = 1.927138, unit = "mm" }
f = { from = -1.101328, to = 0.989255, unit = "mm" }
g = { from = -0.981645, to = 1.438629, unit = "mm" }
alpha = { from = 0.210784, to = 1.31103, unit = "rad" }
[limits]
rotatable = true
max_pressure_angle = { max = 1.004165, unit = "rad" }
a = { min = 0.145436, max = 0.535226, unit = "mm" }
b = { min = 0.830086, max = 2.897126, unit = "mm" }
c = { min = 0.636441, max = 1.343083, unit = "mm" }
[objective]
minimise = "max_abs_d2psi"
[optimise]
starts = 24
"""


def met(problem: Problem, starts: np.ndarray) -> np.ndarray:
    """Which starts stand near the best design."""
    near = np.linalg.norm(problem.scaled(starts) - PLACE, axis=1) < 0.2
    return np.asarray(near & (starts[:, -1] == 1.0), np.bool_)


@pytest.mark.parametrize("seed", [42, 7])
def test_basin_at_several_bounds_is_found_from_a_sample(seed: int) -> None:
    found = optimum(CORNER, BRANCHES, OptimiseSettings(starts=12, seed=seed))
    assert found[0].objective == pytest.approx(BEST, rel=5e-6)
    assert found[0].status == 0 and found[0].kkt_residual <= 1e-6


def test_nearly_every_sample_reaches_a_basin_at_several_bounds(monkeypatch: pytest.MonkeyPatch) -> None:
    problem = on_locus(CORNER)

    def samples(seeds: range) -> list[int]:
        found = [gathered(sampling.samples(problem, BRANCHES, 4 * GROUP_SIZE, seed)) for seed in seeds]
        return [len({numbers[k] for k in np.flatnonzero(met(problem, starts))}) for starts, numbers in found]

    assert sum(samples(range(2))) >= 6  # of eight
    # Between the bounds alone, and from what keeps the limits alone, hardly any does.
    monkeypatch.setattr(sampling, "WIDENING", 0.0)
    assert sum(samples(range(2))) <= 2


def test_study_whose_sweep_is_large_has_starts_from_samples_too(tmp_path: Path) -> None:
    (tmp_path / "study.toml").write_text(STUDY)
    study = load_study(tmp_path)
    folder = run(replace(study, optimise=None), tmp_path / "designs", jobs=1)
    problem, groups = problem_and_starts(study, folder)
    starts, _ = gathered(groups)
    assert len(starts) == 24
    assert not met(problem, starts[:12]).any() and met(problem, starts[12:]).any()


def test_samples_have_points_of_their_own_and_do_not_depend_on_their_number() -> None:
    problem = on_locus(CORNER)
    starts, numbers = gathered(sampling.samples(problem, BRANCHES, 12, 3))
    assert numbers == (0,) * 6 + (1,) * 6
    np.testing.assert_array_equal(starts[:6], from_sample(problem, BRANCHES, 6, 3))
    np.testing.assert_array_equal(starts[6:], population(Ranked(problem, BRANCHES, 6), (3, 1)).designs)
    assert len(np.unique(starts, axis=0)) == 12
    assert gathered(sampling.samples(problem, BRANCHES, 7, 3))[1] == (0, 0, 0, 0, 1, 1, 1)


def test_sample_that_is_stopped_ranks_no_further_design(monkeypatch: pytest.MonkeyPatch) -> None:
    ranked: list[int] = []
    rank = sampling.ranking

    def counted(*given):
        ranked.append(1)
        return rank(*given)

    monkeypatch.setattr(sampling, "ranking", counted)
    stops = iter([False, True, True])
    found = population(Ranked(on_locus(CORNER), BRANCHES, 2), (3, 0), lambda: next(stops))
    assert len(found.designs) and len(ranked) <= 3  # two blocks, then those of them that seem good


def test_price_of_a_sample_is_that_of_few_designs_where_they_are_dear(monkeypatch: pytest.MonkeyPatch) -> None:
    base = from_sample(CORNER, BRANCHES, 1, 1)[0]
    for step, number in ((0.1, 64), (0.001, 8192)):
        ticks = itertools.count(step=step)
        monkeypatch.setattr("sweep.optimise.starts.dataset.time.process_time", lambda ticks=ticks: next(ticks))
        of_sample = (2**15 + 16 * 24 * 12) * GROUP_SIZE  # designs drawn, and tries around the best of them
        assert sample_seconds(CORNER, base, GROUP_SIZE) == pytest.approx(step / number * of_sample)


def test_price_of_a_sample_does_not_count_the_compilation(monkeypatch: pytest.MonkeyPatch) -> None:
    """The search of a fresh study was said to take 3.3 hours, and took 7 seconds."""
    clock, took = [0.0], iter([130.0])

    def ranked(*_: object) -> None:
        clock[0] += next(took, 0.1)

    monkeypatch.setattr("sweep.optimise.starts.dataset.ranking", ranked)
    monkeypatch.setattr("sweep.optimise.starts.dataset.time.process_time", lambda: clock[0])
    base = from_sample(CORNER, BRANCHES, 1, 1)[0]
    assert sample_seconds(CORNER, base, 1) == pytest.approx(0.1 / 64 * (2**15 + 16 * 24 * 12))


def test_two_coordinates_in_five_of_half_a_sample_are_at_bounds_but_no_angle_of_a_whole_turn() -> None:
    problem = on_locus(CORNER)
    drawn = sampling._drawn_within(problem, np.random.default_rng(1).random((20_000, 5)))
    ends = ((drawn == 0.0) | (drawn == 1.0)).mean(axis=0)
    # 0.7 of a width of 1.7, in half of the sample
    np.testing.assert_allclose(ends[:4], 0.35 / 1.7, atol=0.01)
    assert ends[4] == 0.0 and drawn[:, 4].min() >= 0.25 and drawn[:, 4].max() <= 0.75


def test_half_of_what_is_improved_misses_the_limits_and_stands_apart(monkeypatch: pytest.MonkeyPatch) -> None:
    rng = np.random.default_rng(2)
    places = rng.random((400, 5))
    kinds = np.zeros(400, np.intp)
    merit = np.where(places[:, 0] < 0.5, 1.0 + places[:, 1], OUTSIDE * (2.0 + places[:, 1]))
    landscape = Ranked(on_locus(CORNER), BRANCHES, 1)
    monkeypatch.setattr(landscape, "values", lambda places, *_: 1.0 + places[:, 1])
    monkeypatch.setattr(landscape, "children", lambda parents, *_: parents)
    monkeypatch.setattr(landscape, "ends", 9)  # more than keep the limits: no member is left out afterwards

    chosen = landscape.first(Members(places, kinds, merit, places[:, :0]), rng, lambda: False)
    assert len(np.unique(chosen.places, axis=0)) == len(chosen.places) == 16
    assert (chosen.places[:8, 0] < 0.5).all() and (chosen.places[8:, 0] >= 0.5).all()
    gaps = np.linalg.norm(chosen.places[8:, None] - chosen.places[None], axis=2)
    assert gaps[gaps > 0.0].min() > 0.05
    # Where nothing misses the limits, all of them keep these.
    chosen = landscape.first(Members(places, kinds, 1.0 + places[:, 1], places[:, :0]), rng, lambda: False)
    assert len(chosen.merit) == 16 and (chosen.merit < OUTSIDE).all()
