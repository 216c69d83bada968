"""Machines: members keep their own numbers, points and relations are those of one frame, gradients are exact.

What a member says inside a machine is compared with what it says alone to the bit; distances with the norm of
coordinates placed by hand, to a few roundings of their size.
"""

from __future__ import annotations

import numpy as np
import pandas as pd
import pytest

import sweep
from kernels import status as st
from sweep.quantities.limits import meets
from sweep.quantities.measures import measure

NEEDLE = {
    "a1": 9.16, "b1": 18.31, "c1": 10.66, "e1": 13.4, "f1": -14.68, "g1": 0.0, "alpha1": 1.5, "branch1": 1.0,
    "a2": 2.4, "b2": 15.7, "c2": 3.6, "e2": 17.3, "xi2": -71.5, "eta2": 91.5, "lam2": 0.95, "h2": 114.0,
    "branch2": -1.0, "offset2": 1.8,
}  # fmt: skip
LOOPER = {"a": 10.0, "b": 40.0, "c": 25.0, "e": 35.0, "f": 5.0, "g": -3.0, "alpha": 1.05, "branch": 1.0}
TABLE = pd.DataFrame([{f"needle.{k}": v for k, v in NEEDLE.items()} | {f"looper.{k}": v for k, v in LOOPER.items()}])
PHI = np.linspace(0.0, 6.0, 13)


def two(**looper: object) -> object:
    member = {"family": "rssr", "tip": [30.0, 1.0, -2.0], "place": {"at": [-80.0, 60.0, 4.0], "axis": [0.6, 0.8, 0.0],
              "zero": [0.0, 0.0, 1.0]}} | looper  # fmt: skip
    relations = {
        "clearance": {"distance": ["needle.point", "looper.tip"]},
        "lag": {"timing": ["needle.phi_min_s", "phi_min_clearance"]},
    }
    return sweep.machine({"needle": ["rssr", "guide"], "looper": member}, relations)


def test_members_say_the_same_as_alone_to_the_bit() -> None:
    found = sweep.summarise(
        two(), TABLE, ["needle.max_abs_d2s", "looper.max_abs_d2psi", "looper.swing", "needle.margin"]
    )
    alone = sweep.summarise(["rssr", "guide"], pd.DataFrame([NEEDLE]), ["max_abs_d2s", "margin"])
    other = sweep.summarise("rssr", LOOPER, ["max_abs_d2psi", "swing"])
    assert found["status"][0] == 0
    assert found["needle.max_abs_d2s"][0] == alone["max_abs_d2s"][0]
    assert found["err_needle.max_abs_d2s"][0] == alone["err_max_abs_d2s"][0]
    assert found["needle.margin"][0] == alone["margin"][0]
    assert found["looper.max_abs_d2psi"][0] == other["max_abs_d2psi"][0]
    assert found["looper.swing"][0] == other["swing"][0]
    poses = sweep.evaluate(two(), TABLE, ["needle.s", "looper.d2psi"], phi=PHI)
    single = sweep.evaluate("rssr", LOOPER, ["d2psi"], phi=PHI)
    np.testing.assert_array_equal(poses["looper.d2psi"], single["d2psi"])


@pytest.mark.parametrize("ratio", [1, -3])
def test_margin_of_a_machine_is_that_of_its_weakest_member_whatever_its_gear(ratio: int) -> None:
    """A gear of whole turns takes a crank through all its angles; on a grid, too, what does not turn says so."""
    stuck = LOOPER | {"a": 26.0}
    table = pd.concat([TABLE, TABLE.assign(**{f"looper.{k}": x for k, x in stuck.items()})], ignore_index=True)
    found = sweep.summarise(two(ratio=ratio), table, ["margin"], accuracy=1e-8)
    alone = sweep.summarise("rssr", pd.DataFrame([LOOPER, stuck]), ["margin"], accuracy=1e-8)
    needle = sweep.summarise(["rssr", "guide"], pd.DataFrame([NEEDLE]), ["margin"], accuracy=1e-8)
    assert found["margin"][0] == min(alone["margin"][0], needle["margin"][0])
    assert found["margin"][1] == alone["margin"][1] < 0.0
    on_grid = sweep.summarise(two(ratio=ratio), table, ["max_clearance"], samples=64)
    assert on_grid["status"].tolist() == [0, st.NOT_ROTATABLE]


def test_a_table_of_members_serves_where_a_machine_does() -> None:
    members = {"needle": ["rssr", "guide"], "looper": "rssr"}
    found = sweep.evaluate(members, TABLE, ["needle.s", "looper.psi"], phi=[0.3])
    assert found["looper.psi"][0] == sweep.evaluate("rssr", LOOPER, ["psi"], phi=[0.3])["psi"][0]


def test_distance_is_that_of_points_placed_by_hand() -> None:
    found = sweep.evaluate(two(), TABLE, ["clearance", "looper.tip_x", "looper.tip_y", "looper.tip_z"], phi=PHI)
    psi = sweep.evaluate("rssr", LOOPER, ["psi"], phi=PHI)["psi"].to_numpy()
    needle = sweep.evaluate(["rssr", "guide"], pd.DataFrame([NEEDLE]), ["x_m", "y_m"], phi=PHI)
    radial, across = np.array([np.cos(psi), np.sin(psi), 0 * psi]), np.array([-np.sin(psi), np.cos(psi), 0 * psi])
    tip = np.array([[LOOPER["e"]], [0.0], [-2.0]]) + 30.0 * radial + 1.0 * across
    z, x = np.array([0.6, 0.8, 0.0]), np.array([0.0, 0.0, 1.0])
    placed = np.array([[-80.0], [60.0], [4.0]]) + np.column_stack([x, np.cross(z, x), z]) @ tip
    point = np.array([needle["x_m"], needle["y_m"], 0.0 * psi])
    scale = 200.0 * 2.0**-53  # lengths of some 100
    np.testing.assert_allclose(found[["looper.tip_x", "looper.tip_y", "looper.tip_z"]].T, placed, atol=16 * scale)
    np.testing.assert_allclose(found["clearance"], np.linalg.norm(point - placed, axis=0), atol=32 * scale)


def test_least_distance_and_timing_agree_with_a_dense_grid() -> None:
    found = sweep.summarise(
        two(), TABLE, ["min_clearance", "phi_min_clearance", "lag", "needle.phi_min_s"], accuracy=1e-8
    )
    phi = np.linspace(0.0, 2.0 * np.pi, 200001)
    grid = sweep.evaluate(two(), TABLE, ["clearance", "needle.s"], phi=phi)
    least, lowest = int(grid["clearance"].argmin()), int(grid["needle.s"].argmin())
    assert found["min_clearance"][0] == pytest.approx(grid["clearance"].iloc[least], rel=1e-7)
    assert found["phi_min_clearance"][0] == pytest.approx(phi[least], abs=1e-4)
    assert found["lag"][0] == pytest.approx(np.remainder(phi[least] - phi[lowest] + np.pi, 2 * np.pi) - np.pi, abs=2e-4)


def test_phase_turns_the_places_and_ratio_the_derivatives() -> None:
    shifted = sweep.summarise(two(offset=0.7), TABLE, ["looper.phi_ext", "looper.swing"])
    plain = sweep.summarise(two(), TABLE, ["looper.phi_ext", "looper.swing"])
    assert shifted["looper.swing"][0] == plain["looper.swing"][0]
    assert np.remainder(plain["looper.phi_ext"][0] - shifted["looper.phi_ext"][0], 2 * np.pi) == pytest.approx(
        0.7, abs=1e-14
    )
    double = sweep.evaluate(two(ratio=2), TABLE, ["looper.psi", "looper.dpsi", "looper.d2psi"], phi=[0.4])
    single = sweep.evaluate("rssr", LOOPER, ["psi", "dpsi", "d2psi"], phi=[0.8])
    assert double["looper.psi"][0] == pytest.approx(single["psi"][0], rel=1e-15)
    assert double["looper.dpsi"][0] == pytest.approx(2.0 * single["dpsi"][0], rel=1e-14)
    assert double["looper.d2psi"][0] == pytest.approx(4.0 * single["d2psi"][0], rel=1e-14)
    fast = sweep.summarise(two(ratio=2), TABLE, ["looper.max_abs_d2psi", "looper.swing"], accuracy=1e-8)
    slow = sweep.summarise("rssr", LOOPER, ["max_abs_d2psi", "swing"], accuracy=1e-8)
    assert fast["looper.max_abs_d2psi"][0] == pytest.approx(4.0 * slow["max_abs_d2psi"][0], rel=1e-8)
    assert fast["looper.swing"][0] == pytest.approx(slow["swing"][0], rel=1e-8)


@pytest.mark.parametrize("ratio", [2, -2, 3])
def test_strokes_of_a_geared_member_take_the_times_of_its_own_crank(ratio: int) -> None:
    """Wherever the turn begins; backwards the strokes change places. To ten times the errors, which are roundings."""
    names = ["phi0", "stroke_ratio"]
    alone = sweep.summarise("rssr", LOOPER, names, accuracy=1e-9).iloc[0]
    angle, times = (alone[name] for name in names)
    angle, times = (angle, times) if ratio > 0 else (2.0 * np.pi - angle, 1.0 / times)
    geared = sweep.machine({"looper": {"family": "rssr", "ratio": ratio}})
    behind = sweep.machine(
        {"first": {"family": "rssr", "ratio": ratio}, "looper": {"family": "rssr", "driver": "first.psi"}}
    )
    driven = []
    for offset in (0.0, 1.0, 3.0, 5.0):
        table = {f"{member}.{k}": x for member in ("first", "looper") for k, x in LOOPER.items()}
        found = sweep.summarise(behind, table | {"first.offset": offset}, ["looper.phi0"], accuracy=1e-9).iloc[0]
        driven.append(found["looper.phi0"])
        table = {f"looper.{k}": x for k, x in LOOPER.items()} | {"looper.offset": offset}
        found = sweep.summarise(geared, table, [f"looper.{name}" for name in names], accuracy=1e-9).iloc[0]
        for name, expected in zip(names, (angle / abs(ratio), times), strict=True):
            assert found["status"] == 0
            assert found[f"looper.{name}"] == pytest.approx(expected, abs=10.0 * found[f"err_looper.{name}"])
            assert found[f"err_looper.{name}"] < 1e-12
        ratio_of_times = measure(geared, "looper.stroke_ratio")  # what the optimiser takes for it
        assert ratio_of_times.from_inner(found["looper.phi0"]) == pytest.approx(times, rel=1e-12)
        assert ratio_of_times.to_inner(times) == pytest.approx(found["looper.phi0"], rel=1e-12)
    # What a geared member drives repeats as that one does; to the target of accuracy.
    np.testing.assert_allclose(driven, driven[0], rtol=1e-9)


@pytest.mark.parametrize("how", [{"accuracy": 1e-9}, {"samples": 1024}])
def test_means_of_geared_and_driven_members_and_of_points_are_those_of_their_poses(how: dict) -> None:
    members = {"looper": {"family": "rssr", "ratio": 2, "tip": [30.0, 1.0, -2.0]}}
    members |= {
        "behind": {"family": "rssr", "driver": "looper.psi"},
        "plain": {"family": "rssr", "tip": [3.0, 1.0, 2.0]},
    }
    machine = sweep.machine(members)
    table = {f"{member}.{k}": x for member in members for k, x in LOOPER.items()}
    turn = np.arange(4096) * (2.0 * np.pi / 4096)  # all curves are smooth: even samples know their means to rounding
    for pose in ("looper.d2psi", "looper.tip_x", "behind.dpsi", "plain.tip_y", "plain.dpsi"):
        member, _, own = pose.partition(".")
        name = f"{member}.rms_{own}"
        found = sweep.summarise(machine, table, [name], **how).iloc[0]
        values = sweep.evaluate(machine, table, [pose], phi=turn)[pose].to_numpy()
        assert found["status"] == 0 and found[name] == pytest.approx(np.sqrt(np.mean(values**2)), rel=1e-8), pose


def test_a_member_driven_by_another_is_the_chain_of_both() -> None:
    members = {"first": "rssr", "second": {"family": "guide", "driver": "first.psi", "offset": 1.8}}
    names = ["a1", "b1", "c1", "e1", "f1", "g1", "alpha1", "branch1"]
    table = {f"first.{n[:-1]}": NEEDLE[n] for n in names}
    table |= {f"second.{n}": NEEDLE[f"{n}2"] for n in ("a", "b", "c", "e", "xi", "eta", "lam", "h", "branch")}
    found = sweep.evaluate(
        sweep.machine(members), table, ["second.s", "second.ds", "second.d2s", "second.d3s"], phi=PHI
    )
    alone = sweep.evaluate(["rssr", "guide"], pd.DataFrame([NEEDLE]), ["s", "ds", "d2s", "d3s"], phi=PHI)
    for name in ("s", "ds", "d2s", "d3s"):
        # The chain hands on cosine and sine in twice the working precision, the machine the angle.
        size = alone[name].abs().max()
        np.testing.assert_allclose(found[f"second.{name}"], alone[name], rtol=0.0, atol=1e-12 * size)


@pytest.mark.parametrize("want", [["arm.dpsi", "arm.d3psi"], ["speed"]])
def test_designs_that_share_what_drives_a_member_say_the_same_as_alone(want: list[str]) -> None:
    drive = sweep.machine(
        {"looper": "rssr", "arm": {"family": "four_bar", "driver": "looper.psi"}}, {"speed": {"speed": ["arm.m"]}}
    )
    arm = {"a": 1.0, "b": 3.3, "c": 3.1, "e": 3.0, "xi": 4.2, "eta": 0.8}
    design = {f"looper.{k}": v for k, v in LOOPER.items()} | {f"arm.{k}": v for k, v in arm.items()}
    table = pd.DataFrame([design, design | {"arm.b": 3.5}])
    both = sweep.evaluate(drive, table, want, phi=PHI)
    alone = [sweep.evaluate(drive, table.iloc[[k]], want, phi=PHI) for k in range(2)]
    np.testing.assert_array_equal(both[want], pd.concat(alone)[want])


def test_gradients_of_relations_are_those_of_differences() -> None:
    from sweep.optimise.manufacture.tolerance import sensitivities

    machine = two()
    names = list(machine.parameter_names)
    design = np.array([TABLE.iloc[0].get(n, p.default) for n, p in zip(names, machine.parameters, strict=True)], float)
    rows = pd.DataFrame(sensitivities(machine, design, ["min_clearance", "lag"]))
    for name in ("looper.x_at", "looper.a", "needle.b2", "looper.x_tip", "looper.offset"):
        step = 1e-3
        ends = []
        for sign in (1.0, -1.0):
            moved = design.copy()
            moved[names.index(name)] += sign * step
            ends.append(
                sweep.summarise(machine, dict(zip(names, moved, strict=True)), ["min_clearance", "lag"], accuracy=1e-12)
            )
        for output in ("min_clearance", "lag"):
            slope = (ends[0][output][0] - ends[1][output][0]) / (2 * step)
            own = rows[(rows["parameter"] == name) & (rows["output"] == output)]["growing"].iloc[0]
            # Central differences: the square of the step, and the errors of the places, some 1e-10, over the step.
            assert own == pytest.approx(slope, rel=1e-4, abs=1e-6), (name, output)


def test_torque_on_the_shaft_is_the_sum_of_the_members() -> None:
    members = {"left": "rssr", "right": {"family": "rssr", "offset": 2.0}}
    machine = sweep.machine(members, {"shaft": {"torque": ["left", "right"]}})
    bodies = {"m_crank": 2e-4, "m_coupler": 1e-4, "m_rocker": 3e-4, "j_rocker_zz": 0.3, "speed": 500.0}
    table = {f"{m}.{k}": v for m in members for k, v in (LOOPER | bodies).items()}
    found = sweep.evaluate(machine, table, ["shaft", "left.drive_torque", "right.drive_torque"], phi=PHI)
    assert (found["status"] == 0).all()
    np.testing.assert_allclose(found["shaft"], found["left.drive_torque"] + found["right.drive_torque"], rtol=1e-15)
    alone = sweep.evaluate("rssr", LOOPER | bodies, ["drive_torque"], phi=PHI + 2.0)
    np.testing.assert_allclose(found["right.drive_torque"], alone["drive_torque"], rtol=1e-9, atol=1e-9)


@pytest.mark.parametrize(
    ("members", "relations", "word"),
    [
        ({}, None, "at least one member"),
        ({"a.b": "rssr"}, None, "plain word"),
        ({"x": 3}, None, "a family, a list"),
        ({"x": "rssr", "y": {"family": "rssr", "ratio": 0.5}}, None, "whole number"),
        ({"x": {"family": "rssr", "tipp": 1}}, None, "did you mean 'tip'"),
        ({"x": {"family": "rssr", "driver": "y.psi"}}, None, "stands before"),
        ({"x": "five_link", "y": {"family": "rssr", "driver": "x.theta"}}, None, "three derivatives"),
        ({"x": "feed", "y": {"family": "rssr", "driver": "x.chi"}}, None, "three derivatives"),
        ({"x": {"family": "rssp", "tip": [1, 2, 3]}}, None, "output link turns"),
        ({"x": "rssr"}, {"d": {"distance": ["x.b", "x.q"]}}, "did you mean"),
        ({"x": "rssr"}, {"d": {"away": ["x.b", "x.c"]}}, "one of distance"),
        ({"x": {"family": "rssr", "place": {"axis": [0, 0, 1], "zero": [0, 0, 2]}}}, None, "not along axis"),
    ],
)
def test_what_makes_no_machine_is_refused_with_the_remedy(members: dict, relations: dict, word: str) -> None:
    with pytest.raises(sweep.InputError, match=word):
        sweep.machine(members, relations)


def test_a_misspelt_dotted_name_names_the_right_one() -> None:
    with pytest.raises(sweep.InputError, match="did you mean 'swing'"):
        sweep.summarise(two(), TABLE, ["looper.swong"])
    with pytest.raises(sweep.InputError, match=r"output = 'phi_max_looper.psi'; allowed: looper.phi_max_psi: a member"):
        sweep.summarise(two(), TABLE, ["phi_max_looper.psi"])
    with pytest.raises(sweep.InputError, match=r"looper\.a"):
        sweep.summarise(two(), TABLE.drop(columns="looper.a"), ["looper.swing"])


def test_accepted_machine_of_stitch208_has_its_figures_and_keeps_the_limits() -> None:
    """Clearance 0.05 to 0.1 mm, 35 to 40 degrees after the lowest point of the needle, at least 40 degrees of swing."""
    import json
    from pathlib import Path

    from sweep.study import load_study

    folder = Path(__file__).parents[1] / "studies" / "earlier" / "stitch208"
    study, accepted = load_study(folder), json.loads((folder / "expected.json").read_text())["optimum"]
    found = sweep.summarise(study.family, accepted["design"], list(accepted["outputs"]), accuracy=1e-10)
    assert found["status"][0] == 0
    for name, value in accepted["outputs"].items():
        # Places and distances of the accepted dimensions, to the accuracy of the study.
        assert found[name][0] == pytest.approx(value, rel=1e-7), name
    for limit in study.output_limits:
        if limit.output in found:
            slack = 1e-8  # the optimiser keeps limits to 1e-9 of their size
            value = found[limit.output].to_numpy() * np.array([1.0 - slack, 1.0 + slack])
            assert meets(limit, value).any(), limit.output


def test_needle_of_stitch208_is_one_that_needle208_found_to_be_built() -> None:
    import json
    from pathlib import Path

    folders = (
        Path(__file__).parents[1] / "studies" / "earlier" / "stitch208",
        Path(__file__).parents[2] / "studies" / "needle208",
    )
    ours, theirs = (json.loads((folder / "expected.json").read_text()) for folder in folders)
    drive, best = theirs["earlier"]["design"], theirs["optimum"]["outputs"]["max_abs_d2s"]
    assert theirs["earlier"]["outputs"]["max_abs_d2s"] == pytest.approx(best, rel=1e-3)
    assert {name: ours["optimum"]["design"][f"needle.{name}"] for name in drive} == drive
