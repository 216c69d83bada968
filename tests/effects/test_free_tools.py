"""Tools that move freely: at a four-bar's coupler point and at the tip of a rocker.

A tool is a point mass with a force, so it must do what the same mass does as a part of its link; a force must do its
virtual work.
"""

from __future__ import annotations

import numpy as np
import pytest

import sweep
from kernels import status as st
from kernels.effects.tool import ToolLoad, tool_load
from sweep.effects import all_inputs
from sweep.effects.scene import first_scene
from sweep.families import family
from sweep.families.base import Angles
from tests.effects.test_balance import FRICTION, loads
from tests.reference.momentum import derivative

N = 256
PHI = 2.0 * np.pi * np.arange(N) / N
OMEGA = 500.0
VECTORS = [f"{name}_{axis}" for name in ("force_a", "force_b", "force_c", "force_d", "moment_a", "moment_d")
           for axis in "xyz"]  # fmt: skip
SCALARS = ["drive_torque", "reduced_inertia", "dreduced_inertia", "finger_couple"]
BODIES = loads(("crank", "coupler", "rocker"))
RSSR = {"a": 20.0, "b": 95.0, "c": 60.0, "e": 70.0, "f": 12.0, "g": 8.0, "alpha": 1.2}
FOUR_BAR = {"a": 20.0, "b": 50.0, "c": 45.0, "e": 40.0, "xi": 70.0, "eta": 9.0}
MASS = 1e-4
TIP = np.array([75.0, -12.0, 8.0])  # from D, as centres of mass; inputs count from z = 0
AT = {"tool_x": TIP[0], "tool_y": TIP[1], "tool_z": TIP[2] + RSSR["g"]}
TOOL = {"m_tool": MASS} | AT
FORCE = {"tool_force_x": -30.0, "tool_force_y": 50.0, "tool_force_z": 9.0}


def turn(name, table, wanted, **more):
    poses = sweep.evaluate(name, table, wanted, phi=PHI, **more)
    assert (poses["status"] == st.OK).all()
    return poses


def heavier(body, at, mass):
    """Bodies with a point mass added to one of them."""
    m = BODIES[f"m_{body}"]
    centre = np.array([BODIES.get(f"com_{body}_{x}", 0.0) for x in "xyz"])
    pairs = ("xx", "xy", "xz", "yy", "yz", "zz")
    tensor = {p: BODIES.get(f"j_{body}_{p}", 0.0) for p in pairs}
    new = (m * centre + mass * at) / (m + mass)
    for part, arm in ((m, centre - new), (mass, at - new)):
        more = part * (arm @ arm * np.eye(3) - np.outer(arm, arm))
        tensor = {p: x + more["xyz".index(p[0]), "xyz".index(p[1])] for p, x in tensor.items()}
    found = BODIES | {f"m_{body}": m + mass} | {f"com_{body}_{x}": new[k] for k, x in enumerate("xyz")}
    return found | {f"j_{body}_{p}": x for p, x in tensor.items()}


@pytest.mark.parametrize(("name", "design", "body", "at", "finger"), [
    ("rssr", RSSR, "rocker", TIP, 0.0),
    ("rssr", RSSR, "rocker", TIP, 1.0),
    ("four_bar", FOUR_BAR, "coupler", np.array([70.0, 9.0, 0.0]), 0.0),
    ("four_bar", FOUR_BAR, "coupler", np.array([70.0, 0.0, 9.0]), 1.0),
])  # fmt: skip
def test_a_tool_without_a_force_loads_the_joints_like_a_point_mass_of_its_link(name, design, body, at, finger):
    """Exact but for rounding, which grows with the mass of the body against that of the tool."""
    wanted = [*VECTORS, *SCALARS]
    if name == "four_bar" and finger == 0.0:
        # The finger at C makes n square to the plane: k x s is the coupler's second axis where n points along k, and
        # its reverse where it does not.  The finger at B makes k x s the third axis.
        normal = turn(name, design | BODIES | {"finger": finger}, ["n_z"])["n_z"].to_numpy()
        assert np.abs(normal[0] - normal).max() < 1e-12
        at = at * np.array([1.0, np.sign(normal[0]), 1.0])
    one = turn(name, design | BODIES | TOOL | {"finger": finger} if name == "rssr" else
               design | BODIES | {"m_tool": MASS, "finger": finger}, wanted)  # fmt: skip
    two = turn(name, design | heavier(body, at, MASS) | {"finger": finger}, wanted)
    force, moment = (max(np.abs(two[c]).max() for c in VECTORS if c.startswith(kind)) for kind in ("force", "moment"))
    for column in wanted:  # what is zero but for rounding is measured by the largest force or moment
        size = force if column.startswith("force") else moment if column.startswith("moment") else 0.0
        size = max(size, np.abs(two[column]).max())
        np.testing.assert_allclose(one[column], two[column], atol=1e-12 * size, rtol=0.0, err_msg=column)


@pytest.mark.parametrize(("name", "design"), [("rssr", RSSR), ("four_bar", FOUR_BAR)])
def test_the_driving_torque_of_a_force_is_its_virtual_work(name, design):
    tool = FORCE | (AT if name == "rssr" else {})
    massless = {f"m_{body}": 0.0 for body in ("crank", "coupler", "rocker")}
    own = "tip" if name == "rssr" else "tool"
    wanted = ["drive_torque", f"{own}_torque", f"{own}_load", "psi", *([] if name == "rssr" else ["x_m", "y_m"])]
    poses = turn(name, design | massless | tool | {"speed": OMEGA}, wanted)
    if name == "rssr":
        psi = poses["psi"].to_numpy()
        place = np.stack([TIP[0] * np.cos(psi) - TIP[1] * np.sin(psi), TIP[0] * np.sin(psi) + TIP[1] * np.cos(psi)], 1)
    else:
        place = poses[["x_m", "y_m"]].to_numpy()
    work = -(derivative(place) @ np.array([FORCE["tool_force_x"], FORCE["tool_force_y"]]))
    size = np.abs(work).max()
    np.testing.assert_allclose(poses["drive_torque"], work, atol=1e-9 * size)
    np.testing.assert_allclose(poses[f"{own}_torque"], work, atol=1e-9 * size)
    np.testing.assert_allclose(poses[f"{own}_load"], np.linalg.norm(list(FORCE.values())), rtol=1e-14)


def test_friction_bearings_and_speed_see_a_tool_at_the_tip():
    table = RSSR | {f"m_{body}": 0.0 for body in ("crank", "coupler", "rocker")} | {"speed": OMEGA} | FRICTION
    heavy = turn("rssr", table | TOOL, ["drive_torque_friction", "drive_torque"])
    assert heavy["drive_torque_friction"].mean() > heavy["drive_torque"].mean() + 10.0
    catalogue = {"dynamic_capacity": 6000.0, "radial_factor": 0.56, "axial_factor": 1.5, "e_limit": 0.3}
    life = [
        sweep.summarise("rssr", table | catalogue | TOOL | {"m_tool": m}, ["life_d1"], accuracy=1e-6).life_d1[0]
        for m in (1e-4, 2e-4)
    ]
    assert life[0] / life[1] == pytest.approx(8.0, rel=1e-8)
    speeds = turn("rssr", table | TOOL | {"flywheel": 1.0}, ["crank_speed", "reduced_inertia"])
    inertia = 1.0 + speeds["reduced_inertia"]
    energy = speeds["crank_speed"] ** 2 * inertia
    np.testing.assert_allclose(energy, energy[0], rtol=1e-8)


def test_a_force_over_the_turn_adds_to_the_constant_one():
    massless = {f"m_{body}": 0.0 for body in ("crank", "coupler", "rocker")} | {"speed": OMEGA}
    curve = {"tool_force_y": {"mean": 2.0, "cos": [3.0]}}
    poses = turn("four_bar", FOUR_BAR | massless, ["drive_torque", "dy_m"], loads=curve)
    force = 2.0 + 3.0 * np.cos(PHI)
    np.testing.assert_allclose(poses["drive_torque"], -force * poses["dy_m"], atol=1e-10)


def test_no_mass_and_no_force_change_no_bit():
    one, two = (turn("rssr", RSSR | BODIES | tool, [*VECTORS, *SCALARS]) for tool in ({}, TOOL | {"m_tool": 0.0}))
    np.testing.assert_array_equal(one, two)


@pytest.mark.parametrize("on_rocker", [True, False])
def test_compiled_free_tool_equals_plain_python_bit_for_bit(on_rocker):
    designs = np.array([[*RSSR.values(), 1.0]])
    scene = first_scene(family("rssr"), designs, Angles.of(PHI[None, :40:8]), {})
    data = np.array([[MASS, *TIP, 3.0, -9810.0, 8.0]])
    drive, force = np.array([[[0.0, 500.0, 30.0]]]), np.array([[[-12.0, 4.0, 7.0]]])
    results = []
    for function in (tool_load, tool_load.py_func):
        out = [np.empty((1, 5, k)) for k in (6, 2, 2)]
        status = scene.status()
        function(*scene.records, data, drive, force, np.zeros(1), on_rocker, status, ToolLoad(*out))
        results.append([status, *out])
    for compiled, plain in zip(*results, strict=True):
        np.testing.assert_array_equal(compiled, plain)


def test_mass_and_tip_stand_at_one_point():
    """A machine's tip and a mass at the same numbers move as one: the mass's momentum is that of the tip."""
    member = {"family": "rssr", "tip": [75.0, -12.0, 4.0]}
    machine = sweep.machine({"x": member}, {"f": {"shaking": ["x"]}})
    massless = {f"m_{body}": 0.0 for body in ("crank", "coupler", "rocker")} | {"speed": OMEGA, "m_tool": MASS}
    design = {"a": 20.0, "b": 95.0, "c": 60.0, "e": 70.0, "f": 12.0, "g": -3.0, "alpha": 1.2}
    design |= massless | {"tool_x": 75.0, "tool_y": -12.0, "tool_z": 4.0}
    names = [f"{what}_{x}" for what in ("x.tip", "f", "f_moment") for x in "xyz"]
    found = sweep.evaluate(machine, {f"x.{key}": x for key, x in design.items()}, names, phi=PHI)
    tip, force, moment = (found[[f"{what}_{x}" for x in "xyz"]].to_numpy() for what in ("x.tip", "f", "f_moment"))
    rate = -MASS * OMEGA**2 * derivative(derivative(tip))
    # 256 samples differentiated twice by the Fourier transform: measured 3e-12
    assert np.abs(force - rate).max() < 1e-10 * np.abs(rate).max()
    turning = np.cross(tip, rate)
    assert np.abs(moment - turning).max() < 1e-10 * np.abs(turning).max()


# Loopers whose crank and output link turn about one axis, so that the link goes round evenly: a mass at its tip pulls
# outwards with m omega^2 r and nothing else acts.
EVEN = {
    "rssr": {"a": 10.0, "b": 734.0**0.5, "c": 25.0},
    "five_link": {"a": 10.0, "b": 730.0**0.5, "c": 25.0, "h": 2.0},
    "slotted": {"a": 10.0},
}


@pytest.mark.parametrize("name", EVEN)
def test_moment_of_a_mass_at_the_tip_is_its_pull_times_its_height_above_zero(name):
    """With g = -3 and a tip at z = 4 the pull acts at 4: 18.0 and 120.7 N mm by hand, 4.5 and 30.2 from z = g."""
    pull = np.array([30.175, 4.5])  # along x and y of the frame [N]
    radius = 30.0
    tool = {"m_tool": np.hypot(*pull) / (radius * OMEGA**2), "tool_x": radius, "tool_y": 0.0, "tool_z": 4.0}
    looper = EVEN[name] | {"e": 0.0, "f": 0.0, "g": -3.0, "alpha": 0.0}
    ahead = sweep.evaluate(name, looper, ["psi"], phi=[0.0])["psi"][0]
    machine = sweep.machine({"x": {"family": name, "tip": [radius, 0.0, 4.0]}}, {"f": {"shaking": ["x"]}})
    bodies = {p.name: 0.0 for p in all_inputs(family(name)).values() if p.name.startswith("m_")}
    table = {f"x.{key}": x for key, x in (bodies | looper | tool | {"speed": OMEGA}).items()}
    names = ["x.tip_z", "f_moment_x", "f_moment_y", "f_moment_z", "f_x", "f_y"]
    found = sweep.evaluate(machine, table, names, phi=[np.arctan2(pull[1], pull[0]) - ahead]).iloc[0]
    assert found["status"] == 0
    assert found["x.tip_z"] == 4.0
    # some forty roundings of terms of the size of the largest
    for one, exact in zip(names[1:], (-18.0, 120.7, 0.0, *pull), strict=True):
        assert abs(found[one] - exact) < 1e-12 * 120.7
