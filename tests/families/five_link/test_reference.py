"""Five-link against the 25-digit table, joint geometry, the crank-rocker it becomes, plain Python, exact gradients."""

from __future__ import annotations

import json
import math
from pathlib import Path

import numpy as np
import pytest
from mpmath import mp, mpf

import sweep
from kernels import status as st
from kernels.families import five_link
from kernels.families.five_link import motion
from sweep.families import family
from sweep.families.base import Angles
from tests.reference import five_link as naive
from tests.support.family_checks import factors
from tests.support.rssr_designs import random_designs

ROWS = json.loads((Path(__file__).parents[2] / "oracle" / "fivelink_open.json").read_text())["rows"]
NAMES = family("five_link").parameter_names
GEOMETRY = NAMES[:9]
ORDERS = {"psi": ("psi", 0), "dpsi": ("d1", 1), "d2psi": ("d2", 2), "d3psi": ("d3", 3)}
CHOICES = [(branch, mode) for branch in (1.0, -1.0) for mode in (1.0, 2.0, 3.0)]
# Inputs rounded once would make errors of 1 x 2^-53 cond; solving adds a handful of roundings of the same size.
FACTOR = 8.0


def every_mode(rows):
    """All assembly modes of each row, one table row each."""
    table = {name: [row[name] for row in rows for _ in CHOICES] for name in (*GEOMETRY, "phi")}
    table |= {"branch": [b for _ in rows for b, _ in CHOICES], "mode": [m for _ in rows for _, m in CHOICES]}
    return sweep.evaluate("five_link", table, [*ORDERS, "theta", "beta"])


def nearest_mode(rows):
    """Of each row's modes the one whose angle the table gives."""
    frame = every_mode(rows)
    apart = np.abs(np.exp(1j * frame.psi) - np.exp(1j * np.repeat([float(r["psi"]) for r in rows], len(CHOICES))))
    apart = np.where(frame.status == st.OK, apart, 9.0).reshape(len(rows), -1)
    return frame.iloc[np.argmin(apart, axis=1) + len(CHOICES) * np.arange(len(rows))]


def worst_factor(frame, rows, output):
    """Largest error in units of 2^-53 max(cond, |y|); the angle relative to at least 1."""
    worst, (column, order) = 0.0, ORDERS[output]
    with mp.workdps(40):
        for value, row in zip(frame[output], rows, strict=True):
            lower = [f"d{m}" for m in range(1, order + 1)] or [column]
            size = max(max(mpf(row["cond"][k]), abs(mpf(row[k]))) for k in lower)
            size = size if order else max(size, 1)
            worst = max(worst, float(abs(mpf(float(value)) - mpf(row[column])) / (mpf(2) ** -53 * size)))
    return worst


@pytest.mark.parametrize("output", ORDERS)
def test_five_link_matches_oracle_on_every_row(output):
    frame = nearest_mode(ROWS)
    assert (frame.status == st.OK).all()
    assert worst_factor(frame, ROWS, output) <= FACTOR


@pytest.mark.parametrize("output", ["theta", "beta"])
def test_five_link_joint_angles_match_oracle(output):
    # The table has no condition numbers for them; both turn no faster than the rocker, times c over the reach across.
    for value, row in zip(nearest_mode(ROWS)[output], ROWS, strict=True):
        apart = abs(np.exp(1j * value) - np.exp(1j * float(row[output])))
        assert apart <= FACTOR * 2.0**-53 * max(row["cond"]["psi"], 1.0), row["id"]


def test_negative_control_difference_quotient_fails_the_oracle():
    step = 6e-6
    shifted = [nearest_mode([row | {"phi": row["phi"] + d} for row in ROWS]).psi.to_numpy() for d in (-step, step)]
    frame = nearest_mode(ROWS).assign(dpsi=(shifted[1] - shifted[0]) / (2.0 * step))
    assert worst_factor(frame, ROWS, "dpsi") > 1000.0 * FACTOR


def test_negative_control_crank_rocker_with_the_same_links_fails_the_oracle():
    rows = [row for row in ROWS if row["kind"] == "hard_tiny_h"]
    assert worst_factor(nearest_mode([row | {"h": 0.0} for row in rows]), rows, "psi") > 1000.0 * FACTOR


def test_five_link_without_its_offsets_is_the_crank_rocker_to_the_last_bit():
    designs = random_designs(300, 3)
    phi = np.linspace(0.0, 6.2, 25)
    names = [
        "psi",
        "dpsi",
        "d2psi",
        "d3psi",
        "sin_psi",
        "cos_psi",
        "discriminant",
        "pressure_angle",
        "x_b",
        "y_b",
        "z_b",
    ]
    names += ["x_c", "y_c", "z_c"]
    angles, wanted = Angles.of(phi[None, :]), frozenset(names)
    alone = np.column_stack([designs[:, :7], np.zeros((300, 2)), designs[:, 7], np.ones(300)])
    one, other = family("rssr").poses(designs, angles, wanted), family("five_link").poses(alone, angles, wanted)
    np.testing.assert_array_equal(one["status"], other["status"])
    for name in names:
        known = other["status"] == st.OK if name in ("x_b", "y_b", "z_b") else np.ones_like(other["status"], bool)
        np.testing.assert_array_equal(one[name][known], other[name][known], err_msg=name)


def random_five_links(n, seed):
    """Links of every proportion, half of them with a long h, half with an s2."""
    r = np.random.default_rng(seed)
    a, b = r.uniform(0.1, 1.5, n), r.uniform(0.3, 4.0, n)
    e, f, g = r.uniform(-2.0, 2.0, (3, n))
    alpha, h = r.uniform(-3.0, 3.0, n), r.uniform(-1.0, 1.0, n) * r.choice([0.05, 1.0], n)
    s2 = r.uniform(-0.5, 0.5, n) * r.choice([0.0, 1.0], n)
    return np.column_stack([a, b, np.ones(n), e, f, g, alpha, h, s2]), r.uniform(0.0, 6.28, n)


def test_five_link_finds_every_assembly_mode_and_no_other():
    links, phi = random_five_links(150, 7)
    table = {name: np.repeat(links[:, k], len(CHOICES)) for k, name in enumerate(GEOMETRY)}
    table |= {"branch": [b for _ in links for b, _ in CHOICES], "mode": [m for _ in links for _, m in CHOICES]}
    frame = sweep.evaluate("five_link", table | {"phi": np.repeat(phi, len(CHOICES))}, ["psi", "pressure_angle"])
    seen = set()
    for k, (design, angle) in enumerate(zip(links, phi, strict=True)):
        modes = naive.modes(tuple(design), angle)
        seen.add(len(modes))
        for (_, row), choice in zip(frame.iloc[6 * k : 6 * k + 6].iterrows(), CHOICES, strict=True):
            assert row.status == (st.OK if choice in modes else st.NOT_ASSEMBLED), (k, choice)
            if choice in modes:
                # the naive root is good to 1e-15, both to the sensitivity of the angle, here below 1e5
                assert abs(np.exp(1j * row.psi) - np.exp(1j * modes[choice])) < 1e-10, (k, choice)
                force = naive.pressure_angle(tuple(design), angle, row.psi)
                assert row.pressure_angle == pytest.approx(force, abs=1e-9), (k, choice)
    assert seen >= {0, 2}


def with_four_solutions():
    """A short coupler far from the axis of a long rocker: the crank pin sees four places for the ball."""
    links, phi = random_five_links(4000, 11)
    links[:, 7] = 1.0 + np.abs(links[:, 7])
    for design, angle in zip(links, phi, strict=True):
        values = dict(zip(GEOMETRY, design, strict=True)) | {
            "branch": [1.0, -1.0, 1.0, -1.0],
            "mode": [1.0, 1.0, 2.0, 2.0],
        }
        frame = sweep.evaluate("five_link", values, ["psi"], phi=[angle])
        if (frame.status == st.OK).all():
            return design, angle, frame.psi
    raise AssertionError("no five-link with four solutions was found")


def test_five_link_modes_tell_four_solutions_apart():
    design, angle, psi = with_four_solutions()
    modes = naive.modes(tuple(design), angle)
    assert len(modes) == 4
    expected = [modes[choice] for choice in ((1.0, 1.0), (-1.0, 1.0), (1.0, 2.0), (-1.0, 2.0))]
    np.testing.assert_allclose(np.exp(1j * psi), np.exp(1j * np.array(expected)), atol=1e-10)


def test_five_link_derivatives_match_numerical_differentiation_in_fifty_digits():
    links, phi = random_five_links(60, 3)
    checked = 0
    for design, angle in zip(links, phi, strict=True):
        values = dict(zip(GEOMETRY, design, strict=True))
        row = sweep.evaluate("five_link", values, [*ORDERS, "pressure_angle"], phi=[angle]).iloc[0]
        if row.status != st.OK or row.pressure_angle > 1.3:
            continue
        expected = naive.outputs(tuple(design), angle, row.psi)
        checked += 1
        for name in ORDERS:
            # 2^-53 times a sensitivity that this far from dead points stays below 1e5, times the slope of d3psi
            assert float(abs(row[name] - expected[name])) < 1e-9 * (1.0 + abs(row.d3psi)), name
    assert checked > 10


@pytest.mark.parametrize("h", [0.2, -0.3])
def test_five_link_with_a_long_rocker_on_a_far_axis_keeps_its_digits(h):
    # The terms of the closure are as long as the rocker and had left the coupler to a few of their digits: 800 units.
    # The inputs are rounded once, the vector along the coupler adds a few roundings of the same size: 16 asked.
    generator, checked = np.random.default_rng(6), 0
    for _ in range(12):
        c, branch = 10.0 ** generator.uniform(1.5, 3.0), generator.choice([-1.0, 1.0])
        e, phi = generator.uniform(-1.5, 1.5) - c, generator.uniform(-9.0, 9.0)
        design = (1.0, 2.5, c, e, 0.4, -0.3, generator.choice([0.0, 0.5]), h, 0.0)
        table = dict(zip(GEOMETRY, design, strict=True)) | {"branch": branch}
        row = sweep.evaluate("five_link", table, [*ORDERS], phi=[phi]).iloc[0]
        if row.status == st.OK:
            expected = naive.outputs(design, phi, row.psi)
            found = factors("five_link", (*design, branch, 1.0), phi, expected, row, positions=False)
            assert max(found.values()) <= 16.0, (design, phi, found)
            checked += 1
    assert checked >= 6


def test_five_link_kernel_jitted_equals_plain_python():
    links, phi = random_five_links(12, 5)
    designs = np.column_stack([links, np.ones(12), np.ones(12)])
    results = []
    for function in (five_link.poses, five_link.poses.py_func):
        out, places = [np.empty((12, 12)) for _ in range(8)], np.empty((11, 12, 12))
        status = np.empty((12, 12), np.uint8)
        function(designs, np.cos(phi)[None, :], np.sin(phi)[None, :], status, motion.Outputs(*out, places))
        results.append([status, *out, places])
    for compiled, plain in zip(*results, strict=True):
        np.testing.assert_array_equal(compiled, plain)


def test_five_link_complex_step_gives_the_next_derivative_and_the_partial_ones():
    links, phi = random_five_links(200, 9)
    designs = np.column_stack([links, np.ones(200), np.ones(200)])
    wanted = frozenset([*ORDERS, "pressure_angle", "discriminant", "theta"])
    mechanism = family("five_link")
    real = mechanism.poses(designs, Angles.of(phi[:, None]), wanted)
    good = (real["status"] == st.OK) & (np.cos(real["pressure_angle"]) > 0.3)
    assert good.sum() > 20
    turned = mechanism.poses(designs, Angles.of(phi[:, None] + 1e-100j), wanted)
    for lower, upper in (("psi", "dpsi"), ("dpsi", "d2psi"), ("d2psi", "d3psi")):
        np.testing.assert_allclose(turned[lower].imag[good] / 1e-100, real[upper][good], rtol=1e-9, atol=1e-9)
    step = 1e-6
    for k in range(9):
        direction = np.eye(11)[k]
        exact = mechanism.poses(designs + 1e-100j * direction, Angles.of(phi[:, None]), wanted)
        ends = [mechanism.poses(designs + d * direction, Angles.of(phi[:, None]), wanted) for d in (-step, step)]
        near = good & (ends[0]["status"] == st.OK) & (ends[1]["status"] == st.OK)
        for name in ("psi", "discriminant", "pressure_angle"):
            slope = exact[name].imag[near] / 1e-100
            quotient = (ends[1][name][near] - ends[0][name][near]) / (2.0 * step)
            # second order in the step; third derivatives of these linkages stay below 1e6
            assert np.abs(slope - quotient).max() < 1e-5 * (1.0 + np.abs(slope).max()), (NAMES[k], name)


@pytest.mark.parametrize("exponent", [-330, -40, 40, 330])
def test_five_link_scaled_by_a_power_of_two_keeps_every_bit(exponent):
    links, phi = random_five_links(40, 2)
    designs = np.column_stack([links, np.ones(40), np.ones(40)])
    scaled = designs.copy()
    for k in (0, 1, 2, 3, 4, 5, 7, 8):
        scaled[:, k] = np.ldexp(designs[:, k], exponent)
    wanted = frozenset([*ORDERS, "pressure_angle", "theta", "beta"])
    one, other = (family("five_link").poses(x, Angles.of(phi[None, :]), wanted) for x in (designs, scaled))
    for name in (*wanted, "status"):
        np.testing.assert_array_equal(one[name], other[name], err_msg=name)


def test_five_link_mirrored_turns_the_other_way():
    # the mirror image in the plane of the common perpendicular and the bisector: alpha, f, psi and branch change sign
    links, phi = random_five_links(60, 4)
    designs = np.column_stack([links, np.ones(60), np.ones(60)])
    mirrored = designs.copy()
    mirrored[:, 6] = math.pi - designs[:, 6]
    mirrored[:, 4] = -designs[:, 4]
    mirrored[:, 9] = -1.0
    wanted = frozenset(["psi", "dpsi"])
    one, other = (family("five_link").poses(x, Angles.of(phi[None, :]), wanted) for x in (designs, mirrored))
    np.testing.assert_array_equal(one["status"], other["status"])
    ok = one["status"] == st.OK
    np.testing.assert_allclose(np.exp(1j * one["psi"][ok]), np.exp(-1j * other["psi"][ok]), atol=1e-9)


def test_five_link_in_a_plane_is_the_four_bar_with_a_longer_coupler():
    phi = np.linspace(0.0, 6.2, 25)
    links = {"a": 1.0, "c": 2.5, "e": 3.0, "f": 0.0, "g": 0.0, "alpha": 0.0, "branch": [1.0, -1.0]}
    bent = sweep.evaluate("five_link", links | {"b": 2.5, "h": 0.5}, ["psi", "d3psi", "pressure_angle"], phi)
    straight = sweep.evaluate("rssr", links | {"b": 3.0}, ["psi", "d3psi", "pressure_angle"], phi)
    np.testing.assert_allclose(
        bent[["psi", "d3psi", "pressure_angle"]], straight[["psi", "d3psi", "pressure_angle"]], atol=4e-14
    )


@pytest.mark.parametrize(
    ("change", "status"),
    [
        ({}, st.OK),
        ({"e": 7.0}, st.NOT_ASSEMBLED),
        ({"g": 2.5}, st.NOT_ASSEMBLED),  # the ball is farther along the crank axis than the coupler is long
        ({"g": 2.0}, st.NOT_ASSEMBLED),
        ({"e": 6.5}, st.DEAD_POINT),
        ({"mode": 2.0}, st.NOT_ASSEMBLED),
        ({"c": 1e-310}, st.INVALID_INPUT),
        ({"h": 1e300}, st.INVALID_INPUT),
    ],
)
def test_five_link_status_explains_every_nan(change, status):
    table = {"a": 1.0, "b": 2.0, "c": 3.0, "e": 3.0, "f": 0.0, "g": 0.0, "alpha": 0.0, "h": 0.5, "s2": 0.0} | change
    names = [o.name for o in family("five_link").pose_outputs]
    row = sweep.evaluate("five_link", table, names, phi=[0.0]).iloc[0]
    assert row.status == status
    if status == st.OK:
        assert np.isfinite(row[names]).all()
    elif status == st.DEAD_POINT:
        assert row[["psi", "pressure_angle"]].notna().all()
        assert row[["dpsi", "d2psi", "d3psi"]].isna().all()
    else:
        assert row[["psi", *list(ORDERS), "pressure_angle", "theta", "x_c"]].isna().all()


def test_five_link_near_a_dead_point_keeps_what_the_inputs_fix():
    # A spatial one, from its dead point on inwards: Newton alone would not settle there.
    design = {"a": 1.0, "b": 3.0, "c": 2.0, "e": 2.2, "f": 0.4, "g": -0.3, "alpha": 1.1, "h": 0.4, "s2": 0.2}
    phi = np.linspace(0.0, 2.0 * math.pi, 2000)
    frame = sweep.evaluate("five_link", design | {"a": 2.5}, ["psi", "discriminant"], phi)
    edge = np.flatnonzero(np.diff(frame.status == st.OK))
    assert edge.size >= 2
    inside, outside = (
        (phi[edge[0]], phi[edge[0] + 1]) if frame.status[edge[0]] == st.OK else (phi[edge[0] + 1], phi[edge[0]])
    )
    for _ in range(60):
        middle = 0.5 * (inside + outside)
        row = sweep.evaluate("five_link", design | {"a": 2.5}, ["psi"], [middle]).iloc[0]
        inside, outside = (middle, outside) if row.status == st.OK else (inside, middle)
    for distance in (1e-4, 1e-8, 1e-11):
        angle = inside + math.copysign(distance, inside - outside)
        row = sweep.evaluate("five_link", design | {"a": 2.5}, ["psi"], [angle]).iloc[0]
        assert row.status == st.OK
        values = tuple((design | {"a": 2.5})[name] for name in GEOMETRY)
        expected = float(naive.outputs(values, angle, row.psi)["psi"])
        # psi goes like the root of the distance, so one rounding of phi moves it by 2^-53 phi over that
        assert abs(row.psi - expected) < 200.0 * 2.0**-53 * 6.3 / math.sqrt(distance)


def test_five_link_with_complex_numbers_has_a_status_where_the_coupler_reaches_just_not_at_all():
    """At the end of the arc rho is exactly 0, and a compiled division by a complex zero would raise an exception."""
    generator = np.random.default_rng(12)
    names = family("five_link").parameter_names
    for _ in range(60):
        table = {
            "a": 1.0,
            "b": 2.0 ** generator.integers(-1, 2),
            "c": 2.0,
            "e": 1.0,
            "f": float(generator.integers(-2, 3)),
        }
        table |= {
            "g": float(generator.integers(-2, 3)),
            "alpha": math.pi / 2,
            "h": 0.5,
            "s2": 0.0,
            "mode": 1.0,
            "branch": 1.0,
        }
        design = np.array([[table[name] for name in names]], complex)
        phi = np.linspace(0.0, 2.0 * np.pi, 9)[None, :] + 0j
        columns = family("five_link").poses(design, Angles.of(phi), frozenset(family("five_link").pose_names))
        plain = family("five_link").poses(design.real.copy(), Angles.of(phi.real), frozenset(("psi",)))
        np.testing.assert_array_equal(columns["status"], plain["status"])
