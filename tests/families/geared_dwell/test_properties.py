"""Symmetries, limits and published values of the geared dwell drive.

Tolerances: identities between values of two designs hold to the roundings of both, 1e-13 of their size; published
figures to half a unit of their last printed digit.
"""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as some

from kernels import status as st
from sweep.families import family
from sweep.families.base import Angles
from tests.families.geared_dwell.test_oracle import step

FAMILY = family("geared_dwell")
MOTION = ("psi", "dpsi", "d2psi", "d3psi")
DEG = np.pi / 180.0


def motion(k, a, phi):
    got = FAMILY.poses(np.array([[k, a]], dtype=float), Angles.of(np.atleast_2d(phi)), frozenset(MOTION))
    assert (got["status"] == st.OK).all()
    return [got[name][0] for name in MOTION]


working = some.tuples(some.floats(0.3, 4.0), some.floats(0.05, 0.95), some.floats(0.01, 3.1))


@settings(deadline=None, max_examples=40)
@given(working)
def test_motion_is_odd_and_even_about_mid_dwell(case):
    k, share, phi = case
    a = k - 2.0 + 4.0 * share
    ahead, behind = motion(k, a, phi), motion(k, a, -phi)
    for order, sign in enumerate((-1.0, 1.0, -1.0, 1.0)):
        np.testing.assert_array_equal(behind[order], sign * ahead[order])


@settings(deadline=None, max_examples=40)
@given(working)
def test_exchange_of_pin_distance_and_offset_mirrors_the_turn(case):
    # phi''(al; p, q) = phi''(pi - al; p, -q), and q -> -q exchanges k and a; psi - phi likewise.
    k, share, phi = case
    a = max(k - 2.0 + 4.0 * share, 0.05)  # as a pin distance it must be positive
    here, there = motion(k, a, phi), motion(a, k, np.pi - phi)
    size = [1.0 + abs(value[0]) for value in here]
    size = np.maximum.accumulate(size) * (1.0 + 1.0 / min(a - k + 2.0, k + 2.0 - a))
    assert abs((here[0] - phi) - (there[0] - (np.pi - phi)))[0] <= 1e-13 * size[0]
    assert abs(here[1] + there[1] - 2.0)[0] <= 1e-13 * size[1]
    assert abs(here[2] - there[2])[0] <= 1e-13 * size[2] * size[1]
    assert abs(here[3] + there[3])[0] <= 1e-13 * size[3] * size[1]


@settings(deadline=None, max_examples=40)
@given(some.floats(0.05, 0.95), some.floats(-9.0, 9.0))
def test_offset_minus_k_turns_uniformly(k, phi):
    psi, *derivatives = motion(k, -k, phi)
    assert abs(psi[0] - phi) <= 4e-15 * (1.0 + abs(phi)) / (1.0 - k)
    assert [value[0] for value in derivatives] == [1.0, 0.0, 0.0]


def test_optimum_offset_has_two_equal_peaks_and_the_closed_form_maximum():
    k = np.geomspace(1.001, 20.0, 60)
    inner = 3.0 * (1.0 + k**2)
    w = (1.0 + 2.0 * k**2) / (inner + np.sqrt(inner**2 - 1.0 - 2.0 * k**2))
    closed = np.sqrt(w) * (1.0 + 2.0 * k**2 - w) / (1.0 + w) ** 2
    got = step("stationary points", np.stack([k, k], axis=1), ["max_abs_d2psi", "phi_max_abs_d2psi"])
    np.testing.assert_allclose(got["max_abs_d2psi"], closed, rtol=16 * 2.0**-53)
    for kk, phi, peak in zip(k, got["phi_max_abs_d2psi"], got["max_abs_d2psi"], strict=True):
        assert abs(motion(kk, kk, np.pi - phi)[2][0]) == pytest.approx(peak, rel=1e-14)
    for nudge in (-1e-4, 1e-4):
        beside = step("stationary points", np.stack([k, k * (1.0 + nudge)], axis=1), ["max_abs_d2psi"])
        assert (beside["max_abs_d2psi"] > got["max_abs_d2psi"]).all()


def test_extreme_angle_of_the_optimum_offset_has_its_closed_form():
    k = np.array([1.01, 1.2, 1.7, 3.0, 12.0])
    cosine = 2.0 * (1.0 + k**2) / (k * (1.0 + np.sqrt(5.0 + 4.0 * k**2)))
    deviation = step("dwell", np.stack([k, k], axis=1), ["dwell_deviation"])["dwell_deviation"]
    for kk, c, delta in zip(k, cosine, deviation, strict=True):
        psi, dpsi, *_ = motion(kk, kk, np.arccos(c))
        assert abs(dpsi[0]) < 1e-12
        assert -psi[0] == pytest.approx(delta, rel=1e-12)


# alpha0 [deg], delta [deg] and max psi'' at a = 0, the same at a = k; docs/geared_dwell.md section 5.
TRADE = [
    (30, 0.410, 1.496, 0.200, 0.926),
    (45, 1.448, 1.721, 0.685, 0.990),
    (60, 3.678, 2.151, 1.657, 1.094),
    (72, 6.859, 2.804, 2.922, 1.220),
    (90, 15.793, 5.407, 5.924, 1.524),
    (100, 24.757, 10.292, 8.328, 1.796),
    (108, 36.150, 24.825, 10.720, 2.103),
    (120, None, None, 15.246, 2.820),
    (140, None, None, 26.039, 5.772),
]


@pytest.mark.parametrize("row", TRADE, ids=lambda row: f"{row[0]} deg")
def test_table_of_the_offset_trade(row):
    alpha0, delta0, peak0, delta, peak = row
    k = 1.0 / np.cos(0.5 * alpha0 * DEG)
    names = ["dwell_angle", "dwell_deviation"]
    for a, expected in ((0.0, (delta0, peak0)), (k, (delta, peak))):
        if expected[0] is None:
            continue
        measures = step("dwell", [(k, a)], names)
        largest = step("stationary points", [(k, a)], ["max_abs_d2psi"])["max_abs_d2psi"][0]
        assert measures["dwell_angle"][0] == pytest.approx(alpha0 * DEG, rel=1e-12)
        assert measures["dwell_deviation"][0] / DEG == pytest.approx(expected[0], abs=0.00051)
        assert largest == pytest.approx(expected[1], abs=0.00051)


def test_claims_of_the_source_hold_only_as_corrected():
    # k = sqrt 2: the deviation falls 2.77 times from a = 0 to a = 1.5, not "more than three times".
    k = np.sqrt(2.0)
    deviation = step("dwell", [(k, 0.0), (k, 1.5), (1.41, 0.0)], ["dwell_deviation"])["dwell_deviation"]
    assert deviation[0] / deviation[1] == pytest.approx(2.77, abs=0.005)
    assert deviation[0] / DEG == pytest.approx(15.79, abs=0.005)
    assert deviation[2] / DEG == pytest.approx(15.55, abs=0.005)
    assert abs(deviation[2] / DEG - 14.2) > 1.0  # as printed
    peak = step("stationary points", [(k, 0.0), (k, 1.5)], ["max_abs_d2psi"])["max_abs_d2psi"]
    assert peak[0] / peak[1] == pytest.approx(3.08, abs=0.01)


@pytest.mark.parametrize("gap", [1e-3, 1e-6, 1e-9, 1e-12])
def test_peak_next_to_the_singular_offsets_follows_its_asymptote(gap):
    k = 1.5
    for a, distance, lever in (
        (k + 2.0 - gap, (k + 2.0) - (k + 2.0 - gap), k + 1.0),
        (k - 2.0 + gap, (k - 2.0 + gap) - (k - 2.0), k - 1.0),
    ):
        got = step("stationary points", [(k, a)], ["max_abs_d2psi"])["max_abs_d2psi"][0]
        assert got == pytest.approx(3.0 * np.sqrt(3.0) / 8.0 * (2.0 * lever / distance) ** 2, rel=30.0 * gap + 1e-14)


def test_cusp_at_unit_pin_distance_is_a_third_order_dwell():
    for a in (0.0, 0.7, 2.0):
        phi = np.array([1e-2, 1e-3, 1e-5])
        psi, dpsi, _, d3psi = motion(1.0, a, phi)
        np.testing.assert_allclose(psi, phi**3 / (1.0 + a), rtol=2e-4)
        np.testing.assert_allclose(dpsi, 3.0 * phi**2 / (1.0 + a), rtol=4e-4)
        assert d3psi[-1] == pytest.approx(6.0 / (1.0 + a), rel=1e-8)
