"""Slopes of sensitivities against differences of what summaries say: tied tops, dimensions of very different sizes."""

from __future__ import annotations

import numpy as np
import pytest

import sweep
from sweep.effects import extended
from sweep.evaluation.summaries import design_outputs
from sweep.families import family
from sweep.families.base import Accuracy
from sweep.optimise.manufacture.tolerance import sensitivities

FINE = Accuracy(target=1e-10)
STEP = 1e-4


def design(full, values):
    """A design row of the family, with defaults for what is not given."""
    return np.array([values.get(p.name, p.default or 0.0) for p in full.parameters])


def slope_of_summaries(full, row, output, parameter):
    """Fourth-order difference of a design output."""
    rows = np.tile(row, (4, 1))
    rows[:, full.parameter_names.index(parameter)] += np.array([-2.0, -1.0, 1.0, 2.0]) * STEP
    return (
        np.asarray(design_outputs(full, rows, [output], FINE)[output]) @ np.array([1.0, -8.0, 8.0, -1.0]) / 12.0 / STEP
    )


def test_of_tops_alike_the_place_of_the_first_counts_as_in_summaries():
    """A member of ratio -2 has every top twice a turn."""
    full = family(sweep.machine({"p": {"family": "geared_dwell", "ratio": -2, "offset": 0.7}}))
    row = design(full, {f"p.{name}": value for name, value in family("geared_dwell").example.items()})
    output = "p.phi_max_abs_y_b"
    found = sensitivities(full, row, [output])
    expected = slope_of_summaries(full, row, output, "p.k")
    assert found["value"][0] == pytest.approx(design_outputs(full, row[None], [output], FINE)[output][0], abs=1e-8)
    assert found["growing"][found["parameter"].index("p.k")] == pytest.approx(expected, rel=1e-6)


def test_a_small_dimension_does_not_drown_the_slopes_of_others_in_rounding():
    """The step of a difference suits each dimension by itself: 1e-8 is what fourth-order differences are good to."""
    output = "max_force_c_y"
    full = extended(family("rssr"), (output.removeprefix("max_"),))
    given = {"m_coupler": 1e-4, "m_rocker": 1e-4, "speed": 200.0}
    row = design(full, dict(family("rssr").example) | given)
    found = sensitivities(full, row, [output])
    slope = found["growing"][found["parameter"].index("alpha")]
    assert slope == pytest.approx(slope_of_summaries(full, row, output, "alpha"), rel=1e-8)


@pytest.mark.parametrize("parameter", ["p.x_tilt", "p.y_tilt", "q.x_tilt", "q.y_tilt", "q.z_at"])
def test_a_box_of_planar_members_has_the_slopes_of_all_joints_in_its_outer_planes(parameter):
    """Where a plane tilts, the joint that rises most at its angle of the turn is foremost, on either side another."""
    above = {
        "family": "slider_crank",
        "place": {"at": [0.0, 0.0, 2.0], "axis": [0.0, 0.0, 1.0], "zero": [1.0, 0.0, 0.0]},
    }
    full = family(sweep.machine({"p": {"family": "four_bar"}, "q": above}))
    given = {"p": family("four_bar").example, "q": family("slider_crank").example}
    row = design(full, {f"{member}.{name}": x for member, own in given.items() for name, x in own.items()})
    found = sensitivities(full, row, ["box_z"])
    moved = np.tile(row, (5, 1))
    moved[:, full.parameter_names.index(parameter)] += np.array([-2.0, -1.0, 0.0, 1.0, 2.0]) * STEP
    box = np.asarray(design_outputs(full, moved, ["box_z"], FINE)["box_z"])
    place = found["parameter"].index(parameter)
    # One-sided differences of second order: the square of the step remains.
    assert found["growing"][place] == pytest.approx(box[2:] @ [-1.5, 2.0, -0.5] / STEP, rel=1e-6)
    assert found["shrinking"][place] == pytest.approx(box[:3] @ [0.5, -2.0, 1.5] / STEP, rel=1e-6)


@pytest.mark.parametrize("beside", [1e-6, -1e-6, 3e-7])
def test_of_nearly_equal_slopes_of_a_constant_the_largest_counts_wherever_the_samples_lie(beside):
    """z_b of a planar stage grows with alpha2 by -a2 sin(phi2), whose ends over the swing of stage 1 are nearly alike.

    The lower one lay closer to a sample, and the slope was 9e-7 too small.
    """
    full, driver = family(["rssr", "rssr"]), family("rssr").example
    turn = np.linspace(0.0, 2.0 * np.pi, 20001)
    psi = sweep.evaluate("rssr", driver, ["psi"], phi=turn)["psi"].to_numpy()
    offset = 0.5 * np.pi - 0.5 * (psi.min() + psi.max()) + beside
    given = {f"{name}1": x for name, x in driver.items()} | {"a2": 1.0, "b2": 4.1, "c2": 3.2, "e2": 2.9}
    found = sensitivities(full, design(full, given | {"branch2": 1.0, "offset2": offset}), ["max_z_b2"])
    place = found["parameter"].index("alpha2")
    slopes = -np.sin(psi + offset)
    # The slope is refined to angles of 6e-6 rad, and the samples of psi leave 1e-9.
    assert found["growing"][place] == pytest.approx(slopes.max(), rel=1e-8)
    assert found["shrinking"][place] == pytest.approx(slopes.min(), rel=1e-8)
