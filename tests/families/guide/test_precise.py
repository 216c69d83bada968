"""``evaluate`` computes the guided four-bar in twice the working precision; plain arithmetic is the control."""

import numpy as np
import pytest
from mpmath import mp, mpf

import sweep
from kernels.families import guide
from kernels.families.guide import motion
from sweep.families import family
from sweep.families.base import Angles
from tests.reference.guide import outputs
from tests.support.turn_designs import guided_four_bars

UNIT = 2.0**-53
PLAIN, PRECISE = family("guide"), family("guide").precise()
WANTED = frozenset(PLAIN.pose_names)
MOTION = ("s", "ds", "d2s", "d3s", "dev", "ddev", "d2dev")
PHI = np.linspace(0.0, 6.0, 11)[None]


def short_couplers(coupler, n, seed):
    """Crank and rocker nearly alike and nearly coaxial, one nearly above the other."""
    r = np.random.default_rng(seed)
    phi, off = r.uniform(0.0, 6.0, n), coupler * r.uniform(0.3, 0.6, n)
    c, e = 1.0 + coupler * r.uniform(-0.3, 0.3, n), coupler * r.uniform(-0.2, 0.2, n)
    d = e + c * np.exp(1j * (phi + off)) - np.exp(1j * phi)
    point = coupler * r.uniform(-1.0, 1.0, (2, n))
    return np.column_stack([np.ones(n), np.abs(d), c, e, *point, r.uniform(-3.0, 3.0, (2, n)).T, np.ones(n)]), phi


@pytest.mark.parametrize("coupler", [1e-3, 1e-1])
def test_short_couplers_keep_every_digit(coupler):
    designs, phi = short_couplers(coupler, 12, 5)
    exact = [outputs(tuple(design), angle) for design, angle in zip(designs, phi, strict=True)]
    for mechanism, largest in ((PRECISE, 8.0 + 4.0 / coupler), (PLAIN, None)):
        got, worst = mechanism.poses(designs, Angles.of(phi[:, None]), frozenset(MOTION)), 0.0
        for k, row in enumerate(exact):
            size = max(abs(float(y)) for y in row.values())
            with mp.workdps(40):
                errors = [abs(float(mpf(float(got[name][k, 0])) - y)) for name, y in row.items()]
            worst = max(worst, max(errors) / (UNIT * size))
        if largest is not None:
            assert worst < largest
        elif coupler < 0.01:
            assert worst > 3.0 * (8.0 + 4.0 / coupler)


def test_evaluate_is_the_precise_one_alone_and_at_the_end_of_a_chain():
    designs, angles = guided_four_bars(20, 4), Angles.of(PHI)
    table = dict(zip(PLAIN.parameter_names, designs.T, strict=True))
    frame = sweep.evaluate("guide", table, list(MOTION), phi=PHI[0])
    found = PRECISE.poses(designs, angles, frozenset(MOTION))
    for name in MOTION:
        np.testing.assert_array_equal(frame[name], found[name].ravel(), err_msg=name)
    assert family(["rssr", "guide"]).precise().stages[1].family.poses is PRECISE.poses


def test_both_kernels_agree_on_ordinary_poses():
    designs, angles = guided_four_bars(300, 1), Angles.of(PHI)
    plain, exact = (mechanism.poses(designs, angles, WANTED) for mechanism in (PLAIN, PRECISE))
    np.testing.assert_array_equal(plain["status"], exact["status"])
    assert np.unique(exact["status"]).size > 1
    mild = np.nan_to_num(plain["pressure_angle"], nan=2.0) < 1.4
    for name in PLAIN.pose_names:
        np.testing.assert_array_equal(np.isnan(plain[name]), np.isnan(exact[name]), err_msg=name)
        np.testing.assert_allclose(plain[name][mild], exact[name][mild], rtol=1e-11, atol=1e-11, err_msg=name)


@pytest.mark.parametrize("exponent", [-300, -20, 1, 60, 199])
def test_scaling_by_a_power_of_two_changes_no_bit(exponent):
    designs, names = guided_four_bars(100, 2), [n for n in PLAIN.pose_names if n != "discriminant"]
    scaled = designs.copy()
    scaled[:, [0, 1, 2, 3, 4, 5, 7]] = np.ldexp(designs[:, [0, 1, 2, 3, 4, 5, 7]], exponent)
    here, there = (PRECISE.poses(d, Angles.of(PHI), WANTED) for d in (designs, scaled))
    for name in names:
        factor = 0 if name == "pressure_angle" else exponent
        np.testing.assert_array_equal(there[name], np.ldexp(here[name], factor), err_msg=name)


def test_computing_less_changes_no_bit_and_plain_python_agrees():
    designs, angles = guided_four_bars(15, 3), Angles.of(PHI)
    everything = PRECISE.poses(designs, angles, WANTED)
    for name in ("dev", "d3s", "x_m"):
        np.testing.assert_array_equal(PRECISE.poses(designs, angles, frozenset({name}))[name], everything[name])
    status, joints = np.empty((15, 11), np.uint8), np.empty((6, 15, 11))
    values = [np.empty((15, 11)) for _ in PLAIN.pose_names[:9]]
    guide.precise_poses.py_func(designs, angles.cos, angles.sin, status, motion.Outputs(*values, joints))
    np.testing.assert_array_equal(status, everything["status"])
    for name, column in zip(PLAIN.pose_names[:15], [*values, *joints], strict=True):
        np.testing.assert_allclose(column, everything[name], rtol=2.0**-50, err_msg=name)
