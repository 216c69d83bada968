"""Loads of other programs: free-running loops of Modelica, statics of linkage_sim and MotionGenesis, EXUDYN.

Tolerances are half a unit of the last printed digit, or what the program's integration leaves.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from scipy.optimize import brentq

import sweep

STEEL = 7.7  # t/m^3, the density of the Modelica Standard Library; lengths in m, hence kN
GRAVITY = 9.80665


def cylinder(length: float, diameter: float) -> tuple[float, float]:
    """Mass, and inertia across the middle."""
    mass = STEEL * np.pi / 4.0 * diameter**2 * length
    return mass, mass * (length**2 + 0.75 * diameter**2) / 12.0


def box(length: float, width: float, height: float) -> tuple[float, float]:
    """Mass, and inertia about the width."""
    mass = STEEL * length * width * height
    return mass, mass * (length**2 + height**2) / 12.0


def fourbar2() -> tuple[str, dict[str, float]]:
    """Crank and slider are cylinders of 50 mm, the rod between them has no mass."""
    drawn = sweep.from_points("rssp", A=[0, 0, 0], axis_A=[1, 0, 0], B=[0, 0.5, 0.1], C=[1, 0.2, 0], axis_D=[1, 0, 0])
    mass, inertia = cylinder(drawn.parameters["a"], 0.05)
    design = drawn.parameters | {"branch": drawn.branch, "m_crank": mass, "j_crank_zz": inertia}
    design |= {"com_crank_x": drawn.parameters["a"] / 2.0, "m_coupler": 0.0, "m_slider": cylinder(0.2, 0.05)[0]}
    return "rssp", design | {"gravity_x": -GRAVITY}  # X is vertical: it runs from the crank axis to the slide


def engine1a() -> tuple[str, dict[str, float]]:
    """Crank of two webs, a pin and a shaft, with an inertia of 1 kg m^2; rod a box, piston a cylinder below gravity."""
    (web, web_inertia), (rod, rod_inertia) = box(0.1, 0.02, 0.05), box(0.2, 0.02, 0.06)
    pin, shaft = cylinder(0.1, 0.03)[0], cylinder(0.1, 0.05)[0]
    mass = shaft + 2.0 * web + pin
    centre = (2.0 * web * 0.05 + pin * 0.1) / mass
    about_axis = shaft * 0.05**2 / 8.0 + 2.0 * (web_inertia + web * 0.05**2) + pin * (0.03**2 / 8.0 + 0.1**2)
    design = {"a": 0.1, "b": 0.2, "flywheel": 1e-3, "gravity_x": -GRAVITY, "m_slider": cylinder(0.1, 0.1)[0]}
    design |= {"m_crank": mass, "com_crank_x": centre, "j_crank_zz": about_axis - mass * centre**2}
    return "slider_crank", design | {"m_coupler": rod, "com_coupler_x": 0.1, "j_coupler_zz": rod_inertia}


@pytest.mark.parametrize(
    ("model", "mean", "fastest", "slowest"),
    [
        (fourbar2, 8.051854247298765, 11.896777656769158, 5.132825644961559),
        (engine1a, 10.682886793776852, 11.64035618546467, 9.979868751666924),
    ],
)
def test_free_running_loop_of_modelica_has_the_speeds_of_the_reference_results(
    model: Callable[[], tuple[str, dict[str, float]]], mean: float, fastest: float, slowest: float
) -> None:
    """Modelica.Mechanics.MultiBody.Examples.Loops, reference results by Dymola: the first full turn of the crank.

    Nothing drives and nothing brakes, so the motion is the steady one of constant mean speed without load.
    """
    name, design = model()
    found = sweep.summarise(name, design | {"speed": mean}, "fastest, slowest, unevenness", accuracy=1e-9).iloc[0]
    # Dymola integrated with a tolerance of 1e-6; its energy drifts by 3e-5 of itself in 5 s.
    assert found["fastest"] == pytest.approx(fastest, rel=1e-5)
    assert found["slowest"] == pytest.approx(slowest, rel=1e-5)
    assert found["unevenness"] == pytest.approx((fastest - slowest) / mean, rel=1e-5)


# Gerstmayr, EXUDYN's example of a slider-crank, reference solution by MATLAB: time, crank angle, crank speed.
EXUDYN = [
    (0.3025635, 1.4693723, 6.4923781),
    (0.60219327, 5.3558174, 13.14014),
    (0.90134647, 11.613176, 19.146027),
    (1.2003681, 20.227787, 23.799972),
    (1.5001275, 31.247025, 62.667853),
    (1.8003469, 44.827631, 39.544191),
]


def test_slider_crank_of_exudyn_gains_the_work_of_its_torque() -> None:
    """From rest, 0.1 N m on the crank: J omega^2/2 is 0.1 phi; crank and rod are slender, lengths in m."""
    _, phi, speed = np.transpose(EXUDYN)
    design = {"a": 0.1, "b": 0.3, "m_crank": 0.2, "m_coupler": 0.2, "m_slider": 0.4, "speed": 1.0}
    inertia = sweep.evaluate("slider_crank", design, "reduced_inertia", phi=phi)["reduced_inertia"]
    # The energy of the reference, integrated with a tolerance of 1e-6, drifts by 6e-5 of itself.
    np.testing.assert_allclose(inertia * speed**2 / 2.0, 0.1 * phi, rtol=1e-4)


# Reference data of linkage_sim (coleas33), statics of its four-bar below its weight: crank angle [deg], torque on the
# crank, forces of the frame on crank and rocker.
LINKAGE_SIM = [
    (30.0, 21.085597076442088, (5.552977629114837, 37.36356342518907), (-5.552977629114833, 31.306436574810963)),
    (80.0, -6.326374080269012, (11.288244306174214, 37.3966783902309), (-11.28824430617425, 31.27332160976917)),
    (230.0, -0.5124841782110394, (33.04721040650921, 49.99141557410598), (-33.04721040650918, 18.678584425894)),
]


@pytest.mark.parametrize(("degrees", "torque", "crank", "rocker"), LINKAGE_SIM)
def test_resting_four_bar_carries_its_weight_as_in_linkage_sim(
    degrees: float, torque: float, crank: tuple[float, float], rocker: tuple[float, float]
) -> None:
    """Links of 2, 3 and 2 kg, centres halfway; the inverse dynamics of that program leave out omega^2 r of its rods."""
    design = {"a": 1.0, "b": 3.0, "c": 2.0, "e": 4.0, "branch": -1, "gravity_y": -9.81, "speed": 1e-9}
    design |= {"m_crank": 2.0, "m_coupler": 3.0, "m_rocker": 2.0}
    names = "drive_torque, force_a_x, force_a_y, force_d_x, force_d_y"
    found = sweep.evaluate("four_bar", design, names, phi=np.radians(degrees)).iloc[0]
    # That program ends its position search at 1e-10.
    assert found.to_numpy()[2:-1] == pytest.approx([torque, *crank, *rocker], abs=2e-9)


def test_four_bar_rests_where_its_potential_energy_is_least() -> None:
    """Links of 1, 2, 2 m and 10, 20, 20 kg on a frame of 1 m, 200 N across at the rocker's pin.

    MotionGenesis's example; its angles from the vertical are 20.0, 71.7, 38.3 deg.
    """
    design = {"a": 1.0, "b": 2.0, "c": 2.0, "e": 1.0, "xi": 2.0, "tool_force_x": 0.2, "gravity_y": -9.81, "speed": 1e-9}
    design |= {"m_crank": 0.01, "m_coupler": 0.02, "m_rocker": 0.02}

    def torque(phi: float) -> float:
        return float(sweep.evaluate("four_bar", design, "drive_torque", phi=phi)["drive_torque"][0])

    def energy(phi: float) -> float:
        pin = np.exp(1j * phi)
        line = pin - 1.0  # from the rocker's pivot; both other links are 2 m, so the other pin is beside its middle
        other = 1.0 + line / 2.0 * (1.0 + 1j * np.sqrt(16.0 / abs(line) ** 2 - 1.0))
        heights = 0.01 * pin.imag / 2.0 + 0.02 * (pin + other).imag / 2.0 + 0.02 * other.imag / 2.0
        return float(9.81 * heights - 0.2 * other.real)

    phi = brentq(torque, np.radians(-80.0), np.radians(-60.0), xtol=1e-14)
    # Two steps of central differences, extrapolated: their error is some 1e-12 of the energy over the step.
    wide, narrow = ((energy(phi + h) - energy(phi - h)) / (2.0 * h) for h in (2e-3, 1e-3))
    assert (4.0 * narrow - wide) / 3.0 == pytest.approx(0.0, abs=1e-11)
    assert energy(phi) < min(energy(phi - 0.1), energy(phi + 0.1))
    assert np.degrees(phi) + 90.0 == pytest.approx(20.0, abs=0.05)


# Modelica.Mechanics.MultiBody.Examples.Loops.PlanarFourbar, reference results: crank angle and speed, and the integral
# of the squared speed over time, summed by trapezia over its steps of 1 ms.
PLANAR_FOURBAR = [
    (-0.135510109, -2.72234586, 0.245253226),
    (-1.31824202, -10.0566051, 8.07797862),
    (-1.82106781, 12.4555110, 46.2434109),
    (-0.946797100, 7.03396407, 220.844763),
]


def test_falling_four_bar_of_modelica_keeps_its_energy() -> None:
    """Bars of 50 x 50 mm fall from rest against a damper of 0.1 N m s on the crank."""
    drawn = sweep.from_points("four_bar", A=[0, 0, 0], B=[0.4, 0, 0], C=[0.5, 1.1, 0], D=[-0.15, 1, 0])
    x, y, _ = drawn.place.zero  # X of the family's frame in the drawing, whose Y is vertical
    design = drawn.parameters | {"branch": drawn.branch, "speed": 1e-9}
    design |= {"gravity_x": -GRAVITY * y, "gravity_y": -GRAVITY * x}
    for link, side in (("crank", "a"), ("coupler", "b"), ("rocker", "c")):
        design[f"m_{link}"], design[f"j_{link}_zz"] = box(design[side], 0.05, 0.05)
        design[f"com_{link}_x"] = design[side] / 2.0
    start = sweep.evaluate("four_bar", design, "drive_torque, reduced_inertia", phi=drawn.phi).iloc[0]
    # The first step of the trace, 27.0039 rad/s^2, is the mean over 1 ms.
    assert -start["drive_torque"] / start["reduced_inertia"] == pytest.approx(-27.0039, abs=5e-4)
    turn, speed, squared = np.transpose([(0.0, 0.0, 0.0), *PLANAR_FOURBAR])
    found = sweep.evaluate("four_bar", design, "reduced_inertia, x_b, y_b, x_c, y_c", phi=drawn.phi + turn)
    pins = [found[f"x_{pin}"] * y + found[f"y_{pin}"] * x for pin in "bc"]  # heights
    height = design["m_crank"] * pins[0] + design["m_coupler"] * (pins[0] + pins[1]) + design["m_rocker"] * pins[1]
    energy = found["reduced_inertia"] * speed**2 / 2.0 + GRAVITY * height / 2.0 + 1e-4 * squared
    # Dymola integrated with a tolerance of 1e-6; its energy drifts by 7e-5 of the largest kinetic one, 0.136 kN m.
    np.testing.assert_allclose(energy - energy[0], 0.0, atol=1e-4 * 0.136)


def test_slider_crank_of_exudyn_shakes_nothing_with_its_best_centres_of_mass() -> None:
    """Gerstmayr's example of optimisation: crank -75 mm, rod -150 mm from their first joints, known in closed form."""
    design = {"a": 0.1, "b": 0.3, "m_crank": 0.4, "m_coupler": 0.2, "m_slider": 0.1, "speed": 10.0 * np.pi}
    design |= {"com_crank_x": -0.075, "com_coupler_x": -0.15}
    design |= {"j_crank_zz": 0.4 * 0.1**2 / 12.0, "j_coupler_zz": 0.2 * 0.3**2 / 12.0}
    found = sweep.evaluate("slider_crank", design, "shaking_force, force_d_y", phi=np.linspace(0.0, 6.0, 13))
    # Rounding of forces of some 50 N.
    assert np.abs(found["shaking_force"]).max() < 1e-13
    assert np.abs(found["force_d_y"]).max() > 1.0
