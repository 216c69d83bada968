"""Laws that the oracle tables do not use: momentum, power, limits.

The tolerance of the balances is that of differentiating 512 samples three times by the Fourier transform: measured
1e-10 of the largest force, 1e-8 asked for.
"""

from __future__ import annotations

import numpy as np
import pytest

import sweep
from kernels import status as st
from tests.reference.momentum import balance, body_momentum, derivative, triads

N = 512
PHI = 2.0 * np.pi * np.arange(N) / N
OMEGA = 500.0
GRAVITY = np.array([300.0, -9810.0, 500.0])
MASSES = {"crank": 2e-4, "coupler": 1.1e-4, "rocker": 3e-4, "slider": 2.5e-4}
CENTRES = {
    "crank": (-3.0, 1.0, 2.0), "coupler": (40.0, 3.0, -2.0), "rocker": (20.0, -4.0, 5.0), "slider": (3.0, 2.0, -1.0),
}  # fmt: skip
TENSORS = {
    "crank": (0.05, 0.004, -0.003, 0.07, 0.005, 0.2),
    "coupler": (0.01, 0.002, 0.001, 0.09, -0.002, 0.08),
    "rocker": (0.2, 0.01, 0.02, 0.15, -0.03, 0.3),
    "slider": (0.1, 0.01, 0.02, 0.15, -0.03, 0.2),
}
RSSR = {"a": 20.0, "b": 95.0, "c": 60.0, "e": 70.0, "f": 12.0, "g": 8.0, "alpha": 1.2}
RSSP = {"a": 20.0, "b": 95.0, "e": 12.0, "f": 15.0, "alpha": 0.4}
AXES = ("xx", "xy", "xz", "yy", "yz", "zz")


def loads(bodies):
    table = {f"gravity_{x}": g for x, g in zip("xyz", GRAVITY, strict=True)} | {"speed": OMEGA}
    for body in bodies:
        table[f"m_{body}"] = MASSES[body]
        table |= {f"com_{body}_{x}": c for x, c in zip("xyz", CENTRES[body], strict=True)}
        table |= {f"j_{body}_{x}": j for x, j in zip(AXES, TENSORS[body], strict=True)}
    return table


def full(tensor):
    xx, xy, xz, yy, yz, zz = tensor
    return np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])


def vector(poses, name):
    return poses[[f"{name}_{axis}" for axis in "xyz"]].to_numpy()


VECTORS = [f"{name}_{axis}" for name in ("force_a", "force_d", "moment_a", "moment_d") for axis in "xyz"]
JOINTS = [f"{axis}_{joint}" for joint in "bc" for axis in "xyz"]


def motion(geometry, follower, branch, finger):
    """Everything the frame does to the linkage, and what momentum asks for, at N poses."""
    family = "rssr" if follower == "rocker" else "rssp"
    load = "load_torque" if follower == "rocker" else "load_force"
    table = geometry | loads(("crank", "coupler", follower)) | {load: -7000.0 if follower == "rocker" else -150.0}
    table |= {"branch": branch, "finger": finger}
    wanted = [*VECTORS, *JOINTS, "drive_torque", "reduced_inertia", "dreduced_inertia"]
    wanted += ["psi", "dpsi"] if follower == "rocker" else ["ds"]
    poses = sweep.evaluate(family, table, wanted, phi=PHI)
    assert (poses["status"] == st.OK).all()
    B, C = (poses[[f"{x}_{joint}" for x in "xyz"]].to_numpy() for joint in "bc")
    sa, ca = np.sin(geometry["alpha"]), np.cos(geometry["alpha"])
    u, A = np.array([0.0, sa, ca]), geometry["f"] * np.array([0.0, sa, ca])
    rho_b = np.stack([np.cos(PHI), ca * np.sin(PHI), -sa * np.sin(PHI)], axis=1)
    if follower == "rocker":
        D = np.array([geometry["e"], 0.0, geometry["g"]])
        rho = (C - D) / geometry["c"]
        k = np.array([0.0, 0.0, 1.0])
        third = np.stack([rho, np.cross(k, rho), np.broadcast_to(k, rho.shape)], axis=1)
        origins = (A, B, np.broadcast_to(D, C.shape))
    else:
        third = np.broadcast_to(np.eye(3), (N, 3, 3))
        origins = (A, B, C)
    frames = triads(B, C, u, (rho_b, np.cross(u, rho_b)), third, branch, finger == 0)
    parts = [
        (body_momentum(o, t, MASSES[b], np.array(CENTRES[b]), full(TENSORS[b]), OMEGA), MASSES[b])
        for o, t, b in zip(origins, frames, ("crank", "coupler", follower), strict=True)
    ]
    return poses, table[load], A, origins[2], parts


@pytest.mark.parametrize("finger", [0.0, 1.0])
@pytest.mark.parametrize("branch", [1.0, -1.0])
@pytest.mark.parametrize(("geometry", "follower"), [(RSSR, "rocker"), (RSSP, "slider")])
def test_frame_reactions_balance_the_momentum(geometry, follower, branch, finger):
    """Force and moment of the frame, weights and the load are the rate of the whole linkage's momentum."""
    poses, load, A, D, parts = motion(geometry, follower, branch, finger)
    force, moment, power = balance(parts, GRAVITY, OMEGA)
    on_a, on_d = vector(poses, "force_a"), vector(poses, "force_d")
    given = on_a + on_d
    turning = vector(poses, "moment_a") + np.cross(A, on_a) + vector(poses, "moment_d") + np.cross(D, on_d)
    if follower == "rocker":
        turning = turning + np.array([0.0, 0.0, load])
        supplied = OMEGA * (poses["drive_torque"] + load * poses["dpsi"])
    else:
        along = np.array([0.0, load, 0.0])
        given, turning = given + along, turning + np.cross(D, along)
        supplied = OMEGA * (poses["drive_torque"] + load * poses["ds"])
        # The guide does no work: it has no force along the slide.
        assert np.abs(on_d[:, 1]).max() < 1e-10 * np.abs(on_d).max()
    scale = np.abs(on_a).max()
    assert np.abs(given - force).max() < 1e-8 * scale
    assert np.abs(turning - moment).max() < 1e-8 * scale * 100.0
    assert np.abs(supplied - power).max() < 1e-8 * np.abs(power).max()


def test_the_balance_notices_a_wrong_reaction():
    """Negative control: one part in a million on one component is seen."""
    poses, _, _, _, parts = motion(RSSR, "rocker", 1.0, 0.0)
    force, _, _ = balance(parts, GRAVITY, OMEGA)
    wrong = vector(poses, "force_a") * np.array([1.0, 1.0 + 1e-6, 1.0]) + vector(poses, "force_d")
    assert np.abs(wrong - force).max() > 1e-8 * np.abs(wrong).max()


@pytest.mark.parametrize(("geometry", "follower"), [(RSSR, "rocker"), (RSSP, "slider")])
def test_reduced_inertia_is_twice_the_energy(geometry, follower):
    poses, _, _, _, parts = motion(geometry, follower, 1.0, 0.0)
    energy = sum(p[2] for p, _ in parts)
    inertia = poses["reduced_inertia"].to_numpy()
    np.testing.assert_allclose(0.5 * inertia * OMEGA**2, energy, rtol=1e-9)
    slope = poses["dreduced_inertia"].to_numpy()
    np.testing.assert_allclose(derivative(inertia), slope, atol=1e-9 * np.abs(slope).max())


FRICTION = {
    "mu_a": 0.05, "mu_b": 0.08, "mu_c": 0.07, "mu_d": 0.05, "radius_a": 8.0, "radius_b": 5.0, "radius_c": 5.0,
    "radius_d": 7.0, "thrust_radius_a": 6.0, "thrust_radius_d": 5.0, "support_a1": -30.0, "support_a2": -60.0,
    "support_d1": -20.0, "support_d2": 30.0,
}  # fmt: skip
RSSR_LOADS = RSSR | loads(("crank", "coupler", "rocker")) | {"load_torque": -7000.0}


def test_drive_work_is_load_work_and_friction_losses():
    """At every pose: drive + load + friction power = rate of energy less the weights' power."""
    wanted = [
        "drive_torque", "drive_torque_friction", "shaft_torque_a", "shaft_torque_d", "ball_couple_b", "ball_couple_c",
        "dpsi", *(f"omega_{x}" for x in "xyz"),
    ]  # fmt: skip
    poses = sweep.evaluate("rssr", RSSR_LOADS | FRICTION | {"x_point": 0.0}, wanted, phi=PHI)
    assert (poses["status"] == st.OK).all()
    rod = OMEGA * vector(poses, "omega")
    u = np.array([0.0, np.sin(RSSR["alpha"]), np.cos(RSSR["alpha"])])
    crank = OMEGA * u
    rocker = OMEGA * np.outer(poses["dpsi"], [0.0, 0.0, 1.0])
    lost = poses["ball_couple_b"] * np.linalg.norm(rod - crank, axis=1)
    lost += poses["ball_couple_c"] * np.linalg.norm(rod - rocker, axis=1)
    lost -= poses["shaft_torque_a"] * OMEGA + poses["shaft_torque_d"] * OMEGA * poses["dpsi"]
    extra = OMEGA * (poses["drive_torque_friction"] - poses["drive_torque"])
    np.testing.assert_allclose(extra, lost, atol=1e-10 * lost.max())
    assert lost.min() > 0.0
    # Over the turn the energy comes back: drive work = work against the load + losses.
    work = OMEGA * (poses["drive_torque_friction"].mean() - 7000.0 * poses["dpsi"].mean())
    assert work == pytest.approx(lost.mean(), rel=1e-9)


def test_without_friction_the_friction_effect_is_kinetostatics():
    plain = [f"{name}{tail}" for name in ("force_a", "force_b", "force_c", "force_d", "moment_a", "moment_d")
             for tail in ("", "_x", "_y", "_z")] + ["drive_torque", "finger_couple"]  # fmt: skip

    def with_friction(name):
        parts = name.rsplit("_", 1)
        return f"{parts[0]}_friction_{parts[1]}" if parts[1] in "xyz" else f"{name}_friction"

    smooth = FRICTION | {f"mu_{x}": 0.0 for x in "abcd"}
    both = [*plain, *(with_friction(name) for name in plain), "friction_contraction", "friction_passes"]
    poses = sweep.evaluate("rssr", RSSR_LOADS | smooth, both, phi=PHI)
    for name in plain:
        size = np.abs(poses[name]).max()
        np.testing.assert_allclose(poses[with_friction(name)], poses[name], atol=1e-14 * size)
    assert (poses["friction_contraction"] == 0.0).all()
    # And it is no identity: with friction the drive asks for more.
    rough = sweep.evaluate("rssr", RSSR_LOADS | FRICTION, ["drive_torque", "drive_torque_friction"], phi=PHI)
    assert (rough["drive_torque_friction"] > rough["drive_torque"]).all()


def test_a_rigid_coupler_does_not_lag():
    elastic = RSSR | {"driven_inertia": 1.3, "speed": OMEGA, "load_torque": -500.0, "damping": 0.01}
    wanted = ["lag", "lag_dynamic", "elongation_dynamic", "frequency_ratio"]
    sizes = []
    for stiffness in (1e6, 1e8, 1e10):
        poses = sweep.evaluate("rssr", elastic | {"stiffness": stiffness}, wanted, phi=PHI)
        assert (poses["status"] == st.OK).all()
        sizes.append((poses["lag"].abs().max(), (poses["lag_dynamic"] - poses["lag"]).abs().max()))
    # The lag falls with 1/k, what vibration adds with 1/k^2.
    assert sizes[1][0] == pytest.approx(sizes[0][0] / 100.0, rel=1e-12)
    assert sizes[2][0] == pytest.approx(sizes[1][0] / 100.0, rel=1e-12)
    assert sizes[1][1] == pytest.approx(sizes[0][1] / 1e4, rel=0.1)


def test_a_large_flywheel_evens_the_speed_and_the_estimate_is_right():
    """For a heavy flywheel the unevenness falls with 1/J and the small-fluctuation estimate becomes exact."""
    table = {name: np.full(3, x) for name, x in RSSR_LOADS.items()} | {"flywheel": np.array([1e2, 1e3, 1e4])}
    got = sweep.summarise("rssr", table, ["unevenness", "fastest", "slowest", "max_crank_speed"])
    assert (got["status"] == st.OK).all()
    ratio = got["unevenness"].to_numpy()[:-1] / got["unevenness"].to_numpy()[1:]
    assert ratio == pytest.approx(10.0, rel=0.03)
    np.testing.assert_allclose(got["max_crank_speed"], got["fastest"], rtol=1e-12)


@pytest.mark.parametrize(("family", "geometry", "bodies", "along", "friction"), [
    ("rssr", RSSR, ("crank", "coupler", "rocker"), "moment_d{}_z", "shaft_torque_d"),
    ("rssp", RSSP, ("crank", "coupler", "slider"), "force_d{}_y", "slide_friction"),
])  # fmt: skip
def test_follower_bearing_takes_only_friction_where_the_follower_moves(family, geometry, bodies, along, friction):
    table = {**geometry, **loads(bodies), "support_d1": -30.0, "support_d2": 30.0, "support_a1": -30.0}
    table |= {"support_a2": 30.0} | {f"mu_{x}": 0.1 for x in "abcd"}
    table |= {f"radius_{x}": 8.0 for x in ("abcd" if family == "rssr" else "abc")}
    plain, rubbing = along.format(""), along.format("_friction")
    found = sweep.evaluate(family, table, [plain, rubbing, friction], phi=PHI[::16])
    assert (found["status"] == st.OK).all()
    assert (found[plain] == 0.0).all()  # as a difference of all loads it was their rounding
    assert (found[friction].abs() > 0.01).all()
    np.testing.assert_allclose(found[rubbing], found[friction], rtol=4 * 2.0**-53)  # one more sum
