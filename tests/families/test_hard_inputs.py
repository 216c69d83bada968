"""Inputs at and beyond the edge: a status, never a plausible number, never an exception from a kernel, never a hang.

Everything goes to the family's own functions, below the checks of tables, as a sweep or an optimiser would send it.
"""

from __future__ import annotations

import itertools
import math

import numpy as np
import pytest

from kernels import status as st
from sweep.evaluation.summaries import design_outputs, summarise
from sweep.families import family
from sweep.families.base import Accuracy, Angles
from tests.support.sixty_digits import condition, transfer_functions

RSSR = family("rssr")
ORDINARY = np.array([0.5, 3.0, 2.0, 2.5, 0.7, -0.4, 0.9, 1.0])
PHI = np.linspace(0.0, 2.0 * math.pi, 25)[None, :]
POSES = ("psi", "dpsi", "d2psi", "d3psi", "pressure_angle", "x_c", "y_c")
TURN = ("rotatable", "margin", "max_pressure_angle", "max_abs_dpsi", "max_abs_d2psi", "max_abs_d3psi", "swing", "phi0")
LENGTHS = range(6)


def poses(designs, phi=PHI):
    return RSSR.poses(np.atleast_2d(designs), Angles.of(phi), frozenset(POSES))


FINE = Accuracy(target=1e-8)


def summary(designs, accuracy=FINE):
    return design_outputs(RSSR, np.atleast_2d(designs), TURN, accuracy)


def explained(columns, names):
    """Whether every nan stands beside a status that is not OK."""
    bad = np.zeros(columns["status"].shape, bool)
    for name in names:
        bad |= np.isnan(np.asarray(columns[name], float))
    return bool((columns["status"][bad] != st.OK).all())


def changed(column, value):
    design = ORDINARY.copy()
    design[column] = value
    return design


IMPOSSIBLE = [(k, v) for k, v in itertools.product(range(8), (math.nan, math.inf, -math.inf))]
IMPOSSIBLE += [(k, v) for k, v in itertools.product((0, 1, 2), (0.0, -0.0, -1.0, 5e-324))]
IMPOSSIBLE += [(7, v) for v in (0.0, 0.5, 2.0)]


@pytest.mark.parametrize(("column", "value"), IMPOSSIBLE)
def test_impossible_parameters_give_invalid_input_or_no_assembly(column, value):
    design = changed(column, value)
    for accuracy in (Accuracy(target=1e-8), Accuracy(samples=64)):
        found = summary(design, accuracy)
        assert found["status"][0] in (st.INVALID_INPUT, st.NOT_ROTATABLE)
        assert np.isnan(np.asarray(found["max_abs_d2psi"], float)).all()
    columns = poses(design)
    # a crank or rocker of 5e-324 is a length, too short for any reciprocal
    assert np.isin(columns["status"], (st.INVALID_INPUT, st.NOT_ASSEMBLED)).all()
    assert all(np.isnan(columns[name]).all() for name in ("psi", "dpsi", "d2psi", "d3psi", "pressure_angle"))


@pytest.mark.parametrize("phi", [math.nan, math.inf, -math.inf])
def test_a_crank_angle_that_is_no_number_gives_invalid_input(phi):
    with np.errstate(invalid="ignore"):
        columns = poses(ORDINARY, np.array([[phi, 0.5]]))
    assert columns["status"][0, 0] == st.INVALID_INPUT
    assert columns["status"][0, 1] == st.OK
    assert np.isnan(columns["psi"][0, 0])


@pytest.mark.parametrize("exponent", [-332, -200, -60, 60, 200, 332])  # 1e-100 ... 1e100
def test_scales_keep_every_bit(exponent):
    scaled = ORDINARY.copy()
    scaled[:6] = np.ldexp(ORDINARY[:6], exponent)
    plain, big = poses(ORDINARY), poses(scaled)
    for name in ("psi", "dpsi", "d2psi", "d3psi", "pressure_angle", "status"):
        np.testing.assert_array_equal(plain[name], big[name])
    for accuracy in (Accuracy(target=1e-8), Accuracy(samples=64)):
        plain, big = summary(ORDINARY, accuracy), summary(scaled, accuracy)
        for name in (*TURN, "status"):
            np.testing.assert_array_equal(plain[name], big[name], err_msg=name)


@pytest.mark.parametrize("exponent", [-1060, -1000, 1000, 1020])
def test_scales_beyond_the_range_keep_every_bit_or_say_so(exponent):
    scaled = ORDINARY.copy()
    scaled[:6] = np.ldexp(ORDINARY[:6], exponent)
    columns = poses(scaled)
    if (columns["status"] == st.OK).all() and exponent > -1060:
        np.testing.assert_array_equal(columns["psi"], poses(ORDINARY)["psi"])
    else:
        # denormal lengths have lost digits: those that are left are computed with, and the rest is not made up
        assert explained(columns, ("psi", "d3psi"))
        ok = columns["status"] == st.OK
        near = np.abs(np.sin(columns["psi"] - poses(ORDINARY)["psi"])) < 1e-2
        assert (near | ~ok).all()


@pytest.mark.parametrize(("column", "value"), [(k, v) for k in (3, 4, 5) for v in (0.0, -0.0, 5e-324, -1e-310)])
def test_denormal_and_zero_offsets_are_offsets_of_zero(column, value):
    np.testing.assert_array_equal(poses(changed(column, value))["psi"], poses(changed(column, 0.0))["psi"])


def test_one_length_far_beyond_the_others_never_reaches():
    for column in range(6):
        for size in (1e20, 1e100, 1e150, 1e300):
            for design in (changed(column, size), changed(column, size) * np.array([1e-300] * 6 + [1, 1])):
                columns, found = poses(design), summary(design)
                assert not (columns["status"] == st.OK).any(), (column, size)
                assert found["status"][0] != st.OK
                assert np.isnan(columns["psi"][columns["status"] == st.NOT_ASSEMBLED]).all()


def test_crank_pin_on_the_rocker_axis_is_singular():
    # alpha = 0, e = a: at phi = 0 the pin stands on the axis; b^2 = c^2 + (f - g)^2 lets any angle close the loop.
    design = np.array([1.0, 2.5, 2.0, 1.0, 1.5, 0.0, 0.0, 1.0])
    columns = poses(design, np.array([[0.0, 0.5]]))
    assert columns["status"][0, 0] == st.SINGULAR
    assert np.isnan(columns["psi"][0, 0]) and np.isnan(columns["dpsi"][0, 0])
    assert columns["status"][0, 1] == st.OK
    assert summary(design)["status"][0] != st.OK


def test_crank_pin_on_the_rocker_axis_without_closure_does_not_reach():
    design = np.array([1.0, 2.6, 2.0, 1.0, 1.5, 0.0, 0.0, 1.0])
    columns = poses(design, np.array([[0.0]]))
    assert columns["status"][0, 0] == st.NOT_ASSEMBLED


@pytest.mark.parametrize("branch", [1.0, -1.0])
def test_an_exact_dead_point_keeps_its_angle_and_has_no_derivatives(branch):
    # Planar: a = 1, e = 4 at phi = 0 leaves 3 = b + c: coupler and rocker in line, psi = pi.
    columns = poses([1.0, 2.0, 1.0, 4.0, 0.0, 0.0, 0.0, branch], np.array([[0.0]]))
    assert columns["status"][0, 0] == st.DEAD_POINT
    assert abs(abs(columns["psi"][0, 0]) - math.pi) < 1e-15
    assert columns["pressure_angle"][0, 0] == pytest.approx(math.pi / 2, abs=1e-15)
    assert all(np.isnan(columns[name][0, 0]) for name in ("dpsi", "d2psi", "d3psi"))


def test_exact_change_points_are_undecidable():
    # a + e = b + c, and b + e = a + c: the margin is exactly zero, on either side of which the verdict differs.
    for a, b, c, e in ((1.0, 2.0, 3.0, 4.0), (1.0, 4.0, 2.0, 5.0), (1.0, 3.0, 4.0, 2.0), (2.0, 3.0, 3.0, 2.0)):
        found = summary([a, b, c, e, 0.0, 0.0, 0.0, 1.0])
        assert found["status"][0] in (st.UNDECIDABLE, st.SINGULAR), (a, b, c, e)
        assert np.isnan(found["max_abs_d2psi"]).all()
        assert abs(float(found["margin"][0])) < 1e-14


@pytest.mark.parametrize("branch", [1.0, -1.0])
def test_coupler_parallel_to_the_rocker_axis_is_a_dead_point(branch):
    # Planar, phi = 0: the pin at (1, 0, 1.5) above the ball at (1, 0, 0); no force of the coupler turns the rocker.
    design = np.array([1.0, 1.5, 1.0, 2.0, 1.5, 0.0, 0.0, branch])
    columns = poses(design, np.array([[0.0, 1e-3]]))
    assert columns["status"].tolist() == [[st.DEAD_POINT, st.NOT_ASSEMBLED]]
    assert abs(columns["psi"][0, 0]) == pytest.approx(math.pi, abs=1e-15)
    assert columns["pressure_angle"][0, 0] == pytest.approx(math.pi / 2, abs=1e-15)
    assert all(np.isnan(columns[name][0, 0]) for name in ("dpsi", "d2psi", "d3psi"))
    assert explained(columns, POSES)
    assert summary(design)["status"][0] in (st.NOT_ROTATABLE, st.UNDECIDABLE)


def test_coupler_parallel_to_the_crank_axis_is_no_trouble_for_the_motion():
    # Joints first: the ball stands on the line through the crank pin along the crank axis.
    a, f, b, alpha, phi, psi = 0.5, 0.3, 2.0, 0.9, 0.7, 1.1
    sa, ca = math.sin(alpha), math.cos(alpha)
    pin = np.array([a * math.cos(phi), f * sa + a * ca * math.sin(phi), f * ca - a * sa * math.sin(phi)])
    ball = pin + b * np.array([0.0, sa, ca])
    c = ball[1] / math.sin(psi)
    design = np.array([a, b, c, ball[0] - c * math.cos(psi), f, ball[2], alpha, 1.0])
    columns = poses(design, np.array([[phi]]))
    assert columns["status"][0, 0] == st.OK
    exact, cond = transfer_functions(design, phi), condition(design, phi)
    assert float(exact[0]) == pytest.approx(psi, abs=1e-14)
    for order, name in enumerate(("psi", "dpsi", "d2psi", "d3psi")):
        size = max(*cond[: order + 1], abs(float(exact[order])))
        assert abs(columns[name][0, 0] - float(exact[order])) <= 8.0 * 2.0**-53 * size, name


def test_random_bit_patterns_never_raise_and_every_nan_is_explained():
    """Any 64 bits as parameters: signalling nothing, finishing, and a status beside every nan."""
    bits = np.random.default_rng(11).integers(0, 2**64, (4000, 8), dtype=np.uint64)
    designs = bits.view(np.float64).copy()
    designs[:, 7] = np.where(bits[:, 7] % 2 == 0, 1.0, -1.0)
    designs[:2000, 6] = np.random.default_rng(12).uniform(-4.0, 4.0, 2000)
    designs[:2000, :3] = np.abs(designs[:2000, :3])
    columns = poses(designs)
    assert explained(columns, ("psi", "dpsi", "d2psi", "d3psi", "pressure_angle"))
    for accuracy in (Accuracy(target=1e-6), Accuracy(samples=32)):
        found = summary(designs, accuracy)
        assert explained(found, ("max_abs_d2psi", "swing", "max_pressure_angle"))


def test_extreme_ratios_never_hang():
    """Lengths over thirty decades: far more than any drawing; each design answers or says why not."""
    generator = np.random.default_rng(13)
    designs = 10.0 ** generator.uniform(-15.0, 15.0, (3000, 8))
    designs[:, 3:6] *= generator.choice([-1.0, 0.0, 1.0], (3000, 3))
    designs[:, 6] = generator.uniform(-math.pi, math.pi, 3000)
    designs[:, 7] = generator.choice([-1.0, 1.0], 3000)
    found = summary(designs)
    assert explained(found, ("max_abs_d2psi", "swing", "max_pressure_angle"))


def test_the_table_interface_refuses_what_is_no_number():
    from sweep.errors import InputError

    good = {"a": 0.5, "b": 3.0, "c": 2.0, "e": 2.5, "f": 0.7, "g": -0.4, "alpha": 0.9}
    for name, value in (("a", math.nan), ("e", math.inf), ("b", 0.0), ("c", -2.0), ("alpha", "steep")):
        with pytest.raises(InputError, match=name):
            summarise("rssr", good | {name: value}, "margin")
