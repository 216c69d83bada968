"""Crank speed under a motor line, friction, loads that jump: the torque that is left for the motor is its line.

The check shares nothing with the solver: the joint loads at the speed and acceleration that it found, pose by pose,
give the torque that the motor has to give there.
"""

from __future__ import annotations

import numpy as np
import pytest
from scipy.integrate import cumulative_trapezoid
from scipy.optimize import brentq

import sweep
from kernels import status as st
from studies.accuracy.ordinary import designs as ordinary
from sweep.effects import extended
from sweep.effects import speed as speed_of_turn
from sweep.families import family
from tests.effects.test_tool import DRIVE, GUIDE

N = 64
PHI = 2.0 * np.pi * np.arange(N) / N
LINKS = {"a": 20.0, "b": 95.0, "c": 60.0, "e": 70.0, "f": 12.0, "g": 8.0, "alpha": 1.2}
OMEGA = 500.0
BODIES = {"m_crank": 2e-4, "m_coupler": 1e-4, "com_coupler_x": 40.0, "m_rocker": 3e-4, "j_rocker_zz": 0.3,
          "j_crank_zz": 0.2, "load_torque": -900.0, "gravity_y": -9810.0}  # fmt: skip
RUBBING = {f"mu_{k}": 0.05 for k in "abcd"} | {f"radius_{k}": 5.0 for k in "abcd"}
RUBBING |= {"support_a1": -30.0, "support_a2": -60.0, "support_d1": -20.0, "support_d2": 30.0}
CRANK_ROCKER = LINKS | BODIES | {"flywheel": 1.0, "speed": OMEGA}
TURNS = 0.1  # time constant of the motor line


def slope(table, turns=TURNS):
    inertia = sweep.evaluate("rssr", table, ["reduced_inertia"], phi=PHI).reduced_inertia.mean() + table["flywheel"]
    return inertia * OMEGA / (2.0 * np.pi * turns)


def changes(mechanism, table, speed, phi, loads=None):
    """Derivative of omega^2/2 by the crank angle: differences of fourth order of the speed that is given."""
    step = 1e-3
    moved = [sweep.evaluate(mechanism, table, [speed], phi=phi + k * step, loads=loads) for k in (-2, -1, 1, 2)]
    squares = [0.5 * found[speed] ** 2 for found in moved]
    return ((squares[0] - squares[3] + 8.0 * (squares[2] - squares[1])) / (12.0 * step)).to_numpy()


def left_for_the_motor(mechanism, table, suffix, number="", loads=None):
    """Torque of the motor plus its line: a constant in the steady state; and the speed over the turn."""
    names = [f"crank_{name}{suffix}{number}" for name in ("speed", "acceleration")]
    turn = sweep.evaluate(mechanism, table, names, phi=PHI, loads=loads)
    assert (turn.status == st.OK).all()
    speed, change = turn[names[0]].to_numpy(), changes(mechanism, table, names[0], PHI, loads)
    # beside kinks of friction the speed's own derivative is off
    assert np.abs(turn[names[1]] - change).max() < (1e-2 if suffix or loads else 1e-6) * np.abs(change).max()
    posed = table | {f"speed{number}": speed, f"speed_change{number}": change, "phi": PHI}
    torque = sweep.evaluate(mechanism, posed, [f"drive_torque{suffix}{number}"], loads=loads).iloc[:, 0].to_numpy()
    mean = 1.0 / np.mean(1.0 / speed)
    line = table.get(f"motor_slope{number}", 0.0) * (speed - OMEGA)
    return torque + table[f"flywheel{number}"] * change + line, speed, mean


@pytest.mark.parametrize("turns", [None, 3.0, TURNS, 0.01])
def test_motor_gives_what_its_line_says_at_every_pose(turns):
    table = CRANK_ROCKER | {"motor_slope": 0.0 if turns is None else slope(CRANK_ROCKER, turns)}
    torque, speed, mean = left_for_the_motor("rssr", table, "")
    # The series of torque and inertia are resolved to 1e-9 of the torque of inertia.
    size = np.abs(sweep.evaluate("rssr", table, ["drive_torque"], phi=PHI).drive_torque).max()
    assert np.ptp(torque) < 1e-7 * size
    assert mean == pytest.approx(OMEGA, rel=1e-9)
    assert np.ptp(speed) > 1e-4 * OMEGA


def test_motor_line_of_a_tenth_of_a_turn_moves_unevenness_by_20_to_30_percent():
    constant = sweep.summarise("rssr", CRANK_ROCKER, ["unevenness"], accuracy=1e-8).unevenness[0]
    line = CRANK_ROCKER | {"motor_slope": slope(CRANK_ROCKER)}
    assert 0.7 < sweep.summarise("rssr", line, ["unevenness"], accuracy=1e-8).unevenness[0] / constant < 0.8


def test_weak_motor_line_is_constant_torque_and_a_stiff_one_holds_the_speed():
    table = CRANK_ROCKER | {"motor_slope": [0.0, 1e-6, *(slope(CRANK_ROCKER) * np.array([1.0, 4.0, 16.0]))]}
    found = sweep.summarise("rssr", table, ["unevenness"], accuracy=1e-8)
    assert (found.status == st.OK).all()
    assert found.unevenness[1] == pytest.approx(found.unevenness[0], rel=1e-6)
    assert (np.diff(found.unevenness[1:]) < 0.0).all()
    assert found.unevenness[4] < 0.2 * found.unevenness[0]


@pytest.mark.parametrize("line", [False, True])
def test_motor_gives_what_its_line_says_at_every_pose_where_the_joints_rub(line):
    table = CRANK_ROCKER | RUBBING | {"motor_slope": slope(CRANK_ROCKER) if line else 0.0}
    torque, _, mean = left_for_the_motor("rssr", table, "_friction")
    size = np.abs(sweep.evaluate("rssr", table, ["drive_torque_friction"], phi=PHI).drive_torque_friction).max()
    # Coulomb friction has kinks where the rocker turns back: a series of 1024 harmonics misses 1e-3 beside them.
    assert np.median(np.abs(torque - np.median(torque))) < 1e-4 * size
    assert np.ptp(torque) < 5e-3 * size
    assert mean == pytest.approx(OMEGA, rel=1e-6)
    smooth, _, _ = left_for_the_motor("rssr", table, "")
    assert np.median(torque) > np.median(smooth) + 0.01 * size  # negative control: friction is felt


# Stiff friction in a light drive: 257 poses miss 3e-3 of the torque, and friction settles within 20 passes.
LIGHT_SLIDER = {
    "a": 21.5186, "b": 88.6279, "e": 64.2281, "f": 11.203, "alpha": 1.2999, "branch": -1.0, "m_crank": 1.0662e-4,
    "j_crank_zz": 0.15393, "m_coupler": 7.6218e-5, "com_coupler_x": 22.8229, "com_coupler_y": 2.326,
    "j_coupler_xx": 2.9728e-3, "j_coupler_yy": 0.050078, "j_coupler_zz": 0.074404, "m_slider": 1.6664e-4,
    "gravity_z": -17554.3, "load_force": -25.4279, "speed": 786.858, "mu_a": 0.0017031, "mu_b": 0.096241,
    "mu_c": 0.0058525, "mu_d": 0.255635, "radius_a": 5.8932, "radius_b": 6.7783, "radius_c": 3.5923,
    "support_a1": -42.459, "support_a2": -56.117, "support_d1": -24.6573, "support_d2": 30.085, "flywheel": 3.16277,
}  # fmt: skip


def test_motor_gives_a_constant_torque_where_friction_is_stiff():
    torque, speed, _ = left_for_the_motor("rssp", LIGHT_SLIDER, "_friction")
    size = np.abs(sweep.evaluate("rssp", LIGHT_SLIDER, ["drive_torque_friction"], phi=PHI).drive_torque_friction).max()
    # 2049 poses miss 5e-4 of the torque of inertia, and leave 7e-4 here; friction of an even speed leaves 1.4 %.
    assert np.percentile(np.abs(torque - np.median(torque)), 90) < 2e-3 * size
    found = sweep.summarise("rssp", LIGHT_SLIDER, ["unevenness_friction"], accuracy=1e-8)
    assert found.status[0] == st.OK
    assert np.ptp(speed) == pytest.approx(found.unevenness_friction[0] * LIGHT_SLIDER["speed"], rel=0.02)


def test_largest_speed_with_friction_is_no_better_known_than_the_turn_it_comes_from():
    table = CRANK_ROCKER | RUBBING
    names = [f"{kind}_crank_speed_friction" for kind in ("max_abs", "max", "min")]
    found = sweep.summarise("rssr", table, names, accuracy=1e-8)
    assert found.status[0] == st.OK
    assert found.max_abs_crank_speed_friction[0] == found.max_crank_speed_friction[0]
    assert found.err_max_abs_crank_speed_friction[0] == found.err_max_crank_speed_friction[0]
    assert found.err_max_abs_crank_speed_friction[0] > 1e-9 * OMEGA  # kinks are not resolved to the rounding


def test_error_of_a_small_acceleration_counts_the_torque_that_the_turn_misses():
    names = ["fastest_friction", "max_abs_crank_acceleration_friction"]
    found = sweep.summarise("rssr", CRANK_ROCKER | RUBBING, names, accuracy=1e-8).iloc[0]
    assert found.status == st.OK
    assert found.max_abs_crank_acceleration_friction < 0.2 * found.fastest_friction**2
    # Both errors come from one share of J omega^2: for the speed it is one of omega, for the acceleration of omega^2,
    # of which the torque over the turn misses the 2 pi-th part.
    missed = found.err_fastest_friction * found.fastest_friction
    assert found.err_max_abs_crank_acceleration_friction >= missed / (2.0 * np.pi)


@pytest.mark.parametrize("line", [False, True])
def test_error_of_an_acceleration_with_friction_is_that_of_the_turn_it_comes_from(line, monkeypatch):
    """The mean torque misses the 2 pi-th part of the energy's error, not all: err_ was 15 to 100 times the error."""
    table = CRANK_ROCKER | RUBBING | {"motor_slope": slope(CRANK_ROCKER) if line else 0.0}
    names = [f"{kind}_crank_acceleration_friction" for kind in ("max", "min")]
    found = sweep.summarise("rssr", table, names, accuracy=1e-8).iloc[0]
    monkeypatch.setattr(speed_of_turn, "RUBBING", (129, 16385))  # eight times as many poses miss an eighth
    finer = sweep.summarise("rssr", table, names, accuracy=1e-8).iloc[0]
    assert found.status == finer.status == st.OK
    for name in names:
        assert 0.02 * found[f"err_{name}"] < abs(found[name] - finer[name]) < found[f"err_{name}"]


def test_friction_without_coefficients_is_the_smooth_drive():
    table = CRANK_ROCKER | RUBBING | {f"mu_{k}": 0.0 for k in "abcd"} | {"motor_slope": slope(CRANK_ROCKER)}
    found = sweep.summarise("rssr", table, ["unevenness", "unevenness_friction", "slowest_friction", "slowest"])
    assert found.unevenness_friction[0] == pytest.approx(found.unevenness[0], rel=1e-9)
    assert found.slowest_friction[0] == pytest.approx(found.slowest[0], rel=1e-9)


def test_jammed_drive_has_no_speed_with_friction():
    table = CRANK_ROCKER | RUBBING | {f"mu_{k}": 1.5 for k in "abcd"} | {f"radius_{k}": 20.0 for k in "abcd"}
    found = sweep.summarise("rssr", table, ["unevenness_friction"])
    assert found.status[0] == st.JAMMED
    assert np.isnan(found.unevenness_friction[0])


def test_load_over_the_turn_moves_the_speed_as_its_work_does():
    curve = (np.radians([0.0, 60.0, 120.0, 240.0]), [0.0, 0.0, -2000.0, 0.0])
    torque, _, mean = left_for_the_motor("rssr", CRANK_ROCKER, "", loads={"load_torque": curve})
    size = np.abs(sweep.evaluate("rssr", CRANK_ROCKER, ["drive_torque"], phi=PHI).drive_torque).max()
    assert np.ptp(torque) < 1e-4 * size  # the curve's slope changes its slope at the points
    assert mean == pytest.approx(OMEGA, rel=1e-8)


def test_both_stages_with_needle_bar_friction_and_motor_line_are_one_drive():
    chain = (
        DRIVE | {f"{name}2": x for name, x in GUIDE.items()} | {"flywheel1": 2.0, "speed1": OMEGA, "m_tool2": 2.5e-5}
    )
    for k in (1, 2):
        chain |= {f"{name}{k}": x for name, x in (BODIES | RUBBING).items()}
    chain["motor_slope1"] = 400.0
    torque, speed, mean = left_for_the_motor(["rssr", "guide"], chain, "_friction", "1")
    assert np.median(np.abs(torque - np.median(torque))) < 1e-3 * np.abs(torque).max()
    assert mean == pytest.approx(OMEGA, rel=1e-5)
    assert np.ptp(speed) > 1.0


def test_piercing_force_that_jumps_has_its_unevenness_within_the_error():
    table = GUIDE | {"m_crank": 1e-5, "m_coupler": 1e-5, "m_rocker": 1e-5, "j_rocker_zz": 0.01, "m_tool": 2.5e-5,
                     "speed": OMEGA, "flywheel": 0.05, "pierce_force": 40.0, "pierce_at": 100.0,
                     "pierce_sense": -1.0}  # fmt: skip
    way = sweep.evaluate("guide", table, ["s"], phi=PHI).s
    table["pierce_at"] = 0.5 * (way.max() + way.min())
    found = sweep.summarise("guide", table, ["unevenness"], accuracy=1e-6)
    assert found.status[0] == st.OK
    assert 1e-9 < found.err_unevenness[0] < 1e-2 * found.unevenness[0]
    # Work by the trapezoidal rule on 2^15 poses; the energy from the mean speed.
    fine = 2.0 * np.pi * np.arange(2**15) / 2**15
    poses = sweep.evaluate("guide", table, ["reduced_inertia", "dreduced_inertia", "drive_torque"], phi=fine)
    inertia = poses.reduced_inertia.to_numpy() + table["flywheel"]
    excess = (0.5 * poses.dreduced_inertia * OMEGA**2 - poses.drive_torque).to_numpy()
    excess = excess - excess.mean()
    work = np.cumsum(0.5 * (excess + np.roll(excess, 1))) * (fine[1] - fine[0])

    def speed(energy):
        return np.sqrt(2.0 * (energy + work) / inertia)

    low = -work.min()
    energy = brentq(
        lambda e: np.mean(1.0 / speed(e)) - 1.0 / OMEGA, low * 1.001 + 1e-9, low + 100.0 * inertia.max() * OMEGA**2
    )
    unevenness = np.ptp(speed(energy)) / OMEGA
    assert abs(found.unevenness[0] - unevenness) < found.err_unevenness[0] + 1e-3 * unevenness
    without = sweep.summarise("guide", table | {"pierce_force": 0.0}, ["unevenness"]).unevenness[0]
    assert abs(without - unevenness) > 0.02 * unevenness  # negative control: piercing is felt


def test_quasi_static_lag_sees_a_load_over_the_turn_as_it_sees_a_constant():
    table = LINKS | {"driven_inertia": 0.6, "stiffness": 2e4, "damping": 1.0, "speed": OMEGA}
    wanted = ["lag", "lag_dynamic"]
    constant = sweep.evaluate("rssr", table | {"load_torque": -700.0}, wanted, phi=PHI)
    curve = sweep.evaluate("rssr", table, wanted, phi=PHI, loads={"load_torque": {"mean": -700.0}})
    np.testing.assert_allclose(curve[wanted], constant[wanted], rtol=1e-10, atol=1e-15)
    wave = sweep.evaluate("rssr", table, wanted, phi=PHI, loads={"load_torque": {"mean": -700.0, "cos": [300.0]}})
    more = sweep.evaluate("rssr", table | {"load_torque": -400.0}, wanted, phi=PHI)
    np.testing.assert_allclose(wave.lag - constant.lag, (more.lag - constant.lag) * np.cos(PHI), atol=1e-15)
    assert np.abs(wave.lag_dynamic - constant.lag_dynamic).max() > 1e-5


def test_the_error_of_an_acceleration_that_is_zero_tells_its_rounding():
    """Without weights nothing changes the speed of a lone crank."""
    random, n = np.random.default_rng(0), 100
    crank = {"a": 2.0, "e": 3.0, "f": 1.0, "alpha": 0.5, "Z1": -3.0, "Z2": 4.0, "P_h": 8.0}
    table = {name: np.full(n, value) for name, value in crank.items()}
    table |= {"speed": np.exp(random.uniform(1.0, 6.0, n)), "m_crank": random.uniform(1e-4, 1e-3, n)}
    table |= {"com_crank_x": random.uniform(-1.0, 1.0, n), "j_crank_zz": random.uniform(1e-4, 1e-2, n)}
    found = sweep.summarise("eyelet", table, ["max_abs_crank_acceleration", "rms_crank_acceleration"], accuracy=1e-6)
    assert (found.status == st.OK).all()
    for name in ("max_abs_crank_acceleration", "rms_crank_acceleration"):
        assert (found[name] <= found[f"err_{name}"]).all()
        assert (found[f"err_{name}"] < 1e-12 * table["speed"] ** 2).all()


@pytest.mark.parametrize(("law", "flywheel"), [(1.0, 100.0), (3.0, 100.0), (1.0, 3000.0), (2.0, 3000.0)])
def test_errors_of_the_speed_of_a_cam_see_what_the_harmonics_of_its_kinks_add_up_to(law, flywheel):
    """Rise and return of one length leave every fourth harmonic: two others were looked at, 5e4 times too small."""
    lever = {"lift": 0.3, "r0": 20.0, "c": 40.0, "e": 48.0, "law": law, "m_lever": 1e-3, "speed": 50.0}
    phi = np.linspace(0.0, 2.0 * np.pi, 2**14 + 1)  # kinks stand on it
    loads = sweep.evaluate("cam_lever", lever, ["drive_torque", "reduced_inertia", "dreduced_inertia"], phi=phi)
    inertia = loads.reduced_inertia.to_numpy() + flywheel
    excess = 0.5 * 50.0**2 * loads.dreduced_inertia.to_numpy() - loads.drive_torque.to_numpy()
    excess -= np.trapezoid(excess, phi) / (2.0 * np.pi)
    work = cumulative_trapezoid(excess, phi, initial=0.0)
    low, high = 0.9 * 1250.0 * inertia.mean(), 1.1 * 1250.0 * inertia.mean()
    energy = brentq(
        lambda e: np.trapezoid(np.sqrt(inertia / (e + work)), phi) - 2.0 * np.pi * 2.0**0.5 / 50.0, low, high
    )
    speed = np.sqrt(2.0 * (energy + work) / inertia)
    change = (excess - 0.5 * speed**2 * loads.dreduced_inertia) / inertia
    exact = {"unevenness": np.ptp(speed) / 50.0, "fastest": speed.max(), "max_crank_acceleration": change.max()}
    poses = sweep.evaluate("cam_lever", lever | {"flywheel": flywheel}, ["crank_acceleration"], phi=phi)
    # each pose by its own balance of torques: the trapezoids leave 1e-8; the series alone was up to 3e-3 off at kinks
    np.testing.assert_allclose(poses.crank_acceleration, change, atol=2e-7 * np.abs(change).max())
    found = sweep.summarise("cam_lever", lever | {"flywheel": flywheel}, list(exact), accuracy=1e-6).iloc[0]
    assert found.status == st.OK
    for name, value in exact.items():
        assert abs(found[name] - value) <= found[f"err_{name}"] + 1e-8 * value, name
    assert found.err_max_crank_acceleration < 0.1 * change.max() and found.err_unevenness < 1e-6


REDUCED = ("max", "min", "max_abs", "range", "rms")


@pytest.mark.parametrize("name", ["slider_crank", "rssp", "four_bar"])
def test_extremes_of_an_acceleration_that_jumps_are_those_of_its_poses(name):
    """A series of the turn resolves no jump: half of ordinary slider-cranks had no acceleration with friction."""
    change = "crank_acceleration_friction"
    places = [f"phi_{kind}_{change}" for kind in REDUCED[:3]]
    full = extended(family(name), [change])
    rows = ordinary(full, 6, seed=1)
    table = dict(zip(full.parameter_names, rows.T, strict=True))
    found = sweep.summarise(name, table, [*(f"{kind}_{change}" for kind in REDUCED), *places], accuracy=1e-8)
    turning = np.flatnonzero(~found.status.isin([st.JAMMED, st.NOT_ASSEMBLED, st.NOT_ROTATABLE]))
    assert turning.size > 3 and (found.status[turning] == st.OK).all()
    at = np.concatenate([found[place].to_numpy()[:, None] + [-1e-6, 0.0, 1e-6] for place in places], axis=1)
    for row in turning:
        design = {key: column[row] for key, column in table.items()}
        phi = np.concatenate([2.0 * np.pi * np.arange(4001) / 4001, at[row]])
        poses = sweep.evaluate(name, design, [change], phi=phi)[change].to_numpy()
        size, even = np.abs(poses).max(), poses[:4001]
        exact = (poses.max(), poses.min(), size, np.ptp(poses), np.sqrt(np.mean(even * even)))
        for kind, value in zip(REDUCED, exact, strict=True):
            off = abs(found[f"{kind}_{change}"][row] - value)
            assert off <= found[f"err_{kind}_{change}"][row] + 1e-5 * size
            assert found[f"err_{kind}_{change}"][row] < 1e-2 * size


def turn_by_collocation(table, size):
    """Speed and acceleration on an even odd grid: the balance at each pose, by Newton's method on all at once."""
    phi, k = 2.0 * np.pi * np.arange(size) / size, np.arange(1, size)
    posed = sweep.evaluate("rssr", table, ["reduced_inertia", "dreduced_inertia", "drive_torque"], phi=phi)
    inertia, bent = posed.reduced_inertia.to_numpy() + table["flywheel"], posed.dreduced_inertia.to_numpy()
    speed, line = table["speed"], table["motor_slope"]
    excess = 0.5 * bent * speed**2 - posed.drive_torque.to_numpy()
    column = np.concatenate([[0.0], 0.5 * (-1.0) ** k / np.sin(np.pi * k / size)])  # derivative of a periodic function
    differences = column[(np.arange(size)[:, None] - np.arange(size)) % size]
    energy, torque = np.full(size, 0.5 * inertia.mean() * speed**2), -excess.mean()
    for _ in range(30):
        omega = np.sqrt(2.0 * energy / inertia)
        left = differences @ energy - excess - torque + line * (omega - speed)
        rows = np.column_stack([differences + np.diag(line / (inertia * omega)), -np.ones(size)])
        time = np.append(-1.0 / (inertia * omega**3) / size, 0.0)
        step = np.linalg.solve(np.vstack([rows, time]), -np.append(left, np.mean(1.0 / omega) - 1.0 / speed))
        step *= min(1.0, 0.5 * np.min(energy / np.maximum(-step[:-1], 1e-300)))
        energy, torque = energy + step[:-1], torque + step[-1]
    omega = np.sqrt(2.0 * energy / inertia)
    return omega, (excess + torque - line * (omega - speed) - 0.5 * bent * omega**2) / inertia


def test_a_steep_line_that_bends_the_energy_more_than_the_loads_do_is_resolved():
    """65 poses resolve the loads, not the energy: accelerations were 4e-2 off where 2e-6 was told, speeds 20 errors."""
    table = {"a": 1.12, "b": 4.578, "c": 2.968, "e": 2.758, "f": 0.647, "g": -0.416, "alpha": 0.743, "branch": -1.0,
             "m_crank": 0.074, "com_crank_x": 0.132, "j_crank_zz": 0.492, "m_coupler": 0.0, "m_rocker": 0.0,
             "j_rocker_zz": 5.81, "gravity_y": -17.6, "flywheel": 0.307, "load_torque": -520.0, "speed": 21.4,
             "motor_slope": 130.7}  # fmt: skip
    size = 513
    speed, change = turn_by_collocation(table, size)
    phi = 2.0 * np.pi * np.arange(size) / size
    names = ["crank_speed", "crank_acceleration"]
    posed = sweep.evaluate("rssr", table, names, phi=phi)
    # 257 poses resolve the energy's slope to 1e-9, which the line makes 4e-8 of the torque
    for name, exact in zip(names, (speed, change), strict=True):
        np.testing.assert_allclose(posed[name], exact, rtol=0.0, atol=1e-7 * np.abs(exact).max())
    wanted = ["rms_crank_acceleration", "rms_crank_speed"]
    found = sweep.summarise("rssr", table, [*wanted, "fastest", "slowest", "max_crank_acceleration"], accuracy=1e-8)
    assert found.status[0] == st.OK
    for name, exact in zip(wanted, (change, speed), strict=True):
        assert abs(found[name][0] - np.sqrt(np.mean(exact**2))) < found[f"err_{name}"][0] < 1e-6 * found[name][0]
    for name, samples, mode in (("fastest", speed, 1), ("slowest", speed, -1), ("max_crank_acceleration", change, 1)):
        # the samples' own trigonometric polynomial, on a grid that misses 1e-9 of its peaks
        wave = np.fft.rfft(samples)
        dense = np.fft.irfft(wave, 2**18) * (2**18 / size)
        err = found[f"err_{name}"][0]
        assert abs(found[name][0] - mode * (mode * dense).max()) < err + 1e-8 * np.abs(samples).max()
        assert err < 1e-5 * np.abs(samples).max()
