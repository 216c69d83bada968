"""Needle bar at the guided point: plain statics, momentum and virtual power over the turn, both stages, limits.

Tolerances of the balances are those of tests/effects/test_balance.py: differentiating by the Fourier transform.
"""

from __future__ import annotations

import numpy as np
import pytest

import sweep
from kernels import status as st
from kernels.effects.kinetostatics import Loading, kinetostatics
from kernels.effects.tool import ToolLoad, tool_load
from sweep.effects import extended
from sweep.effects.scene import first_scene
from sweep.families import family
from sweep.families.base import Angles
from tests.effects.test_balance import CENTRES, GRAVITY, MASSES, OMEGA, TENSORS, full, loads, vector
from tests.reference.momentum import balance, body_momentum, derivative, triads
from tests.reference.planar_tool import joint_forces

N = 512
PHI = 2.0 * np.pi * np.arange(N) / N
GUIDE = {"a": 11.0, "b": 40.0, "c": 45.0, "e": 38.0, "xi": 75.0, "eta": 12.0, "lam": 1.4, "h": 5.0}
DRIVE = {"a1": 12.0, "b1": 60.0, "c1": 30.0, "e1": 50.0, "f1": 5.0, "g1": 2.0, "alpha1": 1.2}
MASSLESS = {"m_crank": 0.0, "m_coupler": 0.0, "m_rocker": 0.0}
RPM_7000 = 7000.0 * 2.0 * np.pi / 60.0
TOOL = {"m_tool": 2.5e-5, "tool_force": -12.0}
JOINTS = ["x_b", "y_b", "x_c", "y_c", "x_m", "y_m"]
VECTORS = [f"{name}_{axis}" for name in ("force_a", "force_b", "force_c", "force_d", "moment_a", "moment_d")
           for axis in "xyz"]  # fmt: skip


def turn(table, wanted, mechanism="guide"):
    poses = sweep.evaluate(mechanism, table, wanted, phi=PHI)
    assert (poses["status"] == st.OK).all()
    return poses


@pytest.mark.parametrize("branch", [1.0, -1.0])
@pytest.mark.parametrize("finger", [0.0, 1.0])
def test_joint_forces_of_massless_links_under_a_needle_bar_are_those_of_plain_statics(branch, finger):
    table = GUIDE | MASSLESS | TOOL | {"speed": RPM_7000, "branch": branch, "finger": finger}
    poses = turn(table, [*VECTORS, *JOINTS, "d2s", "drive_torque", "tool_load"])
    lam = np.array([np.cos(1.4), np.sin(1.4)])
    for k in range(0, N, 37):
        p = poses.iloc[k]
        force = -(2.5e-5 * p.d2s * RPM_7000**2 + 12.0) * lam
        b, c, m = (np.array([p[f"x_{name}"], p[f"y_{name}"]]) for name in "bcm")
        on_pin, on_rocker, torque = joint_forces(b, c, np.array([38.0, 0.0]), m, force)
        size = np.abs(force).max() * 10.0
        np.testing.assert_allclose([p.force_b_x, p.force_b_y, p.force_b_z], [*on_pin, 0.0], atol=1e-12 * size)
        np.testing.assert_allclose([p.force_c_x, p.force_c_y, p.force_c_z], [*on_rocker, 0.0], atol=1e-12 * size)
        assert p.drive_torque == pytest.approx(torque, abs=1e-11 * size)
        assert p.tool_load == pytest.approx(-force @ lam, rel=1e-13)


def test_needle_bar_of_25_g_at_7000_rpm_needs_some_300_newtons():
    poses = turn(GUIDE | MASSLESS | {"m_tool": 2.5e-5, "speed": RPM_7000}, ["tool_load", "force_d", "d2s"])
    assert 250.0 < poses.tool_load.abs().max() < 350.0
    np.testing.assert_allclose(poses.tool_load, 2.5e-5 * RPM_7000**2 * poses.d2s, rtol=1e-12)
    without = turn(GUIDE | MASSLESS | {"speed": RPM_7000}, ["force_d"])
    assert without.force_d.max() == 0.0


def whole(finger, tool):
    """Reactions of the guide with heavy links, and the momentum of its links."""
    table = GUIDE | loads(("crank", "coupler", "rocker")) | {"load_torque": -7000.0, "finger": finger} | tool
    poses = turn(table, [*VECTORS, *JOINTS, "ds", "d2s", "drive_torque", "reduced_inertia",
                         "dreduced_inertia"])  # fmt: skip
    zero = np.zeros(N)
    b, c = (np.column_stack([poses[f"x_{n}"], poses[f"y_{n}"], zero]) for n in "bc")
    z, d = np.array([0.0, 0.0, 1.0]), np.array([GUIDE["e"], 0.0, 0.0])
    rho_b, rho = b / GUIDE["a"], (c - d) / GUIDE["c"]
    follower = np.stack([rho, np.cross(z, rho), np.broadcast_to(z, rho.shape)], axis=1)
    frames = triads(b, c, z, (rho_b, np.cross(z, rho_b)), follower, 1.0, finger == 0.0)
    origins = (np.zeros(3), b, np.broadcast_to(d, c.shape))
    parts = [
        (body_momentum(o, t, MASSES[n], np.array(CENTRES[n]), full(TENSORS[n]), OMEGA), MASSES[n])
        for o, t, n in zip(origins, frames, ("crank", "coupler", "rocker"), strict=True)
    ]
    dpsi = derivative(np.unwrap(np.arctan2(rho[:, 1], rho[:, 0])))
    return poses, parts, d, dpsi


@pytest.mark.parametrize("finger", [0.0, 1.0])
def test_frame_and_tool_together_balance_the_momentum(finger):
    poses, parts, d, dpsi = whole(finger, TOOL)
    lam = np.array([np.cos(1.4), np.sin(1.4), 0.0])
    # The rod alone: its momentum along the line; what it puts on the coupler is the reverse.
    on_coupler = -(2.5e-5 * (OMEGA**2 * derivative(poses.ds.to_numpy()) - GRAVITY @ lam) + 12.0)[:, None] * lam
    point = np.column_stack([poses.x_m, poses.y_m, np.zeros(N)])
    force, moment, power = balance(parts, GRAVITY, OMEGA)
    on_a, on_d = vector(poses, "force_a"), vector(poses, "force_d")
    turning = vector(poses, "moment_a") + vector(poses, "moment_d") + np.cross(d, on_d) + [0.0, 0.0, -7000.0]
    scale = np.abs(on_a).max()
    assert np.abs(on_a + on_d + on_coupler - force).max() < 1e-8 * scale
    assert np.abs(turning + np.cross(point, on_coupler) - moment).max() < 1e-8 * scale * 100.0
    # Virtual power: of the drive, the load and the tool, which does work along the line only.
    supplied = OMEGA * (poses.drive_torque - 7000.0 * dpsi + on_coupler @ lam * poses.ds)
    assert np.abs(supplied - power).max() < 1e-8 * np.abs(power).max()
    without = whole(finger, {})[0]
    assert np.abs(on_a - vector(without, "force_a")).max() > 0.02 * scale  # negative control: the tool is felt


def test_drive_torque_of_both_stages_is_the_work_of_the_tool():
    chain = DRIVE | {f"{name}2": x for name, x in GUIDE.items()}
    chain |= {f"{name}{k}": 0.0 for name in MASSLESS for k in (1, 2)} | {"speed1": RPM_7000}
    chain |= {f"{name}2": x for name, x in TOOL.items()} | {"gravity_x2": 500.0, "gravity_y2": -9810.0}
    wanted = [
        "ds",
        "d2s",
        "drive_torque1",
        "drive_torque2",
        "dpsi1",
        "reduced_inertia1",
        "dreduced_inertia1",
        "force_d1",
    ]
    poses = turn(chain, wanted, ["rssr", "guide"])
    weight = 2.5e-5 * (500.0 * np.cos(1.4) - 9810.0 * np.sin(1.4))
    # The chain turns the tool: force along the line times its way for a turn of the first crank.
    tool = (2.5e-5 * RPM_7000**2 * poses.d2s - weight + 12.0) * poses.ds
    np.testing.assert_allclose(poses.drive_torque1, tool, atol=1e-10 * tool.abs().max())
    np.testing.assert_allclose(poses.drive_torque2 * poses.dpsi1, tool, atol=1e-10 * tool.abs().max())
    np.testing.assert_allclose(poses.reduced_inertia1, 2.5e-5 * poses.ds**2, atol=1e-17)
    np.testing.assert_allclose(poses.dreduced_inertia1, 5e-5 * poses.ds * poses.d2s, atol=1e-16)
    assert poses.force_d1.max() > 10.0


def test_friction_bearings_and_speed_see_the_tool():
    table = GUIDE | MASSLESS | {"speed": RPM_7000}
    rubbing = {f"mu_{k}": 0.1 for k in "abcd"} | {f"radius_{k}": 5.0 for k in "abcd"}
    rubbing |= {"support_a1": -30.0, "support_a2": -60.0, "support_d1": -20.0, "support_d2": 30.0}
    heavy = turn(table | rubbing | TOOL, ["drive_torque_friction", "drive_torque", "force_b_friction", "force_b"])
    smooth = turn(table | rubbing | TOOL | {f"mu_{k}": 0.0 for k in "abcd"}, ["drive_torque_friction"])
    np.testing.assert_allclose(smooth.drive_torque_friction, heavy.drive_torque, rtol=1e-12, atol=1e-9)
    assert heavy.drive_torque_friction.mean() > heavy.drive_torque.mean() + 10.0
    catalogue = {"dynamic_capacity": 6000.0, "radial_factor": 0.56, "axial_factor": 1.5, "e_limit": 0.3}
    life = [
        sweep.summarise("guide", table | rubbing | catalogue | {"m_tool": m}, ["life_d1"], accuracy=1e-6).life_d1[0]
        for m in (1e-5, 2e-5)
    ]
    # Without any other mass the loads grow with the tool, the life falls with the third power.
    assert life[0] / life[1] == pytest.approx(8.0, rel=1e-9)


def test_crank_with_a_needle_bar_alone_runs_as_its_energy_says():
    # A constant drive, no load: E is constant, omega = sqrt(2 E/J) with J = flywheel + m s'^2.
    table = GUIDE | MASSLESS | {"speed": 500.0, "m_tool": 2.5e-5, "flywheel": 0.002}
    poses = turn(table, ["crank_speed", "ds"])
    inertia = 0.002 + 2.5e-5 * poses.ds**2
    np.testing.assert_allclose(
        poses.crank_speed**2 * inertia / (poses.crank_speed[0] ** 2 * inertia[0]), 1.0, rtol=1e-8
    )
    uneven = sweep.summarise("guide", table, ["unevenness"], accuracy=1e-6)
    assert uneven.unevenness[0] == pytest.approx(np.ptp(poses.crank_speed) / 500.0, rel=1e-3)
    assert uneven.unevenness[0] > 0.1


def test_piercing_force_acts_from_entry_to_the_turning_point_and_not_on_the_way_back():
    table = GUIDE | MASSLESS | {"speed": 500.0}
    motion = turn(table, ["s", "ds", "tool_load"])
    middle = float(motion.s.mean())
    for sense in (1.0, -1.0):
        pierced = {"pierce_force": 7.0, "pierce_at": middle, "pierce_sense": sense}
        poses = turn(table | pierced, ["tool_load", "drive_torque", "force_b"])
        inside = (sense * (motion.s - middle) > 0.0) & (sense * motion.ds > 0.0)
        assert 0.15 < inside.mean() < 0.35
        np.testing.assert_array_equal(poses.tool_load, np.where(inside, sense * 7.0, 0.0))
        # The drive gives the work of piercing: force times the way from entry to the turning point.
        depth = sense * (motion.s * sense).max() - middle
        work = poses.drive_torque.mean() * 2.0 * np.pi
        assert work == pytest.approx(7.0 * sense * depth, rel=2e-2)  # a jump on 512 samples
        assert ((poses.force_b > 0.0) == inside).all()


def test_only_families_that_carry_a_tool_take_one():
    taken = {name: {p.name for p in extended(family(name), ["force_b"]).parameters}
             for name in ("kim_dison", "guide", "four_bar", "rssr")}  # fmt: skip
    assert taken["kim_dison"].isdisjoint([*TOOL, "pierce_force", "tool_x"])
    assert {"m_tool", "tool_force", "pierce_force"} <= taken["guide"] and "tool_force_x" not in taken["guide"]
    assert {"m_tool", "tool_force_x"} <= taken["four_bar"] and taken["four_bar"].isdisjoint({"tool_force", "tool_x"})
    assert {"m_tool", "tool_force_x", "tool_x"} <= taken["rssr"] and "pierce_force" not in taken["rssr"]
    chain = {p.name for p in extended(family(["rssr", "guide"]), ["force_b1"]).parameters}
    assert {"m_tool2", "tool_force2", "m_tool1", "tool_x1"} <= chain
    assert chain.isdisjoint({"tool_force1", "tool_x2"})


def test_tool_of_no_mass_and_force_changes_no_bit():
    table = GUIDE | loads(("crank", "coupler", "rocker"))
    one, two = (turn(table | tool, [*VECTORS, "drive_torque"]) for tool in ({}, {"m_tool": 0.0, "tool_force": 0.0}))
    np.testing.assert_array_equal(one, two)


def test_compiled_tool_equals_plain_python_bit_for_bit():
    full_family = extended(family("guide"), ["tool_load", "force_b"])
    given = {p.name: np.array([(GUIDE | MASSLESS | TOOL | {"speed": 500.0}).get(p.name, p.default)])
             for p in full_family.parameters}  # fmt: skip
    designs = np.column_stack([given[name] for name in family("guide").parameter_names]).astype(float)
    scene = first_scene(
        family("guide"), designs, Angles.of(PHI[None, :40:8]), {k: v.astype(float) for k, v in given.items()}
    )
    data = np.array([[2.5e-5, 75.0, 12.0, 0.0, 0.0, -9810.0, 0.0, 0.2, 0.9, 0.0, 3.0, 50.0, -1.0]])
    drive, force = np.array([[[0.0, 500.0, 30.0]]]), np.array([[[-12.0]]])
    results = []
    for function, loads_of in ((tool_load, kinetostatics), (tool_load.py_func, kinetostatics.py_func)):
        out = [np.empty((1, 5, k)) for k in (6, 2, 2)]
        forces, status = np.empty((1, 5, 18)), scene.status()
        function(*scene.records, data, drive, force, np.zeros(1), False, status, ToolLoad(*out))
        given = Loading(np.linspace(0.1, 0.7, 33)[None] * 1e-4, drive, out[0])
        loads_of(*scene.records, np.zeros(1), given, status, forces, None, None)
        results.append([status, *out, forces])
    for compiled, plain in zip(*results, strict=True):
        np.testing.assert_array_equal(compiled, plain)
