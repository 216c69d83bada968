"""Loads of textbooks and papers: joint forces, friction, flywheels, ball bearings by ISO 281.

Tolerances are half a unit of the last printed digit, or roundings where the loads have a closed form.
"""

from __future__ import annotations

import numpy as np
import pytest

import sweep
from sweep.families import family


def polar(length: float, degrees: float) -> tuple[float, float]:
    """Both components of a vector."""
    return length * np.cos(np.radians(degrees)), length * np.sin(np.radians(degrees))


def test_four_bar_of_norton_has_the_printed_forces_and_torque() -> None:
    """Design of Machinery, example 11-3; inches, pounds and seconds, masses as rounded there."""
    crank, coupler, force = polar(3.0, 30.0), polar(9.0, 45.0), polar(80.0, 330.0)
    point = np.add(coupler, polar(3.0, 100.0))
    design = {"a": 5.0, "b": 15.0, "c": 10.0, "e": 19.0, "branch": -1, "xi": point[0], "eta": point[1]}
    design |= {"speed": 25.0, "speed_change": -40.0, "load_torque": 120.0}
    design |= {"m_crank": 0.004, "m_coupler": 0.020, "m_rocker": 0.015}
    design |= {"j_crank_zz": 0.4, "j_coupler_zz": 1.5, "j_rocker_zz": 0.8, "com_rocker_x": 5.0}
    for (x, y), name in ((crank, "com_crank"), (coupler, "com_coupler"), (force, "tool_force")):
        design |= {f"{name}_x": x, f"{name}_y": y}
    found = sweep.evaluate("four_bar", design, "force_a_x, force_a_y, drive_torque", phi=np.radians(60.0)).iloc[0]
    assert found["force_a_x"] == pytest.approx(-117.65, abs=0.005)
    assert found["force_a_y"] == pytest.approx(-107.84, abs=0.005)
    assert found["drive_torque"] == pytest.approx(243.23, abs=0.005)


def test_quick_return_of_marghitu_and_dupac_has_the_printed_forces_and_torque() -> None:
    """Advanced Dynamics, example 6.1: bars of 10 x 1 mm and blocks of 20 x 50 x 1 mm of steel, 500 N at the slider.

    The crank pivot is above the rocker pivot, so X of stage 1 points down; X of stage 2 is horizontal.  The rod has the
    inertia that the book computes, with the mass of a block.
    """
    bar, block = 8000.0 * 0.01 * 0.001, 8000.0 * 0.02 * 0.05 * 0.001

    def inertia(mass: float, length: float, height: float = 0.01) -> float:
        return mass * (length**2 + height**2) / 12.0

    design = {"a1": 0.2, "e1": 0.4, "a2": 0.7, "b2": 0.3, "e2": 0.75, "branch2": -1}
    design |= {"offset2": -np.pi / 2.0, "turn2": np.pi / 2.0, "speed1": 200.0 * np.pi / 30.0}
    design |= {"m_crank1": 0.2 * bar, "com_crank_x1": 0.1, "j_crank_zz1": inertia(0.2 * bar, 0.2)}
    design |= {"m_rocker1": 0.7 * bar, "com_rocker_x1": 0.35, "j_rocker_zz1": inertia(0.7 * bar, 0.7)}
    design |= {"m_block1": block, "j_block_zz1": inertia(block, 0.02, 0.05), "m_slider2": block, "m_crank2": 0.0}
    design |= {"m_coupler2": 0.3 * bar, "com_coupler_x2": 0.15, "j_coupler_zz2": inertia(block, 0.3)}
    design |= {"gravity_x1": 9.807, "gravity_y2": -9.807, "load_force2": 500.0}
    names = [f"force_{x}" for x in ("a_x1", "a_y1", "b_x1", "b_y1", "c_x1", "c_y1", "d_x1", "d_y1")]
    names += [f"force_{x}" for x in ("a_x2", "a_y2", "b_x2", "b_y2", "c_x2", "c_y2", "d_y2")]
    found = sweep.evaluate(
        "inverted_slider_crank+slider_crank", design, ["drive_torque1", *names], phi=np.radians(135.0)
    ).iloc[0]

    def down(joint: str) -> tuple[float, float]:
        """A force of stage 1 along the horizontal and the vertical of the book."""
        return found[f"force_{joint}_y1"], -found[f"force_{joint}_x1"]

    near = {"abs": 5e-4, "rel": 0.0}
    assert found["drive_torque1"] == pytest.approx(111.518, **near)
    assert down("a") == pytest.approx((-626.106, 162.525), **near)
    assert down("b") == pytest.approx((-625.610, 162.864), **near)
    assert down("c") == pytest.approx((625.114, -163.282), **near)
    assert (found["force_b_x2"], found["force_b_y2"]) == pytest.approx((-500.685, 124.998), **near)
    assert (-found["force_c_x2"], -found["force_c_y2"]) == pytest.approx((500.140, -125.037), **near)
    assert found["force_d_y2"] == pytest.approx(-124.959, **near)
    # Rocker and second crank are one body in the book: its bearing bears what ours bear together.
    together = np.add(down("d"), (found["force_a_x2"], found["force_a_y2"]))
    assert together == pytest.approx((123.647, -38.376), **near)


@pytest.mark.parametrize(
    ("speed", "flywheel", "cos", "sin", "energy", "fastening", "place"),
    [
        # Example 16.11: 3121 kg m^2 keep 180 rev/min within 1 %; 3.044 rad/s^2 at 45 deg.
        (180.0, 3121.0, (0.0, -5700.0), (0.0, 9500.0), 11078.0, 3.044, 45.0),
        # Example 16.12: 80 kg m^2 at 150 rev/min; retardation of 12.2 rad/s^2 at 127.6 deg.  Its largest acceleration,
        # 3.46 at 35 deg, is that of the first half turn alone: the moments are odd, so 12.2 comes back at 232.4 deg.
        (150.0, 80.0, (0.0, 0.0), (-500.0, 600.0), 1204.0, -12.2, 127.6),
        (150.0, 80.0, (0.0, 0.0), (-500.0, 600.0), 1204.0, 12.2, 232.4),
    ],
)
def test_flywheel_of_khurmi_and_gupta_takes_the_printed_energy(
    speed: float,
    flywheel: float,
    cos: tuple[float, float],
    sin: tuple[float, float],
    energy: float,
    fastening: float,
    place: float,
) -> None:
    """Theory of Machines, pages 585 and 587: the moment of an engine less that of its machine, in N m."""
    coupled = {"a": 1.0, "b": 1.5, "c": 1.0, "e": 0.0, "m_crank": 0.0, "m_coupler": 0.0, "m_rocker": 0.0}
    table, load = coupled | {"speed": speed * np.pi / 30.0, "flywheel": flywheel}, {"mean": 0.0, "cos": cos, "sin": sin}
    given = {"loads": {"load_torque": load}}
    found = sweep.summarise("four_bar", table, "fastest, slowest", accuracy=1e-9, **given).iloc[0]
    assert flywheel * (found["fastest"] ** 2 - found["slowest"] ** 2) / 2.0 == pytest.approx(
        energy, abs=1.0
    )  # cut, not rounded
    at = sweep.evaluate("four_bar", table, "crank_acceleration", phi=np.radians(place), **given)["crank_acceleration"]
    assert at[0] == pytest.approx(fastening, abs=0.05 if abs(fastening) > 10.0 else 5e-4)


@pytest.mark.parametrize(
    ("radial", "axial", "speed", "factors", "capacity", "load", "hours", "digit"),
    [
        # Shigley, Mechanical Engineering Design: a 6210 under 500 lbf across and 400 lbf along its shaft.
        (500.0, 400.0, 24.0 * np.pi, (0.56, 1.527, 0.285), 7900.0, 890.8, 16150.0, 5.0),
        # Wentzell, Machine Design, example 20-1: 2400 lbf across at 1750 rev/min.
        (2400.0, 0.0, 1750.0 * np.pi / 30.0, (0.56, 1.5, 0.3), 5050.0, 2400.0, 88.73, 0.005),
        # A 6309 under 10 kN across at 3000 rev/min.
        (10.0, 0.0, 100.0 * np.pi, (0.56, 1.5, 0.3), 55.3, 10.0, 940.0, 5.0),
    ],
)
def test_ball_bearing_has_the_printed_load_and_life(
    radial: float,
    axial: float,
    speed: float,
    factors: tuple[float, float, float],
    capacity: float,
    load: float,
    hours: float,
    digit: float,
) -> None:
    """The weight of a crank whose centre is in its first support loads the shaft."""
    design = dict(family("slotted").example)
    axis = np.array([0.0, np.sin(design["alpha"]), np.cos(design["alpha"])])
    weight = axial * axis + [radial, 0.0, 0.0]
    design |= {"m_crank": 1.0, "com_crank_z": -2.0, "support_a1": -2.0, "support_a2": -5.0, "speed": speed}
    design |= {f"gravity_{x}": weight[k] for k, x in enumerate("xyz")}
    design |= dict(zip(("radial_factor_a", "axial_factor_a", "e_limit_a"), factors, strict=True))
    found = sweep.summarise("slotted", design | {"dynamic_capacity_a": capacity}, "mean_load_a1, life_a1").iloc[0]
    assert found["mean_load_a1"] == pytest.approx(load, abs=0.05)
    assert found["life_a1"] / 3600.0 == pytest.approx(hours, abs=digit)
    # ISO 281: X R + Y A where A is above e R, else R; a million turns times (C/P)^3.  Some ten roundings.
    across, along, limit = factors
    equivalent = across * radial + along * axial if axial > limit * radial else radial
    assert found["mean_load_a1"] == pytest.approx(equivalent, rel=1e-14)
    assert found["life_a1"] == pytest.approx(1e6 * (capacity / equivalent) ** 3 * 2.0 * np.pi / speed, rel=1e-13)


def test_friction_of_an_eccentric_drive_is_that_of_bevans_friction_circles() -> None:
    """Theory of Machines, page 198: eccentric 8 in, rod 80 in, 6 tons on the slider, mu = 0.05 in three journals.

    The slider drives: 3.64 ton ft without friction, 3.06 with it, efficiency 84.17 %.
    """
    design = {"a": 8.0, "b": 80.0, "m_crank": 0.0, "m_coupler": 0.0, "m_slider": 0.0, "speed": 1.0, "load_force": -6.0}
    design |= {
        "mu_a": 0.05,
        "mu_b": 0.05,
        "mu_c": 0.05,
        "mu_d": 0.0,
        "radius_a": 7.0,
        "radius_b": 15.0,
        "radius_c": 4.4,
    }
    design |= {"support_a1": -1.0, "support_a2": 1.0, "support_d1": -1.0, "support_d2": 1.0}
    found = sweep.evaluate("slider_crank", design, "drive_torque, drive_torque_friction", phi="60 deg").iloc[0]
    # Half a unit of the last printed digit.
    assert -found["drive_torque"] / 12.0 == pytest.approx(3.64, abs=0.005)
    assert -found["drive_torque_friction"] / 12.0 == pytest.approx(3.06, abs=0.005)
    assert found["drive_torque_friction"] / found["drive_torque"] == pytest.approx(0.8417, abs=5e-5)


# Cremasco Coelho, Mech. Mach. Theory 2025, 106163, equation (55) of an RSSR with friction in its shafts alone: crank
# angle [deg], sense of the crank, torque on the crank per torque of the driven arm.
RSSR_FRICTION = [
    (0.0, 1.0, -0.7123763752854408),
    (-30.0, 1.0, -0.2329015848897181),
    (-90.0, 1.0, 0.7568274132552235),
    (-120.0, 1.0, 1.0372138123728558),
    (-180.0, 1.0, 0.8681117931551212),
    (0.0, -1.0, -1.9122389879552024),
    (-30.0, -1.0, -0.8466820431143449),
    (-90.0, -1.0, 0.23354052012206628),
]


@pytest.mark.parametrize(("turn", "sense", "ratio"), RSSR_FRICTION)
def test_friction_of_the_shafts_of_an_rssr_is_that_of_the_closed_form(turn: float, sense: float, ratio: float) -> None:
    """Journals and collars of 5 mm, mu = 0.7 at the crank and 0.6 at the arm; links without mass.

    Both shafts have their supports at his origins and 30 mm behind them, the arms lean out of their planes.
    """
    crank = 201.6318 * np.array([-0.379646, 0.400777, 0.833815])
    frame = 403.1627 * np.array([0.524328, 0.835662, -0.163552])
    axis = np.array([0.009243, -0.951003, 0.309043]) / np.linalg.norm([0.009243, -0.951003, 0.309043])
    along, (x, y), start = axis @ crank, polar(201.6318, 7.294), 1.7072908360923371
    foot = frame - [y, 0.0, 0.0]
    arm = x * np.array([0.0, np.cos(start), np.sin(start)])
    drawn = sweep.from_points(
        "rssr", A=axis * along, axis_A=axis, B=crank, C=foot + arm, D=foot, axis_D=[1.0, 0.0, 0.0]
    )
    design = drawn.parameters | {"branch": drawn.branch, "speed": sense, "load_torque": 1.0}
    design |= {"m_crank": 0.0, "m_coupler": 0.0, "m_rocker": 0.0, "mu_a": 0.7, "mu_b": 0.0, "mu_c": 0.0, "mu_d": 0.6}
    design |= {"radius_b": 1.0, "radius_c": 1.0, "support_a1": -along, "support_a2": 30.0 - along}
    design |= {f"{kind}_{joint}": 5.0 for joint in "ad" for kind in ("radius", "thrust_radius")}
    design |= {"support_d1": y, "support_d2": 30.0 + y}
    phi = drawn.phi + np.radians(turn)
    found = sweep.evaluate("rssr", design, "drive_torque_friction", phi=phi)["drive_torque_friction"]
    # The closed form in float64; cancellations cost it two digits.
    assert found[0] == pytest.approx(ratio, rel=1e-13)


def test_a_turning_load_as_large_as_a_fixed_one_has_the_mean_of_the_catalogues() -> None:
    """SKF: F_m = f_m (F_1 + F_2), f_m = 0.75 for equal loads; exactly (4/(3 pi))^(1/3)."""
    design = dict(family("slotted").example) | {"m_crank": 1.0, "com_crank_x": 0.1, "com_crank_z": -2.0, "speed": 10.0}
    design |= {"support_a1": -2.0, "support_a2": -5.0, "gravity_x": 10.0, "dynamic_capacity_a": 1.0}
    design |= {"radial_factor_a": 1.0, "axial_factor_a": 0.0, "e_limit_a": 1.0}
    found = sweep.summarise("slotted", design, "mean_load_a1", accuracy=1e-9)["mean_load_a1"]
    assert found[0] / 20.0 == pytest.approx((4.0 / (3.0 * np.pi)) ** (1.0 / 3.0), rel=1e-9)
    assert round(found[0] / 20.0, 2) == 0.75


@pytest.mark.parametrize(
    ("cranks", "left"), [((0.0, 180.0, 180.0, 0.0), (2, 4, 6)), ((0.0, 120.0, 240.0, 240.0, 120.0, 0.0), (6,))]
)
def test_engine_in_line_shakes_in_the_orders_of_den_hartog(cranks: tuple[float, ...], left: tuple[int, ...]) -> None:
    """Mechanical Vibrations, chapter 5: pistons alone, crank 40, rod 160, 120 apart; the orders that do not cancel."""
    members = {
        f"c{k}": {"family": "slider_crank", "offset": np.radians(angle), "place": {"at": [0.0, 0.0, 120.0 * k]}}
        for k, angle in enumerate(cranks)
    }
    one = {"a": 40.0, "b": 160.0, "m_crank": 0.0, "m_coupler": 0.0, "m_slider": 5e-4, "speed": 300.0}
    design = {f"{member}.{name}": value for member in members for name, value in one.items()}
    engine = sweep.machine(members, {"shaking": {"shaking": list(members)}})
    angles = np.linspace(0.0, 2.0 * np.pi, 64, endpoint=False)
    found = sweep.evaluate(engine, design, "shaking_x, shaking_moment_y", phi=angles)
    unit, x = 5e-4 * 40.0 * 300.0**2, 40.0 / 160.0
    series = {2: x + x**3 / 4.0 + 15.0 * x**5 / 128.0, 4: x**3 / 4.0 + 3.0 * x**5 / 16.0, 6: 9.0 * x**5 / 128.0}
    orders = 2.0 * np.abs(np.fft.rfft(found["shaking_x"])) / 64.0 / unit / len(cranks)
    expected = [series[k] if k in left else 0.0 for k in range(1, 8)]
    np.testing.assert_allclose(orders[1:8], expected, atol=0.2 * x**7)  # the first terms that he leaves out
    # Mirrored cranks: the couple about the middle is nothing, so the moment is the force at the middle.
    middle = 120.0 * (len(cranks) - 1) / 2.0
    np.testing.assert_allclose(found["shaking_moment_y"], middle * found["shaking_x"], atol=1e-9)


@pytest.mark.parametrize("ratio", [0.3, 0.9, 1.0, 1.5, 3.0])
@pytest.mark.parametrize("damping", [0.02, 0.2])
def test_slider_on_an_elastic_rod_answers_an_eccentric_as_textbooks_say(ratio: float, damping: float) -> None:
    """Den Hartog, Mechanical Vibrations, chapter 2: a r^2/sqrt((1 - r^2)^2 + (2 zeta r)^2), and exp(-2 pi zeta/r).

    The rod of 10^7 cranks leaves a pure sine of the crank's length, its second order is 1e-7 of that.
    """
    mass, stiffness = 1e-3, 100.0
    design = {"a": 1.0, "b": 1e7, "m_crank": 0.0, "m_coupler": 0.0, "m_slider": mass, "driven_mass": mass}
    design |= {"stiffness": stiffness, "damping": 2.0 * damping * np.sqrt(stiffness * mass)}
    design["speed"] = ratio * np.sqrt(stiffness / mass)
    found = sweep.summarise("slider_crank", design, "max_abs_lag_dynamic, floquet", accuracy=1e-6).iloc[0]
    expected = ratio**2 / np.hypot(1.0 - ratio**2, 2.0 * damping * ratio)
    assert found["max_abs_lag_dynamic"] == pytest.approx(expected, rel=1e-6)
    assert found["floquet"] == pytest.approx(np.exp(-2.0 * np.pi * damping / ratio), rel=1e-12)


def test_steam_engine_carries_its_piston_effort_along_the_rod() -> None:
    """Crank 0.3 m, rod 1.2 m, 250 kg, 250 rev/min, 68.73 kN of steam at 60 deg, an engine of Khurmi and Gupta.

    Effort Q = steam - m a, with the exact a; rod Q/cos, guide Q tan, torque Q sin(crank + rod)/cos times the crank.
    """
    speed, steam, crank = 250.0 * np.pi / 30.0, 350.0 * np.pi / 4.0 * 0.5**2, np.radians(60.0)
    design = {"a": 0.3, "b": 1.2, "m_crank": 0.0, "m_coupler": 0.0, "m_slider": 0.25, "speed": speed}
    want = "drive_torque, force_c, force_d_y"
    found = sweep.evaluate("slider_crank", design | {"load_force": -steam}, want, phi=crank).iloc[0]
    rod = np.arcsin(0.25 * np.sin(crank))
    turn = -0.25 * np.cos(crank) / np.cos(rod)
    bend = (0.25 * np.sin(crank) - turn**2 * np.sin(rod)) / np.cos(rod)
    d2s = -0.3 * np.cos(crank) + 1.2 * (bend * np.sin(rod) - turn**2 * np.cos(rod))
    effort = steam + 0.25 * d2s * speed**2
    # Some ten roundings of the steam's force.
    assert found["force_c"] == pytest.approx(effort / np.cos(rod), rel=1e-14)
    assert found["force_d_y"] == pytest.approx(effort * np.tan(rod), rel=1e-14)
    assert -found["drive_torque"] == pytest.approx(0.3 * effort * np.sin(crank + rod) / np.cos(rod), rel=1e-14)


def test_engine_with_two_thirds_balanced_is_left_with_the_rest() -> None:
    """Two thirds of 50 kg and all of 37 kg at 150 mm are balanced by 26.375 kg at 400 mm, at 240 rev/min and 60 deg.

    A third is left along the stroke, two thirds across, in an engine of Khurmi and Gupta; a rod of 10^6 cranks.
    """
    speed, balance = 8.0 * np.pi, 26.375e-3
    crank = 0.037 + balance
    design = {"a": 0.15, "b": 1.5e5, "m_crank": crank, "com_crank_x": (0.037 * 0.15 - balance * 0.4) / crank}
    design |= {"m_coupler": 0.0, "m_slider": 0.05, "speed": speed}
    found = sweep.evaluate("slider_crank", design, "shaking_force", phi="60 deg")["shaking_force"][0]
    assert found == pytest.approx(0.05 * 0.15 * speed**2 * np.hypot(0.5 / 3.0, np.sqrt(3.0) / 3.0), rel=1e-5)


def test_four_bar_balanced_by_berkof_and_lowen_shakes_nothing() -> None:
    """Their two counterweights: m2 r2 = m3 (a/b)(r3 - b), m4 r4 = -m3 (c/b) r3 for a coupler of any shape (1969)."""
    a, b, c, mass, centre = 50.0, 150.0, 100.0, 3e-4, 60.0 + 20.0j
    design = {"a": a, "b": b, "c": c, "e": 160.0, "branch": -1, "speed": 30.0, "m_coupler": mass}
    design |= {"m_crank": 4e-4, "m_rocker": 5e-4}
    moments = {"crank": mass * a / b * (centre - b), "rocker": -mass * c / b * centre, "coupler": mass * centre}
    for link, moment in moments.items():
        offset = moment / design[f"m_{link}"]
        design |= {f"com_{link}_x": offset.real, f"com_{link}_y": offset.imag, f"j_{link}_zz": 1.0}
    found = sweep.evaluate("four_bar", design, "shaking_force, force_b", phi=np.linspace(0.0, 6.0, 13))
    # Rounding of the forces that cancel.
    assert found["shaking_force"].max() < 1e-14 * found["force_b"].max()
