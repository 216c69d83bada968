"""Presser foot on the rack of a feed mechanism: loss of contact, the softest spring, the least preload."""

from __future__ import annotations

import math

import numpy as np
import pytest

import sweep
from kernels import status as st

RACK = {
    "h_a": 0.4, "h_b": 3.4, "h_c": 1.6, "h_e": 3.5, "rh": 1.2, "dh": -0.3, "xE": 5.6, "yE": 0.7, "rE": 0.18, "dE": 0.8,
    "q": 2.6, "fx": -1.7, "fy": 0.6, "tx": -0.3, "ty": 0.9, "h_sigma": -1.0, "bar_branch": -1.0,
}  # fmt: skip


def test_foot_on_the_rack_of_a_feed_mechanism_loses_contact_where_the_force_vanishes():
    phi = np.linspace(0.0, 2.0 * math.pi, 721)[:-1]
    path = sweep.evaluate("feed", RACK, ["y_t", "d2y_t", "x_t"], phi=phi)
    plate = float(path.y_t.mean())
    p = RACK | {"y_plate": plate, "m": 0.05, "k": 50.0, "F0": 4.0}
    force = p["F0"] + p["k"] * (path.y_t - plate) + p["m"] * path.d2y_t
    above = path.y_t > plate
    slope = p["m"] * path.d2y_t
    # the speed at which the least force over the plate is zero, at the nodes
    limit = math.sqrt(float(((p["F0"] + p["k"] * (path.y_t - plate))[above] / -slope[above].where(slope < 0)).min()))
    table = p | {"omega": [0.5 * limit, 0.999 * limit, 1.02 * limit, 1.5 * limit]}
    got = sweep.summarise("feed_foot", table, ["flights", "lost_angle", "stitch_error", "least_force", "phi_loss"])
    assert got.status.tolist() == [st.NO_EVENT, st.NO_EVENT, st.OK, st.OK]
    assert (got.flights[:2] == 0.0).all() and (got.flights[2:] > 0.0).all()
    assert got.stitch_error[:2].tolist() == [0.0, 0.0] and 0.0 < got.stitch_error[2] < got.stitch_error[3]
    assert not np.signbit(got.stitch_error).any()  # a rack that runs backwards loses 0, not -0
    assert force[above].min() > 0.0
    at = sweep.evaluate("feed", p | {"phi": got.phi_loss[2]}, ["y_t", "d2y_t"]).iloc[0]
    left = p["F0"] + p["k"] * (at.y_t - plate) + p["m"] * table["omega"][2] ** 2 * at.d2y_t
    # between nodes the curvature is interpolated: 1e-8 of the preload
    assert abs(left) < 1e-7 * p["F0"]


def test_foot_on_a_rack_that_is_not_assembled_reports_the_linkage():
    p = RACK | {"h_a": 3.0, "y_plate": 0.0, "m": 0.05, "k": 50.0, "F0": 4.0, "omega": 1.0}
    got = sweep.summarise("feed_foot", p, ["flights"]).iloc[0]
    assert got.status == st.NOT_ASSEMBLED and math.isnan(got.flights)


def test_foot_on_a_feed_rack_keeps_contact_from_the_softest_spring_and_the_least_preload():
    p = RACK | {"y_plate": 1.55, "m": 0.05, "k": 0.0, "F0": 4.0, "omega": 20.0}
    need = sweep.summarise("feed_foot", p, ["F0_min_contact"]).F0_min_contact[0]
    assert need > 0.0
    preload = 1.02 * need
    found = sweep.summarise("feed_foot", p | {"F0": preload}, ["k_min_contact"]).iloc[0]
    assert found.status == st.OK and found.k_min_contact > 0.0
    springs = np.array([0.999, 1.001]) * found.k_min_contact
    got = sweep.summarise("feed_foot", p | {"F0": preload, "k": springs}, ["flights"])
    assert got.flights[0] > 0.0 and got.flights[1] == 0.0
    short = sweep.summarise("feed_foot", p | {"F0": 0.98 * need}, ["k_min_contact"]).iloc[0]
    assert math.isnan(short.k_min_contact) and short.status == st.NO_EVENT
    plenty = sweep.summarise("feed_foot", p | {"F0": 50.0 * need}, ["k_min_contact"]).iloc[0]
    assert plenty.k_min_contact == 0.0 and plenty.status == st.OK


def test_the_tooth_that_passes_the_plate_four_times_is_held_in_its_shorter_stay_too():
    """The shorter one asks for 3.6 times the preload of the longer, which was all that counted."""
    p = RACK | {"h_a": 0.71, "rE": 0.04, "dE": 0.3, "tx": 2.0, "ty": 0.6, "h_sigma": 1.0, "y_plate": -2.65}
    p |= {"m": 0.05, "k": 0.0, "F0": 4.0, "omega": 20.0}
    at = sweep.evaluate("feed", p, ["y_t", "d2y_t"], phi=np.arange(14400) * (math.pi / 7200))
    above = (at.y_t > p["y_plate"]).to_numpy()
    bend = p["m"] * p["omega"] ** 2 * at.d2y_t.to_numpy()[above != np.roll(above, 1)]
    need = sweep.summarise("feed_foot", p, ["F0_min_contact"]).F0_min_contact[0]
    # two places of the crank, 4e-4 rad apart, enclose a passage
    assert bend.size == 4 and need == pytest.approx(-bend.min(), rel=2e-3)
    spring = sweep.summarise("feed_foot", p | {"F0": 1.02 * need}, ["k_min_contact"]).k_min_contact[0]
    table = p | {"F0": 1.02 * need, "k": np.array([0.999, 1.001]) * spring}
    assert (sweep.summarise("feed_foot", table, ["flights"]).flights > 0.0).tolist() == [True, False]
    short = sweep.summarise("feed_foot", p | {"F0": 0.98 * need}, ["k_min_contact"]).iloc[0]
    assert math.isnan(short.k_min_contact) and short.status == st.NO_EVENT


def test_softest_spring_of_two_nearly_equal_tops_is_that_of_the_higher_one():
    """The higher top lies in the middle between two nodes, both lower than the node beside the other top."""
    names = ("h_a", "h_b", "h_c", "h_e", "rh", "dh", "xE", "yE", "rE", "dE", "q", "fx", "fy", "tx", "ty")
    values = (0.375, 3.395, 1.597, 4.171, 1.197, -0.264, 4.82, 0.619, 0.177, 0.687, 1.868, -1.393, 0.628, -0.259, 0.809)
    shift = 0.125 * 2.0 * math.pi / 720
    rack = dict(zip(names, values, strict=True)) | {"h_sigma": -1.0, "bar_branch": -1.0, "y_plate": 1.3266229}
    rack |= {"dh": rack["dh"] + shift, "dE": rack["dE"] + shift}
    m, omega = 0.038, 24.07
    p = rack | {"m": m, "k": 0.0, "F0": 0.8, "omega": omega}
    p["F0"] = 1.01 * sweep.summarise("feed_foot", p, ["F0_min_contact"]).F0_min_contact[0]
    tops = []
    for place in (1.137, 2.152):
        poses = sweep.evaluate("feed", rack, ["y_t", "d2y_t"], phi=np.linspace(place - 0.02, place + 0.02, 8001))
        spring = (-m * omega**2 * poses.d2y_t - p["F0"]) / (poses.y_t - rack["y_plate"])
        assert 0 < spring.argmax() < 8000
        tops.append(spring.max())
    assert 5e-6 < tops[1] / tops[0] - 1.0 < 1.5e-5
    # a parabola through three nodes misses the higher top by 2.1e-6; the lower one would be 1e-5 too low
    assert abs(sweep.summarise("feed_foot", p, ["k_min_contact"]).k_min_contact[0] / tops[1] - 1.0) < 3e-6


@pytest.mark.parametrize(("plate", "more"), [(1.6, 1.0 + 1e-6), (1.55, 1.02), (1.55, 1.2), (1.55, 1.4)])
def test_the_softest_spring_on_a_feed_rack_leaves_the_foot_just_no_force(plate, more):
    """It was the softest at the nodes, then of parabolas through them: 1.5e-6 of the preload were left."""
    p = RACK | {"y_plate": plate, "m": 0.05, "k": 0.0, "F0": 4.0, "omega": 20.0}
    p["F0"] = more * sweep.summarise("feed_foot", p, ["F0_min_contact"]).F0_min_contact[0]
    p["k"] = sweep.summarise("feed_foot", p, ["k_min_contact"]).k_min_contact[0]
    assert p["k"] > 0.0
    # the march reads the force between nodes by parabolas
    assert abs(sweep.summarise("feed_foot", p, ["least_force"]).least_force[0]) < 5e-8 * p["F0"]
