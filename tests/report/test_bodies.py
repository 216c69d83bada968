"""Bars of a material and a section in the report: mass, centre and inertia of the design, by hand."""

from __future__ import annotations

import math

import pytest

import sweep
from sweep.report.dataset import as_result, gather, read_dataset
from sweep.report.page import write_report
from sweep.report.sketch import bars
from sweep.report.tables import parameter_rows
from sweep.study import study_from_data

STEEL = {"material": "steel", "section": "12 mm round"}


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    data = {
        "study": {"name": "bars"},
        "mechanism": {"family": "four_bar"},
        "scene": {"want": ["max_abs_drive_torque"], "speed": "600 rpm"},
        "design": {"a": {"values": [10.0, 11.0], "unit": "mm"}, "b": "35 mm", "c": "30 mm", "e": "32 mm"},
        "bodies": {"crank": STEEL | {"inertia": "exact"}, "rocker": STEEL, "m_coupler": "10 g"},
        "objective": {"minimise": "max_abs_drive_torque"},
    }
    return sweep.run(study_from_data(data, "study.toml"), out=tmp_path_factory.mktemp("bars") / "designs", jobs=1)


def test_bars_are_those_of_the_design(folder):
    data = as_result(read_dataset(folder), dict(sweep.load(folder).iloc[0]))
    found = {name: (kind, words) for name, kind, words in bars(data)}
    a = float(data.result["a"])
    mass = 7.85e-3 * math.pi * 36.0 * a  # g
    assert [found[body][0] for body in ("crank", "rocker", "coupler")] == ["exact", "slender", "slender"]
    numbers = [float(text.split("\u00a0")[0]) for text in found["crank"][1]]
    inertias = (1e-3 * mass * (a**2 / 12.0 + 9.0), 1e-3 * mass * 18.0)  # kg mm^2, k = d/4
    assert numbers == pytest.approx([mass, a / 2.0, *inertias], rel=1e-4)  # as printed
    assert found["coupler"][1][0] == "10\u00a0g" and found["rocker"][1][-1] == "0\u00a0kg·mm²"


def test_page_shows_them(folder):
    text = write_report(folder).read_text(encoding="utf-8")
    assert 'id="bars"' in text and "inertia across it" in text


def test_speed_and_load_that_are_swept_stand_among_the_dimensions(tmp_path):
    data = {
        "study": {"name": "speeds"},
        "mechanism": {"family": "four_bar"},
        "scene": {"want": ["max_abs_drive_torque"]},
        "design": {"a": "10 mm", "b": "35 mm", "c": "30 mm", "e": "32 mm"}
        | {"speed": {"values": [600, 900], "unit": "rpm"}},
        "bodies": {"crank": STEEL, "rocker": STEEL, "m_coupler": "10 g"},
        "loads": {"load_torque": {"values": [-0.5, -1.0], "unit": "N*m"}},
        "objective": {"minimise": "max_abs_drive_torque"},
    }
    folder = sweep.run(study_from_data(data, "study.toml"), out=tmp_path / "designs", jobs=1)
    rows = {row.name: (row.value, row.space) for row in parameter_rows(gather(folder)[0])}
    assert rows["speed"] == ("600\u00a0rpm", "600 or 900\u00a0rpm")
    assert rows["load_torque"] == ("−500\u00a0N·mm", "−500 or −1000\u00a0N·mm")
    assert "gravity_x" not in rows  # left out by the study
