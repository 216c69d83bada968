"""Sine and cosine to the last bit, against 40 digits and next to the C library."""

from __future__ import annotations

import math

import mpmath
import numpy as np
import pytest

from kernels import status as st
from kernels.arithmetic.sincos import rounded_sincos
from kernels.jit import kernel
from sweep.evaluation.summaries import design_outputs
from sweep.evaluation.tables import design_matrix
from sweep.families.base import Accuracy
from sweep.study.load import load_study
from tests.support.engine_study import ROOT


@kernel
def both(x, sine, cosine):
    for i in range(x.size):
        sine[i], cosine[i] = rounded_sincos(x[i])


OUTPUTS = ["max_abs_d2s", "max_abs_dev", "max_x_m2"]


def sines(x):
    sine, cosine = np.empty_like(x), np.empty_like(x)
    both(x, sine, cosine)
    return sine, cosine


def misses(got, of, x):
    """Errors in units of the last place of the nearest number, and how many are not that number."""
    with mpmath.workdps(40):
        exact = [of(mpmath.mpf(y)) for y in x]
        nearest = np.array([float(y) for y in exact])
        off = np.array([float(mpmath.mpf(a) - b) for a, b in zip(got, exact, strict=True)])
    return np.abs(off) / np.spacing(np.abs(nearest)), np.count_nonzero(got != nearest)


def test_sine_and_cosine_are_the_nearest_numbers_more_often_than_those_of_the_library():
    x = np.random.default_rng(7).uniform(-2.0 * math.pi, 2.0 * math.pi, 20_000)
    own = [misses(got, of, x)[1] for got, of in zip(sines(x), (mpmath.sin, mpmath.cos), strict=True)]
    library = [misses(got, of, x)[1] for got, of in ((np.sin(x), mpmath.sin), (np.cos(x), mpmath.cos))]
    assert sum(own) <= sum(library)
    assert sum(own) < 20  # of 40 000; 8 are expected


@pytest.mark.parametrize("most", [math.pi / 4, 1e5])
def test_sine_and_cosine_err_by_no_more_than_rounding_does(most):
    r = np.random.default_rng(8)
    near = np.arange(-40, 41) * (math.pi / 2)  # next to zeros, where all digits cancel
    tiny = r.choice([-1.0, 1.0], 99) * 10.0 ** r.uniform(-300, 0, 99)
    x = np.concatenate([r.uniform(-most, most, 2000), near, np.nextafter(near, 9e9), tiny])
    for got, of in zip(sines(x), (mpmath.sin, mpmath.cos), strict=True):
        assert misses(got, of, x)[0].max() < 0.513  # half a unit is what rounding must cost


def test_sine_and_cosine_of_what_is_no_angle_are_nan():
    sine, cosine = sines(np.array([math.nan, math.inf, -math.inf]))
    assert np.isnan(sine).all()
    assert np.isnan(cosine).all()


def test_sine_and_cosine_in_a_vector_are_those_of_one_angle():
    x = np.random.default_rng(9).uniform(-10.0, 10.0, 101)
    one_by_one = np.concatenate([sines(y[None]) for y in x], axis=1)
    np.testing.assert_array_equal(np.stack(sines(x)), one_by_one)


def drives(angles):
    """Needle drives whose line has these angles [rad]."""
    study = load_study(ROOT / "studies" / "needle208", smoke=True)
    (design,), _ = design_matrix(study.family, study.reference)
    designs = np.tile(design, (len(angles), 1))
    designs[:, study.family.parameter_names.index("lam2")] = angles
    return design_outputs(study.family, designs, OUTPUTS, Accuracy(target=1e-6))


@pytest.mark.parametrize("angle", [0.7, -3e4, 9e4])
def test_a_design_with_an_angle_of_many_turns_is_that_of_the_same_angle_within_one(angle):
    """A chain's search takes sine and cosine of its line's angle from here."""
    turns = angle + np.arange(9.0)
    one, other = drives(turns), drives(np.arctan2(np.sin(turns), np.cos(turns)))
    for name in OUTPUTS:
        # an angle within a turn is rounded to 2e-16 of it; what that moves is measured by the size of the drive
        np.testing.assert_allclose(one[name], other[name], rtol=1e-12, atol=1e-13, err_msg=name)


def test_a_design_with_an_angle_beyond_what_is_exact_is_refused():
    found = drives(np.array([1.1e5, -1e7, math.inf]))
    assert (found["status"] == st.INVALID_INPUT).all()
    assert np.isnan([found[name] for name in OUTPUTS]).all()
