"""The closure constant in twice the working precision: given doubles meant to the last bit, long couplers included."""

from __future__ import annotations

from fractions import Fraction
from pathlib import Path

import numpy as np
import pytest
from mpmath import mp, mpf

from kernels.families.rssr.exact import exact_constant
from studies.accuracy import oracle
from studies.accuracy.exact import constants, motion
from tests.turn_designs import crank_rockers

FOLDER = Path(__file__).parent / "oracle"
NAMES = ("a", "b", "c", "e", "f", "g", "alpha", "sigma")
UNIT = 2.0**-53


def long_couplers():
    rows = [row for row in oracle.read(FOLDER, "rssr") if row["kind"] == "hard_long_coupler" and row["feasible"]]
    return rows, np.array([[row[name] for name in NAMES] for row in rows]), np.array([row["phi"] for row in rows])


def errors(rows, got):
    """Error of psi in units of 2^-53 (not of the condition number)."""
    with mp.workdps(40):
        return np.array(
            [float(abs(mp.sin(mpf(float(g)) - mpf(row["psi"])))) / UNIT for g, row in zip(got, rows, strict=True)]
        )


def test_long_couplers_of_the_table_gain_most_of_what_plain_arithmetic_loses():
    rows, designs, phi = long_couplers()
    plain, exact = (errors(rows, motion(designs, phi, k0)[0]) for k0 in (None, constants(designs)))
    print(plain.max(), exact.max())
    assert plain.max() > 1e5
    assert exact.max() < 1e-3 * plain.max()
    assert exact.max() < 200.0


def test_elsewhere_nothing_changes_but_roundings():
    rows = [row for row in oracle.read(FOLDER, "rssr") if row["feasible"] and row["kind"].startswith("regular")]
    designs = np.array([[row[name] for name in NAMES] for row in rows])
    got = motion(designs, np.array([row["phi"] for row in rows]), constants(designs))
    for values, (key, lower) in zip(got, oracle._orders("psi", "psi").values(), strict=True):
        for value, row in zip(values, rows, strict=True):
            size = max(max(float(row["cond"][k]), abs(float(row[k]))) for k in lower)
            assert abs(value - float(row[key])) <= 8.0 * UNIT * max(size, 1.0)


@pytest.mark.parametrize("which", [3, 4, 5])
def test_constant_is_that_of_rational_arithmetic(which):
    """Parallel axes make K rational, so it can be compared with fractions: within one rounding, whatever cancels."""
    designs = crank_rockers(200, which)
    designs[:, 6] = 0.0
    designs[:, which] *= 1e6
    if which > 3:
        designs[:, 1] = np.abs(designs[:, 4] - designs[:, 5]) * (1.0 + 1e-9)
    else:
        designs[:, 1] = np.abs(designs[:, 3]) * (1.0 + 1e-9)
    for design, got in zip(designs, constants(designs), strict=True):
        a, b, c, e, f, g = (Fraction(float(x)) for x in design[:6])
        exact = (a * a - b * b + c * c + e * e + (f - g) ** 2) / (2 * a * c)
        assert abs(Fraction(float(got)) - exact) <= 4 * Fraction(UNIT) * abs(exact)


def test_constant_scales_bit_for_bit_and_runs_as_plain_python():
    designs = crank_rockers(50, 1)
    scaled = designs.copy()
    scaled[:, :6] = np.ldexp(designs[:, :6], 230)
    np.testing.assert_array_equal(constants(designs), constants(scaled))
    python = np.empty(len(designs))
    exact_constant.py_func(designs, python)
    np.testing.assert_allclose(python, constants(designs), rtol=4.0 * UNIT)


def test_what_is_not_finite_stays_visible():
    designs = np.array([[1.0, 2.0, 1.5, np.nan, 0.0, 0.0, 0.3, 1.0], [1.0, np.inf, 1.5, 1.0, 0.0, 0.0, 0.3, 1.0]])
    assert np.isnan(constants(designs)).all()
