"""The study head208: accepted figures recomputed, what its README says, and the whole machine in MuJoCo."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

import sweep
from sweep.evaluation.balancing import CorrectionPlane, best_counterweights, rms
from sweep.families import family
from sweep.study import load_study
from tests.support.mujoco_machine import WholeMachine

FOLDER = Path(__file__).parents[2] / "studies" / "head208"
OMEGA = 7000.0 * 2.0 * np.pi / 60.0
PARTS = [f"{name}_{x}" for name in ("shake", "shake_moment") for x in "xyz"]
TURN = np.arange(360) * (2.0 * np.pi / 360)
# MuJoCo closes loops to 1e-15 m; a rod's joints are some 50 mm apart.
NEAR = 1e-9  # mm, and of the largest force, moment or torque


@pytest.fixture(scope="module")
def accepted():
    return load_study(FOLDER), json.loads((FOLDER / "expected.json").read_text())


def complete(study, design):
    return dict(study.reference) | design


@pytest.mark.parametrize("name", ["reference", "optimum"])
def test_accepted_figures_are_those_of_the_accepted_designs(accepted, name):
    study, expected = accepted
    design = complete(study, {} if name == "reference" else expected["optimum"]["design"])
    found = sweep.summarise(study.bare, design, list(study.want), accuracy=1e-6).iloc[0]
    for output, value in expected[name]["outputs"].items():
        assert found[output] == pytest.approx(value, rel=1e-6, abs=1e-6), output


def test_optimum_is_the_least_squares_of_two_counterweights(accepted):
    """Forces are linear in the counterweights: the optimiser ends where a linear least-squares problem ends."""
    study, expected = accepted
    found = sweep.evaluate(study.bare, study.reference, PARTS, phi=TURN)
    force, moment = found[PARTS[:3]].to_numpy(), found[PARTS[3:]].to_numpy()
    across = {"mark": (0.0, 1.0, 0.0), "across": (0.0, 0.0, 1.0)}
    places = [CorrectionPlane(at=(0.0, 0.0, 0.0), **across)]
    places += [CorrectionPlane(at=(0.0, -39.743, -55.139), ratio=-1.0, **across)]
    best = best_counterweights(TURN, force, moment, OMEGA, places)
    assert rms(best.force) == pytest.approx(expected["optimum"]["outputs"]["rms_shake"], rel=1e-6)
    assert rms(force) / rms(best.force) == pytest.approx(expected["factor"], rel=1e-6)


def test_the_machine_in_mujoco_stands_moves_and_shakes_the_same(accepted):
    study, _ = accepted
    machine, design = family(study.bare), complete(study, {"needle.com_crank_x1": -3.0, "looper.com_crank_y": 4.0})
    # MuJoCo refuses a plate without inertia across; round bodies turn in their planes alike
    flat = [name for name in design if "_zz" in name and design[name] > 0.0 and "coupler_zz1" not in name]
    design |= {name.replace("_zz", pair): design[name] for name in flat for pair in ("_xx", "_yy")}
    start = 0.3
    model = WholeMachine(machine, design, start)
    angles = np.linspace(start, start + 2.0 * np.pi, 73)  # on from pose to pose: Newton stays in its assembly
    names = [f"{point}_{x}" for point in ("needle.point", "looper.tip", "feed.t") for x in "xyz"]
    ours = sweep.evaluate(study.bare, design, [*names, *PARTS, "shaft"], phi=angles)
    at_start = sweep.evaluate(study.bare, design, names, phi=[start]).iloc[0]
    first = [at_start[names[3 * k : 3 * k + 3]].to_numpy(float) for k in range(3)]
    rows = []
    for phi in angles:
        model.at(phi, OMEGA)
        place = [
            model.placed(b, p) for b, p in zip(("needle2 coupler", "looper link", "feed rack"), first, strict=True)
        ]
        force, moment, power = model.shaking()
        # the needle bar moves upright with its point, on its line
        point = 1e-3 * place[0]
        at, w, v, _, _ = model.moving("needle2 coupler")
        speed, change = v + np.cross(w, point - at), model.acceleration("needle2 coupler", point)
        push = -1e3 * design["needle.m_tool2"] * change[2] * np.array([0.0, 0.0, 1.0])
        force, power = force + push, power - 1e3 * push[2] * speed[2]
        moment = moment + np.cross(model_line(study, design), push)
        rows.append(np.concatenate([*place, force, moment, [power / OMEGA]]))
    found = np.array(rows)
    assert np.abs(found[:, :9] - ours[names].to_numpy()).max() < NEAR
    for columns, ours_of in ((slice(9, 12), PARTS[:3]), (slice(12, 15), PARTS[3:]), (slice(15, 16), ["shaft"])):
        size = np.abs(ours[ours_of].to_numpy()).max()
        assert np.abs(found[:, columns] - ours[ours_of].to_numpy()).max() < NEAR * size


def model_line(study, design):
    """A point of the needle's line [mm]: upright through where the point is when it does not deviate."""
    found = sweep.evaluate(
        study.bare, design, ["needle.point_x", "needle.point_y", "needle.dev"], phi=np.array([0.0, 1.0])
    )
    slope = np.ptp(found["needle.point_x"]) / np.ptp(found["needle.dev"])
    sign = np.sign(np.diff(found["needle.point_x"]) * np.diff(found["needle.dev"]))[0]
    assert slope == pytest.approx(1.0, abs=1e-9)
    return np.array([found["needle.point_x"][0] - sign * found["needle.dev"][0], found["needle.point_y"][0], 0.0])
