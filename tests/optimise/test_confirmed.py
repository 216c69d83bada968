"""What a search ends at against ``summarise``: phases of cams, narrow peaks, jumps of tools, friction, tables."""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest

import sweep
from kernels import status as st
from studies.accuracy.ordinary import designs
from sweep.cli.ending import ending
from sweep.dataset.files import OPTIMUM, beside
from sweep.effects import extended
from sweep.engine.run import run
from sweep.evaluation.loads import curves_of
from sweep.families import family
from sweep.optimise import Problem, Result, minimise
from sweep.optimise.extrema import scanned
from sweep.optimise.local.start import DIFFERS
from sweep.study import Limit, OptimiseSettings, load_study

ONCE = OptimiseSettings(starts=1, seed=1, looks=400)
TARGET = 1e-9

CAM = {"lift": 1.0, "rise": 1.0, "dwell": 0.7, "fall": 1.2, "start": 0.3, "law": 2.0, "r0": 3.0, "e": 0.4}
SHORT = CAM | {"lift": 0.05, "rise": 0.02, "dwell": 0.0, "fall": 0.02, "start": 2.03, "law": 1.0, "e": 0.1}
SLIT = {"a": 1.0, "e": 1.003, "f": 2e-3, "g": 0.0, "alpha": 0.0, "Lw": 2.0}
PLANET = {"k": 1.17, "a": 0.2, "n": 63.0, "mesh": 1.0}
BOX = {"b": (92.0, 85.0, 105.0), "f": (14.0, 4.0, 20.0)}
TABLE = {"load_torque": ([0.0, 1.97, 2.0, 2.03, 6.0], [0.0, 0.0, 300000.0, 0.0, 0.0])}
SERIES = {"load_torque": {"mean": 0.0, "cos": [0.0] * 63 + [3000.0]}}


def loaded(name: str, outputs: Sequence[str], **more: float) -> dict[str, float]:
    full = extended(family(name), outputs)
    return dict(zip(full.parameter_names, map(float, designs(full, 1)[0]), strict=True)) | more


def pierced(share: float, sense: float = 1.0) -> dict[str, float]:
    """A needle that pierces so far before its turning point, as a share of its stroke."""
    row = loaded("guide", ["tool_load"])
    ends = sweep.summarise("guide", row, ["max_s", "min_s"], accuracy=TARGET).iloc[0]
    at = float(ends["max_s"] - share * (ends["max_s"] - ends["min_s"]))
    return row | {"pierce_force": 400.0, "pierce_at": at, "pierce_sense": sense, "m_tool": 2e-5}


def around(row: dict[str, float], reach: dict[str, float]) -> dict[str, tuple[float, float, float]]:
    return {name: (row[name], row[name] - by, row[name] + by) for name, by in reach.items()}


def search(
    name: str,
    row: dict[str, float],
    varied: dict[str, tuple[float, float, float]],
    objective: str,
    limits: Sequence[Limit] = (),
    loads: Any = None,
    window: tuple[float, float] | None = None,
) -> tuple[Result, pd.Series]:
    """One search, and what summarise says of the design that it ends at; ``varied`` are start and bounds by name."""
    plain, asked = family(name), [objective, *(limit.output for limit in limits)]
    asked = [output for output in asked if output not in plain.parameter_names]
    full = extended(plain, asked) if loads is None else extended(plain, asked, curves_of(plain, loads))
    values = {p.name: p.default for p in full.parameters} | dict(full.example) | row
    fixed = {n: x for n, x in values.items() if n in full.parameter_names and n not in varied and x is not None}
    signs = {n: fixed.pop(n) for n in list(fixed) if n.startswith("branch")}
    start, low, high = np.array(list(varied.values())).T
    problem = Problem(full, tuple(varied), low, high, fixed, objective, tuple(limits), window)
    found = minimise(problem, problem.rows(start[None, :], **signs), ONCE)[0]
    table = dict(zip(full.parameter_names, found.design, strict=True))
    return found, sweep.summarise(name, table, asked, accuracy=TARGET, loads=loads, window=window).iloc[0]


def assert_confirmed(found: Result, said: pd.Series, objective: str, limits: Sequence[Limit] = ()) -> None:
    assert said["status"] == st.OK
    for output, value in ({objective: found.objective} | {x.output: found.values[x.output] for x in limits}).items():
        if output in said:
            assert abs(value - said[output]) <= said[f"err_{output}"]
    for limit in limits:
        assert limit.maximum is not None
        # What the search calls feasible misses a limit by a billionth of it at most.
        assert said[limit.output] <= limit.maximum * (1.0 + 1.1e-9) or found.status == st.LIMIT_EXCEEDED


CASES: dict[str, tuple[str, dict[str, float], dict[str, tuple[float, float, float]], str, tuple[Limit, ...], Any]] = {
    "jerk of a cam jumps where its phases end": (
        "cam", CAM, {"rise": (1.0, 0.3, 1.3), "r0": (3.0, 2.0, 6.0)}, "max_abs_d3s", (), None,
    ),
    "cam with phases between two poses": (
        "cam", SHORT, {"rise": (0.01, 0.008, 0.02), "fall": (0.012, 0.008, 0.02)}, "max_abs_d2s", (), None,
    ),
    "least cam whose short phases keep a pressure angle": (
        "cam", SHORT, {"r0": (30.0, 1.0, 60.0), "fall": (0.02, 0.01, 0.03)}, "r0",
        (Limit("max_pressure_angle", None, 0.6),), None,
    ),
    "lever of a cam with short phases": (
        "cam_lever", SHORT | {"c": 5.0, "e": 6.0, "branch": 1.0}, {"c": (5.0, 4.0, 6.0), "r0": (3.0, 2.0, 5.0)},
        "max_pressure_angle", (), None,
    ),
    "planet as fast as poses stand": (
        "epicyclic_dwell", PLANET, {"k": (1.17, 1.1, 1.3), "a": (0.2, 0.1, 0.3)}, "max_abs_d2psi", (), None,
    ),
    "geared dwell near its cusp": (
        "geared_dwell", {}, {"k": (1.9, 1.7, 1.95), "a": (-0.103, -0.12, -0.08)}, "max_abs_d2psi", (), None,
    ),
    "swivel that turns within a few thousandths of a radian": (
        "swivel", SLIT, {"e": (1.003, 1.002, 1.01), "f": (2e-3, 1e-3, 4e-3)}, "max_abs_d2y_p", (), None,
    ),
    "rack": (
        "feed", {}, {"xE": (5.6, 5.3, 5.9), "fx": (-1.7, -1.8, -1.6)}, "max_abs_d2chi", (), None,
    ),
    "friction whose torque jumps where joints reverse": (
        "rssr", loaded("rssr", ["max_abs_drive_torque_friction"], speed=60.0), BOX | {"e": (70.0, 60.0, 80.0)},
        "max_abs_drive_torque_friction", (), None,
    ),
    "short load of a table": (
        "rssr", loaded("rssr", ["max_abs_drive_torque"]), BOX, "max_abs_drive_torque", (), TABLE,
    ),
    "load of 64 waves as a limit": (
        "rssr", loaded("rssr", ["max_abs_drive_torque"]), BOX, "max_abs_d2psi",
        (Limit("max_abs_drive_torque", None, 17_000.0),), SERIES,
    ),
}  # fmt: skip


@pytest.mark.parametrize("case", CASES)
def test_value_of_an_optimum_is_that_of_summarise_within_its_error(case: str) -> None:
    name, row, varied, objective, limits, loads = CASES[case]
    row = {n: x for n, x in row.items() if loads is None or n not in loads}
    found, said = search(name, row, varied, objective, limits, loads)
    assert_confirmed(found, said, objective, limits)
    # Nothing that the search followed had to be put right.
    assert (found.ended, found.status) == ("converged", st.OK)


@pytest.mark.parametrize("sense", [1.0, -1.0])
@pytest.mark.parametrize("share", [0.3, 0.01, 1e-3])
def test_load_of_a_tool_that_pierces_is_that_of_summarise(share: float, sense: float) -> None:
    """The force sets in where the needle passes the fabric, at an edge that moves with the design."""
    row = pierced(share, sense)
    varied = around(row, {"b": 0.3, "c": 0.3})
    found, said = search("guide", row, varied, "max_abs_tool_load")
    assert_confirmed(found, said, "max_abs_tool_load")
    first = sweep.summarise("guide", row, ["max_abs_tool_load"], accuracy=TARGET).iloc[0]
    assert found.objective <= first["max_abs_tool_load"] and found.ended == "converged"


def test_limit_on_the_load_of_a_tool_that_pierces_is_kept_by_summarise() -> None:
    """A longer crank has more stroke and loads the tool more, most where it pierces."""
    row, limits = pierced(0.3), (Limit("max_tool_load", None, 373.0),)
    found, said = search("guide", row, around(row, {"a": 0.2, "xi": 1.0}), "minus_stroke", limits)
    assert found.feasible and said["max_tool_load"] == pytest.approx(373.0, rel=1e-6)
    assert_confirmed(found, said, "minus_stroke", limits)


def test_a_straightness_in_a_window_is_that_of_summarise_beside_a_tool_that_pierces() -> None:
    """The ends of the stroke, which the window counts from, are edges where a tool jumps."""
    row, limits = pierced(0.3), (Limit("max_abs_tool_load", None, 373.0),)
    found, said = search("guide", row, around(row, {"a": 0.2, "xi": 1.0}), "max_abs_dev", limits, window=(0.0, 0.6))
    assert_confirmed(found, said, "max_abs_dev", limits)
    assert (found.ended, found.status) == ("converged", st.OK)


@pytest.mark.parametrize("objective", ["max_abs_d2alpha", "max_abs_dalpha", "max_abs_epsilon3", "max_abs_omega3"])
@pytest.mark.parametrize("coupler", [28.0, 32.3, 37.7])
def test_a_rocker_that_stands_still_is_found(objective: str, coupler: float) -> None:
    """Its ball stays on the crank's axis, at b + z from the crank: h^2 = a^2 + z^2, l^2 = r^2 + (b + z)^2."""
    row = {"r": 10.0, "l": coupler, "h": 21.0, "a": 20.0, "b": 30.0, "branch": -1.0}
    varied = around(row, {"l": 1.0, "h": 1.5})
    found, _ = search("kim_dison", row, varied, objective)
    assert (found.ended, found.status) == ("converged", st.OK)
    assert 0.0 <= found.objective < 1e-14  # of values near 1: nothing but rounding
    length, rocker = found.design[1], found.design[2]
    z = np.sqrt(length**2 - 100.0) - 30.0
    assert rocker == pytest.approx(math.hypot(20.0, z), rel=1e-12)


@pytest.mark.parametrize("objective", ["range_dev", "max_dev", "minus_min_dev", "minus_max_dev", "min_dev"])
def test_every_reduction_of_a_deviation_counts_in_the_window_alone(objective: str) -> None:
    """The least of a scan of one dimension, each design at dense poses, is no lower than what the search ends at."""
    row, window = loaded("guide", ["dev"]), (0.3, 0.8)
    varied = around(row, {"eta": 0.3})
    found, said = search("guide", row, varied, objective, window=window)
    assert_confirmed(found, said, objective)
    assert (found.ended, found.status) == ("converged", st.OK)
    scan = {name: np.full(61, x) for name, x in row.items()} | {"eta": np.linspace(*varied["eta"][1:], 61)}
    poses = sweep.evaluate("guide", scan, ["s", "dev"], phi=np.arange(2880) * (2.0 * np.pi / 2880))
    s, dev = (poses[name].to_numpy().reshape(61, -1) for name in ("s", "dev"))
    share = (s - s.min(axis=1, keepdims=True)) / np.ptp(s, axis=1, keepdims=True)
    inside = (share >= window[0]) & (share <= window[1])
    most, least = np.where(inside, dev, -np.inf).max(axis=1), np.where(inside, dev, np.inf).min(axis=1)
    values = {"range_dev": most - least, "max_dev": most, "min_dev": least}
    reached = (-1.0 if objective.startswith("minus_") else 1.0) * values[objective.removeprefix("minus_")]
    step = np.abs(np.diff(dev, axis=1)).max()  # an edge of the window, of which a range has two, lies between two poses
    assert found.objective == pytest.approx(reached.min(), abs=2.0 * step)


def test_the_largest_stroke_of_a_member_is_that_of_its_longest_crank() -> None:
    """Without an offset the stroke is twice the crank; its negative has no magnitude to be compared by."""
    two = family(sweep.machine({"needle": "slider_crank", "looper": {"family": "slider_crank", "ratio": 2}}))
    fixed = {"needle.b": 30.0, "needle.a": 5.0, "needle.e": 0.0, "looper.b": 30.0, "looper.e": 0.0}
    box = np.array([5.0]), np.array([9.0])
    problem = Problem(two, ("looper.a",), *box, fixed, "minus_looper.stroke", (Limit("needle.stroke", None, 11.0),))
    signs = {"needle.branch": 1.0, "looper.branch": -1.0}
    found = minimise(problem, problem.rows(np.array([[6.0]]), **signs), ONCE)[0]
    assert (found.ended, found.status) == ("converged", st.OK)
    assert found.objective == pytest.approx(-18.0, rel=1e-12)


def blind(monkeypatch: pytest.MonkeyPatch) -> None:
    """Let the search look at its poses alone, as if no family knew of phases and edges."""
    monkeypatch.setattr(scanned, "poses_needed", lambda family, design, outputs: 0)
    monkeypatch.setattr(scanned, "may_bend", lambda family, outputs: False)


def test_a_search_that_missed_a_jump_has_not_converged_and_says_the_true_value(monkeypatch: pytest.MonkeyPatch) -> None:
    blind(monkeypatch)
    name, row, varied, objective, _, _ = CASES["jerk of a cam jumps where its phases end"]
    found, said = search(name, row, varied, objective)
    assert_confirmed(found, said, objective)
    assert (found.ended, found.status) == (DIFFERS, st.NOT_CONVERGED) and found.feasible
    assert found.gap == pytest.approx(2.0 / 3.0, rel=1e-6)  # a third of the jerk is all that the poses show


def test_a_design_that_misses_a_limit_by_summarise_is_infeasible(monkeypatch: pytest.MonkeyPatch) -> None:
    blind(monkeypatch)
    row, limits = pierced(0.3), (Limit("max_tool_load", None, 300.0),)
    found, said = search("guide", row, around(row, {"a": 0.2, "xi": 1.0}), "max_abs_d2s", limits)
    assert (found.ended, found.status) == (DIFFERS, st.LIMIT_EXCEEDED)
    assert found.relaxation["max_tool_load"] == pytest.approx(said["max_tool_load"] - 300.0, abs=1e-6)
    assert found.violation == pytest.approx(found.relaxation["max_tool_load"] / 300.0, rel=1e-12)


def test_edges_are_the_ends_of_phases_and_where_a_tool_pierces() -> None:
    cam = family("cam")
    design = np.array([{p.name: p.default for p in cam.parameters} | CAM], dtype=object)[0]
    matrix = np.array([design[name] for name in cam.parameter_names], np.float64)
    ends = 0.3 + np.array([0.0, 1.0, 1.7, 2.9])
    (before, behind), which = scanned.edges(cam, matrix, ["d3s"])
    assert sorted(which[which >= 1.0]) == list(range(1, 9))
    for end in ends:
        k = int(np.abs(0.5 * (before + behind) - end).argmin())
        assert before[k] < end < behind[k] and behind[k] - before[k] < 1e-10
    row = pierced(0.01)
    full = extended(family("guide"), ["tool_load"])
    sides, _ = scanned.edges(full, np.array([row[name] for name in full.parameter_names]), ["tool_load"])
    loads = sweep.evaluate("guide", row, ["tool_load"], phi=sides.ravel())["tool_load"].to_numpy().reshape(2, -1)
    jumps = np.abs(loads[1] - loads[0])
    # In at the fabric and off at the turning point; elsewhere a slope of some hundreds makes 1e-8.
    assert (np.abs(jumps - 400.0) < 1e-4).sum() == 2 and (jumps < 1e-4).sum() == jumps.size - 2


STUDY = """
[study]
name = "jumping"
[mechanism]
family = "cam"
[scene]
want = ["max_abs_d3s"]
[design]
lift = "1 mm"
rise = { from = 20, to = 75, count = 3, unit = "deg" }
dwell = "40 deg"
fall = "70 deg"
law = 2
r0 = "3 mm"
e = "0.4 mm"
[objective]
minimise = "max_abs_d3s"
[optimise]
starts = 1
"""


@pytest.mark.parametrize("missed", [True, False])
def test_terminal_warns_of_a_search_that_followed_other_values(
    missed: bool, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    if missed:
        blind(monkeypatch)
    (tmp_path / "study.toml").write_text(STUDY)
    folder = run(load_study(tmp_path), tmp_path / "out", jobs=1)
    best = pd.read_parquet(beside(folder) / OPTIMUM).iloc[0]
    assert (best["ended"] == DIFFERS) is missed and math.isfinite(best["max_abs_d3s"])
    warned = [line for line in ending(folder).lines if "beside the true ones" in line]
    assert len(warned) == missed


def test_a_limit_that_is_kept_and_holds_nothing_back_may_differ():
    """The speed of a tip is 0 where it turns back, with a kink that no search follows: its range is some 1e-5 off."""
    machine = sweep.machine({"p": {"family": "rssr", "tip": [2.0, 0.5, 0.0]}}, {"pace": {"speed": ["p.tip"]}})
    given = {f"p.{name}": float(x) for name, x in family("rssr").example.items() if name != "p.b"}

    def ended(objective: str, most: float) -> Result:
        limits = (Limit("range_pace", None, most),)
        problem = Problem(
            family(machine), ("p.b",), np.array([3.9]), np.array([4.4]), given | {"p.b": 4.2}, objective, limits
        )
        return minimise(problem, problem.rows(np.array([[4.2]])), ONCE)[0]

    free, held = ended("p.max_abs_d2psi", 1.26), ended("minus_p.max_abs_d2psi", 1.26)
    assert free.ended == "converged" and free.active == ("p.b at its lower bound",)
    # Of a speed that is 0 somewhere the range is the largest one, and that has no kink.
    fastest = sweep.summarise(machine, given | {"p.b": 3.9}, "max_pace")["max_pace"][0]
    assert free.values["range_pace"] == pytest.approx(fastest, abs=1e-8)
    assert held.ended == DIFFERS and held.active == ("range_pace at its maximum",)
