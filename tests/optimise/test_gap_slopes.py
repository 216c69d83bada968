"""Slopes of the least gap of two bodies as the optimiser has them, against two other ways to them.

At the least gap of a turn its rate is zero, so its slope by a dimension is that of the gap at this crank angle alone:
the complex step there.  An angle that is off by x changes it by x times a second derivative, so that an angle to 1e-8,
as ``phi_min_free`` has it, is no reference for more than eight digits; here it is the root of the rate, to rounding.
"""

from __future__ import annotations

import functools

import numpy as np
import pandas as pd
import pytest

import sweep
from sweep.families.base import Angles
from sweep.optimise.manufacture.tolerance import sensitivities
from tests.families.machines.test_moments import machine_of, rows_of

STEP = 1e-100
SIXTH = {1: 3.0 / 4.0, 2: -3.0 / 20.0, 3: 1.0 / 60.0}  # weights of central differences of sixth order
LINKS = [["needle.rocker1", "looper.coupler"], ["needle.coupler2", "looper.rocker"]]
# Row of the table, bodies, and where along both the least gap lies: at an end or inside.
CASES = {
    "two ends": (0, LINKS[0], (1.0, 1.0)),
    "an end and inside": (5, LINKS[1], (0.0, 0.4057)),
    "inside and an end": (8, LINKS[1], (0.1692, 1.0)),
    "inside both": (1, ["thin", "blade"], (0.8104, 0.2935)),
}


@functools.cache
def scene(case):
    """Return the machine, its design, the slopes of its least gap by parameter, and a gap of complex designs."""
    row, bodies, _ = CASES[case]
    radii = {} if bodies[0] == "thin" else {"radii": [1.0, 2.0]}
    machine, given = machine_of(rows_of("capsule_turn")[row]["inputs"], free={"gap": bodies} | radii)
    parameters = zip(machine.parameter_names, machine.parameters, strict=True)
    design = np.array([given.get(name, p.default) for name, p in parameters], np.float64)
    slopes = pd.DataFrame(sensitivities(machine, design, ["min_free"])).set_index("parameter")["growing"]
    assert np.isfinite(slopes).all() and len(slopes) > 30
    return machine, design, slopes


def gap_at(machine, design, phi, name="free"):
    return machine.poses(design[None], Angles.of(np.array([[phi]])), frozenset([name]))[name][0, 0]


def least(machine, design):
    """Return the crank angle of the least gap: the root of its rate by the secant method."""
    table = dict(zip(machine.parameter_names, design, strict=True))
    start = sweep.summarise(machine, table, ["phi_min_free"], accuracy=1e-12)["phi_min_free"][0]
    ends = [start - 1e-6, start + 1e-6]
    rates = [gap_at(machine, design + 0j, phi + 1j * STEP).imag / STEP for phi in ends]
    while abs(rates[-1]) < abs(rates[-2]) or len(rates) == 2:
        ends.append(ends[-1] - rates[-1] * (ends[-1] - ends[-2]) / (rates[-1] - rates[-2]))
        rates.append(gap_at(machine, design + 0j, ends[-1] + 1j * STEP).imag / STEP)
    assert abs(ends[-2] - start) < 1e-6
    return ends[-2]


@pytest.mark.parametrize("case", CASES)
def test_slopes_of_the_least_gap_are_those_of_the_complex_step_there(case):
    machine, design, slopes = scene(case)
    phi = least(machine, design)
    places = [gap_at(machine, design, phi, f"free_{which}") for which in ("first", "second")]
    np.testing.assert_allclose(places, CASES[case][2], rtol=0.0, atol=1e-4)
    for name, slope in slopes.items():
        moved = design.astype(complex)
        moved[machine.parameter_names.index(name)] += 1j * STEP
        expected = gap_at(machine, moved, phi).imag / STEP
        # Both angles carry some 1e-15 of rounding times the second derivative, which is 1e3 of the slopes where a tip
        # passes near: seen 2e-15 of the largest slope.
        assert abs(slope - expected) <= 1e-12 * slopes.abs().max(), name


@pytest.mark.parametrize("case", [case for case in CASES if CASES[case][1] in LINKS])
def test_slopes_of_the_least_gap_are_those_of_central_differences_of_sixth_order(case):
    """The gap changes over lengths of some 20 mm: what is left out is (0.05/20)^6/140, below all rounding."""
    machine, design, slopes = scene(case)
    for name, slope in slopes.items():
        own = machine.parameter_names.index(name)
        step = 2e-3 if machine.parameters[own].unit == "angle" else 5e-2
        moved = np.repeat(design[None], 6, axis=0)
        moved[:, own] += step * np.array([-3.0, -2.0, -1.0, 1.0, 2.0, 3.0])
        table = dict(zip(machine.parameter_names, moved.T, strict=True))
        found = sweep.summarise(machine, table, ["min_free"], accuracy=1e-12)
        values = found["min_free"].to_numpy()
        expected = sum(weight * (values[2 + k] - values[3 - k]) for k, weight in SIXTH.items()) / step
        # the weights of all six values together are below 2
        assert abs(slope - expected) <= 2.0 * found["err_min_free"].max() / step, name
