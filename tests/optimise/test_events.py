"""Events as the optimiser follows them: their places, their gradients, and what keeps them from jumping."""

from __future__ import annotations

import math

import numpy as np
import pandas as pd
import pytest

import sweep
from sweep.families import family
from sweep.families.base import Accuracy
from sweep.optimise.extrema.scanned import PASSING, first_passage, passages
from sweep.optimise.local.model import Model
from sweep.optimise.manufacture.tolerance import sensitivities
from sweep.optimise.problem.program import Program
from sweep.optimise.problem.statement import Problem
from sweep.study.study import Limit
from tests.evaluation.test_machine_events import MEMBERS, RELATIONS, TABLE

MACHINE = sweep.machine(MEMBERS, RELATIONS | {"hit": {"value": ["pace", "phi_arrive"]}})
NAMES = list(MACHINE.parameter_names)
DESIGN = np.array([TABLE.iloc[0].get(n, p.default) for n, p in zip(NAMES, MACHINE.parameters, strict=True)], np.float64)


def summarised(design: np.ndarray, output: str) -> float:
    table = dict(zip(NAMES, design, strict=True))
    return float(sweep.summarise(MACHINE, table, [output], accuracy=1e-12)[output][0])


@pytest.mark.parametrize("output", ["phi_arrive", "phi_plane", "stay", "hit"])
def test_slopes_of_events_are_exact(output: str) -> None:
    rows = pd.DataFrame(sensitivities(MACHINE, DESIGN, [output])).set_index("parameter")
    assert rows["value"].iloc[0] == pytest.approx(summarised(DESIGN, output), abs=1e-13)
    for name, step in (("looper.a", 1e-2), ("looper.x_at", 2e-2), ("looper.offset", 1e-3)):
        ends = []
        for k in (-2.0, -1.0, 1.0, 2.0):
            moved = DESIGN.copy()
            moved[NAMES.index(name)] += k * step
            ends.append(summarised(moved, output))
        slope = (ends[0] - 8.0 * ends[1] + 8.0 * ends[2] - ends[3]) / (12.0 * step)
        # What the five points leave out is of fourth order in a thousandth of the dimension; roots carry 1e-14/step.
        assert rows.loc[name, "growing"] == pytest.approx(slope, rel=1e-7, abs=1e-10), name
        assert rows.loc[name, "growing"] == rows.loc[name, "shrinking"]


# A rocker whose angle passes 180 degrees, where it jumps by a turn, and a six-bar with a dip to 0.995 of its stroke.
ROCKER = {"a": 10.0, "b": 21.0, "c": 35.0, "e": 38.0, "f": 16.0, "g": 17.0, "alpha": 0.7, "branch": 1.0}
SIX_BAR = {
    "a1": 5.26, "b1": 37.7, "c1": 16.4, "e1": 40.0, "f1": 0.0, "g1": 0.0, "alpha1": 0.0, "branch1": -1.0,
    "a2": 47.9, "b2": 20.0, "e2": 40.0, "branch2": 1.0, "offset2": -0.99,
}  # fmt: skip


@pytest.mark.parametrize("window", [(0.9, 1.0), (0.0, 0.2), (0.3, 0.7), (0.5, 0.997), (0.997, 1.0)])
@pytest.mark.parametrize(("chain", "table"), [(["rssr"], ROCKER), (["rssr", "slider_crank"], SIX_BAR)])
def test_slopes_of_the_angle_in_a_window_are_exact(
    chain: list[str], table: dict[str, float], window: tuple[float, float]
) -> None:
    full = family(chain if len(chain) > 1 else chain[0])
    design = np.array([table.get(p.name, p.default) for p in full.parameters], np.float64)

    def angle(changed: dict[str, float]) -> float:
        found = sweep.summarise(full, table | changed, ["window_angle"], accuracy=1e-12, window=window)
        return float(found["window_angle"][0])

    rows = pd.DataFrame(sensitivities(full, design, ["window_angle"], window)).set_index("parameter")
    # Edges are tracked to the square of 3e-6 rad.
    assert rows["value"].iloc[0] == pytest.approx(angle({}), abs=1e-10)
    for name in [n for n in table if n[0] in "abco" and not n.startswith("branch")]:
        step = 1e-4 if name.startswith(("alpha", "offset")) else 1e-3
        ends = [angle({name: table[name] + k * step}) for k in (-2.0, -1.0, 1.0, 2.0)]
        slope = (ends[0] - 8.0 * ends[1] + 8.0 * ends[2] - ends[3]) / (12.0 * step)
        # Five points leave out the fourth power of the step; the errors of the angles are 1e-12 / step.
        assert rows.loc[name, "growing"] == pytest.approx(slope, rel=1e-6, abs=1e-8), name


@pytest.mark.parametrize(
    ("name", "table", "outputs"),
    [
        ("rssr", ROCKER, ["psi_ext", "psi_fold", "max_psi", "min_psi"]),
        ("backrest", dict(family("backrest").example), ["rho_max_h", "rho_min_K", "rho_max_L1", "max_K"]),
    ],
)
def test_ends_beyond_half_a_turn_and_places_over_an_interval_are_those_of_summaries(
    name: str, table: dict[str, float], outputs: list[str]
) -> None:
    full = family(name)
    design = np.array([table.get(p.name, p.default) for p in full.parameters], np.float64)
    true = sweep.summarise(full, table, outputs, accuracy=1e-10)
    rows = pd.DataFrame(sensitivities(full, design, outputs)).groupby("output")["value"].first()
    for output in outputs:
        assert rows[output] == pytest.approx(float(true[output][0]), rel=1e-9), output


def test_a_dip_narrower_than_the_samples_is_no_feasible_rest() -> None:
    # Its two edges, 0.0016 rad apart around one of 256 samples, once merged into one: the rest of 1.39 rad was 1.76.
    links = {"a1": 5.00476917879443, "b1": 38.29477135152248, "c1": 15.597207723578443, "a2": 47.68539618599832}
    changed = SIX_BAR | links | {"b2": 20.00000894069676, "offset2": 5.327040728397252}
    full, free = family(["rssr", "slider_crank"]), ("a1", "b1")
    design = np.array([changed.get(p.name, p.default) for p in full.parameters], np.float64)
    low, limit = np.array([4.0, 30.0]), Limit("window_angle", math.radians(80.0), None)
    problem = Problem(full, free, low, low + 10.0, changed, "max_abs_d2s", (limit,), (0.99, 1.0))
    program = Program(problem)
    start = Model(problem, program, design, lambda: False)
    state = start.state(problem.scaled(design[None, :])[0])
    measured = program.value(program.requirements[-1].measure, state.form, start.curves, design, state.atoms)
    true = sweep.summarise(full, changed, ["window_angle"], accuracy=1e-12, window=(0.99, 1.0)).window_angle[0]
    # What the dip takes is no part of the measured angle, but its row is violated.
    assert true == pytest.approx(1.39469, abs=1e-5) and measured == pytest.approx(true + 0.00157, abs=1e-5)
    assert not state.feasible and state.violation < 1e-4


def model(limit: Limit) -> Model:
    free = ("looper.a", "looper.x_at")
    place = DESIGN[[NAMES.index(name) for name in free]]
    fixed = {n: float(x) for n, x in zip(NAMES, DESIGN, strict=True) if n not in free}
    problem = Problem(
        MACHINE, free, place - 1.0, place + 1.0, fixed, "looper.max_abs_d2psi", (limit,), None, Accuracy(target=1e-9)
    )
    return Model(problem, Program(problem), DESIGN, lambda: False)


def test_passage_stays_on_its_level_while_the_design_changes() -> None:
    start = model(Limit("stay", 0.1, None))
    state = start.state(np.array([0.5, 0.5]))
    points, _ = start.tracked(np.array([0.7, 0.35]), state.form, state.form.points)
    own = points.kind == PASSING
    assert own.sum() >= 2
    there = start.curves.values(start.design(np.array([0.7, 0.35]))[None, :], points)[0]
    # one Newton step beyond 3e-6 rad leaves 1e-11 of the slope, which is some 30 mm/rad here
    np.testing.assert_allclose(there[own], points.level[own], atol=1e-9)


def test_bump_before_the_event_is_kept_below_its_level() -> None:
    phi = np.arange(256) * (math.tau / 256)
    bump = 0.9 * np.exp(-8.0 * (phi - 1.0) ** 2) + 2.0 * np.exp(-8.0 * (phi - 3.0) ** 2)
    rows = passages(0, phi, bump, 1.0, 1.0)
    places, how = np.array([row[1] for row in rows]), np.array([row[3] for row in rows])
    first, before = first_passage(places, how, range(len(rows)))
    assert first is not None and 2.0 < places[first] < 3.0
    assert [round(float(places[k]), 1) for k in before] == [1.0]
    after = passages(0, phi, np.roll(bump, -81), 1.0, 1.0)  # the passage comes before the bump
    places, how = np.array([row[1] for row in after]), np.array([row[3] for row in after])
    assert first_passage(places, how, range(len(after)))[1] == []


def test_curve_that_never_passes_has_no_event() -> None:
    phi = np.arange(64) * (math.tau / 64)
    rows = passages(0, phi, np.cos(phi), 2.0, 1.0)
    assert [row[3] for row in rows] == [0]
    assert first_passage(np.array([0.0]), np.array([0]), [0]) == (None, [0])
