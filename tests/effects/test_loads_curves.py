"""Loads over the turn: the curve between its points, and that effects take it as they take a constant."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as some

import sweep
from sweep.effects import extended
from sweep.effects.wanted import names_of_effects
from sweep.errors import InputError
from sweep.evaluation.summaries import output
from sweep.families import family
from sweep.numerics.curves import SeriesCurve, table_curve
from tests.effects.test_tool import DRIVE, GUIDE, MASSLESS, RPM_7000

PHI = 2.0 * np.pi * np.arange(90) / 90
CHAIN = DRIVE | {f"{name}2": x for name, x in GUIDE.items()} | {f"{m}{k}": 0.0 for m in MASSLESS for k in (1, 2)}
CHAIN |= {"speed1": RPM_7000}


@settings(max_examples=60, deadline=None)
@given(
    values=some.lists(some.floats(-100.0, 100.0), min_size=3, max_size=9),
    start=some.floats(-6.0, 6.0),
)
def test_curve_meets_its_points_and_stays_between_neighbours_over_the_seam_too(values, start):
    phi = start + 2.0 * np.pi * np.arange(len(values)) / len(values)
    curve = table_curve(phi, np.array(values))
    size = 1e-12 * max(1.0, np.abs(values).max())
    np.testing.assert_allclose(curve(phi), values, atol=size)
    np.testing.assert_allclose(curve(phi + 2.0 * np.pi), values, atol=1e3 * size)  # the angle itself is rounded
    for k, low in enumerate(values):
        high = values[(k + 1) % len(values)]
        between = curve(phi[k] + np.linspace(0.0, 2.0 * np.pi / len(values), 17))
        assert between.min() >= min(low, high) - size
        assert between.max() <= max(low, high) + size


def test_curve_has_a_continuous_slope_at_the_seam_and_a_third_order_error_for_a_smooth_load():
    errors = []
    for n in (32, 64):
        phi = 2.0 * np.pi * np.arange(n) / n
        curve = table_curve(phi, np.exp(np.sin(phi)))
        at = np.linspace(-1.0, 8.0, 4001)
        errors.append(np.abs(curve(at) - np.exp(np.sin(at))).max())
        step = 1e-6
        slopes = [
            (curve(np.array(x + s * step)) - curve(np.array(x))) / (s * step)
            for x in (0.0, 2.0 * np.pi)
            for s in (1, -1)
        ]
        np.testing.assert_allclose(slopes, slopes[0], atol=1e-4)  # differences of step 1e-6
    assert errors[1] < errors[0] / 3.5  # monotone cubics are of second order at extrema


def test_a_table_of_both_ends_of_the_turn_is_that_without_the_second():
    phi = np.radians([0.0, 100.0, 200.0, 360.0])
    values = np.array([1.0, 3.0, 2.0, 1.0])
    assert table_curve(phi, values) == table_curve(phi[:-1], values[:-1])


def test_a_sine_over_the_whole_turn_is_a_table_although_it_ends_beside_its_beginning():
    phi = np.linspace(0.0, 2.0 * np.pi, 73)
    torque = -7.5e6 * np.sin(3.0 * phi)
    assert torque[-1] != torque[0]
    assert table_curve(phi, torque) == table_curve(phi[:-1], torque[:-1])


@pytest.mark.parametrize(
    ("phi", "values"),
    [
        ([0.0], [1.0]),
        ([0.0, 1.0], [1.0, np.nan]),
        ([0.0, 0.0, 1.0], [1.0, 1.0, 1.0]),
        ([0.0, 7.0], [1.0, 2.0]),
        ([0.0, 1.0, 2.0 * np.pi], [1.0, 2.0, 3.0]),
        ([0.0, 1.0], [1.0, 2.0, 3.0]),
    ],
)
def test_what_is_no_curve_over_a_turn_is_refused(phi, values):
    with pytest.raises(ValueError, match=r"angles|finite|turn"):
        table_curve(np.array(phi), np.array(values))


def test_series_is_the_sum_of_its_harmonics():
    curve = SeriesCurve(2.0, (0.5, 0.0, 0.25), (0.0, -1.0))
    np.testing.assert_allclose(
        curve(PHI), 2.0 + 0.5 * np.cos(PHI) + 0.25 * np.cos(3 * PHI) - np.sin(2 * PHI), atol=1e-14
    )


def test_a_constant_curve_changes_no_bit_against_the_constant_itself():
    table = GUIDE | MASSLESS | {"speed": RPM_7000}
    wanted = ["kinetostatics", "tool"]
    constant = sweep.evaluate("guide", table | {"tool_force": -12.0}, wanted, phi=PHI)
    curve = sweep.evaluate("guide", table, wanted, phi=PHI, loads={"tool_force": {"mean": -12.0}})
    assert constant.equals(curve)


def test_drive_torque_of_the_first_stage_is_the_work_of_a_force_over_the_angle_of_the_first_crank():
    given_phi, force = np.radians([0.0, 80.0, 150.0, 300.0]), np.array([0.0, -30.0, -4.0, 0.0])
    poses = sweep.evaluate(
        ["rssr", "guide"], CHAIN, ["ds", "drive_torque1"], phi=PHI, loads={"tool_force2": (given_phi, force)}
    )
    work = -table_curve(given_phi, force)(PHI) * poses.ds  # massless links: all that the drive gives is the tool's work
    np.testing.assert_allclose(poses.drive_torque1, work, atol=1e-10 * np.abs(work).max())
    assert np.abs(work).max() > 10.0


def test_load_torque_over_the_turn_enters_kinetostatics_and_friction_of_its_own_stage():
    curve = ([0.0, 2.0, 4.0], [0.0, -500.0, 200.0])
    poses = sweep.evaluate(["rssr", "guide"], CHAIN, ["drive_torque1", "dpsi1"], phi=PHI, loads={"load_torque1": curve})
    work = -table_curve(np.array(curve[0]), np.array(curve[1]))(PHI) * poses.dpsi1
    np.testing.assert_allclose(poses.drive_torque1, work, atol=1e-10 * np.abs(work).max())


def test_largest_value_over_the_turn_sees_the_curve():
    table, curve = GUIDE | MASSLESS | {"speed": RPM_7000}, (np.radians([0, 60, 90, 180]), [0.0, 0.0, -40.0, 0.0])
    found = sweep.summarise("guide", table, ["max_abs_tool_load"], accuracy=1e-8, loads={"tool_force": curve})
    assert found.max_abs_tool_load[0] == pytest.approx(40.0, rel=1e-8)
    assert sweep.summarise("guide", table, ["max_abs_tool_load"]).max_abs_tool_load[0] == 0.0  # negative control


@pytest.mark.parametrize(
    ("loads", "word"),
    [
        ({"tool_forc": (PHI, PHI)}, "did you mean 'tool_force'"),
        ({"m_tool": (PHI, PHI)}, "tool_force"),
        ({"tool_force": {"men": 1.0}}, "mean, cos and sin"),
        ({"tool_force": 3.0}, "a pair"),
        ({"tool_force": ([0.0, 9.0], [1.0, 2.0])}, "within one turn"),
        ({"tool_force": ([0.0, 1.0], [1.0, "x"])}, "number"),
        ({"tool_force": {"mean": [1.0, 2.0]}}, "one number"),
    ],
)
def test_what_is_no_load_over_the_turn_is_named(loads, word):
    with pytest.raises(InputError, match=word):
        sweep.summarise("guide", GUIDE | MASSLESS | {"speed": 1.0}, "max_abs_tool_load", loads=loads)


def test_a_machine_takes_the_loads_of_its_members():
    machine = {"needle": "guide"}
    table = {f"needle.{name}": x for name, x in (GUIDE | MASSLESS | {"speed": RPM_7000}).items()}
    found = sweep.evaluate(machine, table, "needle.tool_load", phi=PHI, loads={"needle.tool_force": {"mean": -3.0}})
    np.testing.assert_allclose(found["needle.tool_load"], 3.0, rtol=1e-15)


def test_the_name_of_an_effect_stands_for_its_outputs():
    table = GUIDE | MASSLESS | {"speed": RPM_7000, "m_tool": 2.5e-5}
    found = sweep.summarise("guide", table, "tool")
    assert [name for name in found if not name.startswith("err_")] == [
        "max_abs_tool_load",
        "max_abs_tool_torque",
        "status",
    ]
    assert list(sweep.evaluate("guide", table, ["tool", "s"], phi=0.3)) == [
        "design",
        "phi",
        "tool_load",
        "tool_torque",
        "s",
        "status",
    ]


@pytest.mark.parametrize("name", ["rssr", "rssp", "guide", "eyelet", ["rssr", "guide"]])
def test_outputs_that_an_effect_stands_for_exist(name):
    bare = family(name)
    for outputs in names_of_effects(bare).values():
        full = extended(bare, outputs)
        assert outputs
        for wanted in outputs:
            assert output(full, wanted).name == wanted
