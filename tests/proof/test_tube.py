"""Where a rocker can be in time: crank-rockers keep to it, the fastest motion is its side, and rows tell the sides."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import sweep
from kernels.boxes.tape import run
from kernels.boxes.taylor import width
from kernels.boxes.tube import HIGH, LOW, POSES, THETA, least_acceleration, tube
from kernels.families.rssr import box_locus
from kernels.families.rssr import box_turn as bt
from kernels.families.rssr.box_problem import BoxQuestion, angle_inputs, inputs, middle
from sweep.proof.question import question_of
from sweep.study.load import load_study

STUDIES = Path(__file__).parents[2] / "studies"
SWING, PHI0 = 1.05, 2.9


def mechanisms(swing: float) -> list[dict[str, float]]:
    """Crank-rockers that swing so far in PHI0."""
    rng = np.random.default_rng(5)
    n = 20_000
    asked = {"swing": swing, "phi0": PHI0, "phi1": rng.uniform(0, 6.28, n), "alpha": rng.uniform(0.3, 1.5, n)}
    made = sweep.synthesise("rssr", asked | {k: rng.uniform(-2, 2, n) for k in "efg"}, max_pressure_angle=0.9)
    good = made[(made.status == 0) & (made.failed == "")]
    return good.to_dict("records")[:40]


@pytest.mark.parametrize("swing", [SWING, -SWING])
def test_rocker_stays_in_the_tube_of_its_own_largest_acceleration(swing):
    checked = 0
    for one in mechanisms(swing):
        design = {k: np.array([one[k]]) for k in ("a", "b", "c", "e", "f", "g", "alpha")}
        design["branch"] = np.array([one["branch"]])
        most = float(sweep.summarise("rssr", design, want=["max_abs_d2psi"]).max_abs_d2psi.iloc[0])
        found = tube(swing, PHI0, most * (1.0 + 1e-9))
        phi = one["phi_ext"] + np.concatenate([[0.0], found[:, THETA]])
        psi = np.unwrap(sweep.evaluate("rssr", design, phi=phi, want=["psi"]).psi.to_numpy())
        turned = psi[1:] - psi[0]
        # the synthesis' rounding of limit positions, below 1e-9 for these
        assert (turned >= found[:, LOW] - 1e-9).all() and (turned <= found[:, HIGH] + 1e-9).all()
        checked += 1
    assert checked >= 10


def test_motion_with_the_largest_acceleration_all_the_time_is_the_side_of_the_tube():
    time, most = PHI0, 1.2 * least_acceleration(SWING, PHI0)
    switch = 0.25 * time + SWING / (most * time)
    steps = np.linspace(0.0, time, 200_001)
    acceleration = np.where((steps > switch) & (steps < switch + 0.5 * time), -most, most)
    speed = np.concatenate([[0.0], np.cumsum(0.5 * np.diff(steps) * (acceleration[1:] + acceleration[:-1]))])
    way = np.concatenate([[0.0], np.cumsum(0.5 * np.diff(steps) * (speed[1:] + speed[:-1]))])
    assert abs(speed[-1]) < 1e-4 and way[-1] == pytest.approx(SWING, abs=1e-4)
    found = tube(SWING, PHI0, most)[:POSES]
    # the quadrature misses the two switches by a step of 1.5e-5 each
    assert found[:, HIGH] == pytest.approx(np.interp(found[:, THETA], steps, way), abs=1e-4)
    assert found[:, LOW] == pytest.approx(SWING - np.interp(time - found[:, THETA], steps, way), abs=1e-4)


def test_tube_closes_at_the_least_acceleration_of_any_motion():
    shorter = min(PHI0, 2 * np.pi - PHI0)
    found = tube(SWING, PHI0, least_acceleration(SWING, shorter) * (1.0 + 1e-9))
    forward, back = found[:POSES], found[POSES:]
    # the width grows with what the acceleration has to spare
    assert (forward[:, HIGH] - forward[:, LOW]).max() < 1e-7
    assert (back[:, HIGH] - back[:, LOW]).min() > 1e-3


@pytest.mark.parametrize("swing", [SWING, -SWING])
def test_sign_of_the_row_tells_whether_the_rocker_has_passed_an_angle(swing):
    formulas = box_locus.by_rocker()
    recorded = (formulas.operations, formulas.factors, formulas.ends)
    branch = -1.0 if swing > 0.0 else 1.0
    problem = BoxQuestion(branch, 2, 0.5, np.full(8, np.inf), 1.0, np.zeros((0, 9)))
    checked = 0
    for one in mechanisms(swing):
        if one["alpha"] == 0.0:
            continue
        place = np.array([swing, PHI0, one["phi_ext"], one["psi_ext"], one["c"], one["f"], one["alpha"]])
        design = {k: np.array([one[k]]) for k in ("a", "b", "c", "e", "f", "g", "alpha")}
        design["branch"] = np.array([one["branch"]])
        at, half = np.zeros((formulas.forms, width(1))), np.zeros(1)
        inputs(problem, place[2:3], half, np.array([2.0]), place, at)
        for theta in (0.7, 2.0, 4.0, 5.5):
            psi = sweep.evaluate("rssr", design, phi=one["phi_ext"] + np.array([0.0, theta]), want=["psi"]).psi
            turned = (psi.iloc[1] - psi.iloc[0] + np.pi) % (2 * np.pi) - np.pi
            for ahead in (0.01, -0.01):
                angle_inputs(at, bt.COS_THETA, theta)
                angle_inputs(at, bt.COS_TURN, turned + ahead)
                # the crank's own length where it is free, and as it follows from the place
                at[bt.ANY_CRANK] = 0.0
                at[bt.ANY_CRANK, 0] = one["a"]
                assert all(run(*recorded, part, at, 1) for part in (bt.PLACE, bt.ARRIVAL, bt.FREE))
                for slot in (bt.PASSED, bt.FREE_PASSED):
                    assert middle(at, formulas.slots[slot]) * ahead > 0.0
                assert middle(at, formulas.slots[bt.FREE_CRANK]) == pytest.approx(0.0, abs=1e-9)
        checked += 1
    assert checked >= 10


def test_sides_are_not_used_where_the_other_assembly_mode_could_be_between_them():
    question = question_of(load_study(STUDIES / "crank-rocker-proof-spatial"))
    assert np.isfinite(question.tube(0.5)).all()
    short = question.links.copy()
    short[-2] = 1.0  # a coupler of a hundredth of the rocker
    assert np.isinf(replace(question, links=short).tube(0.5)[:, [LOW, HIGH]]).any()
    assert np.isinf(replace(question, cos2=0.0).tube(0.5)[:, [LOW, HIGH]]).all()
    assert len(question.tube(0.9 * question.floor)) == 0
