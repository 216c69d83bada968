"""Outputs with jumps and kinks: friction where the follower reverses, angles that leap by pi, the larger load."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pandas as pd
import pytest

import sweep
from kernels import status as st
from studies.accuracy.ordinary import designs
from sweep.effects import extended
from sweep.evaluation.summaries import design_outputs
from sweep.families import family
from sweep.families.base import Accuracy, Angles
from sweep.reductions.peak_search import LIMIT, PeakSearch
from tests.effects.test_balance import FRICTION, RSSR_LOADS
from tests.support.optimise_family import FAMILY as WAVES

DENSE = 100_000
PHI = 2.0 * np.pi * (np.arange(DENSE) + 0.5) / DENSE


def found_and_dense(name, output, count=5, told=True):
    """Largest and least value by the search, the same on a dense grid, of linkages that turn.

    Where it is not told of kinks, the search has to see by itself that a curve jumps.
    """
    full = extended(family(name), [output])
    if not told:
        full = replace(full, pose_outputs=tuple(replace(o, kinks=False) for o in full.pose_outputs))
    matrix = designs(full, 3 * count)
    turning = design_outputs(family(name), matrix[:, : len(family(name).parameters)], ["margin"], Accuracy(target=1e-6))
    matrix = matrix[turning["status"] == st.OK][:count]
    names = [f"max_{output}", f"min_{output}", f"rms_{output}"]
    got = design_outputs(full, matrix, names, Accuracy(target=1e-8))
    values = np.asarray(full.poses(matrix, Angles.of(PHI[None]), frozenset([output]))[output], np.float64)
    return got, values


@pytest.mark.parametrize(
    ("name", "output", "told"),
    [
        ("rssp", "drive_torque_friction", True),
        ("rssr", "shaft_torque_d", True),
        ("rssr", "theta3", True),
        ("rssr", "theta3", False),
        ("rssr", "rolling_utilisation", True),
    ],
)
def test_extremes_beside_jumps_are_found(name, output, told):
    got, values = found_and_dense(name, output, told=told)
    size = np.abs(values).max(axis=1)
    for which, dense in (("max", values.max(axis=1)), ("min", -((-values).max(axis=1)))):
        sign = 1.0 if which == "max" else -1.0
        value, err = got[f"{which}_{output}"], got[f"err_{which}_{output}"]
        assert (sign * (value - dense) >= -err - 1e-12 * size).all(), "a grid sees no more than was found"
        assert (sign * (value - dense) < 1e-3 * size).all(), "and a fine grid nearly as much"
        assert (err < 1e-7 * size).all()


def test_the_mean_of_a_curve_with_jumps_is_found_to_its_target():
    """Where the follower reverses, friction jumps: panels close in on that."""
    got, values = found_and_dense("rssp", "drive_torque_friction")
    exact = np.sqrt((values**2).mean(axis=1))
    assert (got["status"] == st.OK).all()
    # The dense sum errs by a sample at each jump.
    assert (np.abs(got["rms_drive_torque_friction"] - exact) <= 1e-4 * exact).all()
    assert (got["err_rms_drive_torque_friction"] < 1.1e-8 * exact).all()
    smooth, values = found_and_dense("rssp", "drive_torque")
    assert (smooth["status"] == st.OK).all()
    np.testing.assert_allclose(smooth["rms_drive_torque"], np.sqrt((values**2).mean(axis=1)), rtol=1e-8)


@pytest.mark.parametrize(("law", "square"), [(1.0, 720.0), (2.0, (16.0 * np.pi**3 / (4.0 + np.pi)) ** 2 / 6.0),
                                             (3.0, 8.0 * np.pi**4)])  # fmt: skip
@pytest.mark.parametrize("start", [0.0, 0.01, -0.5 * np.pi])
@pytest.mark.parametrize(("name", "output"), [("cam", "d3s"), ("cam_lever", "d3psi")])
def test_the_mean_of_a_jerk_that_jumps_at_a_sample_is_that_of_the_law(name, output, start, law, square):
    """The reference is the integral of the square of docs/cam.md (2)-(4), in closed form.

    Rounding moves a jump that lies at a sample, which is no sign that the whole curve is rounding.  The error has to
    keep to the target of 1e-8, and the value to its error; 1e-13 is rounding of the reference.
    """
    example = {**family(name).example, "law": law, "start": start, "rise": 0.5 * np.pi, "fall": 0.75 * np.pi}
    found = sweep.summarise(name, example, f"rms_{output}", accuracy=1e-8).iloc[0]
    phases = example["rise"] ** -5 + example["fall"] ** -5
    mean = example["lift"] * np.sqrt(square * phases / (2.0 * np.pi))
    assert found["status"] == st.OK
    assert found[f"err_rms_{output}"] <= 1e-8 * mean
    assert abs(found[f"rms_{output}"] - mean) <= found[f"err_rms_{output}"] + 1e-13 * mean


def test_without_brackets_a_jump_takes_the_most_samples(monkeypatch):
    """Negative control: the bracketing ends the search early; else panels take over after the most samples."""
    taken, block = [], PeakSearch.block

    def counted(self, rows, samples):
        taken.append(samples)
        block(self, rows, samples)

    monkeypatch.setattr(PeakSearch, "block", counted)
    found_and_dense("rssr", "theta3", count=1, told=False)
    assert max(taken) < LIMIT
    monkeypatch.setattr("sweep.reductions.peak_search.BREAKING", 10**9)
    found_and_dense("rssr", "theta3", count=1, told=False)
    assert max(taken) == LIMIT


def test_a_smooth_curve_is_not_taken_for_one_that_jumps(monkeypatch):
    """A made-up family without jumps: the search gives the same whether it may look for them or not."""
    matrix = np.column_stack([np.linspace(-2.0, 2.0, 40), np.linspace(3.0, -3.0, 40), np.zeros(40), np.ones(40)])
    with_brackets = design_outputs(WAVES, matrix, ["max_wave", "max_abs_dev"], Accuracy(target=1e-10))
    monkeypatch.setattr("sweep.reductions.peak_search.BREAKING", 10**9)
    without = design_outputs(WAVES, matrix, ["max_wave", "max_abs_dev"], Accuracy(target=1e-10))
    for name, values in without.items():
        assert np.array_equal(values, with_brackets[name]), name


def test_the_largest_count_is_that_of_a_phase_shorter_than_the_first_samples_and_is_whole():
    """Two minima of a thread's length stand for 2 % and 0.5 % of a turn: 32 samples saw one, with status 0.

    Where both were seen the largest was 2.0000000000000018, beyond a limit of 2.
    """
    names = ("a", "X1", "Y1", "Z1", "X2", "Y2", "Z2")
    table = pd.DataFrame(
        [
            (0.7298, -0.6882, 0.3524, -1.1685, -0.8829, 0.4412, 0.8807),
            (0.3776, 0.1157, -1.3825, -16.8423, 1.5526, -0.1025, 0.3962),
            (2.059, 4.7451, -0.2828, -0.4527, 34.9333, -0.5316, 32.7016),
        ],
        columns=names,
    )
    dense = sweep.evaluate("free_cam", table, ["minima"], phi=np.arange(2000) * np.pi / 1000.0)
    ends = dense.groupby("design")["minima"].agg(["max", "min"])
    found = sweep.summarise("free_cam", table, ["max_minima", "min_minima"], accuracy=1e-6)
    assert (found["status"] == 0).all()
    assert found["max_minima"].tolist() == ends["max"].tolist() == [2.0, 2.0, 2.0]
    assert found["min_minima"].tolist() == ends["min"].tolist()


def test_a_count_that_is_least_up_to_a_jump_is_that_of_its_own_side():
    """A thread is off its edge for 70 % of the turn: two in five had a least `contact` of 1, with status 0."""
    rng = np.random.default_rng(4)
    ordinary = family("free_cam").example
    table = pd.DataFrame({name: x * np.exp(rng.uniform(-0.1, 0.1, 40)) for name, x in ordinary.items()})
    dense = sweep.evaluate("free_cam", table, ["contact"], phi=np.arange(720) * np.pi / 360.0)
    ends = dense.groupby("design")["contact"].agg(["max", "min"])
    for accuracy in (1e-4, 1e-8):
        found = sweep.summarise("free_cam", table, ["max_contact", "min_contact", "range_contact"], accuracy=accuracy)
        assert (found["status"] == 0).all()
        assert found["max_contact"].tolist() == ends["max"].tolist()
        assert found["min_contact"].tolist() == ends["min"].tolist()
        assert (found["range_contact"] == ends["max"].to_numpy() - ends["min"].to_numpy()).all()


@pytest.mark.parametrize("accuracy", [1e-3, 1e-9])
def test_a_count_that_flickers_where_rounding_decides_is_whole_and_says_how_far_it_may_be_off(accuracy):
    """Passes of the friction iteration change by one from pose to pose: every design was NOT_CONVERGED for them."""
    names = ["max_friction_passes", "min_friction_passes", "range_friction_passes"]
    found = sweep.summarise("rssr", RSSR_LOADS | FRICTION, names, accuracy=accuracy).iloc[0]
    turn = np.linspace(0.0, 2.0 * np.pi, 20001)
    dense = sweep.evaluate("rssr", RSSR_LOADS | FRICTION, ["friction_passes"], phi=turn)["friction_passes"]
    assert found.status == st.OK
    for name, value in zip(names, (dense.max(), dense.min(), np.ptp(dense)), strict=True):
        assert found[name] == round(found[name])
        assert abs(found[name] - value) <= found[f"err_{name}"]


def test_an_angle_that_all_but_jumps_over_its_cut_is_not_called_a_turn():
    """Forks whose ball passes close to the driven axis: of 1869 that swing 124 had a swing of 2 pi."""
    rng, n = np.random.default_rng(5), 400
    a, alpha, at = rng.uniform(5.0, 40.0, n), rng.uniform(-3.0, 3.0, n), rng.uniform(0.0, 2.0 * np.pi, n)
    f = -a * np.cos(alpha) * np.sin(at) / np.sin(alpha)
    e = a * np.cos(at) + a * 10.0 ** rng.uniform(-7.0, -1.0, n) * rng.choice([-1, 1], n)
    got = sweep.summarise("slotted", {"a": a, "e": e, "f": f, "alpha": alpha}, ["swing"])
    close = np.concatenate([-np.geomspace(1e-10, 1e-2, 1000), np.geomspace(1e-10, 1e-2, 1000)])
    swinging = 0
    for i in np.flatnonzero(got.status == st.OK):
        phi = np.sort(np.concatenate([np.linspace(0.0, 2.0 * np.pi, 20_001), at[i] + close]))
        up = f[i] * np.sin(alpha[i]) + a[i] * np.cos(alpha[i]) * np.sin(phi)
        psi = np.unwrap(np.arctan2(up, a[i] * np.cos(phi) - e[i]))  # 1e-6 from a limit position no sample is
        assert abs(got.swing[i]) == pytest.approx(np.ptp(psi), abs=1e-4)
        swinging += 1
    assert swinging > 80


def test_an_angle_beside_a_jump_over_its_cut_converges_as_its_mirror_image_does():
    """Forks whose ball passes 1e-9 to 0.1 cranks from the driven axis: up to half was NOT_CONVERGED, by the branch."""
    rng, n = np.random.default_rng(3), 100
    alpha, at, gap = rng.uniform(-1.2, 1.2, n), rng.uniform(0.0, 2.0 * np.pi, n), 10.0 ** rng.uniform(-9.0, -1.0, n)
    e, f = np.cos(at) + gap * rng.choice([-1, 1], n), -np.sin(at) / np.tan(alpha)
    around = e**2 + (f * np.tan(alpha)) ** 2 < 1.0
    names, fork = ["max_psi", "min_psi"], {"a": np.ones(n), "e": e, "f": f, "alpha": alpha}
    ends = []
    for design in (fork, fork | {"branch": -np.ones(n)}, fork | {"alpha": -alpha}):
        got = sweep.summarise("slotted", design, names, accuracy=1e-8)
        assert (got.status == np.where(around, st.NOT_OSCILLATING, st.OK)).all()
        ends.append(got[~around])
    own, turned, mirrored = ends
    for off in (
        turned.max_psi - own.max_psi + np.pi,
        turned.min_psi - own.min_psi + np.pi,
        mirrored.max_psi + own.min_psi,
    ):
        assert np.abs(np.remainder(off + 1.0, 2.0 * np.pi) - 1.0).max() <= 1e-8
    for i in range(0, len(own), 7):
        k = np.flatnonzero(~around)[i]
        close = np.sinh(np.linspace(-24.0, 24.0, 4000)) * 1e-11
        phi = np.sort(np.concatenate([np.linspace(0.0, 2.0 * np.pi, 4001), at[k] + close]))
        psi = np.unwrap(np.arctan2(f[k] * np.sin(alpha[k]) + np.cos(alpha[k]) * np.sin(phi), np.cos(phi) - e[k]))
        assert own.max_psi.iloc[i] - own.min_psi.iloc[i] == pytest.approx(np.ptp(psi), abs=1e-4)


@pytest.mark.parametrize("gap", [1e-11, 1e-9, 1e-6])
@pytest.mark.parametrize("side", [-1.0, 1.0])
def test_an_angle_that_leaves_its_cut_at_once_is_continuous_from_the_angle_0_on(side, gap):
    """psi is pi at phi = 0 and passes its cut there with side -1: extremes were those less a full turn."""
    e = 1.0 + gap
    crank = {"a": 1.0, "e": side * e, "branch": side}
    got = sweep.summarise("inverted_slider_crank", crank, ["max_psi", "min_psi"], accuracy=1e-9).iloc[0]
    tangent = np.arctan2(1.0, np.sqrt((e - 1.0) * (e + 1.0)))  # asin(a/e), where the slot touches the crank circle
    assert got.status == st.OK
    assert abs(got.max_psi - np.pi - tangent) <= got.err_max_psi + 1e-15
    assert abs(got.min_psi - np.pi + tangent) <= got.err_min_psi + 1e-15


BORN_DEAD = (
    0.9651568162379532, 1.9292332440078357, 1.7214334501208706, -0.8645343199626364, -0.42182100618150087,
    -0.36326689004741036, 0.8990315876340816, -0.22168799026252226, 0.14593584177720245, 1.0, 1.0,
)  # fmt: skip


def test_panels_resolve_what_the_most_even_samples_do_not():
    """Five-links whose discriminants nearly vanish, which hardly bends the coupler's angle: they were NOT_CONVERGED."""
    matrix = np.array([
        BORN_DEAD,
        (1.8221917079683514, 3.4732334119921315, 3.1248101364480743, -1.7603751230026785,
         -0.8064053567998615, 0.3320322946670546, 0.6488808932376903, -0.1132668371826532,
         -0.2713429003267522, 1.0, 1.0),
    ])  # fmt: skip
    full, names = family("five_link"), ["max_abs_beta", "min_theta"]
    dense = full.poses(matrix, Angles.of(PHI[None]), frozenset(["beta", "theta"]))
    expected = {"max_abs_beta": np.abs(dense["beta"]).max(axis=1), "min_theta": dense["theta"].min(axis=1)}
    for target in (1e-4, 1e-9):
        found = design_outputs(full, matrix, names, Accuracy(target=target))
        assert (found["status"] == st.OK).all()
        for name, value in expected.items():
            # Between 100 000 poses a curve rises by some 1e-9 of its bend, next to the dead point by 1e-6.
            np.testing.assert_allclose(found[name], value, rtol=0.0, atol=1e-6)


def test_a_margin_that_jumps_to_a_dead_point_is_the_limit_there():
    """Mode 1 of this five-link begins in a dead point, next to another solution: the error was 0.01, with status 0."""
    design = dict(zip(family("five_link").parameter_names, BORN_DEAD, strict=True))
    for target in (1e-2, 1e-4, 1e-8):
        found = sweep.summarise("five_link", design, ["margin", "max_pressure_angle"], accuracy=target).iloc[0]
        assert found["status"] == st.OK
        # A jump is located to 1e-11 rad; the angle changes by the root of the margin.
        assert abs(found["margin"]) <= found["err_margin"] < 1e-10
        assert abs(found["max_pressure_angle"] - 0.5 * np.pi) <= found["err_max_pressure_angle"] < 1e-5
