"""Stitches made by hand, whose moments are known in closed form; mirrored and reversed ones; what is degenerate.

The needle hangs on a crank pin (a guided point with xi = eta = 0), G = CRANK (cos phi, sin phi, 0), and points along
-x, so it is lowest at 180 deg; with its scarf along z the tip passes it along y.  The looper turns about an axis along
x by psi = 90 deg - atan(SHARE cos phi_l), so that its arm stands along z where its crank stands at -90 deg.
"""

from __future__ import annotations

import math

import numpy as np
import pandas as pd
import pytest
from scipy.spatial.transform import Rotation

import sweep
from kernels import status as st
from sweep.errors import InputError
from sweep.evaluation.tables import design_matrix

CRANK, ARM, SHARE = 12.0, 30.0, 0.625
AFTER = math.radians(30.0)  # from the needle's lowest point to A
PHI = math.pi + AFTER
AT = (CRANK * math.cos(PHI) - 28.0, CRANK * math.sin(PHI), 0.45 - ARM)  # the tip 28 below G, 0.45 beside the axis
NEEDLE = {"on": "needle.point", "line": "line", "sense": -1, "scarf": [0.0, 0.0, 1.0], "diameter": 0.75}
NEEDLE |= {"scarf_end": 24.0, "eye": 30.0, "point": 34.0}
BLADE = {"on": "looper", "tip": [ARM, 0.0, 0.0], "back": [0.5 * ARM, 0.0, 0.0], "radius": 0.4}
DESIGN = {"a": CRANK, "b": 40.0, "c": 35.0, "e": 30.0, "xi": 0.0, "eta": 0.0, "lam": 0.0, "h": 0.0, "branch": 1.0}
DESIGN = {f"needle.{key}": value for key, value in DESIGN.items()}
DESIGN |= {"looper.a": 5.0, "looper.e": 0.0, "looper.f": 8.0, "looper.alpha": 0.5 * math.pi}
WANT = ["phi_a", "count_a", "a_rise", "a_clearance", "a_above_eye", "a_below_scarf_end", "a_lag", "a_gauge"]
WANT += ["a_overtravel", "a_reach", "a_back_height", "a_back_side", "a_directness", "a_free"]


def machine_of(relations=None, *, at=AT, side=1, sense=1, running=1, tools=None, members=None, needle=None):
    place = {"at": [at[0], at[1], side * at[2]], "axis": [side, 0.0, 0.0], "zero": [0.0, 1.0, 0.0]}
    looper = {"family": "slotted", "offset": -0.5 * math.pi - PHI, "ratio": running, "place": place}
    thin = NEEDLE | {"scarf": [0.0, 0.0, side]} | (needle or {})
    return sweep.machine(
        {"needle": {"family": "guide", "ratio": running}, "looper": looper} | (members or {}),
        {"a": {"take": ["thin", "blade"], "sense": side * sense}} | (relations or {}),
        tools={"thin": thin, "blade": BLADE} | (tools or {}),
    )


def found(machine, want=WANT, design=DESIGN):
    return sweep.summarise(machine, design, want, accuracy=1e-9).iloc[0]


def across(phi):
    """The tip across the needle."""
    turned = SHARE * math.cos(phi - 0.5 * math.pi - PHI)
    return AT[1] + ARM * turned / math.hypot(1.0, turned) - CRANK * math.sin(phi)


def test_moment_a_is_the_one_made_by_hand():
    got = found(machine_of())
    turned = ARM * SHARE - CRANK * math.cos(PHI)
    expected = {
        "phi_a": PHI, "count_a": 1.0, "a_rise": CRANK * (1.0 - math.cos(AFTER)), "a_clearance": 0.45 - 0.375,
        "a_above_eye": 2.0, "a_below_scarf_end": 4.0, "a_lag": AFTER, "a_gauge": -across(math.pi),
        "a_directness": turned / math.hypot(turned, CRANK * math.sin(PHI)),
    }  # fmt: skip
    assert got["status"] == st.OK
    for name, value in expected.items():
        assert got[name] == pytest.approx(value, abs=1e-13 * 100.0), name
    samples = [across(2.0 * math.pi * k / 20000) for k in range(20000)]
    # The largest of 20 000 samples is short of a peak by at most |X''| (pi/20000)^2/2, some 40 * 1.3e-8.
    assert got["a_reach"] == pytest.approx(-min(samples), abs=1e-6)
    assert got["a_overtravel"] == pytest.approx(max(samples), abs=1e-6)


def test_mirrored_stitch_has_the_same_moment():
    plain, mirrored = found(machine_of()), found(machine_of(side=-1))
    for name in WANT:
        assert mirrored[name] == pytest.approx(plain[name], abs=1e-12), name


def test_reversed_running_passes_at_the_opposite_angle_in_the_other_sense():
    plain, backwards = found(machine_of()), found(machine_of(running=-1, sense=-1))
    assert backwards["status"] == st.OK
    # The machine's pose at phi is now that of -phi; the looper's crank keeps its offset.
    assert backwards["phi_a"] == pytest.approx(2.0 * math.pi - plain["phi_a"], abs=1e-12)
    for name in ("a_rise", "a_clearance", "a_above_eye", "a_directness"):
        assert backwards[name] == pytest.approx(plain[name], abs=1e-12), name


@pytest.mark.parametrize(("turn", "ahead"), [((1.0, -0.7, 0.2), CRANK), ((0.1, 2.0, 0.4), 11.999), ((0, 0, 1), 0)])
def test_of_two_lowest_places_the_last_one_counts_wherever_the_machine_stands(turn, ahead):
    """The needle goes down twice in a turn; put ``ahead`` along itself its lowest depth is a small difference."""
    rotation = Rotation.from_rotvec(turn)

    def place(at, *axes):
        axis, zero = rotation.apply(axes).tolist()
        return {"at": rotation.apply(np.add(at, [ahead, 3.0, 50.0])).tolist(), "axis": axis, "zero": zero}

    looper = {"family": "slotted", "offset": -0.5 * math.pi - PHI, "place": place(AT, [1.0, 0.0, 0.0], [0.0, 1.0, 0.0])}
    needle = {"family": "guide", "ratio": 2, "place": place([0.0, 0.0, 0.0], [0.0, 0.0, 1.0], [1.0, 0.0, 0.0])}
    long = {"scarf": rotation.apply([0.0, 0.0, 1.0]).tolist(), "top": -60.0, "point": 60.0}
    got = found(machine_of(members={"needle": needle, "looper": looper}, needle=long), ["phi_a", "a_lag", "a_gauge"])
    assert got["a_lag"] == pytest.approx(got["phi_a"] - 0.5 * math.pi, abs=1e-12) and got["a_lag"] < math.pi
    turned = SHARE * math.cos(PHI)
    assert got["a_gauge"] == pytest.approx(-AT[1] - ARM * turned / math.hypot(1.0, turned), abs=1e-11)


def test_a_tip_that_touches_the_line_is_undecided():
    forward = found(machine_of(sense=-1), ["a_reach"])["a_reach"]
    backward = found(machine_of(), ["a_reach"])["a_reach"]
    for shift in (-forward, backward):  # the extreme itself comes to lie on the line, from either side
        touching = machine_of(at=(AT[0], AT[1] + shift, AT[2]), needle={"point": 200.0})
        got = found(touching, ["phi_a", "a_reach"])
        assert got["status"] == st.TANGENT and math.isnan(got["phi_a"]), shift
    for shift, status in ((-forward - 1e-9, (st.NEVER,)), (-forward + 1e-9, (st.OK, st.WRONG_SIDE))):
        near = machine_of(at=(AT[0], AT[1] + shift, AT[2]), needle={"point": 200.0})
        assert found(near, ["phi_a"])["status"] in status


@pytest.mark.parametrize("apart", [1e-6, 1e-8, 1e-10, 1e-12])
def test_errors_of_a_passage_that_nearly_touches_are_those_of_its_root(apart):
    """The angle moves by the rounding of coordinates over the slope across, and with it all that is read there."""
    shift = found(machine_of(), ["a_reach"])["a_reach"] - apart
    long = {"top": -100.0, "scarf_end": -50.0, "eye": 100.0, "point": 200.0}
    machine = machine_of(at=(AT[0], AT[1] + shift, AT[2]), needle=long)
    names = ["phi_a", "a_clearance", "a_above_eye", "a_rise", "a_directness"]
    got = sweep.summarise(machine, DESIGN, names, accuracy=1e-12).iloc[0]
    low, high = (np.longdouble(got["phi_a"]) + way * 0.5 * math.sqrt(apart / 40.0) for way in (-1.0, 1.0))
    for _ in range(70):
        middle = 0.5 * (low + high)
        turned = SHARE * np.cos(middle + np.longdouble(-0.5 * math.pi - PHI))
        off = np.longdouble(AT[1] + shift) + ARM * turned / np.sqrt(1.0 + turned**2) - CRANK * np.sin(middle)
        low, high = (middle, high) if off < 0.0 else (low, middle)
    poses = sweep.evaluate(machine, DESIGN, ["a_side", "a_height", "a_depth", "a_dacross", "a_speed"], phi=[float(low)])
    side, height, depth, dacross, speed = poses.loc[0, ["a_side", "a_height", "a_depth", "a_dacross", "a_speed"]]
    for name, value in zip(names, (low, side - 0.375, 100.0 - height, CRANK - depth, dacross / speed), strict=True):
        assert abs(got[name] - value) <= got[f"err_{name}"] <= 1e-3 * math.sqrt(1e-12 / apart), name


def test_the_gap_counts_from_the_needles_top_to_its_lowest_point_only():
    machine = machine_of({"whole": {"gap": ["thin", "blade"]}})
    got = found(machine, ["a_free", "min_whole", "phi_min_whole"])
    poses = sweep.evaluate(machine, DESIGN, ["a_gap"], phi=[math.pi * k / 4000 for k in range(4001)])
    # Samples a step apart miss the least by no more than half a step times the tip's relative speed, some 30 per rad.
    assert got["a_free"] == pytest.approx(poses["a_gap"].min(), abs=15.0 * math.pi / 4000)
    assert got["min_whole"] < got["a_free"] and got["phi_min_whole"] > math.pi


@pytest.mark.parametrize("shift", [4.0, 8.0, 12.0, 16.0])
def test_axes_that_meet_on_the_way_down_leave_minus_the_radii(shift):
    """The curve of the gap is a wedge there: its place counts to first order, so it is found to rounding."""
    machine = machine_of(at=(AT[0], AT[1] + shift, AT[2]), needle={"scarf_end": 2.0, "eye": 60.0, "point": 80.0})
    got = found(machine, ["a_free"])
    assert abs(got["a_free"] + 0.375 + 0.4) <= min(got["err_a_free"], 1e-12)


PLATE = {"plate": {"at": [-28.0, 7.0, 9.0], "normal": [2.0, 0.0, 0.0], "fabric": 2.0}}


def test_needle_goes_through_fabric_and_plate_where_they_are():
    """The plate is the plane x = -28, up along x; the needle's point stands at x = CRANK cos phi - 34."""
    relations = {"lift": {"above": ["thin", "plate"]}, "tip": {"above": ["blade", "plate"]}}
    relations |= {"enters": {"event": "lift_fabric", "rising": False}, "leaves": {"event": "lift"}}
    machine = machine_of(relations, tools=PLATE)
    got = found(machine, ["phi_enters", "phi_leaves", "min_lift", "phi_min_lift", "min_lift_fabric"])
    expected = {
        "phi_enters": math.acos((34.0 - 28.0 + 2.0) / CRANK), "phi_leaves": 2.0 * math.pi - math.acos(6.0 / CRANK),
        "min_lift": -CRANK - 6.0, "phi_min_lift": math.pi, "min_lift_fabric": -CRANK - 8.0,
    }  # fmt: skip
    for name, value in expected.items():
        assert got[name] == pytest.approx(value, abs=1e-9), name
    poses = sweep.evaluate(machine, DESIGN, ["dlift", "dtip", "tip"], phi=[1.0])
    assert poses["dlift"][0] == pytest.approx(-CRANK * math.sin(1.0), abs=1e-12)
    assert poses["tip"][0] == pytest.approx(AT[0] + 28.0, abs=1e-12) and abs(poses["dtip"][0]) < 1e-12


@pytest.mark.parametrize("of", [["thin", "blade"], ["plate", "thin"]])
def test_height_is_one_above_a_plate(of):
    with pytest.raises(InputError, match="a needle, a blade or a moving point, then a plate: plate"):
        machine_of({"lift": {"above": of}}, tools=PLATE)


STILL = {"family": "slotted", "place": {"at": [-28.0, -5.0, -4.0], "axis": [0.0, 1.0, 0.0], "zero": [0.0, 0.0, 1.0]}}
TRIANGLE = {
    "still": {"on": "upper", "tip": [5.0, 0.0, 0.0], "back": [0.0, 0.0, 0.0], "eye": [0.0, 0.0, 0.0]}
    | {"hold": [0.0, 0.0, 30.0]},
    "seam": {"at": [-28.0, -5.0, 26.0]},
}
ENTERED = ["phi_c", "count_c", "c_from_blade", "c_from_thread", "c_from_seam", "c_margin", "c_pace"]
UPPER = {f"upper.{name.partition('.')[2]}": x for name, x in DESIGN.items() if name.startswith("looper")}


def entering(table, at=None, seam=None):
    place = STILL["place"] | ({"at": at} if at else {})
    tools = TRIANGLE | ({"seam": {"at": seam}} if seam else {})
    return machine_of({"c": table}, members={"upper": STILL | {"place": place}}, tools=tools)


def test_needle_enters_a_triangle_made_by_hand():
    """Corners on the looper's axis stand still: a right angle at the eye, legs of 30 in the plane x = -28.

    The needle's point, 34 below G, passes that plane at 60 deg on its way down and at 300 deg on its way up.
    """
    got = found(entering({"enter": ["thin", "still", "seam"], "sense": -1}), ENTERED, DESIGN | UPPER)
    aside = CRANK * math.sin(math.pi / 3.0)
    expected = {
        "phi_c": math.pi / 3.0, "count_c": 1.0, "c_from_blade": 4.0, "c_from_thread": aside + 5.0,
        "c_from_seam": (21.0 - aside) / math.sqrt(2.0), "c_margin": 4.0 - 0.375, "c_pace": aside,
    }  # fmt: skip
    assert got["status"] == st.OK
    for name, value in expected.items():
        assert got[name] == pytest.approx(value, abs=1e-13 * 100.0), name
    back = found(entering({"enter": ["thin", "still", "seam"], "sense": 1}), ENTERED, DESIGN | UPPER)
    assert back["phi_c"] == pytest.approx(5.0 * math.pi / 3.0, abs=1e-12)
    assert back["status"] == st.WRONG_SIDE and back["c_from_thread"] == pytest.approx(5.0 - aside, abs=1e-12)


@pytest.mark.parametrize("window", [(0.0, 360.0), (-180.0, 180.0), (30.0, 390.0), (100.0, 700.0)])
def test_a_window_of_a_whole_turn_holds_every_angle(window):
    table = {"enter": ["thin", "still", "seam"], "sense": -1, "window": [math.radians(end) for end in window]}
    got = found(entering(table), ENTERED, DESIGN | UPPER)
    assert got["status"] == st.OK and got["phi_c"] == pytest.approx(math.pi / 3.0, abs=1e-12)


def test_loopers_tip_enters_a_triangle_made_by_hand():
    """The tip passes the plane y = AT_y where its arm stands along z: 240 deg before and 30 deg behind the lowest."""
    members = {"upper": {"family": "slotted", "place": {"at": [AT[0] - 10.0, AT[1], AT[2] + ARM - 3.0]}}}
    members["upper"]["place"] |= {"axis": [1.0, 0.0, 0.0], "zero": [0.0, 1.0, 0.0]}
    tools = TRIANGLE | {"seam": {"at": [AT[0] - 10.0, AT[1], AT[2] + ARM + 27.0]}}
    relations = {"c": {"enter": ["blade", "still", "seam"], "sense": -1, "window": [3.0, 4.5]}}
    got = found(machine_of(relations, members=members, tools=tools), ENTERED, DESIGN | UPPER)
    expected = {"phi_c": PHI, "count_c": 1.0, "c_from_blade": 3.0, "c_from_thread": 10.0, "c_pace": ARM * SHARE}
    expected |= {"c_from_seam": (30.0 - 13.0) / math.sqrt(2.0), "c_margin": 3.0 - 0.4}
    assert got["status"] == st.OK
    for name, value in expected.items():
        assert got[name] == pytest.approx(value, abs=1e-13 * 100.0), name


@pytest.mark.parametrize(
    ("table", "at", "seam", "status"),
    [
        ({"sense": -1, "window": [2.0, 3.0]}, None, None, st.NEVER),
        ({"sense": -1, "window": [5.0, 6.0]}, None, None, st.WRONG_WAY),
        ({"sense": -1, "window": [5.0, 2.0]}, None, None, st.OK),  # over zero
        ({"sense": -1}, [-28.0 - 20.0, -5.0, -4.0], [-28.0 - 20.0, -5.0, 26.0], st.NEVER),
        ({"sense": -1}, [-46.0, -5.0, -4.0], [-46.0, -5.0, 26.0], st.TANGENT),
        ({"sense": -1}, None, [-28.0, 60.0, -4.0], st.NO_TRIANGLE),
    ],
)
def test_what_does_not_enter_is_said_by_status(table, at, seam, status):
    table = {"enter": ["thin", "still", "seam"]} | table
    assert found(entering(table, at, seam), ["phi_c"], DESIGN | UPPER)["status"] == status


def test_rise_has_the_window_that_two_fields_leave():
    fields = {"slow and loose": [1.5, 3.0], "fast and thick": [1.0, 2.5]}
    machine = machine_of({"a": {"take": ["thin", "blade"], "fields": fields}})
    rise = CRANK * (1.0 - math.cos(AFTER))
    assert found(machine, ["a_room"])["a_room"] == pytest.approx(rise - 1.5, abs=1e-12)
    (step,) = (step for step in machine.steps if step.name == "passage a")
    text = next(output.text for output in step.provides if output.name == "a_room")
    assert text.endswith("at least 1.5 for slow and loose, at most 2.5 for fast and thick")


def text_of_room(machine):
    (step,) = (step for step in machine.steps if step.name == "passage a")
    return next(output.text for output in step.provides if output.name == "a_room")


def test_fields_that_leave_no_window_are_said_by_status_and_name():
    fields = {"slow and loose": [2.0, 3.0], "fast and thick": [1.0, 1.8]}
    machine = machine_of({"a": {"take": ["thin", "blade"], "fields": fields}})
    got = found(machine, ["a_room", "a_least", "a_most", "a_rise"])
    assert got["status"] == st.NO_WINDOW
    assert (got["a_least"], got["a_most"]) == (2.0, 1.8)
    assert got["a_room"] == pytest.approx(got["a_rise"] - 2.0, abs=1e-12) and got["a_room"] < 0.0
    assert text_of_room(machine).endswith("at least 2 for slow and loose, at most 1.8 for fast and thick: none is left")


def test_fields_that_vary_leave_a_window_or_none_design_by_design():
    fields = {"slow and loose": [1.5, 3.0], "fast and thick": [1.0, 2.5]}
    machine = machine_of({"a": {"take": ["thin", "blade"], "fields": fields, "vary": True}})
    rise = CRANK * (1.0 - math.cos(AFTER))
    changed = [{}, {"a_least_slow_and_loose": 2.6}, {"a_most_fast_and_thick": 1.7}, {"a_least_fast_and_thick": 1.55}]
    rows = pd.DataFrame([DESIGN | one for one in changed]).fillna(
        {"a_least_slow_and_loose": 1.5, "a_most_fast_and_thick": 2.5, "a_least_fast_and_thick": 1.0}
    )
    got = sweep.summarise(machine, rows, ["a_room", "a_least", "a_most"], accuracy=1e-9)
    assert got["status"].tolist() == [st.OK, st.NO_WINDOW, st.OK, st.OK]
    ends = [(1.5, 2.5), (2.6, 2.5), (1.5, 1.7), (1.55, 2.5)]
    assert list(zip(got["a_least"], got["a_most"], strict=True)) == ends
    rooms = [min(rise - least, most - rise) for least, most in ends]
    assert got["a_room"].tolist() == pytest.approx(rooms, abs=1e-12)
    window = next(relation.window for relation in machine.relations if relation.name == "a")
    for one, row in zip(changed[1:], (1, 2, 3), strict=True):
        design = design_matrix(machine, dict(rows.loc[row]))[0][0]
        (slow, _), (fast, _) = window.binding(design, machine.parameter_names)
        assert slow == ("fast and thick" if "a_least_fast_and_thick" in one else "slow and loose")
        assert fast == "fast and thick"
    assert text_of_room(machine).endswith("its window, which slow and loose and fast and thick leave")


@pytest.mark.parametrize("name", ["a_gap", "a_side", "a_free"])
def test_two_relations_with_one_output_are_refused(name):
    """What the moment reads of its own gap and coordinates would be those of the other relation."""
    with pytest.raises(InputError, match=f"relation = '{name}'; allowed: an output or parameter of one relation alone"):
        machine_of({name: {"gap": ["needle.rocker", "blade"]}})


@pytest.mark.parametrize("name", ["looper", "needle.rocker", "two words"])
def test_a_tool_with_the_name_of_a_member_or_a_link_is_refused(name):
    """A thread over it would run over the member, and a gap to the link would be one to the tool."""
    with pytest.raises(InputError, match=f"tool = '{name}'; allowed: a plain word that is no member"):
        machine_of(tools={name: {"at": [0.0, 0.0, 0.0]}})


def test_what_does_not_sew_says_which_fault_its_moment_has():
    fields = {"slow and loose": [1.5, 3.0], "fast and thick": [1.0, 2.5]}
    sews = {"sew": ["a"], "speeds": [50.0 * math.pi, 100.0 * math.pi]}
    for sense, status in ((1, st.OK), (-1, st.WRONG_WAY)):
        machine = machine_of({"a": {"take": ["thin", "blade"], "sense": sense, "fields": fields}, "sews": sews})
        got = found(machine, ["sews_at_1500"])
        assert got["status"] == status and math.isnan(got["sews_at_1500"]) == (status != st.OK)


def test_fields_vary_only_where_there_are_some():
    with pytest.raises(InputError, match="whether the ends of its fields are parameters"):
        machine_of({"a": {"take": ["thin", "blade"], "vary": True}})
