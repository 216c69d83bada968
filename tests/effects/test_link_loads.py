"""Loads of the loopers: each body's momentum, virtual power over the turn, friction, chains, negative controls.

The momenta come from public poses alone (tests/reference/linked.py), differentiated by the Fourier transform: exact to
rounding of the highest harmonic, N/2 * 2^-53 of the largest value and the square of that for accelerations.
"""

from __future__ import annotations

import numpy as np
import pytest

import sweep
from kernels import status as st
from sweep.effects import extended
from sweep.families import family
from sweep.families.link_tree import LinkTree
from tests.reference.linked import POSES, READERS, Z
from tests.reference.momentum import body_momentum, derivative

N = 256
PHI = 2.0 * np.pi * np.arange(N) / N
OMEGA = 30.0
GRAVITY = np.array([900.0, -9810.0, 400.0])
FORCE = np.array([3000.0, -5000.0, 2000.0])
NEAR = 1e-9  # of the largest force; seen 4e-12
DESIGNS = {
    "five_link": {"tool_x": 3.0, "tool_y": 0.7, "tool_z": -0.4},
    "slotted fork": {"g": 0.3, "tool_x": 3.0, "tool_y": 0.7, "tool_z": -0.4},
    "slotted bar": {"k": 1.8, "tau": -1.0, "tool_x": 3.0, "tool_y": 0.7, "tool_z": -0.4},
    "swivel": {},
    "spherical_looper": {},
    "cylindrical_looper sliding": {},
    "cylindrical_looper held": {"slides": 0.0},
    "cylindrical_looper beside": {"d2": 0.4, "beta2": 0.3, "gamma2": 0.7},
}
TIPS = {
    "swivel": lambda d: [d["Lw"], 0.0, 0.0],
    "spherical_looper": lambda d: [d["p0x"], d["p0y"], d["p0z"]],
    "cylindrical_looper": lambda d: [d["p0x"], d["p0y"], d["p0z"]],
}


def design(case):
    name = case.split()[0]
    own = {p.name: p.default for p in family(name).parameters if p.default is not None}
    return name, own | dict(family(name).example) | DESIGNS[case]


def masses(name, seed=3):
    """Bodies without any symmetry, their inputs and (mass, centre, tensor) by name; all of the size of the links."""
    rng = np.random.default_rng(seed)
    table, found = {}, {}
    for body in family(name).find(LinkTree).bodies:
        m, centre = rng.uniform(0.5, 2.0), rng.uniform(-0.5, 0.5, 3)
        if body.slender:
            j = rng.uniform(0.2, 0.6)
            centre = np.array([centre[0], 0.0, 0.0])
            table |= {f"m_{body.name}": m, f"com_{body.name}_x": centre[0], f"j_{body.name}": j}
            found[body.name] = (m, centre, np.diag([0.0, j, j]))
            continue
        half = rng.uniform(-0.5, 0.5, (3, 3))
        tensor = half @ half.T + 0.2 * np.eye(3)
        table[f"m_{body.name}"] = m
        table |= {f"com_{body.name}_{x}": centre[k] for k, x in enumerate("xyz")}
        pairs = ("xx", "xy", "xz", "yy", "yz", "zz")
        table |= {f"j_{body.name}_{p}": tensor["xyz".index(p[0]), "xyz".index(p[1])] for p in pairs}
        found[body.name] = (m, centre, tensor)
    return table, found


TOOL = {"m_tool": 0.8} | {f"tool_force_{x}": FORCE[k] for k, x in enumerate("xyz")}
WEIGHT = {f"gravity_{x}": GRAVITY[k] for k, x in enumerate("xyz")}


def vectors(name, suffix=""):
    tree = family(name).find(LinkTree)
    found = [f"force_{j.name}{suffix}_{x}" for j in tree.joints for x in "xyz"]
    return found + [f"moment_{j.name}{suffix}_{x}" for j in tree.joints if j.kind in ("shaft", "sleeve") for x in "xyz"]


def vector(poses, name):
    if f"{name}_x" not in poses:
        return np.zeros((len(poses), 3))
    return poses[[f"{name}_{x}" for x in "xyz"]].to_numpy()


def tool_from_axis(name, d):
    """Place of the tool in the axes of its body; inputs of the output link count from z = 0, that body from z = g."""
    return np.array(TIPS[name](d) if name in TIPS else [d["tool_x"], d["tool_y"], d["tool_z"] - d["g"]])


def needed(case, poses, d, load=0.0):
    """What each body needs of its joints: force, moment about the origin; and the power that all need together."""
    name = case.split()[0]
    bodies, joints, carrier, axes = READERS[name](d, poses)
    _, given = masses(name)
    tip = tool_from_axis(name, d)
    found, power = {}, 0.0
    for body, (origin, triad) in bodies.items():
        origin = np.broadcast_to(origin, (N, 3))
        parts = [(body_momentum(origin, triad, *given[body], OMEGA), given[body][0], 0.0)]
        if body == carrier:
            parts.append((body_momentum(origin, triad, 0.8, tip, np.zeros((3, 3)), OMEGA), 0.8, FORCE))
        force, moment = np.zeros((N, 3)), np.zeros((N, 3))
        for (linear, angular, energy, place), mass, applied in parts:
            outside = mass * GRAVITY + applied
            force += OMEGA * derivative(linear) - outside
            moment += OMEGA * derivative(angular) - np.cross(place, outside)
            power = power + OMEGA * derivative(energy) - OMEGA * derivative(place) @ outside
        if body == carrier and load:
            moment = moment - load * Z
            power = power - load * OMEGA * poses["dpsi"].to_numpy()
        found[body] = (force, moment)
    return found, joints, axes, power


def of_joints(poses, body, joints, suffix=""):
    """Force and moment about the origin that all joints of a body put on it."""
    force, moment = np.zeros((N, 3)), np.zeros((N, 3))
    for joint, (place, on, by) in joints.items():
        sign = 1.0 if body == on else -1.0 if body == by else 0.0
        force += sign * vector(poses, f"force_{joint}{suffix}")
        moment += sign * vector(poses, f"moment_{joint}{suffix}")
        moment += sign * np.cross(np.broadcast_to(place, (N, 3)), vector(poses, f"force_{joint}{suffix}"))
    return force, moment


def turn(case, extra=None, wanted=(), drop=()):
    name, d = design(case)
    table = {k: v for k, v in d.items() if k not in drop} | masses(name)[0] | TOOL | WEIGHT | {"speed": OMEGA}
    poses = sweep.evaluate(name, table | (extra or {}), [*POSES[name], *wanted], phi=PHI)
    assert (poses["status"] == st.OK).all()
    return name, d, poses


@pytest.mark.parametrize(
    ("name", "unit"),
    [("cam", "force"), ("guided_cam", "force"), ("heddle", "force"), ("cam_lever", "torque"), ("slotted", "torque"),
     ("geared_dwell", "torque"), ("epicyclic_dwell", "torque"), ("inverted_slider_crank", "torque")],
)  # fmt: skip
def test_the_useful_load_of_an_output_link_is_a_force_where_that_slides_and_a_torque_where_it_turns(name, unit):
    bare = family(name)
    rate, load = bare.derivative_of[bare.position], f"load_{unit}"
    (own,) = (p for p in extended(bare, ["drive_torque"]).parameters if p.name.startswith("load_"))
    assert (own.name, own.unit) == (load, unit)
    row = {p.name: p.default for p in bare.parameters if p.default is not None} | dict(bare.example) | {"speed": -OMEGA}
    idle, loaded = (sweep.evaluate(name, row | {load: x}, ["drive_torque", rate], phi=PHI) for x in (0.0, 700.0))
    power = 700.0 * idle[rate]
    np.testing.assert_allclose(idle.drive_torque - loaded.drive_torque, power, atol=1e-12 * np.abs(power).max())


@pytest.mark.parametrize("name", ["geared_dwell", "epicyclic_dwell"])
def test_loads_of_a_planet_of_any_radius_are_those_of_1_mm_brought_to_its_size(name):
    """A length counts R times, a force too where masses and times stay, a torque R^2 times, a pressure 1/R times."""
    radius, shape = 12.0, dict(family(name).example)
    own = {"m_carrier": 1e-4, "m_planet": 2e-4, "com_planet_x": 3.0, "j_planet_zz": 2e-3, "m_link": 1e-4}
    own |= {"m_tool": 1e-5, "tool_x": 40.0, "tool_force_y": -2.0, "gravity_y": -9810.0, "load_torque": 50.0}
    own |= {"speed": 300.0, "flywheel": 0.5}
    own |= {"contact_radius_b": 2.0, "contact_length_b": 5.0, "contact_modulus": 1e5}
    powers = {"com_planet_x": 1, "j_planet_zz": 2, "tool_x": 1, "tool_force_y": 1, "gravity_y": 1, "load_torque": 2}
    powers |= {"flywheel": 2, "contact_radius_b": 1, "contact_length_b": 1, "contact_modulus": -1}
    small = {key: value / radius ** powers.get(key, 0) for key, value in own.items()}
    of = {"force_b": 1, "force_teeth": 1, "shaking_force": 1, "drive_torque": 2, "reduced_inertia": 2, "crank_speed": 0}
    of |= {"sliding_b": 1, "stress_b": -1}
    sized = sweep.evaluate(name, shape | own | {"planet_radius": radius}, list(of), phi=PHI)
    of_one = sweep.evaluate(name, shape | small, list(of), phi=PHI)
    for output, power in of.items():
        expected = of_one[output] * radius**power
        np.testing.assert_allclose(sized[output], expected, atol=1e-12 * np.abs(expected).max(), err_msg=output)
    still = {"load_torque": 700.0, "planet_radius": radius, "speed": 1.0}
    poses = sweep.evaluate(name, shape | still, ["force_b", "x_b", "y_b"], phi=PHI)
    np.testing.assert_allclose(poses.force_b * radius * np.hypot(poses.x_b, poses.y_b), 700.0, rtol=1e-12)


@pytest.mark.parametrize("case", DESIGNS)
def test_joints_of_every_body_balance_its_momentum(case):
    load = -4000.0 if family(case.split()[0]).find(LinkTree).output >= 0 and "looper" not in case else 0.0
    wanted = [*vectors(case.split()[0]), "drive_torque", *(["dpsi"] if load else [])]
    _, d, poses = turn(case, {"load_torque": load} if load else {}, wanted)
    found, joints, axes, power = needed(case, poses, d, load)
    scale = max(np.abs(force).max() for force, _ in found.values())
    for body, (force, moment) in found.items():
        on_force, on_moment = of_joints(poses, body, joints)
        assert np.abs(on_force - force).max() < NEAR * scale, body
        # about the axis of a slender rod nothing is said, nor anything put on it
        assert np.abs(on_moment - moment).max() < NEAR * 5.0 * scale, body
    for joint, axis in axes.items():  # a joint bears nothing about the axis that it turns about
        about = (vector(poses, f"moment_{joint}") * axis).sum(axis=1)
        assert np.abs(about).max() < NEAR * 5.0 * scale, joint
    assert np.abs(OMEGA * poses["drive_torque"] - power).max() < NEAR * np.abs(power).max()


@pytest.mark.parametrize("case", DESIGNS)
def test_reduced_inertia_is_the_kinetic_energy_and_the_tool_does_its_work(case):
    wanted = ["reduced_inertia", "dreduced_inertia", "tool_torque", "tool_load_x", "tool_load_y", "tool_load_z"]
    name, d, poses = turn(case, None, wanted)
    bodies, _, carrier, _ = READERS[name](d, poses)
    given = masses(name)[1]
    tip = tool_from_axis(name, d)
    energy = 0.0
    for body, (origin, triad) in bodies.items():
        origin = np.broadcast_to(origin, (N, 3))
        energy = energy + body_momentum(origin, triad, *given[body], OMEGA)[2]
        if body == carrier:
            linear, _, more, place = body_momentum(origin, triad, 0.8, tip, np.zeros((3, 3)), OMEGA)
            energy = energy + more
            on_tool = OMEGA * derivative(linear) - 0.8 * GRAVITY - FORCE
            if name in TIPS:
                np.testing.assert_allclose(place, poses[["x_p", "y_p", "z_p"]], atol=1e-13)
    inertia = poses["reduced_inertia"].to_numpy()
    np.testing.assert_allclose(0.5 * OMEGA**2 * inertia, energy, rtol=1e-10)
    slope = derivative(inertia)
    assert np.abs(poses["dreduced_inertia"] - slope).max() < NEAR * np.abs(slope).max()
    assert np.abs(vector(poses, "tool_load") - on_tool).max() < NEAR * np.abs(on_tool).max()
    work = (on_tool * derivative(place)).sum(axis=1)
    assert np.abs(poses["tool_torque"] - work).max() < NEAR * np.abs(work).max()


def rubbing(name, mu=0.1):
    table = {}
    for joint in family(name).find(LinkTree).joints:
        table |= {f"mu_{joint.name}": mu, f"radius_{joint.name}": 0.1}
        if joint.kind in ("shaft", "sleeve"):
            table |= {f"support_{joint.name}1": -0.4, f"support_{joint.name}2": 0.5}
        if joint.kind == "shaft":
            table[f"thrust_radius_{joint.name}"] = 0.15
    return table


@pytest.mark.parametrize("case", DESIGNS)
def test_what_the_drive_gives_more_with_friction_is_what_the_joints_lose(case):
    name = case.split()[0]
    lost = [f"lost_torque_{j.name}" for j in family(name).find(LinkTree).joints]
    mu = 0.02 if "bar" in case else 0.1
    wanted = ["drive_torque", "drive_torque_friction", *lost, *vectors(name, "_friction")]
    name, d, poses = turn(case, rubbing(name, mu), wanted)
    extra = poses["drive_torque_friction"] - poses["drive_torque"]
    whole = poses[lost].sum(axis=1)
    np.testing.assert_allclose(extra, whole, atol=1e-12 * np.abs(poses["drive_torque"]).max())
    assert (poses[lost] >= -1e-12 * np.abs(whole).max()).all().all()
    assert (poses[lost].max() > 0.0).sum() >= len(lost) - 2  # key and hold of a sliding rocker rub nowhere
    # every body but a rod about its own axis is in balance with what rubs
    found, joints, _, _ = needed(case, poses, d)
    scale = max(np.abs(force).max() for force, _ in found.values())
    for body, (force, _) in found.items():
        assert np.abs(of_joints(poses, body, joints, "_friction")[0] - force).max() < NEAR * scale, body


@pytest.mark.parametrize("case", DESIGNS)
def test_without_coefficients_friction_changes_nothing_and_steep_ones_jam(case):
    name = case.split()[0]
    wanted = ["drive_torque", "drive_torque_friction", "friction_passes"]
    _, _, poses = turn(case, rubbing(name, 0.0), wanted)
    size = np.abs(poses["drive_torque"]).max()
    np.testing.assert_allclose(poses["drive_torque_friction"], poses["drive_torque"], atol=1e-13 * size)
    assert (poses["friction_passes"] == 1.0).all()
    table = design(case)[1] | masses(name)[0] | TOOL | {"speed": OMEGA} | rubbing(name, 9.0)
    steep = sweep.evaluate(name, table, wanted, phi=PHI[::8])
    assert st.JAMMED in set(steep["status"])
    assert steep["drive_torque_friction"].isna().equals(steep["status"] != st.OK)


def test_a_collar_rubs_where_the_friction_radius_of_its_shaft_is_zero():
    """Friction is continuous as the radius goes to 0: the collar's share was lost at 0 itself."""
    names = ["lost_torque_a", "lost_torque_d", "drive_torque_friction"]
    both = [turn("five_link", rubbing("five_link") | {"radius_a": x, "radius_d": x}, names)[2] for x in (0.0, 1e-9)]
    for name in names:
        np.testing.assert_allclose(both[0][name], both[1][name], atol=1e-7 * np.abs(both[1][name]).max())
    assert both[0]["lost_torque_a"].min() > 0.0


def test_the_block_of_a_fork_rubs_along_the_slot_and_along_the_driven_axis():
    """The block slides by rho' along the slot and by the ball's height; friction opposes both, with the joint's load.

    The height comes from public poses and the Fourier transform, as in the other tests, so 1e-12 of the loss.
    """
    names = ["lost_torque_c", "load_support_c1", "load_support_c2", "drho", "z_b"]
    _, _, poses = turn("slotted fork", rubbing("slotted", 0.05) | {"radius_c": 0.0}, names)
    along, height = poses["drho"].to_numpy(), derivative(poses["z_b"].to_numpy())
    lost = 0.05 * (poses["load_support_c1"] + poses["load_support_c2"]) * np.hypot(along, height)
    np.testing.assert_allclose(poses["lost_torque_c"], lost, atol=1e-12 * lost.max())
    assert np.abs(height).max() > 0.3 * np.abs(along).max()  # of the same size: neither may be left out


def test_a_tenth_of_a_percent_of_the_tool_is_seen():
    _, d, poses = turn("spherical_looper", {"m_tool": 0.8008}, vectors("spherical_looper"))
    found, joints, _, _ = needed("spherical_looper", poses, d)
    scale = max(np.abs(force).max() for force, _ in found.values())
    assert np.abs(of_joints(poses, "looper", joints)[0] - found["looper"][0]).max() > 1e-5 * scale


def test_what_the_frame_bears_is_what_it_gives_its_links():
    _, d, poses = turn("cylindrical_looper held", rubbing("cylindrical_looper"), [
        *vectors("cylindrical_looper"), *(f"shaking_force_{x}" for x in "xyz"), *(f"shaking_moment_{x}" for x in "xyz"),
    ])  # fmt: skip
    _, joints, _, _ = needed("cylindrical_looper held", poses, d)
    force, moment = np.zeros((N, 3)), np.zeros((N, 3))
    for joint, (place, _, by) in joints.items():
        if by is None:
            on = vector(poses, f"force_{joint}")
            force -= on
            moment -= vector(poses, f"moment_{joint}") + np.cross(np.broadcast_to(place, (N, 3)), on)
    scale = np.abs(force).max()
    np.testing.assert_allclose(vector(poses, "shaking_force"), force, atol=1e-12 * scale)
    np.testing.assert_allclose(vector(poses, "shaking_moment"), moment, atol=1e-11 * scale)


@pytest.mark.parametrize(("first", "second"), [("rssr", "swivel"), ("five_link", "swivel"), ("five_link", "guide")])
def test_the_drive_of_a_chain_does_the_work_of_the_tool_behind_it(first, second):
    table = {f"{name}1": x for name, x in family(first).example.items()}
    table |= {f"{name}2": x for name, x in family(second).example.items()} | {"speed1": OMEGA}
    bodies = {p.name: 0.0 for p in sweep.effects.extended(family([first, second]), ["drive_torque1"]).parameters
              if p.name.startswith("m_") and not p.name.startswith("m_tool")}  # fmt: skip
    free = second == "swivel"
    table |= bodies | {"m_tool2": 0.7} | ({"tool_force_x2": -40.0} if free else {"tool_force2": -40.0})
    point = ["x_p", "y_p", "z_p"] if free else ["s"]
    names = ["drive_torque1", "reduced_inertia1", "tool_torque2", "dpsi1", *point]
    poses = sweep.evaluate([first, second], table, names, phi=PHI)
    assert (poses["status"] == st.OK).all()
    speed = np.stack([derivative(poses[name].to_numpy()) for name in point], axis=1)
    inertia = 0.7 * (speed * speed).sum(axis=1)
    work = 0.5 * OMEGA**2 * derivative(inertia) + 40.0 * speed[:, 0]
    np.testing.assert_allclose(poses["reduced_inertia1"], inertia, atol=1e-10 * inertia.max())
    np.testing.assert_allclose(poses["drive_torque1"], work, atol=NEAR * np.abs(work).max())
    np.testing.assert_allclose(poses["tool_torque2"] * poses["dpsi1"], work, atol=NEAR * np.abs(work).max())


def test_a_force_over_the_turn_adds_to_the_constant_one():
    name, d = design("swivel")
    table = d | {"speed": OMEGA, "tool_force_x": 5.0}
    curve = {"tool_force_x": {"mean": 2.0, "cos": [3.0], "sin": [-1.0]}}
    poses = sweep.evaluate(name, table, ["drive_torque", "dx_p"], phi=PHI, loads=curve)
    force = 7.0 + 3.0 * np.cos(PHI) - np.sin(PHI)
    np.testing.assert_allclose(poses["drive_torque"], -force * poses["dx_p"], atol=1e-12)
