"""The cyclogram against closed forms, and as input of a study."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner

import sweep
from sweep.chunks.plan import designs_fingerprint
from sweep.cli.main import main
from sweep.study import load_study
from sweep.study.limits import settings
from tests.families.machines.test_hand_made_stitches import DESIGN, PHI, machine_of

CRANK, ROD = 20.0, 70.0


@pytest.mark.parametrize("dwell", [0.0, 0.5, math.nan, None])
def test_a_dwell_that_is_no_share_of_the_stroke_is_refused(dwell):
    with pytest.raises(sweep.InputError, match="a share of the stroke between 0 and 0"):
        sweep.cyclogram("slider_crank", {"a": CRANK, "b": ROD, "e": 0.0}, dwell=dwell)


def test_strokes_and_dwells_of_a_slider_crank_are_those_of_its_closed_form():
    rows = sweep.cyclogram("slider_crank", {"a": CRANK, "b": ROD, "e": 0.0}, dwell=0.05)
    strokes = rows[rows["kind"] == "stroke"].set_index("name")
    assert strokes.loc["falls", ["start", "end", "size"]].to_list() == pytest.approx([0.0, math.pi, -2.0 * CRANK])
    assert strokes.loc["rises", "start"] == pytest.approx(math.pi) and strokes.loc["rises", "size"] == 2.0 * CRANK
    dwells = rows[rows["kind"] == "dwell"].set_index("name")
    # The law of cosines at the angle where the slider stands a twentieth of its stroke from either end.
    for name, s in (("low", ROD - CRANK + 0.1 * CRANK), ("high", ROD + CRANK - 0.1 * CRANK)):
        edge = math.acos((CRANK**2 + s**2 - ROD**2) / (2.0 * CRANK * s))
        expected = [edge, 2.0 * math.pi - edge] if name == "low" else [2.0 * math.pi - edge, edge]
        assert dwells.loc[name, ["start", "end"]].to_list() == pytest.approx(expected, abs=1e-9)


@pytest.mark.parametrize("ratio", [1, -2])
@pytest.mark.parametrize("name", ["cam", "cam_lever"])
def test_strokes_of_a_cam_begin_and_end_where_its_follower_moves(name, ratio):
    """They lasted through the dwells: from the end of one stroke to the end of the next."""
    law = {"lift": 0.4, "rise": 1.3, "dwell": 1.1, "fall": 1.7, "start": 0.3, "law": 2.0, "r0": 3.0, "e": 0.4}
    law |= {"c": 5.0, "e": 6.0, "branch": -1.0} if name == "cam_lever" else {}
    machine = sweep.machine({"x": {"family": name, "ratio": ratio, "offset": 0.7}}, {})
    rows = sweep.cyclogram(machine, {f"x.{key}": value for key, value in law.items()})
    for word, begins, ends in (("rises", 0.3, 1.6), ("falls", 2.7, 4.4)):
        span = (begins, ends) if ratio > 0 else (ends, begins)
        word = word if ratio > 0 else {"rises": "falls", "falls": "rises"}[word]
        strokes = rows[(rows["kind"] == "stroke") & (rows["name"] == word)]
        assert len(strokes) == abs(ratio)
        for k, edge in enumerate(("start", "end")):
            expected = np.sort(np.mod((span[k] - 0.7 + 2.0 * np.pi * np.arange(abs(ratio))) / ratio, 2.0 * np.pi))
            # near its ends the law moves by the cube of the angle at least: below 1e-5 rad that is rounding
            np.testing.assert_allclose(np.sort(strokes[edge]), expected, rtol=0.0, atol=1e-5)
        np.testing.assert_allclose(strokes["size"], 0.4 if word == "rises" else -0.4, rtol=1e-9)
    dwells = rows[rows["kind"] == "dwell"]
    assert dwells["name"].value_counts().to_dict() == {"low": abs(ratio), "high": abs(ratio)}


def test_a_geared_cam_without_dwell_turns_back_where_its_rise_ends():
    """Its slope is zero with a bend there: polynomials missed the place by 4e-4 rad, and one of five dwells with it."""
    cam = {"lift": 7.2, "rise": 0.66, "dwell": 0.0, "fall": 1.74, "start": 4.84, "law": 3.0, "r0": 30.0, "e": 2.5}
    for offset in (0.0, 1.0, 2.0, 3.3):
        machine = sweep.machine({"m": {"family": "cam", "ratio": 5, "offset": offset}}, {})
        rows = sweep.cyclogram(machine, {f"m.{key}": value for key, value in cam.items()}, angles="rad")
        ends = rows[(rows["kind"] == "stroke") & (rows["name"] == "rises")]["end"].to_numpy()
        off = np.mod(5.0 * ends + offset - 4.84 - 0.66 + math.pi, 2.0 * math.pi) - math.pi
        # The slope is proportional to the square of the distance: its rounding hides 1e-7 rad.
        assert ends.size == 5 and np.abs(off).max() < 1e-6
        assert (rows["name"] == "high").sum() == 5


def test_machine_lists_its_moments_and_all_its_members():
    rows = sweep.cyclogram(machine_of(), DESIGN)
    assert set(rows["member"]) == {"", "needle", "looper"}
    event = rows[rows["kind"] == "event"].iloc[0]
    assert event["name"] == "a" and event["start"] == pytest.approx(PHI, abs=1e-12)
    for member in ("needle", "looper"):
        strokes = rows[(rows["kind"] == "stroke") & (rows["member"] == member)]
        assert strokes["size"].sum() == pytest.approx(0.0, abs=1e-12)
        assert np.mod(strokes["end"] - strokes["start"], 2.0 * math.pi).sum() == pytest.approx(2.0 * math.pi)


def test_chart_has_a_row_for_each_member():
    axes = sweep.plot.cyclogram(machine_of(), DESIGN)
    assert [label.get_text() for label in axes.get_yticklabels()] == ["looper", "needle"]


def test_command_writes_chart_and_table(tmp_path):
    (tmp_path / "one.csv").write_text("a,b,e\n20,70,0\n")
    for name in ("chart.svg", "table.csv"):
        command = ["draw", "cyclogram", "slider_crank", str(tmp_path / "one.csv"), "--out", str(tmp_path / name)]
        assert CliRunner().invoke(main, [*command, "--angles", "rad"]).exit_code == 0
    lines = (tmp_path / "table.csv").read_text().splitlines()
    assert lines[0] == "member,kind,name,from [deg],to [deg],lasts [deg]"
    assert lines[1] == ",stroke,falls,0.0000,180.0000,180.0000"


STUDY = """
[study]
name = "when"

[machine.needle]
family = "guide"

[machine.looper]
family = "slotted"

[tools.thin]
on = "needle.point"
line = "line"
scarf = [0, 0, 1]
diameter = "0.75 mm"
eye = "30 mm"
point = "34 mm"

[tools.blade]
on = "looper"
tip = ["30 mm", "0 mm", "0 mm"]
back = ["15 mm", "0 mm", "0 mm"]

[relations]
a = { take = ["thin", "blade"], settings = "juki-mo-104d" }

[design.needle]
a = "12 mm"
b = "40 mm"
c = "35 mm"
e = "30 mm"
xi = "0 mm"
eta = "0 mm"
lam = "0 deg"
h = "0 mm"

[design.looper]
a = { from = 4, to = 6, count = 3, unit = "mm" }
e = "0 mm"
f = "8 mm"
alpha = "90 deg"

[limits]
a_back_height = { min = -1, max = 1, unit = "mm" }

[cyclogram]
a = ["205 deg", "230 deg"]

[cyclogram.looper]
duration = ["170 deg", "190 deg"]
size = ["40 deg", "60 deg"]
"""


def written(tmp_path: Path, text: str) -> Path:
    (tmp_path / "study.toml").write_text(text)
    return tmp_path


def test_windows_and_settings_of_a_study_are_limits(tmp_path):
    limits = {x.output: (x.minimum, x.maximum) for x in load_study(written(tmp_path, STUDY)).limits}
    assert limits["phi_a"] == pytest.approx((math.radians(205.0), math.radians(230.0)))
    assert limits["looper.phi0"] == pytest.approx((math.radians(170.0), math.radians(190.0)))
    assert limits["looper.swing"] == pytest.approx((math.radians(40.0), math.radians(60.0)))
    assert limits["a_clearance"] == tuple(settings()["juki-mo-104d"]["clearance"])
    assert limits["a_back_height"] == (-1.0, 1.0)  # the study's own, not the machine's 0.2


def test_an_edited_setting_leaves_no_old_chunk_valid(tmp_path, monkeypatch):
    """The table is no source that is hashed: its numbers are part of a study's identity as limits."""
    before = load_study(written(tmp_path, STUDY))
    edited = {"juki-mo-104d": settings()["juki-mo-104d"] | {"clearance": [0.02, 0.1]}}
    monkeypatch.setattr("sweep.study.limits.settings", lambda: edited)
    after = load_study(written(tmp_path, STUDY))
    assert after.data == before.data
    assert designs_fingerprint(after) != designs_fingerprint(before)


def test_plan_tells_a_limit_of_the_cyclogram_and_another_on_the_same_output(tmp_path):
    text = STUDY.replace("[cyclogram]", "[limits.looper]\nswing = '<= 55 deg'\n\n[cyclogram]")
    plan = CliRunner().invoke(main, ["check", str(written(tmp_path, text))]).output
    assert "looper.swing (40 to 60° and at most 55°)" in plan


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ('a = ["205 deg", "230 deg"]', 'a = ["350 deg", "10 deg"]', "within one turn"),
        ('a = ["205 deg", "230 deg"]', 'b = ["205 deg", "230 deg"]', "cyclogram.b"),
        ('a = ["205 deg", "230 deg"]', "a = 205", "from and to"),
        ('"juki-mo-104d"', '"juki-mo-104"', "juki-mo-104d"),
    ],
)
def test_faults_of_cyclogram_and_settings_are_said(tmp_path, old, new, words):
    with pytest.raises(sweep.StudyError, match=words):
        load_study(written(tmp_path, STUDY.replace(old, new)))


def test_page_lists_the_settings_that_there_are():
    text = (Path(sweep.__file__).parents[1] / "docs" / "stitch.md").read_text()
    columns = ("rise", "clearance", "above_eye", "reach", "back_height")
    for name, setting in settings().items():
        assert set(setting) <= {"source", *columns}
        (row,) = (line for line in text.splitlines() if line.startswith(f"| `{name}` |"))
        cells = [cell.strip() for cell in row.split("|")[2:-1]]
        assert cells[0] == setting["source"]
        assert cells[1:] == [f"{ends[0]:g} to {ends[1]:g}" if (ends := setting.get(x)) else "" for x in columns]
