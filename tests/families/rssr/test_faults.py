"""Crank-rocker: what float64 cannot hold or the geometry does not have gets a status, never a plausible number."""

import math

import numpy as np
import pytest

import sweep
from kernels import status as st
from kernels.families import rssr
from sweep.errors import InputError
from tests.support.rssr_designs import POSE_NAMES, limits, margins, maxima, poses, random_designs

GOOD = random_designs(1, 40, rotatable=True)[0]
PHI = np.linspace(0.0, 6.0, 9)[None]
BAD = [math.nan, math.inf, -math.inf]


def refused(design, code):
    """Every kernel gives this status and nan."""
    design = np.asarray(design, dtype=float)[None]
    motion, margin, turn = poses(design, PHI), margins(design), limits(design)
    assert set(motion["status"].ravel()) == {code}
    for name in ("psi", "dpsi", "d2psi", "d3psi", "sin_psi", "cos_psi", "pressure_angle", "x_c", "y_c"):
        assert np.isnan(motion[name]).all(), name
    assert margin["status"][0] == turn["status"][0] == code
    assert np.isnan([turn[name][0] for name in rssr.LIMIT_NAMES]).all()
    for order in (1, 2, 3):
        found = maxima(design, order)
        assert found["status"][0] == code
        assert np.isnan([found[name][0] for name in ("max", "phi", "error", "phi_error")]).all()
    return margin


@pytest.mark.parametrize("value", [*BAD, 0.0, -1.0, -5e-324])
@pytest.mark.parametrize("column", [0, 1, 2])
def test_impossible_lengths_are_invalid(column, value):
    design = GOOD.copy()
    design[column] = value
    margin = refused(design, st.INVALID_INPUT)
    assert np.isnan(
        [margin[name][0] for name in ("margin", "rotatable", "max_pressure_angle", "phi_min", "error")]
    ).all()


def test_a_coupler_of_hardly_any_length_does_not_turn():
    design = GOOD.copy()
    design[1] = 5e-324
    assert set(poses(design[None], PHI)["status"].ravel()) == {st.NOT_ASSEMBLED}
    assert margins(design[None])["status"][0] == limits(design[None])["status"][0] == st.NOT_ROTATABLE


@pytest.mark.parametrize("value", BAD)
@pytest.mark.parametrize("column", [3, 4, 5, 6, 7])
def test_numbers_that_are_none_are_invalid(column, value):
    design = GOOD.copy()
    design[column] = value
    refused(design, st.INVALID_INPUT)


@pytest.mark.parametrize("branch", [0.0, 2.0, 0.5])
def test_a_branch_that_is_none_is_invalid(branch):
    design = GOOD.copy()
    design[7] = branch
    refused(design, st.INVALID_INPUT)


@pytest.mark.parametrize("scale", [1e-200, 1e-100, 1e-60, 1e60, 1e100, 1e150])
def test_any_common_scale_that_float64_holds_works(scale):
    designs = random_designs(50, 41, rotatable=True)
    scaled = designs.copy()
    scaled[:, :6] *= scale
    here, there = poses(designs, PHI), poses(scaled, PHI)
    assert np.all(there["status"] == st.OK)
    mild = here["pressure_angle"] < 1.4
    for name in ("psi", "dpsi", "d2psi", "d3psi"):
        np.testing.assert_allclose(there[name][mild], here[name][mild], rtol=1e-8, atol=1e-9)
    np.testing.assert_allclose(margins(scaled)["margin"], margins(designs)["margin"], atol=1e-12)
    assert np.all(maxima(scaled, 2)["status"] == st.OK)


@pytest.mark.parametrize("scale", [1e-320, 5e-324, 1e308])
def test_scales_at_the_ends_of_float64_get_a_status(scale):
    design = GOOD.copy()
    with np.errstate(over="ignore"):
        design[:6] *= scale
    for found in (poses(design[None], PHI), margins(design[None]), limits(design[None]), maxima(design[None], 2)):
        assert st.OK not in found["status"]


@pytest.mark.parametrize(("column", "value"), [(3, 1e200), (4, 1e200), (5, -1e200), (1, 1e200), (0, 1e-200), (6, 1e6)])
def test_lopsided_scales_get_a_status(column, value):
    design = GOOD.copy()
    design[column] = value
    for found in (poses(design[None], PHI), margins(design[None]), limits(design[None]), maxima(design[None], 2)):
        assert st.OK not in found["status"]


def test_a_pin_on_the_rocker_axis_is_singular():
    # a = e, phi = 0: the pin stands on the rocker axis; with b = c every rocker angle closes the loop.
    design = np.array([2.0, 3.0, 3.0, 2.0, 0.0, 0.0, 0.0, 1.0])
    found = poses(design[None], np.array([[0.0]]))
    assert found["status"][0, 0] == st.SINGULAR
    assert all(np.isnan(found[name][0, 0]) for name in ("psi", "dpsi", "sin_psi", "x_c"))
    design[1] = 2.5  # and with b != c none does
    assert poses(design[None], np.array([[0.0]]))["status"][0, 0] == st.NOT_ASSEMBLED


@pytest.mark.parametrize("branch", [-1.0, 1.0])
def test_an_exact_dead_point_keeps_its_angle_and_loses_its_derivatives(branch):
    # 3-4-5: pin at (0, 3), pivot at (4, 0), coupler 2 and rocker 3 in line between them.
    found = poses(np.array([[3.0, 2.0, 3.0, 4.0, 0.0, 0.0, 0.0, branch]]), np.array([[0.5 * math.pi]]))
    assert found["status"][0, 0] == st.DEAD_POINT
    assert found["psi"][0, 0] == pytest.approx(math.atan2(3.0, -4.0), abs=1e-15)
    assert found["pressure_angle"][0, 0] == pytest.approx(0.5 * math.pi, abs=1e-15)
    assert all(np.isnan(found[name][0, 0]) for name in ("dpsi", "d2psi", "d3psi"))


def test_parallelogram_is_undecidable():
    # Its links pass through one line: whether the crank turns is decided by the last bit.
    found = margins(np.array([[1.0, 3.0, 1.0, 3.0, 0.0, 0.0, 0.0, 1.0]]))
    assert found["status"][0] == st.UNDECIDABLE
    assert abs(found["margin"][0]) < 1e-15
    assert np.isnan(found["rotatable"][0])


def test_double_crank_turns_but_has_no_limit_positions():
    design = np.array([[3.0, 4.0, 3.5, 1.0, 0.0, 0.0, 0.0, 1.0]])
    assert margins(design)["status"][0] == st.OK
    found = limits(design)
    assert found["status"][0] == st.NOT_OSCILLATING
    assert np.isnan([found[name][0] for name in rssr.LIMIT_NAMES]).all()


def test_constant_discriminant_is_no_trouble():
    # e = 0, alpha = 0: the pin keeps its distance from the rocker axis, crank and rocker turn together.
    design = np.array([[2.0, 3.0, 4.0, 0.0, 1.0, 1.0, 0.0, 1.0]])
    assert margins(design)["status"][0] == st.OK
    assert limits(design)["status"][0] == st.NOT_OSCILLATING
    found = maxima(design, 1)
    assert found["status"][0] in (st.OK, st.NOT_CONVERGED)
    if found["status"][0] == st.OK:
        assert found["max"][0] == pytest.approx(1.0, abs=1e-14)
    np.testing.assert_allclose(poses(design, PHI)["dpsi"], 1.0, rtol=1e-14)


def test_nan_never_stands_without_a_status():
    designs = random_designs(400, 42)
    designs[::17, 3] = math.inf
    designs[5::19, 0] = 0.0
    motion = poses(designs, PHI)
    bad = np.isnan(motion["psi"])
    np.testing.assert_array_equal(bad, ~np.isin(motion["status"], [st.OK, st.DEAD_POINT]))
    for name in POSE_NAMES[1:4]:
        np.testing.assert_array_equal(np.isnan(motion[name]), motion["status"] != st.OK)
    for found in (limits(designs), maxima(designs, 2)):
        for name, column in found.items():
            np.testing.assert_array_equal(
                np.isnan(column.astype(float)) & (name != "status"),
                (found["status"] != st.OK) & (name != "status"),
                err_msg=name,
            )


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"a": -1.0}, ["a", "-1.0", "positive", "row 0"]),
        ({"b": math.nan}, ["b", "nan", "finite", "row 0"]),
        ({"branch": 0.0}, ["branch", "0.0", "row 0"]),
        ({"alfa": 1.0}, ["alfa", "alpha"]),
    ],
)
def test_the_interface_names_column_value_and_row(change, words):
    table = dict(zip(("a", "b", "c", "e", "f", "g", "alpha", "branch"), GOOD, strict=True)) | change
    if "alfa" in change:
        del table["alpha"]
    with pytest.raises(InputError) as raised:
        sweep.summarise("rssr", table, ["margin"])
    assert all(word in str(raised.value) for word in words)
