"""``evaluate`` closes the crank-rocker in twice the working precision: given doubles are meant to the last bit.

What remains is the rounding of cos(phi), sin(phi) and of the result.  The kernel of the sweeps, in plain arithmetic, is
the negative control.
"""

from __future__ import annotations

from fractions import Fraction
from pathlib import Path

import numpy as np
import pytest
from mpmath import mp, mpf

import sweep
from kernels import status as st
from kernels.families import rssr
from kernels.families.rssr import precise
from sweep.families import family
from sweep.families.base import Angles
from tests.support import oracle_factors as oracle
from tests.support.rssr_designs import random_designs
from tests.support.sixty_digits import ORDERS, transfer_functions
from tests.support.turn_designs import crank_rockers

FOLDER = Path(__file__).parents[2] / "oracle"
NAMES = ("a", "b", "c", "e", "f", "g", "alpha", "sigma")
UNIT = 2.0**-53
RSSR = family("rssr")
PLAIN, PRECISE = RSSR, RSSR.precise()
WANTED = frozenset(RSSR.pose_names)
PHI = np.linspace(0.0, 6.0, 11)[None]


def motion(mechanism, designs, phi):
    """Angle and three derivatives, (4, n), at one crank angle per design."""
    columns = mechanism.poses(designs, Angles.of(phi[:, None]), frozenset(ORDERS))
    return np.stack([np.asarray(columns[name], np.float64)[:, 0] for name in ORDERS])


def long_couplers():
    rows = [row for row in oracle.read(FOLDER, "rssr") if row["kind"] == "hard_long_coupler" and row["feasible"]]
    return rows, np.array([[row[name] for name in NAMES] for row in rows]), np.array([row["phi"] for row in rows])


def errors(rows, got):
    """Error of psi in units of 2^-53 (not of the condition number)."""
    with mp.workdps(40):
        return np.array(
            [float(abs(mp.sin(mpf(float(g)) - mpf(row["psi"])))) / UNIT for g, row in zip(got, rows, strict=True)]
        )


def test_long_couplers_of_the_table_lose_nothing():
    rows, designs, phi = long_couplers()
    plain, exact = (errors(rows, motion(mechanism, designs, phi)[0]) for mechanism in (PLAIN, PRECISE))
    assert plain.max() > 1e5
    assert exact.max() < 4.0


def test_evaluate_is_the_precise_one():
    _, designs, phi = long_couplers()
    table = dict(zip(("a", "b", "c", "e", "f", "g", "alpha", "branch"), designs.T, strict=True)) | {"phi": phi}
    for wanted in (["psi"], ["psi", "theta1"]):
        found = sweep.evaluate("rssr", table, wanted)
        np.testing.assert_array_equal(found["psi"], motion(PRECISE, designs, phi)[0])
    chained = {f"{name}{k}": column for name, column in table.items() if name != "phi" for k in (1, 2)}
    first = sweep.evaluate(["rssr", "rssr"], chained | {"phi": phi}, ["psi1"])
    np.testing.assert_array_equal(first["psi1"], motion(PRECISE, designs, phi)[0])


@pytest.mark.parametrize("coupler", [1e-3, 1e-2, 1e-1])
def test_short_couplers_keep_every_digit(coupler):
    """Crank and rocker nearly alike and nearly coaxial: plain arithmetic loses the square of the coupler's length."""
    r = np.random.default_rng(int(1000 * coupler))
    n = 40
    c, phi, off = 1.0 + coupler * r.uniform(-0.3, 0.3, n), r.uniform(0.0, 6.0, n), coupler * r.uniform(0.3, 0.6, n)
    e, f, g = coupler * r.uniform(-0.2, 0.2, (3, n))
    pin = np.array(
        [np.cos(phi), f * np.sin(coupler) + np.cos(coupler) * np.sin(phi), f - np.sin(coupler) * np.sin(phi)]
    )
    psi = phi + off
    b = np.linalg.norm(pin - [e + c * np.cos(psi), c * np.sin(psi), g], axis=0)
    designs = np.column_stack([np.ones(n), b, c, e, f, g, np.full(n, coupler), np.ones(n)])
    for mechanism, bound in ((PRECISE, 0.5 / coupler), (PLAIN, None)):
        got, worst = motion(mechanism, designs, phi), 0.0
        for k, design in enumerate(designs):
            exact = transfer_functions(design, phi[k])
            size = max(abs(float(y)) for y in exact[1:])
            worst = max(worst, *(abs(float(y - g)) / (UNIT * size) for y, g in zip(exact[1:], got[1:, k], strict=True)))
        if bound is not None:
            assert worst < 8.0 + 8.0 * bound
        elif coupler < 0.01:
            assert worst > 1e3 / coupler


def test_both_kernels_agree_on_ordinary_poses():
    designs, angles = random_designs(300, 30), Angles.of(PHI)
    plain, exact = (mechanism.poses(designs, angles, WANTED) for mechanism in (PLAIN, PRECISE))
    np.testing.assert_array_equal(plain["status"], exact["status"])
    assert np.unique(exact["status"]).size > 1
    mild = np.nan_to_num(plain["pressure_angle"], nan=2.0) < 1.4
    for name in RSSR.pose_names:
        np.testing.assert_array_equal(np.isnan(plain[name]), np.isnan(exact[name]), err_msg=name)
        np.testing.assert_allclose(plain[name][mild], exact[name][mild], rtol=1e-11, atol=1e-11, err_msg=name)


def test_dead_points_and_a_pin_on_the_axis_keep_their_status():
    flat = [1.0, 2.0, 1.5, 4.5, 0.0, 0.0, 0.0, 1.0]  # crank turned away: crank, coupler and rocker stretched to 4.5
    on_axis = [1.0, 1.5, 1.5, 1.0, 0.0, 0.0, 0.0, 1.0]
    broken = [1.0, 2.0, np.inf, 4.5, 0.0, 0.0, 0.0, 1.0]
    columns = PRECISE.poses(np.array([flat, on_axis, broken]), Angles.of(np.array([[0.0, 3.0]])), WANTED)
    assert columns["status"].tolist() == [
        [st.DEAD_POINT, st.NOT_ASSEMBLED],
        [st.SINGULAR, st.OK],
        [st.INVALID_INPUT, st.INVALID_INPUT],
    ]
    assert np.isnan(columns["dpsi"][0, 0])


@pytest.mark.parametrize("branch", [1.0, -1.0])
def test_an_angle_of_pi_is_never_minus_pi(branch):
    """In (-pi, pi], as documented: at a dead point, where no rounding hides the sign of zero, and at a limit."""
    flat = np.array([[1.0, 2.0, 1.5, 4.5, 0.0, 0.0, 0.0, branch]])
    for mechanism in (PLAIN, PRECISE):
        columns = mechanism.poses(flat, Angles.of(np.zeros((1, 1))), WANTED)
        assert columns["psi"][0, 0] == np.pi == np.arctan2(columns["sin_psi"][0, 0], columns["cos_psi"][0, 0])
    drawing = {"a": 1.0, "b": 13.0, "c": 20.0, "e": 26.0, "f": 12.0 * branch, "g": 0.0, "alpha": np.pi / 2.0}
    frame = sweep.summarise("rssr", drawing | {"branch": branch}, ["psi_ext", "phi_ext"])
    assert frame["psi_ext"][0] == np.pi
    assert frame["phi_ext"][0] < 1e-15


def test_dead_points_made_in_float64_are_dead_points():
    """A coupler computed for the stretched position is off by a few roundings; what is off by more is decided."""
    r = np.random.default_rng(3)
    n = 2000
    a, c = r.uniform(0.1, 2.0, (2, n))
    e, f, g = r.uniform(-3.0, 3.0, (3, n))
    alpha, phi = r.uniform(-3.0, 3.0, n), r.uniform(0.0, 6.0, n)
    x, y = a * np.cos(phi) - e, f * np.sin(alpha) + a * np.cos(alpha) * np.sin(phi)
    z = f * np.cos(alpha) - a * np.sin(alpha) * np.sin(phi) - g
    stretched = np.hypot(c + np.hypot(x, y), z)
    for factor, wanted, share in ((1.0, st.DEAD_POINT, 0.98), (1.0 + 1e-13, st.NOT_ASSEMBLED, 0.9)):
        designs = np.column_stack([a, stretched * factor, c, e, f, g, alpha, np.ones(n)])
        status = PRECISE.poses(designs, Angles.of(phi[:, None]), frozenset({"psi"}))["status"]
        assert (status == wanted).mean() > share


@pytest.mark.parametrize("exponent", [-300, -20, 1, 60, 250])
def test_scaling_by_a_power_of_two_changes_no_bit(exponent):
    designs = random_designs(200, 31)
    scaled = designs.copy()
    scaled[:, :6] = np.ldexp(designs[:, :6], exponent)
    here, there = (PRECISE.poses(d, Angles.of(PHI), WANTED) for d in (designs, scaled))
    for name in ("status", "psi", "dpsi", "d2psi", "d3psi", "sin_psi", "cos_psi", "pressure_angle"):
        np.testing.assert_array_equal(there[name], here[name], err_msg=name)
    for name in ("x_b", "y_b", "z_b", "x_c", "y_c", "z_c"):
        np.testing.assert_array_equal(there[name], np.ldexp(here[name], exponent), err_msg=name)


def test_mirroring_swaps_the_branch_and_changes_no_bit():
    designs = random_designs(200, 32)
    mirrored = designs * np.array([1, 1, 1, 1, 1, 1, -1, -1])
    here, there = PRECISE.poses(designs, Angles.of(PHI), WANTED), PRECISE.poses(mirrored, Angles.of(-PHI), WANTED)
    for name, sign in (("psi", -1), ("dpsi", 1), ("d2psi", -1), ("d3psi", 1), ("cos_psi", 1), ("discriminant", 1)):
        np.testing.assert_array_equal(there[name], sign * here[name], err_msg=name)


def test_what_is_not_wanted_changes_no_bit_and_plain_python_agrees():
    designs, angles = random_designs(20, 33), Angles.of(PHI)
    everything = PRECISE.poses(designs, angles, WANTED)
    for name in ("psi", "d2psi", "z_b"):
        np.testing.assert_array_equal(PRECISE.poses(designs, angles, frozenset({name}))[name], everything[name])
    constants, python = np.empty((20, rssr.PRECISE_COLUMNS)), np.empty((20, rssr.PRECISE_COLUMNS))
    rssr.precise_constants(designs, constants)
    rssr.precise_constants.py_func(designs, python)
    np.testing.assert_array_equal(constants, python)
    out, status = {name: np.empty((20, 11)) for name in RSSR.pose_names}, np.empty((20, 11), np.uint8)
    rssr.precise_poses.py_func(constants, designs, angles.cos, angles.sin, status, rssr.Outputs(**out))
    for name, column in out.items():
        np.testing.assert_allclose(column, everything[name], rtol=2.0**-50, err_msg=name)


@pytest.mark.parametrize("which", [3, 4, 5])
def test_constant_is_that_of_rational_arithmetic(which):
    """Parallel axes make K rational, so it can be compared with fractions, whatever cancels."""
    designs = crank_rockers(200, which)
    designs[:, 6] = 0.0
    designs[:, which] *= 1e6
    length = np.abs(designs[:, 4] - designs[:, 5]) if which > 3 else np.abs(designs[:, 3])
    designs[:, 1] = length * (1.0 + 1e-9)
    constants = np.empty((len(designs), rssr.PRECISE_COLUMNS))
    rssr.precise_constants(designs, constants)
    for design, row in zip(designs, constants, strict=True):
        a, b, c, e, f, g = (Fraction(float(x)) for x in design[:6])
        exact = (a * a - b * b + c * c + e * e + (f - g) ** 2) / (2 * a * c)
        got = Fraction(float(row[precise.K0])) + Fraction(float(row[precise.K0 + 1]))
        terms = (b * b + e * e + (f - g) ** 2) / (a * c)
        assert abs(got - exact) <= 16 * Fraction(2) ** -104 * terms
