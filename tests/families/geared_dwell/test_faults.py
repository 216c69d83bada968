"""What the geared dwell drive says where it has no value: status and nan together, never one without the other."""

from __future__ import annotations

import numpy as np
import pytest

import sweep
from kernels import status as st
from sweep.errors import InputError
from sweep.families.base import Accuracy
from tests.families.geared_dwell.test_oracle import step

DWELL = ["dwell_angle", "dwell_deviation", "dwell_band"]
MAXIMA = ["max_abs_dpsi", "max_abs_d2psi", "max_abs_d3psi"]
VALUES = ["psi", "dpsi", "d2psi", "d3psi", "sin_psi", "cos_psi", "x_b", "y_b"]


def evaluate(k, a, phi):
    return sweep.evaluate("geared_dwell", {"k": k, "a": a}, VALUES, phi=phi)


@pytest.mark.parametrize(
    ("k", "a", "phi"),
    [(2.0, 0.0, 0.0), (1.25, -0.75, 0.0), (1.5, 3.5, np.pi), (1.25, -1.25, np.arccos(0.8)), (1.0, -1.0, 0.0)],
)
def test_pin_on_the_output_axis_is_singular_there_and_regular_beside(k, a, phi):
    frame = evaluate(k, a, [phi, phi + 1e-3])
    # The double nearest to pi is not pi: the pin is 6e-16 from the axis, on it within the rounding of phi.
    assert list(frame.status) == [st.SINGULAR, st.OK]
    assert frame[VALUES].iloc[0].isna().all()
    assert np.isfinite(frame[VALUES].iloc[1]).all()


def test_pin_passing_the_axis_at_1e_9_is_not_called_singular():
    frame = evaluate(1.5, 3.5 - 2.0**-30, [np.pi])
    assert frame.status[0] == st.OK
    assert frame.dpsi[0] == pytest.approx(2.0 * 2.5 * 2.0**30, rel=1e-11)


@pytest.mark.parametrize(("k", "a"), [(2.0, 0.0), (1.5, 3.5), (1.25, -1.25), (1.0, -1.0)])
def test_singular_designs_have_no_maxima_whatever_the_grid(k, a):
    for name, accuracy in (("stationary points", Accuracy(target=1e-8)), ("grid", Accuracy(samples=361))):
        got = step(name, [(k, a)], MAXIMA, accuracy)
        assert got["status"][0] == st.SINGULAR
        assert all(np.isnan(got[output][0]) for output in MAXIMA)


def test_uniform_motion_below_unit_pin_distance_is_no_singularity():
    got = step("stationary points", [(0.6, -0.6)], MAXIMA)
    assert got["status"][0] == st.OK
    assert [got[output][0] for output in MAXIMA] == [1.0, 0.0, 0.0]


@pytest.mark.parametrize(("k", "a", "turns"), [(1.5, 4.0, 0), (1.5, -2.0, 0), (2.75, 0.25, 2), (0.5, -1.8, 0)])
def test_output_that_does_not_turn_once_has_no_dwell_but_its_turns_and_maxima(k, a, turns):
    got = step("dwell", [(k, a)], [*DWELL, "turns"])
    assert got["status"][0] == st.NO_DWELL
    assert all(np.isnan(got[output][0]) for output in DWELL)
    assert got["turns"][0] == turns
    assert step("dwell", [(k, a)], ["turns"])["status"][0] == st.OK
    assert step("stationary points", [(k, a)], MAXIMA)["status"][0] == st.OK


@pytest.mark.parametrize("k", [0.4, 1.0])
def test_pin_that_never_turns_back_has_no_dwell_angle(k):
    got = step("dwell", [(k, 0.5)], DWELL)
    assert got["status"][0] == st.OK
    assert [got[output][0] for output in DWELL] == [0.0, 0.0, 0.0]


@pytest.mark.parametrize("design", [(0.0, 0.5), (-1.0, 0.5), (np.nan, 0.5), (1.5, np.inf), (1.5, np.nan), (1e31, 0.0)])
def test_kernels_answer_bad_numbers_with_a_status(design):
    for name, wanted, accuracy in (
        ("dwell", DWELL, Accuracy(target=1e-8)),
        ("stationary points", MAXIMA, Accuracy(target=1e-8)),
        ("grid", MAXIMA, Accuracy(samples=64)),
    ):
        got = step(name, [design], wanted, accuracy)
        assert got["status"][0] == st.INVALID_INPUT
        assert all(np.isnan(got[output][0]) for output in wanted)


def test_evaluate_names_column_row_and_allowed_value():
    with pytest.raises(InputError, match=r"column k, row 1: k = -2.0; allowed: a positive ratio"):
        sweep.evaluate("geared_dwell", {"k": [1.4, -2.0], "a": [0.0, 0.0]}, "psi", phi=0.0)
    with pytest.raises(InputError, match="did you mean 'a'"):
        sweep.evaluate("geared_dwell", {"k": 1.4, "A": 0.0}, "psi", phi=0.0)
