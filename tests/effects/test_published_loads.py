"""Loads of textbooks: Norton's four-bar by the matrix method, Shigley's ball bearing by ISO 281.

Tolerances are half a unit of the last printed digit.
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


def test_ball_bearing_of_shigley_has_the_printed_load_and_life() -> None:
    """Mechanical Engineering Design, a 6210 ball bearing under 500 lbf across and 400 lbf along its shaft at 720 rpm.

    The weight of a crank whose centre is in its first support loads the shaft.
    """
    design = dict(family("slotted").example)
    axis = np.array([0.0, np.sin(design["alpha"]), np.cos(design["alpha"])])
    weight = 400.0 * axis + [500.0, 0.0, 0.0]
    design |= {"m_crank": 1.0, "com_crank_z": -2.0, "support_a1": -2.0, "support_a2": -5.0, "speed": 24.0 * np.pi}
    design |= {f"gravity_{x}": weight[k] for k, x in enumerate("xyz")}
    design |= {"radial_factor_a": 0.56, "axial_factor_a": 1.527, "e_limit_a": 0.285, "dynamic_capacity_a": 7900.0}
    found = sweep.summarise("slotted", design, "mean_load_a1, life_a1").iloc[0]
    assert found["mean_load_a1"] == pytest.approx(890.8, abs=0.05)
    assert found["life_a1"] / 3600.0 == pytest.approx(16150.0, abs=5.0)
