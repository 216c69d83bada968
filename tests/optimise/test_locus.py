"""Search along the locus: coordinates, gradients, the answers of the search in the parameters, infeasible problems."""

from __future__ import annotations

import math
from dataclasses import replace
from itertools import islice

import numpy as np
import pytest

from kernels import status as st
from sweep.dataset.files import beside
from sweep.engine.run import run
from sweep.errors import InputError
from sweep.evaluation.summaries import design_outputs
from sweep.families import family
from sweep.families.base import Accuracy
from sweep.optimise import Problem, minimise, on_locus, optimise_study, optimum
from sweep.optimise.local.model import Model
from sweep.optimise.problem.program import Program
from sweep.optimise.starts.ranked import ranking
from sweep.study import Limit, OptimiseSettings, load_study
from tests.support.specifications import specifications
from tests.support.starts import from_sample

RSSR, RSSP = family("rssr"), family("rssp")
BRANCHES = ({"branch": 1.0}, {"branch": -1.0})


def sized(seed: int = 1971) -> Problem:
    """A random specification with the rocker's length fixed."""
    return next(specifications(seed))


def placed() -> Problem:
    """The same with all lengths varied and the frame fixed: e is given, c follows."""
    limits = (Limit("swing", 0.7, 0.7), Limit("phi0", 3.0, 3.0), Limit("max_pressure_angle", None, 0.9))
    names = ("a", "b", "c", "f", "g", "alpha")
    low, high = np.array([0.1, 0.5, 0.3, -1, -1, 0.2]), np.array([1.5, 5, 2.5, 1, 1, 1.4])
    return Problem(RSSR, names, low, high, {"e": 1.0}, "max_abs_d2psi", limits)


def slider() -> Problem:
    limits = (Limit("stroke", 24.5, 24.5), Limit("phi0", 3.3, 3.3), Limit("max_pressure_angle", None, 0.6))
    low, high = np.array([5.0, 20, 0, -10, 0.1]), np.array([30.0, 90, 20, 10, 1.4])
    return Problem(RSSP, ("a", "b", "e", "f", "alpha"), low, high, {}, "max_abs_d2s", limits)


PROBLEMS = {"rocker of given length": sized, "rocker in a given frame": placed, "slider": slider}


@pytest.mark.parametrize("name", PROBLEMS)
def test_every_place_meets_the_equations_and_is_read_back(name):
    raw = PROBLEMS[name]()
    along = on_locus(raw)
    assert not any(limit.minimum == limit.maximum for limit in along.limits)
    assert len(along.variables) == len(raw.variables) - 2
    rng = np.random.default_rng(3)
    for signs in BRANCHES:
        designs = along.rows(along.lower + along.span * rng.random((2000, len(along.variables))), **signs)
        designs = designs[np.isfinite(designs).all(axis=1)]
        wanted = [limit.output for limit in raw.limits[:2]]
        found = design_outputs(raw.family, designs, [*wanted, "margin"], Accuracy(target=1e-9))
        good = found["margin"] > 0.01
        assert good.sum() > 20
        for limit in raw.limits[:2]:
            np.testing.assert_allclose(np.abs(found[limit.output][good]), limit.maximum, rtol=1e-9)
        again = along.placed(designs[good][0], along.scaled(designs[good]))
        np.testing.assert_allclose(again, designs[good], rtol=1e-7, atol=1e-7)


@pytest.mark.parametrize("name", PROBLEMS)
def test_gradients_along_the_locus_equal_differences(name):
    along = on_locus(PROBLEMS[name]())
    start = from_sample(along, BRANCHES, 1, 5)[0]
    model = Model(along, Program(along), start, lambda: False)
    at = np.clip(along.scaled(start[None, :])[0], 0.05, 0.95)
    state = model.state(at)
    jacobian = model.jacobian(at, state.form, state.form.points)
    step = 1e-5
    for j in range(len(at)):
        rows = []
        for n in (-1, 1):
            moved = at.copy()
            moved[j] += n * step
            rows.append(state.form.rows(model.tracked(moved, state.form, state.form.points)[1], 0.0))
        np.testing.assert_allclose(jacobian[:, j], (rows[1] - rows[0]) / (2.0 * step), rtol=1e-5, atol=1e-5)


@pytest.mark.parametrize("name", PROBLEMS)
def test_both_searches_find_the_same_optimum(name):
    raw = PROBLEMS[name]()
    along = on_locus(raw)
    starts = from_sample(along, BRANCHES, 3, 1)
    best = minimise(along, starts, OptimiseSettings(starts=3))[0]
    assert best.status == st.OK and best.kkt_residual <= 1e-6
    # In the parameters, with equations, from a feasible design some way off.
    other = minimise(raw, starts, OptimiseSettings(starts=3))[0]
    assert other.objective == pytest.approx(best.objective, rel=1e-6)
    found = design_outputs(raw.family, best.design[None, :], [x.output for x in raw.limits], Accuracy(target=1e-10))
    for limit in raw.limits[:2]:
        assert abs(found[limit.output][0]) == pytest.approx(limit.maximum, rel=1e-9)
    assert found["max_pressure_angle"][0] <= raw.limits[2].maximum + 1e-8


def test_problems_without_equations_stay_as_they_are():
    raw = sized()
    assert on_locus(replace(raw, limits=raw.limits[1:])).coordinates is None
    along = on_locus(raw)
    assert on_locus(along) is along
    held = on_locus(replace(raw, variables=raw.variables[1:], lower=raw.lower[1:], upper=raw.upper[1:],
                            fixed={"c": 1.0, "a": 0.4}))  # fmt: skip
    assert Limit("a", 0.4, 0.4) in held.limits, "a link that follows and is given becomes an equation"


def test_starts_are_those_of_their_seed_and_ranked_by_what_they_are_worth():
    along = on_locus(sized())
    first, again, other = (from_sample(along, BRANCHES, 4, seed) for seed in (1, 1, 2))
    assert first.tobytes() == again.tobytes() != other.tobytes()
    merit = ranking(along, first)
    assert np.isfinite(merit).all() and (np.diff(merit) >= 0.0).all() and merit.max() < 1e10
    rng = np.random.default_rng(0)
    random = ranking(along, along.rows(along.lower + along.span * rng.random((4000, 4)), branch=1.0))
    assert merit[0] < random.min()


def test_ranking_puts_designs_that_lack_a_limited_output_behind():
    raw = sized()
    turning = np.array([2.0, 2.5, 2.2, 1.0, 0.0, 0.0, 0.0, 1.0])  # a drag link: the rocker turns, there is no swing
    good = from_sample(on_locus(raw), BRANCHES, 1, 1)[0]
    merit = ranking(raw, np.array([turning, good, np.full(8, np.nan)]))
    assert merit[1] < 1e10 < merit[0] and merit[2] == math.inf


def test_infeasible_specification_is_answered_with_the_smallest_relaxation():
    raw = sized()
    tight = replace(raw, limits=(*raw.limits[:2], Limit("max_pressure_angle", None, math.radians(8))))
    result = optimum(tight, BRANCHES, OptimiseSettings(starts=1, seed=1))[0]
    assert result.status == st.LIMIT_EXCEEDED and result.ended == "infeasible"
    assert "max_pressure_angle" in result.relaxation and result.violation > 1e-3
    # No design of the locus, where the equations hold, comes as near.
    along = minimise(on_locus(tight), from_sample(on_locus(tight), BRANCHES, 2, 1), OptimiseSettings(starts=2))[0]
    assert along.status == st.LIMIT_EXCEEDED and result.violation <= along.violation * (1.0 + 1e-9)


def test_optimum_is_at_least_as_good_as_what_a_search_in_the_parameters_finds():
    for problem in islice(specifications(7), 2):
        ours = optimum(problem, BRANCHES, OptimiseSettings(starts=4, seed=1))[0]
        theirs = minimise(problem, from_sample(problem, BRANCHES, 4, 1), OptimiseSettings(starts=4))[0]
        assert ours.kkt_residual <= 1e-6
        assert theirs.status != st.OK or ours.objective <= theirs.objective * (1.0 + 1e-6)


STUDY = """
[study]
name = "along"
[mechanism]
family = "rssr"
[scene]
want = ["swing", "phi0", "max_abs_d2psi", "max_pressure_angle"]
[locus]
swing = "50 deg"
phi0 = "185 deg"
phi_ext = {{ from = 0, to = 360, unit = "deg" }}
[design]
sample = {{ kind = "sobol", n = 65536, seed = 1 }}
alpha = {{ from = 20, to = 70, unit = "deg" }}
e = {{ from = 40, to = 90, unit = "mm" }}
f = {{ from = -20, to = 20, unit = "mm" }}
g = {{ from = -20, to = 20, unit = "mm" }}
[limits]
max_pressure_angle = {{ max = 45, unit = "deg" }}
b = {{ max = 120, unit = "mm" }}
c = {{ min = 30, max = 60, unit = "mm" }}
[objective]
minimise = "max_abs_d2psi"
[optimise]
starts = 3
seed = 1
{variables}
[reference.design]
a = "20 mm"
b = "90 mm"
c = "50 mm"
e = "80 mm"
f = "5 mm"
g = "5 mm"
alpha = "40 deg"
[output]
curves = "none"
"""


SYMMETRIC = """
[study]
name = "symmetric"
[mechanism]
family = "rssr"
[locus]
swing = "70 deg"
phi0 = "185 deg"
phi_ext = { from = 0, to = 350, count = 11, unit = "deg" }
[design]
e = "20 mm"
f = { from = 100, to = 200, count = 2, unit = "mm" }
g = "0 mm"
alpha = "90 deg"
[objective]
minimise = "max_abs_d2psi"
[optimise]
starts = 1
"""


def test_study_on_a_locus_optimises_along_it_and_agrees_with_its_equations(tmp_path):
    import pandas as pd

    best = {}
    for variables in ("", 'variables = "locus"', 'variables = "parameters"'):
        path = tmp_path / "study.toml"
        path.write_text(STUDY.format(variables=variables))
        study = load_study(path)
        folder = run(study, tmp_path / "out", jobs=1) if not best else tmp_path / "out"
        optimise_study(study, folder)
        best[variables] = pd.read_parquet(beside(folder) / "_optimum.parquet")
    default, along, raw = best.values()
    pd.testing.assert_frame_equal(default, along)
    assert along.iloc[0].ended == raw.iloc[0].ended == "converged"
    assert along.iloc[0].max_abs_d2psi == pytest.approx(raw.iloc[0].max_abs_d2psi, rel=1e-6)
    held = along[along.role != "reference"]
    np.testing.assert_allclose(held.swing.abs(), math.radians(50), rtol=1e-12)
    np.testing.assert_allclose(held.phi0, math.radians(185), rtol=1e-12)
    assert along.iloc[0].c <= 60.0 + 1e-6 and along.iloc[0].b <= 120.0 + 1e-6
    # The reference is no design of the locus: it stays itself, and how far it is off is told as ever.
    assert along.iloc[-1].a == 20.0 and along.iloc[-1].violation == raw.iloc[-1].violation > 0.01


def test_a_locus_without_a_mechanism_says_so(tmp_path):
    """With g = 0 and crossed axes every crank-rocker is symmetric, and no other phi0 than 180 degrees exists."""
    path = tmp_path / "study.toml"
    path.write_text(SYMMETRIC)
    with pytest.raises(InputError, match="allowed: at least one mechanism that"):
        run(load_study(path), tmp_path / "out", jobs=1)


def test_equations_that_say_the_same_are_refused_by_name() -> None:
    """A crank-rocker without quick return: phi0 = 180 deg and stroke_ratio = 1 are one equation, of which every start
    would stall; beside the swing either of them is searched.
    """
    half, swing = Limit("phi0", np.pi, np.pi), Limit("swing", 0.8, 0.8)
    once = replace(sized(), limits=(swing, half))
    starts = from_sample(once, [{"branch": -1.0}], 2, 0)
    assert len(starts) == 2 and minimise(once, starts, OptimiseSettings(looks=3))
    twice = replace(once, limits=(swing, half, Limit("stroke_ratio", 1.0, 1.0)))
    with pytest.raises(InputError, match="phi0 and stroke_ratio"):
        minimise(twice, starts, OptimiseSettings(looks=3))
    with pytest.raises(InputError, match="stroke_ratio"):  # what the locus holds by construction says it already
        optimum(twice, [{"branch": -1.0}], OptimiseSettings(starts=2))


def test_an_equation_that_no_variable_changes_is_refused_as_such() -> None:
    """A planar crank-rocker's swing does not depend on where along the axes its planes are."""
    fixed = {"a": 1.0, "b": 4.0, "c": 3.0, "e": 3.5, "alpha": 0.0, "f": 0.0, "branch": 1.0}
    equation = (Limit("swing", 0.8, 0.8),)
    box = np.array([-1.0]), np.array([1.0])
    problem = Problem(family("rssr"), ("g",), *box, fixed, "max_abs_d2psi", equation)
    with pytest.raises(InputError, match="swing'; allowed: an equation of what some variable changes"):
        minimise(problem, problem.rows(np.zeros((1, 1))), OptimiseSettings(looks=3))
