"""Shaking estimate: against differences of the joints' positions, and against joint loads with rods' masses."""

from __future__ import annotations

import numpy as np
import pytest

import sweep
from kernels import status as st

CRANK_ROCKER = {"a": 1.0, "b": 4.0, "c": 2.5, "e": 3.1, "f": 0.7, "g": -0.6, "alpha": 0.9}
GUIDE = {"a": 1.0, "b": 3.3, "c": 3.1, "e": 3.0, "xi": 4.2, "eta": 0.8, "lam": 1.1, "h": -0.6}
SLIDER = {"a": 1.0, "b": 3.0, "e": 0.4, "branch": -1.0}
PHI = np.linspace(0.1, 6.2, 9)
AXES = "xyz"
STEP = 1e-3
WEIGHTS = {-2: -1 / 12, -1: 16 / 12, 0: -30 / 12, 1: 16 / 12, 2: -1 / 12}  # second derivative to fourth order


def centre(mechanism, table, lengths, phi, suffix="", axes=AXES):
    """(m, 3) common centre of mass of rods from positions of the joints; pivots, which stand still, left out."""
    names = [f"{axis}_{joint}{suffix}" for joint in "bc" for axis in axes]
    found = sweep.evaluate(mechanism, {k: [x] for k, x in table.items()}, names, phi=phi)[names].to_numpy()
    b, c = found[:, : len(axes)], found[:, len(axes) :]
    crank, coupler, rocker = lengths
    return (crank * b + coupler * (b + c) + rocker * c) / (2.0 * sum(lengths))


@pytest.mark.parametrize(
    ("mechanism", "table", "suffix", "axes", "lengths"),
    [
        ("rssr", CRANK_ROCKER, "", "xyz", (1.0, 4.0, 2.5)),
        ("guide", GUIDE, "", "xy", (1.0, 3.3, 3.1)),
        ("slider_crank", SLIDER, "", "xy", (1.0, 3.0, 0.0)),
        (["rssr", "guide"], {f"{k}1": x for k, x in CRANK_ROCKER.items()} | {f"{k}2": x for k, x in GUIDE.items()}, "2",
         "xy", (1.0, 3.3, 3.1)),
    ],
)  # fmt: skip
def test_estimate_is_the_acceleration_of_the_rods_centre(mechanism, table, suffix, axes, lengths) -> None:
    places = {k: centre(mechanism, table, lengths, PHI + k * STEP, suffix, axes) for k in WEIGHTS}
    exact = np.linalg.norm(sum(w * places[k] for k, w in WEIGHTS.items()) / STEP**2, axis=1)
    name = f"shaking_estimate{suffix}"
    found = sweep.evaluate(mechanism, {k: [x] for k, x in table.items()}, [name], phi=PHI)
    assert (found["status"] == st.OK).all()
    # fourth order of the step, and rounding of positions over its square
    np.testing.assert_allclose(found[name], exact, rtol=1e-7, atol=1e-8)


def test_estimate_times_mass_and_speed_is_the_shaking_force_of_rods() -> None:
    density, speed = 3e-6, 500.0
    a, b, c = (CRANK_ROCKER[name] for name in "abc")
    rods = {"m_crank": density * a, "com_crank_x": 0.5 * a, "m_coupler": density * b, "com_coupler_x": 0.5 * b,
            "m_rocker": density * c, "com_rocker_x": 0.5 * c, "j_coupler_yy": density * b**3 / 12.0,
            "j_coupler_zz": density * b**3 / 12.0, "j_rocker_yy": density * c**3 / 12.0,
            "j_rocker_zz": density * c**3 / 12.0, "speed": speed}  # fmt: skip
    table = {k: [x] for k, x in (CRANK_ROCKER | rods).items()}
    found = sweep.evaluate("rssr", table, ["shaking_estimate", "shaking_force"], phi=PHI)
    mass = density * (a + b + c)
    # two ways of some hundred operations
    np.testing.assert_allclose(mass * speed**2 * found["shaking_estimate"], found["shaking_force"], rtol=1e-12)


def test_magnitude_is_that_of_its_components() -> None:
    wanted = ["shaking_estimate", *(f"shaking_estimate_{axis}" for axis in AXES)]
    found = sweep.evaluate("rssr", {k: [x] for k, x in CRANK_ROCKER.items()}, wanted, phi=PHI)
    # a sum of three squares and a root
    np.testing.assert_allclose(found[wanted[0]], np.linalg.norm(found[wanted[1:]], axis=1), rtol=4e-16)


def test_estimate_of_a_linkage_that_does_not_reach_is_nan_with_its_status() -> None:
    table = {k: [x] for k, x in (CRANK_ROCKER | {"b": 40.0}).items()}
    found = sweep.evaluate("rssr", table, ["shaking_estimate"], phi=PHI)
    assert (found["status"] != st.OK).all() and found["shaking_estimate"].isna().all()
