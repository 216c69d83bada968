"""Thread of a machine: lengths, bends and tension against plain sums and the tables' own functions; exact gradients.

Lengths are sums of a few square roots, so they agree to some roundings of the largest of them.
"""

from __future__ import annotations

import math
from itertools import pairwise

import numpy as np
import pytest

import sweep
from kernels import status as st
from sweep.errors import InputError, StudyError
from sweep.families.base import Angles
from sweep.families.machines.thread_balance import GF
from sweep.families.machines.thread_way import bend
from sweep.study import load_study, study_from_data
from tests.evaluation.test_machines import NEEDLE

PHI = np.linspace(0.0, 6.0, 37)
GUIDE, HOLE, STOP = [-52.0, 122.0, 8.0], [-83.6, 79.0, 0.0], [-40.0, 130.0, 20.0]
EYELET = {"a": 20.0, "e": 30.0, "f": 10.0, "alpha": 0.5, "Z1": -30.0, "Z2": 40.0, "P_h": 60.0}
CAM = {"P_h": 60.0, "X1": 3.0, "Z1": 12.0, "e": 5.0, "R0": 30.0, "A1": 10.0, "B2": 3.0}
MEMBERS = {"needle": ["rssr", "guide"], "lever": {"family": "eyelet", "offset": 0.4}, "cam": "guided_cam"}
TABLE = {f"needle.{k}": v for k, v in NEEDLE.items()} | {f"lever.{k}": v for k, v in EYELET.items()}
TABLE |= {f"cam.{k}": v for k, v in CAM.items()}
THREAD = {
    "thread": ["lever", STOP, GUIDE, "needle.point", HOLE, "cam"], "stock": 130.0, "tension": 0.2, "stiffness": 0.004,
    "radius": [0.8, 1.0, 0.4, 1.5],
}  # fmt: skip


def machine(**changes):
    return sweep.machine(MEMBERS, {"upper": THREAD | changes})


def poses(made, wanted, table=TABLE, phi=PHI):
    found = sweep.evaluate(made, table, wanted, phi=phi)
    assert (found.status == st.OK).all()
    return found


def test_needed_given_and_surplus_are_plain_sums_of_distances():
    found = poses(
        machine(),
        ["upper_needed", "upper_given", "upper_surplus", "lever.P", "cam.P"]
        + [f"needle.point_{axis}" for axis in "xyz"],
    )
    eye = found[[f"needle.point_{axis}" for axis in "xyz"]].to_numpy()
    for k in range(len(found)):
        needed = math.dist(STOP, GUIDE) + math.dist(GUIDE, eye[k]) + math.dist(eye[k], HOLE)
        given = 130.0 - found["lever.P"][k] - found["cam.P"][k]
        assert found.upper_needed[k] == pytest.approx(needed, rel=1e-14)
        assert found.upper_given[k] == pytest.approx(given, rel=1e-14)
        assert found.upper_surplus[k] == pytest.approx(given - needed, abs=1e-12)
    assert np.ptp(found.upper_needed) > 5.0


def test_tension_is_the_law_of_contours_over_the_bends_in_their_order():
    names = ["upper_surplus", "upper_tension", "upper_wrap", "lever.wrap", "cam.wrap"]
    found = poses(machine(), names + [f"needle.point_{axis}" for axis in "xyz"])
    pulled = 0
    for _, row in found.iterrows():
        eye = np.array([row[f"needle.point_{axis}"] for axis in "xyz"])
        ways = np.diff(np.array([STOP, GUIDE, eye, HOLE]), axis=0)
        between = [math.degrees(math.atan2(np.linalg.norm(np.cross(p, q)), p @ q)) for p, q in pairwise(ways)]
        wraps = [math.degrees(row["lever.wrap"]), *between, math.degrees(row["cam.wrap"])]
        assert math.degrees(row.upper_wrap) == pytest.approx(sum(wraps), rel=1e-12)
        start = max(0.2 - 0.004 * row.upper_surplus, 0.0) / GF
        pulled += start > 0.0
        whole = sweep.thread.path(start, {"R": THREAD["radius"], "theta_deg": wraps})
        assert row.upper_tension == pytest.approx(GF * whole.T5[0], rel=1e-12)
    assert pulled > 0


def test_slack_thread_has_what_its_bends_alone_hold_and_more_surplus_does_not_change_it():
    slack = poses(machine(stock=1e4), ["upper_tension"]).upper_tension
    slacker = poses(machine(stock=2e4), ["upper_tension"]).upper_tension
    np.testing.assert_array_equal(slack, slacker)
    assert (poses(machine(), ["upper_tension"]).upper_tension >= slack).all()


@pytest.mark.parametrize("angle", [0.0, 1e-9, 1e-3, 1.0, 2.0, np.pi - 1e-9, np.pi])
def test_bend_is_exact_where_the_thread_runs_straight_and_where_it_is_folded(angle):
    e1, e2 = (1.0, 0.0, 0.0), (np.cos(angle), np.sin(angle), 0.0)
    assert float(bend(tuple(map(np.float64, e1)), tuple(map(np.float64, e2)))) == pytest.approx(
        angle, rel=1e-12, abs=2e-16
    )


def test_wrap_of_the_cam_follower_is_that_of_a_thread_over_one_point():
    found = poses("guided_cam", ["wrap", "S"], CAM)
    for _, row in found.iterrows():
        d = np.array([row.S, CAM["e"] - CAM["X1"], CAM["Z1"]])
        other = np.array([row.S, CAM["e"] - CAM["X1"], -CAM["Z1"]])
        # Both pieces make the angle of S over the distance from the line of the guides' plane; by symmetry twice.
        half = math.atan2(row.S, math.hypot(d[1], d[2]))
        assert row.wrap == pytest.approx(2.0 * half, rel=1e-14)
        assert np.linalg.norm(d) + np.linalg.norm(other) == pytest.approx(CAM["P_h"] + poses_at(row.phi), rel=1e-13)


def poses_at(phi):
    return sweep.evaluate("guided_cam", CAM, ["P"], phi=[phi]).P[0]


def test_point_of_a_coupler_is_an_eyelet_like_any_other():
    planar = {"drive": {"family": "four_bar", "eye": [12.0, 5.0, 3.0]}}
    table = {"drive.a": 10.0, "drive.b": 40.0, "drive.c": 30.0, "drive.e": 38.0, "drive.xi": 12.0, "drive.eta": 5.0}
    relation = {"upper": {"thread": [STOP, "drive.eye", HOLE]}}
    wanted = ["drive.eye_x", "drive.eye_y", "drive.eye_z", "drive.x_m", "drive.y_m", "upper_needed"]
    found = poses(sweep.machine(planar, relation), wanted, table)
    np.testing.assert_allclose(found["drive.eye_x"], found["drive.x_m"], rtol=1e-13)
    np.testing.assert_allclose(found["drive.eye_y"], found["drive.y_m"], rtol=1e-13, atol=1e-13)
    np.testing.assert_array_equal(found["drive.eye_z"], 3.0)
    for k in range(0, len(found), 9):
        eye = [found[f"drive.eye_{axis}"][k] for axis in "xyz"]
        assert found.upper_needed[k] == pytest.approx(math.dist(STOP, eye) + math.dist(eye, HOLE), rel=1e-14)


def test_point_on_the_coupler_of_a_spatial_drive_is_that_of_the_coupler_effect():
    links = {"a": 10.0, "b": 40.0, "c": 25.0, "e": 35.0, "f": 5.0, "g": -3.0, "alpha": 1.05}
    made = sweep.machine({"drive": {"family": "rssr", "eye": [15.0, 0.0, 0.0]}})
    found = poses(made, [f"drive.eye_{axis}" for axis in "xyz"], {f"drive.{k}": x for k, x in links.items()})
    effect = poses("rssr", ["x_p", "y_p", "z_p"], links | {"x_point": 15.0})
    np.testing.assert_allclose(
        found[[f"drive.eye_{a}" for a in "xyz"]], effect[["x_p", "y_p", "z_p"]], rtol=1e-12, atol=1e-12
    )
    with pytest.raises(InputError, match="on the line of the joints"):
        sweep.machine({"drive": {"family": "rssr", "eye": [15.0, 1.0, 0.0]}})
    with pytest.raises(InputError, match="has none"):
        sweep.machine({"drive": {"family": "eyelet", "eye": [15.0, 0.0, 0.0]}})


@pytest.mark.parametrize("output", ["upper_surplus", "upper_tension", "upper_wrap", "upper_excess"])
def test_gradients_by_the_complex_step_are_those_of_central_differences(output):
    made = machine(allowed={"phi": [0.0, 2.0, 4.0], "values": [2.0, 0.5, 2.0]}, stock=110.0)
    row = np.array([[TABLE.get(p.name, p.default) for p in made.parameters]])
    angles = Angles.of(PHI[None, ::6])
    for name in ("lever.a", "lever.P_h", "lever.offset", "cam.A1", "needle.a1", "needle.x_at"):
        k = made.parameter_names.index(name)
        step = 1e-6 * max(1.0, abs(row[0, k]))
        unit = np.zeros_like(row)
        unit[0, k] = 1.0
        tiny = made.poses(row + 1e-200j * unit, angles, frozenset({output}))[output]
        ahead, behind = (made.poses(row + s * step * unit, angles, frozenset({output}))[output] for s in (1.0, -1.0))
        exact = np.imag(tiny) / 1e-200
        size = max(1.0, np.abs(exact).max())
        np.testing.assert_allclose(exact, (ahead - behind) / (2.0 * step), atol=1e-6 * size)


def test_most_surplus_is_allowed_over_the_turn_and_its_place_is_found():
    made = machine(allowed={"phi": [0.0, 2.0, 4.0], "values": [2.0, 0.5, 2.0]})
    found = sweep.summarise(made, TABLE, ["max_upper_excess", "phi_max_upper_excess", "range_upper_surplus"])
    fine = poses(made, ["upper_excess", "upper_surplus"], phi=np.linspace(0.0, 2.0 * np.pi, 20001))
    assert found.max_upper_excess[0] == pytest.approx(fine.upper_excess.max(), abs=1e-5)  # 20001 samples
    assert found.range_upper_surplus[0] == pytest.approx(np.ptp(fine.upper_surplus), abs=1e-5)


@pytest.mark.parametrize("width", [0.05, 0.002])
def test_a_notch_in_what_is_allowed_is_not_missed(width):
    """Between the points of its table the curve is smooth: Gauss on each piece knows its mean to rounding."""
    points = [0.0, 1.0, 1.0 + width, 1.0 + 2.0 * width]
    thread = {"thread": [STOP, "drive.eye", HOLE], "allowed": {"phi": points, "values": [6.0, 6.0, -30.0, 6.0]}}
    made = sweep.machine({"drive": {"family": "four_bar", "eye": [12.0, 5.0, 3.0]}}, {"upper": thread})
    table = {"drive.a": 10.0, "drive.b": 40.0, "drive.c": 30.0, "drive.e": 38.0}
    found = sweep.summarise(made, table, ["max_upper_excess", "rms_upper_excess"], accuracy=1e-8).iloc[0]
    x, weights = np.polynomial.legendre.leggauss(80)
    square, most = 0.0, -np.inf
    for start, end in pairwise([*points, 2.0 * np.pi]):
        at = start + 0.5 * (end - start) * (x + 1.0)
        square += 0.5 * (end - start) * weights @ poses(made, ["upper_excess"], table, at).upper_excess.to_numpy() ** 2
        most = max(most, poses(made, ["upper_excess"], table, np.linspace(start, end, 400)).upper_excess.max())
    assert found.rms_upper_excess == pytest.approx(math.sqrt(square / (2.0 * np.pi)), rel=1e-8)
    assert most <= found.max_upper_excess + 1e-12 and found.max_upper_excess < most + 0.1 * width
    assert found.status == st.OK


@pytest.mark.parametrize(("changes", "speed"), [({"stock": 257.5, "stiffness": 0.1}, 0.0), ({}, 700.0)])
def test_extremes_of_the_tension_at_its_kinks_keep_the_accuracy(changes, speed):
    """It has kinks where the thread becomes slack, and where its speed leaves the measured range."""
    table = {"drive.a": 10.0, "drive.b": 40.0, "drive.c": 30.0, "drive.e": 38.0, "upper_speed": speed}
    table |= {"drive.xi": 12.0, "drive.eta": 5.0, "drive.lam": 0.3, "drive.h": 0.0}
    thread = {"thread": [STOP, "drive.point", HOLE], "tension": 0.2, "radius": 2.4} | changes
    made = sweep.machine({"drive": "guide"}, {"upper": thread})
    found = sweep.summarise(made, table, ["min_upper_tension", "max_upper_tension"], accuracy=1e-8).iloc[0]
    size = 1e-8 * found.max_upper_tension
    assert found.status == st.OK and max(found.err_min_upper_tension, found.err_max_upper_tension) <= size
    for name, sign in (("min_upper_tension", -1.0), ("max_upper_tension", 1.0)):
        phi = np.linspace(0.0, 2.0 * np.pi, 2001)
        for _ in range(4):  # ever closer to the pose that is beyond all others
            tension = sign * poses(made, ["upper_tension"], table, phi).upper_tension
            phi = phi[tension.argmax()] + (phi[1] - phi[0]) * np.linspace(-1.0, 1.0, 201)
        assert found[name] == pytest.approx(sign * tension.max(), abs=2.0 * size), name


EDGE = {"a": 0.3862972320083632, "X1": -0.7938025818599606, "Y1": -3.561063343973213, "Z1": -2.016207720436983}
EDGE |= {"X2": 1.7028389336647864, "Y2": -1.1151966263861868, "Z2": 2.5652392940996886, "P_h": 5.190297446276568}


@pytest.mark.parametrize("output", ["t_wrap", "t_surplus", "edge.tension", "edge.eyelet_force"])
def test_extremes_of_a_thread_on_a_bare_edge_are_found_where_it_comes_to_lie_and_leaves(output):
    """Its wrap jumps where the shortest way passes from one side of the edge to the other."""
    thread = {"thread": ["edge", [0.0, 30.0, 5.0], [9.0, -20.0, 0.0]], "stock": 90.0}
    made = sweep.machine({"edge": "free_cam"}, {"t": thread})
    table = {f"edge.{name}": x for name, x in EDGE.items()}
    table |= {"edge.thread_tension": 20.0, "edge.eyelet_radius": 1.0, "edge.mu_eyelet": 0.4} if "edge" in output else {}
    member, dot, own = output.rpartition(".")
    name = f"{member}{dot}max_{own}"
    found = sweep.summarise(made, table, [name], accuracy=1e-8).iloc[0]
    phi = np.linspace(0.0, 2.0 * np.pi, 4001)
    for _ in range(4):
        values = poses(made, [output], table, phi)[output]
        phi = phi[values.argmax()] + (phi[1] - phi[0]) * np.linspace(-1.0, 1.0, 201)
    assert found.status == st.OK and found[name] == pytest.approx(values.max(), rel=1e-8)
    assert found[f"err_{name}"] <= 1.01e-8 * found[name]


@pytest.mark.parametrize(
    ("changes", "word"),
    [
        ({"thread": ["levr", STOP, HOLE]}, "did you mean 'lever'"),
        ({"thread": ["lever", STOP]}, "two points at least in a row"),
        ({"thread": [[0.0, 1.0], HOLE, STOP]}, "three finite numbers"),
        ({"radius": [1.0]}, "one for each of the 4 bends"),
        ({"radius": -1.0}, "not negative"),
        ({"stiffness": "x"}, "a finite number"),
        ({"stoc": 1.0}, "did you mean 'stock'"),
        ({"allowed": {"phi": [0.0, 9.0], "values": [1.0, 2.0]}}, "within one turn"),
        ({"allowed": {"phi": [0.0, 1.0]}}, "phi \\[rad\\] and values"),
    ],
)
def test_what_is_no_thread_is_named(changes, word):
    with pytest.raises(InputError, match=word):
        machine(**changes)


STUDY = """
[study]
name = "thread"
[machine.drive]
family = "four_bar"
eye = ["12 mm", "5 mm", "0 mm"]
[machine.lever]
family = "eyelet"
[thread.upper]
path = ["lever", ["40 mm", "60 mm", "0 mm"], "drive.eye", ["0 mm", "-30 mm", "2 mm"]]
stock = "15 cm"
tension = "20 gf"
stiffness = "10 gf/mm"
radius = ["1 mm", "0.5 mm"]
allowed = { phi = [0, 180], values = [2, 1], unit = "mm" }
[scene]
want = ["max_upper_tension", "max_upper_excess", "range_upper_surplus"]
[design.drive]
a = "10 mm"
b = "40 mm"
c = "30 mm"
e = "38 mm"
[design.lever]
a = "20 mm"
e = "30 mm"
f = "10 mm"
alpha = "0.5 rad"
Z1 = "-30 mm"
Z2 = "40 mm"
P_h = { from = 60, to = 70, count = 3, unit = "mm" }
"""


def test_study_has_its_threads_in_its_units(tmp_path):
    (tmp_path / "study.toml").write_text(STUDY)
    study = load_study(tmp_path)
    (thread,) = study.family.relations
    assert thread.stock == 150.0
    assert thread.tension == pytest.approx(20.0 * GF, rel=1e-15)
    assert thread.stiffness == pytest.approx(10.0 * GF, rel=1e-15)
    assert thread.radii == (1.0, 0.5)
    assert study_from_data(study.data, study.path).fingerprint == study.fingerprint


@pytest.mark.parametrize(
    ("old", "new", "line"),
    [
        ('"drive.eye", [', '"drive.ey", [', "thread.upper.path = 'drive.ey'; allowed: points, take-ups: drive.b"),
        ('"2 mm"]]', '"2"]]', "thread.upper.path[3][2] = '2'; allowed: a number and its unit"),
        (
            '["1 mm", "0.5 mm"]',
            '["1 mm"]',
            "thread.upper.radius = ['1 mm']; allowed: one number, or one for each of the 2",
        ),
        ('"20 gf"', '"20 mm"', "thread.upper.tension = '20 mm'; allowed: a force"),
        ('stock = "15 cm"', 'stok = "15 cm"', "thread.upper.stok: unknown key"),
        ("path = [", "pth = [", "thread.upper.pth: unknown key"),
        (', unit = "mm" }\n[scene]', " }\n[scene]", "thread.upper.allowed.unit is missing"),
        ('"lever", ["40', '7, ["40', "thread.upper.path[0] = 7"),
    ],
)
def test_faults_of_a_thread_name_key_and_what_is_right(tmp_path, old, new, line):
    assert old in STUDY
    (tmp_path / "study.toml").write_text(STUDY.replace(old, new))
    with pytest.raises(StudyError) as error:
        load_study(tmp_path)
    assert line in "\n".join(error.value.faults)


def test_thread_needs_a_machine(tmp_path):
    text = (
        '[study]\nname = "x"\n[mechanism]\nfamily = "eyelet"\n[thread.upper]\npath = ["lever"]\n[design]\na = "1 mm"\n'
    )
    (tmp_path / "study.toml").write_text(text)
    with pytest.raises(StudyError, match="it needs a \\[machine\\]"):
        load_study(tmp_path)
