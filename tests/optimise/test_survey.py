"""What the starts of a search tell: basins, the best from distinct valleys, unseen share, when enough is enough."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from kernels import status as st
from sweep.optimise import Survey, explore
from sweep.optimise.multistart.survey import GROUP_SIZE, StartGroup, in_groups, survey, wanted, with_basins
from sweep.study import OptimiseSettings, load_study
from tests.optimise.test_study import STUDY
from tests.support.starts import bowl, populations_ended_at, result

ASKED = OptimiseSettings(starts=20)


def starts(count: int) -> np.ndarray:
    rng = np.random.default_rng(1)
    return np.column_stack([rng.uniform(-4, 4, (count, 2)), np.zeros(count), np.ones(count)])


def test_values_within_a_ten_thousandth_are_one_basin_and_infeasible_ends_are_none() -> None:
    ends = [result(0, 2.0), result(1, 1.0), result(2, 1.00005), result(3, 0.5, st.LIMIT_EXCEEDED), result(4, 1.001)]
    assert {r.start: r.basin for r in with_basins(ends)} == {0: 3, 1: 1, 2: 1, 3: 0, 4: 2}


def test_unseen_share_is_the_larger_of_good_turing_and_boender_rinnooy_kan() -> None:
    values = [1.0] * 6 + [2.0] * 3 + [3.0]
    found = survey(bowl(), [StartGroup(starts(10))], [result(k, x) for k, x in enumerate(values)], ASKED, "starts")
    # One of ten was met once; 3 * 4 / (10 * 9) is larger.
    assert (found.basins, found.best) == (3, 6) and found.unseen == pytest.approx(12 / 90)
    chance = "another start finds a new one with an estimated chance of 13 %"
    assert found.words == f"3 local optima found, the best from 6 distinct starts; {chance}"
    singles = [result(k, 1.0 if k < 8 else float(k)) for k in range(12)]
    assert survey(bowl(), [StartGroup(starts(12))], singles, ASKED, "starts").unseen == pytest.approx(4 / 12)


POPULATIONS = replace(ASKED, globally="proportions", populations=50)


def test_of_a_population_the_best_end_counts_alone() -> None:
    values = [9.0, 1.0, 2.0, 1.0, 3.0, 1.0, 4.0]
    ends, some = [result(k, x) for k, x in enumerate(values)], starts(7)
    # Three populations, all of which ended in the best basin; their other ends, and a start of the sweep, do not count.
    groups = [StartGroup(some[:1], counted=0), *(StartGroup(some[k : k + 2], k, 1) for k in (1, 3, 5))]
    found = survey(bowl(), groups, ends, replace(POPULATIONS, unseen=0.02), "starts")
    assert (found.basins, found.best, found.starts) == (1, 3, 7) and found.unseen == pytest.approx(2 / 6)
    assert found.populations == 3 and not found.enough
    chance = "another population finds a new one with an estimated chance of 33 %"
    assert found.words == f"3 populations ended best in 1 local optimum, 3 of them in the best one; {chance}"
    assert found.warnings[-1] == f"{chance}, not the 2 % wanted: more populations may find a better one"
    assert survey(bowl(), groups, ends, POPULATIONS, "starts").enough
    twice = survey(bowl(), groups, ends[:5], POPULATIONS, "starts")
    assert (twice.basins, twice.best) == (1, 2) and twice.unseen == 1.0 and not twice.enough


def test_starts_of_different_samples_are_distinct_wherever_they_stand() -> None:
    alike = np.tile(starts(1), (12, 1)) + 1e-4 * np.arange(12)[:, None] * np.array([1.0, 1.0, 0.0, 0.0])
    ends = [result(k, 1.0) for k in range(12)]
    together = survey(bowl(), [StartGroup(alike)], ends, ASKED, "starts")
    assert together.best == 1 and not together.enough
    samples = [StartGroup(alike[4 * k : 4 * k + 4], k) for k in range(3)]
    apart = survey(bowl(), samples, ends, ASKED, "starts")
    assert apart.best == 3 and apart.enough
    found, told, _ = explore(bowl(), samples, ASKED)
    assert (len(found), told.best, told.ended) == (12, 3, "enough")


def test_populations_are_enough_by_the_same_rule_as_starts() -> None:
    def settled(values: list[float], share: float = 0.02) -> bool:
        return populations_ended_at(values, replace(ASKED, unseen=share)).enough

    # One basin: 2 / (11 * 10) is below 2 %; two: 6 / (18 * 17); three: 12 / (25 * 24) is 2 %.
    assert settled([1.0] * 11) and not settled([1.0] * 10)
    assert settled([1.0] * 16 + [1.1] * 2) and not settled([1.0] * 15 + [1.1] * 2)
    assert settled([1.0] * 19 + [1.1] * 3 + [1.2] * 3) and not settled([1.0] * 18 + [1.1] * 3 + [1.2] * 3)
    # Values that nearly agree are one basin; what was met once is a share of 1/25; the best has to be met three times.
    assert settled([1.0] * 8 + [1.1, 1.10001, 1.09999, 1.10002] + [1.0] * 6)
    assert not settled([1.0] * 22 + [1.1] * 2 + [1.2])
    assert not settled([1.0] * 2 + [1.1] * 23)
    assert not settled([]) and not settled([1.0], 1.0)
    # Without a share the best basin decides, and what is not feasible is no end.
    values = [1.1, 1.0, 1.1, 1.0, math.inf, 1.1, 1.0]
    assert settled(values, 1.0) and not settled(values[:-1], 1.0)
    assert not settled([1.0, math.inf, 1.0], 1.0) and not settled([], 1.0)


def test_share_of_unseen_basins_that_ends_a_search_is_that_of_its_starts_or_the_one_asked() -> None:
    assert [wanted(settings) for settings in (ASKED, POPULATIONS)] == [0.02, 1.0]
    assert [wanted(replace(settings, unseen=0.05)) for settings in (ASKED, POPULATIONS)] == [0.05, 0.05]


def test_unseen_share_is_no_smaller_than_what_random_searches_leave() -> None:
    # Six basins of random volumes, 18 searches each: what none of them met.
    rng = np.random.default_rng(8)
    estimated, happened = [], []
    for _ in range(1000):
        volumes = rng.dirichlet(np.ones(6))
        ends = rng.choice(6, 18, p=volumes)
        found = survey(
            bowl(), [StartGroup(starts(18))], [result(k, 1.0 + x) for k, x in enumerate(ends)], ASKED, "starts"
        )
        estimated.append(found.unseen)
        happened.append(1.0 - volumes[np.unique(ends)].sum())
    assert np.mean(estimated) >= np.mean(happened)


def test_starts_beside_each_other_count_once() -> None:
    close = np.repeat(starts(1), 12, axis=0) + np.linspace(0.0, 1e-3, 12)[:, None] * [1, 1, 0, 0]
    ends = [result(k, 1.0) for k in range(12)]
    assert survey(bowl(), [StartGroup(close)], ends, ASKED, "starts").best == 1
    assert not survey(bowl(), [StartGroup(close)], ends, ASKED, "starts").enough
    assert survey(bowl(), [StartGroup(starts(12))], ends, ASKED, "starts").enough


def test_one_start_or_none_feasible_says_nothing_of_the_rest() -> None:
    assert survey(bowl(), [StartGroup(starts(1))], [result(0, 1.0)], ASKED, "starts").unseen == 1.0
    nothing = survey(
        bowl(), [StartGroup(starts(2))], [result(k, 1.0, st.LIMIT_EXCEEDED) for k in range(2)], ASKED, "starts"
    )
    assert nothing.unseen == 1.0 and nothing.basins == 0
    assert nothing.words == "none led to a design within all limits"


def test_search_ends_when_enough_is_known() -> None:
    many = starts(50)
    results, found, _ = explore(bowl(), in_groups(many), replace(ASKED, starts=50))
    # One basin, met by 12 starts: 2 / (12 * 11) is below 2 %, 2 / (6 * 5) is not.
    assert found.ended == "enough" and len(results) == found.starts == 12 == 2 * GROUP_SIZE
    assert found.warnings == ()
    _, more, _ = explore(bowl(), in_groups(many), replace(ASKED, starts=50, unseen=1e-3))
    assert more.starts == 48 and more.unseen == pytest.approx(2 / (48 * 47))


@pytest.mark.parametrize("jobs", [1, 2])
def test_each_start_is_told_when_it_is_done_and_none_before_the_first(jobs: int) -> None:
    told: list[tuple[int, int, float]] = []
    asked = replace(ASKED, starts=8)
    results = explore(bowl(), in_groups(starts(8)), asked, jobs=jobs, tell=lambda *now: told.append(now)).results
    assert told[0] == (0, 8, math.inf)
    assert [done for done, _, _ in told] == list(range(len(results) + 1)) and {most for _, most, _ in told} == {8}
    assert told[-1][2] == results[0].objective


def test_number_of_starts_does_not_depend_on_jobs() -> None:
    many, asked = starts(30), OptimiseSettings(starts=30)
    alone, one, _ = explore(bowl(), in_groups(many), asked)
    together, two, _ = explore(bowl(), in_groups(many), asked, jobs=2)
    assert one == two and [r.objective for r in alone] == [r.objective for r in together]


def test_warnings_name_what_was_not_reached() -> None:
    found = Survey(4, 20, 2, 1, 0.5, 0.02, "starts")
    assert found.warnings[0] == "only 4 starts of the 20 asked: no more were found in the design space"
    assert (found.shortcomings, found.doubts) == (found.warnings[:1], found.warnings[1:])
    assert "1 of the 3 distinct starts" in found.warnings[1]
    assert "an estimated chance of 50 %, not the 2 % wanted: more starts" in found.warnings[1]
    # Of n starts in one basin the estimate is 2 / (n (n - 1)): 2.2 % of 10, 1.8 % of 11.
    few = [replace(found, starts=n, asked=n, basins=1, best=n, unseen=2 / (n * (n - 1))) for n in (8, 10, 11)]
    takes = "an estimated chance of 3.6 %, not the 2 % wanted, which takes at least 11 starts: more starts"
    assert takes in few[0].doubts[0] and "at least 11 starts" in few[1].doubts[0] and few[2].doubts == ()
    late = replace(found, ended="time", starts=5, asked=12)
    assert late.warnings == ("time ran out: 5 of 12 starts",)


def test_signs_have_basins_of_their_own() -> None:
    both = starts(6)
    both[3:, 3] = -1.0
    ends = [result(k, 1.0 if k < 4 else 2.0) for k in range(6)]
    found = survey(bowl(), [StartGroup(both)], ends, ASKED, "starts")
    assert found.kinds == (("branch = -1", 3, 2), ("branch = 1", 3, 1))
    assert math.isclose(found.unseen, 6 / 30)


def test_every_key_of_the_search_arrives(tmp_path: Path) -> None:
    keys = 'starts = 7\nseed = 3\nunseen = "5 %"\nlooks = 900\ntime_budget = "2 s"\nglobal = "none"\npopulations = 9\n'
    (tmp_path / "study.toml").write_text(STUDY.format(swing=40).replace("starts = 3\nseed = 1\n", keys))
    assert load_study(tmp_path).optimise == OptimiseSettings(7, 3, 2.0, None, 0.05, 900, "none", 9)


def test_listed_angles_are_in_degrees() -> None:
    both = np.tile([1.0, 2.0, 0.0, 1.0], (4, 1))
    both[2:, 2] = math.pi / 3.0
    problem = bowl()
    p, q, r, branch = problem.family.parameters
    family = replace(problem.family, parameters=(p, q, replace(r, unit="angle"), branch))
    ends = [result(k, 1.0) for k in range(4)]
    found = survey(replace(problem, family=family), [StartGroup(both)], ends, ASKED, "starts")
    assert [words for words, *_ in found.kinds] == ["r = 0 deg", "r = 60 deg"]
