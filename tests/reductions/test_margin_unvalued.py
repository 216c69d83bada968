"""Whether a linkage turns, without the margin of those that do not: the same verdicts as with it."""

from __future__ import annotations

import numpy as np
import pytest

import sweep
from sweep.families import NAMES, family
from sweep.families.base import Accuracy
from sweep.families.capabilities import Assembly
from sweep.reductions.margins import FEW, own_step

# Families whose margin comes from poses: those without a step of their own.
FROM_POSES = [
    name
    for name in NAMES
    if family(name).find(Assembly)
    and family(name).example
    and own_step(family(name), "", Accuracy(target=1e-8)) is None
]


def near_the_example(name: str, count: int, spread: float) -> dict[str, np.ndarray]:
    """Designs about a family's example, wide enough that many of them do not turn."""
    rng = np.random.default_rng(sorted(NAMES).index(name))
    found, example = family(name), family(name).example
    wide = {p.name: p.choices is None and p.name in example for p in found.parameters}
    return {
        key: value * (1.0 + spread * rng.uniform(-1.0, 1.0, count)) if wide[key] else np.full(count, value)
        for key, value in example.items()
    }


def test_families_are_looked_at():
    assert "five_link" in FROM_POSES and len(FROM_POSES) >= 4


@pytest.mark.parametrize("name", FROM_POSES)
def test_verdict_does_not_depend_on_whether_the_margin_is_asked(name):
    table = near_the_example(name, 60, 0.5)
    alone = sweep.summarise(name, table, ["rotatable", "max_pressure_angle"], accuracy=1e-6)
    beside = sweep.summarise(name, table, ["rotatable", "max_pressure_angle", "margin"], accuracy=1e-6)
    for column in alone.columns:
        np.testing.assert_array_equal(alone[column], beside[column], err_msg=column)


def test_margin_on_samples_is_the_least_of_them_where_the_links_do_not_reach():
    table = near_the_example("five_link", 200, 0.5)
    rough = sweep.summarise("five_link", table, ["margin"], samples=FEW)
    exact = sweep.summarise("five_link", table, ["margin"], accuracy=1e-8)
    np.testing.assert_array_equal(rough["status"], exact["status"])
    turns = (exact["status"] == 0).to_numpy()
    np.testing.assert_array_equal(rough["margin"][turns], exact["margin"][turns])
    # Where the rocker's ball reaches nothing at all, five-links have no discriminant, and no margin then.
    fails = ~turns & exact["margin"].notna().to_numpy()
    assert 20 < fails.sum() < 180
    assert (rough["margin"][fails] >= exact["margin"][fails] - 1e-9).all() and (rough["margin"][fails] < 0.0).all()
    poses = sweep.evaluate("five_link", table, ["discriminant"], phi=np.arange(FEW) * 2.0 * np.pi / FEW)
    least = poses["discriminant"].to_numpy().reshape(-1, FEW).min(axis=1)
    scale = (2.0 * np.asarray(table["b"]) * np.asarray(table["c"])) ** 2
    seen = fails & (least < 0.0)
    assert seen.sum() > 0.9 * fails.sum()
    np.testing.assert_allclose(rough["margin"][seen], (least / scale)[seen], rtol=1e-12)
