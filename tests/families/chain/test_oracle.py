"""Two linkages in series against the 25-digit table, by the tolerance of the other tables.

8 x 2^-53 max(cond, |y|), for derivatives the maximum over the lower orders too (a single condition number may vanish by
accident): the inputs are rounded once, and the composition adds a handful of roundings of the same size.
"""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from mpmath import mp, mpf

import sweep
from kernels import status as st

ROWS = json.loads((Path(__file__).parents[2] / "oracle" / "composite_open.json").read_text())["rows"]
FACTOR = 8.0
LENGTHS = ("a", "b", "c", "e", "f", "g")
CASES = {("rssr", "rssr"): "psi", ("rssr", "rssp"): "s"}


def rows_of(chain):
    return [row for row in ROWS if row["stage2_type"].lower() == chain[1]]


def evaluated(chain, rows, scale1=1.0, scale2=1.0):
    scales = {1: scale1, 2: scale2}
    table = {
        f"{name}{k}": [row[f"stage{k}"][name] * (scales[k] if name in LENGTHS else 1.0) for row in rows]
        for k in (1, 2)
        for name in rows[0][f"stage{k}"]
    }
    table |= {"branch1": [row["sigma1"] for row in rows], "branch2": [row["sigma2"] for row in rows]}
    table |= {"kappa2": [row["kappa"] for row in rows], "offset2": [row["theta0"] for row in rows]}
    y = CASES[chain]
    names = [y, f"d{y}", f"d2{y}", f"d3{y}"]
    frame = sweep.evaluate(list(chain), table | {"phi": [row["phi"] for row in rows]}, [*names, "dpsi1", "d2psi1"])
    return frame.rename(columns=dict(zip(names, ("y", "d1", "d2", "d3"), strict=True)))


def worst_factor(frame, rows, column):
    """Largest error in units of 2^-53 max(cond, |y|)."""
    worst = 0.0
    lower = {"y": ["y"], "d1": ["d1"], "d2": ["d1", "d2"], "d3": ["d1", "d2", "d3"]}[column]
    with mp.workdps(40):
        for value, row in zip(frame[column], rows, strict=True):
            size = max(max(mpf(row["cond"][k]), abs(mpf(row[k]))) for k in lower)
            worst = max(worst, float(abs(mpf(float(value)) - mpf(row[column])) / (mpf(2) ** -53 * size)))
    return worst


@pytest.mark.parametrize("chain", CASES)
@pytest.mark.parametrize("column", ["y", "d1", "d2", "d3"])
def test_chain_matches_oracle_on_every_row(chain, column):
    rows = rows_of(chain)
    frame = evaluated(chain, rows)
    assert (frame.status == st.OK).all()
    assert worst_factor(frame, rows, column) <= FACTOR


@pytest.mark.parametrize("chain", CASES)
def test_chain_stages_may_be_drawn_at_any_scale(chain):
    rows = rows_of(chain)
    plain, scaled = evaluated(chain, rows), evaluated(chain, rows, 2.0**-199, 2.0**199)
    length = 199 if CASES[chain] == "s" else 0
    for column in ("y", "d1", "d2", "d3"):
        np.testing.assert_array_equal(np.ldexp(plain[column], length), scaled[column])


def test_negative_control_printed_second_derivative_fails_the_oracle():
    # the source loses one dot in (22): y'' = I' II' + I'^2 II''; I' II' is the velocity
    rows = rows_of(("rssr", "rssr"))
    frame = evaluated(("rssr", "rssr"), rows)
    second = (frame.d2 - frame.d2psi1 * frame.d1 / frame.dpsi1) + frame.d1
    assert worst_factor(frame.assign(d2=second), rows, "d2") > 1e6


def test_negative_control_forgotten_sense_of_the_coupling_fails_the_oracle():
    rows = [row for row in rows_of(("rssr", "rssr")) if row["kappa"] == -1]
    frame = evaluated(("rssr", "rssr"), rows)
    assert len(rows) > 5
    assert worst_factor(frame.assign(d1=-frame.d1), rows, "d1") > 1e6
