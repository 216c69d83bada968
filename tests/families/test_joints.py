"""Joint coordinates: link lengths, places of members, agreement with the pose outputs, for every family."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

import sweep
from sweep.evaluation.joints import parts
from sweep.exchange.scene import over
from sweep.families import NAMES, family
from sweep.families.base import March
from sweep.families.capabilities import Skeleton

DRAWN = NAMES
PHI = np.linspace(0.0, 2.0 * math.pi, 24, endpoint=False)
ROUNDING = 1e-12  # a few roundings of coordinates of size 10

# Links whose joints keep their distance; of the rest one joint slides along the link.
SLIDING = {
    ("swivel", "rod"), ("geared_dwell", "slotted link"), ("epicyclic_dwell", "slotted link"),
    ("slotted", "driven link"), ("inverted_slider_crank", "rocker"), ("guided_cam", "cam"),
    ("heddle", "heddle rod"),  # a long one: its upper end has no place
}  # fmt: skip
BACKRESTS = ("backrest", "backrest_tension", "backrest_closure")
# Threads, warps and springs change their lengths, and so do the bracket and the beam between the joints named.
SOFT = ("thread", "warp", "spring", "bracket", "beam", "back-rest")
GENERAL_HEDDLE = {"O3D": 80.0, "O4F": 70.0, "O3O4": 200.0, "DF": math.hypot(200.0, 10.0), "EG": 300.0, "x_s": 130.0}


def example(name):
    return dict(family(name).example)


def whole(name, design=None):
    """The only part of a family over its whole domain."""
    (part,) = over(name, design or example(name), 0.0, 24)
    return part


def distance(part, first, second):
    return np.linalg.norm(part.joints[second] - part.joints[first], axis=1)


@pytest.mark.parametrize(
    ("name", "crank", "pin"),
    [
        ("rssr", "a", "x_b"), ("rssp", "a", "x_b"), ("guide", "a", "x_b"), ("five_link", "a", "x_b"),
        ("slotted", "a", "x_b"), ("slotted", "a", "x_c"), ("swivel", "a", "x_b"), ("inverted_slider_crank", "a", "x_b"),
        ("spherical_looper", "a1", "x_b1"), ("spherical_looper", "a2", "x_b2"), ("cylindrical_looper", "a1", "x_b1"),
    ],
)  # fmt: skip
def test_pin_of_a_short_crank_keeps_its_digits(name, crank, pin):
    # Its place from the shaft is proportional to the crank; a power of two changes no bit of a product.
    design, phi = example(name), np.linspace(0.1, 6.0, 7)
    short = sweep.evaluate(name, design | {crank: design[crank] * 2.0**-16}, [pin], phi=phi)
    whole_length = sweep.evaluate(name, design, [pin], phi=phi)
    np.testing.assert_allclose(short[pin] * 2.0**16, whole_length[pin], rtol=16 * 2.0**-53)


@pytest.mark.parametrize("name", DRAWN)
def test_links_keep_their_lengths_over_the_turn(name):
    part = whole(name)
    assert (part.status == 0).all()
    size = max(1.0, *(np.abs(path).max() for path in part.joints.values()))
    for link in part.links:
        if (name, link.name) in SLIDING or link.name.startswith(SOFT):
            continue
        for first, second in zip(link.joints, link.joints[1:], strict=False):
            assert np.ptp(distance(part, first, second)) < ROUNDING * size, (link.name, first, second)


@pytest.mark.parametrize("name", ["eyelet", "guided_cam", "free_cam", "free_cam_friction"])
def test_thread_between_the_guides_is_as_long_as_the_take_up_says(name):
    part = whole(name)
    steps = 2.0 * math.pi / 24 * np.arange(24)
    length = sweep.evaluate(name, example(name), ["L"], phi=steps)["L"].to_numpy()
    knot = next(link.joints[1] for link in part.links if link.name == "thread 1")
    found = distance(part, "n1", knot)[:-1] + distance(part, knot, "n2")[:-1]
    np.testing.assert_allclose(found, length, rtol=1e-14)


def test_follower_of_the_thread_cam_comes_as_near_as_the_radius():
    # Between 24 poses the least distance is off by the square of half a step times the lift.
    assert distance(whole("guided_cam"), "a", "r").min() == pytest.approx(30.0, abs=0.2)


def test_thread_without_friction_passes_the_cam_where_the_march_has_it():
    smooth = example("free_cam_friction") | {"mu": 0.0, "tension_ratio": 1.0}
    first, second = whole("free_cam"), whole("free_cam_friction", smooth)
    apart = np.linalg.norm(second.joints["contact"] - first.joints["contact"], axis=1)
    # A thread that marches stays in a minimum that is not the shortest any more, for as long as there is one.
    assert (apart < 1e-9).sum() >= 22


@pytest.mark.parametrize("name", BACKRESTS)
def test_warp_touches_beam_and_back_rest_and_is_as_long_as_the_outputs(name):
    design, part = example(name), whole(name)
    poses = sweep.evaluate(name, design, ["L1", "L2", "spring_length", "R1"], phi=part.phi)
    for joints, length in (
        (("t1", "t2"), poses["L1"]), (("t3", "w"), poses["L2"]), (("m", "q"), poses["spring_length"]),
        (("o2", "s"), poses["R1"]), (("o", "t1"), part.phi), (("axis", "t2"), design["r"]),
        (("axis", "t3"), design["r"]),
        (("axis", "p"), design["r0"]), (("axis", "s"), design["H"]), (("o2", "m"), design["lM"]),
    ):  # fmt: skip
        np.testing.assert_allclose(distance(part, *joints), np.asarray(length, float), atol=1e-13, err_msg=str(joints))
    for at, first, second in (("t1", "o", "t2"), ("t2", "axis", "t1"), ("t3", "axis", "w")):
        along, across = part.joints[second] - part.joints[at], part.joints[first] - part.joints[at]
        assert np.abs((along * across).sum(axis=1)).max() < 1e-14


@pytest.mark.parametrize("side", [1.0, -1.0])
def test_heddle_drive_with_a_second_four_bar_and_a_rod_keeps_all_lengths(side):
    design = example("heddle") | GENERAL_HEDDLE | {"side_F": side}
    part = whole("heddle", design)
    for joints, length in ((("d", "f"), "DF"), (("e", "g"), "EG"), (("o3", "d"), "O3D"), (("o4", "f"), "O4F")):
        np.testing.assert_allclose(distance(part, *joints), design[length], rtol=1e-13)
    assert np.ptp(distance(part, "c", "d")) < 1e-11
    assert np.ptp(distance(part, "f", "e")) < 1e-11
    assert np.ptp(part.joints["g"][:, 0]) == 0.0  # on its vertical


def test_three_leads_hold_the_rack():
    design, part = example("feed_triad"), whole("feed_triad")
    for joints, length in ((("h", "f1"), "q1"), (("e2", "f2"), "q2"), (("e3", "f3"), "q3")):
        np.testing.assert_allclose(distance(part, *joints), design[length], rtol=1e-13)


def test_foot_rests_on_the_tooth_until_it_jumps():
    part = whole("feed_foot")
    gap = part.joints["p"][:, 1] - np.maximum(part.joints["t"][:, 1], example("feed_foot")["y_plate"])
    assert gap.min() > -1e-12
    assert (np.abs(gap) < 1e-12).any()


@pytest.mark.parametrize("name", DRAWN)
def test_cranks_turn_right_handed_about_their_axes(name):
    march = isinstance(family(name).domain, March)
    steps = 0.1 if not march else math.pi / 24
    (part,) = parts(name, example(name), steps * np.arange(48 if march else 2))
    for link in part.links:
        pivot, end = link.joints[0], link.joints[-1]
        if not link.name.startswith(("crank", "carrier")) or (name == "spherical_looper" and link.name == "carrier"):
            continue
        before, after = (part.joints[end] - part.joints[pivot])[:2]
        axis = part.axes[pivot]
        assert abs(before @ axis) < ROUNDING  # the crank circle is square to the axis, about the joint named
        turned = math.atan2(np.cross(before, after) @ axis, before @ after)
        assert turned == pytest.approx(steps, abs=1e-12)


@pytest.mark.parametrize("name", [n for n in DRAWN if family(n).pose_output[family(n).position].wraps])
def test_output_angle_turns_right_handed_about_the_axis_of_the_output_link(name):
    mechanism = family(name)
    design = example(name) | ({"s": 0.0} if name == "slotted" else {})  # an offset slot points elsewhere than its ball
    (part,) = parts(name, design, [0.2, 0.3])
    psi = sweep.evaluate(name, design, mechanism.position, phi=[0.2, 0.3])[mechanism.position].to_numpy()
    pivot = "d1" if name == "spherical_looper" else "q1" if name == "cylindrical_looper" else "d"
    link = next(link for link in part.links if link.joints[0] == pivot)
    end = link.joints[1]
    axis = part.axes["d1" if "looper" in name else "d"]
    before, after = part.joints[end] - part.joints[pivot]
    before, after = before - (before @ axis) * axis, after - (after @ axis) * axis
    turned = math.atan2(np.cross(before, after) @ axis, before @ after)
    assert turned == pytest.approx(psi[1] - psi[0], abs=1e-11)


@pytest.mark.parametrize("name", DRAWN)
def test_every_family_has_a_skeleton_and_every_linked_joint_has_coordinates(name):
    found = sweep.joints(name, example(name), [0.0 if isinstance(family(name).domain, March) else 0.3])
    skeleton = family(name).find(Skeleton)
    assert skeleton is not None
    linked = {joint for link in skeleton.links for joint in link.joints}
    assert set(found["joint"]) == linked | set(skeleton.fixed)
    assert set(found.loc[found["kind"] == "fixed", "joint"]) == set(skeleton.fixed)
    assert found[["x", "y", "z"]].notna().all(axis=None)
    assert found.attrs["units"]["x"] == "length"


def test_rows_of_a_joint_are_the_pose_outputs():
    design = example("rssr")
    poses = sweep.evaluate("rssr", design, ["x_c", "y_c", "z_c"], phi=PHI)
    found = sweep.joints("rssr", design, PHI)
    c = found[found["joint"] == "c"]
    np.testing.assert_array_equal(c[["x", "y", "z"]].to_numpy(), poses[["x_c", "y_c", "z_c"]].to_numpy())
    np.testing.assert_array_equal(c["phi"], PHI)


def test_stages_of_a_chain_stand_in_the_frame_of_the_first_and_are_driven_in_series():
    first, second = example("rssr"), example("guide")
    design = {f"{k}1": v for k, v in first.items()} | {f"{k}2": v for k, v in second.items()}
    design |= {"kappa2": -1.0, "offset2": 0.7, "shift2": 2.5, "turn2": 0.0}
    found = sweep.joints(["rssr", "guide"], design, PHI)
    assert set(found["frame"]) == {"stage 1 (rssr)"}
    psi = sweep.evaluate("rssr", first, "psi", phi=PHI)["psi"].to_numpy()
    alone = sweep.joints("guide", second, 0.7 - psi)
    for joint in ("b", "c", "point"):
        chained = found[(found["stage"] == "2") & (found["joint"] == joint)]
        own = alone.loc[alone["joint"] == joint, ["x", "y", "z"]].to_numpy()
        turned = own * [1.0, -1.0, -1.0] + [first["e"], 0.0, 2.5]  # half a turn about x, on the rocker axis
        np.testing.assert_allclose(chained[["x", "y", "z"]], turned, atol=1e-13)


def test_members_of_a_machine_stand_in_its_frame():
    place = {"at": [1.0, 30.0, 12.0], "axis": [0.0, 1.0, 1.0], "zero": [1.0, 0.0, 0.0]}
    machine = sweep.machine(
        {
            "needle": ["rssr", "guide"],
            "looper": {"family": "rssr", "ratio": -2, "offset": 0.4, "tip": [2.0, 0.5, 0.1], "place": place},
            "feed": {"family": "four_bar", "driver": "needle.psi1", "ratio": 1},
        }
    )
    design = {f"needle.{k}1": v for k, v in example("rssr").items()}
    design |= {f"needle.{k}2": v for k, v in example("guide").items()}
    design |= {f"looper.{k}": v for k, v in example("rssr").items()}
    design |= {f"feed.{k}": v for k, v in example("four_bar").items()}
    found = sweep.joints(machine, design, PHI)
    assert set(found["frame"]) == {"machine"}
    for member, joint in (("needle", "point"), ("looper", "tip"), ("looper", "c"), ("feed", "m")):
        names = [f"{member}.{joint}_{axis}" for axis in "xyz"]
        poses = sweep.evaluate(machine, design, names, phi=PHI)
        rows = found[(found["member"] == member) & (found["joint"] == joint) & (found["stage"] != "1")]
        np.testing.assert_allclose(rows[["x", "y", "z"]].to_numpy(), poses[names].to_numpy(), atol=1e-13)
    d = found[(found["member"] == "looper") & (found["joint"] == "d")].iloc[0]
    r = example("rssr")
    half = math.sqrt(0.5)  # z of the member is (0, 1, 1)/sqrt(2), x is x
    np.testing.assert_allclose([d.x, d.y, d.z], [1.0 + r["e"], 30.0 + half * r["g"], 12.0 + half * r["g"]], atol=1e-14)


def test_pose_that_does_not_exist_has_its_status_and_no_coordinates():
    found = sweep.joints("four_bar", {"a": 3.0, "b": 1.0, "c": 1.0, "e": 4.5}, [math.pi])
    c = found[found["joint"] == "c"].iloc[0]
    assert math.isnan(c.x) and c.status != 0
    assert (found.loc[found["kind"] == "fixed", "status"] == 0).all()


def test_several_designs_and_bad_angles_are_refused():
    design = example("four_bar")
    with pytest.raises(sweep.InputError, match="one design"):
        sweep.joints("four_bar", design | {"a": [1.0, 1.1]}, 0.0)
    with pytest.raises(sweep.InputError, match="a finite number"):
        sweep.joints("four_bar", design, [math.nan])


def test_points_without_links_are_given_and_a_mechanism_without_joints_is_refused():
    found = sweep.joints(replace(family("heddle"), capabilities=()), example("heddle"), [0.3])
    assert set(found["joint"]) == {"b", "c"}
    assert found["x"].notna().all()
    with pytest.raises(sweep.InputError, match="that has joints"):
        sweep.joints(replace(family("heddle"), capabilities=(), points={}), example("heddle"), [0.0])


def test_march_has_joints_in_equal_steps_of_one_turn_only():
    with pytest.raises(sweep.InputError, match="equal steps of one turn from 0"):
        sweep.joints("foot", example("foot"), [0.3])
