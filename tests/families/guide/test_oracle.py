"""Guided four-bar behind a crank-rocker (class-208 needle drive) against the 25-digit table.

Tolerance 8 x 2^-53 max(cond, |y|), for derivatives the maximum over the lower orders too (a single condition number may
vanish by accident): the inputs are rounded once, and two closures add a handful of roundings of the same size.
"""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from mpmath import mp, mpf

import sweep
from kernels import status as st
from tests.support.guided_sensitivities import dev_sensitivities

ROWS = json.loads((Path(__file__).parents[2] / "oracle" / "needle208_open.json").read_text())["rows"]
COLUMNS = {
    "s": ["along"],
    "ds": ["along_d1"],
    "d2s": ["along_d1", "along_d2"],
    "d3s": ["along_d1", "along_d2", "along_d3"],
    "dev": ["dev"],
    "ddev": ["dev_d1"],
    "d2dev": ["dev_d1", "dev_d2"],
    "x_m": ["x"],
    "y_m": ["y"],
}
FACTOR = 8.0
LENGTHS = ("a1", "b1", "c1", "e1", "a2", "b2", "c2", "e2", "xi", "eta", "hl")


def evaluated(rows, scale=1.0):
    def column(name):
        return np.array([row[name] for row in rows]) * (scale if name in LENGTHS else 1.0)

    table = {name: column(name) for name in ("phi", *LENGTHS[:8])}
    table |= {"xi2": column("xi"), "eta2": column("eta"), "lam2": column("lam"), "h2": column("hl")}
    table |= {"f1": 0.0, "g1": 0.0, "alpha1": 0.0, "branch1": column("sigma1"), "branch2": column("sigma2")}
    table |= {"kappa2": column("kappa"), "offset2": column("theta0")}
    return sweep.evaluate(["rssr", "guide"], table, list(COLUMNS))


def worst_factor(frame, rows, output):
    """Largest error in units of 2^-53 max(cond, |y|)."""
    worst = 0.0
    with mp.workdps(40):
        for value, row in zip(frame[output], rows, strict=True):
            names = COLUMNS[output]
            size = max(max(mpf(row["cond"][k]), abs(mpf(row[k]))) for k in names)
            worst = max(worst, float(abs(mpf(float(value)) - mpf(row[names[-1]])) / (mpf(2) ** -53 * size)))
    return worst


@pytest.mark.parametrize("output", COLUMNS)
def test_guide_matches_oracle_on_every_row(output):
    frame = evaluated(ROWS)
    assert (frame.status == st.OK).all()
    assert worst_factor(frame, ROWS, output) <= FACTOR


@pytest.mark.parametrize("exponent", [-199, 199])  # 1e-60, 1e60
def test_guide_scaled_by_a_power_of_two_keeps_every_bit(exponent):
    plain, scaled = evaluated(ROWS), evaluated(ROWS, 2.0**exponent)
    assert (scaled.status == st.OK).all()
    for name in COLUMNS:
        np.testing.assert_array_equal(np.ldexp(plain[name], exponent), scaled[name])


def test_guide_sensitivities_of_dev_match_oracle():
    # No condition numbers are tabulated for these; they are first derivatives, so the condition numbers of dev and
    # of its derivatives with respect to phi, divided by the parameter's size, set the scale of their error.
    parameters = ("theta0", "a2", "b2", "c2", "e2", "xi", "eta", "lam", "hl")
    for row in ROWS:
        psi = sweep.evaluate(
            "rssr",
            {name: row[f"{name}1"] for name in "abce"}
            | {"f": 0.0, "g": 0.0, "alpha": 0.0, "branch": row["sigma1"], "phi": row["phi"]},
            "psi",
        ).psi[0]
        design = [row[k] for k in ("a2", "b2", "c2", "e2", "xi", "eta", "lam", "hl", "sigma2")]
        sensitivities, status = dev_sensitivities(design, row["kappa"] * psi + row["theta0"])
        assert (status == st.OK).all()
        size = max(row[k] for k in ("a2", "b2", "c2", "e2"))
        scale = max(row["cond"]["dev"], row["cond"]["dev_d1"], row["cond"]["dev_d2"]) / size
        for value, name in zip(sensitivities, parameters, strict=True):
            unit = size if name in ("theta0", "lam") else 1.0
            expected = float(row["ddev"][name])
            assert abs(value - expected) <= 16.0 * 2.0**-53 * max(scale, 1.0) * max(unit, abs(expected)), name


def test_negative_control_difference_quotient_fails_the_oracle():
    step = 6e-6
    shifted = [evaluated([row | {"phi": row["phi"] + d} for row in ROWS]).dev for d in (-step, step)]
    frame = evaluated(ROWS).assign(ddev=(shifted[1] - shifted[0]) / (2.0 * step))
    assert worst_factor(frame, ROWS, "ddev") > 1000.0 * FACTOR


def test_negative_control_dropped_turning_of_the_coupler_fails_the_oracle():
    # dev of the crank pin's motion alone: what remains when the coupler is taken not to turn
    frame = evaluated([row | {"xi": 0.0, "eta": 0.0} for row in ROWS])
    assert worst_factor(frame, ROWS, "ddev") > 1e10
