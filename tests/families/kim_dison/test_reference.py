"""Crank-rocker of Kim and Dison against its 25-digit table, its points, and the crank-rocker it is."""

from __future__ import annotations

import json
import math
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as some
from mpmath import mp, mpf

import sweep
from kernels import status as st
from sweep.evaluation.summaries import design_outputs
from sweep.families import family
from sweep.families.base import Accuracy, Angles
from tests.reference import kim_dison as naive

ROWS = json.loads((Path(__file__).parents[2] / "oracle" / "kim_dison_open.json").read_text())["rows"]
LINKS = ("r", "l", "h", "a", "b")
OUTPUTS = ("alpha", "dalpha", "d2alpha", "sin_transmission")
# Inputs rounded once would make errors of 1 x 2^-53 cond; the closure adds a handful of roundings of the same size.
FACTOR = 8.0


def table(rows):
    names = [*LINKS, "branch", *(["phi"] if "phi" in rows[0]["in"] else [])]
    return {name: [row["in"][name] for row in rows] for name in names}


def conditions(rows):
    """Sum of |x dy/dx| over the links and the crank angle, by the complex step: what rounding the inputs once does."""
    mechanism = family("kim_dison")
    matrix = np.array([[row["in"][name] for name in LINKS] + [1.0, 0.0, row["in"]["branch"]] for row in rows])
    phi = np.array([[row["in"]["phi"]] for row in rows])
    total = dict.fromkeys(OUTPUTS, 0.0)
    for k in range(6):
        turned = phi * (1.0 + 1e-100j * (k == 5))
        found = mechanism.poses(matrix * (1.0 + 1e-100j * (np.arange(8) == k)), Angles.of(turned), frozenset(OUTPUTS))
        total = {name: total[name] + np.abs(found[name].imag[:, 0]) / 1e-100 for name in OUTPUTS}
    return total


@pytest.mark.parametrize("output", OUTPUTS)
def test_kim_dison_matches_oracle_on_every_pose(output):
    rows = [row for row in ROWS if row["kind"] == "position"]
    assert {row["tag"] for row in rows} > {"near_dead_point_1e-11", "b_zero", "scaled"}
    frame, sensitivity = sweep.evaluate("kim_dison", table(rows), list(OUTPUTS)), conditions(rows)
    assert (frame.status == st.OK).all()
    with mp.workdps(40):
        for k, row in enumerate(rows):
            lower = [n for n in OUTPUTS[1 : OUTPUTS.index(output) + 1] if n != "sin_transmission"] or [output]
            lower = ["sin_transmission"] if output == "sin_transmission" else lower
            size = max(max(mpf(float(sensitivity[n][k])), abs(mpf(row["out"][n]))) for n in lower)
            error = abs(mpf(float(frame[output][k])) - mpf(row["out"][output]))
            assert error <= FACTOR * mpf(2) ** -53 * size, (k, row["tag"])


@pytest.mark.parametrize("output", ["alpha_at_phi0", "alpha_at_phipi", "swing"])
def test_kim_dison_limit_positions_match_oracle(output):
    rows = [row for row in ROWS if row["kind"] == "swing"]
    assert len(rows) >= 10
    frame = sweep.summarise("kim_dison", table(rows), [output], accuracy=1e-12)
    assert (frame.status == st.OK).all()
    for value, error, row in zip(frame[output], frame[f"err_{output}"], rows, strict=True):
        assert abs(float(mpf(row["out"][output]) - mpf(value))) <= error < 1e-12
    # there are no other extremes: where the ball is on the crank axis the crank does not move it
    assert all(row["out"]["extra_extrema_in_0_pi"] == 0 for row in rows)


def test_kim_dison_sign_of_the_source_is_minus_the_crank_rockers():
    rows = [row for row in ROWS if row["kind"] == "position" and row["tag"] == "regular"]
    given = table(rows)
    theirs = {"a": given["r"], "b": given["l"], "c": given["h"], "e": given["a"], "f": given["b"]}
    theirs |= {"g": 0.0, "alpha": 0.5 * math.pi, "phi": given["phi"]}
    own = sweep.evaluate("kim_dison", given, ["alpha", "d3alpha"])
    same = sweep.evaluate("rssr", theirs | {"branch": [-s for s in given["branch"]]}, ["psi", "d3psi"])
    other = sweep.evaluate("rssr", theirs | {"branch": given["branch"]}, ["psi"])
    np.testing.assert_array_equal(own.alpha, same.psi)
    np.testing.assert_array_equal(own.d3alpha, same.d3psi)
    assert (np.abs(own.alpha - other.psi) > 1e-3).all()


def by_construction(r, h, a, b, alpha, phi):
    """Links measured on joints placed first, so that the linkage assembles; l = 0 where they coincide is refused."""
    d = np.array([-r * math.sin(phi), a + h * math.cos(alpha) - r * math.cos(phi), b - h * math.sin(alpha)])
    return (r, float(np.linalg.norm(d)), h, a, b), phi


LINKAGES = some.builds(
    by_construction,
    r=some.floats(0.1, 1.0),
    h=some.floats(1.0, 3.0),
    a=some.floats(-3.0, 3.0),
    b=some.floats(-3.0, 3.0),
    alpha=some.floats(-3.0, 3.0),
    phi=some.floats(-3.0, 3.0),
).filter(lambda linkage: linkage[0][1] > 0.0)


@settings(deadline=None, max_examples=25)
@given(LINKAGES, some.sampled_from([-1.0, 1.0]))
def test_kim_dison_equals_its_points(linkage, branch):
    design, phi = linkage
    want = ["alpha", "dalpha", "d2alpha", "d3alpha", "sin_transmission", "omega3", "epsilon3"]
    want += [f"{axis}_{point}" for point in "bc" for axis in "xyz"]
    given = dict(zip(LINKS, design, strict=True)) | {"branch": branch, "omega1": 3.0, "epsilon1": -2.0}
    row = sweep.evaluate("kim_dison", given, want, phi=[phi]).iloc[0]
    if row.status != st.OK or abs(row.sin_transmission) < 0.3:
        return
    expected = naive.outputs(design, phi, branch)
    for name in expected:
        # this far from dead points the condition numbers stay below 1e6
        assert float(abs(row[name] - expected[name])) < 1e6 * 2.0**-52, name
    assert row.omega3 == pytest.approx(3.0 * row.dalpha, rel=1e-15)
    assert row.epsilon3 == pytest.approx(9.0 * row.d2alpha - 2.0 * row.dalpha, rel=1e-13, abs=1e-13)
    r, length, h, a, b = design
    np.testing.assert_allclose([row.x_b, row.y_b, row.z_b], [r * math.sin(phi), r * math.cos(phi), 0.0], atol=1e-14)
    ball = [0.0, a + h * math.cos(row.alpha), b - h * math.sin(row.alpha)]
    np.testing.assert_allclose([row.x_c, row.y_c, row.z_c], ball, atol=1e-14)
    apart = np.array([row.x_c - row.x_b, row.y_c - row.y_b, row.z_c - row.z_b])
    assert np.linalg.norm(apart) == pytest.approx(length, rel=1e-12)


def test_kim_dison_crank_pin_far_from_the_rocker_axis_keeps_its_digits():
    # x_b = r sin(phi), a product of two numbers that are rounded once each: 4 roundings.  b cos(pi/2 rounded) was 1e3.
    phi = np.array([-8.0, -2.0, 0.3, 1.0, 9.5])
    given = {"r": 0.01, "l": 130.0, "h": 30.0, "a": 40.0, "b": 120.0, "branch": 1.0}
    found = sweep.evaluate("kim_dison", given, ["x_b"], phi=phi)
    assert (found.status == st.OK).all()
    np.testing.assert_allclose(found.x_b, 0.01 * np.sin(phi), rtol=4.0 * 2.0**-53)


def test_kim_dison_maxima_are_those_of_the_crank_rocker():
    rows = [row for row in ROWS if row["kind"] == "swing"]
    designs = np.array([[row["in"][name] for name in LINKS] + [1.0, 0.0, row["in"]["branch"]] for row in rows])
    matrix = np.column_stack([designs[:, :5], 0.0 * designs[:, 0], np.full(len(rows), 0.5 * math.pi), -designs[:, 7]])
    for accuracy in (Accuracy(samples=360), Accuracy(target=1e-8), Accuracy(target=1e-6, certify=True)):
        own = design_outputs(family("kim_dison"), designs, ["max_abs_d2alpha", "phi_max_abs_d3alpha"], accuracy)
        same = design_outputs(family("rssr"), matrix, ["max_abs_d2psi", "phi_max_abs_d3psi"], accuracy)
        np.testing.assert_array_equal(own["max_abs_d2alpha"], same["max_abs_d2psi"])
        np.testing.assert_array_equal(own["phi_max_abs_d3alpha"], same["phi_max_abs_d3psi"])
    loose = design_outputs(family("kim_dison"), designs, ["margin", "rotatable"], Accuracy(target=1e-8))
    assert np.asarray(loose["rotatable"]).all()


def test_negative_control_printed_sign_of_the_rocker_ball_fails_the_oracle():
    # y2 = a - h cos(alpha) as printed is the mirror image of the rocker: its angle is pi - alpha
    rows = [row for row in ROWS if row["kind"] == "position" and row["tag"] == "regular"]
    frame = sweep.evaluate("kim_dison", table(rows), ["alpha"])
    printed = np.array([math.pi - float(row["out"]["alpha"]) for row in rows])
    assert (np.abs(np.exp(1j * frame.alpha) - np.exp(1j * printed)) > 1e-3).all()


@pytest.mark.parametrize("target", [1e-4, 1e-8, 1e-11])
def test_of_two_tops_as_high_as_each_other_the_first_of_the_turn_counts(target: float) -> None:
    """The way back is the way forth, so every top has a twin at 2 pi - phi: rounding chose among them."""
    draw = np.random.default_rng(1).uniform
    links = {"r": draw(0.5, 1.0, 200), "l": draw(5.5, 6.5, 200), "h": draw(3.0, 3.4, 200)}
    links |= {"a": 2.9, "b": 4.0, "branch": -1}
    names = [f"phi_max_abs_{name}" for name in ("dalpha", "d2alpha", "d3alpha")]
    found = sweep.summarise("kim_dison", links, names, accuracy=target)
    assert (found["status"] == 0).all()
    assert (found[names] <= np.pi + 1e-7).all(axis=None)


def test_the_crank_pin_stays_in_the_plane_of_the_crank() -> None:
    """Its height over that plane was a rounding of b, so `box_z` of every sixth linkage was NOT_CONVERGED."""
    rng = np.random.default_rng(5)
    ordinary = {"r": 3.7, "l": 22.2, "h": 11.84, "a": 10.73, "b": 14.8, "branch": -1.0}
    table = {name: x * np.exp(rng.uniform(-0.05, 0.05, 200)) for name, x in ordinary.items() if name != "branch"}
    got = sweep.summarise("kim_dison", {**table, "branch": -1.0}, ["box_z", "range_z_b", "max_z_c", "min_z_c"])
    assert (got["status"] == st.OK).all()
    assert (got["range_z_b"] == 0.0).all()
    heights = np.column_stack([np.zeros(200), table["b"], got["max_z_c"], got["min_z_c"]])
    np.testing.assert_allclose(got["box_z"], np.ptp(heights, axis=1), rtol=1e-8)  # the accuracy asked
