"""The sheet for the shop: its tables are the design's numbers, its files open."""

from __future__ import annotations

import math
import re
import tomllib

import numpy as np
import pytest
from click.testing import CliRunner

import sweep
from sweep.cli import main
from sweep.exchange.scene import pose
from sweep.plot.sheet import A3, LINES, VIEWS_HIGH, _rows, tables_of, write_sheet
from sweep.report.dataset import as_result, chosen, read_dataset, row_of
from sweep.study import study_from_data

STUDY = {
    "study": {"name": "drive", "title": "A drive"},
    "mechanism": {"family": "rssr"},
    "scene": {"want": ["max_abs_d2psi", "swing"], "speed": "600 rpm"},
    "design": {"a": {"from": 10.0, "to": 12.0, "count": 3, "unit": "mm"}, "alpha": "60 deg"}
    | {name: f"{value} mm" for name, value in {"b": 40, "c": 25, "e": 35, "f": 5, "g": -3}.items()},
    "limits": {"swing": {"min": 30.0, "unit": "deg"}},
    "objective": {"minimise": "max_abs_d2psi"},
    "optimise": {"starts": 2},
    "tolerance": {"lengths": "0.02 mm", "angles": "0.05 deg", "own": {"c": "0.005 mm", "g": "0 mm"}},
}


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    study = study_from_data(STUDY, "study.toml")
    return sweep.run(study, out=tmp_path_factory.mktemp("drive") / "designs", jobs=1)


def test_tables_hold_dimensions_tolerances_joints_and_limits(folder):
    data, found = read_dataset(folder), chosen(folder)
    row = row_of(data.study, found.design)
    dimensions, joints, limits = tables_of(as_result(data, row), pose(found.family, found.design, 0.3))
    by_name = {line[0]: line[1:] for line in dimensions.lines}
    assert by_name["b"][:2] == ("40 mm", "± 0.02 mm") and by_name["alpha"][:2] == ("60°", "± 0.05°")
    assert by_name["branch"][1] == ""
    assert by_name["c"][1] == "± 0.005 mm" and by_name["g"][1] == ""  # of their own
    true = sweep.joints("rssr", found.design, 0.3).set_index("joint")[["x", "y", "z"]]
    for name, *at in joints.lines:
        np.testing.assert_allclose([float(x.replace("−", "-")) for x in at], true.loc[name.lower()], atol=5e-5)
    ((_, required, value, state),) = limits.lines
    assert required == "at least 30°" and state in ("met", "active")
    assert float(value.rstrip("°")) == pytest.approx(abs(math.degrees(row["swing"])), abs=5e-4)


@pytest.mark.parametrize("kind", ["pdf", "svg", "dxf"])
def test_verb_writes_the_sheet(folder, kind):
    said = CliRunner().invoke(main, ["export", str(folder), "--format", kind])
    assert said.exit_code == 0, said.output
    content = (folder.parent / "export" / f"result.{kind}").read_bytes()
    assert content.startswith({"pdf": b"%PDF", "svg": b"<?xml", "dxf": b"  0"}[kind])


def test_dxf_holds_the_tables_and_still_reads_back(folder, tmp_path):
    import ezdxf

    target = write_sheet(folder, None, tmp_path / "drive.dxf")
    words = {text.dxf.text for text in ezdxf.readfile(target).modelspace().query("TEXT")}
    assert {"Dimensions", "Hardpoints [mm]", "Limits", "± 0.02 mm", "at least 30°"} <= words
    said = CliRunner().invoke(main, ["points", "rssr", str(target)])
    assert said.exit_code == 0, said.output
    assert float(tomllib.loads(said.output)["design"]["b"].split()[0]) == pytest.approx(40.0, abs=1e-9)


@pytest.fixture(scope="module")
def machine(tmp_path_factory):
    """A machine of three slider-cranks, whose dimensions are more than a table has lines."""
    slider = {"family": "slider_crank", "driver": "shaft"}
    size = {"a": {"from": 10.0, "to": 12.0, "count": 2, "unit": "mm"}, "b": "40 mm", "e": "2 mm"}
    data = {
        "study": {"name": "three"},
        "machine": {"left": slider, "right": slider, "rear": slider},
        "scene": {"want": ["left.stroke", "right.stroke"]},
        "design": {"left": size, "right": size | {"a": "11 mm"}, "rear": size | {"a": "12 mm"}},
        "limits": {"left": {"stroke": {"max": 30.0, "unit": "mm"}}},
    }
    return sweep.run(study_from_data(data, "study.toml"), out=tmp_path_factory.mktemp("three") / "designs", jobs=1)


def test_a_long_table_goes_on_below_in_lines_of_the_same_height(machine, tmp_path):
    data, found = read_dataset(machine), chosen(machine)
    tables = tables_of(as_result(data, row_of(data.study, found.design)), pose(found.family, found.design, 0.0))
    first, *below = _rows(tables)
    assert [table.title for table in first] == ["Dimensions", "Hardpoints [mm]", "Limits"]
    laid = [table for row in (first, *below) for table in row]
    assert all(len(table.lines) <= LINES for table in laid)
    lines = {t.title: [x for one in laid if one.title.startswith(t.title) for x in one.lines] for t in tables}
    assert lines == {t.title: list(t.lines) for t in tables}
    assert below and below[0][0].title == "Dimensions, continued"
    assert write_sheet(machine, None, tmp_path / "three.pdf").read_bytes().startswith(b"%PDF")


def test_the_sheet_is_as_long_as_its_tables_need(folder, machine, tmp_path):
    """Ten lines below the views need less than A3, 66 lines of three cranks in rows of 24 need more."""
    short, long = (write_sheet(f, None, tmp_path / "sheet.svg").read_text() for f in (folder, machine))
    heights = [float(re.search(r'height="([\d.]+)pt"', text).group(1)) / 72.0 for text in (short, long)]
    assert VIEWS_HIGH + 2.0 < heights[0] < 0.8 * A3[1] and heights[1] > A3[1]


def test_a_machine_has_its_cyclogram_on_the_sheet(machine):
    data, found = read_dataset(machine), chosen(machine)
    tables = tables_of(as_result(data, row_of(data.study, found.design)), pose(found.family, found.design, 0.0))
    lines = {line[0]: line[1:] for line in tables[-1].lines}
    assert lines["left falls"][0] == "stroke" and lines["right rises"][0] == "stroke"


def test_same_data_same_bytes(folder, tmp_path):
    for kind in ("svg", "pdf"):
        one, other = (write_sheet(folder, "optimum", tmp_path / f"{k}.{kind}").read_bytes() for k in (1, 2))
        assert one == other
    with pytest.raises(sweep.InputError, match=r"ending in \.pdf"):
        write_sheet(folder, None, tmp_path / "drive.png")
