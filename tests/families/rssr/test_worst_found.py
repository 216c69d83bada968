"""The poses with the largest errors that the search has found so far: none may become worse.

The bound is half as much again as the recorded factor, plus one: another library's cosine may round phi differently.
A kernel that gets better lets its factors fall; the table is then searched anew (``make search-worse``).
"""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from tests.search.worse import NAMES, ORDERS, POSES, factors

ROWS = json.loads((Path(__file__).parents[2] / "oracle" / "worst_found.json").read_text())["rows"]


@pytest.mark.parametrize("row", ROWS, ids=lambda row: f"{row['poses']}, {row['region']}, {row['output']}")
def test_known_worst_pose_does_not_get_worse(row):
    design = np.array([float.fromhex(row["hex"][name]) for name in NAMES])
    phi = float.fromhex(row["hex"]["phi"])
    assert [row["inputs"][name] for name in (*NAMES, "phi")] == [*design, phi]
    now = factors(design, phi, row["poses"])[ORDERS.index(row["output"])]
    assert now <= 1.5 * row["factor"] + 1.0
    assert row["poses"] == "sweeps" or row["factor"] <= 3.0


def test_poses_that_are_hard_for_the_sweeps_are_not_for_evaluate():
    hard = [row for row in ROWS if row["poses"] == "sweeps" and row["factor"] > 8.0]
    assert len(hard) > 5
    for row in hard:
        design = np.array([float.fromhex(row["hex"][name]) for name in NAMES])
        assert max(factors(design, float.fromhex(row["hex"]["phi"]))) < 3.0


def test_the_search_measures_errors_and_not_itself():
    """Negative control: the same pose with its crank angle moved by 1e-12 is off by thousands of units."""
    from tests.support.sixty_digits import angle_error, condition, transfer_functions

    row = next(row for row in ROWS if row["output"] == "psi" and row["region"] == "ordinary")
    design = np.array([float.fromhex(row["hex"][name]) for name in NAMES])
    phi = float.fromhex(row["hex"]["phi"])
    moved = float(transfer_functions(design, phi + 1e-12)[0])
    off = angle_error(moved, transfer_functions(design, phi)[0]) / (2.0**-53 * max(condition(design, phi)[0], 1.0))
    slope = abs(float(transfer_functions(design, phi)[1]))
    assert off > 100.0 * slope / max(condition(design, phi)[0], 1.0)


def test_every_region_and_output_has_been_searched():
    from tests.search.worse import REGIONS

    for poses in POSES:
        found = {(row["region"], row["output"]) for row in ROWS if row["poses"] == poses}
        assert found == {(r, o) for r in REGIONS for o in ORDERS}
