"""Degrees never pass for radians: headers, the argument angles=, and what is refused while nothing says the unit."""

from __future__ import annotations

import math

import numpy as np
import pandas as pd
import pytest
from click.testing import CliRunner

import sweep
from sweep.cli import main
from sweep.families import NAMES, family

DESIGN = {"a": 10.0, "b": 40.0, "c": 25.0, "e": 35.0, "f": 5.0, "g": -3.0}
RADIANS = DESIGN | {"alpha": math.pi / 3}
DEGREES = DESIGN | {"alpha": 60.0}
HEADED = DESIGN | {"alpha [deg]": 60.0}


@pytest.mark.parametrize("table", [HEADED, pd.DataFrame([HEADED], index=["drive"])])
def test_header_with_degrees_is_converted(table):
    found = sweep.evaluate("rssr", table, "psi, d2psi", phi=[0.3])
    plain = sweep.evaluate("rssr", RADIANS, ["psi", "d2psi"], phi=[0.3])
    np.testing.assert_array_equal(found[["psi", "d2psi"]], plain[["psi", "d2psi"]])
    assert found.index[0] == ("drive" if isinstance(table, pd.DataFrame) else 0)
    turn = sweep.summarise("rssr", table, "swing,margin")
    np.testing.assert_array_equal(turn, sweep.summarise("rssr", RADIANS, ["swing", "margin"]))


def test_argument_says_the_unit_of_table_and_grid():
    found = sweep.evaluate("rssr", DEGREES, "psi", phi=[0.0, 90.0], angles="deg")
    plain = sweep.evaluate("rssr", RADIANS, "psi", phi=[0.0, 0.5 * math.pi])
    pd.testing.assert_frame_equal(found, plain)  # results, and the column phi, are in rad
    row = sweep.evaluate("rssr", DEGREES | {"phi": 90.0}, "psi", angles="deg")
    assert row["psi"][0] == plain["psi"][1]
    joints = sweep.joints("rssr", DEGREES, 90.0, angles="deg")
    pd.testing.assert_frame_equal(joints, sweep.joints("rssr", RADIANS, 0.5 * math.pi))
    assert len(sweep.plot.motion("rssr", DEGREES, "psi", angles="deg")) == 1


@pytest.mark.parametrize("call", [
    lambda: sweep.evaluate("rssr", DEGREES, "psi", phi=0.0),
    lambda: sweep.summarise("rssr", DEGREES, "swing"),
    lambda: sweep.joints("rssr", DEGREES, 0.0),
    lambda: sweep.export("rssr", DEGREES, "never.csv"),
    lambda: sweep.plot.motion("rssr", DEGREES),
    lambda: sweep.plot.mechanism("rssr", DEGREES),
    lambda: sweep.plot.polar_load("rssr", DEGREES),
])  # fmt: skip
def test_parameter_above_a_turn_is_refused_with_the_remedy(call):
    with pytest.raises(sweep.InputError, match=r'column alpha, row 0: alpha = 60.0; .*"alpha \[deg\]".*angles="deg"'):
        call()


@pytest.mark.parametrize("phi", [180, [0, 30, 360], np.linspace(0, 360, 50), np.arange(0, 720, 7.5), -90.0])
def test_grid_in_degrees_is_refused(phi):
    with pytest.raises(sweep.InputError, match=r'rad, which this does not look like; for degrees write "90 deg"'):
        sweep.evaluate("rssr", RADIANS, "psi", phi=phi)
    with pytest.raises(sweep.InputError, match="does not look like"):
        sweep.evaluate("rssr", RADIANS | {"phi": phi}, "psi")
    assert (sweep.evaluate("rssr", RADIANS, "psi", phi=phi, angles="rad")["status"] == 0).all()


@pytest.mark.parametrize(
    "phi", [4 * math.pi, [0.0, 12.0], np.linspace(0, 20 * math.pi, 9), -12345.678, 1e9, [180.0, 1e6], 39.72467163391411]
)
def test_angles_of_many_turns_in_rad_are_taken(phi):
    assert (sweep.evaluate("rssr", RADIANS, "psi", phi=phi)["status"] == 0).all()


def test_a_whole_turn_is_no_parameter_too_large():
    for whole in (2 * math.pi, -2 * math.pi, np.deg2rad(360.0), np.nextafter(2 * math.pi, 7)):
        assert sweep.evaluate("rssr", DESIGN | {"alpha": whole}, "psi", phi=0.0)["status"][0] == 0
    machine = {"looper": {"family": "rssr", "ratio": 1}}
    moved = {f"looper.{name}": value for name, value in RADIANS.items()} | {"looper.offset": 6.75}
    assert sweep.summarise(machine, moved, "looper.swing")["status"][0] == 0  # a member may start beyond a turn
    with pytest.raises(sweep.InputError, match="does not look like"):
        sweep.summarise(machine, moved | {"looper.offset": 180.0}, "looper.swing")
    above = DESIGN | {"alpha": 6.5}
    with pytest.raises(sweep.InputError, match="at most 2 pi"):
        sweep.evaluate("rssr", above, "psi", phi=0.0)
    assert sweep.evaluate("rssr", above, "psi", phi=0.0, angles="rad")["status"][0] == 0


@pytest.mark.parametrize("table, words", [
    (HEADED | {"alpha": 1.0}, "either alpha or alpha"),
    (DESIGN | {"alpha [grad]": 60.0}, "an angle, in deg"),
    (RADIANS | {"a [mm]": 10.0}, "either a or a"),
    ({name: x for name, x in RADIANS.items() if name != "a"} | {"a [kg]": 10.0}, "a length, in mm"),
    (DESIGN | {"alpha [deg]": "sixty"}, r"column alpha \[deg\], row 0"),
    (HEADED | {"alpha [rad]": 0.5}, "one heading with its unit, not two"),
])  # fmt: skip
def test_header_that_cannot_be_is_refused(table, words):
    with pytest.raises(sweep.InputError, match=words):
        sweep.evaluate("rssr", table, "psi", phi=0.0)


def test_offset_of_a_member_in_degrees_is_refused():
    with pytest.raises(sweep.InputError, match="offset = 180"):
        sweep.machine({"looper": {"family": "rssr", "offset": 180}})
    assert sweep.machine({"looper": {"family": "rssr", "offset": 6.98}}).parameters


def test_requirements_in_degrees_give_the_same_mechanisms():
    given = {"swing": 45.0, "phi0": 195.0, "phi1": 0.0, "e": 100.0, "f": 0.0, "g": 10.0, "alpha": 60.0}
    angles = ("swing", "phi0", "phi1", "alpha")
    rad = given | {name: math.radians(given[name]) for name in angles}
    headed = {f"{name} [deg]" if name in angles else name: value for name, value in given.items()}
    plain = sweep.synthesise("rssr", rad, max_pressure_angle=math.radians(60.0))
    pd.testing.assert_frame_equal(plain, sweep.synthesise("rssr", given, max_pressure_angle=60.0, angles="deg"))
    pd.testing.assert_frame_equal(plain, sweep.synthesise("rssr", headed, max_pressure_angle=math.radians(60.0)))
    with pytest.raises(sweep.InputError, match="for degrees write"):
        sweep.synthesise("rssr", given)


def test_angles_of_threads_say_their_unit_too():
    plain = sweep.thread.capstan({"T1": 5.0, "wrap": math.pi / 2, "mu": 0.2})
    pd.testing.assert_frame_equal(plain, sweep.thread.capstan({"T1": 5.0, "wrap [deg]": 90.0, "mu": 0.2}))
    with pytest.raises(sweep.InputError, match="does not look like"):
        sweep.thread.capstan({"T1": 5.0, "wrap": 90.0, "mu": 0.2})
    assert sweep.thread.capstan({"T1": 5.0, "wrap": 6 * math.pi, "mu": 0.2})["status"][0] == 0  # three windings


def test_unknown_unit_is_refused():
    with pytest.raises(sweep.InputError, match='"rad" or "deg"'):
        sweep.summarise("rssr", RADIANS, "swing", angles="grad")


def test_columns_of_others_keep_their_headers():
    found = sweep.evaluate("rssr", RADIANS | {"mass [kg]": 3.0}, "psi", phi=0.0, keep=True)
    assert found["mass [kg]"][0] == 3.0


def test_variable_that_is_no_angle_may_be_large(tmp_path):
    example = dict(family("backrest").example)
    lengths = [p.name for p in family("backrest").parameters if p.unit == "length"]
    assert family("backrest").domain.unit == "length" and lengths
    with pytest.raises(sweep.InputError, match="column psi"):
        sweep.evaluate("backrest", example | {"psi": 86.0}, "K_couple", phi=[0.3])
    assert "does not look" not in str(sweep.evaluate("backrest", example, "K_couple", phi=[180.0])["status"])
    in_mm = {name: 1000.0 * value if name in lengths else value for name, value in example.items()}
    turned = [p.name for p in family("backrest").parameters if p.unit == "angle"]
    degrees = {name: math.degrees(value) if name in turned else value for name, value in in_mm.items()}
    plain = sweep.joints("backrest", in_mm, 262.5)
    assert set(plain["phi"]) == {262.5} and (plain["status"] == 0).all()
    said = sweep.joints("backrest", degrees, 262.5, angles="deg")
    np.testing.assert_allclose(said[["phi", "x", "y"]], plain[["phi", "x", "y"]], rtol=1e-9, atol=1e-9)
    file = sweep.export("backrest", degrees, tmp_path / "rest.csv", phi=262.5, angles="deg")
    np.testing.assert_allclose(pd.read_csv(file)["x"][: len(plain)], plain["x"], rtol=1e-9, atol=1e-9)
    assert len(sweep.plot.mechanism("backrest", in_mm, phi=262.5)) == 1


@pytest.mark.parametrize("name", NAMES)
def test_examples_of_the_register_are_plausible_angles(name):
    angles = [p.name for p in family(name).parameters if p.unit == "angle"]
    assert all(abs(family(name).example.get(key, 0.0)) <= 2 * math.pi for key in angles)


def test_verbs_take_degrees_by_option_and_by_header(tmp_path):
    run = CliRunner().invoke
    for name, table in (("deg", DEGREES), ("rad", RADIANS), ("headed", HEADED)):
        pd.DataFrame([table]).to_csv(tmp_path / f"{name}.csv", index=False)
    plain = run(main, ["summarise", "rssr", str(tmp_path / "rad.csv"), "--want", "swing"]).output
    by_option = ["summarise", "rssr", str(tmp_path / "deg.csv"), "--want", "swing", "--angles", "deg"]
    assert run(main, by_option).output == plain
    assert run(main, ["summarise", "rssr", str(tmp_path / "headed.csv"), "--want", "swing"]).output == plain
    refused = run(main, ["summarise", "rssr", str(tmp_path / "deg.csv"), "--want", "swing"])
    assert refused.exit_code == 2 and "--angles deg" in refused.output
    pd.DataFrame([HEADED | {"phi [deg]": 90.0}]).to_csv(tmp_path / "pose.csv", index=False)
    one = run(main, ["eval", "rssr", str(tmp_path / "pose.csv"), "--want", "psi"])
    assert one.exit_code == 0 and float(one.output.splitlines()[1].split(",")[0]) == pytest.approx(-2.0241, abs=1e-4)
    turn = ["eval", "rssr", str(tmp_path / "deg.csv"), "--want", "psi", "--poses", "4", "--angles", "deg"]
    assert float(run(main, turn).output.splitlines()[2].split(",")[2]) == pytest.approx(-2.0241, abs=1e-4)
    phi = ["draw", "mechanism", "rssr", str(tmp_path / "rad.csv"), "--phi", "180", "--out", str(tmp_path / "x.svg")]
    assert run(main, phi).exit_code == 2
    out = tmp_path / "motion.svg"
    done = run(main, ["draw", "motion", "rssr", str(tmp_path / "deg.csv"), "--angles", "deg", "--out", str(out)])
    assert done.exit_code == 0 and out.exists(), done.output
