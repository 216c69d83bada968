"""Orders of a machine's shaking as design outputs: what counterweights take away, and what phases and torque cost."""

from __future__ import annotations

import numpy as np
import pytest

import sweep
from kernels import status as st
from sweep.effects import extended
from sweep.evaluation.balancing import orders
from sweep.evaluation.tables import design_matrix
from sweep.families import family
from sweep.families.base import Accuracy
from sweep.optimise import Problem, minimise, pareto
from sweep.study import OptimiseSettings, ParetoSettings
from tests.effects.test_main_shaft import LOOPER, NEEDLE, OMEGA

PHI = np.arange(300) * (2.0 * np.pi / 300)
A, SLIDER, CRANK = 1.0, 0.7, 1.6  # length and masses of a slider-crank whose coupler has no mass
SLIDING = {"x.a": A, "x.b": 3.5, "x.e": 0.0, "x.m_crank": CRANK, "x.m_coupler": 0.0, "x.m_slider": SLIDER}
SLIDING |= {"x.rod_crank": 0.0, "x.speed": OMEGA}
FIRST = SLIDER * A * OMEGA**2  # of the force along the line, by the series of a slider-crank


def sliding():
    return sweep.machine({"x": "slider_crank"}, {"f": {"shaking": ["x"]}})


def test_orders_are_those_of_the_poses_fourier_transform():
    machine = sweep.machine({"needle": ["rssr", "guide"]}, {"f": {"shaking": ["needle1", "needle2"]}})
    given = {f"needle.{key}": x for key, x in NEEDLE.items()} | {"needle.speed1": OMEGA}
    want = [f"{name}_order{n}" for name in ("f", "f_moment") for n in (1, 2)]
    found = sweep.summarise(machine, given, want, accuracy=1e-10).iloc[0]
    assert found["status"] == st.OK
    for name in ("f", "f_moment"):
        parts = [f"{name}_{x}" for x in "xyz"]
        curve = sweep.evaluate(machine, given, parts, phi=PHI)[parts].to_numpy()
        series = orders(curve, 2)
        for n in (1, 2):
            size = np.sqrt(0.5 * (series.cos[n - 1] ** 2 + series.sin[n - 1] ** 2).sum())
            off = abs(found[f"{name}_order{n}"] - size)
            # 300 samples in place of some hundred leave rounding alone
            assert off <= found[f"err_{name}_order{n}"] + 1e-13 * np.abs(curve).max()


def test_half_the_slider_on_the_crank_leaves_a_force_that_turns_backwards():
    """Machine-and-stitch, 3.2: of constant size, half of what it was."""
    bare = sweep.summarise(sliding(), SLIDING, ["f_order1"], accuracy=1e-9).iloc[0]
    assert bare["f_order1"] == pytest.approx(FIRST / np.sqrt(2.0), rel=1e-9)
    half = SLIDING | {"x.com_crank_x": -0.5 * SLIDER * A / CRANK}
    left = sweep.summarise(sliding(), half, ["f_order1"], accuracy=1e-9).iloc[0]
    assert left["f_order1"] == pytest.approx(0.5 * FIRST, rel=1e-9)
    parts = ["f_x", "f_y", "f_z"]
    series = orders(sweep.evaluate(sliding(), half, parts, phi=PHI)[parts].to_numpy(), 1)
    # F(phi) = c cos phi + s sin phi of constant size: both square to each other and as long
    c, s = series.cos[0], series.sin[0]
    assert abs(c @ s) < 1e-12 * FIRST**2
    assert [np.linalg.norm(c), np.linalg.norm(s)] == pytest.approx([0.5 * FIRST] * 2, rel=1e-12)
    crank = sweep.evaluate(sliding(), half, ["x.b_x", "x.b_y", "x.b_z"], phi=[0.0, 0.5 * np.pi]).to_numpy()[:, -4:-1]
    assert np.cross(c, s) @ np.cross(*crank.astype(float)) < 0.0  # backwards


def test_the_optimiser_finds_the_counterweight_of_an_order():
    machine = extended(family(sliding()), ["f_order1"])
    problem = Problem(machine, ("x.com_crank_x", "x.com_crank_y"), np.full(2, -1.0), np.full(2, 1.0),
                      {p.name: SLIDING.get(p.name, p.default) for p in machine.parameters
                       if p.name not in ("x.com_crank_x", "x.com_crank_y")}, "f_order1", (), None,
                      Accuracy(target=1e-9))  # fmt: skip
    found = minimise(problem, problem.rows(np.array([[0.3, 0.4]])), OptimiseSettings())[0]
    assert found.status == st.OK and found.objective == pytest.approx(0.5 * FIRST, rel=1e-9)
    named = dict(zip(machine.parameter_names, found.design, strict=True))
    assert named["x.com_crank_x"] == pytest.approx(-0.5 * SLIDER * A / CRANK, abs=1e-6)
    assert named["x.com_crank_y"] == pytest.approx(0.0, abs=1e-6)


def test_shaking_is_paid_for_in_torque():
    """Front of two equal links on one shaft whose phase is free, against a grid of phases."""
    one = {"family": "slotted", "shaft": "main"}
    relations = {"f": {"shaking": ["x", "y"]}, "t": {"torque": ["x", "y"]}}
    machine = sweep.machine({"x": one, "y": one}, relations, shafts={"main": {}})
    full = extended(family(machine), ["rms_f", "rms_t"])
    given = {f"{name}.{key}": x for key, x in LOOPER.items() for name in "xy"} | {"x.speed": OMEGA, "y.speed": OMEGA}
    fixed = dict(zip(full.parameter_names, design_matrix(full, given)[0][0], strict=True))
    del fixed["y.key"]
    keys = np.linspace(0.0, np.pi, 400)
    grid = sweep.summarise(machine, given | {"y.key": keys}, ["rms_f", "rms_t"], accuracy=1e-9)
    problem = Problem(full, ("y.key",), np.zeros(1), np.full(1, np.pi), fixed, "rms_f", (), None, Accuracy(target=1e-9))
    low, high = grid["rms_t"].min(), grid["rms_t"].max()
    bounds = (high, 0.5 * (low + high), low + 0.1 * (high - low))
    starts = problem.rows(np.linspace(0.2, 3.0, 4)[:, None])
    front = pareto(problem, ParetoSettings("rms_t", bounds, False, 4, None, None), starts)
    for bound, result in zip(bounds, front, strict=True):
        allowed = grid[grid["rms_t"] <= bound * (1.0 + 1e-9)]
        assert result.status == st.OK
        # no worse than the best of 400 phases, by more than its own accuracy
        assert result.objective <= allowed["rms_f"].min() * (1.0 + 1e-8)
