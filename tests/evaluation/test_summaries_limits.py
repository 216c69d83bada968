"""Limit positions from poses alone: the 25-digit table of crank-rockers, published mechanisms, definitions."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

import sweep
from kernels import status as st
from sweep.evaluation.summaries import design_outputs
from sweep.families import family as find_family
from sweep.families.base import Accuracy
from tests.support.turn_designs import RSSR, crank_rockers, guided_four_bars, slider_cranks

ROWS = json.loads((Path(__file__).parents[1] / "oracle" / "limits_open.json").read_text())["rows"]
PLAIN_RSSR = replace(RSSR, steps=())


def test_chebyshev_tracer_stays_in_its_published_band():
    """Crank 1, frame 2, coupler = rocker 2.5, arm 5: over the half turn about 180 degrees the band is 0.009753733.

    A crank-rocker swings the crank over part of that half turn, the middle of the band included.
    """
    drive = {"a1": 0.3, "b1": 1.0, "c1": 0.8, "e1": 1.1, "f1": 0.1, "g1": 0.2, "alpha1": 0.3}
    tracer = {"a2": 1.0, "b2": 2.5, "c2": 2.5, "e2": 2.0, "xi2": 5.0, "eta2": 0.0, "lam2": 0.0, "h2": 4.0}
    frame = sweep.summarise(
        ["rssr", "guide"], drive | tracer | {"branch2": [-1.0]}, ["max_abs_dev", "max_psi1", "min_psi1"]
    )
    assert frame["status"][0] == st.OK
    assert 0.5 * np.pi < abs(frame["min_psi1"][0]) < 1.5 * np.pi
    assert 0.5 * np.pi < abs(frame["max_psi1"][0]) < 1.5 * np.pi
    assert frame["max_abs_dev"][0] == pytest.approx(0.009753733, abs=1e-9)


def test_benchmark_slider_crank_has_its_published_stroke():
    table = {"a": [0.08], "b": [0.3], "e": [0.1562049935], "f": [0.0], "alpha": [np.pi / 2]}
    frame = sweep.summarise("rssp", table, ["stroke", "s_ext", "s_fold", "min_s", "max_s"])
    assert frame["min_s"][0] == pytest.approx(0.1849518884, abs=1e-10)
    assert frame["max_s"][0] == pytest.approx(0.2901599541, abs=1e-10)
    assert frame["s_ext"][0] == frame["max_s"][0]
    assert frame["stroke"][0] == pytest.approx(0.2901599541 - 0.1849518884, abs=2e-10)


@pytest.mark.parametrize("branch", [1.0, -1.0])
def test_planar_slider_crank_is_extended_in_line_outward(branch):
    frame = sweep.summarise(
        "rssp",
        {"a": [1.0], "b": [3.0], "e": [0.5], "f": [0.0], "alpha": [0.0], "branch": [branch]},
        ["s_ext", "s_fold", "phi_ext", "phi_fold", "phi0", "stroke_ratio"],
    ).iloc[0]
    assert frame["s_ext"] == pytest.approx(branch * np.sqrt(4.0**2 - 0.25), rel=1e-12)
    assert frame["s_fold"] == pytest.approx(branch * np.sqrt(2.0**2 - 0.25), rel=1e-12)
    # Crank and coupler in line: the crank points to the slider, or away from it.
    assert np.tan(frame["phi_ext"]) == pytest.approx(frame["s_ext"] / 0.5, rel=1e-6)
    assert np.cos(frame["phi_ext"]) > 0.0 > np.cos(frame["phi_fold"])
    phi0 = (frame["phi_fold"] - frame["phi_ext"]) % (2.0 * np.pi)
    assert frame["phi0"] == pytest.approx(phi0, abs=1e-12)
    assert frame["stroke_ratio"] == pytest.approx(phi0 / (2.0 * np.pi - phi0), rel=1e-12)


def test_extremes_of_spatial_slider_cranks_are_in_line_outward():
    designs = slider_cranks(400, 41)
    wanted = ["s_ext", "phi_ext", "s_fold", "phi_fold"]
    table = dict(zip(("a", "b", "e", "f", "alpha", "branch"), designs.T, strict=True))
    frame = sweep.summarise("rssp", table, wanted)
    frame = frame.assign(**table)
    frame = frame[frame["status"] == st.OK]
    assert len(frame) > 100
    for kind, sign in (("ext", 1.0), ("fold", -1.0)):
        # Position of the slider in the crank plane, along the crank: rho or -rho.
        x, y = frame["e"], frame[f"s_{kind}"] * np.cos(frame["alpha"])
        along = x * np.cos(frame[f"phi_{kind}"]) + y * np.sin(frame[f"phi_{kind}"])
        np.testing.assert_allclose(along, sign * np.hypot(x, y), rtol=1e-9)


def test_limit_positions_of_the_table_of_crank_rockers():
    """All rows but swings below 1e-10 rad, a difference of angles here (the family's own step does better)."""
    rows = [row for row in ROWS if row["full_rotation"] and row["rocker"] == "oscillates"]
    rows = [row for row in rows if abs(float(row["psi0"])) > 1e-10]
    names = ("a", "b", "c", "e", "f", "g", "alpha", "sigma")
    designs = np.array([[float(row[name]) for name in names] for row in rows])
    found = design_outputs(PLAIN_RSSR, designs, ["swing", "phi0"], Accuracy(target=1e-10))
    assert len(rows) > 95
    # Closer to a change point than 1e-8 no affordable sampling resolves the motion, and the status says so.
    unresolved = found["status"] != st.OK
    assert set(found["status"][unresolved]) <= {st.NOT_CONVERGED}
    assert {rows[i]["kind"] for i in np.flatnonzero(unresolved)} <= {"hard_change_point"}
    assert unresolved.sum() <= 3
    for name, column in (("swing", "psi0"), ("phi0", "phi0")):
        exact = np.array([float(row[column]) for row in rows])
        cond = np.array([max(1.0, float(row["cond"][column])) for row in rows])
        error = np.abs(np.angle(np.exp(1j * (found[name] - exact))))
        assert (error <= found[f"err_{name}"] + 16.0 * 2.0**-53 * cond).all()
        assert np.median(found[f"err_{name}"]) < 1e-11


@pytest.mark.parametrize(
    ("design", "phi0", "stroke_ratio"),
    [
        ((1.981239643231553e-09, 28.525761791025275, 69.28350958738054, -31.206092007024893, -40.418177415528376,
          32.08044160201162, 2.132710294534813, -1.0), 3.1415926532561856303, 0.99999999978761880046),
        ((0.003611318813218683, 23.65385666082121, 42.839828311276584, -3.242994525909431, -20.40971158601303,
          -5.473596520133931, 1.2945625724406051, -1.0), 3.1430872286429752622, 1.0009519288989078613),
        ((2.74366791051808, 26.97344495631146, 57.64340995887085, -42.015627223468485, -12.071020014735183,
          6.66655779261923, 1.6150321104185181, -1.0), 3.3278236634308408795, 1.1260292527887191754),
    ],
)  # fmt: skip
def test_stroke_ratio_keeps_its_digits_where_both_limits_nearly_coincide(design, phi0, stroke_ratio):
    """Expected at 60 digits; the condition numbers of both are at most 1.2."""
    names = ("a", "b", "c", "e", "f", "g", "alpha", "branch")
    found = sweep.summarise("rssr", {n: [x] for n, x in zip(names, design, strict=True)}, ["phi0", "stroke_ratio"])
    assert found["phi0"][0] == pytest.approx(phi0, rel=0.0, abs=4.0 * 2.0**-53 * phi0)
    assert found["stroke_ratio"][0] == pytest.approx(stroke_ratio, rel=0.0, abs=4.0 * 2.0**-53)


@pytest.mark.parametrize(
    ("design", "swing"),
    [
        ((0.19878513407076476, 4.264731383184888, 3.7559023120821258, -1.8225764339733483, -0.7341732898957085,
          1.2272837972358586, 1.193212526974253, 1.0), -0.004805849876982996093833),
        ((0.38143623081368705, 280.1607292260518, 1.7154028972401056, -0.9022488485304225, -279.50588235610513,
          0.7006400763364398, 0.4222217235069572, 1.0), -0.003308349093291862500487),
        ((0.9958324141476641, 2669.5075693930426, 3.1392671699815082, 2.3851357682119234, -2669.9833738972206,
          -0.7419462682174038, 0.8612705195631452, -1.0), 0.0002958969898832275954455),
        ((0.5148462645783128, 24722.92788485492, 3.1395545694837037, -2.3193150931820252, -24724.679920578226,
          1.7432843730439926, 2.8967628069244475, 1.0), -0.00004556020963487921518213),
    ],
)  # fmt: skip
def test_error_of_a_tiny_swing_counts_what_its_lever_and_distances_round_by(design, swing):
    """Expected at 50 digits; the estimate stays below what the difference of two angles would have."""
    found = design_outputs(RSSR, np.array([design]), ["swing", "psi_ext"], Accuracy(target=1e-8))
    assert abs(found["swing"][0] - swing) <= found["err_swing"][0] < found["err_psi_ext"][0]


def test_swing_of_a_general_chain_is_unwrapped():
    designs = crank_rockers(300, 42)
    found = design_outputs(PLAIN_RSSR, designs, ["swing", "psi_ext", "psi_fold", "range_psi"], Accuracy(target=1e-8))
    ok = found["status"] == st.OK
    np.testing.assert_allclose(np.abs(found["swing"][ok]), found["range_psi"][ok], rtol=1e-12)
    turns = (found["swing"][ok] - (found["psi_fold"][ok] - found["psi_ext"][ok])) / (2.0 * np.pi)
    np.testing.assert_allclose(turns, np.rint(turns), atol=1e-12)
    assert set(np.rint(turns)) == {-1.0, 0.0, 1.0}, "some must pass pi, either way"
    assert (np.sign(found["swing"][ok]) == -designs[ok, 7]).all()  # sheet (3-sgn)


@pytest.mark.parametrize("own_steps", [True, False])
@pytest.mark.parametrize("names", [["rssr"], ["rssr", "guide"], ["rssr", "rssr"]])
def test_limit_angles_are_those_of_the_poses_in_line(names, own_steps, monkeypatch):
    """In (-pi, pi], as atan2 has it, by the family's own step or from poses, alone or in a chain, in any stage."""
    n = 400
    parts = [crank_rockers(n, 5), crank_rockers(n, 6) * ([0.3] + 7 * [1.0])]
    if names[-1] == "guide":
        parts[1] = guided_four_bars(n, 6)
    table = {}
    for number, name in enumerate(names):
        suffix = str(number + 1) if len(names) > 1 else ""
        columns = [f"{p}{suffix}" for p in find_family(name).parameter_names]
        table |= dict(zip(columns, parts[number].T, strict=True))
    if not own_steps:
        monkeypatch.setattr("sweep.reductions.steps.own_steps", lambda *_: [])
        monkeypatch.setattr("sweep.evaluation.routes._known", lambda *_: {})
    stages = [""] if len(names) == 1 else [str(k + 1) for k, name in enumerate(names) if name == "rssr"]
    for stage in stages:
        wanted = [f"{limit}{stage}" for limit in ("psi_ext", "phi_ext", "psi_fold", "phi_fold")]
        frame = sweep.summarise(names, table, wanted)
        ok = frame["status"] == st.OK
        assert ok.sum() > 20
        for angle, phi in (wanted[:2], wanted[2:]):
            pose = sweep.evaluate(names, pd.DataFrame(table)[ok].assign(phi=frame.loc[ok, phi]), f"psi{stage}")
            error = np.abs(frame.loc[ok, angle] - pose[f"psi{stage}"])
            at_pi = np.abs(np.abs(pose[f"psi{stage}"]) - np.pi) < 1e-6
            assert error[~at_pi].max() < 1e-6
            assert (frame.loc[ok, angle] > -np.pi).all() and (frame.loc[ok, angle] <= np.pi).all()


def test_angle_that_rounds_to_a_whole_turn_is_the_beginning_of_it() -> None:
    """An inverted slider-crank without offset is fastest at the crank angle 0; many searches end just below it."""
    rng = np.random.default_rng(1)
    table = {"a": rng.uniform(5.0, 15.0, 200), "e": rng.uniform(40.0, 60.0, 200), "h": 0.0}
    found = sweep.summarise("inverted_slider_crank", table, ["phi_max_abs_dpsi"], accuracy=1e-8)["phi_max_abs_dpsi"]
    assert ((found >= 0.0) & (found < 2.0 * np.pi)).all() and (found == 0.0).sum() > 20
