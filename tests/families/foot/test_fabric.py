"""Foot on fabric against an ODE solver that knows nothing of series and events, its limits, and what it refuses."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import sweep
from kernels import status as st
from kernels.effects.foot import OUTPUTS
from kernels.effects.foot_fabric import march
from sweep.families.foot import NODES, TURNS, path_of
from tests.families.foot.test_feed_rack import RACK
from tests.families.foot.test_reference import HEAVY
from tests.support.selection import mostly_long

PHI = np.arange(NODES) * (2.0 * math.pi / NODES)


def integrated(p: dict[str, float], turns: int) -> tuple[np.ndarray, np.ndarray]:
    """Height of the foot and force of the fabric at the nodes of the last turn, by a general ODE solver."""

    def ground(t: float) -> tuple[float, float]:
        y = p["Y"] * math.sin(p["omega"] * t) - p["p"]
        return (y, p["omega"] * p["Y"] * math.cos(p["omega"] * t)) if y > 0.0 else (0.0, 0.0)

    def force(t: float, y: float, v: float) -> float:
        g, slope = ground(t)
        return max(0.0, p["kf"] * (g - y) + p["cf"] * (slope - v)) if g > y else 0.0

    def rates(t: float, x: np.ndarray) -> list[float]:
        return [x[1], (-p["F0"] - p["k"] * x[0] + force(t, *x)) / p["m"]]

    turn = 2.0 * math.pi / p["omega"]
    begin = -0.25 * turn
    at = begin + (turns - 1 + np.arange(NODES) / NODES) * turn
    found = solve_ivp(
        rates, (begin, begin + turns * turn), [-p["F0"] / (p["k"] + p["kf"]), 0.0], method="DOP853", t_eval=at,
        rtol=1e-9, atol=1e-12, max_step=turn / 1500,
    )  # fmt: skip
    forces = np.array([force(t, y, v) for t, y, v in zip(at, *found.y, strict=True)])
    return np.roll(found.y[0], -NODES // 4), np.roll(forces, -NODES // 4)  # from the rack's lowest place to phi = 0


def marched(p: dict[str, float], turns: int) -> tuple[int, np.ndarray, np.ndarray]:
    table = np.array([[p[name] for name in ("m", "k", "F0", "omega", "Y", "p", "restitution", "X")]])
    feet = np.array([[p[name] for name in ("m", "k", "F0", "omega", "restitution", "kf", "cf")]])
    status, outputs = np.empty(1, np.uint8), np.empty((11, 1))
    heights, forces = np.empty((1, NODES)), np.empty((1, NODES))
    march(path_of(table, NODES), feet, turns, status, outputs, heights, forces, np.empty((1, 257)))
    return int(status[0]), heights[0], forces[0]


@pytest.mark.parametrize(("kf", "cf"), [(2e4, 0.0), (5e4, 20.0), (2e5, 100.0)])
@pytest.mark.parametrize("omega", [150.0, 400.0])
def test_foot_on_fabric_moves_as_its_equation_of_motion(omega: float, kf: float, cf: float) -> None:
    p = HEAVY | {"omega": omega, "kf": kf, "cf": cf}
    status, heights, forces = marched(p, 2)
    expected, pushes = integrated(p, 2)
    assert status == st.OK
    # the solver steps over kinks of the force: 2e-8 of the lift was measured, and the stiffness of that in the force
    np.testing.assert_allclose(heights, expected, atol=1e-7 * p["Y"])
    np.testing.assert_allclose(forces, pushes, atol=1e-7 * p["Y"] * kf + 1e-6 * p["F0"])


def test_public_march_is_the_same() -> None:
    p = HEAVY | {"omega": 260.0, "kf": 5e4, "cf": 20.0}
    got = sweep.evaluate("foot", p, ["y_foot", "force"], phi=PHI)
    _, heights, forces = marched(p, TURNS)
    assert (got.y_foot == heights).all() and (got.force == forces).all()


@pytest.mark.parametrize("zeta", [0.2, 0.6])
def test_stiff_fabric_is_a_rigid_ground_with_the_restitution_of_its_damper(zeta: float) -> None:
    root = math.sqrt(1.0 - zeta * zeta)
    bounce = math.exp(-zeta / root * math.atan2(2.0 * zeta * root, 2.0 * zeta * zeta - 1.0))
    names, apart = ["phi_loss", "phi_land"], []
    rigid = sweep.summarise("foot", HEAVY | {"restitution": bounce}, names).iloc[0]
    for kf in (1e8, 1e10):
        soft = HEAVY | {"kf": kf, "cf": 2.0 * zeta * math.sqrt(kf * HEAVY["m"])}
        got = sweep.summarise("foot", soft, names).iloc[0]
        assert got.status == st.OK
        apart.append(max(abs(got[name] - rigid[name]) for name in names))
    # the time of the impact, some pi sqrt(m/kf), is what the rigid ground leaves out
    assert apart[1] < 0.2 * apart[0] < 0.2 * 0.1


def test_foot_without_fabric_has_the_bits_of_the_rigid_foot() -> None:
    names = ["flights", "phi_loss", "phi_land", "least_force"]
    one = sweep.summarise("foot", HEAVY, names)
    both = sweep.summarise("foot", HEAVY | {"kf": [0.0, 1e5, 0.0]}, names)
    for row in (0, 2):
        assert (both.loc[row, names] == one.loc[0, names]).all()
    assert both.phi_land[1] != one.phi_land[0]


def test_fabric_that_springs_back_throws_the_foot_off_below_the_speed_of_a_rigid_ground() -> None:
    p = HEAVY | {"omega": 310.0}
    stiff = sweep.summarise("foot", p, ["flights", "least_force"]).iloc[0]
    soft = sweep.summarise("foot", p | {"kf": 5e3, "cf": 5.0}, ["flights", "least_force", "most_force"]).iloc[0]
    assert stiff.flights == 0.0 and stiff.least_force > 0.0
    assert soft.flights == 1.0 and soft.least_force == 0.0 and np.isfinite(soft.most_force)


def test_foot_on_fabric_lies_pressed_in_where_the_rack_is_away() -> None:
    p = HEAVY | {"omega": 20.0, "kf": 1e5, "cf": 50.0}
    got = sweep.evaluate("foot", p, ["y_foot", "force"], phi=PHI)
    lowest = 3 * NODES // 4
    assert got.y_foot[lowest] == pytest.approx(-p["F0"] / (p["k"] + p["kf"]), rel=1e-6)
    assert got.force[lowest] == pytest.approx(p["F0"] * p["kf"] / (p["k"] + p["kf"]), rel=1e-6)


@pytest.mark.parametrize("zeta", [1.0, 3.0])
@pytest.mark.parametrize("kf", [1e6, 1e7])
def test_the_greatest_force_of_a_damped_fabric_is_the_blow_at_entry(kf: float, zeta: float) -> None:
    """The foot lies still until then: the force of rest, and the damper at the speed of the rack."""
    p = HEAVY | {"omega": 100.0, "kf": kf, "cf": 2.0 * zeta * math.sqrt(kf * HEAVY["m"])}
    got = sweep.summarise("foot", p, ["most_force", "flights", "v_entry"]).iloc[0]
    assert got.flights == 0.0
    assert got.most_force == pytest.approx(p["F0"] * kf / (p["k"] + kf) + p["cf"] * got.v_entry, rel=1e-9)


@pytest.mark.parametrize("kf", [5e7, 2e8])
def test_the_greatest_force_of_a_stiff_fabric_lies_between_the_ends_of_parts(kf: float) -> None:
    p = HEAVY | {"kf": kf}
    got = sweep.summarise("foot", p, ["most_force"]).iloc[0]
    dense = sweep.evaluate("foot", p, ["force"], phi=2.0 * math.pi * np.arange(64 * NODES) / (64 * NODES))
    # poses stand so near that they miss a share of (swing between two)^2/8 of the peak at most
    missed = (math.sqrt(kf / p["m"]) / p["omega"] * 2.0 * math.pi / (64 * NODES)) ** 2 / 8.0
    assert got.most_force == pytest.approx(dense.force.max(), rel=2.0 * missed)


def test_fabric_at_another_speed_scales_with_its_square() -> None:
    names = ["flights", "phi_loss", "phi_land", "lost_angle"]
    p = HEAVY | {"kf": 5e4, "cf": 20.0}
    faster = p | {"omega": 800.0, "k": 4 * p["k"], "F0": 4 * p["F0"], "kf": 4 * p["kf"], "cf": 2 * p["cf"]}
    one, two = (sweep.summarise("foot", x, names) for x in (p, faster))
    assert (one[names] == two[names]).all(axis=None)  # a power of two: not a bit changes


def test_fabric_is_refused_with_restitution_without_stiffness_and_beyond_its_parts() -> None:
    for wrong in ({"kf": 1e5, "restitution": 0.3}, {"cf": 5.0}):
        assert sweep.summarise("foot", HEAVY | wrong, ["flights"]).status[0] == st.INVALID_INPUT
    assert sweep.summarise("foot", HEAVY | {"kf": 1e20}, ["flights"]).status[0] == st.NOT_CONVERGED
    with pytest.raises(sweep.InputError):
        sweep.summarise("foot", HEAVY | {"kf": -1.0}, ["flights"])


def test_feed_rack_carries_a_foot_on_fabric() -> None:
    p = RACK | {"y_plate": 1.6, "m": 0.05, "k": 50.0, "F0": 4.0, "omega": 20.0}
    rigid, soft = (sweep.summarise("feed_foot", p | {"kf": kf}, ["most_force", "flights"]) for kf in (0.0, 5e3))
    assert rigid.status[0] == soft.status[0]
    assert np.isfinite(soft.most_force[0]) and soft.most_force[0] != rigid.most_force[0]


def test_march_jitted_equals_plain() -> None:
    p = HEAVY | {"kf": 5e4, "cf": 20.0}
    table = np.array([[p[name] for name in ("m", "k", "F0", "omega", "Y", "p", "restitution", "X")]])
    feet = np.array([[p[name] for name in ("m", "k", "F0", "omega", "restitution", "kf", "cf")]])
    path, results = path_of(table, 96), []
    for function in (march, march.py_func):
        room = np.empty(1, np.uint8), np.empty((11, 1)), np.empty((1, 96)), np.empty((1, 96)), np.zeros((1, 257))
        function(path, feet, 1, *room)
        results.append(room)
    for one, other in zip(*results, strict=True):
        np.testing.assert_array_equal(one, other)


def last_turn(p: dict[str, float], turns: int) -> dict[str, float]:
    """Events of the last of some turns."""
    table = np.array([[p[name] for name in ("m", "k", "F0", "omega", "Y", "p", "restitution", "X")]])
    feet = np.array([[p[name] for name in ("m", "k", "F0", "omega", "restitution", "kf", "cf")]])
    status, outputs = np.empty(1, np.uint8), np.empty((11, 1))
    room = np.empty((1, NODES)), np.empty((1, NODES)), np.empty((1, 257))
    march(path_of(table, NODES), feet, turns, status, outputs, *room)
    assert status[0] == st.OK
    return dict(zip(OUTPUTS, outputs[:, 0], strict=True))


SWINGING = HEAVY | {"m": 0.06, "k": 4e3, "F0": 38.0, "omega": 733.0, "kf": 2e5, "cf": 60.0, "Y": 2e-3, "p": 1.2e-3}


def test_turns_that_differ_are_not_called_alike() -> None:
    turns = [last_turn(SWINGING, k) for k in (*range(1, 7), 60, 61)]
    lost, settled = ([turn[name] for turn in turns] for name in ("lost_angle", "settled"))
    # to the digits of the example
    assert lost[:6] == pytest.approx([1.005, 1.024, 1.0146, 1.0125, 1.0124, 1.0124], abs=3e-4)
    assert settled[:4] == [0.0] * 4 and settled[6:] == [1.0, 1.0]
    assert lost[7] == pytest.approx(lost[6], rel=1e-9)
    table = sweep.summarise("foot", SWINGING, ["lost_angle", "settled"])
    assert (table.lost_angle[0], table.settled[0]) == (lost[TURNS - 1], 0.0)


@pytest.mark.parametrize("cf", mostly_long([0.0, 1.0, 30.0], [1.0]))
@pytest.mark.parametrize("kf", [2e4, 1e5])
def test_turns_called_alike_are_so_in_every_later_turn(kf: float, cf: float) -> None:
    for p in (SWINGING, HEAVY):
        called = None
        for turn in (last_turn(p | {"kf": kf, "cf": cf}, k) for k in range(1, 41)):
            called = turn if called is None and turn["settled"] == 1.0 else called
            # angles of loss and landing move by as much as the height, over the slope of their crossing
            assert called is None or turn["lost_angle"] == pytest.approx(called["lost_angle"], abs=1e-4)
            assert called is None or turn["settled"] == 1.0


def test_a_swing_that_builds_up_over_hundreds_of_turns_is_not_called_alike() -> None:
    """Five swings a turn, all but undamped: the foot comes back to within 1e-6 of its height, and farther on each time.

    In all the swing grows to sixty times what the first turn shows.
    """
    p = HEAVY | {"omega": 150.0, "k": 0.0, "F0": 30.0, "kf": 0.05 * 750.0**2, "cf": 0.01, "p": 1e-3, "Y": 1e-3 + 1e-8}
    late = [last_turn(p, turns) for turns in (4, 100, 1000)]
    assert late[2]["most_force"] / late[1]["most_force"] - 1.0 > 2e-5
    assert [turn["settled"] for turn in late[:2]] == [0.0, 0.0]
