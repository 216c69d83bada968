"""The box of a mechanism and the least transmission angle: against poses, at optima, in chains and machines."""

from __future__ import annotations

import math

import numpy as np
import pytest

import sweep
from kernels import status as st
from sweep.errors import InputError
from sweep.families import NAMES, family, machine
from sweep.families.base import Accuracy
from sweep.optimise import Problem, minimise
from sweep.optimise.local.model import Model
from sweep.optimise.manufacture.tolerance import sensitivities
from sweep.optimise.problem.program import Program
from sweep.quantities.box import boxes
from sweep.study import Limit, OptimiseSettings

GUIDE = {"a": 1.0, "b": 3.3, "c": 3.1, "e": 3.0, "xi": 4.2, "eta": 0.8, "lam": 1.1, "h": -0.6}
CRANK_ROCKER = {"a": 1.0, "b": 4.0, "c": 2.5, "e": 3.1, "f": 0.7, "g": -0.6, "alpha": 0.9}
CHAIN = {f"{k}1": x for k, x in CRANK_ROCKER.items()} | {f"{k}2": x for k, x in GUIDE.items()}
MACHINE = {"needle": ["rssr", "guide"], "looper": {"family": "rssr", "ratio": 2, "place": {"at": [10.0, 0.0, 0.0]}}}
OF_MACHINE = {f"needle.{k}": x for k, x in CHAIN.items()} | {f"looper.{k}": x for k, x in CRANK_ROCKER.items()}
STILL = {"rssr": [[0.0, 0.7 * math.sin(0.9), 0.7 * math.cos(0.9)], [3.1, 0.0, -0.6]], "guide": [[0.0] * 3, [3.0, 0, 0]]}
GRID = np.linspace(0.0, 2.0 * np.pi, 20001)


def one(mechanism, table, wanted):
    found = sweep.summarise(mechanism, {name: [x] for name, x in table.items()}, list(wanted))
    assert found["status"].tolist() == [st.OK]
    return found.iloc[0]


def reach(mechanism, table, joints, axis, still):
    """Largest minus smallest coordinate of all joints over a dense grid of poses."""
    names = [f"{axis}_{joint}" for joint in joints]
    found = sweep.evaluate(mechanism, {k: [x] for k, x in table.items()}, names, phi=GRID)[names].to_numpy()
    return max(found.max(), *still) - min(found.min(), *still)


@pytest.mark.parametrize(
    ("name", "table", "joints", "axes"), [("rssr", CRANK_ROCKER, "bc", "xyz"), ("guide", GUIDE, "bcm", "xy")]
)
def test_box_holds_all_joints_over_a_turn(name, table, joints, axes) -> None:
    found = one(name, table, [f"box_{axis}" for axis in axes])
    for k, axis in enumerate(axes):
        dense = reach(name, table, joints, axis, [point[k] for point in STILL[name]])
        # a grid of 20 000 misses an extremum by (pi/20000)^2/2 of its curvature, which is at most some tens
        assert -1e-9 <= found[f"box_{axis}"] - dense <= 1e-6 and found[f"err_box_{axis}"] < 1e-6


def test_box_of_a_planar_linkage_has_no_height() -> None:
    with pytest.raises(InputError, match="box_x"):
        sweep.summarise("guide", {k: [x] for k, x in GUIDE.items()}, ["box_z"])


def test_boxes_of_a_chain_are_those_of_its_stages() -> None:
    found = one(["rssr", "guide"], CHAIN, ["box_x1", "box_z1"])
    alone = one("rssr", CRANK_ROCKER, ["box_x", "box_z"])
    assert found["box_x1"] == pytest.approx(alone["box_x"], abs=2e-8) and found["box_z1"] == pytest.approx(
        alone["box_z"], abs=2e-8
    )
    with pytest.raises(InputError, match=r"box_x exists for a stage, as box_x1"):
        sweep.summarise(["rssr", "guide"], {k: [x] for k, x in CHAIN.items()}, ["box_x"])


def test_box_of_a_machine_is_in_its_own_frame() -> None:
    found = one(machine(MACHINE), OF_MACHINE, ["box_x", "looper.box_x"])
    placed = [f"needle.{joint}_x" for joint in ("b", "c", "point")] + ["looper.b_x", "looper.c_x"]
    table = {k: [x] for k, x in OF_MACHINE.items()}
    dense = sweep.evaluate(machine(MACHINE), table, placed, phi=GRID)[placed].to_numpy()
    still = [0.0, 3.0, 10.0, 13.1]  # bearings of the guide, and of the looper, whose origin stands at x = 10
    assert found["box_x"] == pytest.approx(max(dense.max(), *still) - min(dense.min(), *still), abs=1e-6)
    assert found["looper.box_x"] == pytest.approx(one("rssr", CRANK_ROCKER, ["box_x"])["box_x"], abs=2e-8)


def test_families_with_joints_that_are_no_pose_outputs_have_no_box() -> None:
    having = {name for name in NAMES if boxes(family(name))}
    assert {"rssr", "rssp", "guide", "four_bar", "slider_crank", "five_link", "spherical_looper", "swivel"} <= having
    assert having.isdisjoint({"cam_lever", "geared_dwell", "backrest", "foot", "cylindrical_looper"})


def test_least_transmission_angle_is_the_complement_of_the_pressure_angle() -> None:
    for mechanism, table, stages in (("rssr", CRANK_ROCKER, [""]), (["rssr", "guide"], CHAIN, ["", "1", "2"])):
        names = [f"{base}{s}" for base in ("least_transmission_angle", "max_pressure_angle") for s in stages]
        found = one(mechanism, table, names)
        for s in stages:
            total = found[f"least_transmission_angle{s}"] + found[f"max_pressure_angle{s}"]
            assert total == pytest.approx(0.5 * math.pi, abs=2e-15)
            assert found[f"err_least_transmission_angle{s}"] < 1e-13
    geared = one(
        machine(MACHINE),
        OF_MACHINE,
        [
            "looper.least_transmission_angle",
            "looper.margin",
            "needle.least_transmission_angle2",
            "least_transmission_angle",
        ],
    )
    alone = one("rssr", CRANK_ROCKER, ["least_transmission_angle", "margin"])
    assert geared["looper.margin"] == pytest.approx(alone["margin"], rel=1e-12)
    for name in ("looper.least_transmission_angle", "least_transmission_angle"):
        assert geared[name] == pytest.approx(alone["least_transmission_angle"], rel=1e-12)


def test_least_transmission_angle_stays_exact_where_the_linkage_nearly_locks() -> None:
    """A planar linkage whose longest diagonal a + e is b + c less a hair: half angles do not cancel there."""
    gap = 1e-12
    table = {"a": 1.0, "b": 3.0, "c": 2.0 + gap, "e": 4.0, "f": 0.0, "g": 0.0, "alpha": 0.0}
    found = one("rssr", table, ["least_transmission_angle", "margin"])
    slack = (table["b"] + table["c"]) - (table["a"] + table["e"])
    # sin^2(mu/2) = ((b + c)^2 - (a + e)^2)/(4 b c) for the angle mu that is missing to a straight line
    exact = 2.0 * math.asin(math.sqrt(slack * (slack + 10.0) / (4.0 * 3.0 * table["c"])))
    assert found["least_transmission_angle"] == pytest.approx(exact, abs=4 * found["err_least_transmission_angle"])
    assert found["least_transmission_angle"] == pytest.approx(math.sqrt(found["margin"]), rel=1e-9)


def problem(*limits: Limit) -> tuple[Problem, np.ndarray]:
    names = ("a", "b", "c", "e", "xi", "eta")
    lower = np.array([2.0, 4.0, 4.0, 4.0, -120.0, -120.0])
    upper = np.array([25.0, 60.0, 60.0, 60.0, 120.0, 120.0])
    fixed = {"lam": 0.0, "h": 0.0, "branch": 1.0}
    limits = (Limit("stroke", 24.5, 24.5), *limits)
    found = Problem(family("guide"), names, lower, upper, fixed, "max_abs_d2s", limits)
    return found, found.rows(np.array([[9.0, 24.0, 24.0, 20.0, 30.0, 6.0], [10.0, 30.0, 25.0, 22.0, 10.0, 10.0]]))


@pytest.mark.parametrize(
    ("limit", "same"),
    [
        (Limit("least_transmission_angle", 1.2, None), Limit("max_pressure_angle", None, 0.5 * math.pi - 1.2)),
        (Limit("box_x", None, 50.0), None),
    ],
)
def test_optimum_ends_at_the_limit(limit, same) -> None:
    limited, starts = problem(limit)
    best = minimise(limited, starts, OptimiseSettings())[0]
    assert best.status == st.OK and best.kkt_residual <= 1e-6
    row = dict(zip(limited.family.parameter_names, best.design, strict=True))
    bound = limit.minimum if limit.maximum is None else limit.maximum
    assert one("guide", row, [limit.output])[limit.output] == pytest.approx(bound, rel=1e-8)
    if same is not None:
        other = minimise(problem(same)[0], starts, OptimiseSettings())[0]
        assert best.objective == pytest.approx(other.objective, rel=1e-9)


@pytest.mark.parametrize("output", ["box_x", "box_y", "least_transmission_angle"])
def test_gradients_are_differences_of_the_output(output) -> None:
    own = family("guide")
    design = np.array([*GUIDE.values(), 1.0])
    rows = sensitivities(own, design, [output])
    step = 1e-4
    for name, slope in zip(rows["parameter"], rows["growing"], strict=True):
        k = own.parameter_names.index(name)
        ends = []
        for sign in (1.0, -1.0):
            moved = design.copy()
            moved[k] += sign * step
            table = {n: [x] for n, x in zip(own.parameter_names, moved, strict=True)}
            ends.append(float(sweep.summarise("guide", table, [output], accuracy=1e-12)[output].iloc[0]))
        # second order of the step
        assert slope == pytest.approx((ends[0] - ends[1]) / (2.0 * step), rel=1e-6, abs=1e-6)


def test_program_follows_what_stands_still() -> None:
    """A short crank beside a long frame: one end of the box is the rocker's bearing, which is a plain number."""
    limited, _ = problem(Limit("box_x", None, 80.0))
    program = Program(limited)
    start = limited.rows(np.array([[2.0, 60.0, 8.0, 60.0, 0.0, 0.0]]))[0]
    model = Model(limited, program, start, lambda: False)
    state = model.state(limited.scaled(start[None, :])[0])
    found = next(r.measure for r in program.requirements if r.measure.name == "box_x")
    value = program.value(found, state.form, model.curves, state.design, state.atoms)
    table = {n: [x] for n, x in zip(limited.family.parameter_names, start, strict=True)}
    wanted = sweep.summarise("guide", table, ["box_x", "max_x_c"], accuracy=Accuracy(target=1e-12).target)
    assert value == pytest.approx(float(wanted["box_x"].iloc[0]), rel=1e-10)
