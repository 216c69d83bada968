"""Published examples that nobody of this project made and that no test of a family has yet.

Tolerances are half a unit of the last published digit, or what the rounding of the published links leaves.
"""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.optimize import brentq

import sweep
from sweep.evaluation import thread

PLANAR = {"f": 0.0, "g": 0.0, "alpha": 0.0}


# Reference data of the PMKS project, case teaching_four_bar by its MATLAB solver: crank angle from the drawn position,
# coupler point G and its rates, turn of the rocker from the drawn position and its rates.
PMKS_FOUR_BAR = [
    (0.0, (2.053, 3.543), (1.9050987595824984, 1.3544859653932582), (-1.5780211285500994, -1.0767235402100255),
     0.0, -0.53770780682542996, 0.77808194018514543),
    (1.7453292519943318, (1.8879620572814964, 4.361560124167692), (-1.4272622640613082, -0.42686431856603391),
     (-0.3292200691307644, -1.2859504640802606), 0.22613503074842556, 0.53049153707997776, 0.10288099266213648),
    (3.4906585039886444, (0.056140782649201082, 2.7409998535258362), (-0.59509862490047827, -1.0156849852936085),
     (0.76323036323632432, 0.52143158264943679), 0.88657475089552196, 0.12611784062862083, -0.43422175482362413),
    (5.2359877559829542, (0.35189297754121629, 2.2431900455891256), (1.1342877931881619, 0.78764487909457825),
     (1.4481034988299621, 1.7785999622032274), 0.59645151840486643, -0.48774521431427875, -0.43554766716280835),
]  # fmt: skip

# The same data, case slider_crank_tracer: crank angle, slider, then point D of the rod, each with its rates.
PMKS_SLIDER_CRANK = [
    (0.46364760900080609, (12.0, -3.1415926535897931, -6.1685027506808483),
     (20.0, 2.0, -2.0943951023931953, -4.1887902047863923, -8.7729816898572075, 1.0966227112321505)),
    (2.5580427113939974, (4.137396646368126, -1.3566572798942553, 2.8075471059099684),
     (12.240603983436188, 1.5290620826134944, -2.1160335900327989, 4.0242863634371657, 0.40201258304606657,
      1.7795300209423424)),
    (4.6524378137871683, (6.6654335872603916, 4.4941329688803071, 3.4297322464736126),
     (10.682370573982309, 7.2016815567411383, 4.202679111995387, 0.16256644624169875, 8.5004309453102813,
      -2.8437872725497142)),
]  # fmt: skip

# Cremasco Coelho, Mech. Mach. Theory 2025, 106163, as its MATLAB file has it: RSSR in MSC ADAMS without friction.
# Crank angle [deg], angle of the driven arm [rad], torque on the crank per torque of the driven arm, force of the
# coupler per torque on the crank [1/mm].
ADAMS_RSSR = [
    (0.0, 1.71, 1.16, 6.77e-3),
    (-10.0, 1.53, 0.893, 7.47e-3),
    (-20.0, 1.39, 0.683, 8.81e-3),
    (-30.0, 1.29, 0.502, 1.13e-2),
    (-90.0, 1.28, -0.483, -1.16e-2),
    (-120.0, 1.63, -0.791, -6.99e-3),
]


# IFToMM benchmark of the spatial slider-crank, solution of Masarati by MBDyn: turn of the crank, place of the slider.
MBDYN_RSSP = [
    (0.5600213536265, 0.2267867),
    (1.287191842519, 0.2630368),
    (3.063028402641, 0.2821285),
    (4.404676961283, 0.2230848),
    (5.574337284775, 0.1849586),
    (8.060717629202, 0.2807141),
]


def test_crank_rocker_of_goessner_swings_80_degrees_in_nine_tenths_of_the_return() -> None:
    # Published: crank 60 and frame 120, swing 80 deg, ratio 10/9; coupler 103, rocker 94, transmission angle 35 deg.
    links = {"a": 60.0, "b": 103.197, "c": 93.965, "e": 120.0, "branch": -1.0} | PLANAR
    found = sweep.summarise("rssr", links, ["swing", "phi0", "stroke_ratio", "max_pressure_angle"], accuracy=1e-10)
    # The links have six digits: 1e-3 deg and 1e-4 of the ratio are left.
    assert math.degrees(abs(found["swing"][0])) == pytest.approx(80.0, abs=1e-3)
    # Mirrored, the linkage takes 170.53 deg of the crank where the published one takes 189.47.
    angle = math.degrees(found["phi0"][0])
    assert max(angle, 360.0 - angle) == pytest.approx(189.4737, abs=1e-3)
    assert max(found["stroke_ratio"][0], 1.0 / found["stroke_ratio"][0]) == pytest.approx(10.0 / 9.0, rel=1e-4)
    assert 90.0 - math.degrees(found["max_pressure_angle"][0]) == pytest.approx(35.038, abs=1e-3)
    assert (round(links["b"]), round(links["c"])) == (103, 94)


def test_crank_rocker_of_goessner_lies_on_the_locus_of_its_requirement() -> None:
    phi0 = math.radians(360.0 * 10.0 / 19.0)
    phi1 = np.radians(np.arange(0.0, 360.0, 0.02))
    table = {"swing": math.radians(80.0), "phi0": phi0, "phi1": phi1, "e": 120.0} | PLANAR
    found = sweep.synthesise("rssr", table)
    found = found[found["status"] == 0]
    near = found.iloc[(found["a"] - 60.0).abs().argmin()]
    # A step of 0.02 deg on the locus moves links of some 100 by some 0.05.
    assert near["a"] == pytest.approx(60.0, abs=0.05)
    assert near["b"] == pytest.approx(103.197, abs=0.1) and near["c"] == pytest.approx(93.965, abs=0.1)


@pytest.mark.parametrize(("swing", "mu"), [(40.0, 50.0), (60.0, 40.0), (25.0, 62.0)])
def test_central_crank_rocker_has_the_swing_and_transmission_of_its_closed_form(swing: float, mu: float) -> None:
    # Brodell and Soni: frame 1, equal times, from swing and least transmission angle.
    square = math.cos(math.radians(mu)) ** 2
    b = math.sqrt((1.0 - math.cos(math.radians(swing))) / (2.0 * square))
    c = math.sqrt((1.0 - b * b) / (1.0 - b * b * square))
    links = {"a": math.sqrt(b * b + c * c - 1.0), "b": b, "c": c, "e": 1.0} | PLANAR
    found = sweep.summarise("rssr", links, ["swing", "phi0", "max_pressure_angle"], accuracy=1e-10)
    # Some ten roundings of the links.
    assert math.degrees(abs(found["swing"][0])) == pytest.approx(swing, rel=1e-13)
    assert math.degrees(found["phi0"][0]) == pytest.approx(180.0, rel=1e-13)
    assert 90.0 - math.degrees(found["max_pressure_angle"][0]) == pytest.approx(mu, rel=1e-13)


@pytest.mark.parametrize(("ratio", "mu"), [(14.0, 0.280012679), (19.0, 0.312414679)])
def test_rope_of_one_and_a_half_turns_has_the_published_friction(ratio: float, mu: float) -> None:
    found = thread.capstan({"T1": 1.0, "wrap": 3.0 * math.pi, "mu": mu})
    # Nine digits of mu over 9.4 rad.
    assert found["T2"][0] == pytest.approx(ratio, rel=3.0 * math.pi * 0.5e-9 * 1.1)


def test_bell_crank_of_the_six_bar_needle_drive_swings_by_the_cosine_rule() -> None:
    # Between crank and coupler in line and folded; 94.099 deg.
    a, b, c, e = 47.5, 105.0, 67.5, math.hypot(30.0, 120.0)
    ends = [math.acos((c * c + e * e - far**2) / (2.0 * c * e)) for far in (b + a, b - a)]
    for branch in (1.0, -1.0):
        design = {"a": a, "b": b, "c": c, "e": e, "branch": branch} | PLANAR
        found = sweep.summarise("rssr", design, ["swing"], accuracy=1e-10)
        assert abs(found["swing"][0]) == pytest.approx(ends[0] - ends[1], rel=1e-14)  # some ten roundings


def test_sine_of_the_needle_stroke_has_the_published_peaks() -> None:
    # 24.5 mm at 7000 per minute: 8.98 m/s and 6582 m/s^2, the limit of a rod that is long beside the crank.
    omega = 7000.0 * math.pi / 30.0
    found = sweep.summarise(
        "slider_crank", {"a": 12.25, "b": 1e7}, ["stroke", "max_abs_ds", "max_abs_d2s"], accuracy=1e-9
    )
    assert found["stroke"][0] == pytest.approx(24.5, rel=1e-6)
    assert found["max_abs_ds"][0] * omega / 1e3 == pytest.approx(8.98, abs=0.005)
    assert found["max_abs_d2s"][0] * omega**2 / 1e3 == pytest.approx(6582.0, abs=0.5)


@pytest.mark.parametrize(("turn", "place", "velocity", "acceleration", "psi", "omega", "alpha"), PMKS_FOUR_BAR)
def test_four_bar_moves_as_in_the_reference_data_of_pmks(
    turn: float,
    place: tuple[float, float],
    velocity: tuple[float, float],
    acceleration: tuple[float, float],
    psi: float,
    omega: float,
    alpha: float,
) -> None:
    drawn = sweep.from_points(
        "four_bar", A=[0, 0, 0], B=[1.52, 0, 0], C=[4.23, 3.029, 0], D=[4.572, 0, 0], M=[2.053, 3.543, 0]
    )
    design = drawn.parameters | {"branch": drawn.branch}
    want = "psi, dpsi, d2psi, x_m, y_m, dx_m, dy_m, d2x_m, d2y_m"
    found = sweep.evaluate("four_bar", design, want, phi=[0.0, turn]).iloc[1]
    speed = 10.31 * math.pi / 30.0
    # Both programs carry float64; lengths of 4 and pressure angles below 60 deg cost them some ten roundings.
    near = {"abs": 1e-13, "rel": 0.0}
    assert found["psi"] - math.atan2(3.029, 4.23 - 4.572) == pytest.approx(psi, **near)
    assert found["dpsi"] * speed == pytest.approx(omega, **near)
    assert found["d2psi"] * speed**2 == pytest.approx(alpha, **near)
    for order, (prefix, expected) in enumerate(zip(("", "d", "d2"), (place, velocity, acceleration), strict=True)):
        got = [found[f"{prefix}{axis}_m"] * speed**order for axis in "xy"]
        assert got == pytest.approx(expected, **near)


@pytest.mark.parametrize(("phi", "slider", "tracer"), PMKS_SLIDER_CRANK)
def test_slider_crank_and_point_of_its_rod_move_as_in_the_reference_data_of_pmks(
    phi: float, slider: tuple[float, ...], tracer: tuple[float, ...]
) -> None:
    # Crank pin (4, 2), slider pin (12, 0), point D of the rod (20, 2); 10 rev/min.
    along, across = np.array([8.0, -2.0]) / math.sqrt(68.0), np.array([2.0, 8.0]) / math.sqrt(68.0)
    design = {"a": math.sqrt(20.0), "b": math.sqrt(68.0), "x_point": 16.0 * along[0], "y_point": 16.0 * across[0]}
    want = "s, ds, d2s, x_p, y_p, dx_p, dy_p, d2x_p, d2y_p"
    found = sweep.evaluate("slider_crank", design, want, phi=phi).iloc[0].to_numpy()[2:-1]
    speed = (math.pi / 3.0) ** np.array([0, 1, 2, 0, 0, 1, 1, 2, 2])
    # Float64 of both programs, lengths of 20.
    np.testing.assert_allclose(found * speed, [*slider, *tracer], rtol=0.0, atol=2e-13)


@pytest.mark.parametrize(("turn", "psi", "torque", "force"), ADAMS_RSSR)
def test_spatial_crank_rocker_turns_and_carries_as_in_adams(
    turn: float, psi: float, torque: float, force: float
) -> None:
    # The arms lean: A and D are the feet of the balls on their axes. The first is at rest in the drawn position.
    crank, frame = (
        201.6318 * np.array([-0.379646, 0.400777, 0.833815]),
        403.1627 * np.array([0.524328, 0.835662, -0.163552]),
    )
    axis = np.array([0.009243, -0.951003, 0.309043]) / np.linalg.norm([0.009243, -0.951003, 0.309043])
    lean, start = math.radians(7.294), 1.7072908360923371  # closes the loop at the coupler of 350 mm
    arm = 201.6318 * math.cos(lean) * np.array([0.0, math.cos(start), math.sin(start)])
    foot = frame - [201.6318 * math.sin(lean), 0.0, 0.0]
    drawn = sweep.from_points(
        "rssr", A=axis * (axis @ crank), axis_A=axis, B=crank, C=foot + arm, D=foot, axis_D=[1.0, 0.0, 0.0]
    )
    assert drawn.parameters["b"] == pytest.approx(350.0, abs=1e-9)
    design = drawn.parameters | {"branch": drawn.branch, "speed": -1.0, "load_torque": -1.0}
    design |= {"m_crank": 0.0, "m_coupler": 0.0, "m_rocker": 0.0}
    phi = [drawn.phi, drawn.phi + math.radians(turn)]
    found = sweep.evaluate("rssr", design, "psi, drive_torque, force_b", phi=phi)
    # The stored angles and ratios have three digits.
    assert start + found["psi"][1] - found["psi"][0] == pytest.approx(psi, abs=5e-3)
    assert found["drive_torque"][1] == pytest.approx(torque, rel=6e-3)
    assert found["force_b"][1] / found["drive_torque"][1] == pytest.approx(force, rel=6e-3)


def test_quick_return_of_marghitu_and_dupac_has_the_printed_velocities_and_accelerations() -> None:
    # Advanced Dynamics, examples 5.3 at 60 deg and 5.5, 5.6 at 200 deg and 700 rev/min; lengths in m, X turned round.
    design = {"a1": 0.15, "e1": 0.3, "a2": 0.2, "b2": 0.14, "e2": 0.25, "offset2": -math.pi / 2.0}
    want = "psi1, dpsi1, d2psi1, s, ds, d2s, ds1, d2s1, omega_z2, eps_z2"
    found = sweep.evaluate("inverted_slider_crank+slider_crank", design, want, phi=np.radians([-120.0, 20.0]))
    speed = 700.0 * math.pi / 30.0
    # Half a unit of the last printed digit.
    np.testing.assert_allclose(found["s"], [0.0605, 0.188], atol=5e-4)
    last = found.iloc[1]
    assert math.degrees(found["psi1"][0]) + 180.0 == pytest.approx(19.1, abs=0.05)
    assert math.degrees(last["psi1"]) - 180.0 == pytest.approx(-17.878, abs=5e-4)
    assert last["dpsi1"] * speed == pytest.approx(-51.934, abs=5e-4)
    assert last["d2psi1"] * speed**2 == pytest.approx(7157.347, abs=5e-4)
    assert last["ds"] * speed == pytest.approx(8.383, abs=5e-4)
    assert last["d2s"] * speed**2 == pytest.approx(-1660.866, abs=5e-4)
    # The block in its slot, which the book counts towards the pivot, and the coupler of the second dyad.
    assert last["ds1"] * speed == pytest.approx(6.751, abs=5e-4)
    assert last["d2s1"] * speed**2 == pytest.approx(1086.945, abs=5e-4)
    assert last["omega_z2"] * speed == pytest.approx(25.176, abs=5e-4)
    assert last["eps_z2"] * speed**2 == pytest.approx(882.339, abs=5e-4)


def test_hookes_joint_of_bevan_has_the_printed_speeds() -> None:
    # Theory of Machines, page 138: 1000 rev/min, shafts at 20 deg: 111.4 and 98.4 rad/s, at most 1370 rad/s^2.  His
    # place of the latter is approximate, cos 2t = 2 k/(2 - k) with k = sin^2 20 deg: 41.43 deg, exactly 41.46.
    joint = {"a": 1.0, "b": math.sqrt(2.0), "c": 1.0, "e": 0.0, "f": 0.0, "g": 0.0, "alpha": math.radians(20.0)}
    want = "max_dpsi, min_dpsi, max_abs_d2psi, phi_max_abs_d2psi"
    found = sweep.summarise("rssr", joint, want, accuracy=1e-10).iloc[0]
    speed = 1000.0 * math.pi / 30.0
    assert found["max_dpsi"] * speed == pytest.approx(111.4, abs=0.05)
    assert found["min_dpsi"] * speed == pytest.approx(98.4, abs=0.05)
    assert found["max_abs_d2psi"] * speed**2 == pytest.approx(1370.0, abs=0.5)
    k = math.sin(joint["alpha"]) ** 2
    double = (math.hypot(2.0 - k, math.sqrt(8.0) * k) - (2.0 - k)) / (2.0 * k)  # the root of the derivative
    assert -math.cos(2.0 * found["phi_max_abs_d2psi"]) == pytest.approx(double, abs=1e-9)


def test_linkages_of_meriam_and_kraige_have_the_printed_speeds() -> None:
    # Dynamics, sample problems 5/8 and 5/14: the vector equations have these fractions as solutions.
    drawn = sweep.from_points("four_bar", A=[250, 50, 0], B=[175, 50, 0], C=[0, 100, 0], D=[0, 0, 0])
    design = drawn.parameters | {"branch": drawn.branch}
    found = sweep.evaluate("four_bar", design, "dpsi, omega_z, d2psi, eps_z", phi=drawn.phi).iloc[0]
    assert 2.0 * found["omega_z"] == pytest.approx(-6.0 / 7.0, rel=1e-14)
    assert 2.0 * found["dpsi"] == pytest.approx(-3.0 / 7.0, rel=1e-14)
    turn = -900.0 / (49.0 * 175.0)  # -18.37 = -36.7 - 175 alpha of AB
    assert 4.0 * found["eps_z"] == pytest.approx(turn, rel=1e-13)
    assert 4.0 * found["d2psi"] == pytest.approx((50.0 * turn - 300.0 - 6300.0 / 49.0) / 100.0, rel=1e-13)
    # 5/9: crank 5 in, rod 14 in, mass centre 4 in from the crank pin, 1500 rev/min, crank at 60 deg: 64.1 ft/s.
    rod = sweep.evaluate("slider_crank", {"a": 5.0, "b": 14.0, "x_point": 4.0}, "dx_p, dy_p", phi=math.pi / 3.0)
    assert math.hypot(rod["dx_p"][0], rod["dy_p"][0]) * 50.0 * math.pi / 12.0 == pytest.approx(64.1, abs=0.05)


def test_belt_of_bevan_transmits_the_printed_power() -> None:
    # Theory of Machines, page 228: 165 deg of wrap, mu = 0.3, 500 lb in both sides at rest, 60 ft/s: 44.40 hp.
    ratio = thread.capstan({"T1": 1.0, "wrap": "165 deg", "mu": 0.3})["T2"][0]
    assert 2.0 * 500.0 * (ratio - 1.0) / (ratio + 1.0) * 60.0 / 550.0 == pytest.approx(44.40, abs=0.005)


@pytest.mark.parametrize(("turn", "place"), MBDYN_RSSP)
def test_spatial_slider_crank_moves_as_in_mbdyn(turn: float, place: float) -> None:
    points = {"A": [0.0, 0.1, 0.12], "B": [0.0, 0.1, 0.2], "C": [0.2, 0.0, 0.0], "D": [0.0, 0.0, 0.0]}
    drawn = sweep.from_points("rssp", **points, axis_A=[1.0, 0.0, 0.0], axis_D=[1.0, 0.0, 0.0])
    design = drawn.parameters | {"branch": drawn.branch}
    found = sweep.evaluate("rssp", design, "s", phi=drawn.phi + turn)
    # Half a unit of the last digit, and as much for the constraints that MBDyn integrates.
    assert found["s"][0] == pytest.approx(place, abs=1e-7)


def test_coupler_point_is_where_solvespace_puts_it() -> None:
    # Its own test: crank 35 at 45 deg, coupler 70 with arms of 40 to the point, rocker 70, frame 90.
    design = {"a": 35.0, "b": 70.0, "c": 70.0, "e": 90.0, "xi": 35.0, "eta": math.sqrt(375.0), "branch": -1}
    found = sweep.evaluate("four_bar", design, "x_m, y_m", phi="45 deg").iloc[0]
    assert (found["x_m"], found["y_m"]) == pytest.approx((39.54852, 61.91009), abs=1e-5)  # cut, not rounded


def test_slider_is_fastest_where_the_cubic_of_zhang_and_li_says() -> None:
    # J. Mech. Des. 128 (2006), 654: with k = b/a, sin^2 phi is a root of u^3 - k^2 u^2 - k^4 u + k^4 = 0.  For k = 3
    # encyclopaedias print 73.17615 deg; the root is 73.17530 deg.
    for k in (3.0, 4.5):
        found = sweep.summarise("slider_crank", {"a": 2.0, "b": 2.0 * k}, "phi_max_abs_ds", accuracy=1e-12)
        square = math.sin(found["phi_max_abs_ds"][0]) ** 2
        (root,) = (u.real for u in np.roots([1.0, -(k**2), -(k**4), k**4]) if 0.0 < u.real < 1.0)
        assert square == pytest.approx(root, rel=1e-11)  # a place is flat to the root of the value's accuracy


def test_shedding_linkages_have_the_printed_coupler_points() -> None:
    # Advanced Textile Technology (China) 2024, 6: crank, coupler and rocker 1 : 2 : 2, the coupler point as far from
    # the rocker pin as the crank pin is.  Where crank and frame are in line its path is straight to third order (frame
    # 2.76, angle at the crank pin 62.49 deg, found by drawing), or curved by equal radii (2.3, 49.15 deg, computed).
    def curvatures(frame: float, degrees: float) -> np.ndarray:
        x, y = math.cos(math.radians(degrees)), math.sin(math.radians(degrees))
        design = {"a": 1.0, "b": 2.0, "c": 2.0, "e": frame, "xi": 4.0 * x * x, "eta": 4.0 * x * y, "branch": -1}
        path = sweep.evaluate("four_bar", design, "dx_m, dy_m, d2x_m, d2y_m", phi=[0.0, math.pi])
        turn = path["dx_m"] * path["d2y_m"] - path["dy_m"] * path["d2x_m"]
        return np.asarray(turn / np.hypot(path["dx_m"], path["dy_m"]) ** 3)

    # 0.1 deg of the drawing moves the curvature of the two places by 3e-3.
    assert np.abs(curvatures(2.76, 62.49)).max() < 3e-3
    equal = brentq(lambda degrees: curvatures(2.3, degrees).sum(), 45.0, 55.0)
    assert equal == pytest.approx(49.15, abs=0.005)
