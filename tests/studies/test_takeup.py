"""An accepted cam take-up, optimum of an earlier study with one path and no speed: figures recomputed, four peaks."""

from __future__ import annotations

import json

import numpy as np
import pytest

import sweep
from tests.support.studies import EARLIER, beside_needle208

GRAM_FORCE = 9.80665e-3


@pytest.fixture(scope="module")
def accepted(tmp_path_factory):
    study = beside_needle208("takeup", tmp_path_factory.mktemp("takeup"))
    return study, json.loads((EARLIER / "takeup" / "expected.json").read_text())


def test_accepted_cam_has_its_accepted_figures_and_keeps_the_limits(accepted):
    study, expected = accepted
    found = sweep.summarise(study.bare, expected["optimum"]["design"], list(study.want), accuracy=1e-6).iloc[0]
    for name, value in expected["optimum"]["outputs"].items():
        if not name.startswith("phi_"):  # of equal peaks the least rounding decides which is the largest
            assert found[name] == pytest.approx(value, rel=1e-6, abs=1e-9), name
    for limit in study.limits:
        assert limit.minimum is None or found[limit.output] >= limit.minimum - 1e-6
        assert limit.maximum is None or found[limit.output] <= limit.maximum + 1e-6


def test_best_cam_halves_the_peak_of_the_cam_that_fits_the_demand(accepted):
    study, expected = accepted
    best = expected["optimum"]["outputs"]["max_upper_tension"] / GRAM_FORCE
    fitted = sweep.summarise(study.bare, study.reference, ["max_upper_tension"], accuracy=1e-6).max_upper_tension[0]
    assert best == pytest.approx(196.0, abs=0.5)
    assert fitted / GRAM_FORCE == pytest.approx(410.0, abs=1.0)


def test_best_cam_has_four_equal_peaks_and_is_tight_where_the_needle_is_up(accepted):
    study, expected = accepted
    phi = np.radians(np.arange(0.0, 360.0, 0.5))
    turn = sweep.evaluate(study.bare, expected["optimum"]["design"], ["upper_tension", "upper_surplus"], phi=phi)
    pull = turn.upper_tension.to_numpy()
    peaks = (pull > np.roll(pull, 1)) & (pull >= np.roll(pull, -1)) & (pull > (1.0 - 1e-3) * pull.max())
    assert peaks.sum() == 4
    tight = np.degrees(turn.phi[turn.upper_surplus < 1e-3])
    assert ((tight < 95.0) | (tight > 265.0)).all()
    assert turn.upper_surplus[(turn.phi > np.radians(100.0)) & (turn.phi < np.radians(260.0))].min() > 0.4


def test_stock_shifts_the_surplus_and_nothing_else(accepted):
    study, expected = accepted
    design = expected["optimum"]["design"]
    wanted = ["min_upper_surplus", "range_upper_surplus", "cam.min_S"]
    more = sweep.summarise(study.bare, design | {"upper_stock": design["upper_stock"] + 0.25}, wanted, accuracy=1e-6)
    assert more.min_upper_surplus[0] == pytest.approx(0.25, abs=1e-6)
    assert more.range_upper_surplus[0] == pytest.approx(2.0, abs=1e-6)
