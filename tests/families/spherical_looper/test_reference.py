"""Looper on a sphere against joint coordinates, the formulas of its drive, invariants, plain Python and gradients."""

from __future__ import annotations

import math

import numpy as np
import pytest
from mpmath import mp

import sweep
from kernels import status as st
from kernels.families import spherical_looper
from sweep.families import family
from tests.reference import spherical_looper as naive
from tests.reference.space import exact, length, turned
from tests.support.family_checks import (
    assert_compiled_equals_plain,
    assert_gradients_are_those_of_the_reference,
    factors,
)

NAMES = family("spherical_looper").parameter_names
SHAPES = [(4,), (2,), (4,), (2,), (3,), (3,), (3,), (3,), (3,), (12,)]
ALL = [o.name for o in family("spherical_looper").pose_outputs]
POINT = ["x_p", "y_p", "z_p"]


def by_construction(generator):
    """A looper whose joints are placed first, so that both loops close at the crank angle given with it."""
    values = dict.fromkeys(NAMES, 0.0)
    for name in ("e1", "f1", "g1", "o", "x2", "y2", "z2", "p0x", "p0y", "p0z"):
        values[name] = generator.uniform(-4.0, 4.0)
    for name in ("c0x", "c0y", "c0z"):
        values[name] = generator.uniform(-3.0, 3.0)
    for name in ("alpha1", "delta", "gamma", "theta2", "beta2", "offset2"):
        values[name] = generator.uniform(-3.0, 3.0)
    values |= {"a1": 1.0, "b1": 1.0, "c1": generator.uniform(1.5, 3.0), "a2": generator.uniform(0.3, 1.5), "b2": 1.0}
    psi, chi, phi = generator.uniform(-3.0, 3.0, 3)
    with mp.workdps(30):
        v = {name: mp.mpf(x) for name, x in values.items()}
        pin1 = naive.crank_pin(v["a1"], v["f1"], v["alpha1"], phi)
        ball1 = naive.vector(v["e1"], 0, v["g1"]) + turned(naive.UP, psi, naive.vector(v["c1"], 0, 0))
        pin2 = naive.second_pin(
            v["a2"], naive.vector(v["x2"], v["y2"], v["z2"]), v["theta2"], v["beta2"], phi + v["offset2"]
        )
        axis = naive.axis_of(v["delta"], v["gamma"])
        ball2 = turned(naive.UP, psi, turned(axis, chi, naive.vector(v["c0x"], v["c0y"], v["c0z"])))
        ball2 += naive.vector(v["e1"], 0, v["o"])
        values["b1"], values["b2"] = float(length(ball1 - pin1)), float(length(ball2 - pin2))
    design = [values[name] for name in NAMES]
    for branch1 in (1.0, -1.0):
        for branch2 in (1.0, -1.0):
            design[7], design[-1] = branch1, branch2
            row = evaluated(design, phi, ALL).iloc[0]
            near = abs(math.remainder(row.psi - psi, 2 * math.pi)) + abs(math.remainder(row.chi - chi, 2 * math.pi))
            if near < 1e-6 and max(row.pressure_angle1, row.pressure_angle2) < 1.5:
                return tuple(design), phi
    return None


def evaluated(design, phi, want):
    return sweep.evaluate("spherical_looper", dict(zip(NAMES, design, strict=True)), want, phi=np.atleast_1d(phi))


def loopers(count, seed):
    generator = np.random.default_rng(seed)
    while count:
        found = by_construction(generator)
        if found is not None:
            count -= 1
            yield found


DESIGN, PHI = next(loopers(1, 11))


def test_spherical_looper_equals_joint_geometry():
    # The inputs are rounded once and two closures in series add a few roundings each; 16 is asked, 3 measured.
    for design, phi in loopers(10, 1):
        expected = naive.outputs(design, phi)
        found = factors("spherical_looper", design, phi, expected, evaluated(design, phi, ALL).iloc[0])
        assert max(found.values()) <= 16.0, (design, phi, found)


def test_spherical_looper_keeps_its_distance_from_the_common_point():
    for design, phi in loopers(20, 2):
        table = dict(zip(NAMES, design, strict=True))
        frame = evaluated(design, np.linspace(phi - 0.3, phi + 0.3, 7), ALL)
        frame = frame[frame.status == st.OK]
        assert len(frame) > 0
        away = frame[POINT].to_numpy() - [table["e1"], 0.0, table["o"]]
        radius = math.hypot(table["p0x"], table["p0y"], table["p0z"])
        # a rotation keeps lengths to a few roundings of the coordinates, which are at most 12
        np.testing.assert_allclose(np.linalg.norm(away, axis=1), radius, rtol=0, atol=64.0 * 2.0**-53 * 12.0)
        velocity = frame[["dx_p", "dy_p", "dz_p"]].to_numpy()
        scale = np.linalg.norm(velocity, axis=1) * radius
        assert (np.abs((velocity * away).sum(axis=1)) <= 1e-12 * scale).all()


def test_spherical_looper_couplers_keep_their_lengths():
    for design, phi in loopers(20, 3):
        row = evaluated(design, phi, ALL).iloc[0]
        for coupler, number in ((design[1], 1), (design[18], 2)):
            ends = [np.array([row[f"{x}_{ball}{number}"] for x in "xyz"]) for ball in "bc"]
            assert np.linalg.norm(ends[1] - ends[0]) == pytest.approx(coupler, rel=1e-13)


def test_spherical_looper_follows_the_formulas_of_its_drive():
    """The closure in chi and chi' as the sheet of the generalised schemes states them, in 40 digits."""
    for design, phi in loopers(10, 4):
        row = evaluated(design, phi, ALL).iloc[0]
        with mp.workdps(40):
            v = dict(zip(NAMES, exact(design), strict=True))
            n1, n2, psi = naive.UP, naive.axis_of(v["delta"], v["gamma"]), mp.mpf(row.psi)
            centre = naive.vector(v["e1"], 0, v["o"])
            c0 = naive.vector(v["c0x"], v["c0y"], v["c0z"])
            w = n2 * naive_dot(c0, n2)
            p = c0 - w
            q = naive_cross(n2, p)
            pin = [
                naive.second_pin(v["a2"], naive.vector(v["x2"], v["y2"], v["z2"]), v["theta2"], v["beta2"], angle)
                for angle in (phi + v["offset2"], phi + v["offset2"] + mp.mpf(10) ** -20)
            ]
            d = turned(n1, -psi, pin[0] - centre)
            left = 2 * naive_dot(d - w, p) * mp.cos(row.chi) + 2 * naive_dot(d - w, q) * mp.sin(row.chi)
            right = length(d - w) ** 2 + length(p) ** 2 - v["b2"] ** 2
            # psi and chi of the row are rounded; the terms are squares of lengths of at most 12
            assert abs(left - right) < 1e-12
            ball = centre + turned(n1, psi, turned(n2, mp.mpf(row.chi), c0))
            e, rc = pin[0] - ball, ball - centre
            velocity = (pin[1] - pin[0]) * mp.mpf(10) ** 20
            axis = turned(n1, psi, n2)
            numerator = naive_dot(velocity, e) - mp.mpf(row.dpsi) * naive_dot(naive_cross(n1, rc), e)
            dchi = numerator / naive_dot(naive_cross(axis, rc), e)
            assert float(abs(dchi - row.dchi)) <= 1e-11 * max(1.0, abs(row.dchi))


def naive_dot(a, b):
    return (a.T * b)[0]


def naive_cross(a, b):
    return naive.vector(a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0])


def test_spherical_looper_magnitudes_are_those_of_the_components():
    frame = evaluated(DESIGN, PHI, ALL)
    for name, prefix in (("speed_p", "d"), ("acceleration_p", "d2"), ("jerk_p", "d3")):
        components = frame[[f"{prefix}{x}_p" for x in "xyz"]].to_numpy()
        np.testing.assert_allclose(frame[name], np.linalg.norm(components, axis=1), rtol=1e-15)


def test_spherical_looper_carrier_is_the_crank_rocker():
    for design, phi in loopers(10, 5):
        carrier = dict(zip(("a", "b", "c", "e", "f", "g", "alpha", "branch"), design[:8], strict=True))
        names = ["psi", "dpsi", "d2psi", "d3psi", "pressure_angle"]
        alone = sweep.evaluate("rssr", carrier, names, phi=[phi]).iloc[0]
        row = evaluated(design, phi, ALL).iloc[0]
        for name in names[:4]:
            assert row[name] == pytest.approx(alone[name], rel=1e-11, abs=1e-12)
        assert row.pressure_angle1 == pytest.approx(alone.pressure_angle, abs=1e-12)


def test_spherical_looper_jitted_equals_plain():
    designs = np.array([DESIGN, *(d for d, _ in loopers(2, 6))])
    designs = np.vstack([designs, designs[0] * np.where(np.arange(26) == 18, 1e-3, 1.0)])
    phi = np.vstack([PHI + np.linspace(-0.2, 0.2, 3)] * 4)
    assert_compiled_equals_plain(spherical_looper.poses, designs, phi, SHAPES)


def test_spherical_looper_complex_step_gives_exact_gradients():
    row = evaluated(DESIGN, PHI, ALL).iloc[0]
    near = {"psi": mp.mpf(row.psi), "chi": mp.mpf(row.chi)}

    def reference(numbers, phi):
        h = mp.mpf(10) ** -25
        pose, ahead = (naive.position(numbers, x, near) for x in (phi, phi + h))
        return pose | {"dx_p": (ahead["x_p"] - pose["x_p"]) / h}

    outputs = ["psi", "chi", *POINT, "dx_p"]
    assert_gradients_are_those_of_the_reference("spherical_looper", DESIGN, PHI, reference, outputs)


def test_spherical_looper_status_says_which_loop_fails():
    table = dict(zip(NAMES, DESIGN, strict=True))
    apart = sweep.evaluate("spherical_looper", table | {"b2": 1e-3}, ALL, phi=[PHI]).iloc[0]
    assert apart.status == st.NOT_ASSEMBLED and np.isfinite(apart.psi) and np.isnan(apart.chi)
    assert apart[[*POINT, "speed_p", "x_c2"]].isna().all() and apart.discriminant2 < 0.0
    alone = sweep.evaluate("spherical_looper", table | {"b2": 1e-3}, ["psi"], phi=[PHI]).iloc[0]
    assert alone.status == st.OK  # nothing wanted depends on the looper's loop
    carrier = sweep.evaluate("spherical_looper", table | {"b1": 1e-3}, ALL, phi=[PHI]).iloc[0]
    assert carrier.status == st.NOT_ASSEMBLED and carrier[["psi", "chi", *POINT]].isna().all()
    axis = [math.sin(table["delta"]) * math.cos(table["gamma"]), math.sin(table["delta"]) * math.sin(table["gamma"]),
            math.cos(table["delta"])]  # fmt: skip
    on_axis = table | dict(zip(("c0x", "c0y", "c0z"), axis, strict=True))
    row = sweep.evaluate("spherical_looper", on_axis, ALL, phi=[PHI]).iloc[0]
    assert row.status == st.SINGULAR and row[["chi", *POINT]].isna().all()
    row = sweep.evaluate("spherical_looper", table | {"x2": 1e300}, ALL, phi=[PHI]).iloc[0]
    assert row.status == st.INVALID_INPUT and row[ALL].isna().all()
