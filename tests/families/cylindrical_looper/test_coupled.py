"""Looper on a cylinder whose sliding drive stands beside the axis: both loops at once, against points and distances."""

from __future__ import annotations

import numpy as np
import pytest
from mpmath import mp

import sweep
from kernels import status as st
from kernels.families import cylindrical_looper
from kernels.families.cylindrical_looper.coupled import _square as across_square
from sweep.families import family
from tests.families.cylindrical_looper.test_reference import ALL, NAMES, SHAPES, TABLE, evaluated, loopers
from tests.reference import cylindrical_looper as naive
from tests.support.family_checks import (
    assert_compiled_equals_plain,
    assert_gradients_are_those_of_the_reference,
    factors,
)

BESIDE = TABLE | {"d2": 0.9, "beta2": 0.7, "gamma2": -0.4}


def near(row):
    return {"psi": mp.mpf(row.psi), "s": mp.mpf(row.s)}


def test_coupled_looper_equals_joint_geometry():
    # As for the looper on the axis: 16 is asked; 1.1 was measured on 40 loopers.
    for design, phi in loopers(6, 21, on_axis=False):
        row = evaluated(design, phi, ALL).iloc[0]
        expected = naive.outputs(design, phi, near(row))
        found = factors("cylindrical_looper", design, phi, expected, row)
        assert max(found.values()) <= 16.0, (design, phi, found)


def test_ball_that_comes_to_the_axis_gives_the_looper_on_the_axis():
    phi = np.linspace(0.0, 6.0, 9)
    on = sweep.evaluate("cylindrical_looper", TABLE, ALL, phi=phi)
    off = sweep.evaluate("cylindrical_looper", TABLE | {"d2": 1e-13, "beta2": 0.7}, ALL, phi=phi)
    # 1e-13 of a link moves nothing by more than some ten times that
    np.testing.assert_allclose(off[ALL], on[ALL], rtol=1e-11, atol=1e-11)


def test_place_of_the_second_drive_about_the_shaft_does_not_matter_on_the_axis():
    turned = sweep.evaluate("cylindrical_looper", TABLE | {"gamma2": 1.3, "d2": 1e-14}, ["psi", "s"], phi=[0.3, 2.0])
    plain = sweep.evaluate("cylindrical_looper", TABLE, ["psi", "s"], phi=[0.3, 2.0])
    np.testing.assert_allclose(turned[["psi", "s"]], plain[["psi", "s"]], atol=1e-12)


def crossings(table, phi):
    """How often the first coupler's length fits on a dense grid of shaft angles, the second's fitting by its place."""
    pin1, pin2 = (np.array([float(x) for x in pin]) for pin in naive.pins([*map(float, table.values())], phi))
    psi, count = np.linspace(-np.pi, np.pi, 4001) + 1e-4, 0
    foot, zero = np.array([table["e1"], 0.0, table["g1"]]), 0.0 * psi
    ball = foot + table["d2"] * np.stack([np.cos(psi + table["beta2"]), np.sin(psi + table["beta2"]), zero], axis=1)
    rocker = foot + table["c1"] * np.stack([np.cos(psi), np.sin(psi), zero], axis=1)
    across = (ball[:, :2] - pin2[:2]) ** 2
    with np.errstate(invalid="ignore"):
        reach = np.sqrt(table["b2"] ** 2 - across.sum(axis=1))
        for sign in (-1.0, 1.0):
            s = pin2[2] - foot[2] + sign * reach
            ends = rocker + np.stack([zero, zero, table["slides"] * s], axis=1)
            gap = ((ends - pin1) ** 2).sum(axis=1) - table["b1"] ** 2
            count += int(np.sum(gap[:-1] * gap[1:] < 0.0))
    return count


def test_all_solutions_are_found_branch_by_branch():
    most = 0
    for design, phi in loopers(40, 9, on_axis=False):
        table = dict(zip(NAMES, design, strict=True))
        rows = {
            "branch1": [-1.0, -1.0, 1.0, 1.0] * 2, "branch2": [-1.0] * 4 + [1.0] * 4, "mode": [1.0, 2.0] * 4,
        }  # fmt: skip
        got = sweep.evaluate("cylindrical_looper", table | rows | {"phi": phi}, ["psi", "s"])
        own, expected = got[got.status == st.OK], crossings(table, phi)
        # the grid of 4000 can miss a pair, or a root between its last point and the end of an arc
        assert expected <= len(own) <= expected + 2
        most = max(most, len(own))
        assert len(own) == len(own[["psi", "s"]].round(9).drop_duplicates())
    assert most >= 3


def test_coupled_looper_jitted_equals_plain():
    designs = np.array([d for d, _ in loopers(4, 6, on_axis=False)])
    phi = np.random.default_rng(3).uniform(-4.0, 4.0, (4, 3))
    assert_compiled_equals_plain(cylindrical_looper.coupled_poses, designs, phi, SHAPES)


@pytest.mark.parametrize("slides", [0.0, 1.0])
def test_coupled_looper_complex_step_gives_exact_gradients(slides):
    design, phi = tuple((BESIDE | {"slides": slides}).values()), 2.3
    row = evaluated(design, phi, ALL).iloc[0]

    def reference(numbers, angle):
        h = mp.mpf(10) ** -25
        pose, ahead = (naive.coupled(numbers, x, near(row)) for x in (angle, angle + h))
        return pose | {"dx_p": (ahead["x_p"] - pose["x_p"]) / h}

    assert_gradients_are_those_of_the_reference(
        "cylindrical_looper", design, phi, reference, ["psi", "s", "x_p", "dx_p"]
    )


def test_scale_changes_no_bit():
    lengths = [p.name for p in family("cylindrical_looper").parameters if p.unit == "length"]
    large = {name: value * (2.0**9 if name in lengths else 1.0) for name, value in BESIDE.items()}
    phi = np.linspace(0.0, 6.0, 7)
    one, other = (
        sweep.evaluate("cylindrical_looper", t, ["psi", "d3psi", "s", "d2s"], phi=phi) for t in (BESIDE, large)
    )
    assert (one[["psi", "d3psi"]] == other[["psi", "d3psi"]]).all(axis=None)
    assert (one[["s", "d2s"]] * 2.0**9 == other[["s", "d2s"]]).all(axis=None)


def test_designs_on_and_beside_the_axis_keep_their_order():
    both = {name: [BESIDE[name], TABLE[name], BESIDE[name]] for name in TABLE}
    got = sweep.evaluate("cylindrical_looper", both | {"phi": [0.3, 1.0, 2.0]}, ["psi", "x_p"])
    for k, (table, phi) in enumerate(((BESIDE, 0.3), (TABLE, 1.0), (BESIDE, 2.0))):
        alone = sweep.evaluate("cylindrical_looper", table, ["psi", "x_p"], phi=[phi])
        assert (got.loc[k, ["psi", "x_p"]] == alone.loc[0, ["psi", "x_p"]]).all()


@pytest.mark.parametrize("small", [1e-3, 1e-6, 1e-9])
def test_part_of_a_coupler_that_does_no_work_keeps_its_digits_where_it_is_small(small):
    # As a difference of squares it lost all digits below 1e-8; a quotient of sums of products has a few roundings.
    way, coupler = (3.0, 0.0, 4.0), (6.0 - 0.8 * small, 0.0, 8.0 + 0.6 * small)
    assert across_square.py_func(way, coupler) == pytest.approx(small**2, rel=20.0 * 2.0**-53 / small)


def test_pressure_angles_say_where_both_loops_lock():
    phi = np.linspace(0.0, 2.0 * np.pi, 60)
    got = sweep.evaluate(
        "cylindrical_looper", BESIDE, ["pressure_angle1", "pressure_angle2", "discriminant1", "dpsi"], phi=phi
    )
    ok = got.status == st.OK
    cos1 = np.cos(got.pressure_angle1[ok])
    np.testing.assert_allclose(BESIDE["b1"] ** 2 * cos1**2, got.discriminant1[ok], rtol=1e-10)
    apart = sweep.evaluate("cylindrical_looper", BESIDE | {"b1": 1e-2}, ["psi", "discriminant1"], phi=phi)
    assert (apart.status == st.NOT_ASSEMBLED).all() and (apart.discriminant1 < 0.0).all() and apart.psi.isna().all()
    whole = sweep.summarise(
        "cylindrical_looper", BESIDE, ["margin", "rotatable", "swing", "max_pressure_angle"], accuracy=1e-8
    )
    assert whole.rotatable[0] and whole.margin[0] > 0.0
