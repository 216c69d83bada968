"""Several results side by side: each under its own name, judged by the limits of the first."""

from __future__ import annotations

import html
import re
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner

import sweep
from sweep.cli import main
from sweep.report.dataset import chosen
from sweep.report.quantities import quantity
from sweep.study import study_from_data

DATA = {
    "study": {"name": "long"},
    "mechanism": {"family": "four_bar"},
    "scene": {"want": ["max_abs_d2psi", "swing"]},
    "design": {"a": {"from": 8.0, "to": 12.0, "count": 9, "unit": "mm"}}
    | {name: f"{value} mm" for name, value in {"b": 35, "c": 30, "e": 32, "xi": 20, "eta": 5}.items()},
    "limits": {"swing": {"min": 40.0, "unit": "deg"}},
    "objective": {"minimise": "max_abs_d2psi"},
}


def ran(place, name, **tables):
    study = study_from_data(DATA | {"study": {"name": name}} | tables, "study.toml")
    return sweep.run(study, out=place / name / "designs", jobs=1)


@pytest.fixture(scope="module")
def folders(tmp_path_factory):
    place = tmp_path_factory.mktemp("compared")
    return ran(place, "long"), ran(place, "short", limits={"swing": {"min": 35.0, "unit": "deg"}})


def test_all_results_are_on_one_page_and_judged_alike(folders):
    said = CliRunner().invoke(main, ["report", *map(str, folders)])
    assert said.exit_code == 0, said.output
    page = (folders[0].parent / "comparison.html").read_text()
    assert said.output == f"report: {folders[0].parent / 'comparison.html'}\n"
    words = re.sub(r"\s+", " ", html.unescape(re.sub(r"<(style|script).*?</\1>|<[^>]+>", " ", page, flags=re.DOTALL)))
    assert "long and short" in words
    for folder in folders:
        design = chosen(folder).design
        true = sweep.summarise("four_bar", {n: [x] for n, x in design.items()}, ["max_abs_d2psi"], accuracy=1e-8)
        assert quantity("max_abs_d2psi", "1").show(float(true.iloc[0, 0])) in page
        assert f"{design['a']:g}" in words
    assert "active" in words or "met" in words
    long, less = (chosen(folder).design for folder in folders)
    both = sweep.summarise("four_bar", {n: [long[n], less[n]] for n in long}, ["max_abs_d2psi"])["max_abs_d2psi"]
    assert f"{100.0 * (1.0 - both[1] / both[0]):.3g} % less" in words and "against long." in words
    short = np.degrees(abs(float(sweep.summarise("four_bar", chosen(folders[1]).design, ["swing"]).iloc[0, 0])))
    assert short < 40.0 and f"missed by {quantity('swing', 'rad').show(np.radians(40.0 - short), 3)}" in words
    assert 'value="1"' in page and "pin-1" in page  # the second one can be chosen, and has its colour


def test_another_mechanism_is_refused(folders, tmp_path):
    other = study_from_data(
        {"study": {"name": "slider"}, "mechanism": {"family": "slider_crank"}, "scene": {"want": ["stroke"]},
         "design": {"a": {"values": [10.0, 12.0], "unit": "mm"}, "b": "60 mm", "e": "0 mm"},
         "objective": {"minimise": "stroke"}}, "study.toml")  # fmt: skip
    folder = sweep.run(other, out=tmp_path / "slider" / "designs", jobs=1)
    spatial = ran(tmp_path, "spatial", mechanism={"family": "rssr"}, scene={"want": ["swing"]}, design={
        "a": {"values": [10.0, 12.0], "unit": "mm"}, "alpha": "40 deg"}
        | {name: f"{value} mm" for name, value in {"b": 36, "c": 26, "e": 40, "f": 6, "g": -4}.items()})  # fmt: skip
    for one, another in ((folders[0], folder), (folder, spatial)):  # a slider-crank has names of rssr: a, b, e, branch
        said = CliRunner().invoke(main, ["report", str(one), str(another)])
        assert said.exit_code == 2 and f"{another}'; allowed: a dataset of the mechanism of" in said.output


def test_a_design_without_values_is_called_by_its_own_name(folders, tmp_path):
    """A four-bar of 10, 20, 15 and 32 mm does not close over the turn: 10 + 32 > 20 + 15 (Grashof)."""
    small = {name: f"{value} mm" for name, value in {"b": 20, "c": 15, "e": 32, "xi": 20, "eta": 5}.items()}
    reached = {"scene": {"want": ["size"]}, "objective": {"minimise": "size"}, "limits": {}}
    folder = ran(tmp_path, "stuck", **reached, design={"a": {"values": [10.0, 12.0], "unit": "mm"}} | small)
    assert CliRunner().invoke(main, ["report", str(folders[0]), str(folder)]).exit_code == 0
    missed = re.findall('<p class="missed">(.*)</p>', (folders[0].parent / "comparison.html").read_text())
    assert len(missed) == 1 and missed[0].startswith("stuck: ")


@pytest.mark.parametrize("count", [1, 2])
def test_report_on_a_full_disk_does_not_speak_of_a_run(folders, tmp_path, monkeypatch, count):
    def full(*_):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(Path, "write_bytes", full)
    said = CliRunner().invoke(main, ["report", *map(str, folders[:count]), "--out", str(tmp_path)])
    page = tmp_path / ("report.html" if count == 1 else "comparison.html")
    assert said.exit_code == 74 and f"{page}: cannot be written: No space left on device" in said.stderr
    assert "run again" not in said.stderr and not list(tmp_path.rglob("_tmp-*"))
