"""Tasks 1 to 4 and the engineering method: the mechanisms are checked by the families, without the task's formulas."""

from __future__ import annotations

import numpy as np
import pandas as pd
import pytest

import sweep
from kernels import status as st
from sweep.synthesis.tasks import (
    EngineeringMethod,
    Position,
    Task1,
    Task2,
    Task5,
    adjustments,
    solve,
)
from tests.support.task_cases import (
    BOUNDS,
    DRIVE,
    RSSR,
    SPACE,
    TASK1,
    TASK2,
    TASK3,
    TASK3_THREE,
    TASK4,
    Case,
    best,
    check_limits,
    check_position,
    rocker,
)


def test_task1_one_position():
    table = rocker(best(TASK1))
    turn = check_limits(table, 0.9, 3.3, 1.2)
    check_position(table, turn, Position(1.0, 0.25))
    assert BOUNDS["b"][0] - 1e-9 <= table["b"][0] <= BOUNDS["b"][1] + 1e-9


def test_task1_one_position_is_the_best_of_a_dense_search():
    problem = TASK1.build()
    found = problem.evaluate(np.linspace(0.0, 2.0 * np.pi, 20001)[:, None])
    kept = np.min([*found.limits.values()], axis=0) >= 0.0
    assert kept.sum() > 100
    dense = np.abs(found.curve[kept]).max(axis=1).min()
    assert best(TASK1).objective <= dense
    assert best(TASK1).objective == pytest.approx(dense, rel=1e-3)


def test_task1_two_positions():
    second = best(TASK2)  # its swing and phi0 have a mechanism through both positions
    swing, phi0 = second.unknowns["swing"], second.unknowns["phi0"]
    positions = TASK2.numbers["positions"]
    hits = [s for s in solve(Task1(swing, phi0, **SPACE, positions=positions)) if s.feasible]
    assert any(s.mechanism["a"] == pytest.approx(second.mechanism["a"], rel=1e-5) for s in hits)
    for solution in hits:
        turn = check_limits(rocker(solution), swing, phi0, np.pi / 2)
        for position in positions:
            check_position(rocker(solution), turn, position)


def test_task1_planar_one_position_fixes_the_place():
    """In the plane f drops out: one position is an equation for phi1, and there is nothing left to minimise."""
    wanted = Position(1.2, 0.3)
    problem = Task1(0.8, 3.2, 1.0, 0.0, 0.0, positions=(wanted,), max_pressure_angle=1.3)
    assert [*problem.evaluate(np.zeros((1, 1))).equations] == ["position 1"]
    found = [s for s in solve(problem) if s.feasible]
    assert found
    for solution in found:
        table = rocker(solution)
        assert table["alpha"] == [0.0] and table["f"] == table["g"]
        check_position(table, check_limits(table, 0.8, 3.2, 1.3), wanted)
    # A dense search over phi1 sees the same places as changes of sign, and no more.
    grid = np.linspace(0.0, 2.0 * np.pi, 7201)
    dense = problem.evaluate(grid[:, None])
    kept = np.min([*dense.limits.values()], axis=0) >= 0.0
    missed = np.where(kept, dense.equations["position 1"], np.nan)
    crossed = np.flatnonzero(missed[1:] * missed[:-1] < 0.0)
    places = sorted(solution.unknowns["phi1"] for solution in found)
    assert len(crossed) == len(places)
    np.testing.assert_allclose(grid[crossed], places, atol=grid[1])


def test_task2_swing_and_phi0_are_found_with_the_least_acceleration():
    solution = best(TASK2)
    table = rocker(solution)
    turn = check_limits(table, solution.unknowns["swing"], solution.unknowns["phi0"], 1.2)
    for position in (Position(1.0, 0.2), Position(2.0, 0.6)):
        check_position(table, turn, position)
    assert 0.5 <= solution.unknowns["swing"] <= 1.2
    true = sweep.summarise("rssr", table, "max_abs_d2psi")["max_abs_d2psi"][0]
    assert true == pytest.approx(solution.objective, rel=2e-5)  # the task looks at parabolas through 180 poses
    # Fixing swing and phi0 elsewhere costs acceleration.
    for swing in (0.7, 0.85):
        others = solve(Task1(swing, 3.1, **SPACE, positions=TASK2.numbers["positions"], bounds=BOUNDS,
                             max_pressure_angle=1.2), candidates=512, starts=4)  # fmt: skip
        assert all(o.objective > solution.objective for o in others if o.feasible)


def test_task2_free_offset_and_angle_buy_acceleration():
    free = best(Case(Task2, **TASK2.numbers, g_range=(0.2, 2.0), alpha_range=(0.4, 1.5)))
    turn = check_limits(rocker(free), free.unknowns["swing"], free.unknowns["phi0"], 1.2)
    for position in TASK2.numbers["positions"]:
        check_position(rocker(free), turn, position)
    assert free.mechanism["g"] == free.unknowns["g"] and free.mechanism["alpha"] == free.unknowns["alpha"]
    assert free.objective < best(TASK2).objective


def test_task3_one_dimension_makes_the_second_setting():
    solution = best(TASK3)
    table = rocker(solution)
    check_limits(table, 0.8, 3.2, 1.3)
    check_limits(table | {"f": [solution.mechanism["f of setting 2"]]}, 0.6, 3.2, 1.3)


def test_task3_three_settings_by_one_dimension():
    solution = best(TASK3_THREE)
    table = rocker(solution)
    check_limits(table, 0.8, 3.2, 1.3)
    check_limits(table | {"g": [solution.mechanism["g of setting 2"]]}, 0.7, 3.2, 1.3)
    third = table | {"g": [solution.mechanism["g of setting 3"]]}
    found = sweep.summarise("rssr", third, ["swing", "max_pressure_angle"], accuracy=1e-12).iloc[0]
    assert found["swing"] == pytest.approx(0.6, abs=1e-9)
    assert found["max_pressure_angle"] <= 1.3 + 1e-7
    # The same links stand in all three settings: nothing else was changed, and phi0 of the third was free.
    free = sweep.summarise("rssr", third, "phi0", accuracy=1e-12)["phi0"][0]
    assert abs(free - 3.2) > 1e-3


def test_task3_adjustments_are_the_derivatives():
    table = adjustments(DRIVE)
    step = 1e-5
    for name in table.index:
        pair = [DRIVE | {name: DRIVE[name] + s * step} for s in (1.0, -1.0)]
        found = sweep.summarise("rssr", pd.DataFrame(pair), ["swing", "phi0"], accuracy=1e-13)
        slopes = (found.iloc[0] - found.iloc[1]) / (2.0 * step)
        assert slopes["swing"] == pytest.approx(table["dswing"][name], abs=2e-8)
        assert slopes["phi0"] == pytest.approx(table["dphi0"][name], abs=2e-8)
    assert (table["dpsi_fold"] - table["dpsi_ext"] - table["dswing"]).abs().max() < 1e-12


def test_task3_in_the_plane_only_the_difference_of_the_offsets_counts():
    planar = DRIVE | {"alpha": 0.0, "f": 0.3, "g": 0.3, "a": 0.4, "b": 1.2, "c": 1.1, "e": 1.3}
    table = adjustments(planar)
    assert list(table["adjusts"][["f", "g"]]) == ["nothing", "nothing"]
    # Making the whole four-bar larger changes no angle (Euler's theorem on homogeneous functions).
    scaled = sum(planar[name] * table["dswing"][name] for name in "abce")
    assert abs(scaled) < 1e-12
    assert table["adjusts"]["a"] == "both"


def test_task4_is_the_best_transmission_of_freudenstein_and_primrose():
    """Swing 45 deg over 165 deg: Q^3 + 2 Q^2 - t^2 Q - (t^2/u^2)(1 + t^2) = 0, coupler/crank = |t|/sqrt(Q)."""
    t, u = np.tan(np.radians(165.0) / 2), np.tan(np.radians(120.0) / 2)
    q = max(np.roots([1.0, 2.0, -t * t, -(t * t / u**2) * (1.0 + t * t)]).real)
    solution = best(TASK4)
    m = solution.mechanism
    assert m["b"] / m["a"] == pytest.approx(abs(t) / np.sqrt(q), abs=1e-6)
    assert m["b"] / m["a"] == pytest.approx(2.238114, abs=1e-6)
    assert [m["a"], m["b"], m["c"]] == pytest.approx([0.270443, 0.605283, 0.730439], abs=1e-6)
    assert 90.0 - np.degrees(solution.objective) == pytest.approx(36.13782, abs=1e-5)
    check_limits(rocker(solution), np.radians(45.0), np.radians(165.0), np.pi / 2)


def test_engineering_method_beats_every_mechanism_of_a_dense_search():
    problem = EngineeringMethod(0.8, 3.2, **SPACE, f_range=(-3.0, 3.0), max_pressure_angle=1.2, bounds=BOUNDS)
    solution = solve(problem)[0]
    assert solution.feasible
    phi1, f = (grid.ravel() for grid in np.meshgrid(np.linspace(0, 2 * np.pi, 240), np.linspace(-3, 3, 61)))
    table = {"swing": 0.8, "phi0": 3.2, "phi1": phi1, "f": f, **SPACE}
    frame = sweep.synthesise("rssr", table, max_pressure_angle=1.2)
    frame = frame[(frame["status"] == st.OK) & frame["b"].between(*BOUNDS["b"]) & frame["c"].between(*BOUNDS["c"])]
    dense = sweep.summarise("rssr", frame[list(RSSR)], "max_abs_d2psi", samples=180)["max_abs_d2psi"]
    assert len(dense) > 200
    assert solution.objective <= dense.min() * (1.0 + 1e-9)


@pytest.mark.parametrize(
    "task",
    [
        EngineeringMethod(
            0.7559108123501284, 2.98649576763178, 1.0, 0.8972988942744877, 0.7806483068094369, (-2.0, 2.0)
        ),
        pytest.param(
            Task5(
                -1.1826634798211146, 3.473160035564651, 1.0, 0.4495798815470673, 0.9494722266569211, (-2.0, 2.0), 1.0
            ),
            marks=pytest.mark.long,
        ),
    ],
)
def test_mechanism_on_its_dead_point_is_no_solution(task):
    """By 180 poses alone it was the best one: between two of them the acceleration has no bound."""
    found = [s for s in solve(task, samples=1) if s.feasible]
    number = "1" if isinstance(task, Task5) else ""
    made = pd.DataFrame([[s.mechanism[name + number] for name in RSSR] for s in found], columns=list(RSSR))
    turns = sweep.summarise("rssr", made, ["max_abs_d2psi"], accuracy=1e-9)
    assert len(made) > 1 and (turns["status"] == st.OK).all()
    if not number:
        np.testing.assert_allclose([s.objective for s in found], turns["max_abs_d2psi"], rtol=1.1e-4)


def test_engineering_method_keeps_the_joint_in_its_box():
    """The rocker ball at the extended position in a box that the free optimum misses; the best of a dense search."""
    numbers = {"swing": 0.8, "phi0": 3.2, **SPACE, "f_range": (-3.0, 3.0), "max_pressure_angle": 1.2}
    box = {"x_ext": (0.3, 1.0), "y_ext": (-0.6, 0.6)}
    free, kept = (solve(EngineeringMethod(**numbers, bounds=BOUNDS | more), starts=4)[0] for more in ({}, box))
    assert free.feasible and kept.feasible
    assert not 0.3 <= free.mechanism["x_ext"] <= 1.0
    turn = check_limits(rocker(kept), 0.8, 3.2, 1.2)
    ball = kept.mechanism["c"] * np.exp(1j * turn["psi_ext"])
    assert ball == pytest.approx(kept.mechanism["x_ext"] + 1j * kept.mechanism["y_ext"], abs=1e-9)
    assert 0.3 - 1e-8 <= ball.real <= 1.0 + 1e-8 and abs(ball.imag) <= 0.6 + 1e-8
    phi1, f = (grid.ravel() for grid in np.meshgrid(np.linspace(0, 2 * np.pi, 480), np.linspace(-3, 3, 61)))
    dense = EngineeringMethod(**numbers, bounds=BOUNDS | box).evaluate(np.column_stack([phi1, f]))
    inside = np.min([*dense.limits.values()], axis=0) >= 0.0
    assert inside.sum() > 50
    assert free.objective < kept.objective <= np.abs(dense.curve[inside]).max(axis=1).min() * (1.0 + 1e-9)


BEARINGS = {
    "resisting_torque": 900.0, "support_d1": -0.4, "support_d2": 1.1, "journal_diameter": 0.4, "journal_length1": 0.5,
    "journal_length2": 0.5, "collar_diameter": 0.8, "mu_d": 0.1, "thrust_radius_d": 0.25,
} | {f"permissible_pressure{k}": 7e3 for k in (1, 2, 3)}  # fmt: skip


def test_bearings_bound_the_offsets_of_the_engineering_method():
    """Step 3: what the bearings permit, by the formulas of their pressures at every pose, bounds the range of f."""
    numbers = {"swing": 0.8, "phi0": 3.2, **SPACE, "f_range": (-3.0, 3.0), "max_pressure_angle": 1.2}
    free, held = EngineeringMethod(**numbers), EngineeringMethod(**numbers, bearings=BEARINGS)
    places, offsets = 24, 25
    phi1, f = (x.ravel() for x in np.meshgrid(np.arange(places) * (2 * np.pi / places), np.linspace(-3, 3, offsets)))
    found = held.evaluate(np.column_stack([phi1, f]))
    alive = np.isfinite(found.results["a"])
    table = {name: found.results[name][alive] for name in RSSR}
    poses = sweep.evaluate("rssr", table, ["theta1", "theta2"], phi=np.arange(180) * (2 * np.pi / 180))
    theta1, theta2 = (poses[name].to_numpy().reshape(-1, 180) for name in ("theta1", "theta2"))
    z1, z2, d, c = BEARINGS["support_d1"], BEARINGS["support_d2"], BEARINGS["journal_diameter"], table["c"][:, None]
    x, span = np.sin(theta1) * np.tan(theta2), abs(z2 - z1)
    arms = [np.hypot(z * np.cos(theta1), z * np.sin(theta1) + c * x) for z in (z2, z1)]
    friction = BEARINGS["mu_d"] * (d * sum(arms) / (2.0 * span) + BEARINGS["thrust_radius_d"] * np.abs(x))
    force = BEARINGS["resisting_torque"] / (c * np.cos(theta1) - friction)
    pressures = [force * arm / (span * d * 0.5) for arm in arms]
    pressures.append(4.0 * force * np.abs(x) / (np.pi * (BEARINGS["collar_diameter"] ** 2 - d**2)))
    permitted = ((force > 0.0) & (np.max(pressures, axis=0) <= 7e3)).all(axis=1)
    slack = found.limits["bearings"][alive]
    assert (permitted == (slack >= 0.0)).all()
    assert 0.02 < permitted.mean() < 0.9
    kept = np.zeros(len(f), np.bool_)
    kept[alive] = permitted & (found.limits["pressure angle"][alive] >= 0.0)
    every = [set(np.round(np.linspace(*ends, round((ends[1] - ends[0]) / 0.25) + 1), 9)) for ends in
             held.offset_ranges(places, offsets)]  # fmt: skip
    assert set().union(*every) == set(np.round(f[kept], 9))
    assert held.offset_ranges(places, offsets) != free.offset_ranges(places, offsets)
