"""Mean loads and lives over the turn against integrals split at every kink and jump by an independent search."""

from __future__ import annotations

from functools import lru_cache

import numpy as np
import pytest

import sweep
from kernels import status as st
from studies.accuracy.ordinary import designs as bench_designs
from sweep.effects import extended
from sweep.evaluation.summaries import design_outputs
from sweep.families import family
from sweep.families.base import Accuracy, Angles
from tests.support.near_change_points import near_change_points
from tests.support.rssr_designs import margins

WANT = ["mean_load_d1", "mean_load_d2", "life_d1", "life_d2"]
RSSR = extended(family("rssr"), WANT)
OWN = 8
NODES, WEIGHTS = np.polynomial.legendre.leggauss(8)
SWITCH = ("radial_load_d1", "radial_load_d2", "axial_load_d", "dpsi")
AT = {name: k for k, name in enumerate(RSSR.parameter_names)}


def ordinary(n):
    rows = bench_designs(RSSR, 4 * n)
    return rows[margins(np.ascontiguousarray(rows[:, :OWN]))["margin"] > 1e-3][:n]


def switching(n):
    """Designs whose bearings pass e_limit, where the load jumps."""
    rows = ordinary(n)
    rows[:, AT["e_limit"]] = np.random.default_rng(1).uniform(0.01, 1.0, len(rows))
    return rows


def stretched(n):
    """Designs next to change points, as large as the others."""
    rows = ordinary(n)
    hard = near_change_points(len(rows), 9, 1.0, 1e-8, 1e-3)
    rows[:, :OWN] = hard
    rows[:, :6] *= 30.0
    return rows


def values(design, phi, names):
    found = RSSR.precise().poses(design[None], Angles.of(phi[None]), frozenset(names))
    return [np.asarray(found[name][0], np.float64) for name in names]


def conditions(design, phi):
    """What changes its sign where the integrand has a kink or a jump."""
    first, second, axial, dpsi = values(design, phi, SWITCH)
    limit = design[AT["e_limit"]] * design[AT["rotation_factor"]]
    on = (first, second)[int(design[AT["axial_support"]]) - 1]
    return np.stack([dpsi, np.abs(axial) - limit * on, axial])


def naive(design):
    """Mean loads and lives: a grid about the deepest dip, every sign change bisected, Gauss rules between."""
    deepest = margins(np.ascontiguousarray(design[None, :OWN]))["phi_min"][0]
    away = 1.3 ** np.arange(-75.0, 4.0)
    away = away[away < np.pi]
    grid = deepest + np.unique(np.concatenate([np.linspace(-np.pi, np.pi, 20001), away, -away]))
    signs = conditions(design, grid)
    which, column = np.nonzero(signs[:, 1:] * signs[:, :-1] < 0.0)
    low, high, sign = grid[column], grid[column + 1], np.sign(signs[which, column])
    for _ in range(60):
        middle = 0.5 * (low + high)
        same = np.sign(conditions(design, middle)[which, np.arange(which.size)]) == sign
        low, high = np.where(same, middle, low), np.where(same, high, middle)
    edges = np.sort(np.concatenate([grid, 0.5 * (low + high)]))
    half = 0.5 * np.diff(edges)[:, None]
    phi, weight = (0.5 * (edges[1:] + edges[:-1])[:, None] + half * NODES).ravel(), (half * WEIGHTS).ravel()
    first, second, dpsi = values(design, phi, ("equivalent_load_d1", "equivalent_load_d2", "dpsi"))
    way, p = np.abs(dpsi) * weight, design[AT["life_exponent"]]
    means = [load.max() * (((load / load.max()) ** p * way).sum() / way.sum()) ** (1.0 / p) for load in (first, second)]
    turns = [1e6 * (design[AT["dynamic_capacity"]] / mean) ** p for mean in means]
    per_time = way.sum() / (2.0 * np.pi) * design[AT["speed"]] / (2.0 * np.pi)
    return [*means, *(turn / per_time for turn in turns)]


@lru_cache
def population(make):
    """Designs and what the naive integrals say of them."""
    rows = make(12)
    return rows, np.array([naive(row) for row in rows])


@pytest.mark.parametrize("make", [ordinary, switching, stretched])
@pytest.mark.parametrize("target", [1e-4, 1e-8, 1e-10])
def test_mean_loads_and_lives_are_as_exact_as_asked_and_their_errors_hold(make, target):
    rows, exact = population(make)
    found = design_outputs(RSSR, rows, WANT, Accuracy(target=target))
    good = found["status"] == st.OK
    assert good.mean() > 0.9
    for k, name in enumerate(WANT):
        off, err = np.abs(found[name] - exact[:, k]), found[f"err_{name}"]
        # The reference: zeros closer than 3e-4 rad are not seen, Gauss rules of 8 points.
        assert (off <= err + 3e-11 * exact[:, k])[good].all(), name
        assert (err <= 8.0 * target * exact[:, k])[good].all(), name


def test_a_grid_errs_more_than_it_knows():
    """Negative control: what a grid of 720 poses says of designs near change points."""
    rows, exact = population(stretched)
    coarse = design_outputs(RSSR, rows, ["mean_load_d1"], Accuracy(samples=720))
    assert (np.abs(coarse["mean_load_d1"] - exact[:, 0]) > 0.01 * exact[:, 0]).sum() > 2


def test_samples_are_those_asked_for():
    rows = ordinary(5)
    a, b = (design_outputs(RSSR, rows, ["mean_load_d1"], Accuracy(samples=n))["mean_load_d1"] for n in (90, 720))
    assert (a != b).all()
    np.testing.assert_allclose(a, b, rtol=1e-2)


def test_bearings_that_carry_nothing_have_a_mean_load_and_no_life():
    row = ordinary(1)[:1]
    for name, k in AT.items():
        if name.startswith(("m_", "j_", "load_", "gravity")):
            row[:, k] = 0.0
    table = {name: row[:, k] for name, k in AT.items()}
    found = sweep.summarise("rssr", table, WANT).iloc[0]
    assert found["status"] == st.INVALID_INPUT
    assert found["mean_load_d1"] == 0.0 and np.isnan(found["life_d1"])
    alone = sweep.summarise("rssr", table, ["mean_load_d1"]).iloc[0]
    assert alone["status"] == st.OK and alone["mean_load_d1"] == 0.0 and alone["err_mean_load_d1"] == 0.0
