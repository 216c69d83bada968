"""Margins for tolerances along the turn: against differences, as part of a curve's extrema, and in a robust search."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from sweep.families import family
from sweep.families.base import Angles
from sweep.optimise import Problem
from sweep.optimise.extrema.gradients import gradients, stepped
from sweep.optimise.extrema.points import Curves
from sweep.optimise.local.model import Model
from sweep.optimise.manufacture.curve_margins import (
    allowances,
    curve_derivatives,
    curve_margins,
    curves_with_margin,
    trigonometric_sum,
)
from sweep.optimise.problem.program import Program
from sweep.quantities.measures import Series
from sweep.study import Limit

GUIDE = family("guide")
DESIGN = np.array([1.0, 3.3, 3.1, 3.0, 4.2, 0.8, 1.1, -0.6, 1.0])
SIGMA = np.array([0.01, 0.01, 0.02, 0.01, 0.01, 0.01, 0.002, 0.01, 0.0])
LEVEL = 2.0


def problem(**more: object) -> Problem:
    names = ("a", "b", "c", "e", "xi", "eta", "lam", "h")
    low, high = DESIGN[:8] - 0.3, DESIGN[:8] + 0.3
    limits = (Limit("max_abs_dev", None, 4.0), Limit("stroke", 1.0, 3.0))
    return Problem(GUIDE, names, low, high, {"branch": 1.0}, "max_abs_d2s", limits, **more)  # type: ignore[arg-type]


def spread(design: np.ndarray, phi: np.ndarray) -> np.ndarray:
    """Standard deviation of the deviation at crank angles, by central differences of the family's poses."""
    total = np.zeros(len(phi))
    for k in np.flatnonzero(SIGMA):
        ends = []
        for sign in (1.0, -1.0):
            moved = design.copy()
            moved[k] += sign * 1e-5
            ends.append(GUIDE.poses(moved[None, :], Angles.of(phi[None, :]), frozenset({"dev"}))["dev"][0])
        total += (SIGMA[k] * (ends[0] - ends[1]) / 2e-5) ** 2
    return np.sqrt(total)


def test_changes_are_the_derivatives_times_the_standard_deviations() -> None:
    phi = np.linspace(0.0, 6.0, 7)
    found = curve_derivatives(GUIDE, DESIGN[None, :], SIGMA, ("dev",), phi)["dev"]
    assert found.shape == (1, 8, 7)
    # Central differences over 1e-5 are good to 1e-10 of the lengths, of which the root of eight squares is taken.
    np.testing.assert_allclose(np.sqrt((found[0] ** 2).sum(axis=0)), spread(DESIGN, phi), rtol=1e-7)


def test_room_is_the_spread_along_the_turn_and_follows_the_design_to_first_order() -> None:
    room = curve_margins(problem(), DESIGN, SIGMA, {"dev": LEVEL})["dev"]
    phi = np.linspace(0.1, 6.2, 40)
    # Sixteen harmonics of a curve as smooth as this leave 1e-6 of it.
    np.testing.assert_allclose(room.at(DESIGN[None, :], phi)[0], LEVEL * spread(DESIGN, phi), rtol=1e-4)
    step = np.array([1.0, -2.0, 1.5, 0.5, -1.0, 2.0, 0.3, 1.0, 0.0]) * 1e-3
    before, after = room.at(np.array([DESIGN - step, DESIGN + step]), phi)
    true = LEVEL * (spread(DESIGN + step, phi) - spread(DESIGN - step, phi))
    np.testing.assert_allclose(after - before, true, rtol=0.0, atol=2e-3 * np.abs(true).max())
    h = 1e-5
    slope = (room.at(DESIGN[None, :], phi + h) - room.at(DESIGN[None, :], phi - h))[0] / (2.0 * h)
    np.testing.assert_allclose(room.slope(DESIGN, phi), slope, rtol=0.0, atol=1e-8)


def test_extrema_with_room_are_those_of_the_curve_and_its_room_together() -> None:
    own = problem(curve_margins=curve_margins(problem(), DESIGN, SIGMA, {"dev": LEVEL}))
    points, turns = Curves(own, (Series("dev"),)).scan(DESIGN, 64)
    assert turns
    phi = np.linspace(0.0, 2.0 * np.pi, 20001)
    dev = GUIDE.poses(DESIGN[None, :], Angles.of(phi[None, :]), frozenset({"dev"}))["dev"][0]
    room = own.curve_margins["dev"].at(DESIGN[None, :], phi)[0]
    # A grid of 20 000 angles misses a maximum by half the curvature times 1.6e-4 squared.
    assert points.value[points.sense > 0].max() == pytest.approx((dev + room).max(), abs=1e-7)
    assert points.value[points.sense < 0].min() == pytest.approx((dev - room).min(), abs=1e-7)
    assert points.value.max() > dev.max() + 0.5 * room.min()


def test_gradients_with_room_equal_differences() -> None:
    own = problem(curve_margins=curve_margins(problem(), DESIGN, SIGMA, {"dev": LEVEL}))
    curves = Curves(own, (Series("dev"),))
    points, _ = curves.scan(DESIGN, 64)
    fractions = own.scaled(DESIGN[None, :])[0]
    values, _ = gradients(curves, stepped(own, DESIGN, fractions), points, False)
    for j in range(8):
        moved = np.repeat(fractions[None, :], 2, axis=0)
        moved[:, j] += [1e-5, -1e-5]
        ends = [curves.follow(own.placed(DESIGN, x), points).value for x in moved]
        np.testing.assert_allclose(values[:, j], (ends[0] - ends[1]) / 2e-5, rtol=0.0, atol=1e-7)


def test_only_limits_on_largest_values_have_a_room_along_the_turn() -> None:
    assert curves_with_margin(problem()) == {"max_abs_dev": "dev"}  # the stroke is a difference, the objective no limit


def test_largest_value_that_has_to_be_large_has_no_room_along_the_turn() -> None:
    """The room lifts maxima, which would make such a limit easier, not harder: it gives up an amount instead."""
    below = replace(problem(), limits=(Limit("max_abs_dev", 1.0, None),))
    assert curves_with_margin(below) == {}
    sides = replace(problem(), limits=(Limit("max_dev", None, 4.0), Limit("min_dev", -4.0, None)))
    assert curves_with_margin(sides) == {"max_dev": "dev", "min_dev": "dev"}


def test_trigonometric_sum_and_its_slope() -> None:
    rng = np.random.default_rng(0)
    coefficients, phi = rng.standard_normal((3, 33)), rng.uniform(-10.0, 10.0, 50)
    k = np.arange(1, 17)
    cosines, sines = np.cos(np.outer(k, phi)), np.sin(np.outer(k, phi))
    even, odd = coefficients[:, 1::2], coefficients[:, 2::2]
    out = trigonometric_sum(coefficients, phi)
    np.testing.assert_allclose(out, coefficients[:, :1] + even @ cosines + odd @ sines, rtol=0.0, atol=1e-13)
    out = trigonometric_sum(coefficients, phi, True)
    np.testing.assert_allclose(out, (odd * k) @ cosines - (even * k) @ sines, rtol=0.0, atol=2e-12)


def test_allowance_moves_a_bound_with_the_design_and_its_slope_is_in_the_gradients() -> None:
    plain = problem()
    # A room of the stroke that grows with the crank's length and with h, as a function of the design.
    given = allowances(plain, DESIGN, lambda row: {"stroke": 0.5 * row[0] ** 2 + 0.1 * np.sin(row[7])})
    assert given["stroke"].names == plain.variables
    # Central differences over 6e-5 of a sine are good to 1e-9.
    np.testing.assert_allclose(given["stroke"].slopes[[0, 7]], [DESIGN[0], 0.1 * np.cos(DESIGN[7])], rtol=1e-8)
    np.testing.assert_allclose(given["stroke"].slopes[1:7], 0.0, atol=1e-9)
    moving = problem(allowances=given)
    models = [Model(x, Program(x), DESIGN, lambda: False) for x in (plain, moving)]
    there = plain.scaled(DESIGN[None, :])[0] + 0.01
    rows, slopes = [], []
    for model in models:
        state = model.state(there)
        own = [k for k, label in enumerate(state.form.labels) if label.name == "stroke"]
        rows.append(state.form.rows(state.atoms, 0.0)[own])
        slopes.append(model.jacobian(there, state.form, state.form.points)[own])
    moved = float(given["stroke"].slopes @ (moving.placed(DESIGN, there) - DESIGN)[:8])
    state = models[1].state(there)
    sides = {label.side for label in state.form.labels if label.name == "stroke"}
    assert sides == {"minimum", "maximum"} and moved > 1e-3
    # Both bounds of the band come nearer by as much, so every row of the stroke is smaller and steeper alike.
    assert (rows[1] < rows[0]).all()
    change = slopes[1] - slopes[0]
    assert (change[:, 0] < 0.0).all() and (np.abs(change[:, 1:7]) < 1e-7).all()
