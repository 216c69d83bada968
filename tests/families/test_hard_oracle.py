"""Every row of the open oracle tables, hard ones included, judged by the code whose figures docs/accuracy.md prints.

Tolerances of the sheets in units of 2^-53 max(cond, |y|): 8 for poses, 16 for limit positions and links on a locus, 64
for pressure angles and joint loads, 16 for points of the coupler.
No row may be declared undecidable: the sheets name none.
"""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

import sweep
from kernels import status as st
from tests.support import oracle_factors as oracle

FOLDER = Path(__file__).parents[1] / "oracle"
ROWS = {"rssr": 412, "rssp": 140, "needle208": 46, "composite rssr + rssr": 36, "composite rssr + rssp": 36}
ROWS |= {"limits": 106, "pressure": 71, "largest pressure angle": 32, "geared_dwell": 123}
ROWS |= {"synthesis of rssr": 86, "synthesis of rssp": 32}
ROWS |= {"joint loads": 87, "joint loads with friction": 21, "points of the coupler": 112}


@pytest.fixture(scope="module")
def found():
    return oracle.factors(FOLDER)


@pytest.mark.parametrize("table", ROWS)
def test_every_row_keeps_the_factor_of_its_sheet(found, table):
    worst = [w for w in found if w.table == table]
    bad = [(w.quantity, w.kind, w.factor) for w in worst if not w.factor <= w.allowed]
    assert not bad
    assert max(sum(w.rows for w in worst if w.quantity == q) for q in {w.quantity for w in worst}) == ROWS[table]


def test_no_row_of_the_tables_is_declared_undecidable(found):
    assert sum(w.undecidable for w in found) == 0


def test_poses_that_do_not_reach_say_so():
    rows = [row for row in oracle.read(FOLDER, "rssr") if not row["feasible"]]
    table = {name: [row[name] for row in rows] for name in ("a", "b", "c", "e", "f", "g", "alpha", "phi")}
    frame = sweep.evaluate("rssr", table | {"branch": [row["sigma"] for row in rows]}, ["psi", "d3psi"])
    assert len(rows) == 10
    assert (frame.status == st.NOT_ASSEMBLED).all()
    assert frame[["psi", "d3psi"]].isna().all().all()


def test_rotatability_of_the_limits_table():
    rows = oracle.read(FOLDER, "limits")
    table = {name: [row[name] for row in rows] for name in ("a", "b", "c", "e", "f", "g", "alpha")}
    frame = sweep.summarise("rssr", table | {"branch": [row["sigma"] for row in rows]}, ["rotatable", "margin"])
    np.testing.assert_array_equal(frame.rotatable == 1.0, [row["full_rotation"] for row in rows])
    assert not np.isin(frame.status, (st.UNDECIDABLE, st.NOT_CONVERGED)).any()


def test_least_discriminant_of_the_limits_table():
    """D_min = 4 c^2 a^2 Delta in the table's letters, so margin = D_min/(4 b^2 c^2), to 16 roundings of the inputs."""
    rows = [row for row in oracle.read(FOLDER, "limits") if row["kind"] != "hard_scale"]
    table = {name: np.array([row[name] for row in rows]) for name in ("a", "b", "c", "e", "f", "g", "alpha")}
    frame = sweep.summarise("rssr", table | {"branch": [row["sigma"] for row in rows]}, ["margin"])
    unit = 4.0 * (table["b"] * table["c"]) ** 2
    exact = np.array([float(row["D_min"]) for row in rows])
    size = np.array([max(row["cond"]["D_min"], abs(float(row["D_min"]))) for row in rows])
    assert (np.abs(frame.margin * unit - exact) <= 16.0 * 2.0**-53 * size).all()


def test_the_judge_sees_an_error_of_twenty_roundings():
    """Negative control: the judge itself must not be blind."""
    rows = [row for row in oracle.read(FOLDER, "rssr") if row["feasible"] and row["kind"] == "regular_crank_rocker"]
    table = {name: [row[name] for row in rows] for name in ("a", "b", "c", "e", "f", "g", "alpha", "phi")}
    frame = sweep.evaluate("rssr", table | {"branch": [row["sigma"] for row in rows]}, ["dpsi"])
    off = [20.0 * 2.0**-53 * max(row["cond"]["d1"], abs(float(row["d1"]))) for row in rows]
    wanted = {"dpsi": ("d1", ["d1"])}
    assert oracle.judge("rssr", rows, frame, wanted, 8.0)[0].factor < 8.0
    assert oracle.judge("rssr", rows, frame.assign(dpsi=frame.dpsi + off), wanted, 8.0)[0].factor > 8.0
    assert np.isnan(oracle.judge("rssr", rows, frame.assign(dpsi=np.nan), wanted, 8.0)[0].factor)


def test_tables_are_those_of_the_sheets():
    counts = {name: len(json.loads((FOLDER / f"{name}_open.json").read_text())["rows"]) for name in ("rssr", "limits")}
    assert counts == {"rssr": 422, "limits": 122}
