"""The study joint-loads: its smoke version from outside, one design of the full one, what plan and faults say."""

from __future__ import annotations

import importlib.util
import json
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner

import sweep
from sweep.chunks.chunk import compute_chunk
from sweep.cli import main
from sweep.errors import StudyError
from sweep.study import load_study

FOLDER = Path(__file__).parents[2] / "studies" / "joint-loads"
EXPECTED = json.loads((FOLDER / "expected.json").read_text())


@pytest.fixture(scope="module")
def swept(tmp_path_factory):
    return sweep.load(sweep.run(FOLDER, out=tmp_path_factory.mktemp("joint-loads") / "designs", smoke=True))


def test_smoke_keeps_the_accepted_number_of_designs(swept):
    assert len(swept) == EXPECTED["smoke_feasible_designs"]


def test_inertia_loads_grow_with_the_square_of_the_speed(swept):
    """All but weight does; unevenness and what friction adds do not grow."""
    fast, slow = (swept[np.isclose(swept["speed"], rpm * np.pi / 30.0)] for rpm in (7000, 3000))
    for name in ("max_force_c", "max_shaking_force", "max_abs_lag", "rms_drive_torque"):
        ratio = fast[name].to_numpy() / slow[name].to_numpy()
        assert ratio == pytest.approx((7 / 3) ** 2, rel=0.05), name
    assert fast["unevenness"].to_numpy() == pytest.approx(slow["unevenness"].to_numpy(), rel=0.03)


def test_bearing_limits_are_pressure_angle_limits(swept):
    """The reserve of the pressure angle is negative exactly where the bearings are overloaded, and both occur."""
    overloaded = swept["max_sliding_utilisation"] > 1.0
    assert 0 < overloaded.sum() < len(swept)
    assert ((swept["min_theta1_reserve"] < 0.0) == overloaded).all()


def test_the_figure_says_which_effect_matters_at_which_speed(swept):
    """Friction and uneven speed at all speeds alike, vibration and bearings with the square of the speed."""
    spec = importlib.util.spec_from_file_location("figure", FOLDER / "figure.py")
    figure = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(figure)
    table = figure.table(swept).set_index(["effect", "speed"])
    matters = table["matters"].unstack()
    assert matters.loc["friction: what it adds to the peak torque"].all()
    assert matters.loc["uneven crank speed: unevenness"].all()
    assert list(matters.loc["vibration: what it adds to the lag"]) == [False, False, True]
    assert not matters.loc["plain bearings: utilisation", 3000] and matters.loc["plain bearings: utilisation", 7000]
    assert len(figure.chart(table.reset_index(), swept).axes) == 2


def test_accepted_design_of_the_full_study():
    study = load_study(FOLDER)
    assert study.space.count == EXPECTED["designs"]
    k = EXPECTED["design"]
    found = compute_chunk(study, k, k + 1).columns
    for name, value in EXPECTED["values"].items():
        assert found[name][0] == pytest.approx(value, rel=EXPECTED["relative_tolerance"]), name


def test_the_plan_is_a_tree_with_shares_and_verdicts():
    shown = CliRunner().invoke(main, ["check", str(FOLDER), "--smoke"])
    assert shown.exit_code == 0, shown.output
    for words in (
        "friction             D2", "part of it", "effects not computed", "rolling_limits",
        "kinetostatics: matters", "coupler: matters", "pressure: matters",
    ):  # fmt: skip
        assert " ".join(words.split()) in " ".join(shown.output.split()), words


def edited(tmp_path, old, new):
    text = (FOLDER / "study.toml").read_text()
    assert old in text
    path = tmp_path / "study.toml"
    path.write_text(text.replace(old, new))
    return path


def test_a_missing_input_is_a_fault_that_names_the_effects(tmp_path):
    with pytest.raises(StudyError, match=r"bodies\.m_coupler is missing.*kinetostatics, friction"):
        load_study(edited(tmp_path, 'm_coupler = "14 g"\n', ""))


def test_a_speed_is_given_once(tmp_path):
    with pytest.raises(StudyError, match=r"design\.speed.*\[scene\] gives it"):
        load_study(edited(tmp_path, "[scene]\n", '[scene]\nspeed = "5000 rpm"\n'))


def test_the_speed_of_the_scene_is_the_effects_speed(tmp_path):
    line = 'speed = { values = [3000, 5000, 7000], unit = "rpm" }\n'
    path = edited(tmp_path, line, "")
    text = path.read_text().replace("[scene]\n", '[scene]\nspeed = "7000 rpm"\n', 1)
    path.write_text(text.replace('[reference.design]\nspeed = "7000 rpm"\n', "[reference.design]\n"))
    study = load_study(path)
    assert study.space.fixed["speed"] == pytest.approx(7000.0 * np.pi / 30.0)
    assert study.reference is not None and study.reference["speed"] == study.space.fixed["speed"]


def test_a_unit_of_the_wrong_kind_is_a_fault(tmp_path):
    with pytest.raises(StudyError, match=r"stiffness.*a stiffness, in N/mm"):
        load_study(edited(tmp_path, 'stiffness = "4 kN/mm"', 'stiffness = "4 kN"'))
