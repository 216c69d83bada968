"""Bare cam against scans of its edge: contact, several minima, contact lost, sticking and sliding.

Tolerances: a scan with golden sections finds y to the square root of rounding (1e-7), the length to rounding.
"""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as some

import sweep
from kernels import status as st
from tests.reference import thread as reference

CAM = {"a": 0.4, "X1": 0.83, "Y1": -2.08, "Z1": -3.56, "X2": 3.3, "Y2": -0.85, "Z2": 3.7}
TURN = 2.0 * np.pi * np.arange(360) / 360


def guides(cam):
    return tuple(cam[k] for k in ("X1", "Y1", "Z1")), tuple(cam[k] for k in ("X2", "Y2", "Z2"))


coordinate = some.floats(-3.0, 3.0)
depth = some.floats(0.3, 4.0)
cams = some.builds(
    lambda a, x1, y1, z1, x2, y2, z2: {"a": a, "X1": x1, "Y1": y1, "Z1": -z1, "X2": x2, "Y2": y2, "Z2": z2},
    some.floats(0.0, 0.9), coordinate, coordinate, depth, coordinate, coordinate, depth,
)  # fmt: skip


@settings(deadline=None, max_examples=40)
@given(cam=cams, phi=some.floats(-3.0, 3.0))
def test_contact_is_the_shortest_way_over_the_edge(cam, phi):
    got = sweep.thread.free_cam(cam | {"phi": phi}).iloc[0]
    assert got.contact == reference.passes_inside(cam["a"], phi, *guides(cam))
    y, length, minima = reference.shortest_over_edge(cam["a"], phi, *guides(cam))
    if got.contact:
        assert abs(got.L - length) <= 1e-14 * length
        assert got.y_contact == pytest.approx(y, abs=1e-6) or minima > 1
    else:
        assert math.dist(*guides(cam)) == pytest.approx(got.L, rel=1e-15)
        assert got.wrap == 0.0
    assert got.n_minima == minima


def test_derivatives_of_the_taken_up_thread_are_those_of_its_length():
    # Central differences of sixth order over poses that keep one contact.
    step = 1e-3
    for middle in (0.2, 5.2, 5.9):
        phi = middle + step * np.arange(-3, 4)
        got = sweep.evaluate("free_cam", CAM, ["P", "dP", "d2P", "contact", "y_contact"], phi=phi)
        assert (got.contact == 1.0).all() and np.ptp(got.y_contact) < 0.1
        slope = np.array([-1, 9, -45, 0, 45, -9, 1]) @ got.P.to_numpy() / (60.0 * step)
        bend = np.array([2, -27, 270, -490, 270, -27, 2]) @ got.P.to_numpy() / (180.0 * step * step)
        assert got.dP[3] == pytest.approx(slope, abs=1e-9)
        assert got.d2P[3] == pytest.approx(bend, abs=1e-6)


def test_thread_beside_the_cam_runs_straight_and_takes_up_nothing():
    got = sweep.evaluate("free_cam", CAM, ["P", "dP", "d2P", "L", "wrap", "contact", "X", "Y"], phi=[2.0, 3.0])
    assert (got.contact == 0.0).all() and (got.status == st.OK).all()
    np.testing.assert_array_equal(got[["dP", "d2P", "wrap"]], 0.0)
    one, two = guides(CAM)
    np.testing.assert_allclose(got.L, math.dist(one, two), rtol=1e-15)
    share = one[2] / (one[2] - two[2])
    np.testing.assert_allclose(got.X, one[0] + share * (two[0] - one[0]), rtol=1e-15)
    np.testing.assert_allclose(got.Y, one[1] + share * (two[1] - one[1]), rtol=1e-15)


def test_thread_length_is_continuous_where_contact_begins():
    got = sweep.evaluate("free_cam", CAM, ["L", "contact"], phi=np.linspace(4.0, 5.0, 4001))
    assert set(got.contact) == {0.0, 1.0}
    assert np.abs(np.diff(got.L)).max() < 1e-3


def test_straight_edge_bends_the_thread_as_in_the_unfolded_plane():
    # a = 0: by unfolding about the edge the shortest way is a straight line; the edge is x = 0, material x > 0.
    flat = {"a": 0.0, "X1": 1.0, "Y1": -2.0, "Z1": -3.0, "X2": 2.0, "Y2": 4.0, "Z2": 2.0}
    got = sweep.thread.free_cam(flat | {"phi": 0.0}).iloc[0]
    near, far = math.hypot(1.0, 3.0), math.hypot(2.0, 2.0)
    assert abs(got.L - math.hypot(near + far, 6.0)) <= 1e-14
    assert got.y_contact == pytest.approx(-2.0 + 6.0 * near / (near + far), rel=1e-15)
    assert got.n_minima == 1


@pytest.mark.parametrize("z2", [-1.0, 0.0])
def test_guides_on_one_side_of_the_cam_are_refused_by_status(z2):
    got = sweep.evaluate("free_cam", CAM | {"Z2": z2}, ["P", "contact"], phi=[0.0])
    assert got.status[0] == st.INVALID_INPUT
    assert got[["P", "contact"]].isna().all(axis=None)


@settings(deadline=None, max_examples=30)
@given(cam=cams, phi=some.floats(-3.0, 3.0), mu=some.floats(0.02, 0.6), ratio=some.floats(0.5, 2.5))
def test_limit_points_are_the_nearest_of_all_where_the_resultant_leans_by_the_angle_of_friction(cam, phi, mu, ratio):
    got = sweep.thread.free_cam(cam | {"phi": phi, "mu": mu, "tension_ratio": ratio}).iloc[0]
    if got.status != st.OK:
        assert got.status == st.NOT_CONVERGED  # a limit far outside
        return
    sine, (n1, n2) = mu / math.hypot(1.0, mu), guides(cam)
    y, _, _ = reference.shortest_over_edge(cam["a"], phi, n1, n2)
    for side, found in ((1.0, got.y_limit_plus), (-1.0, got.y_limit_minus)):
        lean = reference.lean_of_resultant(cam["a"], phi, n1, n2, ratio, found)
        assert lean == pytest.approx(side * sine, abs=1e-12 * (1.0 + abs(found)))
        # Nothing nearer changes its sign, in a scan of 2000 points.
        reach = abs(found - y) * (1.0 - 1e-3)
        leans = [
            reference.lean_of_resultant(cam["a"], phi, n1, n2, ratio, y + reach * k / 1000) - side * sine
            for k in range(-1000, 1001)
        ]
        assert len({value > 0.0 for value in leans}) == 1


def test_thread_with_friction_never_leans_by_more_than_the_angle_of_friction():
    cam = CAM | {"mu": 0.3, "tension_ratio": 1.5}
    got = sweep.evaluate("free_cam_friction", cam, ["y_contact", "contact", "sticking", "P", "L"], phi=TURN)
    sine, sliding = 0.3 / math.hypot(1.0, 0.3), 0
    for k in np.flatnonzero(got.contact == 1.0):
        lean = reference.lean_of_resultant(0.4, TURN[k], *guides(CAM), 1.5, got.y_contact[k])
        assert abs(lean) <= sine * (1.0 + 1e-9)
        if got.sticking[k]:
            assert got.contact[k - 1] == 0.0 or got.y_contact[k] == got.y_contact[k - 1]
        else:
            assert abs(lean) == pytest.approx(sine, rel=1e-9)
            sliding += 1
    assert 5 < sliding < 100
    np.testing.assert_array_equal(got.P, got.L)


def test_second_turn_of_the_march_is_what_every_later_turn_repeats():
    cam = {name: np.array([x]) for name, x in (CAM | {"mu": 0.3}).items()}
    from kernels.families import free_cam

    designs = np.column_stack([*(cam[k] for k in CAM), np.zeros(1)])
    out = []
    for turns in (2, 5):
        y, status = np.empty((1, 360)), np.empty((1, 360), np.uint8)
        friction, outputs = np.array([[1.0, 0.0, 0.3]]), free_cam.MarchOutputs(None, None, y, None, None)
        free_cam.march(friction, turns, designs, np.cos(TURN)[None], np.sin(TURN)[None], status, outputs)
        assert (status == st.OK).all()
        out.append(y)
    np.testing.assert_array_equal(*out)


def test_steps_of_the_march_hardly_change_what_it_gives():
    # Sliding to a limit point and landing on the edge are found exactly, whatever the steps.
    cam = CAM | {"mu": 0.3, "tension_ratio": 1.5}
    coarse = sweep.evaluate("free_cam_friction", cam, ["P"], phi=TURN)
    fine = sweep.evaluate("free_cam_friction", cam, ["P"], phi=2.0 * np.pi * np.arange(2880) / 2880)
    np.testing.assert_allclose(coarse.P, fine.P[::8], atol=1e-6)


def test_without_friction_the_march_lies_where_the_length_is_a_minimum():
    cam = CAM | {"mu": 0.0}
    got = sweep.evaluate("free_cam_friction", cam, ["y_contact", "contact", "L"], phi=TURN)
    free = sweep.evaluate("free_cam", CAM, ["y_contact", "minima", "L"], phi=TURN)
    single = (free.minima == 1) & (got.contact == 1.0)
    assert single.sum() > 50
    np.testing.assert_allclose(got.y_contact[single], free.y_contact[single], rtol=1e-9)
    assert (got.L >= free.L * (1.0 - 1e-14)).all()  # with two minima it may stay in the longer one


def test_extrema_of_a_march_are_asked_on_samples():
    cam = CAM | {"mu": 0.3}
    got = sweep.summarise("free_cam_friction", cam, ["max_P", "min_P"], samples=360)
    curve = sweep.evaluate("free_cam_friction", cam, ["P"], phi=TURN)
    assert got.max_P[0] == curve.P.max() and got.min_P[0] == curve.P.min()
    with pytest.raises(sweep.InputError, match="samples"):
        sweep.summarise("free_cam_friction", cam, ["max_P"], accuracy=1e-8)
