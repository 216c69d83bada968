"""Gradients by the complex step against mpmath and against differences of whole solutions."""

from __future__ import annotations

import math

import mpmath as mp
import numpy as np
import pytest

from sweep.families import family
from sweep.families.base import Accuracy
from sweep.optimise import Problem
from sweep.optimise.extrema.gradients import gradients, scalar_gradient, stepped
from sweep.optimise.extrema.points import Curves, Points
from sweep.optimise.extrema.scanned import STATIC
from sweep.optimise.local.model import Model
from sweep.optimise.problem.program import Program
from sweep.quantities.measures import Series
from sweep.study import Limit

NAMES = ("a", "b", "c", "e", "f", "g", "alpha")
DESIGN = np.array([1.0, 4.0, 2.5, 3.1, 0.7, -0.6, 0.9, -1.0])


def rssr(objective="max_abs_d2psi", limits=()):
    values = DESIGN[:7]
    lower, upper = values - 0.4, values + 0.6
    return Problem(family("rssr"), NAMES, lower, upper, {"branch": -1.0}, objective, limits)


def psi_mp(parameters, phi, sigma):
    """Rocker angle from the geometry of the joints: |C - B| = b in the frame of the theory sheet."""
    a, b, c, e, f, g, alpha = parameters
    x = e - a * mp.cos(phi)
    y = f * mp.sin(alpha) + a * mp.cos(alpha) * mp.sin(phi)
    z = f * mp.cos(alpha) - a * mp.sin(alpha) * mp.sin(phi) - g
    # x^2 + y^2 + z^2 + c^2 + 2c (x cos psi - y sin psi) = b^2
    w = (x * x + y * y + z * z + c * c - b * b) / (2 * c)
    return mp.atan2(y, -x) + sigma * mp.acos(w / mp.sqrt(x * x + y * y))


@pytest.mark.parametrize(("output", "order"), [("psi", 0), ("dpsi", 1), ("d2psi", 2)])
def test_gradient_of_a_pose_output_equals_mpmath(output, order):
    problem = rssr()
    curves = Curves(problem, (Series(output),))
    phi = np.array([0.3, 2.0, 4.4])
    points = curves.follow(DESIGN, Points.of([(0, x, 1.0, STATIC, math.nan, 0.0) for x in phi]))
    found, _ = gradients(curves, stepped(problem, DESIGN, problem.scaled(DESIGN[None, :])[0]), points, False)
    with mp.workdps(40):
        exact = [mp.mpf(float(x)) for x in DESIGN[:7]]
        for k, x in enumerate(phi):
            for j in range(7):

                def curve(value, j=j, x=x):
                    parameters = [*exact[:j], value, *exact[j + 1 :]]
                    return mp.diff(lambda t: psi_mp(parameters, t, -1), mp.mpf(float(x)), order)

                wanted = float(mp.diff(curve, exact[j]) * problem.span[j])
                # The kernel's own rounding, 2^-53 times a condition of about 10; the complex step adds none.
                assert found[k, j] == pytest.approx(wanted, rel=1e-12, abs=1e-13)


def objective_of(problem, output, fractions, base):
    model = Model(problem, Program(problem), base, lambda: False)
    state = model.state(fractions)
    measure = next(r.measure for r in model.program.requirements if r.measure.name == output)
    return model.program.value(measure, state.form, model.curves, state.design, state.atoms)


@pytest.mark.parametrize("output", ["phi0", "swing", "psi_ext", "psi_fold", "phi_ext", "phi_fold", "max_x_c", "margin"])
def test_gradient_of_a_limit_equals_differences_of_the_true_output(output):
    problem = rssr(limits=(Limit(output, -10.0, None),))
    model = Model(problem, Program(problem), DESIGN, lambda: False)
    at = problem.scaled(DESIGN[None, :])[0]
    state = model.state(at)
    jacobian = model.jacobian(at, state.form, state.form.points)
    row = next(k for k, label in enumerate(state.form.labels) if label.name == output)
    scale = 1.0 if output == "margin" else 10.0
    step = 1e-4
    for j in range(7):
        values = []
        for n in (-2, -1, 1, 2):
            moved = at.copy()
            moved[j] += n * step
            values.append(objective_of(problem, output, moved, DESIGN))
        difference = (values[0] - 8 * values[1] + 8 * values[2] - values[3]) / (12 * step)
        assert jacobian[row, j] * scale == pytest.approx(difference, rel=1e-7, abs=1e-9)


def test_what_has_no_derivative_spoils_the_rows_that_ask_for_it_and_no_others(monkeypatch):
    problem = rssr(limits=(Limit("phi0", -10.0, None), Limit("margin", -10.0, None)))
    model = Model(problem, Program(problem), DESIGN, lambda: False)
    at = problem.scaled(DESIGN[None, :])[0]
    state = model.state(at)
    whole = model.jacobian(at, state.form, state.form.points)

    def lost(*arguments, **options):
        values, moves = gradients(*arguments, **options)
        moves[angle, 0] = np.inf  # the crank angle of an extremum whose second derivative vanishes
        return values, moves

    count = len(state.form.points)  # the rows are made of so many values and so many crank angles
    angle = int(np.flatnonzero(state.form.matrix[:, count : 2 * count].any(axis=0))[0])
    asking = state.form.matrix[:, count + angle] != 0.0
    assert 0 < asking.sum() < len(asking)
    monkeypatch.setattr("sweep.optimise.local.model.gradients", lost)
    found = model.jacobian(at, state.form, state.form.points)
    assert np.isnan(found[asking]).all()
    np.testing.assert_array_equal(found[~asking], whole[~asking])


def test_gradient_at_a_window_edge_follows_the_edge():
    guide = family("guide")
    names = ("a", "b", "c", "e", "xi", "eta", "lam", "h")
    base = np.array([1.0, 2.4, 2.6, 2.1, 4.8, 0.2, 0.05, -3.9, -1.0])
    limits = (Limit("max_abs_dev", None, 0.01),)
    problem = Problem(guide, names, base[:8] - 0.5, base[:8] + 0.5, {}, "max_abs_d2s", limits, window=(0.1, 0.55))
    model = Model(problem, Program(problem), base, lambda: False)
    at = np.full(8, 0.5)
    state = model.state(at)
    jacobian = model.jacobian(at, state.form, state.form.points)
    rows = state.form.rows(state.atoms, 0.0)
    own = [k for k, label in enumerate(state.form.labels) if label.name == "max_abs_dev"]
    worst = min(own, key=lambda k: rows[k])
    assert int(state.form.points.kind[np.flatnonzero(state.form.matrix[worst])[0]]) == 1, "the edge should be the worst"
    step = 1e-4
    for j in range(8):
        values = []
        for n in (-2, -1, 1, 2):
            moved = at.copy()
            moved[j] += n * step
            values.append(objective_of(problem, "max_abs_dev", moved, base))
        difference = (values[0] - 8 * values[1] + 8 * values[2] - values[3]) / (12 * step)
        assert -jacobian[worst, j] * 0.01 == pytest.approx(difference, rel=1e-7, abs=1e-8)


def test_difference_rule_is_exact_for_quartics_and_stays_inside_the_bounds():
    seen = []

    def quartic(x):
        seen.append(x)
        return (x**4).sum(axis=1) + x[:, 0]

    at = np.array([0.0, 0.4, 1.0])
    found = scalar_gradient(quartic, at)
    assert found == pytest.approx(4 * at**3 + np.array([1.0, 0.0, 0.0]), abs=1e-10)
    assert np.concatenate(seen).min() >= 0.0 and np.concatenate(seen).max() <= 1.0


def test_followed_extrema_equal_scanned_ones():
    problem = rssr()
    curves = Curves(problem, (Series("d2psi"),))
    points, turns = curves.scan(DESIGN, 256)
    assert turns
    moved = DESIGN.copy()
    moved[:7] *= 1.02
    followed, (fresh, _) = curves.follow(moved, points), curves.scan(moved, 256)
    near = np.abs(np.sin(0.5 * (followed.phi[:, None] - fresh.phi))).min(axis=1)
    assert near.max() < 1e-6


def test_accuracy_samples_set_the_grid_of_the_scan():
    problem = Problem(
        family("rssr"), ("a",), DESIGN[:1] - 0.1, DESIGN[:1] + 0.1, {}, "max_abs_d2psi", (), None, Accuracy(samples=32)
    )
    assert Model(problem, Program(problem), DESIGN, lambda: False).samples == 32
