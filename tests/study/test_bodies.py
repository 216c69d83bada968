"""[bodies] and [loads] of a study: the same study as with everything in [design], loads over the turn, faults."""

from __future__ import annotations

import numpy as np
import pandas as pd
import pytest

from sweep.chunks.plan import pilot
from sweep.cli.plan import _effects
from sweep.errors import StudyError
from sweep.study import load_study, study_from_data
from sweep.study.load import merged

HEAD = """
[study]
name = "loaded"
[mechanism]
chain = ["rssr", "guide"]
[scene]
speed = "7000 rpm"
want = ["kinetostatics2", "max_abs_tool_load2"]
[design]
a1 = { from = 10, to = 14, count = 3, unit = "mm" }
b1 = "60 mm"
c1 = "30 mm"
e1 = "50 mm"
f1 = "5 mm"
g1 = "2 mm"
alpha1 = "1.2 rad"
a2 = "11 mm"
b2 = "40 mm"
c2 = "45 mm"
e2 = "38 mm"
xi2 = "75 mm"
eta2 = "12 mm"
lam2 = "1.4 rad"
h2 = "5 mm"
"""
BODIES = """
m_crank2 = "10 g"
m_coupler2 = { values = [10, 20], unit = "g" }
m_rocker2 = "10 g"
m_tool2 = "25 g"
"""
FORCE = "tool_force2 = { phi = [0, 90, 180], values = [0, -5, 0], unit = 'N' }\n"


def load(tmp_path, text, files=None):
    (tmp_path / "study.toml").write_text(text)
    for name, content in (files or {}).items():
        (tmp_path / name).write_text(content)
    return load_study(tmp_path)


def faults(tmp_path, text, files=None):
    with pytest.raises(StudyError) as error:
        load(tmp_path, text, files)
    return "\n".join(error.value.faults)


def test_bodies_in_a_table_of_their_own_make_the_same_study_as_in_design(tmp_path):
    old = load(tmp_path, HEAD + BODIES + 'tool_force2 = "-3 N"\n')
    new = load(tmp_path, HEAD + "[bodies]\n" + BODIES + '[loads]\ntool_force2 = "-3 N"\n')
    assert new.fingerprint == old.fingerprint
    columns, others = (study.space.columns(0, study.space.count) for study in (new, old))
    assert list(columns) == list(others)
    for name, values in columns.items():
        np.testing.assert_array_equal(values, others[name])
    assert study_from_data(new.data, new.path).fingerprint == new.fingerprint


def test_bodies_of_which_only_the_mass_is_given_are_slender_rods_and_the_plan_says_so(tmp_path):
    bare = load(tmp_path, HEAD + "[bodies]\n" + BODIES)
    more = load(tmp_path, HEAD + "[bodies]\n" + BODIES + "com_rocker_x2 = '0 mm'\n")
    names = [f"rod_{body}2" for body in ("crank", "coupler", "rocker")]
    assert [bare.space.fixed[name] for name in names] == [1.0, 1.0, 1.0]
    assert [more.space.fixed[name] for name in names] == [1.0, 1.0, 0.0]
    at = (lines := _effects(more, pilot(more))).index(
        "bodies without centre and inertia are slender rods between their joints"
    )
    assert lines[at + 1].split(", ") == ["  rod_crank2", "rod_coupler2"]


def test_links_whose_mass_is_left_out_are_said_by_the_plan(tmp_path):
    """Forces of a cam or a heddle drive without masses are 0, with status 0: nothing else tells why."""
    text = """
[study]
name = "cam"
[mechanism]
family = "cam"
[scene]
speed = "600 rpm"
want = ["max_force_a"]
[design]
lift = "10 mm"
r0 = { from = 30, to = 40, count = 2, unit = "mm" }
"""
    heading = "bodies taken without mass, as none is given: they cause no force"
    for given, left in (("", ["  m_cam", "m_follower"]), ('[bodies]\nm_follower = "50 g"', ["  m_cam"])):
        study = load(tmp_path, text + given)
        lines = _effects(study, pilot(study))
        assert lines[lines.index(heading) + 1].split(", ") == left
    whole = load(tmp_path, text + '[bodies]\nm_follower = "50 g"\nm_cam = "80 g"')
    assert heading not in _effects(whole, pilot(whole))


def test_masses_that_lie_in_their_joints_are_said_by_the_plan(tmp_path):
    """The link of a slotted link has no second joint; its arm has a centre of mass."""
    text = """
[study]
name = "slotted"
[mechanism]
chain = ["rssr", "slotted"]
[scene]
speed = "600 rpm"
want = ["max_abs_drive_torque1"]
[design]
a1 = "12 mm"
b1 = "40 mm"
c1 = "30 mm"
e1 = "35 mm"
f1 = "0 mm"
g1 = "0 mm"
alpha1 = "20 deg"
a2 = "10 mm"
e2 = "26 mm"
[bodies]
m_crank1 = "10 g"
m_coupler1 = "10 g"
m_rocker1 = "10 g"
m_link2 = "12 g"
m_arm2 = "2 g"
com_arm_y2 = "1 mm"
[accuracy]
samples = 32
"""
    study = load(tmp_path, text)
    at = (lines := _effects(study, pilot(study))).index(
        "masses in the joints of their bodies, as centre and inertia are 0"
    )
    assert lines[at + 1] == "  m_link2"


def test_a_body_of_a_material_and_a_section_has_its_mass_per_length_among_the_parameters(tmp_path):
    bar = BODIES.replace('m_crank2 = "10 g"', 'crank2 = { material = "steel", section = "6 mm round" }')
    fixed = load(tmp_path, HEAD + "[bodies]\n" + bar).space.fixed
    assert fixed["m_crank2"] == 0.0
    assert fixed["line_mass_crank2"] == pytest.approx(7.85e-9 * 9.0 * np.pi, rel=1e-14)
    exact = bar.replace('round" }', 'round", inertia = "exact" }')
    assert load(tmp_path, HEAD + "[bodies]\n" + exact).space.fixed["gyration_crank2"] == pytest.approx(1.5, rel=1e-14)
    wrong = 'crank2 = { material = "steel", section = "6 mm" }'
    assert "bodies.crank2" in faults(tmp_path, HEAD + "[bodies]\n" + bar.replace(bar.split("\n")[1], wrong))
    assert "nothing beside the material" in faults(tmp_path, HEAD + "[bodies]\n" + bar + 'm_crank2 = "1 g"\n')


def test_what_nothing_wanted_takes_describes_the_machine_and_changes_no_study(tmp_path):
    bare = load(tmp_path, HEAD + "[bodies]\n" + BODIES)
    more = load(tmp_path, HEAD + "[bodies]\n" + BODIES + "mu_a1 = 0.05\nflywheel1 = '2 kg*mm^2'\n")
    assert more.fingerprint == bare.fingerprint
    assert "mu_a1" not in more.family.parameter_names


def test_name_of_an_effect_among_the_wanted_stands_for_its_outputs(tmp_path):
    study = load(tmp_path, HEAD + "[bodies]\n" + BODIES)
    assert {"max_abs_force_a2", "max_abs_drive_torque2", "max_abs_tool_load2"} <= set(study.want)
    assert "kinetostatics2" not in study.want


def test_load_over_the_turn_is_the_same_from_the_study_a_csv_and_a_parquet_file(tmp_path):
    inline = load(tmp_path, HEAD + "[bodies]\n" + BODIES + "[loads]\n" + FORCE)
    table = pd.DataFrame({"note": ["x"] * 3, "angle": [0.0, 90.0, 180.0], "force": [0.0, -5.0, 0.0]})
    table.to_parquet(tmp_path / "force.parquet")
    files = {"force.csv": "angle,force\n0,0\n90,-5\n180,0\n"}
    columns = ', columns = ["angle", "force"]'
    for name, more in (("force.csv", ""), ("force.parquet", columns)):
        entry = f'[loads]\ntool_force2 = {{ file = "{name}", unit = "N"{more} }}\n'
        study = load(tmp_path, HEAD + "[bodies]\n" + BODIES + entry, files)
        assert study.curves == inline.curves
        assert study.fingerprint == inline.fingerprint
        # A dataset keeps what the file said: it is complete without it.
        (tmp_path / name).unlink()
        assert study_from_data(study.data, tmp_path / "study.toml").curves == inline.curves
    stronger = FORCE.replace("-5", "-6")
    assert load(tmp_path, HEAD + "[bodies]\n" + BODIES + "[loads]\n" + stronger).fingerprint != inline.fingerprint


def test_units_of_angle_and_load_are_those_written(tmp_path):
    entry = "[loads]\nload_torque1 = { phi = [0.0, 0.25, 0.5], angle = 'rev', values = [0, 1, 0], unit = 'N*m' }\n"
    first = BODIES.replace("2 =", "1 =").replace('m_tool1 = "25 g"', "")
    text = HEAD.replace("kinetostatics2", "kinetostatics") + "[bodies]\n" + BODIES + first + entry
    curve = load(tmp_path, text).curves["load_torque1"]
    np.testing.assert_allclose(curve(np.array([0.5 * np.pi])), 1000.0, rtol=1e-14)


def test_smoke_version_replaces_a_curve_key_by_key(tmp_path):
    over = merged({"loads": {"tool_force2": {"mean": 1.0, "unit": "N"}}}, {"loads": {"tool_force2": {"mean": 2.0}}})
    assert over["loads"]["tool_force2"] == {"mean": 2.0, "unit": "N"}


@pytest.mark.parametrize(
    ("tables", "line"),
    [
        ('[bodies]\nm_crnk2 = "1 g"\n', "bodies.m_crnk2: unknown input of the effects of rssr+guide; allowed: m"),
        ('[bodies]\nload_torque1 = "1 N*m"\n', "bodies.load_torque1 = '1 N*m'; allowed: nothing here: it stands in [l"),
        ('[loads]\nm_crank2 = "1 g"\n', "loads.m_crank2 = '1 g'; allowed: nothing here: it stands in [bodies]"),
        ('[bodies]\na2 = "1 mm"\n', "bodies.a2 = '1 mm'; allowed: nothing here: it is a parameter of the mechanism"),
        ('[bodies]\nspeed1 = "1 rpm"\n', "bodies.speed1 = '1 rpm'; allowed: nothing here: it stands in [scene] or"),
        ("[bodies]\n" + BODIES.replace('m_crank2 = "10 g"\n', ""), "bodies.m_crank2 is missing"),
        ("[loads]\npierce_at2 = { phi = [0, 1], values = [1, 2], unit = 'mm' }\n", "it does not change over the turn"),
        ("[loads]\ntool_force2 = { phi = [0, 90], values = [1, 2] }\n", "loads.tool_force2.unit is missing"),
        ("[loads]\ntool_force2 = { phi = [0, 400], values = [1, 2], unit = 'N' }\n", "rising angles within one turn"),
        ("[loads]\ntool_force2 = { phi = [0, 90], unit = 'N' }\n", "loads.tool_force2.values is missing"),
        ("[loads]\ntool_force2 = { phi = [0, 9], values = [1, 2], mean = 1, unit = 'N' }\n", "allowed: one of {"),
        ("[loads]\ntool_force2 = { mean = 1, unit = 'mm' }\n", "a force, in N, kN or lbf"),
        ("[loads]\ntool_force2 = { file = 'f.csv', unit = 'N' }\n", "a table that can be read"),
        ("[loads]\ntool_force2 = { file = '../f.csv', unit = 'N' }\n", "without a folder"),
        ("[loads]\ntool_force2 = { file = 'g.csv', columns = ['a', 'c'], unit = 'N' }\n", "columns of the file: a, b"),
        ("[loads]\ntool_force2 = { file = 'g.csv', unit = 'N' }\n", "numbers in both columns"),
    ],
)  # fmt: skip
def test_faults_of_bodies_and_loads_name_the_place_and_what_is_right(tmp_path, tables, line):
    text = HEAD + tables if "[bodies]" in tables else HEAD + "[bodies]\n" + BODIES + tables
    assert line in faults(tmp_path, text, {"g.csv": "a,b\n0,x\n90,2\n"})


@pytest.mark.parametrize("content", ["0,0\n90,-5\n180,0\n", "angle;force\n0;0\n90;-5\n"])
def test_a_file_of_loads_needs_names_between_commas(tmp_path, content):
    """The first of its points was taken for the names, and lost."""
    entry = "[loads]\ntool_force2 = { file = 'g.csv', unit = 'N' }\n"
    told = faults(tmp_path, HEAD + "[bodies]\n" + BODIES + entry, {"g.csv": content})
    assert "two columns between commas, angle and load, below a line with their names" in told


def test_missing_mass_is_told_without_the_gram_of_tables_in_tonnes(tmp_path):
    fault = str(faults(tmp_path, HEAD + "[bodies]\n" + BODIES.replace('m_crank2 = "10 g"\n', "")))
    assert "mass of the crank" in fault and "a gram is" not in fault
    fault = str(faults(tmp_path, HEAD + "[bodies]\n" + BODIES.replace('m_crank2 = "10 g"', 'm_crank2 = "-10 g"')))
    assert "a non-negative mass (mass of the crank;" in fault and "a gram is" not in fault


def test_an_input_given_twice_is_a_fault(tmp_path):
    assert "either here or in [design]" in faults(tmp_path, HEAD + 'm_tool2 = "2 g"\n[bodies]\n' + BODIES)


def test_bodies_of_members_stand_under_the_member(tmp_path):
    text = """
[study]
name = "machine"
[machine.needle]
family = "guide"
[scene]
speed = "7000 rpm"
want = ["needle.tool"]
[design.needle]
a = "11 mm"
b = "40 mm"
c = "45 mm"
e = "38 mm"
xi = "75 mm"
eta = "12 mm"
lam = "1.4 rad"
h = "5 mm"
[bodies.needle]
m_tool = "25 g"
[loads.needle]
tool_force = { mean = -2.0, cos = [1.0], unit = "N" }
"""
    study = load(tmp_path, text)
    assert study.want == ("needle.max_abs_tool_load", "needle.max_abs_tool_torque")
    assert set(study.curves) == {"needle.tool_force"}
    assert study.space.fixed["needle.m_tool"] == pytest.approx(25e-6)
    assert study_from_data(study.data, study.path).fingerprint == study.fingerprint


def test_inputs_that_nothing_wanted_takes_are_read_all_the_same(tmp_path):
    unused = 'mu_a2 = "60 kg*mm^2"\nsupport_a22 = "1 N"\nradius_b2 = "3 mm"\n'
    found = faults(tmp_path, f"{HEAD}[bodies]{BODIES}{unused}")
    assert "bodies.mu_a2 = '60 kg*mm^2'; allowed: a number" in found
    assert "bodies.support_a22 = '1 N'; allowed:" in found
    assert "radius_b2" not in found


def test_a_fault_of_the_space_is_none_of_the_reference_that_takes_its_bodies(tmp_path):
    fixed = BODIES.replace('{ values = [10, 20], unit = "g" }', '"10 g"')
    design = HEAD[HEAD.index("a1 =") :].replace('{ from = 10, to = 14, count = 3, unit = "mm" }', '"12 mm"')
    text = f"{HEAD}[bodies]{fixed}[reference.design]\n{design}"
    assert load(tmp_path, text).reference["m_tool2"] == pytest.approx(25e-6)
    assert faults(tmp_path, text.replace('b1 = "60 mm"', "b1 = 60", 1)).count("\n") == 0


def test_a_misspelt_table_of_bodies_is_one_fault(tmp_path):
    found = faults(tmp_path, f"{HEAD}[bodys]{BODIES}")
    assert found.count("\n") == 0 and "bodys: unknown table" in found and "did you mean 'bodies'" in found
