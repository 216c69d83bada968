"""Known optima of real mechanisms (published examples, section 4; geared dwell, closed form) and a needle drive."""

from __future__ import annotations

import math

import numpy as np
import pytest

from kernels import status as st
from sweep.errors import InputError
from sweep.evaluation.summaries import design_outputs
from sweep.families import family
from sweep.families.base import Accuracy
from sweep.optimise import Problem, minimise
from sweep.optimise.local import newton
from sweep.optimise.local.model import Model
from sweep.optimise.problem.program import Program
from sweep.optimise.starts.populations import diverse
from sweep.study import Limit, OptimiseSettings
from tests.support.starts import from_sample

ONCE = OptimiseSettings(starts=1)
RSSR = family("rssr")
PLANAR = {"e": 1.0, "f": 0.0, "g": 0.0, "alpha": 0.0}


def planar(branch, objective, limits):
    low, high = np.array([0.05, 0.2, 0.2]), np.array([0.9, 1.5, 1.5])
    return Problem(RSSR, ("a", "b", "c"), low, high, PLANAR | {"branch": branch}, objective, limits)


def held(output, degrees):
    return Limit(output, math.radians(degrees), math.radians(degrees))


def freudenstein_primrose(swing, phi0):
    """Coupler over crank of the crank-rocker of best transmission: the cubic of the published example."""
    t, u = math.tan(0.5 * math.radians(phi0)), math.tan(0.5 * math.radians(phi0 - swing))
    roots = np.roots([1.0, 2.0, -t * t, -(t * t) / (u * u) * (1.0 + t * t)])
    q = float(roots[(abs(roots.imag) < 1e-12) & (roots.real > 0.0)].real[0])
    return abs(t) / math.sqrt(q)


def test_best_transmission_for_a_swing_and_a_crank_angle():
    # Swing 45 deg over 165 deg of crank: mu_min = 36.13782 deg, links 0.270443, 0.605283, 0.730439 of the frame.
    problem = planar(-1.0, "max_pressure_angle", (held("swing", 45), held("phi0", 165)))
    results = minimise(problem, problem.rows(np.array([[0.27, 0.6, 0.73], [0.3, 0.7, 0.8], [0.2, 0.9, 0.6]])), ONCE)
    assert [r.status for r in results] == [st.OK] * 3 and results[0].agree == 3
    best = results[0]
    assert 90.0 - math.degrees(best.objective) == pytest.approx(36.13782, abs=5e-6)
    assert best.design[:3] == pytest.approx([0.270443, 0.605283, 0.730439], abs=1e-6)
    assert best.design[1] / best.design[0] == pytest.approx(freudenstein_primrose(45.0, 165.0), abs=1e-6)
    assert best.kkt_residual <= 1e-6 and best.violation <= 1e-9 and best.gap <= 1e-9
    assert set(best.active) == {"swing held by its equation", "phi0 held by its equation"}


@pytest.mark.parametrize(("swing", "mu"), [(40.0, 50.0), (60.0, 40.0)])
def test_central_crank_rocker_of_brodell_and_soni(swing, mu):
    # Three equations for three links; no freedom is left to the objective.
    limits = (held("swing", swing), held("phi0", 180), held("max_pressure_angle", 90 - mu))
    problem = planar(1.0, "max_abs_d2psi", limits)
    result = minimise(problem, problem.rows(np.array([[0.35, 0.6, 0.85]])), ONCE)[0]
    cos_mu, half = math.cos(math.radians(mu)), math.radians(swing)
    b = math.sqrt((1.0 - math.cos(half)) / (2.0 * cos_mu**2))
    c = math.sqrt((1.0 - b * b) / (1.0 - b * b * cos_mu**2))
    assert result.design[:3] == pytest.approx([math.sqrt(b * b + c * c - 1.0), b, c], abs=1e-9)
    assert result.violation <= 1e-9


@pytest.mark.parametrize("k", [1.1, 1.4142, 3.0])
def test_geared_dwell_has_its_corner_optimum_at_a_equal_k(k):
    dwell = family("geared_dwell")
    problem = Problem(dwell, ("a",), np.array([max(0.0, k - 1.9)]), np.array([k + 1.9]), {"k": k}, "max_abs_d2psi")
    w = (1 + 2 * k * k) / (3 * (1 + k * k) + math.sqrt(9 * (1 + k * k) ** 2 - 1 - 2 * k * k))
    exact = math.sqrt(w) * (1 + 2 * k * k - w) / (1 + w) ** 2
    for result in minimise(problem, problem.rows(np.array([[k - 0.8], [k + 1.1]])), ONCE):
        assert result.design[1] == pytest.approx(k, abs=1e-9)
        assert result.objective == pytest.approx(exact, abs=1e-9)
        assert result.kkt_residual <= 1e-6


def test_starts_from_a_sample_are_good_between_its_poses_too():
    """Near a = k + 2 the acceleration has a pole that 64 poses miss: a search among them climbs right into it."""
    dwell = family("geared_dwell")
    limits = (Limit("dwell_angle", 1.842, None), Limit("dwell_deviation", None, 0.66))
    problem = Problem(dwell, ("k", "a"), np.array([1.2, 0.05]), np.array([6.0, 8.0]), {}, "max_abs_d2psi", limits)
    starts = from_sample(problem, [{}], 6, 0)
    found = design_outputs(dwell, starts, ["max_abs_d2psi", "dwell_angle"], Accuracy(target=1e-8))
    assert len(starts) == 6
    assert found["max_abs_d2psi"].max() < 2.1  # the optimum is 1.998, at a = k
    assert found["dwell_angle"].min() > 0.95 * 1.842


SPACE = ("a", "b", "c", "e", "f", "g", "alpha")
LOW, HIGH = np.array([0.2, 1, 0.8, 0, -2, -2, 0]), np.array([1.5, 5, 3, 3, 2, 2, math.pi / 2])


def spatial(pressure):
    limits = (
        held("swing", 52.5), held("phi0", 187.3), Limit("max_pressure_angle", None, math.radians(pressure)),
        Limit("max_z_b", None, 3.0),
    )  # fmt: skip
    return Problem(RSSR, SPACE, LOW, HIGH, {"branch": 1.0}, "max_abs_d2psi", limits)


def test_spatial_crank_rocker_from_a_sample_meets_its_certificate_and_the_summaries():
    problem = spatial(54.2)
    starts = from_sample(problem, [{}], 4, seed=3)
    assert starts.tobytes() == from_sample(problem, [{}], 4, seed=3).tobytes()
    results = minimise(problem, starts, ONCE)
    best = results[0]
    assert best.status == st.OK and best.kkt_residual <= 1e-6 and best.gap <= 1e-9
    names = ["max_abs_d2psi", "swing", "phi0", "max_pressure_angle", "max_z_b", "margin"]
    seen = design_outputs(RSSR, best.design[None, :], names, Accuracy(target=1e-8))
    assert best.objective == pytest.approx(float(seen["max_abs_d2psi"][0]), rel=1e-8)
    assert abs(float(seen["swing"][0])) == pytest.approx(math.radians(52.5), abs=1e-8)
    assert float(seen["phi0"][0]) == pytest.approx(math.radians(187.3), abs=1e-7)
    assert float(seen["max_pressure_angle"][0]) <= math.radians(54.2) + 1e-8
    assert float(seen["max_z_b"][0]) <= 3.0 + 1e-8
    assert best.values["max_pressure_angle"] == pytest.approx(float(seen["max_pressure_angle"][0]), abs=1e-8)


def test_starts_that_do_not_turn_are_brought_to_turn_or_reported():
    problem = spatial(54.2)
    rng = np.random.default_rng(11)
    results = minimise(problem, problem.rows(LOW + (HIGH - LOW) * rng.random((6, 7))), ONCE)
    for result in results:
        assert (result.status == st.LIMIT_EXCEEDED) == (result.violation > 1e-9)
        assert result.status != st.LIMIT_EXCEEDED or result.relaxation
    assert results[0].status == st.OK


def test_links_that_meet_at_no_crank_angle_are_brought_to_the_optimum_by_their_margin():
    # From crank pin to rocker pivot it is 0.9 to h = 1.1, and coupler and rocker together reach 0.4.
    problem = planar(-1.0, "max_pressure_angle", (held("swing", 45), held("phi0", 165)))
    start = problem.rows(np.array([[0.1, 0.2, 0.2]]))
    state = Model(problem, Program(problem), start[0], lambda: False).uncounted(problem.scaled(start)[0])
    margin = 1.0 - ((1.1**2 - 2.0 * 0.2**2) / (2.0 * 0.2**2)) ** 2  # (4 b^2 c^2 - (h^2 - b^2 - c^2)^2)/(2 b c)^2
    # A dozen roundings, and h moves by half the square of the error of its crank angle.
    assert state.defined_violation == pytest.approx(1e-6 - margin, rel=1e-13)
    result = minimise(problem, start, ONCE)[0]
    assert result.status == st.OK
    assert result.design[:3] == pytest.approx([0.270443, 0.605283, 0.730439], abs=1e-6)  # of the published example


def test_impossible_pressure_angle_is_infeasible_and_the_relaxation_says_what_is_possible():
    # A planar crank-rocker of 60 deg swing over 165 deg cannot keep 20 deg; the least it can is found by optimising it.
    equations = (held("swing", 60), held("phi0", 165))
    start = np.array([[0.3, 0.7, 0.8]])
    least = minimise(planar(-1.0, "max_pressure_angle", equations), planar(-1.0, "swing", ()).rows(start), ONCE)[0]
    asked = (*equations, Limit("max_pressure_angle", None, math.radians(20)))
    problem = planar(-1.0, "max_abs_d2psi", asked)
    result = minimise(problem, problem.rows(start), ONCE)[0]
    assert result.status == st.LIMIT_EXCEEDED and result.ended == "infeasible"
    assert result.violation > 0.05
    # Giving way a little everywhere, it needs less of the pressure angle than keeping the equations exactly.
    assert 0.0 < result.relaxation["max_pressure_angle"] <= least.objective - math.radians(20) + 1e-9


def test_needle_drive_beats_the_sine_with_a_straightness_of_a_twentieth_millimetre():
    s = 16.5
    base = {
        "a1": 9.0, "b1": 31.0, "c1": 18.0, "e1": 30.0, "f1": 0.0, "g1": 0.0, "alpha1": 0.0, "branch1": 1.0,
        "a2": s, "b2": 2.5 * s, "c2": 2.5 * s, "e2": 2 * s, "xi2": 5 * s, "eta2": 0.0, "lam2": 0.0, "h2": -4 * s,
        "branch2": 1.0, "kappa2": 1.0, "offset2": -1.8,
    }  # fmt: skip
    free = {
        "a1": 2.7,
        "b1": 9.3,
        "c1": 5.4,
        "e1": 9.0,
        "a2": 5.0,
        "b2": 12.0,
        "c2": 12.0,
        "e2": 10.0,
        "xi2": 25.0,
        "h2": 20.0,
    }
    free |= {"eta2": 8.0, "lam2": 0.2, "offset2": 0.6}
    names = tuple(name for name in base if name in free)
    centre, width = np.array([base[n] for n in names]), np.array([free[n] for n in names])
    chain = family(["rssr", "guide"])
    limits = (
        Limit("rotatable", 1.0, None), Limit("stroke", 24.4, 24.6), Limit("max_abs_dev", None, 0.05),
        Limit("max_pressure_angle1", None, math.pi / 4), Limit("max_pressure_angle2", None, math.pi / 4),
    )  # fmt: skip
    fixed = {name: value for name, value in base.items() if name not in free}
    problem = Problem(chain, names, centre - width, centre + width, fixed, "max_abs_d2s", limits, window=(0.0, 0.6))
    result = minimise(problem, problem.rows(centre), ONCE)[0]
    assert result.status == st.OK and result.kkt_residual <= 1e-6
    assert result.objective < 12.25, "half the stroke is what a pure sine takes"
    names_of = ["max_abs_d2s", "stroke", "max_abs_dev", "max_pressure_angle1", "max_pressure_angle2"]
    seen = design_outputs(chain, result.design[None, :], names_of, Accuracy(target=1e-8), (0.0, 0.6))
    assert result.objective == pytest.approx(float(seen["max_abs_d2s"][0]), rel=1e-7)
    assert 24.4 - 1e-6 <= float(seen["stroke"][0]) <= 24.6 + 1e-6
    assert float(seen["max_abs_dev"][0]) <= 0.05 + 1e-7
    assert max(float(seen["max_pressure_angle1"][0]), float(seen["max_pressure_angle2"][0])) <= math.pi / 4 + 1e-8


def test_newton_step_to_where_the_links_do_not_reach_is_still_a_step():
    # Corrected for rows that do not exist, it became a step of nothing, which ended the rounds far from an optimum.
    problem = spatial(50.0)
    program, base, tried = Program(problem), problem.rows(problem.lower)[0], 0
    for fractions in np.random.default_rng(3).random((60, 7)):
        model = Model(problem, program, problem.placed(base, fractions), lambda: False)
        at = model.state(fractions)
        if at.violation < 1.0:
            tried += 1
            form = at.form.near(at.atoms, at.objective)
            there, _ = newton.propose(model, at, form, at.objective, 0.25, None)
            assert np.abs(there - fractions).max() > 1e-6
    assert tried > 5


def test_diverse_starts_keep_their_distance_and_begin_with_the_best():
    problem = spatial(50.0)
    rng = np.random.default_rng(5)
    designs = problem.rows(LOW + (HIGH - LOW) * rng.random((4000, 7)))
    merit = rng.random(4000)
    merit[17] = np.nan
    chosen = diverse(problem, designs, merit, 10)
    place = problem.scaled(chosen)
    apart = np.linalg.norm(place[:, None] - place, axis=2)[~np.eye(10, dtype=bool)]
    assert len(chosen) == 10 and apart.min() >= 0.5 * math.sqrt(7 / 6)
    assert chosen[0].tobytes() == designs[np.nanargmin(merit)].tobytes()


def test_starts_that_are_no_designs_are_refused():
    problem = spatial(50.0)
    with pytest.raises(InputError, match="starts"):
        minimise(problem, np.empty((0, 8)), ONCE)


def test_start_whose_links_reach_a_part_of_the_turn_is_brought_to_turn_and_one_that_reaches_nowhere_is_told():
    problem = Problem(RSSR, SPACE, LOW, HIGH, {"branch": 1.0}, "max_abs_d2psi", (
        Limit("swing", 0.8, 0.9), Limit("max_pressure_angle", None, 0.8)))  # fmt: skip
    part = np.array([0.59, 3.0, 1.68, 0.9, 0.4, 0.0, 0.45])
    nowhere = np.array([0.265, 2.0, 2.23, 3.0, 2.0, -2.0, math.pi / 2])
    turned, lost = sorted(minimise(problem, problem.rows(np.array([part, nowhere])), ONCE), key=lambda r: r.start)
    assert turned.status == st.OK and turned.kkt_residual <= 1e-6
    assert lost.status == st.OK or lost.relaxation, "a design without any pose is no answer"
