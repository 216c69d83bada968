"""Frames of stages and members on shafts against the 25-digit table, K = 16 roundings of each condition number."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from mpmath import mp, mpf

import sweep
from kernels.status import OK
from sweep.evaluation.joints import parts

ROWS = [
    row
    for row in json.loads((Path(__file__).parents[1] / "oracle" / "machine_open.json").read_text())["rows"]
    if row["kind"] == "stage_frames"
]
FACTOR = 16.0


def built(row):
    """Return the machine of a row and its design."""
    given, design = row["inputs"], {}
    member = {"chain": [stage["family"] for stage in given["stages"]]}
    shafts = None
    if "shaft" in given:
        shafts = {"main": {}, "other": given["shaft"]}
        member |= {"shaft": "other"} | {key: given[key] for key in ("sense", "shift", "turn", "key")}
    else:
        member["place"] = {key: given[key] for key in ("at", "axis", "zero")} | {"stage": 1}
    for n, stage in enumerate(given["stages"], start=1):
        design |= {f"x.{key}{n}": value for key, value in stage["p"].items()}
        design |= {f"x.{key}{n}": stage[key] for key in ("kappa", "offset", "shift", "turn") if key in stage}
    return sweep.machine({"x": member}, shafts=shafts), design


def found(row):
    """Return what the table has, from joints, frames and pose outputs."""
    machine, design = built(row)
    phi, values = row["inputs"]["phi"], {}
    for part in parts(machine, design, phi):
        n, axis = part.stage, part.axes["a"]
        values |= {f"{name.upper()}{n}": part.joints[name][0] for name in "abcd" if name in part.joints}
        values |= {f"crank_axis{n}": axis, f"phi{n}": part.crank[0]}
        assert part.frame == "machine" and (part.status == OK).all()
        if "point" in part.joints:
            values |= {f"point{n}": part.joints["point"][0], f"line{n}": part.axes["line"]}
        if part.family.position == "psi":
            values[f"sin_psi{n}"], values[f"cos_psi{n}"] = np.sin(part.position[0]), np.cos(part.position[0])
    member, matrix = machine.members[0], np.array([[design.get(p.name, p.default) for p in machine.parameters]], float)
    for n, frame in enumerate(member.frames(matrix), start=1):
        rotation = frame.rotation[0]
        values |= {f"origin{n}": frame.at[0], f"x_axis{n}": rotation[:, 0], f"z_axis{n}": rotation[:, 2]}
    last = len(row["inputs"]["stages"])
    for name in {"s", "dev"} & set(member.family.pose_names):
        values[f"{name}{last}"] = sweep.evaluate(machine, design, f"x.{name}", phi=[phi])[f"x.{name}"][0]
    return values


def factor(row, name, value):
    expected = np.atleast_1d(row["expected"][name])
    with mp.workdps(40):
        size = max(mpf(row["cond"][name]), *(abs(mpf(x)) for x in expected))
        error = max(abs(mpf(float(a)) - mpf(b)) for a, b in zip(np.atleast_1d(value), expected, strict=True))
        if name == "phi1":
            error = abs(error - 2 * mp.pi * mp.nint(error / (2 * mp.pi)))
        return float(error / (mpf(2) ** -53 * size))


@pytest.mark.parametrize("case", sorted({row["case"] for row in ROWS}))
def test_all_points_and_axes_of_all_stages_are_those_of_the_table(case):
    worst = {}
    for row in (row for row in ROWS if row["case"] == case):
        values = found(row)
        judged = set(values) & set(row["expected"])
        assert set(row["expected"]) - judged <= {f"{x}_psi{k}" for x in ("sin", "cos") for k in (1, 2, 3)}
        for name in judged:
            worst[name[:-1]] = max(worst.get(name[:-1], 0.0), factor(row, name, values[name]))
    assert all(value < FACTOR for value in worst.values()), worst


def test_place_of_the_last_stage_and_of_the_first_are_one_placement():
    row = next(row for row in ROWS if row["case"] == "rssr -> rssr -> guide")
    machine, design = built(row)
    matrix = np.array([[design.get(p.name, p.default) for p in machine.parameters]], float)
    first, last = (machine.members[0].frames(matrix)[k] for k in (0, -1))
    place = {
        "at": last.at[0].tolist(),
        "axis": last.rotation[0, :, 2].tolist(),
        "zero": last.rotation[0, :, 0].tolist(),
    }
    chain = [stage["family"] for stage in row["inputs"]["stages"]]
    again = sweep.machine({"x": {"chain": chain, "place": place}})
    moved = np.array([[design.get(p.name, p.default) for p in again.parameters]], float)
    back = again.members[0].frames(moved)[0]
    np.testing.assert_allclose(back.at, first.at, atol=1e-13)
    np.testing.assert_allclose(back.rotation, first.rotation, atol=1e-14)


def test_every_chain_of_the_register_stands_in_one_frame_and_its_cranks_turn_on_the_axes_before():
    for name in ("rssr", "four_bar", "inverted_slider_crank", "slotted", "five_link", "geared_dwell", "cam_lever"):
        for driven in (
            "rssr", "rssp", "guide", "slotted", "geared_dwell", "cam", "spherical_looper", "cylindrical_looper"
        ):  # fmt: skip
            chain, design = [name, driven], {"kappa2": -1.0, "offset2": 0.3, "shift2": 2.0, "turn2": 0.7}
            for n, one in enumerate(chain, start=1):
                design |= {f"{key}{n}": value for key, value in sweep.families.family(one).example.items()}
            before, after = parts(chain, design, [0.2])
            axis = next(axis for joint, axis in before.axes.items() if joint == "d")
            crank = "a1" if driven.endswith("looper") else "a"
            np.testing.assert_allclose(after.axes[crank], -axis, atol=1e-14, err_msg=str(chain))
            apart = after.joints[crank][0] - before.joints["d"][0]
            assert np.linalg.norm(np.cross(apart, axis)) < 1e-13, chain


@pytest.mark.parametrize(
    ("member", "shafts", "message"),
    [
        ({"shaft": "main", "place": {"at": [0.0, 0.0, 1.0]}}, {"main": {}}, "nothing beside shaft"),
        ({"shaft": "main", "ratio": 2}, {"main": {}}, "nothing beside shaft"),
        ({"shaft": "other"}, {"main": {}}, "one of main"),
        ({"shaft": "main", "sense": 0}, {"main": {}}, "1 or -1"),
        ({"key": 0.3}, {}, "names its shaft"),
        ({}, {"main": {}}, "the shaft that drives it: main"),
        ({"shaft": "x"}, {"x": {}}, "named main"),
        ({"shaft": "main"}, {"main": {"ratio": 2}}, "at, axis, zero"),
        ({"shaft": "main"}, {"main": {}, "x": {"ratio": 0.5}}, "whole number but 0"),
    ],
)
def test_what_contradicts_a_shaft_is_refused(member, shafts, message):
    with pytest.raises(sweep.InputError, match=message):
        sweep.machine({"x": {"family": "rssr"} | member}, shafts=shafts)


def test_members_on_shafts_are_limited_and_differentiated_like_placed_ones():
    shafts = {"main": {"axis": [0.0, 1.0, 0.0]}, "second": {"at": [0.0, 9.0, 0.0], "ratio": -2, "phase": 0.4}}
    on = {
        "family": "rssr",
        "shaft": "second",
        "sense": -1,
        "shift": 1.5,
        "turn": 0.8,
        "key": 0.3,
        "tip": [3.0, 0.1, 0.2],
    }
    machine = sweep.machine({"x": {"family": "rssr", "shaft": "main"}, "y": on}, shafts=shafts)
    rssr = dict(sweep.families.family("rssr").example)
    design = {f"{m}.{key}": value for m in "xy" for key, value in rssr.items()}
    wanted = ["y.max_tip_x", "y.phi_max_tip_x", "y.swing", "x.swing"]
    found = sweep.summarise(machine, design, wanted, accuracy=1e-9)
    dense = sweep.evaluate(machine, design, ["y.tip_x", "y.psi"], phi=np.linspace(0.0, 2.0 * np.pi, 4001))
    assert found["y.max_tip_x"][0] == pytest.approx(dense["y.tip_x"].max(), rel=1e-6)
    alone = sweep.evaluate("rssr", rssr, ["psi"], phi=-(-2.0 * dense["phi"].to_numpy()[:5] + 0.4 + 0.3 - 0.8))
    np.testing.assert_allclose(np.sin(dense["y.psi"][:5]), np.sin(alone["psi"]), atol=1e-12)


def test_first_stage_is_placed_only_where_the_last_one_stands_in_its_frame():
    chain = {"chain": ["kim_dison", "five_link"]}
    sweep.machine({"x": chain | {"place": {}}})
    with pytest.raises(sweep.InputError, match="place: stage = 1"):  # it was a RecursionError
        sweep.machine({"x": chain | {"place": {"stage": 1}}})
