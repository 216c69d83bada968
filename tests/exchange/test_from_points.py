"""Dimensions read off points of a drawing: published hardpoints, round trips, what is refused."""

from __future__ import annotations

import math
import tomllib

import numpy as np
import pytest
from click.testing import CliRunner
from hypothesis import assume, example, given, settings
from hypothesis import strategies as st

import sweep
from sweep.cli import main
from sweep.evaluation.joints import parts
from sweep.families import family
from sweep.families.capabilities import Hardpoints
from sweep.study import load_study

HARDPOINTS = {
    "A": [0.0, 0.0, 0.0], "axis_A": [1.0, 0.0, 0.0], "B": [0.0, 0.0, 200.0], "C": [-750.0, -850.0, 650.0],
    "D": [-400.0, -850.0, 0.0], "axis_D": [0.0, 1.0, 0.0],
}  # fmt: skip
SERVED = ("rssr", "rssp", "four_bar", "guide", "slider_crank")


def test_spatial_four_bar_of_uraeus_smbd():
    found = sweep.from_points("rssr", **HARDPOINTS)
    expected = {"a": 200.0, "b": 1219.6310917650, "c": 738.2411530117, "e": 0.0, "f": 400.0, "g": -850.0}
    for name, value in expected.items():
        assert found.parameters[name] == pytest.approx(value, abs=1e-9)
    assert found.parameters["alpha"] == pytest.approx(-0.5 * math.pi, abs=1e-15)
    assert found.branch == -1.0
    assert abs(found.phi) == pytest.approx(math.pi, abs=1e-15)
    assert found.residual < 1e-12
    psi = sweep.evaluate("rssr", found.parameters, "psi", phi=[found.phi])["psi"][0]
    assert math.degrees(psi) == pytest.approx(151.69924423, abs=1e-7)


def test_spatial_slider_crank_of_the_ifftomm_benchmark():
    found = sweep.from_points(
        "rssp", A=[0, 0.1, 0.12], axis_A=[1, 0, 0], B=[0, 0.1, 0.2], C=[0.2, 0, 0], D=[0, 0, 0], axis_D=[1, 0, 0]
    )
    assert found.parameters["a"] == pytest.approx(0.08, abs=1e-15)
    assert found.parameters["b"] == pytest.approx(0.3, abs=1e-15)
    assert found.parameters["e"] == pytest.approx(0.1562049935, abs=1e-10)
    assert found.parameters["f"] == 0.0
    assert found.parameters["alpha"] == pytest.approx(0.5 * math.pi, abs=1e-15)
    assert math.degrees(found.phi) == pytest.approx(-140.19443, abs=5e-6)
    assert found.branch == 1.0
    motion = sweep.evaluate("rssp", found.parameters, ["s", "ds"], phi=[found.phi])
    assert motion["s"][0] == pytest.approx(0.2, abs=1e-14)
    assert 6.0 * motion["ds"][0] == pytest.approx(0.24, abs=1e-13)


def turned(seed):
    """A random rotation."""
    q, r = np.linalg.qr(np.random.default_rng(seed).normal(size=(3, 3)))
    q = q * np.sign(np.diag(r))
    return q if np.linalg.det(q) > 0.0 else q[:, [1, 0, 2]]


def drawing(name, design, phi, rotation, at):
    """Points of a design in a frame of its own, as a drawing has them."""
    (part,) = parts(name, design, phi)
    reader = family(name).find(Hardpoints)
    points = {}
    for needed in (*reader.needs, *reader.may):
        joint = needed.removeprefix("axis_")
        joint = joint if joint in part.joints else joint.lower()
        if needed.startswith("axis_"):
            points[needed] = (rotation @ part.axes[joint]).tolist()
        else:
            points[needed] = (rotation @ part.joints[joint][0] + at).tolist()
    return points


dimension = st.floats(0.3, 3.0)
offset = st.floats(-3.0, 3.0)
DIMENSIONS = {
    "rssr": {"a": dimension, "c": dimension, "e": dimension, "f": offset, "g": offset,
             "alpha": st.one_of(st.floats(0.1, 3.0), st.floats(-3.0, -0.1))},
    "rssp": {"a": dimension, "e": dimension, "f": offset, "alpha": st.floats(-1.4, 1.4)},
    "four_bar": {"a": dimension, "c": dimension, "e": dimension, "xi": offset, "eta": offset},
    "guide": {"a": dimension, "c": dimension, "e": dimension, "xi": offset, "eta": offset,
              "lam": st.floats(-3.0, 3.0), "h": offset},
    "slider_crank": {"a": dimension, "e": offset},
}  # fmt: skip


def reaching(name, design, phi, share):
    """The length of a coupler that reaches from the crank pin, well away from a dead point."""
    u, v, alpha, f = math.cos(phi), math.sin(phi), design.get("alpha", 0.0), design.get("f", 0.0)
    x, y = design["a"] * u, f * math.sin(alpha) + design["a"] * math.cos(alpha) * v
    z = f * math.cos(alpha) - design["a"] * math.sin(alpha) * v
    if name == "slider_crank":
        return math.hypot(y - design["e"], 0.5 + 2.0 * share)
    if name == "rssp":
        return math.hypot(x - design["e"], z, 0.5 + 2.0 * share)
    angle, r = math.pi * (0.1 + 0.8 * share), math.hypot(x - design["e"], y)
    return math.hypot(z - design.get("g", 0.0), r - design["c"] * math.cos(angle), design["c"] * math.sin(angle))


@pytest.mark.parametrize("name", SERVED)
@settings(max_examples=80, deadline=None)
@given(
    data=st.data(),
    phi=st.floats(-3.1, 3.1),
    branch=st.sampled_from([-1.0, 1.0]),
    share=st.floats(0.0, 1.0),
    seed=st.integers(0, 10**6),
)
def test_round_trip_gives_the_design_back(name, data, phi, branch, share, seed):
    design = {key: data.draw(values, key) for key, values in DIMENSIONS[name].items()}
    design |= {"b": reaching(name, design, phi, share), "branch": branch}
    pose = sweep.evaluate(name, design, "pressure_angle", phi=[phi])
    assume(pose["pressure_angle"][0] < 1.55)  # near a dead point the coupler says nothing of the sign of the branch
    assert pose["status"][0] == 0
    rotation, at = turned(seed), np.array([3.0, -2.0, 5.0])
    found = sweep.from_points(name, **drawing(name, design, phi, rotation, at))
    # Coordinates carry 1e-15; the common perpendicular of axes 0.1 rad apart loses a factor of 10 to 100.
    slack = 1e-12 if name not in ("rssr", "rssp") else 1e-12 / max(0.05, abs(math.sin(2.0 * design["alpha"])))
    for key, value in design.items():
        error = found.parameters[key] - value
        if key in ("alpha", "lam"):
            error = math.remainder(error, 2.0 * math.pi)
        assert abs(error) < slack, key
    assert abs(math.remainder(found.phi - phi, 2.0 * math.pi)) < slack
    np.testing.assert_allclose(found.place.rotation, rotation, atol=slack)
    np.testing.assert_allclose(found.place.at, at, atol=10.0 * slack)
    assert found.residual < 1e-13 + slack


@settings(max_examples=60, deadline=None)
@given(
    e=st.one_of(st.floats(0.1, 2.0), st.floats(-2.0, -0.1)),
    alpha=st.sampled_from([0.0, math.pi, 1e-10, 0.5, -0.5, 1.57]),
    seed=st.integers(0, 10**6),
)
@example(e=0.0, alpha=0.5, seed=1)
@example(e=0.0, alpha=-1.57, seed=2)
def test_equivalent_frames_give_the_same_motion(e, alpha, seed):
    design = {"a": 0.5, "c": 3.0, "e": e, "f": 0.3, "g": -0.6, "alpha": alpha, "branch": 1.0}
    design["b"] = reaching("rssr", design, 0.4, 0.5)
    rotation, at = turned(seed), np.array([0.3, 0.2, -0.5])
    pose = sweep.evaluate("rssr", design, "psi", phi=[0.4])
    assert pose["status"][0] == 0
    found = sweep.from_points("rssr", **drawing("rssr", design, 0.4, rotation, at))
    assert found.parameters["e"] >= 0.0
    step = np.linspace(0.0, 0.2, 6)
    (first,) = parts("rssr", design, 0.4 + step)
    (second,) = parts("rssr", found.parameters, found.phi + step)
    for joint in "bcd":
        np.testing.assert_allclose(
            second.joints[joint] @ found.place.rotation.T + found.place.at,
            first.joints[joint] @ rotation.T + at,
            atol=2e-9 if alpha == 1e-10 else 1e-12,  # axes 1e-10 rad apart are read as parallel
        )


def refused(name, match, **points):
    with pytest.raises(sweep.InputError, match=match):
        sweep.from_points(name, **points)


def test_points_that_make_no_mechanism_are_refused():
    refused("rssr", "missing", **{k: v for k, v in HARDPOINTS.items() if k != "C"})
    refused("rssr", "did you mean 'axis_A'", **HARDPOINTS, axisA=[0, 0, 1])
    refused("rssr", "three finite numbers", **HARDPOINTS | {"B": [0.0, math.nan, 1.0]})
    refused("rssr", "not all zeros", **HARDPOINTS | {"axis_D": [0.0, 0.0, 0.0]})
    refused("rssr", "off the crank axis", **HARDPOINTS | {"B": [5.0, 0.0, 0.0]})
    refused("rssr", "another point than B", **HARDPOINTS | {"C": HARDPOINTS["B"]})
    refused("rssr", "axes on one line", **HARDPOINTS | {"D": [9.0, 0.0, 0.0], "axis_D": [1.0, 0.0, 0.0]})
    refused("swivel", "one of rssr", **HARDPOINTS)


def test_point_off_its_circle_is_refused_and_the_joint_is_named():
    moved = HARDPOINTS | {"B": [3.0, 0.0, 200.0]}
    refused("rssr", r"B = .*from \[0, 0, 200\], where the other points put it", **moved)
    accepted = sweep.from_points("rssr", **moved, tolerance=0.01)
    assert 3.0 <= accepted.residual < 10.0


def test_planar_points_off_their_plane_and_dead_points_are_refused():
    points = {"A": [0, 0, 0], "B": [1, 0.5, 0], "C": [3, 3, 0], "D": [4, 0, 0]}
    assert sweep.from_points("four_bar", **points).residual < 1e-14
    refused("four_bar", "off", **points | {"C": [3, 3, 0.1]})
    refused("four_bar", "dead point", **points | {"B": [1, 0, 0], "C": [2, 0, 0]})


def test_a_study_begins_with_the_points_of_a_drawing(tmp_path):
    file = tmp_path / "drawing.csv"
    rows = [f"{name},{x!r},{y!r},{z!r}" for name, (x, y, z) in HARDPOINTS.items()]
    file.write_text("\n".join(["name,x [mm],y [mm],z [mm]", *rows]) + "\n")
    words = ["init", "drawn", "--family", "rssr", "--points", str(file), "--into", str(tmp_path)]
    done = CliRunner().invoke(main, words)
    assert done.exit_code == 0, done.output
    study = load_study(tmp_path / "drawn")
    found = sweep.from_points("rssr", **HARDPOINTS).parameters
    assert {name: study.reference[name] for name in found} == found
    assert study.space.bounds["a"] == pytest.approx((190.0, 210.0)) and study.space.fixed["branch"] == found["branch"]
    done = CliRunner().invoke(main, ["check", str(tmp_path / "drawn")])
    assert done.exit_code == 0 and "25 designs" in done.output, done.output


def test_verb_reads_a_table_of_points_and_writes_a_design(tmp_path):
    file, out = tmp_path / "drawing.csv", tmp_path / "design.csv"
    rows = [f"{name},{x!r},{y!r},{z!r}" for name, (x, y, z) in HARDPOINTS.items()]
    file.write_text("\n".join(["name, x, y, z", *rows]) + "\n")
    done = CliRunner().invoke(main, ["points", "rssr", str(file), "--out", str(out)])
    assert done.exit_code == 0, done.output
    said = tomllib.loads(done.output)
    assert said["design"]["branch"] == -1 and said["design"]["a"] == "200 mm" and said["drawing"]["residual"] < 1e-9
    done = CliRunner().invoke(main, ["eval", "rssr", str(out), "--want", "psi"])
    assert float(done.output.splitlines()[1].split(",")[0]) == pytest.approx(math.radians(151.69924423), abs=1e-9)
    inches = [f"{name},{x / 25.4!r},{y / 25.4!r},{z / 25.4!r}" for name, (x, y, z) in HARDPOINTS.items()]
    headed = "name,x [inch],y [inch],z [inch]"
    for head, options in (("name,x,y,z", ["--unit", "inch"]), (headed, []), (headed, ["--unit", "inch"])):
        file.write_text("\n".join([head, *inches]) + "\n")
        again = tomllib.loads(CliRunner().invoke(main, ["points", "rssr", str(file), *options]).output)["design"]
        b = float(again["b"].removesuffix(" mm"))
        assert b == pytest.approx(1219.6310917650, abs=1e-9) and again["alpha"] == "-90 deg"
    done = CliRunner().invoke(main, ["points", "rssr", str(file), "--unit", "kg"])
    assert done.exit_code == 2 and "a length, in mm" in done.output
    for head in ("name,x,y,z", headed):
        file.write_text(f"{head}\nA,0,0,0\nB,0,0,2 mm\n")
        done = CliRunner().invoke(main, ["points", "rssr", str(file)])
        assert done.exit_code == 2 and "row 1: z" in done.output and "'2 mm'; allowed: a number" in done.output
    for head, row, found in (("name,x,y", "A,0,0", "name, x, y"), ("name;x;y;z", "A;0,5;0;0", "name;x;y;z")):
        file.write_text(f"{head}\n{row}\n")
        done = CliRunner().invoke(main, ["points", "rssr", str(file)])
        words = f"is missing; needed: the columns name, x, y, z between commas; found {found}\n"
        assert done.exit_code == 2 and words in done.output
