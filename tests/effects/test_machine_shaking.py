"""Force and moment of a machine on its frame: the rate of the momentum of its moving masses, weights and loads aside.

The reference (tests/reference/momentum.py) knows joint positions and bodies alone, in the machine's frame; velocities
come from the Fourier transform of 512 samples.  Tolerance 1e-8 of the largest value, as in effects/test_balance.py.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import sweep
from sweep.effects.scene import Scene
from sweep.families import NAMES, family
from sweep.families.base import Angles
from sweep.families.capabilities import JointRecords, Skeleton
from sweep.families.machines.shaking import shaken
from sweep.optimise.manufacture.tolerance import sensitivities
from tests.effects.test_balance import CENTRES, GRAVITY, MASSES, OMEGA, PHI, RSSP, RSSR, TENSORS, N, full, loads
from tests.reference.momentum import balance, body_momentum, triads

TORQUE, PUSH, OFFSET, RATIO = -7000.0, -150.0, 0.7, 2
# x, y and z of each member's frame in the machine's, by hand: quarter turns and a 3-4-5 triangle.
LEFT = np.array([[0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [1.0, 0.0, 0.0]]).T
RIGHT = np.array([[0.6, 0.8, 0.0], [0.8, -0.6, 0.0], [0.0, 0.0, -1.0]]).T
AT_LEFT, AT_RIGHT = np.array([30.0, -50.0, 120.0]), np.array([-200.0, 15.0, 7.0])
PARTS = ("shaking", "shaking_moment")
WANTED = [f"{name}_{axis}" for name in PARTS for axis in "xyz"]


def machine():
    def spot(at, frame):
        return {"at": at.tolist(), "axis": frame[:, 2].tolist(), "zero": frame[:, 0].tolist()}

    members = {
        "left": {"family": "rssr", "place": spot(AT_LEFT, LEFT)},
        "right": {"family": "rssp", "place": spot(AT_RIGHT, RIGHT), "offset": OFFSET, "ratio": RATIO},
    }
    return sweep.machine(members, {"shaking": {"shaking": ["left", "right"]}})


def table():
    rows = {}
    for name, geometry, follower, load, frame, speed in (
        ("left", RSSR, "rocker", {"load_torque": TORQUE}, LEFT, OMEGA),
        ("right", RSSP, "slider", {"load_force": PUSH}, RIGHT, RATIO * OMEGA),
    ):
        own = geometry | loads(("crank", "coupler", follower)) | load | {"branch": 1.0, "finger": 0.0, "speed": speed}
        own |= {f"gravity_{x}": g for x, g in zip("xyz", frame.T @ GRAVITY, strict=True)}
        rows |= {f"{name}.{key}": value for key, value in own.items()}
    return rows


def moving_masses(geometry, follower, phi, B, C, frame, at):
    """Momentum of the three bodies of a member in the machine's frame, and where its follower's load acts."""
    sa, ca = np.sin(geometry["alpha"]), np.cos(geometry["alpha"])
    u = np.array([0.0, sa, ca])
    rho_b = np.stack([np.cos(phi), ca * np.sin(phi), -sa * np.sin(phi)], axis=1)
    tau_b = np.cross(u, rho_b)
    A = at + frame @ (geometry["f"] * u)
    if follower == "rocker":
        D = np.broadcast_to(at + frame @ np.array([geometry["e"], 0.0, geometry["g"]]), C.shape)
        k = np.broadcast_to(frame[:, 2], C.shape)
        rho = (C - D) / geometry["c"]
        third, last = np.stack([rho, np.cross(k, rho), k], axis=1), D
    else:
        third, last = np.broadcast_to(frame.T, (N, 3, 3)), C
    frames = triads(B, C, frame @ u, (rho_b @ frame.T, tau_b @ frame.T), third, 1.0, True)
    return [
        (body_momentum(o, t, MASSES[b], np.array(CENTRES[b]), full(TENSORS[b]), OMEGA), MASSES[b])
        for o, t, b in zip((A, B, last), frames, ("crank", "coupler", follower), strict=True)
    ]


def from_momentum():
    points = [f"{m}.{p}_{axis}" for m in ("left", "right") for p in "bc" for axis in "xyz"]
    where = sweep.evaluate(machine(), table(), points, phi=PHI)

    def point(name):
        return where[[f"{name}_{axis}" for axis in "xyz"]].to_numpy()

    bodies = moving_masses(RSSR, "rocker", PHI, point("left.b"), point("left.c"), LEFT, AT_LEFT)
    turned = RATIO * PHI + OFFSET
    bodies += moving_masses(RSSP, "slider", turned, point("right.b"), point("right.c"), RIGHT, AT_RIGHT)
    force, moment, _ = balance(bodies, GRAVITY, OMEGA)
    push = PUSH * RIGHT[:, 1]
    return -(force - push), -(moment - TORQUE * LEFT[:, 2] - np.cross(point("right.c"), push))


def test_force_and_moment_on_the_frame_are_the_rate_of_momentum_of_all_members():
    found = sweep.evaluate(machine(), table(), [*WANTED, *PARTS], phi=PHI)
    assert (found["status"] == 0).all()
    for name, expected in zip(PARTS, from_momentum(), strict=True):
        given = found[[f"{name}_{axis}" for axis in "xyz"]].to_numpy()
        scale = np.abs(expected).max()
        assert np.abs(given - expected).max() < 1e-8 * scale
        np.testing.assert_allclose(found[name], np.linalg.norm(given, axis=1), rtol=1e-14)


@pytest.mark.parametrize("wrong", ["left.x_at", "right.z_at", "speed", "left.com_coupler_y"])
def test_the_balance_notices_a_wrong_place_speed_or_mass(wrong):
    given = table()
    for name in [name for name in given if name.endswith(".speed")] if wrong == "speed" else [wrong]:
        given[name] = given.get(name, 30.0 if name == "left.x_at" else 7.0) * (1.0 + 1e-5)
    found = sweep.evaluate(machine(), given, WANTED[3:], phi=PHI).to_numpy()[:, -4:-1]
    _, expected = from_momentum()
    assert np.abs(found - expected).max() > 1e-8 * np.abs(expected).max()


def test_moment_of_a_member_alone_is_that_of_its_own_frame_moved_to_the_machines_origin():
    single = sweep.machine(
        {"left": {"family": "rssr", "place": {"at": AT_LEFT.tolist()}}}, {"s": {"shaking": ["left"]}}
    )
    own = {key.removeprefix("left."): x for key, x in table().items() if key.startswith("left.")}
    names = [f"{name}_{axis}" for name in ("s", "s_moment") for axis in "xyz"]
    found = sweep.evaluate(single, {f"left.{key}": x for key, x in own.items()}, names, phi=PHI)
    alone = sweep.evaluate("rssr", own, [f"shaking_moment_{axis}" for axis in "xyz"], phi=PHI)
    force, moment = found[names[:3]].to_numpy(), found[names[3:]].to_numpy()
    expected = alone[[f"shaking_moment_{axis}" for axis in "xyz"]].to_numpy() + np.cross(AT_LEFT, force)
    # Sums of three products: a few roundings of the largest.
    assert np.abs(moment - expected).max() < 16 * 2**-53 * np.abs(expected).max()


def test_shaking_moment_can_be_reduced_limited_and_differentiated():
    found = sweep.summarise(machine(), table(), ["max_shaking_moment", "rms_shaking_moment"], accuracy=1e-9)
    dense = sweep.evaluate(machine(), table(), ["shaking_moment"], phi=PHI)["shaking_moment"]
    assert found["status"][0] == 0
    assert dense.max() <= found["max_shaking_moment"][0] * (1 + 1e-9)
    # 512 samples of a peak: the square of their distance.
    assert found["max_shaking_moment"][0] == pytest.approx(dense.max(), rel=1e-3)
    assert found["rms_shaking_moment"][0] == pytest.approx(np.sqrt(np.mean(dense**2)), rel=1e-9)


@pytest.mark.parametrize("name", ["left.b", "left.x_at", "right.com_slider_x"])
def test_sensitivity_of_the_moment_is_its_difference_quotient(name):
    full_machine = sweep.effects.extended(machine(), ["max_shaking_moment"])
    names = list(full_machine.parameter_names)
    given = {p.name: p.default for p in full_machine.parameters} | table()
    design = np.array([given[one] for one in names], float)
    found = sensitivities(full_machine, design, ["max_shaking_moment"])
    rows = dict(zip(found["parameter"], found["growing"], strict=True))

    def most(shift):
        moved = given | {name: given[name] + shift}
        return sweep.summarise(machine(), moved, ["max_shaking_moment"], accuracy=1e-12)["max_shaking_moment"][0]

    step = 1e-4 * max(abs(given[name]), 1e-3)
    # Central differences of a maximum: the square of the step and 1e-12 of the value over the step.
    assert rows[name] == pytest.approx((most(step) - most(-step)) / (2.0 * step), rel=1e-5)


@pytest.mark.parametrize("name", [n for n in NAMES if family(n).find(JointRecords)])
def test_joint_records_stand_in_the_frame_of_the_family(name):
    """The moment about the origin is made of the records' places; the skeleton and the points are the family's."""
    own, angles = family(name), Angles.of(PHI[None, ::64])
    design = np.array([[own.example.get(p.name, p.default) for p in own.parameters]], float)
    poses, designs = Scene(own, design, angles, {}).records
    skeleton = own.find(Skeleton)
    size = np.abs(design).max()
    np.testing.assert_allclose(designs[:, 6:9], skeleton.fixed["a"].at(design), atol=1e-15 * size)
    if designs[0, 16] == 1.0:
        np.testing.assert_allclose(designs[:, 9:12], skeleton.fixed["d"].at(design), atol=1e-15 * size)
    where = sweep.joints(name, dict(zip(own.parameter_names, design[0], strict=True)), PHI[::64])
    for joint, columns in (("b", slice(0, 3)), ("c", slice(3, 6))):
        rows = where[where["joint"] == joint][["x", "y", "z"]].to_numpy()
        np.testing.assert_allclose(poses[0, :, columns], rows, atol=1e-14 * size)


def test_a_stage_counts_once_and_a_driven_member_no_forces():
    with pytest.raises(sweep.InputError, match="every stage once"):
        sweep.machine({"x": ["rssr", "rssr"]}, {"s": {"shaking": ["x1", "x1"]}})
    with pytest.raises(sweep.InputError, match="For shaking forces, give one stage and its place"):
        sweep.machine({"x": ["kim_dison", "rssr"]}, {"s": {"shaking": ["x2"]}})
    bare = replace(family("feed"), capabilities=())
    with pytest.raises(sweep.InputError, match="whose forces are known; feed has none"):
        shaken("x", "", bare, [])
    driven = sweep.machine({"x": "rssr", "y": {"family": "rssr", "driver": "x.psi"}}, {"s": {"shaking": ["y"]}})
    with pytest.raises(sweep.InputError, match="drives it unevenly"):
        sweep.evaluate(driven, {}, ["s"], phi=PHI)
    chain = sweep.machine({"x": "rssr", "y": {"chain": ["rssr", "guide"], "driver": "x.psi"}})
    for output in ("y.force_b1", "y.max_abs_drive_torque1", "y.shaking_force2", "y.tool_load2", "y.shaking_estimate2"):
        with pytest.raises(sweep.InputError, match="drives it unevenly"):
            sweep.summarise(chain, {}, [output])
