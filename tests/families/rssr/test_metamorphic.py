"""What must not change, or change in a known way, when the question is asked differently: the crank-rocker.

Bit for bit where only signs and powers of two differ; elsewhere to the roundings that one changed input explains,
2^-53 times the condition number of the pose, with the factor 16 of the sheets for two evaluations.
"""

from __future__ import annotations

import itertools
import math

import numpy as np
import pandas as pd
import pytest
from hypothesis import given, settings
from hypothesis import strategies as some

import sweep
from kernels import status as st
from sweep.evaluation.summaries import design_outputs
from sweep.families import family
from sweep.families.base import Accuracy, Angles
from tests.support.sixty_digits import condition
from tests.support.turn_designs import crank_rockers

RSSR = family("rssr")
NAMES = ("a", "b", "c", "e", "f", "g", "alpha", "branch")
MOTION = ("psi", "dpsi", "d2psi", "d3psi")
POSES = (*MOTION, "sin_psi", "cos_psi", "pressure_angle")
TURN = ("rotatable", "margin", "max_pressure_angle", "max_abs_dpsi", "max_abs_d2psi", "phi_max_abs_d2psi", "swing")
DIALS = (Accuracy(target=1e-8), Accuracy(samples=96))
PHI = np.linspace(-3.0, 3.0, 41)[None, :]


def turning(n, seed):
    designs = crank_rockers(8 * n, seed)
    status = design_outputs(RSSR, designs, ["margin"], DIALS[0])["status"]
    return np.ascontiguousarray(designs[status == st.OK][:n])


DESIGNS = turning(60, 3)


def poses(designs, phi=PHI):
    return RSSR.poses(np.ascontiguousarray(designs), Angles.of(np.ascontiguousarray(phi)), frozenset(POSES))


def with_columns(designs, **values):
    designs = designs.copy()
    for name, value in values.items():
        designs[:, NAMES.index(name)] = value
    return designs


def column(designs, name):
    return designs[:, NAMES.index(name)]


def chord(x, y):
    """Distance of angles on the circle."""
    return np.abs(2.0 * np.sin(0.5 * (x - y)))


@settings(deadline=None, max_examples=25)
@given(exponent=some.integers(-300, 300), seed=some.integers(0, 50))
def test_scaling_by_a_power_of_two_changes_no_bit(exponent, seed):
    designs = turning(3, seed)
    scaled = designs.copy()
    scaled[:, :6] = np.ldexp(designs[:, :6], exponent)
    plain, big = poses(designs), poses(scaled)
    for name in POSES:
        np.testing.assert_array_equal(plain[name], big[name])
    for dial in DIALS:
        plain, big = (design_outputs(RSSR, d, TURN, dial) for d in (designs, scaled))
        for name in (*TURN, "status"):
            np.testing.assert_array_equal(plain[name], big[name], err_msg=name)


def test_mirror_image_runs_backwards_on_the_other_branch_bit_for_bit():
    # y -> -y: alpha, phi, psi and the branch change sign, velocities and jerks keep theirs.
    mirrored = with_columns(DESIGNS, alpha=-column(DESIGNS, "alpha"), branch=-column(DESIGNS, "branch"))
    plain, image = poses(DESIGNS), poses(mirrored, -PHI)
    for name, sign in (("psi", -1), ("dpsi", 1), ("d2psi", -1), ("d3psi", 1), ("pressure_angle", 1)):
        np.testing.assert_array_equal(plain[name], sign * image[name])


def test_mirror_image_has_the_same_turn():
    mirrored = with_columns(DESIGNS, alpha=-column(DESIGNS, "alpha"), branch=-column(DESIGNS, "branch"))
    plain, image = (design_outputs(RSSR, d, TURN, DIALS[0]) for d in (DESIGNS, mirrored))
    np.testing.assert_array_equal(plain["status"], image["status"])
    for name in ("margin", "max_pressure_angle", "max_abs_dpsi", "max_abs_d2psi"):
        np.testing.assert_allclose(plain[name], image[name], rtol=1e-11)
    np.testing.assert_allclose(plain["swing"], -image["swing"], rtol=1e-11)
    # extreme accelerations of equal height occur at two places only by chance
    assert chord(plain["phi_max_abs_d2psi"], -image["phi_max_abs_d2psi"]).max() < 1e-6


def test_half_a_turn_about_the_rocker_axis():
    # x, y -> -x, -y: e and alpha change sign, crank and rocker angles move on by pi.
    turned = with_columns(DESIGNS, alpha=-column(DESIGNS, "alpha"), e=-column(DESIGNS, "e"))
    plain, image = poses(DESIGNS), poses(turned, PHI + math.pi)
    for i, design in enumerate(DESIGNS[:12]):
        for j in range(0, PHI.size, 8):
            cond = condition(design, float(PHI[0, j]))
            size = 16.0 * 2.0**-53 * max(1.0, math.pi / abs(PHI[0, j]) if PHI[0, j] else 1.0)
            assert chord(plain["psi"][i, j] + math.pi, image["psi"][i, j]) <= size * (cond[0] + 4.0)
            for order, name in enumerate(MOTION[1:], 1):
                scale = max(cond[1 : order + 1]) + abs(plain[name][i, j]) + 4.0 * abs(plain[name][i]).max()
                assert abs(plain[name][i, j] - image[name][i, j]) <= size * scale


def test_a_full_turn_of_the_crank_comes_back():
    there, back = poses(DESIGNS), poses(DESIGNS, PHI + 2.0 * math.pi)
    slope, bend = np.abs(there["dpsi"]), np.abs(there["d2psi"])
    # phi + 2 pi is rounded at a magnitude of up to 9.3, and 2 pi itself is known to 2.5e-16
    moved = 2.0 * 2.0**-50
    assert (chord(there["psi"], back["psi"]) <= moved * (slope + 8.0)).all()
    assert (
        np.abs(there["dpsi"] - back["dpsi"]) <= moved * (bend + 64.0 * slope.max(axis=1, keepdims=True) + 8.0)
    ).all()


def test_order_of_rows_is_the_order_of_answers():
    order = np.random.default_rng(1).permutation(len(DESIGNS))
    plain, shuffled = poses(DESIGNS), poses(DESIGNS[order])
    for name in POSES:
        np.testing.assert_array_equal(plain[name][order], shuffled[name])
    for dial in DIALS:
        plain, shuffled = (design_outputs(RSSR, d, TURN, dial) for d in (DESIGNS, np.ascontiguousarray(DESIGNS[order])))
        for name in (*TURN, "status"):
            np.testing.assert_array_equal(plain[name][order], shuffled[name], err_msg=name)


def test_company_changes_nothing():
    """A design alone, in a block of its like, or after designs that do not turn: the same bits."""
    mixed = np.concatenate([crank_rockers(150, 9), DESIGNS])
    for dial in DIALS:
        together = design_outputs(RSSR, mixed, TURN, dial)
        for i in (150, 150 + 17, len(mixed) - 1):
            alone = design_outputs(RSSR, mixed[i : i + 1], TURN, dial)
            for name in (*TURN, "status"):
                np.testing.assert_array_equal(together[name][i], alone[name][0], err_msg=name)


def test_a_grid_cut_otherwise_gives_the_same_bits():
    table = pd.DataFrame(DESIGNS[:5], columns=list(NAMES))
    phi = PHI[0]
    whole = sweep.evaluate("rssr", table, list(POSES), phi=phi)
    halves = [sweep.evaluate("rssr", table, list(POSES), phi=part) for part in (phi[:7], phi[7:])]
    joined = pd.concat(halves).sort_values(["design", "phi"]).reset_index(drop=True)
    pd.testing.assert_frame_equal(whole.sort_values(["design", "phi"]).reset_index(drop=True), joined)
    rows = table.loc[table.index.repeat(phi.size)].assign(phi=np.tile(phi, 5))
    single = sweep.evaluate("rssr", rows, list(POSES))
    for name in POSES:
        np.testing.assert_array_equal(whole[name], single[name])


def test_a_grid_that_contains_another_finds_no_less():
    names = ["max_abs_dpsi", "max_abs_d2psi", "max_abs_d3psi"]
    coarse, fine, finer = (design_outputs(RSSR, DESIGNS, names, Accuracy(samples=90 * k)) for k in (1, 2, 6))
    for name in names:
        # the same angle of two grids may differ by a rounding of its cosine
        assert (fine[name] >= coarse[name] * (1.0 - 1e-9)).all() and (fine[name] > coarse[name]).any()
        assert (finer[name] >= fine[name] * (1.0 - 1e-9)).all()


def test_parallel_axes_are_the_limit_of_nearly_parallel_ones():
    """alpha -> 0 meets the planar four-bar, written out on its own, linearly in alpha for offsets f = g."""
    generator = np.random.default_rng(4)
    a, b, c, e = 0.4, 2.2, 1.7, 2.0
    phi = generator.uniform(0.0, 2.0 * math.pi, 50)
    # plain trigonometry of the triangle over the diagonal
    x, y = e - a * np.cos(phi), -a * np.sin(phi)
    diagonal = np.hypot(x, y)
    inner = np.arccos((c * c + diagonal**2 - b * b) / (2.0 * c * diagonal))
    off = []
    for alpha in (1e-2, 1e-3, 1e-4, 0.0):
        design = [a, b, c, e, 0.75, 0.75, alpha, 1.0]
        psi = RSSR.poses(np.array([design]), Angles.of(phi[None, :]), frozenset({"psi"}))["psi"][0]
        four_bar = np.arctan2(-y, -x) + inner
        off.append(chord(psi, four_bar).max())
    assert off[-1] < 1e-14
    assert off[0] / off[1] == pytest.approx(10.0, rel=0.1)
    assert off[1] / off[2] == pytest.approx(10.0, rel=0.01)


def test_planar_linkages_shift_along_their_axes_bit_for_bit():
    # dyadic offsets: f - g is exact, so only the difference can matter
    planar = with_columns(DESIGNS, alpha=0.0, f=np.round(8.0 * column(DESIGNS, "f")) / 8.0)
    planar = with_columns(planar, g=column(planar, "f") - 0.25)
    shifted = with_columns(planar, f=column(planar, "f") + 1024.0, g=column(planar, "g") + 1024.0)
    plain, moved = poses(planar), poses(shifted)
    assert (plain["status"] == st.OK).mean() > 0.3
    for name in POSES:
        np.testing.assert_array_equal(plain[name], moved[name])


def test_both_branches_are_symmetric_about_the_line_to_the_crank_pin():
    """psi+ + psi- = 2 atan2(Y, -X), and the transfer functions of the sum follow from it."""
    other = with_columns(DESIGNS, branch=-column(DESIGNS, "branch"))
    one, two = poses(DESIGNS), poses(other)
    a, e, f, alpha = (column(DESIGNS, name)[:, None] for name in ("a", "e", "f", "alpha"))
    ca = np.cos(alpha)
    x, y = e - a * np.cos(PHI), f * np.sin(alpha) + a * ca * np.sin(PHI)
    square = x * x + y * y
    turn_rate = -(x * a * ca * np.cos(PHI) - y * a * np.sin(PHI)) / square  # of atan2(Y, -X)
    for i, design in enumerate(DESIGNS[:15]):
        for j in range(0, PHI.size, 8):
            cond = [condition(np.append(design[:7], s), float(PHI[0, j])) for s in (1.0, -1.0)]
            size = 16.0 * 2.0**-53
            both = one["psi"][i, j] + two["psi"][i, j] - 2.0 * math.atan2(y[i, j], -x[i, j])
            near_axis = max(1.0, (abs(e[i, 0]) + a[i, 0] + abs(f[i, 0])) / math.sqrt(square[i, j]))
            assert chord(both, 0.0) <= size * (cond[0][0] + cond[1][0] + near_axis + 4.0)
            rate = one["dpsi"][i, j] + two["dpsi"][i, j] - 2.0 * turn_rate[i, j]
            assert abs(rate) <= size * (cond[0][1] + cond[1][1] + near_axis**2 + 4.0)


@pytest.mark.parametrize("order", [1, 2, 3])
def test_derivatives_are_those_of_the_order_below_at_the_expected_rate(order):
    """Central differences err like h^2: halving h divides the error by four, down to the rounding of the quotient."""
    lower, name = MOTION[order - 1], MOTION[order]
    calm = DESIGNS[design_outputs(RSSR, DESIGNS, ["margin"], DIALS[0])["margin"] > 0.1][:20]
    phi = np.linspace(0.1, 6.1, 13)[None, :]
    exact = poses(calm, phi)[name]
    errors = []
    for h in (2.0**-7, 2.0**-8, 2.0**-9):
        low, high = (poses(calm, phi + s * h)[lower] for s in (-1.0, 1.0))
        difference = high - low
        if lower == "psi":
            difference = np.arctan2(np.sin(difference), np.cos(difference))
        errors.append(np.abs(difference / (2.0 * h) - exact).max(axis=1))
    for coarse, fine in itertools.pairwise(errors):
        assert (fine < coarse).all()
        np.testing.assert_allclose(coarse / fine, 4.0, rtol=0.05)
    # Richardson's extrapolation leaves h^4
    assert (np.abs(errors[2] - errors[1] / 4.0) < 0.02 * errors[1]).all()
