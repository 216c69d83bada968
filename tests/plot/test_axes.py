"""Pictures as axes: what is drawn where, and the verb that saves them."""

from __future__ import annotations

import math
import re
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from click.testing import CliRunner

import sweep
from sweep.cli import main
from sweep.dataset import files
from sweep.families import family
from sweep.report.figures import house_style, new_figure, save
from sweep.report.page import write_report
from tests.support.report_dataset import study_data, write_dataset, write_table

RSSR = dict(family("rssr").example)
LOADS = {"m_crank": 1e-4, "m_coupler": 2e-4, "m_rocker": 1.5e-4, "speed": 100.0}


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    data = study_data(tolerance={"lengths": "0.02 mm"})
    place = write_dataset(tmp_path_factory.mktemp("plot") / "designs", data, optimum={})
    spread = {"role": "optimum", "output": ["max_abs_d2s", "stroke"], "nominal": [8.0, 24.5], "mean": [8.1, 24.5],
              "low": [7.6, 24.4], "high": [8.8, 24.6], "within": [math.nan, 0.9]}  # fmt: skip
    write_table(files.beside(place) / files.TOLERANCE, pd.DataFrame(spread), {})
    slopes = {"role": "optimum", "output": "max_abs_d2s", "parameter": ["a1", "b1"], "value": 8.0,
              "growing": [4.0, -16.0], "shrinking": [4.0, -16.0]}  # fmt: skip
    write_table(files.beside(place) / files.SENSITIVITY, pd.DataFrame(slopes), {})
    return place


def test_lengths_of_a_design_in_metres_give_velocities_in_metres():
    panels = sweep.plot.motion("slider_crank", {"a": 0.02, "b": 0.07, "e": 0.0}, "s, ds, d2s", unit="m", speed=100.0)
    titles = [axes.get_title(loc="left") for axes in panels]
    assert [title.partition("[")[2] for title in titles] == ["m]", "m/rad]", "m/rad²]"]
    (pace,) = panels[1].child_axes
    panels[1].figure.canvas.draw()
    assert pace.get_ylabel() == "m/s"
    assert pace.get_ylim()[1] == pytest.approx(100.0 * panels[1].get_ylim()[1])


def test_motion_has_a_panel_for_each_curve_and_draws_it():
    axes = sweep.plot.motion("rssr", RSSR, "dpsi, d2psi")
    assert len(axes) == 2
    found = sweep.evaluate("rssr", RSSR, "dpsi", phi=np.arange(720) * (2.0 * math.pi / 720))["dpsi"]
    line = axes[0].lines[0].get_ydata()
    assert line.max() == pytest.approx(found.max(), abs=1e-12)
    assert len(sweep.plot.motion("rssr", RSSR)) == 5  # psi, three derivatives, pressure angle
    with pytest.raises(sweep.InputError, match="did you mean 'd2psi'"):
        sweep.plot.motion("rssr", RSSR, ["d2psy"])
    with pytest.raises(sweep.InputError, match="unit = 'furlong'; allowed: mm"):
        sweep.plot.motion("rssr", RSSR, unit="furlong")
    with pytest.raises(sweep.InputError, match="1 to 20 designs"):
        sweep.plot.motion("rssr", pd.DataFrame(RSSR, index=range(21)))


def test_motion_of_several_designs_in_axes_of_ones_own():
    from matplotlib.figure import Figure

    table = pd.DataFrame([RSSR, RSSR | {"a": 0.9 * RSSR["a"]}], index=["long", "short"])
    own = Figure().subplots(1, 2)
    axes = sweep.plot.motion("rssr", table, "dpsi, d2psi", axes=own)
    assert list(axes) == list(own)
    assert [line.get_label() for line in own[0].lines] == ["long", "short"]
    assert len({line.get_color() for line in own[0].lines}) == 2
    phi = np.arange(720) * (2.0 * math.pi / 720)
    found = sweep.evaluate("rssr", table.iloc[[1]], "dpsi", phi=phi)["dpsi"]
    assert own[0].lines[1].get_ydata().max() == pytest.approx(found.max(), abs=1e-12)
    assert [text.get_text() for text in own[0].get_legend().get_texts()] == ["long", "short"]
    alike = sweep.plot.motion("rssr", table.set_axis(["same", "same"]), "dpsi")
    assert len(alike[0].lines) == 2  # designs of one name are drawn too
    with pytest.raises(sweep.InputError, match="axes = 2; allowed: 1"):
        sweep.plot.motion("rssr", table, "dpsi", axes=own)
    assert [line.get_label() for line in sweep.plot.motion("rssr", RSSR | {"a": [1.0, 1.1]})[0].lines] == [
        "design 0",
        "design 1",
    ]


def test_mechanism_has_a_panel_for_each_frame_and_every_joint_in_it():
    (axes,) = sweep.plot.mechanism("rssr", RSSR, 0.4, view="xy")
    assert {"A", "B", "C", "D", "x", "y"} <= {text.get_text() for text in axes.texts}
    coupler = next(line for line in axes.lines if line.get_label() == "coupler")
    joints = sweep.joints("rssr", RSSR, 0.4).set_index("joint")
    np.testing.assert_allclose(coupler.get_xydata(), joints.loc[["b", "c"], ["x", "y"]], atol=1e-14)
    assert axes.get_xlabel() == "x [mm]"
    guide = family("guide").example
    design = {f"{k}1": v for k, v in RSSR.items()} | {f"{k}2": v for k, v in guide.items()}
    assert [a.get_title(loc="left") for a in sweep.plot.mechanism(["rssr", "guide"], design)] == ["stage 1, stage 2"]
    with pytest.raises(sweep.InputError, match="space, xy"):
        sweep.plot.mechanism("rssr", RSSR, view="front")


def test_polar_load_is_the_force_square_to_the_axis():
    axes = sweep.plot.polar_load("rssr", RSSR | LOADS, "d")
    angle, radius = axes.lines[0].get_data()
    names = ["force_d_x", "force_d_y", "force_d_z"]
    force = sweep.evaluate("rssr", RSSR | LOADS, names, phi=[0.0])[names].to_numpy()[0]
    # The rocker axis is z: the diagram is the force in the plane x, y.
    assert radius[0] == pytest.approx(math.hypot(force[0], force[1]), rel=1e-12)
    assert angle[0] == pytest.approx(math.atan2(force[1], force[0]), abs=1e-12)
    assert radius[0] == radius[-1]
    with pytest.raises(sweep.InputError, match="a joint with an axis: a, d"):
        sweep.plot.polar_load("rssr", RSSR | LOADS, "b")
    with pytest.raises(sweep.InputError, match="m_crank"):
        sweep.plot.polar_load("rssr", RSSR)


def test_map_and_front_are_those_of_the_report(folder):
    best, share = sweep.plot.map(folder)
    assert best.get_xlabel() and share.get_xlabel() == best.get_xlabel()
    chosen = sweep.plot.map(folder, "xi2", "a1")
    assert "xi2" in chosen[0].get_xlabel() + chosen[0].get_ylabel()
    with pytest.raises(sweep.InputError, match="two of a1, alpha1, xi2"):
        sweep.plot.map(folder, "b1", "a1")
    labels = sweep.plot.front(folder).get_legend_handles_labels()[1]
    assert "feasible designs of the sweep" in labels and "optimum" in labels


def test_tolerance_shows_the_spread_in_percent_of_the_nominal_value(folder):
    axes = sweep.plot.tolerance(folder)
    low, high = axes.lines[0].get_xdata()
    assert (low, high) == (pytest.approx(-5.0), pytest.approx(10.0))
    assert "0.02" in axes.get_title(loc="left")


def test_report_has_the_numbers_of_the_pictures(folder, tmp_path):
    page = write_report(folder, tmp_path / "report").read_text(encoding="utf-8")
    words = re.sub(r"\s+", " ", re.sub(r"<[^>]+>", " ", page.replace("&nbsp;", " ").replace("\u00a0", " ")))
    assert "max |s″| max_abs_d2s 8 mm/rad² 8.1 mm/rad² 7.6 to 8.8 mm/rad²" in words
    assert "b1 stage 1: coupler 0.1 mm −20 % +20 %" in words
    # The longest bar is half of the cell and goes to its own side.
    assert 'class="larger" style="margin-left: 0.00%; width: 50.00%"' in page


def test_mechanism_is_drawn_in_as_many_positions_as_asked():
    one, several = (sweep.plot.mechanism("rssr", RSSR, positions=n)[0] for n in (1, 8))
    assert len(several.lines) - len(one.lines) == 7 * 3  # crank, coupler, rocker


def test_sensitivity_has_the_most_telling_dimension_first(folder):
    axes = sweep.plot.sensitivity(folder)
    assert [text.get_text().split(",")[0] for text in axes.get_yticklabels()] == ["b1", "a1"]
    assert axes.patches[0].get_width() == pytest.approx(-100.0 * 0.1 * 16.0 / 8.0)


def test_dataset_without_tolerances_is_refused(tmp_path):
    place = write_dataset(tmp_path / "designs", optimum={})
    with pytest.raises(sweep.InputError, match="tolerance"):
        sweep.plot.tolerance(place)
    with pytest.raises(sweep.InputError, match="sensitivities"):
        sweep.plot.sensitivity(place)


@pytest.mark.parametrize("what", ["map", "front", "tolerance", "sensitivity", "motion", "mechanism"])
def test_verb_draws_a_folder(what, folder, tmp_path):
    out = tmp_path / f"{what}.svg"
    done = CliRunner().invoke(main, ["draw", what, str(folder), "--out", str(out)])
    assert done.exit_code == 0, done.output
    assert out.read_text().count("<path") > 10


def test_verb_draws_motions_of_several_designs_with_real_letters(folder, tmp_path):
    out = tmp_path / "motion.svg"
    done = CliRunner().invoke(main, ["draw", "motion", str(folder), "--design", "0,2,reference", "--out", str(out)])
    assert done.exit_code == 0, done.output
    text = out.read_text()
    for words in ("design 0", "design 2", "reference", "displacement s, from its lowest [mm]"):
        assert f">{words}</text>" in text
    assert len(text) < 100_000


def test_numbers_of_a_saved_figure_are_whole_and_its_places_are_short(tmp_path):
    with house_style():
        figure = new_figure(4.0, 3.0)
        figure.subplots().set_xticks([0.0, 0.025, 0.125])
        text = save(figure, tmp_path / "x.svg").read_text()
    assert all(f">{number}</text>" in text for number in ("0.000", "0.025", "0.125"))
    assert not re.search(r"\d\.\d{3}", " ".join(re.findall(r"<[^>]*>", text)))


def test_verb_draws_a_row_of_a_table(tmp_path):
    table = tmp_path / "designs.csv"
    pd.DataFrame([RSSR | LOADS, RSSR | LOADS | {"a": 0.9}]).to_csv(table, index=False)
    for what, more in (("motion", ["--want", "psi,dpsi"]), ("mechanism", ["--view", "zy"]), ("polar_load", [])):
        out = tmp_path / f"{what}.png"
        done = CliRunner().invoke(main, ["draw", what, "rssr", str(table), "--row", "1", "--out", str(out), *more])
        assert done.exit_code == 0, done.output
        assert out.stat().st_size > 5000
    for arguments in (
        ["draw", "motion", "rssr", str(table), "--row", "2", "--out", "x.png"],
        ["draw", "motion", "rssr", "--out", "x.png"],
        ["draw", "map", "rssr", str(table), "--out", "x.png"],
        ["draw", "motion", "rssr", str(table), "--out", "x.bmp"],
    ):
        assert CliRunner().invoke(main, arguments).exit_code == 2


@pytest.mark.parametrize("kind", ["csv", "glb", "dxf", "mjcf", "law"])
def test_export_verb_takes_the_optimum_or_a_design_of_a_folder(kind, tmp_path):
    design = {f"{k}1": v * (20.0 if k in "abcefg" else 1.0) for k, v in RSSR.items()}
    design |= {f"{k}2": v * (1.0 if k in ("lam", "branch") else 20.0) for k, v in family("guide").example.items()}
    place = write_dataset(tmp_path / "designs", optimum=design)
    done = CliRunner().invoke(main, ["export", str(place), "--format", kind, "--design", "optimum"])
    assert done.exit_code == 0, done.output
    file = Path(done.output.split(": ")[1].strip())
    assert file.parent == files.beside(place) / "export" and file.stat().st_size > 200
    out = tmp_path / "row.csv"
    rows = sweep.load(place).set_index("design")
    number = rows.index[-1]
    assert number > len(rows)  # what keeps no limit is not there, so a row's place is not its design's number
    done = CliRunner().invoke(main, ["export", str(place), "--format", "csv", f"--design={number}", "--out", str(out)])
    assert done.exit_code == 0, done.output
    row = rows.loc[number]
    points = pd.read_csv(out).set_index(["stage", "name"])
    assert points.loc[(1, "B"), "x"] == pytest.approx(row["a1"], abs=1e-12)  # the crank at phi = 0
    wrong = CliRunner().invoke(main, ["export", str(place), "--format", "csv", "--design", "worst"])
    assert wrong.exit_code == 2 and "optimum, reference, best" in wrong.output
    wrong = CliRunner().invoke(main, ["export", str(place), "--format", "csv", "--phi", "90"])
    assert wrong.exit_code == 2 and "an angle in rad; 90 deg is 1.5708" in wrong.output
    for missing in (-1, 10**6, next(k for k in rows.index + 1 if k not in rows.index)):
        wrong = CliRunner().invoke(main, ["export", str(place), "--format", "csv", f"--design={missing}"])
        assert wrong.exit_code == 2 and f"some of {rows.index[0]} to {rows.index[-1]}" in wrong.output


def test_motion_of_what_does_not_turn_is_refused_and_its_mechanism_is_drawn():
    design = dict(family("backrest").example)
    with pytest.raises(sweep.InputError, match="over an interval"):
        sweep.plot.motion("backrest", design)
    (axes,) = sweep.plot.mechanism("backrest", design)
    assert {"bracket", "warp 1"} <= {line.get_label() for line in axes.lines}
