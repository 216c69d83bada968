"""Gaps of capsules and the moment A against the 25-digit table, each within 16 roundings of its condition."""

from __future__ import annotations

import json
import math
from pathlib import Path

import numpy as np
import pytest
from mpmath import mp, mpf

import sweep
from kernels import status as st
from sweep.errors import InputError
from sweep.evaluation.tables import design_matrix
from sweep.families import family
from sweep.families.machines.crossings import Poses
from sweep.families.machines.segments import closest, triple_product
from tests.families.machines import test_hand_made_stitches as hand_made

TABLE = json.loads((Path(__file__).parents[2] / "oracle" / "machine_open.json").read_text())["rows"]
FACTOR = 16.0
TURN = np.arange(8192) * (2.0 * np.pi / 8192)


def rows_of(kind, case=None):
    return [row for row in TABLE if row["kind"] == kind and case in (None, row["case"])]


def machine_of(given, **relations):
    """Return the machine of a needle and a looper, and its design."""
    needle, looper, design = given["needle"], given["looper"], {}
    place = {key: needle[key] for key in ("at", "axis", "zero")} | {"stage": 1}
    members = {
        "needle": {"chain": [stage["family"] for stage in needle["stages"]], "place": place},
        "looper": {
            "family": "rssr",
            "ratio": looper["ratio"],
            "offset": looper["offset"],
            "place": {key: looper[key] for key in ("at", "axis", "zero")},
        },
    }
    for n, stage in enumerate(needle["stages"], start=1):
        design |= {f"needle.{key}{n}": value for key, value in stage["p"].items()}
        design |= {f"needle.{key}{n}": stage[key] for key in ("kappa", "offset", "shift", "turn") if key in stage}
    design |= {f"looper.{key}": value for key, value in looper["p"].items()}
    sizes = {key: needle[key] for key in ("sense", "scarf", "diameter", "scarf_end", "eye", "point")}
    tools = {
        "thin": {"on": "needle.point", "line": "line"} | sizes,
        "blade": {"on": "looper", "tip": looper["tip"], "back": looper["back"]},
    }
    return sweep.machine(members, relations, tools=tools), design


def factor(row, name, value):
    exact = mpf(row["expected"][name])
    with mp.workdps(40):
        error = mpf(float(value)) - exact
        if name.startswith("phi"):
            error -= 2 * mp.pi * mp.nint(error / (2 * mp.pi))
        return float(abs(error) / (mpf(2) ** -53 * max(mpf(row["cond"][name]), abs(exact))))


def test_distances_of_segments_are_those_of_the_table():
    worst = {}
    for row in rows_of("capsule"):
        p1, q1, p2, q2 = ([np.float64(x) for x in row["inputs"][name]] for name in ("p1", "q1", "p2", "q2"))
        found = closest(p1, q1, p2, q2)
        values = {"distance": found.distance, "gap": found.distance - row["inputs"]["r1"] - row["inputs"]["r2"]}
        values |= {"triple_product": triple_product(p1, q1, p2, q2)}
        for name, value in values.items():
            if name in row["expected"]:
                scale = float(row["scale"][name] if isinstance(row["scale"], dict) else row["scale"])
                error = float(abs(mpf(float(value)) - mpf(row["expected"][name]))) / (2.0**-53 * scale)
                worst[name, row["case"]] = max(worst.get((name, row["case"]), 0.0), error)
    assert worst and max(worst.values()) < FACTOR, worst


@pytest.mark.parametrize("angle", [1e-3, 1e-6, 1e-8, 1e-10])
def test_segments_that_cross_at_a_hairs_angle_are_no_distance_apart(angle):
    """They meet but for the rounding of their ends; at 1e-8 rad they were found 1e-7 apart."""
    rng = np.random.default_rng(5)
    for _ in range(50):
        meet, d1, across = 50.0 * rng.normal(size=3), 30.0 * rng.normal(size=3), 30.0 * rng.normal(size=3)
        d2 = rng.uniform(0.5, 2.0) * d1 + angle * across
        s, t = rng.uniform(0.2, 0.8, 2)
        found = closest(meet - s * d1, meet + (1.0 - s) * d1, meet - t * d2, meet + (1.0 - t) * d2)
        assert found.distance <= FACTOR * 2.0**-53 * 100.0


@pytest.mark.parametrize("case", sorted({row["case"] for row in rows_of("moment_A")}))
def test_the_moment_a_is_that_of_the_table(case):
    worst = {}
    for row in rows_of("moment_A", case):
        given, expected = row["inputs"], row["expected"]
        machine, design = machine_of(given, a={"take": ["thin", "blade"], "sense": given["looper"]["sense"]})
        names = {
            "phi_A": "phi_a", "lag_A": "a_lag", "clearance_A": "a_clearance", "rise_A": "a_rise",
            "above_eye_A": "a_above_eye", "below_scarf_end_A": "a_below_scarf_end", "overtravel_A": "a_overtravel",
            "gauge": "a_gauge", "reach_before": "a_reach",
        }  # fmt: skip
        found = sweep.summarise(machine, design, [*names.values(), "count_a"], accuracy=1e-9).iloc[0]
        assert found["count_a"] == expected["passages"]
        for name, own in names.items():
            if name not in expected:
                continue
            worst[name] = max(worst.get(name, 0.0), factor(row, name, found[own]))
        if expected["passages"] == 1:
            assert found["status"] in (st.OK, st.WRONG_SIDE)
            rates = sweep.evaluate(
                machine, design, ["a_dacross", "a_dside", "a_dheight", "a_ddepth"], phi=[found["phi_a"]]
            )
            for name, own in zip(("across", "side", "height", "needle"), rates.columns[-5:], strict=False):
                worst[f"rate_{name}_A"] = max(
                    worst.get(f"rate_{name}_A", 0.0), factor(row, f"rate_{name}_A", rates[own][0])
                )
        else:
            assert found["status"] in (st.TWICE, st.NEVER, st.WRONG_WAY)
    assert max(worst.values()) < FACTOR, worst


def test_least_gap_over_the_turn_is_that_of_the_table():
    for row in rows_of("capsule_turn"):
        machine, design = machine_of(row["inputs"], free={"gap": ["thin", "blade"]})
        found = sweep.summarise(machine, design, ["min_free", "phi_min_free"], accuracy=1e-9).iloc[0]
        distance = found["min_free"] + 0.5 * row["inputs"]["needle"]["diameter"]
        error = abs(float(mpf(float(distance)) - mpf(row["expected"]["distance"])))
        assert error <= max(found["err_min_free"], FACTOR * 2.0**-53 * float(row["cond"]["distance"])), row["expected"]
        apart = abs(found["phi_min_free"] - float(row["expected"]["phi"]))
        assert min(apart, 2.0 * math.pi - apart) < 1e-6


def lowest_by_cam(dwell, law):
    """A cam turns the crank of the needle to 10 deg before its lower dead point, holds it there and turns it back.

    Machine, design, crank angle at which the crank turns back, and the gauge.
    """
    cam = {"lift": 1.2, "rise": 1.5, "dwell": dwell, "fall": 1.5, "start": 0.2, "r0": 3.0, "c": 5.0, "e": 6.0}
    leaves = 0.2 + 1.5 + dwell
    held = sweep.evaluate("cam_lever", cam | {"law": law, "branch": -1.0}, ["psi"], phi=[leaves])["psi"][0]
    needle = {f"needle.{key}1": value for key, value in cam.items()} | {"needle.law1": law, "needle.branch1": -1.0}
    needle |= {
        f"needle.{key.removeprefix('needle.')}2": x for key, x in hand_made.DESIGN.items() if key.startswith("needle.")
    }
    looper = {key: x for key, x in hand_made.DESIGN.items() if key.startswith("looper.")} | {"looper.offset": 0.7}
    machine = hand_made.machine_of(
        at=(hand_made.AT[0] + 6.0, 10.0, hand_made.AT[2]), members={"needle": {"chain": ["cam_lever", "guide"]}}
    )
    turned = hand_made.SHARE * math.cos(leaves + 0.7)
    gauge = hand_made.CRANK * math.sin(math.radians(170.0)) - 10.0 - hand_made.ARM * turned / math.hypot(1.0, turned)
    return machine, needle | looper | {"needle.offset2": math.radians(170.0) - held}, leaves, gauge


def test_of_a_needle_that_stands_at_its_lowest_place_the_end_of_that_counts():
    machine, design, leaves, gauge = lowest_by_cam(1.0, 1.0)
    got = hand_made.found(machine, ["a_gauge", "phi_a", "a_lag"], design)
    assert got["status"] == st.OK
    # the end of the dwell is known to the rounding of an angle, some 1e-14, and the looper is slower than 20 per radian
    assert got["a_gauge"] == pytest.approx(gauge, abs=1e-11)
    assert got["a_lag"] == pytest.approx(got["phi_a"] - leaves, abs=1e-12)


@pytest.mark.parametrize("law", [1.0, 2.0, 3.0])
def test_errors_of_a_needle_that_a_cam_turns_back_without_dwell_are_those_of_its_lowest_place(law):
    """Its slope goes with the square of the angle there: its rounding hid 1e-9 rad, its errors 1e-12."""
    machine, design, leaves, gauge = lowest_by_cam(0.0, law)
    got = sweep.summarise(machine, design, ["a_gauge", "phi_a", "a_lag"], accuracy=1e-12).iloc[0]
    assert abs(got["a_gauge"] - gauge) <= got["err_a_gauge"] <= 1e-4
    assert abs(got["a_lag"] - (got["phi_a"] - leaves)) <= got["err_a_lag"] <= 1e-5 and got["err_phi_a"] < 1e-10


def test_a_dip_beside_the_end_that_no_sample_shows_is_the_least():
    """The slider is 0.7 rad earlier in its turn at each sample: samples only fall, and between them it was folded."""
    mechanism = family("slider_crank")
    poses = Poses(mechanism, mechanism.precise(), design_matrix(mechanism, {"a": 20.0, "b": 70.0, "e": 0.0})[0])
    start, end = np.array([5.9]), np.array([5.9 + 3.0 * (2.0 * math.pi - 0.7)])
    place = poses.least(np.zeros(1, np.intp), start, end, "s", samples=4)
    # Heights near the place differ by their rounding within a root of it.
    assert abs(place[0] - 7.0 * math.pi) < 1e-7


def dense(machine, design, needle):
    """Read all crossings off a dense turn, in numpy alone: roots of straight pieces, side and rise between samples."""
    names = [f"a_{x}" for x in ("across", "side", "height", "depth")]
    found = sweep.evaluate(machine, design, names, phi=TURN)
    x, y, z, g = (found[name].to_numpy() for name in names)
    k = np.flatnonzero(x * np.roll(x, -1) < 0.0)
    share = x[k] / (x[k] - np.roll(x, -1)[k])
    y, z, h = (v[k] + share * (np.roll(v, -1)[k] - v[k]) for v in (y, z, g))
    beside = (z > 0.0) & (z < needle["point"])
    return TURN[k] + share * TURN[1], np.sign(np.roll(x, -1)[k] - x[k]), beside, y, z, g.max() - h


def test_passages_of_random_machines_are_those_of_a_dense_turn():
    rng, taken, seen = np.random.default_rng(31), 0, set()
    rows = rows_of("moment_A", "passage")
    for trial in range(60):
        given = json.loads(json.dumps(rows[trial % len(rows)]["inputs"]))
        given["looper"]["at"] = [x + rng.normal(0.0, 6.0) for x in given["looper"]["at"]]
        given["looper"]["offset"] += rng.normal(0.0, 0.3)
        sense = int(rng.choice([-1, 1]))
        machine, design = machine_of(given, a={"take": ["thin", "blade"], "sense": sense})
        names = ["phi_a", "count_a", "a_clearance", "a_rise", "a_above_eye", "a_back_side"]
        found = sweep.summarise(machine, design, names, accuracy=1e-9).iloc[0]
        phi, sign, beside, side, height, rise = dense(machine, design, given["needle"])
        right = np.flatnonzero(beside & (sign == sense))
        assert found["count_a"] == right.size
        seen.add(int(found["status"]))
        if right.size == 1:
            taken, k = taken + 1, right[0]
            assert found["phi_a"] == pytest.approx(phi[k], abs=2e-5)
            assert found["a_clearance"] == pytest.approx(side[k] - 0.5 * given["needle"]["diameter"], abs=2e-3)
            assert found["a_rise"] == pytest.approx(rise[k], abs=2e-3)
            assert found["a_above_eye"] == pytest.approx(given["needle"]["eye"] - height[k], abs=2e-3)
            assert found["a_back_side"] == pytest.approx(side[(k + 1) % phi.size], abs=2e-2)
            assert (found["status"] == st.WRONG_SIDE) == (side[k] < 0.0)
        elif right.size == 0:
            assert found["status"] == (st.WRONG_WAY if (beside & (sign == -sense)).any() else st.NEVER)
        else:
            assert found["status"] == st.TWICE
    assert taken > 12 and {st.OK, st.WRONG_SIDE, st.NEVER, st.WRONG_WAY} <= seen


def test_scarf_along_the_needle_has_no_frame():
    given = json.loads(json.dumps(rows_of("moment_A", "passage")[0]["inputs"]))
    machine, design = machine_of(given, a={"take": ["thin", "blade"]})
    frame = machine.members[0].frame(np.array([[design.get(p.name, p.default) for p in machine.parameters]], float))
    lam = design["needle.lam2"]
    given["needle"]["scarf"] = (frame.rotation[0] @ [math.cos(lam), math.sin(lam), 0.0]).tolist()
    machine, design = machine_of(given, a={"take": ["thin", "blade"]})
    assert sweep.summarise(machine, design, ["a_clearance"], accuracy=1e-9)["status"][0] == st.NO_FRAME


def test_gap_of_links_is_the_least_of_dense_samples():
    row = rows_of("capsule_turn")[0]
    machine, design = machine_of(row["inputs"], free={"gap": ["needle.rocker1", "looper.coupler"], "radii": [1.0, 2.0]})
    found = sweep.summarise(machine, design, ["min_free", "max_free"], accuracy=1e-8).iloc[0]
    where = sweep.joints(machine, design, TURN[::4])

    def path(member, stage, joint):
        rows = where[(where["member"] == member) & (where["stage"] == stage) & (where["joint"] == joint)]
        return rows[["x", "y", "z"]].to_numpy()

    p, q = path("needle", "1", "d")[:, None, None], path("needle", "1", "c")[:, None, None]
    a, b = path("looper", "", "b")[:, None, None], path("looper", "", "c")[:, None, None]
    s, t = np.linspace(0.0, 1.0, 41)[None, :, None, None], np.linspace(0.0, 1.0, 41)[None, None, :, None]
    grid = np.linalg.norm(p + s * (q - p) - a - t * (b - a), axis=3).min(axis=(1, 2)) - 3.0
    assert found["min_free"] <= grid.min() + 1e-9 and found["min_free"] == pytest.approx(grid.min(), abs=0.3)
    assert found["max_free"] == pytest.approx(grid.max(), abs=0.3)


@pytest.mark.parametrize("apart", [1e-6, 1e-10])
def test_room_of_a_passage_that_nearly_touches_is_known_no_better_than_the_rise_there(apart):
    """Its error was the target of the lengths, 6e-13, where that of the rise is 5e-8."""
    shift = hand_made.found(hand_made.machine_of(), ["a_reach"])["a_reach"] - apart
    at, long = hand_made.AT, {"top": -100.0, "scarf_end": -50.0, "eye": 100.0, "point": 200.0}
    tools = {
        "seam": {"at": [-30.0, 5.0, 5.0]},
        "blade": hand_made.BLADE | {"eye": [25.0, 2.0, 0.0], "hold": [20.0, -5.0, 3.0]},
    }
    relations = {"a": {"take": ["thin", "blade"], "fields": {"slow": (0.0, 50.0), "fast": (0.0, 50.0)}}}
    relations |= {"b": {"enter": ["thin", "blade", "seam"]}, "sews": {"sew": ["a", "b"], "speeds": [100.0, 200.0]}}
    machine = hand_made.machine_of(relations, at=(at[0], at[1] + shift, at[2]), needle=long, tools=tools)
    names = [output.name for output in machine.relations[-1].numbers]
    got = sweep.summarise(machine, hand_made.DESIGN, ["a_rise", *names], accuracy=1e-14).iloc[0]
    assert all(got[f"err_{name}"] >= got["err_a_rise"] > 1e-12 for name in names)


@pytest.mark.parametrize("speeds", [100.0, "100 rpm", True, None])
def test_speeds_of_a_sew_that_are_no_list_are_refused_by_name(speeds):
    """A single number ended in a TypeError that named neither relation nor key."""
    relations = {"a": {"take": ["thin", "blade"], "fields": {"slow": (0.0, 50.0)}}}
    with pytest.raises(InputError, match=r"relations\.sews: speeds = .*, growing, at least two"):
        hand_made.machine_of(relations | {"sews": {"sew": ["a"], "speeds": speeds}})
