"""Presser foot: the 25-digit table through the public functions, stepping through time, scaling, limits, controls."""

from __future__ import annotations

import json
import math
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from mpmath import mp, mpf
from scipy.optimize import brentq

import sweep
from kernels import status as st
from kernels.effects import foot as effect
from kernels.effects import foot_fabric
from kernels.families import foot
from sweep.families import family
from sweep.families.foot import NODES, TURNS, path_of
from tests.reference import foot as naive

ROWS = [r for r in json.loads((Path(__file__).parents[2] / "oracle" / "feed_open.json").read_text())["rows"]
        if r["kind"] == "foot"]  # fmt: skip
NAMES = family("foot").parameter_names[:8]
TABLE = pd.DataFrame([r["inputs"] for r in ROWS])
HEAVY = {"m": 0.05, "k": 3000.0, "F0": 6.0, "omega": 400.0, "Y": 1.5e-3, "p": 0.5e-3, "restitution": 0.0, "X": 1e-3}


def rigid(designs):
    """Feet of the march without fabric."""
    return np.hstack([designs[:, [0, 1, 2, 3, 6]], np.zeros((len(designs), 2))])


def test_foot_matches_oracle_on_every_row():
    names = list(ROWS[0]["expected"])
    got = sweep.summarise("foot", TABLE, names)
    assert got.status.tolist() == [st.OK if "t_recontact" in row["expected"] else st.NO_EVENT for row in ROWS]
    for k, row in enumerate(ROWS):
        for name, expected in row["expected"].items():
            # N at entry and at the top are differences of forces of the size of m omega^2 Y: 8 roundings of that
            i = row["inputs"]
            size = i["m"] * i["omega"] ** 2 * i["Y"] + i["F0"] if name.startswith("N_") else 0.0
            assert abs(mpf(float(got[name][k])) - mpf(expected)) <= 16 * mpf(2) ** -53 * max(size, abs(mpf(expected)))
    assert got.t_recontact.notna().tolist() == ["t_recontact" in row["expected"] for row in ROWS]


@pytest.mark.parametrize("restitution", [0.0, 0.2, 0.45])
@pytest.mark.parametrize("omega", [150.0, 260.0, 330.0, 400.0])
def test_foot_flies_and_lands_where_steps_through_time_say(omega, restitution):
    p = HEAVY | {"omega": omega, "restitution": restitution}
    got = sweep.summarise("foot", p, ["flights", "phi_loss", "phi_land", "impact_speed", "settled"]).iloc[0]
    assert got.status == (st.OK if got.flights else st.NO_EVENT)
    start = -0.5 * math.pi
    steps = naive.flights(p, TURNS, 2000)
    last = [f for f in steps if f[0] >= start + (TURNS - 1) * 2.0 * math.pi]
    big = [f for f in last if f[1] - f[0] > 1e-3]
    if not big:
        assert got.flights == 0.0 and math.isnan(got.phi_loss)
        return
    if got.settled:
        # both find the same events by halving; bounces feed rounding back, so some 1e-9 rad remain of 1e-15
        assert got.phi_loss == pytest.approx(big[0][0] % (2.0 * math.pi), abs=1e-9)
        assert got.phi_land == pytest.approx(big[0][1] % (2.0 * math.pi), abs=1e-9)


def test_a_bounce_that_the_rising_rack_cuts_short_ends_where_it_meets_the_foot():
    """In the third turn the foot bounces on the plate 8e-5 rad before the rack comes through, which then hits it.

    That hit was looked for a quarter of a step later, so all that follows was up to 2e-3 rad off.
    """
    p = {"m": 0.04686558890196624, "k": 2490.618000731477, "F0": 7.233372612525972, "omega": 281.0379025384778,
         "Y": 1.2672484258935707e-3, "p": 7.815235707781273e-4, "restitution": 0.9, "X": 1e-3}  # fmt: skip
    steps = naive.flights(p, TURNS, 20000)
    entry = math.asin(p["p"] / p["Y"])
    ahead = [(entry - a[0] % (2.0 * math.pi), a[1] - a[0]) for a in steps]
    short = [(before, hop) for before, hop in ahead if 0.0 < before < 1e-4]
    assert len(short) == 1 and short[0][0] < short[0][1] < 2e-4
    first = next(a for a in steps if a[0] >= -0.5 * math.pi + (TURNS - 1) * 2.0 * math.pi)
    got = sweep.summarise("foot", p, ["phi_loss", "phi_land", "flights", "settled"]).iloc[0]
    # Rounding of 1e-16 grows with every bounce, to 1e-12 after these thirty.
    assert got.phi_loss == pytest.approx(first[0] % (2.0 * math.pi), abs=1e-10)
    assert got.phi_land == pytest.approx(first[1] % (2.0 * math.pi), abs=1e-10)
    assert got.flights == sum(a[0] >= first[0] for a in steps) + 1.0  # the last flight lands in the next turn
    assert got.settled == 0.0


def test_foot_whose_last_hop_is_lower_than_rounding_lies_still_from_there():
    """It fell through the rack to the end of a part of a cell and bounced anew, in 45 of 6000 random feet."""
    p = {"m": 0.40892091432381794, "omega": 475.30429849289357, "Y": 0.0016744970528513358, "p": 0.0,
         "restitution": 0.2, "k": 410199.49643042014, "F0": 27.17704839467424}  # fmt: skip
    above, below = (2 * TURNS - 2) * math.pi, (2 * TURNS - 1) * math.pi
    flown = sum(max(0.0, min(y, below) - max(x, above)) for x, y, _ in naive.flights(p, TURNS, 4000))
    # the steps take hops below a sixty-fourth of a step for rest: 4e-5 rad; the fall through the rack made 3e-3
    assert sweep.summarise("foot", p, ["lost_angle"]).lost_angle[0] == pytest.approx(flown, abs=1e-4)


@pytest.mark.parametrize("restitution", [0.1, 0.4])
def test_foot_whose_first_flight_ends_in_the_next_turn_lands_there(restitution):
    """It was NO_EVENT beside a `phi_loss`: of 2698 random feet with flights 1063."""
    p = HEAVY | {"m": 0.1325, "k": 3446.5, "F0": 7.8, "omega": 653.3, "Y": 2.24e-3, "p": 4.7e-5}
    p |= {"restitution": restitution}
    got = sweep.summarise("foot", p, ["phi_loss", "phi_land", "settled"]).iloc[0]
    begin, end = (2.0 * TURNS - 2.5) * math.pi, (2.0 * TURNS - 0.5) * math.pi
    first = next(f for f in naive.flights(p, TURNS + 2, 4000) if f[0] >= begin)
    assert got.settled == 0.0 and first[0] < end < first[1]
    # both find the same events by halving; three turns of flights feed rounding back
    assert got.phi_loss == pytest.approx(first[0] % (2.0 * math.pi), abs=1e-9)
    assert got.phi_land == pytest.approx(first[1] % (2.0 * math.pi), abs=1e-9)


@pytest.mark.parametrize("before", [1e-7, 1e-6, 1e-5])
def test_foot_thrown_off_just_before_a_part_of_a_cell_ends_flies_on(before):
    """The gap there is below rounding: it landed at once, up to 18 times (3 of 330 random feet that fly)."""
    loss, k, p = 462.0 * (math.pi / 1440.0) - before, 0.5, 0.5
    preload = (1.0 - k) * math.sin(loss) + k * p
    rest, root = -preload / k, math.sqrt(k)

    def gap(phi):
        t = root * (phi - loss)
        free = rest + (math.sin(loss) - p - rest) * math.cos(t) + math.cos(loss) / root * math.sin(t)
        return free - max(math.sin(phi) - p, 0.0)

    foot = {"m": 1.0, "k": k, "F0": preload, "omega": 1.0, "Y": 1.0, "p": p}
    got = sweep.summarise("foot", foot, ["flights", "phi_loss", "phi_land"]).iloc[0]
    assert got.flights == 1.0 and got.phi_loss == pytest.approx(loss, abs=1e-9)
    assert got.phi_land == pytest.approx(brentq(gap, loss + 0.1, 4.0), abs=1e-9)


def test_foot_first_landing_of_the_march_is_the_time_of_the_closed_form():
    for row in (r for r in ROWS if r["case"] == "rebound"):
        table = {name: [row["inputs"].get(name, 0.0)] for name in NAMES}
        designs = np.array([[table[name][0] for name in NAMES]])
        path, outputs, status = path_of(designs, NODES), np.empty((11, 1)), np.empty(1, np.uint8)
        room = [np.empty((1, size)) for size in (NODES, NODES, 257)]
        foot_fabric.march(path, rigid(designs), 1, status, outputs, *room)
        events = dict(zip(effect.OUTPUTS, outputs[:, 0], strict=True))
        flight = (events["phi_land"] - events["phi_loss"]) % (2.0 * math.pi)
        if float(row["expected"]["t_recontact"]) * row["inputs"]["omega"] < math.pi:
            assert flight / row["inputs"]["omega"] == pytest.approx(float(row["expected"]["t_recontact"]), rel=1e-11)
        assert events["phi_loss"] == pytest.approx(float(row["expected"]["x0"]), rel=1e-12)


def test_foot_that_keeps_contact_follows_the_rack():
    p = HEAVY | {"omega": 100.0}
    phi = np.arange(24) * (2.0 * math.pi / 24)
    at = sweep.evaluate("foot", p, ["y_rack", "y_foot", "force"], phi=phi)
    height = p["Y"] * np.sin(phi) - p["p"]
    np.testing.assert_allclose(at.y_rack, height, rtol=0, atol=1e-17)
    np.testing.assert_allclose(at.y_foot, np.maximum(height, 0.0), rtol=0, atol=1e-17)
    above = height > 0.0
    bend = -(p["omega"] ** 2) * p["Y"] * np.sin(phi)
    np.testing.assert_allclose(at.force[above], (p["F0"] + p["k"] * height + p["m"] * bend)[above], rtol=1e-13)
    np.testing.assert_allclose(at.force[~above], p["F0"], rtol=1e-15)
    whole = sweep.summarise("foot", p, ["flights", "lost_angle", "stitch_error", "least_force"]).iloc[0]
    assert (whole.flights, whole.lost_angle, whole.stitch_error) == (0.0, 0.0, 0.0)
    assert whole.least_force > 0.0


def test_foot_keeps_contact_exactly_from_the_preload_and_spring_of_the_closed_forms():
    need = sweep.summarise("foot", HEAVY, ["F0_min_contact"]).F0_min_contact[0]
    assert need == pytest.approx(HEAVY["m"] * HEAVY["omega"] ** 2 * HEAVY["p"], rel=1e-15)
    for preload in (1.001 * need, 2.0 * need):
        p = HEAVY | {"F0": preload}
        spring = sweep.summarise("foot", p, ["k_min_contact"]).k_min_contact[0]
        flights = [
            sweep.summarise("foot", p | {"k": x}, ["flights"]).flights[0] for x in (1.001 * spring, 0.999 * spring)
        ]
        assert flights[0] == 0.0 < flights[1]
    entry = sweep.summarise("foot", HEAVY | {"F0": 0.999 * need, "k": 1e5}, ["flights", "phi_loss", "x0"]).iloc[0]
    assert entry.flights > 0.0 and entry.phi_loss == pytest.approx(entry.x0, rel=1e-9)


@pytest.mark.parametrize("factor", [0.5, 2.0, 4.0])
def test_foot_at_another_speed_needs_spring_and_preload_with_its_square(factor):
    names = ["flights", "phi_loss", "phi_land", "lost_angle", "stitch_error"]
    p = HEAVY | {"restitution": 0.2}
    faster = p | {"omega": factor * p["omega"], "k": factor**2 * p["k"], "F0": factor**2 * p["F0"]}
    one, two = (sweep.summarise("foot", x, [*names, "k_min_contact", "impulse"]) for x in (p, faster))
    # a power of two: not a bit changes
    pd.testing.assert_frame_equal(one[names], two[names], check_exact=True)
    assert two.impulse[0] == factor * one.impulse[0]


def test_foot_without_spring_falls_with_constant_acceleration():
    p = HEAVY | {"k": 0.0, "F0": 3.0, "omega": 300.0}
    phi = np.arange(720) * (2.0 * math.pi / 720)
    at = sweep.evaluate("foot", p, ["y_foot", "force"], phi=phi)
    flying = np.flatnonzero(
        (at.force[:-2] == 0.0).to_numpy() & (at.force[1:-1] == 0.0).to_numpy() & (at.force[2:] == 0.0).to_numpy()
    )
    assert flying.size > 20
    y = at.y_foot.to_numpy()
    bend = (y[flying] - 2.0 * y[flying + 1] + y[flying + 2]) / (2.0 * math.pi / 720 / p["omega"]) ** 2
    np.testing.assert_allclose(bend, -p["F0"] / p["m"], rtol=1e-6)
    soft = sweep.summarise("foot", p | {"k": 1e-6}, ["jump_height_free", "flight_time_free", "phi_land"]).iloc[0]
    none = sweep.summarise("foot", p, ["jump_height_free", "flight_time_free", "phi_land"]).iloc[0]
    np.testing.assert_allclose(soft.to_numpy(float), none.to_numpy(float), rtol=1e-6)


def test_foot_energy_of_a_flight_is_kept():
    p = HEAVY | {"restitution": 0.2}
    phi = np.arange(720) * (2.0 * math.pi / 720)
    at = sweep.evaluate("foot", p, ["y_foot", "force"], phi=phi)
    y, dt = at.y_foot.to_numpy(), 2.0 * math.pi / 720 / p["omega"]
    inside = np.flatnonzero([all(at.force[k - 2 : k + 3] == 0.0) for k in range(2, 718)]) + 2
    v = (y[inside - 2] - 8.0 * y[inside - 1] + 8.0 * y[inside + 1] - y[inside + 2]) / (12.0 * dt)
    energy = 0.5 * p["m"] * v * v + 0.5 * p["k"] * y[inside] ** 2 + p["F0"] * y[inside]
    # a bounce between two nodes changes the energy: pieces between bounces
    pieces = np.split(energy, np.flatnonzero(np.abs(np.diff(energy)) > 1e-4 * energy[:-1]) + 1)
    longest = max(pieces, key=len)
    assert len(longest) > 20
    np.testing.assert_allclose(longest, longest[0], rtol=1e-6)


def test_foot_says_what_it_cannot_do():
    never = sweep.summarise("foot", HEAVY | {"p": 2e-3}, ["x0", "v_entry"]).iloc[0]
    assert never.status == st.NO_EVENT and math.isnan(never.x0)
    buried = sweep.summarise("foot", HEAVY | {"p": -2e-3}, ["flights"]).iloc[0]
    assert buried.status == st.NO_EVENT and math.isnan(buried.flights)
    under = sweep.summarise("foot", HEAVY | {"p": 2e-3}, ["flights", "lost_angle"]).iloc[0]
    assert (under.flights, under.lost_angle, under.status) == (0.0, 0.0, st.OK)
    elastic = sweep.summarise("foot", HEAVY | {"restitution": 1.0}, ["flights"]).iloc[0]
    assert elastic.status == st.INVALID_INPUT


def test_foot_jitted_equals_plain():
    designs = np.array([[r["inputs"].get(name, 1e-3) for name in NAMES] for r in ROWS[:3]])
    results = []
    for plain in (False, True):

        def call(function, plain=plain):
            return function.py_func if plain else function

        status, closed, path = np.empty(3, np.uint8), np.empty((10, 3)), np.empty((3, 6, 96))
        call(foot.closed_forms)(designs, status, closed)
        call(foot.rack_path)(designs, path)
        room = [np.empty(shape) for shape in ((11, 3), (3, 96), (3, 96), (3, 257))]
        call(foot_fabric.march)(path, rigid(designs), 2, status, *room)
        results.append((closed, path, *room, status))
    for one, two in zip(*results, strict=True):
        np.testing.assert_allclose(one, two, rtol=1e-12)


def test_negative_control_launch_without_restitution_fails_the_oracle():
    row = next(r for r in ROWS if r["case"] == "rebound")
    p = {name: row["inputs"][name] for name in row["inputs"]} | {"restitution": 0.0}
    got = sweep.summarise("foot", p, ["jump_height_free"]).jump_height_free[0]
    with mp.workdps(20):
        assert abs(float(mpf(row["expected"]["jump_height_free"]) / mpf(float(got)) - 1)) > 0.1


def test_loads_are_the_momentum_of_the_foot_and_the_work_of_its_rack() -> None:
    """Contact all the way: the force on the frame is that of the path, and the rack gets its work back."""
    design = {"m": 0.05, "k": 3000.0, "F0": 60.0, "omega": 400.0, "Y": 1.5e-3, "p": 0.5e-3, "X": 1e-3}
    phi = np.arange(720) * (2.0 * np.pi / 720)
    found = sweep.evaluate("foot", design, ["y_rack", "force", "drive_torque", "shaking_force_y"], phi=phi)
    above = found.y_rack > 0.0
    bend = -1.5e-3 * np.sin(phi)
    lifted = np.where(above, -0.05 * 400.0**2 * bend, 0.0)
    np.testing.assert_allclose(found.shaking_force_y, lifted, atol=1e-9 * 60.0)
    np.testing.assert_allclose(found.drive_torque, np.where(above, found.force * 1.5e-3 * np.cos(phi), 0.0), atol=1e-12)
    # entry and leaving fall between nodes: a node's share of the largest torque is left
    assert abs(found.drive_torque.mean()) < found.drive_torque.abs().max() / 720


@pytest.mark.parametrize("omega", [300.0, 400.0])
def test_the_greatest_force_counts_the_jump_where_the_rack_passes_the_plate(omega):
    got = sweep.summarise("foot", HEAVY | {"F0": 8.0, "p": -1e-3, "omega": omega}, ["most_force", "N_at_entry"]).iloc[0]
    # the rack's curvature is interpolated there
    assert got.most_force == pytest.approx(got.N_at_entry, rel=1e-7)


@pytest.mark.parametrize("omega", [60.0, 150.0, 300.0])
@pytest.mark.parametrize("p", [-1e-3, 0.3e-3, 1.1e-3])
def test_least_and_greatest_force_of_a_foot_that_keeps_contact_are_those_at_entry_and_top(omega, p):
    """Between entry and top the force is linear in the sine: the node next to the plate read up to 2 % too much."""
    design = HEAVY | {"F0": 45.0, "omega": omega, "p": p}
    names = ["least_force", "most_force", "N_at_entry", "N_at_top"]
    got = sweep.summarise("foot", design, names).iloc[0]
    ends = got.N_at_entry, got.N_at_top
    assert got.least_force == pytest.approx(min(ends), rel=1e-9)
    assert got.most_force == pytest.approx(max(*ends, design["F0"]), rel=1e-9)


def test_the_greatest_force_counts_where_the_foot_lands_between_two_nodes():
    design = {"m": 0.0531, "k": 0.0, "F0": 4.673, "omega": 236.4, "Y": 2.345e-3, "p": -1.631e-3, "restitution": 0.089}
    most = sweep.summarise("foot", design, ["most_force"]).most_force[0]
    nodes = 144000
    found = sweep.evaluate("foot", design, ["force"], phi=np.arange(nodes) * (2.0 * math.pi / nodes))
    # the force falls after the landing, by less than this until the next of so many nodes
    assert 0.0 <= most / found.force.max() - 1.0 < 3e-5


@pytest.mark.parametrize("omega", [20.0, 60.0, 160.0])
def test_bounces_of_a_hard_foot_die_out(omega):
    """More than 64 of them within one step of the march were NOT_CONVERGED."""
    hard = np.linspace(0.65, 0.8, 4)
    table = {name: np.full(4, value) for name, value in HEAVY.items()} | {"omega": np.full(4, omega)}
    got = sweep.summarise("foot", table | {"restitution": hard}, ["lost_angle"])
    assert (got.status == st.OK).all()
    assert (np.diff(got.lost_angle) > 0.0).all()
