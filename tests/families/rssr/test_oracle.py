"""Crank-rocker against the oracle tables (25 digits, computed from joint coordinates), hard rows included.

Tolerance (docs/rssr.md, section 7): K 2^-53 max(cond, |y|), for derivatives the largest of the orders up to theirs.
K = 8 for poses (measured 2.0) and for the margin (1.2), 16 for limit positions (2.5).
"""

import json
import math
from pathlib import Path

import mpmath as mp
import numpy as np
import pytest

from kernels import status as st
from tests.support.rssr_designs import limits, margins, poses

EPS = 2.0**-53
FOLDER = Path(__file__).parents[2] / "oracle"
KEYS = ("a", "b", "c", "e", "f", "g", "alpha")


def table(name):
    rows = json.loads((FOLDER / f"{name}_open.json").read_text())["rows"]
    designs = [[*(float.fromhex(row["hex"][key]) for key in KEYS), row["sigma"]] for row in rows]
    return rows, np.array(designs, dtype=float)


POSES, POSE_DESIGNS = table("rssr")
LIMITS, LIMIT_DESIGNS = table("limits")


@pytest.fixture(scope="module")
def motion():
    phi = np.array([[float.fromhex(row["hex"]["phi"])] for row in POSES])
    return {name: column[:, 0] for name, column in poses(POSE_DESIGNS, phi).items()}


def error(got, expected):
    return float(abs(mp.mpf(float(got)) - mp.mpf(expected)))


def test_every_row_is_decided_as_the_table_says(motion):
    for row, status in zip(POSES, motion["status"], strict=True):
        assert status == (st.OK if row["feasible"] else st.NOT_ASSEMBLED), row["id"]


def test_psi_is_right_to_eight_roundings(motion):
    for i, row in enumerate(POSES):
        if row["feasible"]:
            chord = mp.hypot(
                mp.mpf(motion["sin_psi"][i]) - mp.mpf(row["sin_psi"]),
                mp.mpf(motion["cos_psi"][i]) - mp.mpf(row["cos_psi"]),
            )
            allowed = 8.0 * EPS * max(row["cond"]["psi"], 1.0)
            assert float(chord) <= allowed, row["id"]
            wrapped = error(motion["psi"][i], row["psi"])
            assert min(wrapped, abs(wrapped - 2.0 * math.pi)) <= allowed + 2.0 * EPS * math.pi, row["id"]


def test_derivatives_are_right_to_eight_roundings(motion):
    for i, row in enumerate(POSES):
        scale = 0.0
        for name, key in (("dpsi", "d1"), ("d2psi", "d2"), ("d3psi", "d3")):
            if row["feasible"]:
                scale = max(scale, row["cond"][key], abs(float(row[key])))
                assert error(motion[name][i], row[key]) <= 8.0 * EPS * scale, (row["id"], name)


def test_discriminant_is_right_to_eight_roundings_or_leaves_float64_with_the_true_value(motion):
    for i, row in enumerate(POSES):
        scale = row["cond"]["D"]
        if scale is None:
            assert motion["discriminant"][i] == float(mp.mpf(row["D"])), row["id"]
        else:
            scale = max(scale, abs(float(row["D"])))
            assert error(motion["discriminant"][i], row["D"]) <= 8.0 * EPS * scale + 5e-324, row["id"]


def test_pressure_angle_is_that_of_the_table(motion):
    # cos = |F_psi|/(2 b c); near zero pressure the cosine says little, so the sine is compared through its square.
    for i, row in enumerate(POSES):
        if row["feasible"]:
            b, c = mp.mpf(POSE_DESIGNS[i, 1]), mp.mpf(POSE_DESIGNS[i, 2])
            cosine = abs(mp.mpf(row["F_psi"])) / (2 * b * c)
            allowed = 8.0 * EPS * max(1.0, float(mp.mpf(row["cond"]["F_psi"]) / (2 * b * c)))
            assert float(abs(mp.cos(mp.mpf(motion["pressure_angle"][i])) - cosine)) <= allowed, row["id"]


def test_margin_and_rotatability_are_those_of_the_table():
    found = margins(LIMIT_DESIGNS)
    for i, row in enumerate(LIMITS):
        # None of the rows lies in the undecidable band, not even those a part in 1e12 from a change point.
        assert found["status"][i] == (st.OK if row["full_rotation"] else st.NOT_ROTATABLE), row["id"]
        scale = (2 * mp.mpf(LIMIT_DESIGNS[i, 1]) * mp.mpf(LIMIT_DESIGNS[i, 2])) ** 2
        difference = error(found["margin"][i], mp.mpf(row["D_min"]) / scale)
        assert difference <= 8.0 * EPS * float(mp.mpf(row["cond"]["D_min"]) / scale), row["id"]
        assert difference <= found["error"][i], row["id"]


LIMIT_KEYS = {"swing": "psi0", **{name: name for name in ("psi_ext", "psi_fold", "phi_ext", "phi_fold", "phi0")}}
LIMIT_KEYS["stroke_ratio"] = "stroke_ratio"


@pytest.mark.parametrize("name", LIMIT_KEYS)
def test_limit_positions_are_right_to_sixteen_roundings_and_within_their_own_estimate(name):
    found, key = limits(LIMIT_DESIGNS), LIMIT_KEYS[name]
    for i, row in enumerate(LIMITS):
        if row.get("rocker") != "oscillates":
            expected = st.NOT_OSCILLATING if row["full_rotation"] else st.NOT_ROTATABLE
            assert found["status"][i] == expected and math.isnan(found[name][i]), row["id"]
            continue
        assert found["status"][i] == st.OK, row["id"]
        difference, scale = error(found[name][i], row[key]), row["cond"][key]
        if name.startswith(("psi", "phi_")):
            difference, scale = min(difference, abs(difference - 2.0 * math.pi)), max(scale, 1.0)
        assert difference <= 16.0 * EPS * max(scale, abs(float(row[key]))), row["id"]
        assert difference <= found[f"err_{name}"][i], row["id"]


def test_a_swing_of_1e_minus_10_keeps_its_relative_accuracy():
    found = limits(LIMIT_DESIGNS)
    tiny = [i for i, row in enumerate(LIMITS) if row["kind"] == "hard_tiny_swing"]
    assert min(abs(found["swing"][tiny])) < 1e-10
    for i in tiny:
        relative = error(found["swing"][i], LIMITS[i]["psi0"]) / abs(float(LIMITS[i]["psi0"]))
        assert relative <= 16.0 * EPS * LIMITS[i]["cond"]["psi0"] / abs(float(LIMITS[i]["psi0"])), i
