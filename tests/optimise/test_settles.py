"""Searches that once stopped short: near a singular place of the locus, at bounds, where violations were too cheap,
and in a narrow valley outside of the limits; and under a limit on the angle of a dwell.

The numbers are specifications and starts of ``tests/bench/optimise.py`` from which the search did not end at a local
optimum; the values to be met come from the other starts of the same specifications.
"""

from __future__ import annotations

import math
from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from scipy.optimize import minimize

import sweep
from kernels import status as st
from sweep.families import family
from sweep.families.base import Array
from sweep.optimise import Problem, minimise, on_locus
from sweep.optimise.local import descent
from sweep.optimise.local.kkt import Result
from sweep.optimise.local.start import search
from sweep.optimise.problem.on_locus import in_parameters
from sweep.optimise.starts.dataset import random_designs
from sweep.optimise.starts.posing import problem_of
from sweep.study import Limit, OptimiseSettings
from tests.optimise.test_locus import PROBLEMS
from tests.support.needle208_record import record

RSSR = family("rssr")
NAMES = ("a", "b", "c", "e", "f", "g", "alpha")
SAME = 1e-8  # the residual of 1e-6 leaves the objective good to its square in valleys, and to 1e-10 at corners

# Lower and upper bounds; swing, phi0 and largest pressure angle; a start.
SINGULAR = (
    [0.111485, 0.54785, 0.520079, 0.064259, -1.488171, -1.45237, 0.043359],
    [0.853475, 3.787263, 1.463778, 2.463336, 1.20579, 1.343008, 1.559198],
    [0.862334, 3.093452, 1.045266],
    [0.455525745, 2.050946102, 1.456578704, 0.064512696, 1.190253947, -0.954385365, 1.559197521, 1.0],
)
CORNER = (
    [0.191061, 1.584325, 0.595515, 1.14227, -1.438565, -0.570757, 0.275839],
    [0.817658, 3.788041, 1.393114, 2.428102, 1.130679, 1.318282, 1.430098],
    [0.656229, 3.057416, 0.910376],
    [0.205428291, 2.896816853, 0.608891861, 2.426444838, -0.73080929, 1.118266585, 0.39877362, -1.0],
)
OUTSIDE = (
    [0.13288, 1.436968, 0.653933, 0.986309, -0.54508, -0.68147, 0.605615],
    [0.848215, 3.880313, 1.450473, 2.457231, 1.417867, 1.399488, 1.542023],
    [0.474668, 3.096671, 0.951921],
    [0.383051984, 1.586499806, 1.428927827, 1.058246863, 1.417866512, 1.182634686, 1.233757212, 1.0],
)
# A needle drive that misses the stroke by a third and the straightness of 0.015 mm by 1.5 mm.
BENT = [
    11.436044708045696, 51.931898385158526, 24.10600320147112, 47.54980246664343, -22.63512066485712,
    -18.88951990456738, 1.4884783509973654, 1.0, 31.62676900795491, 52.91118734633505, 63.48632942358304,
    43.89634557659732, 72.54767500787922, -6.288003694406879, 0.4967779095514601, 43.02081546855831, -1.0, 1.0,
    -1.0613686715234767, 0.0, 0.0,
]  # fmt: skip


def asked(case: tuple[list[float], ...]) -> tuple[Problem, Array]:
    low, high, (swing, phi0, pressure), start = case
    limits = (Limit("swing", swing, swing), Limit("phi0", phi0, phi0), Limit("max_pressure_angle", None, pressure))
    problem = Problem(RSSR, NAMES, np.array(low), np.array(high), {}, "max_abs_d2psi", limits)
    return on_locus(problem), np.array(start)


def ended(case: tuple[list[float], ...], looks: float = math.inf) -> Result:
    problem, start = asked(case)
    return search(0, problem, start, lambda: False, looks)


def test_search_near_a_singular_place_of_the_locus_ends_at_the_optimum(monkeypatch: pytest.MonkeyPatch) -> None:
    found = ended(SINGULAR)
    assert found.status == st.OK and found.objective == pytest.approx(0.38800573068655736, rel=SAME)
    assert found.looks < 1500
    # Along the locus alone the valley is too narrow for second derivatives by differences.
    monkeypatch.setattr(descent, "in_parameters", lambda problem, design: None)
    alone = ended(SINGULAR, 1500)
    assert alone.kkt_residual > 1e-3 and alone.objective > found.objective * (1.0 + 1e-4)


def test_variables_at_their_bounds_stay_there_when_the_last_violation_is_mended() -> None:
    found = ended(CORNER)
    assert found.status == st.OK and found.objective == pytest.approx(0.3490196230733644, rel=SAME)
    assert "e at its upper bound" in found.active and "g at its upper bound" in found.active
    assert found.design[3] == CORNER[1][3] and found.design[5] == CORNER[1][5]


def test_search_that_rests_outside_of_its_limits_comes_back() -> None:
    found = ended(OUTSIDE)
    assert found.status == st.OK and found.objective == pytest.approx(0.22041993857643907, rel=SAME)


def test_search_far_outside_of_narrow_limits_comes_within_them() -> None:
    study = record(8.0)
    problem = problem_of(study, random_designs(study, 10, 5))
    assert search(0, problem, np.array(BENT), lambda: False, 900).violation < 1e-9


def test_search_stopped_in_other_coordinates_keeps_what_it_found_there() -> None:
    found = ended(SINGULAR, 850)  # the way through the parameters takes the looks 578 to 867
    assert (found.ended, found.looks) == ("looks", 850)
    assert found.violation <= 1e-9 and found.objective == pytest.approx(0.38800573068655736, rel=1e-6)


@pytest.mark.parametrize("name", PROBLEMS)
def test_problem_on_the_locus_is_stated_again_in_its_parameters(name: str) -> None:
    raw = PROBLEMS[name]()
    along = on_locus(raw)
    signs = {"branch": -1.0}
    design = along.rows(along.lower + 0.5 * along.span, **signs)[0]
    again = in_parameters(along, design)
    assert again is not None and again.coordinates is None and again.fixed == raw.fixed
    assert set(again.limits) == set(raw.limits)
    bounds, known = ({n: (x, y) for n, x, y in zip(p.variables, p.lower, p.upper, strict=True)} for p in (again, raw))
    assert bounds == known
    assert in_parameters(raw, design) is None
    # A place that the study holds, or bounds to less than a turn, cannot be said in parameters.
    held = replace(along, lower=np.where(along.lower == -math.pi, 0.0, along.lower))
    held = replace(held, upper=np.where(along.upper == 3.0 * math.pi, 1.0, along.upper))
    assert in_parameters(held, design) is None


def test_links_without_limits_may_change_by_the_longest_of_them() -> None:
    along = on_locus(PROBLEMS["rocker in a given frame"]())
    free = replace(along, limits=along.limits[:1])
    start = np.array([0.3, 2.0, 1.0, 1.0, 0.1, 0.2, 0.7, -1.0])
    again = in_parameters(free, start)
    assert again is not None
    ends = {n: (x, y) for n, x, y in zip(again.variables, again.lower, again.upper, strict=True)}
    assert ends["a"] == pytest.approx((0.03, 2.3)) and ends["b"] == pytest.approx((0.2, 4.0))


def test_a_search_that_leaves_its_limits_where_no_slope_leads_back_ends_within_them():
    """The follower meets its ends twice a turn there, so that phi0 is half a turn, whatever the dimensions are."""
    ends = {
        "a1": (8, 14), "b1": (30, 60), "c1": (15, 30), "e1": (25, 45), "a2": (15, 30), "b2": (40, 70), "e2": (0, 25),
        "offset2": (0.0, 2.0 * math.pi),
    }  # fmt: skip
    fixed = {"f1": -3.3, "g1": 0.0, "alpha1": 0.5 * math.pi, "f2": 0.0, "alpha2": 0.0}
    lower, upper = np.array(list(ends.values()), np.float64).T
    limits = (Limit("phi0", 3.1416, None), Limit("stroke", 13.541, None))
    problem = Problem(family(["rssr", "rssp"]), tuple(ends), lower, upper, fixed, "rms_d2s", limits)
    start = problem.rows(
        np.array([12.5655, 47.1209, 18.9302, 44.8986, 20.9742, 58.3931, 3.80146, 2.442905]), branch1=1.0, branch2=-1.0
    )
    (found,) = minimise(problem, start, OptimiseSettings(starts=1, looks=600))
    assert found.feasible


def test_a_length_that_comes_down_to_zero_has_converged() -> None:
    """Two equal cranks in step: nothing is below 0, where the distance of their pins has no slope."""
    one = {"family": "slider_crank"}
    machine = sweep.machine({"p": one, "q": one | {"offset": 0.2}}, {"apart": {"distance": ["p.b", "q.b"]}})
    fixed = {f"{n}.{k}": float(x) for n in "pq" for k, x in family("slider_crank").example.items()}
    problem = Problem(family(machine), ("q.offset",), np.array([-1.0]), np.array([1.0]), fixed, "max_apart")
    for found in minimise(problem, problem.rows(np.array([[0.4], [-0.7]])), OptimiseSettings()):
        assert found.ended == "converged" and found.active == () and found.looks < 100
        assert abs(found.objective) < 1e-9 and abs(found.design[problem.columns[0]]) < 1e-8


# A six-bar whose slider rests for 80 degrees within 1 % of its stroke: a1, b1, c1, a2, b2, e2 [mm] and offset2 [rad].
SIX_BAR = ("a1", "b1", "c1", "a2", "b2", "e2", "offset2")
SHORTEST = np.array([5.0, 15.0, 10.0, 10.0, 20.0, -40.0, -math.pi])
LONGEST = np.array([30.0, 80.0, 60.0, 60.0, 120.0, 40.0, math.pi])
PIVOT, REST, PRESSURE = 40.0, math.radians(80.0), math.radians(50.0)


def six_bar(x: Array, phi: Array) -> tuple[Array, Array]:
    """Return the slider's position, and sin^2 less cos^2 of 50 deg at both joints, from its plane triangles."""
    a, b, c, crank, rod, e, offset = x
    pin = a * np.exp(1j * phi) - PIVOT
    r = np.abs(pin)
    psi = np.angle(pin) - np.arccos((c * c + r * r - b * b) / (2.0 * c * r)) + offset
    height = e - crank * np.sin(psi)
    joints = [((b * b + c * c - r * r) / (2.0 * b * c)) ** 2, (height / rod) ** 2]
    return crank * np.cos(psi) + np.sqrt(rod * rod - height**2), math.sin(PRESSURE) ** 2 - np.concatenate(joints)


@cache
def least_acceleration_of_samples(start: tuple[float, ...], begin: float, samples: int) -> float:
    """Return the least acceleration of the six-bar by SLSQP on samples of the turn and of the rest from ``begin`` on.

    Derivatives of the slider's position are those of its trigonometric interpolant.
    """
    turn, orders = 2.0 * math.pi * np.arange(samples) / samples, np.fft.fftfreq(samples, 1.0 / samples)

    def limits(z: Array) -> Array:
        s, joints = six_bar(z[:7], turn)
        acceleration = np.fft.ifft(-(orders**2) * np.fft.fft(s)).real
        at_rest, _ = six_bar(z[:7], z[7] + np.linspace(0.0, REST, samples // 4 + 1))
        top, bottom = max(s.max(), at_rest.max()), s.min()
        stroke = np.array([top - bottom - 20.0, 20.2 - top + bottom]) / 20.0
        rest = 5.0 * (at_rest - top + 0.01 * (top - bottom))
        rows = np.concatenate([z[8] - acceleration, z[8] + acceleration, joints, stroke, rest])
        return np.nan_to_num(rows, nan=-1.0)  # links that do not reach are far outside

    bounds = [*zip(SHORTEST, LONGEST, strict=True), (-7.0, 7.0), (0.0, 100.0)]
    with np.errstate(invalid="ignore"):
        found = minimize(
            lambda z: z[8], [*start, begin, 15.0], jac=lambda z: np.eye(9)[8], method="SLSQP", bounds=bounds,
            constraints={"type": "ineq", "fun": limits}, options={"maxiter": 500, "ftol": 1e-12},
        )  # fmt: skip
        assert limits(found.x).min() > -1e-5
    return float(found.fun)


@pytest.mark.parametrize(
    "start",
    [
        # Two ends of searches to which the angle was a plain number: 3.4 % and 13 % above the least acceleration.
        [5.000179334975353, 38.49349015567975, 15.7728991, 48.12343493, 20.0003079, 39.50826255, -0.96048004],
        [7.0639073149875, 30.79019227765232, 25.6224378, 55.59643629, 20.0000001, 39.99999999, -1.46474559],
    ],
)
@pytest.mark.parametrize(
    ("window", "angle"),
    [
        ((0.99, 1.0), Limit("window_angle", REST, None)),
        # The same said of the rest of the turn, into which the dip must not come.
        ((0.0, 0.99), Limit("window_angle", None, math.tau - REST)),
    ],
)
def test_rest_with_two_tops_and_a_dip_to_its_edge_is_the_best_there_is(
    start: list[float], window: tuple[float, float], angle: Limit
) -> None:
    limits = (
        Limit("max_pressure_angle1", None, PRESSURE), Limit("max_pressure_angle2", None, PRESSURE),
        Limit("stroke", 20.0, 20.2), angle,
    )  # fmt: skip
    fixed = {"branch1": -1.0, "alpha1": 0.0, "f1": 0.0, "g1": 0.0, "e1": PIVOT, "branch2": 1.0}
    chain = family(["rssr", "slider_crank"])
    problem = Problem(chain, SIX_BAR, SHORTEST, LONGEST, fixed, "max_abs_d2s", limits, window)
    found = minimise(problem, problem.rows(np.array([start])), OptimiseSettings())[0]
    assert found.status == st.OK and found.kkt_residual <= 1e-6
    # Samples half a degree apart miss a top by 1e-5 of it, and SLSQP ends within 1e-5 of its limits where the highest
    # of them changes; a limit has a multiplier of at most two.
    reference = least_acceleration_of_samples((5.3, 37.7, 16.4, 48.0, 20.0, 40.0, -1.0), -0.3, 720)
    assert found.objective == pytest.approx(reference, rel=5e-5)
    true = sweep.summarise(
        chain,
        dict(zip(chain.parameter_names, found.design, strict=True)),
        ["window_angle"],
        accuracy=1e-10,
        window=window,
    )
    # Dips stay a millionth of the window on their side: near enough to be at its edge, far enough for samples to tell.
    bound = angle.minimum or angle.maximum
    assert true.window_angle[0] == pytest.approx(bound, abs=1e-9) and true.err_window_angle[0] < 1e-9
