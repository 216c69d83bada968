"""Geared dwell drive against the 25-digit table.

Tolerance 16 x 2^-53 of the size of the quantity, as for the other families: the stable forms add a handful of
roundings.  The size at a pose is the largest of |y|, its lower derivatives (y itself may vanish by accident) and
|phi y'|, what one rounding of the carrier angle changes: the conditioning the table's ``comparison`` names.  Dwell
measures and maxima over the turn are well conditioned; their size is their value.
"""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from mpmath import mp, mpf

import sweep
from kernels import status as st
from sweep.families import family
from sweep.families.base import Accuracy
from tests.reference.geared_dwell import derivatives

ROWS = json.loads((Path(__file__).parents[2] / "oracle" / "geared_dwell_open.json").read_text())["rows"]
UNIT = 2.0**-53
FACTOR = 16.0
COLUMNS = {"psi": "phi", "dpsi": "dphi", "d2psi": "d2phi", "d3psi": "d3phi"}
DWELL = {"dwell_angle": "alpha0", "dwell_deviation": "delta", "dwell_band": "band_dwell"}
TARGET = Accuracy(target=1e-8)


def rows_of(kind):
    return [row for row in ROWS if row["kind"] == kind]


def step(name, table, wanted, accuracy=TARGET):
    run = next(s.run for s in family("geared_dwell").steps if s.name == name)
    return run(np.array(table, dtype=float), frozenset(wanted), accuracy)


def designs(rows):
    return [(row["in"]["k"], row["in"]["a"]) for row in rows]


def factors(values, expected, sizes):
    with mp.workdps(40):
        errors = [abs(mpf(float(v)) - mpf(e)) for v, e in zip(values, expected, strict=True)]
        return np.array([float(e / (UNIT * mpf(s))) for e, s in zip(errors, sizes, strict=True)])


@pytest.fixture(scope="module")
def points():
    rows = rows_of("point")
    table = {"k": [r["in"]["k"] for r in rows], "a": [r["in"]["a"] for r in rows]}
    frame = sweep.evaluate("geared_dwell", table | {"phi": [r["in"]["alpha"] for r in rows]}, [*COLUMNS, "x_b", "y_b"])
    return rows, frame


@pytest.mark.parametrize("order", range(4))
def test_pose_matches_oracle_on_every_row(points, order):
    rows, frame = points
    output = list(COLUMNS)[order]
    sizes = []
    for row in rows:
        with mp.workdps(40):
            given = row["in"]
            ladder = [mpf(row["out"]["phi"]), *derivatives(given["k"], given["a"], given["alpha"])]
            sizes.append(max([abs(given["alpha"] * ladder[order + 1]), *map(abs, ladder[min(order, 1) : order + 1])]))
    sizes = [size or 1 for size in sizes]  # the row at phi = 0, where odd quantities must be exactly zero
    assert len(rows) == 123
    assert (frame.status == st.OK).all()
    assert factors(frame[output], [row["out"][COLUMNS[output]] for row in rows], sizes).max() <= FACTOR


def test_pin_matches_oracle_on_every_row(points):
    rows, frame = points
    for output, column in (("x_b", "x"), ("y_b", "y")):
        # One rounding of phi moves the pin by |phi| (2 + 2 k).
        sizes = [abs(mpf(r["out"][column])) + (1 + abs(r["in"]["alpha"])) * (2 + 2 * r["in"]["k"]) for r in rows]
        assert factors(frame[output], [row["out"][column] for row in rows], sizes).max() <= 2.0


@pytest.mark.parametrize("output", DWELL)
def test_dwell_measure_matches_oracle_on_every_row(output):
    rows = rows_of("dwell")
    got = step("dwell", designs(rows), DWELL)
    expected = [row["out"][DWELL[output]] for row in rows]
    assert (got["status"] == st.OK).all()
    assert factors(got[output], expected, expected).max() <= FACTOR


def test_turns_match_oracle():
    rows = rows_of("turn")
    got = step("dwell", designs(rows), ["turns"])
    assert (got["status"] == st.OK).all()
    np.testing.assert_array_equal(got["turns"], [row["out"]["turns_of_output"] for row in rows])


def test_maxima_over_the_turn_match_oracle_on_every_row():
    rows = rows_of("turn")
    got = step("stationary points", designs(rows), ["max_abs_dpsi", "max_abs_d2psi", "phi_max_abs_d2psi"])
    assert (got["status"] == st.OK).all()
    largest = [max(abs(mpf(r["out"]["max_dphi"])), abs(mpf(r["out"]["min_dphi"]))) for r in rows]
    assert factors(got["max_abs_dpsi"], largest, largest).max() <= FACTOR
    for output, column in (("max_abs_d2psi", "max_abs_d2phi"), ("phi_max_abs_d2psi", "alpha_of_max_in_0_pi")):
        expected = [row["out"][column] for row in rows]
        assert factors(got[output], expected, expected).max() <= FACTOR


def test_sampled_maximum_misses_the_true_one_near_a_singularity():
    # Negative control: the table's sharp peaks do not pass a grid, so the test above cannot pass by accident.
    rows = [row for row in rows_of("turn") if row["tag"].startswith("near")]
    got = step("grid", designs(rows), ["max_abs_d2psi"], Accuracy(samples=360))
    assert (got["max_abs_d2psi"] < 0.7 * np.array([float(row["out"]["max_abs_d2phi"]) for row in rows])).all()


@pytest.mark.parametrize("row", rows_of("optimum"), ids=lambda row: f"k={row['in']['k']:.4f}")
def test_optimum_offset_matches_oracle(row):
    k, out = row["in"]["k"], row["out"]
    places = [k, k - 1e-6, k + 1e-6, 0.0, float(out.get("a_equal_acc", 0.0))]
    got = step("stationary points", [(k, a) for a in places], ["max_abs_d2psi"])["max_abs_d2psi"]
    best = float(out["min_max_abs_d2phi"])
    assert abs(float(out["a_opt"]) - k) <= 1e-9 * k
    assert abs(got[0] - best) <= 1e-12 * best  # the table's minimum is a search over a corner, good to a_opt
    assert got[0] < min(got[1], got[2])
    if "a_equal_acc" in out:
        at_zero = float(out["max_abs_d2phi_at_a0"])
        assert abs(got[3] - at_zero) <= FACTOR * UNIT * at_zero
        assert abs(got[4] - at_zero) <= 1e-10 * at_zero  # a_equal_acc is printed to 12 digits
