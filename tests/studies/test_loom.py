"""The studies feed208, heddle-shafts and backrest: files are in order, accepted figures recomputed."""

from __future__ import annotations

import json
import math
from pathlib import Path

import numpy as np
import pytest

import sweep
from sweep.study import load_study

STUDIES = Path(__file__).resolve().parents[2] / "studies"


def accepted(name):
    return json.loads((STUDIES / name / "expected.json").read_text())


@pytest.mark.parametrize("name", ["feed208", "heddle-shafts", "backrest"])
def test_study_file_is_accepted(name):
    assert load_study(STUDIES / name / "study.toml").name == name


def test_backrest_best_design_is_recomputed():
    expected = accepted("backrest")
    outputs = {k: v for k, v in expected["design"].items() if k.startswith(("max_", "min_"))}
    table = {k: v for k, v in expected["design"].items() if k not in outputs}
    got = sweep.summarise("backrest", table, list(outputs), accuracy=1e-9).iloc[0]
    assert got.status == 0
    for name, value in outputs.items():
        assert got[name] == pytest.approx(value, rel=expected["relative_tolerance"])


def test_feed208_contact_is_lost_between_the_speeds_of_the_table():
    base = {
        "h_a": 2.0, "h_b": 34.0, "h_c": 16.0, "h_e": 35.0, "rh": 12.0, "dh": math.radians(-17.0), "xE": 56.0, "yE": 7.0,
        "rE": 0.9, "dE": math.radians(45.0), "q": 26.0, "fx": -17.0, "fy": 6.0, "tx": -3.0, "ty": 9.0, "y_plate": 14.8,
        "h_sigma": -1.0, "bar_branch": -1.0, "m": 6e-5,
    }  # fmt: skip
    expected = accepted("feed208")
    for row in expected["first_flight"]:
        last = row["rpm"] or 8000.0
        speeds = np.array([last - 125.0, last]) * math.pi / 30.0
        got = sweep.summarise("feed_foot", base | {"k": row["k"], "F0": row["F0"], "omega": speeds}, ["flights"])
        assert (got.flights > 0.0).tolist() == [False, row["rpm"] is not None]


def test_heddle_shafts_strokes_and_accelerations_are_recomputed():
    expected = accepted("heddle-shafts")
    table = {
        "a1": 14.0, "b1": 160.0, "c1": 72.0, "e1": 160.0, "f1": 0.0, "g1": 0.0, "alpha1": 0.0, "O2B2": 192.5,
        "BC2": 225.0, "O3C2": 138.5, "O2O32": 160.0, "O4E2": 138.5, "chi_mid2": math.radians(65.0), "O4F2": 138.5,
        "O3O42": 900.0, "DF2": 900.0, "offset2": math.radians(192.0), "O3D2": [s["O3D2"] for s in expected["shafts"]],
    }  # fmt: skip
    got = sweep.summarise(["rssr", "heddle"], table, ["stroke", "max_abs_d2y", "max_y", "min_y"], accuracy=1e-8)
    for name in ("stroke", "max_abs_d2y", "max_y", "min_y"):
        np.testing.assert_allclose(got[name], [s[name] for s in expected["shafts"]], rtol=1e-6)
    # in proportion to the arm within 1 %
    per_arm = got.stroke / np.array([s["O3D2"] for s in expected["shafts"]])
    assert np.ptp(per_arm) < 0.01 * per_arm.mean()


def test_heddle_shafts_of_one_loom_have_their_strokes_and_a_symmetric_shed():
    import importlib.util

    spec = importlib.util.spec_from_file_location("heddle_shafts", STUDIES / "heddle-shafts" / "figure.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    rows, expected = module.table(), accepted("heddle-shafts")["loom"]
    assert (rows.status == 0).all()
    # the chain from the cam gives the strokes that the synthesis was asked for
    np.testing.assert_allclose(rows.made, rows.stroke, rtol=1e-8)
    for name in ("stroke", "O3D", "DF", "y_high", "y_low", "acceleration"):
        np.testing.assert_allclose(rows[name], [row[name] for row in expected], rtol=1e-6)
    assert rows.asymmetry.abs().max() < 0.2 and abs(rows.asymmetry[3]) < 1e-9
    assert rows.acceleration.iloc[-1] / rows.acceleration.iloc[0] == pytest.approx(1.64, abs=0.005)
