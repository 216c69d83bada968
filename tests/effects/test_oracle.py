"""Every effect against its 25-digit table.

Tolerances: 16 * 2^-53 * max(sens, |y|) for pressure angles and reactions, a quarter of what their sheet allows (the
sensitivity is tabulated per row; couples also carry 2^-53 * b * |R_B|).  Friction rows have no sensitivity: the same
linear solve is iterated, so they get 16 units of the largest force of the pose.  Bearings are a dozen operations:
16 units.  The elastic steady state is a linear system of 121 unknowns with condition ~1e4: 1e-10.
"""

from __future__ import annotations

import math

import mpmath as mp
import numpy as np
import pytest

from kernels import status as st
from kernels.effects import bearings, elasticity, friction, kinetostatics, permissible, pressure, speed_fluctuation
from kernels.effects.coupler import DRIVEN, DRIVING, CouplerMotion, coupler_point
from sweep.families import family
from sweep.families.base import Angles
from tests.support.oracle_rows import factor, geometry, joint_records, rows

CONSTRUCTIONS = {"driven": DRIVEN, "driving": DRIVING}


FRICTION = ("mu_A", "mu_B", "mu_C", "mu_D", "r_A", "r_B", "r_C", "r_D", "rt_A", "rt_D", "zA1", "zA2", "zD1", "zD2")
VECTORS = ("R_A", "R_B", "R_C", "R_D", "M_A", "M_D")


def scene_of(table, construction):
    """Arguments of the load kernels, status last: records, finger, what loads the links; and geometry records."""
    designs, phi = geometry([row["inputs"] for row in table])
    poses, fixed, status = joint_records(designs, phi)
    bodies = np.array([body_columns(row["inputs"]) for row in table])
    drive = np.array([[[row["inputs"][name] for name in ("M_load", "omega", "epsilon")]] for row in table])
    finger = np.full(len(table), CONSTRUCTIONS[construction])
    return [poses, fixed, finger, kinetostatics.Loading(bodies, drive)], status, fixed


def body_columns(inputs):
    columns = []
    for body in "123":
        j = inputs[f"J{body}"]
        columns += [inputs[f"m{body}"], *inputs[f"com{body}"], j[0][0], j[0][1], j[0][2], j[1][1], j[1][2], j[2][2]]
    return [*columns, *inputs["gravity"]]


def in_bearing_axes(got, i, designs):
    """M_A along X and e2, M_D along X and Y: the components the tables give."""
    u = designs[i, :3]
    got["M_A"] = np.array([got["M_A"][0], got["M_A"] @ np.array([0.0, u[2], -u[1]])])
    got["M_D"] = got["M_D"][:2]


@pytest.mark.parametrize("construction", CONSTRUCTIONS)
def test_reactions_equal_oracle(construction):
    table = [r for r in rows("kinetostatics") if r["inputs"]["construction"] == construction]
    scene, status, fixed = scene_of(table, construction)
    forces, couples = np.empty((*status.shape, 18)), np.empty((*status.shape, 2))
    kinetostatics.kinetostatics(*scene, status, forces, couples, None)
    assert (status == st.OK).all()
    assert len(table) > 30
    for i, row in enumerate(table):
        got = dict(zip(VECTORS, forces[i, 0].reshape(6, 3), strict=True))
        got |= {"m_finger": couples[i, 0, 0], "M_drive": couples[i, 0, 1]}
        in_bearing_axes(got, i, fixed)
        size_b = mp.norm([mp.mpf(x) for x in row["expected"]["R_B"]])
        for name, sens in row["sens"].items():
            scale = mp.mpf(sens) + (row["inputs"]["b"] * size_b if name in ("M_A", "M_D", "m_finger") else 0)
            assert factor(got[name], row["expected"][name], scale) < 16, (i, row["case"], name)


def test_reduced_inertia_equals_oracle():
    """No sensitivity is tabulated for J: on the regular rows it is a sum of a dozen products of exact data."""
    table = [r for r in rows("kinetostatics", case="regular") if r["inputs"]["construction"] == "driven"]
    scene, status, _ = scene_of(table, "driven")
    inertia = np.empty((*status.shape, 2))
    kinetostatics.kinetostatics(*scene, status, None, None, inertia)
    j_red, dj_red = inertia[:, :, 0], inertia[:, :, 1]
    for i, row in enumerate(table):
        assert float(j_red[i, 0]) == pytest.approx(float(row["expected"]["J_red"]), rel=1e-12)
        size = max(abs(float(row["expected"]["dJ_red"])), float(row["expected"]["J_red"]))
        assert float(dj_red[i, 0]) == pytest.approx(float(row["expected"]["dJ_red"]), abs=1e-11 * size)


@pytest.mark.parametrize("construction", CONSTRUCTIONS)
def test_friction_equals_oracle(construction):
    table = [r for r in rows("friction") if r["inputs"]["construction"] == construction]
    scene, status, fixed = scene_of(table, construction)
    data = np.array([[r["inputs"]["friction"][name] for name in FRICTION] for r in table])
    forces, couples, losses = (np.empty((*status.shape, size)) for size in (18, 2, 9))
    contraction = np.empty(status.shape)
    friction.friction_loads(*scene, data, status, forces, couples, losses, contraction)
    assert (status == st.OK).all()
    assert losses[:, :, 8].max() < friction.PASSES
    # The bound is one: no observed rate exceeds it, and it is not idle (sheet 2.1: rate/bound between 0.1 and 0.98).
    rates = np.array([float(r["expected"]["contraction_rate"]) for r in table])
    assert (rates <= contraction[:, 0] * (1 + 1e-6)).all()
    assert (rates >= 0.05 * contraction[:, 0]).all()
    for i, row in enumerate(table):
        expected = row["expected"] | {
            # The kernel gives the size of these two couples; their direction is that of the relative speed.
            name: str(mp.norm([mp.mpf(x) for x in row["expected"][name]]))
            for name in ("T_fric_B", "T_fric_C")
        }
        got = dict(zip(VECTORS, forces[i, 0].reshape(6, 3), strict=True))
        got |= {"m_finger": couples[i, 0, 0], "M_drive": couples[i, 0, 1]}
        names = ("T_fric_A", "T_fric_D", "T_fric_B", "T_fric_C", "F_A1", "F_A2", "F_D1", "F_D2")
        got |= dict(zip(names, losses[i, 0], strict=False))
        in_bearing_axes(got, i, fixed)
        force = max(mp.norm([mp.mpf(x) for x in row["expected"][name]]) for name in ("R_A", "R_B", "R_C", "R_D"))
        for name, values in got.items():
            couple = name[0] in "MT" or name == "m_finger"
            scale = force * (row["inputs"]["b"] if couple else 1)
            assert factor(values, expected[name], scale) < 16, (i, row["case"], name)


def test_friction_reports_a_jam_instead_of_the_last_iterate():
    """Close to a dead point with a large coefficient the iteration diverges: status, and nan in every result."""
    row = rows("friction", case="regular")[0]
    scene, status, _ = scene_of([row], "driven")
    data = np.array([[row["inputs"]["friction"][name] for name in FRICTION]])
    data[0, 3], data[0, 7] = 3.0, 2.0 * row["inputs"]["c"]
    couples = np.empty((*status.shape, 2))
    friction.friction_loads(*scene, data, status, None, couples, None, None)
    assert status[0, 0] == st.JAMMED
    assert np.isnan(couples).all()


def test_coupler_point_equals_oracle():
    for construction, code in CONSTRUCTIONS.items():
        table = [r for r in rows("coupler") if r["construction"] == construction]
        designs, phi = geometry(table)
        poses, fixed, status = joint_records(designs, phi)
        point = np.array([[r["x"], r["y"], r["z"]] for r in table])
        out = {name: np.empty((*status.shape, 3)) for name in ("P", "dP", "ddP")}
        coupler_point(poses, fixed, point, np.full(len(table), code), status, CouplerMotion(*out.values()))
        assert len(table) > 40
        for i, row in enumerate(table):
            assert status[i, 0] == st.OK, row["kind"]
            scale = mp.mpf(0)
            for name, values in out.items():
                # The tolerance of order n takes the largest condition of the lower orders (theory section 12).
                scale = max(scale, *(mp.mpf(c) for c in row["cond"][name]), *(abs(mp.mpf(x)) for x in row[name]))
                assert factor(values[i, 0], row[name], scale) < 16, (i, row["kind"], name)


def test_euler_angles_of_the_coupler_equal_oracle():
    for construction, code in CONSTRUCTIONS.items():
        table = [r for r in rows("coupler") if r["construction"] == construction]
        designs, phi = geometry(table)
        poses, fixed, status = joint_records(designs, phi)
        euler, n = np.empty((*status.shape, 2)), np.empty((*status.shape, 3))
        nothing = np.zeros((len(table), 3))
        coupler_point(poses, fixed, nothing, np.full(len(table), code), status, CouplerMotion(n=n, euler=euler))
        for i, row in enumerate(table):
            # The table gives no condition for the angles: that of the point, over its distance from the pin, stands
            # for it; close to a dead point, and where coupler and finger axis nearly meet, it is large.
            arm = max(abs(row[x]) for x in ("x", "y", "z"))
            size = 1.0 + max(mp.mpf(c) for c in row["cond"]["P"]) / arm
            for k, name in enumerate(("Theta", "Phi")):
                off = float(mp.mpf(euler[i, 0, k]) - mp.mpf(row[name]))
                off = math.remainder(off, 2.0 * math.pi)
                assert abs(off) < 16 * 2.0**-53 * float(size), (i, row["kind"], construction, name, off)


def test_pressure_directions_equal_oracle():
    table = rows("pressure", kind="rssr")
    designs, phi = geometry([r["inputs"] for r in table])
    poses, fixed, status = joint_records(designs, phi)
    names = ("t_tau", "t_rho", "t_k", "theta1", "theta2", "theta3")
    out = {name: np.empty(status.shape) for name in names}
    pressure.directions(poses, fixed, status, *out.values())
    theta = family("rssr").poses(designs, Angles.of(phi[:, None]), frozenset({"pressure_angle"}))["pressure_angle"]
    out["theta"] = theta
    for i, row in enumerate(table):
        assert status[i, 0] == st.OK
        for name, sens in row["sens"].items():
            if name in out:
                got, expected = float(out[name][i, 0]), float(row["expected"][name])
                if name in ("theta2", "theta3"):  # a tangent's angle: +pi/2 and -pi/2 are the same direction
                    got += np.pi * round((expected - got) / np.pi)
                assert factor(got, row["expected"][name], sens) < 16, (i, row["case"], name)


def test_sliding_bearings_equal_oracle():
    for row in rows("bearings", kind="sliding"):
        given, expected = row["inputs"], row["expected"]
        data = np.array([[given[name] for name in bearings.Sliding._fields]])
        sine = np.sin(given["theta1"])
        direction = [np.array([[x]]) for x in (np.cos(given["theta1"]), sine, sine * np.tan(given["theta2"]))]
        status = np.zeros((1, 1), np.uint8)
        values = np.empty((6, 1, 1))
        bearings.sliding_bearings(*direction, np.array([given["M_c"]]), data, status, values)
        out = dict(zip(("R1", "R2", "X", "p1", "p2", "p3"), values, strict=True))
        assert status[0, 0] == st.OK
        for name, values in out.items():
            assert factor(values[0], expected[name], 0) < 16, (row["case"], name)


def test_permissible_pressure_angle_equals_oracle():
    """A direction with the table's axial angle; its radial angle does not enter what is permissible."""
    for row in rows("bearings", kind="permissible_theta1"):
        given = row["inputs"]
        data = np.array([[given[name] for name in bearings.Sliding._fields]])
        limits = np.array([[given["p1_adm"], given["p2_adm"], given["p3_adm"]]])
        components = np.array([[1.0]]), np.array([[1.0]]), np.array([[np.tan(given["theta2"])]])
        theta1, reserve, status = np.empty((1, 1)), np.empty((1, 1)), np.zeros((1, 1), np.uint8)
        moment = np.array([given["M_c"]])
        permissible.bearing_limits(*components, moment, data, limits, status, None, theta1, reserve)
        assert status[0, 0] == st.OK
        assert factor(theta1[0], row["expected"]["theta1"], 1) < 16
        assert reserve[0, 0] == theta1[0, 0] - np.arctan(1.0)


def test_rolling_bearings_equal_oracle():
    names = ("c", "z1", "z2", "V", "Xf", "Y", "e_lim", "p", "C_dyn", "Kb", "axial_on")
    for row in rows("bearings", kind="rolling"):
        given = row["inputs"]
        data = np.array([[given[name] for name in names]], dtype=float)
        sine = np.sin(given["theta1"])
        direction = [np.array([[x]]) for x in (np.cos(given["theta1"]), sine, sine * np.tan(given["theta2"]))]
        status = np.zeros((1, 1), np.uint8)
        values = np.empty((4, 1, 1))
        bearings.rolling_bearings(*direction, np.array([given["M_c"]]), data, status, values)
        out = dict(zip(("P_eq1", "P_eq2", "L10_1", "L10_2"), values, strict=True))
        for name, values in out.items():
            assert factor(values[0], row["expected"][name], 0) < 16, (row["case"], name)


def elastic_inputs(given, phi):
    designs, _ = geometry([given])
    wanted = frozenset({"d2psi", "discriminant"})
    motion = family("rssr").poses(designs, Angles.of(np.atleast_2d(phi)), wanted)
    return given["sigma"] * np.sqrt(motion["discriminant"]) / (2.0 * given["b"]), motion["d2psi"]


def test_elastic_lag_equals_oracle():
    for row in rows("elasticity", kind="coupler_elasticity"):
        given, expected = row["inputs"], row["expected"]
        data = np.array([[given["J"], given["k"], given["h"], given["omega"], given["M0"]]])
        c, phi = np.array([given["c"]]), np.array([given["phi"]])
        p, d2psi = elastic_inputs(given, phi)
        status = np.zeros(p.shape, np.uint8)
        lag, ratio = np.empty(p.shape), np.empty(p.shape)
        elasticity.quasi_static(p, d2psi, c, np.ones(1), data, status, lag, None, ratio)
        np.testing.assert_allclose(lag[0], np.array(expected["eta_quasistatic"], float), rtol=1e-13)
        np.testing.assert_allclose(ratio[0], np.array(expected["frequency_ratio"], float), rtol=1e-14)

        grid = 2.0 * np.pi * np.arange(121) / 121
        p, d2psi = elastic_inputs(given, grid)
        found = elasticity.Steady(np.empty(1, np.uint8), np.empty(phi.shape), np.empty(phi.shape), np.empty(1))
        inertia, stiffness, damping, omega, moment = data[0]
        slope = np.fft.irfft(1j * np.arange(61) * np.fft.rfft(p * p), n=121)
        mass, rubbing = inertia * omega * omega, damping * omega
        factors = rubbing * p * p, stiffness * p * p + 0.5 * rubbing * slope, moment - mass * d2psi
        elasticity.steady_state(p, *(x / mass for x in factors), c, np.ones(1), phi, True, found)
        assert found.status[0] in (st.OK, st.NOT_LINEAR)
        dynamic = np.array(expected["eta_dynamic"], float)
        np.testing.assert_allclose(found.eta[0], dynamic, atol=1e-10 * abs(dynamic).max())
        np.testing.assert_allclose(found.floquet[0], float(expected["floquet_max"]), atol=6e-7)


def test_speed_fluctuation_equals_oracle():
    grid = 2.0 * np.pi * np.arange(65) / 65
    for row in rows("elasticity", kind="speed_fluctuation"):
        i, expected = row["inputs"], row["expected"]
        inertia = i["J0"] + i["J1"] * np.cos(grid - i["d1"]) + i["J2"] * np.cos(2 * grid - i["d2"])
        excess = i["M1"] * np.cos(grid - i["g1"]) + i["M2"] * np.cos(2 * grid - i["g2"])
        out = {name: np.empty(1) for name in ("delta", "omega_max", "omega_min", "E_const")}
        found = speed_fluctuation.Uneven(*out.values(), np.empty(1), *np.empty((2, 1, grid.size)))
        status = np.empty(1, np.uint8)
        speed_fluctuation.speed_fluctuation(
            inertia[None], excess[None], np.array([i["omega_mean"]]), grid[None], status, found
        )
        assert status[0] == st.OK
        for name, values in out.items():
            # delta is a difference of two speeds: its digits are those of the speeds.
            scale = float(expected["omega_max"]) / i["omega_mean"] if name == "delta" else abs(float(expected[name]))
            assert float(values[0]) == pytest.approx(float(expected[name]), abs=1e-13 * scale)


def test_euler_angles_turn_the_axes_onto_those_of_the_coupler():
    """Rz(psi) Rx(Theta) Rz(Phi) brings z to n, for both assembly modes, through the public functions."""
    import sweep

    design = {"a": 1.0, "b": 3.9, "c": 3.2, "e": 2.9, "f": 0.6, "g": -0.4, "alpha": 0.7, "finger": 0.0}
    for branch in (1.0, -1.0):
        want = ["psi", "euler_theta", "euler_phi", "n_x", "n_y", "n_z", "x_b", "y_b", "z_b", "x_c", "y_c", "z_c"]
        found = sweep.evaluate("rssr", design | {"branch": branch}, want, phi=np.linspace(0.0, 6.0, 9))
        for row in found.itertuples():
            (cp, sp), (ct, sn), (cf, sf) = (
                (math.cos(x), math.sin(x)) for x in (row.psi, row.euler_theta, row.euler_phi)
            )
            z_turn = np.array([[cp, -sp, 0.0], [sp, cp, 0.0], [0.0, 0.0, 1.0]])
            x_turn = np.array([[1.0, 0.0, 0.0], [0.0, ct, -sn], [0.0, sn, ct]])
            turn = z_turn @ x_turn @ np.array([[cf, -sf, 0.0], [sf, cf, 0.0], [0.0, 0.0, 1.0]])
            along = np.array([row.x_c - row.x_b, row.y_c - row.y_b, row.z_c - row.z_b]) / design["b"]
            # A few roundings of numbers of order one, times the inverse sine of the transmission angle.
            np.testing.assert_allclose(turn[:, 0], along, atol=1e-14)
            np.testing.assert_allclose(turn[:, 2], [row.n_x, row.n_y, row.n_z], atol=1e-14)
