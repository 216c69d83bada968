"""Shaking of chains and their machine against the 25-digit table: minus the rate of momentum, the bar's couple too."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from mpmath import mp, mpf

import sweep

ROWS = [
    row
    for row in json.loads((Path(__file__).parents[1] / "oracle" / "machine_open.json").read_text())["rows"]
    if row["kind"] == "shaking"
]
FACTOR = 64.0
FINGER = {"driving": 1.0, "driven": 0.0, "planar": 0.0}


def bodies(stage, number):
    found = {f"finger{number}": FINGER[stage.get("construction", "planar")]}
    none = {"m": 0.0, "com": [0.0] * 3, "J": [[0.0] * 3] * 3}
    for name, body in (dict.fromkeys(("crank", "coupler", "rocker"), none) | stage["bodies"]).items():
        found[f"m_{name}{number}"] = body["m"]
        found |= {f"com_{name}_{x}{number}": value for x, value in zip("xyz", body["com"], strict=True)}
        found |= {f"j_{name}_{'xyz'[i]}{'xyz'[j]}{number}": body["J"][i][j] for i in range(3) for j in range(i, 3)}
    return found


def evaluated(row):
    given = row["inputs"]
    stages = given["stages"]
    numbers = [str(k) for k in range(1, len(stages) + 1)] if len(stages) > 1 else [""]
    place = {key: given[key] for key in ("at", "axis", "zero") if key in given}
    member = {"family": "rssr"} if len(stages) == 1 else {"chain": [stage["family"] for stage in stages]}
    if place:
        member["place"] = place | ({"stage": 1} if len(stages) > 1 else {})
    listed = [f"x{number}" for number in numbers]
    machine = sweep.machine({"x": member}, {"f": {"shaking": listed}, "t": {"torque": listed[:1]}})
    design = {f"x.speed{numbers[0]}": given["omega"], f"x.speed_change{numbers[0]}": given["epsilon"]}
    for number, stage in zip(numbers, stages, strict=True):
        own = {f"{key}{number}": value for key, value in stage["p"].items()} | bodies(stage, number)
        own |= {f"{key}{number}": stage[key] for key in ("kappa", "offset", "shift", "turn", "m_tool") if key in stage}
        design |= {f"x.{key}": value for key, value in own.items()}
    names = [*(f"f_{axis}" for axis in "xyz"), *(f"f_moment_{axis}" for axis in "xyz"), "t"]
    found = sweep.evaluate(machine, design, names, phi=[given["phi"]]).iloc[0]
    return {
        "force": [found[name] for name in names[:3]],
        "moment": [found[name] for name in names[3:6]],
        "drive_torque": [found["t"]],
    }


@pytest.mark.parametrize("case", sorted({row["case"] for row in ROWS}))
def test_force_moment_and_torque_are_those_of_the_table(case):
    worst = {}
    for row in (row for row in ROWS if row["case"] == case):
        for name, values in evaluated(row).items():
            exact = [mpf(x) for x in np.atleast_1d(row["expected"][name])]
            with mp.workdps(40):
                size = max(mpf(row["cond"][name]), *(abs(x) for x in exact))
                error = max(abs(mpf(float(a)) - b) for a, b in zip(values, exact, strict=True))
                worst[name] = max(worst.get(name, 0.0), float(error / (mpf(2) ** -53 * size)))
    assert max(worst.values()) < FACTOR, worst
