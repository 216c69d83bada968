"""Point, line and scale of a needle drive solved as a linear program, for its drawing and with room for tolerances."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

import sweep
from kernels.descent.descents import LOCKED
from sweep.errors import StudyError
from sweep.optimise.starts.linear import Elimination, elimination, widened
from sweep.optimise.starts.pose_rows import Descents, PoseRows
from sweep.optimise.starts.posing import problem_of
from sweep.study import load_study, study_from_data
from tests.support.needle208_record import record

FOLDER = Path(__file__).parents[2] / "studies" / "needle208"
SIGNS = [{"branch1": 1.0, "branch2": x, "kappa2": 1.0} for x in (1.0, -1.0)]
NONE = np.zeros(1, np.intp)  # one design of the first kind
EXPECTED = json.loads((FOLDER / "expected.json").read_text())
RECORD = EXPECTED["record"]["outputs"]["max_abs_d2s"]


def accepted() -> np.ndarray:
    names = load_study(FOLDER).family.parameter_names
    designs = [{"shift2": 0.0, "turn2": 0.0} | EXPECTED[role]["design"] for role in ("optimum", "record")]
    return np.array([[design[name] for name in names] for design in designs])


@pytest.fixture(scope="module")
def rows() -> PoseRows:
    return PoseRows(eliminated(), SIGNS)


def eliminated(robust: bool = False) -> Elimination:
    study = record()
    if robust:
        study = study_from_data(study.data | {"tolerance": study.data["tolerance"] | {"robust": "95 %"}}, study.path)
    found = elimination(problem_of(study, np.concatenate([0.8 * accepted(), 1.2 * accepted()])), study.tolerance)
    assert found is not None
    return found


def place_of(rows: PoseRows, design: np.ndarray) -> np.ndarray:
    """Place (1, n) of a design (P,), whatever its point, line and scale are."""
    own, values = rows, design[rows.columns].copy()
    guide = [own.columns.index(rows.linear.column(name)) for name in "bce"]
    values[guide] /= design[rows.linear.column("a")]
    place = (values - own.low) / (own.high - own.low)
    log = own.log_width != 0.0
    place[log] = np.log(values[log] / own.low[log]) / own.log_width[log]
    return np.asarray(rows.wrapped(place[None, :]))


def test_unknowns_are_those_of_the_least_acceleration_with_stroke_and_straightness(rows: PoseRows) -> None:
    names = rows.family.parameter_names
    place = place_of(rows, accepted()[1])  # the record: the proportions of the optimum cannot keep its straightness
    x, worth = rows.initial(place, NONE)
    table = dict(zip(names, rows.finished(place, NONE, x).T, strict=True))
    found = sweep.summarise(["rssr", "guide"], table, ["max_abs_d2s", "max_abs_dev", "stroke"], accuracy=1e-9)
    # 64 poses see the peaks of acceleration and stroke to 1e-3, those of the deviation, which has more of them, to 3 %.
    np.testing.assert_allclose(found["stroke"].abs(), 24.495, rtol=1e-3)
    assert (found["max_abs_dev"] <= 0.015 * 1.05).all()
    # The record is the best of its proportions; worth has what the poses miss of the limits in it.
    assert found["max_abs_d2s"][0] == pytest.approx(RECORD, rel=1e-3) and RECORD * 0.999 < worth[0] < RECORD * 1.1


def test_missed_limits_and_designs_that_do_not_turn_rank_behind(rows: PoseRows) -> None:
    good, steep, stuck = (accepted()[1].copy() for _ in range(3))
    steep[0] *= 1.05
    stuck[1] = 3.0
    worth = [float(rows.initial(place_of(rows, design), NONE)[1][0]) for design in (good, steep, stuck)]
    assert worth[0] < worth[1] < LOCKED < worth[2]


def test_guides_that_the_program_shrinks_to_nothing_are_no_solution(rows: PoseRows) -> None:
    finished = rows.linear.finished(accepted(), np.array([[0.0, 0.0, 1.0, 1.0, 0.0], [1.0, 0.0, 1.0, 1.0, 0.0]]))
    assert np.isnan(finished[0]).any() and np.isfinite(finished[1]).all()


def test_room_for_tolerances_costs_acceleration(rows: PoseRows) -> None:
    made, place = PoseRows(eliminated(robust=True), SIGNS), place_of(rows, accepted()[0])
    assert made.linear.sigma is not None and made.linear.level > 1.9
    drawn, built = Descents(rows, place, NONE), Descents(made, place, NONE)
    for many in (drawn, built):
        many.advance(3)
    assert drawn.merit[0] < built.merit[0] < LOCKED


def test_bounds_are_widened_until_designs_lie_within(rows: PoseRows) -> None:
    problem, designs = rows.linear.problem, 2.0 * accepted()
    inside = widened(problem, designs, problem.variables).scaled(designs)
    assert ((inside >= 0.0) & (inside <= 1.0)).all()


def test_other_mechanisms_and_problems_are_refused() -> None:
    study = load_study(FOLDER)
    data = study.data | {"objective": {"minimise": "swing1"}}
    assert elimination(problem_of(study_from_data(data, study.path), accepted())) is None
    other = load_study(FOLDER.parent / "needle51")
    with pytest.raises(StudyError, match=r"optimise\.global"):
        study_from_data(other.data | {"optimise": {"global": "proportions"}}, other.path)
