"""Looper on a cylinder against joint coordinates, the formula of a rocker that slides, invariants and gradients."""

from __future__ import annotations

import math

import numpy as np
import pytest
from mpmath import mp

import sweep
from kernels import status as st
from kernels.families import cylindrical_looper
from sweep.families import family
from tests.reference import cylindrical_looper as naive
from tests.support.family_checks import (
    assert_compiled_equals_plain,
    assert_gradients_are_those_of_the_reference,
    factors,
)

NAMES = family("cylindrical_looper").parameter_names
ON_AXIS = {"d2": 0.0, "beta2": 0.0, "gamma2": 0.0, "mode": 1.0}
SHAPES = [(4,), (2,), (4,), (2,), (3,), (3,), (3,), (3,), (3,), (6,)]
ALL = [o.name for o in family("cylindrical_looper").pose_outputs]
POINT = ["x_p", "y_p", "z_p"]
TABLE = {
    "a1": 1.0, "b1": 4.2, "c1": 2.5, "e1": 3.5, "f1": 0.5, "g1": -0.3, "alpha1": 1.0, "branch1": 1.0,
    "a2": 0.5, "b2": 3.0, "e2": 0.3, "f2": 0.1, "alpha2": 0.2, "offset2": 0.5, "branch2": 1.0, "slides": 1.0,
    "p0x": 2.0, "p0y": 0.3, "p0z": 3.0,
} | ON_AXIS  # fmt: skip
DESIGN = tuple(TABLE.values())


def evaluated(design, phi, want):
    return sweep.evaluate("cylindrical_looper", dict(zip(NAMES, design, strict=True)), want, phi=np.atleast_1d(phi))


def loopers(count, seed, on_axis=True):
    """Loopers that assemble at the crank angle given with them, not near a dead point."""
    generator = np.random.default_rng(seed)
    while count:
        table = {name: generator.uniform(-3.0, 3.0) for name in NAMES}
        table |= {"a1": 1.0, "b1": generator.uniform(1.0, 8.0), "c1": generator.uniform(1.0, 3.0)}
        table |= {"a2": generator.uniform(0.2, 1.5), "b2": generator.uniform(2.0, 6.0)}
        table |= {name: generator.choice([-1.0, 1.0]) for name in ("branch1", "branch2")}
        table |= {"slides": generator.choice([0.0, 1.0])} | (
            ON_AXIS if on_axis else {"mode": generator.choice([1.0, 2.0])}
        )
        design, phi = tuple(table.values()), generator.uniform(-3.0, 3.0)
        row = evaluated(design, phi, ALL).iloc[0]
        if row.status == st.OK and max(row.pressure_angle1, row.pressure_angle2) < 1.5:
            count -= 1
            yield design, phi


def test_cylindrical_looper_equals_joint_geometry():
    # The inputs are rounded once and two closures in series add a few roundings each; 16 is asked, 3 measured.
    for design, phi in loopers(12, 1):
        expected = naive.outputs(design, phi)
        found = factors("cylindrical_looper", design, phi, expected, evaluated(design, phi, ALL).iloc[0])
        assert max(found.values()) <= 16.0, (design, phi, found)


@pytest.mark.parametrize("long", [30.0, 300.0, 900.0])
def test_cylindrical_looper_with_a_long_rocker_on_a_far_shaft_keeps_its_digits(long):
    # A rocker that stays is a crank-rocker, whose poses keep their digits by twice as many: the difference of the
    # squares of rocker and frame had lost 300 units.  Both add a few roundings to those of the inputs: 16 asked.
    generator, checked = np.random.default_rng(5), 0
    for _ in range(8):
        links = {"a": 1.0, "b": 3.0, "c": long, "e": generator.uniform(-2.0, 2.0) - long, "f": 0.5, "g": -0.3}
        links |= {"alpha": generator.choice([0.0, 0.3]), "branch": generator.choice([-1.0, 1.0])}
        phi, angles = generator.uniform(-9.0, 9.0), ["psi", "dpsi", "d2psi", "d3psi"]
        rocker = sweep.evaluate("rssr", links, angles, phi=[phi]).iloc[0]
        design = tuple((TABLE | {f"{name}1": x for name, x in links.items()} | {"slides": 0.0}).values())
        row = evaluated(design, phi, angles).iloc[0]
        if row.status == rocker.status == st.OK:
            expected = {name: mp.mpf(rocker[name]) for name in angles}
            found = factors("cylindrical_looper", design, phi, expected, row, positions=False)
            assert max(found.values()) <= 16.0, (design, phi, found)
            checked += 1
    assert checked >= 4


def test_cylindrical_looper_keeps_its_distance_from_the_shaft():
    for design, phi in loopers(20, 2):
        table = dict(zip(NAMES, design, strict=True))
        row = evaluated(design, phi, ALL).iloc[0]
        away = math.hypot(row.x_p - table["e1"], row.y_p)
        # a rotation keeps lengths to a few roundings of the coordinates, which are at most 8
        assert away == pytest.approx(math.hypot(table["p0x"], table["p0y"]), rel=0, abs=64.0 * 2.0**-53 * 8.0)
        assert row.z_p == pytest.approx(table["g1"] + table["p0z"] + row.s, abs=1e-14)
        assert (row.dz_p, row.d2z_p, row.d3z_p) == (row.ds, row.d2s, row.d3s)


def test_cylindrical_looper_velocity_and_acceleration_are_those_of_a_screw_motion():
    """P' = psi' n x r + s' n;  P'' = psi'' n x r + psi'^2 n x (n x r) + s'' n."""
    for design, phi in loopers(20, 3):
        row = evaluated(design, phi, ALL).iloc[0]
        r = np.array([row.x_p - design[3], row.y_p, 0.0])
        n = np.array([0.0, 0.0, 1.0])
        velocity = row.dpsi * np.cross(n, r) + row.ds * n
        acceleration = row.d2psi * np.cross(n, r) + row.dpsi**2 * np.cross(n, np.cross(n, r)) + row.d2s * n
        np.testing.assert_allclose([row[f"d{x}_p"] for x in "xyz"], velocity, rtol=1e-12, atol=1e-13)
        np.testing.assert_allclose([row[f"d2{x}_p"] for x in "xyz"], acceleration, rtol=1e-11, atol=1e-12)
        assert row.speed_p == pytest.approx(np.linalg.norm(velocity), rel=1e-12)
        assert row.acceleration_p == pytest.approx(np.linalg.norm(acceleration), rel=1e-11)


def test_cylindrical_looper_rocker_that_slides_follows_the_formula():
    """psi' = psi'|g const - h_g s'/(c T) with h_g = g - f ca + a sa sin(phi), g being g1 + s."""
    for design, phi in loopers(40, 4):
        table = dict(zip(NAMES, design, strict=True)) | {"slides": 1.0}
        row = sweep.evaluate("cylindrical_looper", table, ALL, phi=[phi]).iloc[0]
        if row.status != st.OK:
            continue
        g = table["g1"] + row.s
        still = {name: table[f"{name}1"] for name in ("a", "b", "c", "e", "f", "g", "alpha", "branch")} | {"g": g}
        alone = sweep.evaluate("rssr", still, ["psi", "dpsi", "pressure_angle"], phi=[phi]).iloc[0]
        sa, ca = math.sin(table["alpha1"]), math.cos(table["alpha1"])
        h = g - table["f1"] * ca + table["a1"] * sa * math.sin(phi)
        t = table["branch1"] * table["b1"] * math.cos(alone.pressure_angle)
        assert row.psi == pytest.approx(alone.psi, abs=1e-12)
        assert row.dpsi == pytest.approx(alone.dpsi - h * row.ds / (table["c1"] * t), rel=1e-9, abs=1e-10)


def test_cylindrical_looper_with_a_rocker_that_stays_is_crank_rocker_and_slider_crank():
    table = TABLE | {"slides": 0.0}
    phi = np.linspace(0.0, 6.0, 13)
    frame = sweep.evaluate("cylindrical_looper", table, ALL, phi=phi)
    rocker = {name: table[f"{name}1"] for name in ("a", "b", "c", "e", "f", "g", "alpha", "branch")}
    slider = {name: table[f"{name}2"] for name in ("a", "b", "e", "f", "alpha", "branch")}
    swung = sweep.evaluate("rssr", rocker, ["psi", "dpsi", "d2psi", "d3psi"], phi=phi)
    moved = sweep.evaluate("rssp", slider, ["s", "ds", "d2s", "d3s"], phi=phi + table["offset2"])
    for name in ("psi", "dpsi", "d2psi", "d3psi"):
        np.testing.assert_allclose(frame[name], swung[name], rtol=1e-12, atol=1e-13)
    for name in ("s", "ds", "d2s", "d3s"):
        np.testing.assert_allclose(frame[name], moved[name], rtol=1e-12, atol=1e-13)


def test_cylindrical_looper_jitted_equals_plain():
    designs = np.array([DESIGN, *(d for d, _ in loopers(3, 6))])
    designs = np.vstack([designs, designs[0] * np.where(np.arange(len(NAMES)) == 9, 1e-3, 1.0)])
    phi = np.random.default_rng(3).uniform(-4.0, 4.0, (5, 3))
    assert_compiled_equals_plain(cylindrical_looper.poses, designs, phi, SHAPES)


@pytest.mark.parametrize("slides", [0.0, 1.0])
def test_cylindrical_looper_complex_step_gives_exact_gradients(slides):
    design, phi = tuple((TABLE | {"slides": slides}).values()), 2.3
    row = evaluated(design, phi, ALL).iloc[0]
    near = {"psi": mp.mpf(row.psi), "s": mp.mpf(row.s)}

    def reference(numbers, angle):
        h = mp.mpf(10) ** -25
        pose, ahead = (naive.coupled(numbers, x, near) for x in (angle, angle + h))
        return pose | {"dx_p": (ahead["x_p"] - pose["x_p"]) / h}

    outputs = ["psi", "s", *POINT, "dx_p"]
    assert_gradients_are_those_of_the_reference("cylindrical_looper", design, phi, reference, outputs)


def test_cylindrical_looper_status_says_what_fails():
    apart = sweep.evaluate("cylindrical_looper", TABLE | {"b2": 1e-3}, ALL, phi=[0.4]).iloc[0]
    assert apart.status == st.NOT_ASSEMBLED and apart[["s", "psi", *POINT]].isna().all()
    stays = sweep.evaluate("cylindrical_looper", TABLE | {"b2": 1e-3, "slides": 0.0}, ["psi"], phi=[0.4]).iloc[0]
    assert stays.status == st.OK
    swung = sweep.evaluate("cylindrical_looper", TABLE | {"b1": 1e-3}, ALL, phi=[0.4]).iloc[0]
    assert swung.status == st.NOT_ASSEMBLED and np.isfinite(swung.s) and np.isnan(swung.psi)
    moved = sweep.evaluate("cylindrical_looper", TABLE | {"b1": 1e-3}, ["s"], phi=[0.4]).iloc[0]
    assert moved.status == st.OK
    row = sweep.evaluate("cylindrical_looper", TABLE | {"e2": 1e300}, ALL, phi=[0.4]).iloc[0]
    assert row.status == st.INVALID_INPUT and row[ALL].isna().all()
