"""Spatial slider-crank against the 25-digit table.

Tolerance 8 x 2^-53 max(cond, |y|), for derivatives the maximum over the lower orders too (a single condition number may
vanish by accident): the inputs are rounded once, and the stable form adds a handful of roundings of the same size.
"""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from mpmath import mp, mpf

import sweep
from kernels import status as st

ROWS = json.loads((Path(__file__).parents[2] / "oracle" / "rssp_open.json").read_text())["rows"]
ORDERS = {"s": ("S", 0), "ds": ("d1", 1), "d2s": ("d2", 2), "d3s": ("d3", 3), "discriminant": ("Q", 0)}
FACTOR = 8.0


def evaluated(rows, scale=1.0):
    table = {name: [row[name] * scale for row in rows] for name in ("a", "b", "e", "f")}
    table |= {name: [row[name] for row in rows] for name in ("alpha", "phi")}
    return sweep.evaluate("rssp", table | {"branch": [row["sigma"] for row in rows]}, list(ORDERS))


def worst_factor(frame, rows, output):
    """Largest error in units of 2^-53 max(cond, |y|)."""
    worst = 0.0
    with mp.workdps(40):
        for value, row in zip(frame[output], rows, strict=True):
            column, order = ORDERS[output]
            lower = [f"d{m}" for m in range(1, order + 1)] or [column]
            size = max(max(mpf(row["cond"][k] or 0), abs(mpf(row[k]))) for k in lower)
            worst = max(worst, float(abs(mpf(float(value)) - mpf(row[column])) / (mpf(2) ** -53 * size)))
    return worst


FEASIBLE = [row for row in ROWS if row["feasible"]]


@pytest.mark.parametrize("output", ORDERS)
def test_rssp_matches_oracle_on_every_row(output):
    frame = evaluated(FEASIBLE)
    assert (frame.status == st.OK).all()
    assert worst_factor(frame, FEASIBLE, output) <= FACTOR


def test_rssp_reports_what_does_not_reach():
    rows = [row for row in ROWS if not row["feasible"]]
    frame = evaluated(rows)
    assert len(rows) >= 4
    assert (frame.status == st.NOT_ASSEMBLED).all()
    assert frame[["s", "ds", "d2s", "d3s"]].isna().all().all()
    np.testing.assert_allclose(frame.discriminant, [float(row["Q"]) for row in rows], rtol=1e-13)


@pytest.mark.parametrize("exponent", [-330, -40, 40, 330])
def test_rssp_scaled_by_a_power_of_two_keeps_every_bit(exponent):
    rows = [row for row in FEASIBLE if not row["kind"].startswith("hard_scale")]
    plain, scaled = evaluated(rows), evaluated(rows, 2.0**exponent)
    for name in ("s", "ds", "d2s", "d3s"):
        np.testing.assert_array_equal(np.ldexp(plain[name], exponent), scaled[name])
    np.testing.assert_array_equal(np.ldexp(plain.discriminant, 2 * exponent), scaled.discriminant)


def test_negative_control_difference_quotient_fails_the_oracle():
    rows = [row for row in FEASIBLE if row["kind"] == "regular"]
    step = 6e-6
    shifted = [evaluated([row | {"phi": row["phi"] + d} for row in rows]).s for d in (-step, step)]
    frame = evaluated(rows).assign(ds=(shifted[1] - shifted[0]) / (2.0 * step))
    assert worst_factor(frame, rows, "ds") > 1000.0 * FACTOR


def test_negative_control_other_branch_fails_the_oracle():
    rows = [row for row in FEASIBLE if row["kind"] == "regular"]
    frame = evaluated([row | {"sigma": -row["sigma"]} for row in rows])
    assert worst_factor(frame, rows, "s") > 1e10
