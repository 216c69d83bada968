"""All extrema of the pressure angle against the table.

The rows carry no sensitivity.  Angles are differences of terms whose size is the last entry of the ellipse, and the
tables' extrema stay below 82 degrees, where the arcsine multiplies errors by 7 at most: 16 units of 2^-53 size.  Crank
angles are zeros of a function with slope H'': 16 units of 2^-53 size^2/|H''|.
"""

from __future__ import annotations

import math

import mpmath as mp
import numpy as np
import pytest

from kernels import status as st
from kernels.effects.pressure import pressure_extrema, slope_coefficients
from kernels.families import rssp, rssr
from tests.support.oracle_rows import geometry, rows

EPS = 2.0**-53


def rssp_designs(table):
    names = ("a", "b", "e", "f", "alpha")
    return np.array([[*(row["inputs"][name] for name in names), 1.0] for row in table])


def ellipses(kind, table):
    ellipse = np.empty((len(table), 7))
    if kind == "extrema_rssr":
        rssr.pressure_ellipse(geometry([row["inputs"] for row in table])[0], ellipse)
    else:
        rssp.pressure_ellipse(rssp_designs(table), ellipse)
    return ellipse


def extrema(ellipse):
    n = len(ellipse)
    status, count = np.empty(n, np.uint8), np.empty(n)
    out = [np.empty((n, 4)) for _ in range(4)]
    pressure_extrema(ellipse, status, count, *out)
    return status, count, *out


@pytest.mark.parametrize("kind", ["extrema_rssr", "extrema_rssp"])
def test_extrema_equal_oracle(kind):
    table = rows("pressure", kind=kind)
    ellipse = ellipses(kind, table)
    status, count, phi, theta, highest, lowest = extrema(ellipse)
    worst = [0.0, 0.0]
    assert len(table) >= 8
    assert {row["expected"]["count"] for row in table} == {2, 4}
    for i, row in enumerate(table):
        expected = row["expected"]
        assert status[i] == st.OK, row["case"]
        assert count[i] == expected["count"], row["case"]
        size = ellipse[i, 6]
        a1, b1, a2, b2 = slope_coefficients.py_func(*ellipse[i, :6])
        order = np.argsort([float(x) for x in expected["phi"]])
        for k, at in enumerate(order):
            exact_phi, exact_theta = mp.mpf(expected["phi"][at]), mp.mpf(expected["theta"][at])
            x = float(exact_phi)
            slope = abs(b1 * math.cos(x) - a1 * math.sin(x) + 2.0 * (b2 * math.cos(2 * x) - a2 * math.sin(2 * x)))
            off = float(abs(mp.mpf(float(phi[i, k])) - exact_phi)) / (EPS * max(size * size / slope, x))
            worst[0] = max(worst[0], off)
            off = float(abs(mp.mpf(float(theta[i, k])) - exact_theta)) / (EPS * max(size, float(exact_theta)))
            worst[1] = max(worst[1], off)
        assert highest[i, 0] == max(theta[i, : len(order)])
        assert lowest[i, 0] == min(theta[i, : len(order)])
        assert highest[i, 0] >= highest[i, 2] >= lowest[i, 2] >= lowest[i, 0]
    assert worst[0] < 16
    assert worst[1] < 16
