"""Slotted link against the 25-digit table, through `sweep.evaluate`.

Tolerance 4 x 2^-53 max(cond, |y|), for derivatives the maximum over the lower orders too (a single condition number may
vanish by accident), for the angle max(cond, 1): the inputs are rounded once, the closed form adds a few roundings.
"""

from __future__ import annotations

import numpy as np
import pytest
from mpmath import mp, mpf

import sweep
from kernels import status as st
from tests.support.oracle_rows import rows

FACTOR = 4.0
ROWS = rows("slotted")
ORDERS = {"psi": "psi", "dpsi": "d1", "d2psi": "d2", "d3psi": "d3"}
EPS = mpf(2) ** -53


def every_mode(row):
    """All assembly modes of one row, its own first: the one whose angle is nearest to the table's."""
    names = ("a", "e", "f", "g", "alpha", "s", "k", "phi")
    modes = [(tau, branch) for tau in ((1.0, -1.0) if row["variant"] == "bar" else (1.0,)) for branch in (1.0, -1.0)]
    table = {name: [row[name]] * len(modes) for name in names}
    table |= {"tau": [tau for tau, _ in modes], "branch": [branch for _, branch in modes]}
    frame = sweep.evaluate("slotted", table, [*ORDERS, "sin_psi", "cos_psi"])
    frame = frame[frame.status == st.OK]
    away = np.abs(np.angle(np.exp(1j * (frame.psi - row["psi_near"]))))
    return frame.iloc[np.argsort(away)]


def factor(got, row, output):
    keys = list(ORDERS.values())
    at = keys.index(ORDERS[output])
    lower = keys[1 : at + 1] or ["psi"]
    size = max(max(mpf(row["cond"][key]), abs(mpf(row[key]))) for key in lower)
    if output == "psi":
        size = max(mpf(row["cond"]["psi"]), mpf(1))
    with mp.workdps(40):
        return float(abs(mpf(float(got)) - mpf(row[ORDERS[output]])) / (EPS * size))


@pytest.mark.parametrize("output", ORDERS)
def test_slotted_matches_oracle_on_every_row(output):
    worst = max(factor(every_mode(row).iloc[0][output], row, output) for row in ROWS)
    assert worst <= FACTOR


def test_slotted_oracle_has_both_kinds_of_link():
    assert {row["variant"] for row in ROWS} == {"plane", "bar"}
    assert len(ROWS) >= 50


def test_negative_control_other_modes_fail_the_oracle():
    for row in ROWS:
        others = every_mode(row).iloc[1:]
        assert len(others) >= 1
        assert min(factor(psi, row, "psi") for psi in others.psi) > 1e6


def test_negative_control_bar_taken_for_a_slot_fails_the_oracle():
    bars = [row for row in ROWS if row["variant"] == "bar"]
    wrong = [every_mode(row | {"variant": "plane", "k": 0.0}) for row in bars]
    found = [factor(frame.iloc[0].psi, row, "psi") for frame, row in zip(wrong, bars, strict=True) if len(frame)]
    assert len(found) > 5 and min(found) > 1e6
