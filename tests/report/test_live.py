"""What the page's scripts get: motions of the kernels, lines that are rows of the dataset, JSON that stays JSON."""

from __future__ import annotations

import base64
import json
import re
from dataclasses import replace

import numpy as np
import pandas as pd
import pytest

import sweep
from sweep.report.dataset import gather
from sweep.report.live import BEST, POSES, SPREAD, live, moving, parallel, runs
from sweep.report.optima import Shown, groups, shown_designs
from sweep.report.page import write_report
from sweep.study import study_from_data
from tests.support.report_dataset import study_data, write_dataset

FOUR_BAR = {"a": 10.0, "b": 35.0, "c": 30.0, "e": 32.0, "xi": 20.0, "eta": 5.0}


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    return write_dataset(tmp_path_factory.mktemp("live") / "designs", optimum={})


@pytest.fixture(scope="module")
def gathered(folder):
    return gather(folder)


@pytest.fixture(scope="module")
def four_bars(tmp_path_factory):
    """A real sweep of planar four-bars, a reference that does not turn among them."""
    study = {
        "study": {"name": "bars"},
        "mechanism": {"family": "four_bar"},
        "scene": {"want": ["max_abs_d2psi", "max_pressure_angle"], "speed": "600 rpm"},
        "design": {"a": {"from": 8.0, "to": 12.0, "count": 60, "unit": "mm"},
                   "b": {"from": 30.0, "to": 40.0, "count": 80, "unit": "mm"}}
        | {name: f"{FOUR_BAR[name]} mm" for name in ("c", "e", "xi", "eta")},
        "limits": {"max_pressure_angle": {"max": 50.0, "unit": "deg"}},
        "objective": {"minimise": "max_abs_d2psi"},
        "reference": {"design": {name: f"{value} mm" for name, value in FOUR_BAR.items()} | {"a": "60 mm"}},
    }  # fmt: skip
    out = tmp_path_factory.mktemp("bars") / "designs"
    return sweep.run(study_from_data(study, "study.toml"), out=out, jobs=1)


def numbers(text):
    return np.frombuffer(base64.b64decode(text), "<f4").astype(float)


def test_design_moves_as_its_joints_and_curves_do(four_bars):
    data, *_ = gather(four_bars)
    shown = shown_designs(data, groups(data))
    assert [one.role for one in shown] == ["result", "reference"]
    found = moving(data, shown)
    assert json.loads(json.dumps(found, allow_nan=False)) == found
    best, reference = found["designs"]
    design = {name: float(data.result[name]) for name in data.study.family.parameter_names}
    phi = np.radians(numbers(best["phi"]))
    assert phi.size == POSES
    joints = sweep.joints("four_bar", design, phi)
    (part,) = best["parts"]
    for name, text in part["joints"].items():
        path = joints.loc[joints["joint"] == name.lower(), ["x", "y", "z"]].to_numpy()
        path = path[:1] if name in part["kinds"] else path
        np.testing.assert_allclose(numbers(text).reshape(-1, 3), path, atol=1e-5)
    poses = sweep.evaluate("four_bar", design, ["psi", "d2psi"], phi=phi)
    turned = np.degrees(np.unwrap(poses["psi"]))
    np.testing.assert_allclose(numbers(best["curves"]["psi"]), turned - turned.min(), atol=1e-4)  # from the lowest
    np.testing.assert_allclose(numbers(best["curves"]["d2psi"]), poses["d2psi"], rtol=1e-6, atol=1e-7)
    panel = next(curve for curve in found["curves"] if curve["name"] == "d2psi")
    assert panel["fast"]["factor"] == pytest.approx((20.0 * np.pi) ** 2)  # 600 per minute
    assert panel["range"][0] <= poses["d2psi"].min() and panel["range"][1] >= poses["d2psi"].max()
    angle = next(curve for curve in found["curves"] if curve["name"] == "pressure_angle")
    assert angle["limits"] == pytest.approx([50.0])
    # A reference that does not turn has gaps in its curves, and joints that are not everywhere.
    known = [np.isfinite(numbers(reference["curves"][name])) for name in ("psi", "d2psi")]
    assert known[0].any() and not known[0].all()
    np.testing.assert_array_equal(*known)
    assert found["curves"][0]["title"] == "follower angle ψ, from its lowest"


def test_curve_of_rounding_errors_is_drawn_as_zero(tmp_path):
    """The force of a slotted lever in line has no pressure angle; its poses have some 1e-16 rad."""
    study = {
        "study": {"name": "lever"},
        "mechanism": {"family": "inverted_slider_crank"},
        "scene": {"want": ["swing"]},
        "design": {"a": "39.47 mm", "e": {"from": 150.0, "to": 152.4, "count": 2, "unit": "mm"}, "h": "1e-13 mm"},
        "objective": {"minimise": "max_abs_d2psi"},
    }
    data, *_ = gather(sweep.run(study_from_data(study, "study.toml"), out=tmp_path / "designs", jobs=1))
    panels = {curve["name"]: curve for curve in moving(data, shown_designs(data, groups(data)))["curves"]}
    assert panels["pressure_angle"]["range"] == [0.0, 0.0] and panels["d2psi"]["range"][1] > 0.1


def test_lines_are_designs_of_the_dataset_the_best_among_them(four_bars):
    data, _, cells = gather(four_bars)
    rows = sweep.load(four_bars)
    found = parallel(data, cells, shown_designs(data, groups(data)))
    names = [axis["name"] for axis in found["axes"]]
    assert names == ["a", "b", "max_abs_d2psi", "max_pressure_angle"]
    assert found["objective"] == 2 and found["of"] == (rows["status"] == 0).sum()
    values = numbers(found["values"]).reshape(-1, len(names)) / [1.0, 1.0, 1.0, np.degrees(1.0)]
    np.testing.assert_allclose(values, rows.set_index("design").loc[found["numbers"], names], rtol=1e-6)
    assert len(found["numbers"]) <= BEST + SPREAD < found["of"]
    feasible = rows[rows["status"] == 0]
    assert set(feasible.nsmallest(BEST, "max_abs_d2psi")["design"]) <= set(found["numbers"])
    assert found["designs"][0]["role"] == "result"


def test_output_that_a_locus_sweeps_has_one_axis(tmp_path):
    data = {
        "study": {"name": "swings"},
        "mechanism": {"family": "rssr"},
        "scene": {"want": ["swing", "max_pressure_angle"]},
        "locus": {
            "swing": {"from": 12, "to": 16, "count": 3, "unit": "deg"},
            "phi0": "182 deg",
            "phi_ext": {"from": 208, "to": 214, "count": 3, "unit": "deg"},
        },
        "design": {"e": "16 mm", "f": "-63 mm", "g": "12 mm", "alpha": "90 deg"},
        "objective": {"minimise": "max_abs_d2psi"},
    }
    data, _, cells = gather(sweep.run(study_from_data(data, "study.toml"), out=tmp_path / "designs", jobs=1))
    found = parallel(data, cells, shown_designs(data, groups(data)))
    assert [axis["name"] for axis in found["axes"]] == ["swing", "phi_ext", "max_abs_d2psi", "max_pressure_angle"]


def test_study_without_curves_or_designs_has_nothing_to_move(gathered, tmp_path):
    data, _, cells = gathered
    assert moving(data, []) is None
    silent = replace(data, study=replace(data.study, output=replace(data.study.output, curves="none")))
    assert moving(silent, shown_designs(data, groups(data))) is None
    assert parallel(replace(data, parts=()), cells, []) is None


def test_different_optima_are_offered_once_each_the_best_first(gathered):
    data, *_ = gathered
    start = data.optima[data.optima["role"] == "start"].iloc[0]
    ends = [(30.0, 8.5, 0), (60.0, 9.5, 0), (30.1, 8.6, 0), (45.0, 9.0, 0), (90.0, 1.0, 5)]
    rows = [dict(start) | {"a2": a, "max_abs_d2s": value, "status": code} for a, value, code in ends]
    kept = data.optima[data.optima["role"] != "start"].assign(a2=75.0)
    changed = replace(data, optima=pd.concat([kept, pd.DataFrame(rows)]))
    shown = shown_designs(changed, groups(changed))
    assert [one.name for one in shown] == [
        "optimum", "another optimum, 1", "another optimum, 2", "another optimum, 3", "reference",
    ]  # fmt: skip
    assert [one.row["max_abs_d2s"] for one in shown[1:-1]] == [8.5, 9.0, 9.5]


def test_runs_of_poses_have_their_ends():
    assert runs(np.array([True, False, True, True])) == [[0, 0], [2, 3]]
    assert runs(np.zeros(3, bool)) == []


def test_no_word_of_a_study_ends_the_script(gathered, monkeypatch):
    data, _, cells = gathered
    evil = [Shown("</script><b>", "result", "<!--", data.result)]
    monkeypatch.setattr("sweep.report.live.shown_designs", lambda data, different: evil)
    made = live(data, cells, [])
    assert "<" not in made["motion_data"] and json.loads(made["motion_data"])["designs"][0]["name"] == "</script><b>"


def test_data_in_the_page_are_what_was_made(folder):
    page = write_report(folder).read_text(encoding="utf-8")
    data = json.loads(re.search(r'id="motion-data">(.*?)</script>', page)[1])
    assert [design["role"] for design in data["designs"]] == ["result", "reference"]
    lines = json.loads(re.search(r'id="lines-data">(.*?)</script>', page)[1])
    assert lines["of"] > len(lines["numbers"]) > 100
    assert study_data()["study"]["title"] not in page  # escaped in the markup
