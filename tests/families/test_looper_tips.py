"""Tip and timing of every looper: clearance, arrival, residence, passing of a plane, speed there, and their slopes.

Each looper stands beside a slider-crank as needle on one shaft.  Levels are halfway between the least and the largest
value of what passes them, so every event happens.
"""

from __future__ import annotations

from functools import cache

import numpy as np
import pandas as pd
import pytest

import sweep
from sweep.families import family
from sweep.families.base import Accuracy
from sweep.optimise import Problem, minimise
from sweep.optimise.manufacture.tolerance import sensitivities
from sweep.study import Limit, OptimiseSettings
from tests.support.selection import mostly_long

TIP = {"tip": [8.0, 1.0, 0.5]}
LOOPERS = {
    "rssr": ({"family": "rssr"} | TIP, "tip", "a"),
    "five_link": ({"family": "five_link"} | TIP, "tip", "h"),
    "slotted": ({"family": "slotted"} | TIP, "tip", "a"),
    "swivel": ({"family": "swivel"}, "p", "Lw"),
    "rssr, swivel": ({"chain": ["rssr", "swivel"]}, "p", "a1"),
    "spherical_looper": ({"family": "spherical_looper"}, "p", "p0x"),
    "cylindrical_looper": ({"family": "cylindrical_looper"}, "p", "a2"),
}
SECOND = {"a2": 1.5, "e2": 3.0, "f2": 0.2, "g2": -0.1, "alpha2": 0.4, "Lw2": 6.0}
PHI = np.linspace(0.0, 2.0 * np.pi, 7201)
OUTPUTS = ["min_clearance", "phi_min_clearance", "phi_arrive", "stay", "phi_plane", "max_pace", "speed_there"]


def design(name):
    own = family("rssr").example if "," in name else family(name).example
    own = {f"{k}1": v for k, v in own.items()} | SECOND if "," in name else dict(own)
    return {"needle.a": 1.0, "needle.b": 4.0} | {f"looper.{k}": v for k, v in own.items()}


@cache
def machine(name):
    member, point, _ = LOOPERS[name]
    members = {"needle": "slider_crank", "looper": member | {"place": {"at": [0.5, -9.0, 3.0]}, "offset": 0.4}}
    apart = {"clearance": {"distance": ["needle.c", f"looper.{point}"]}, "pace": {"speed": [f"looper.{point}"]}}
    bare = sweep.machine(members, apart)
    across = f"looper.{point}_x"
    curves = sweep.evaluate(bare, pd.DataFrame([design(name)]), ["clearance", across], phi=PHI)
    assert (curves["status"] == 0).all()
    near, level = (float(curves[x].min() + curves[x].max()) / 2.0 for x in ("clearance", across))
    return sweep.machine(
        members,
        apart
        | {
            "arrive": {"event": "clearance", "level": near, "rising": False},
            "leave": {"event": "clearance", "level": near},
            "stay": {"timing": ["phi_arrive", "phi_leave"]},
            "plane": {"event": across, "level": level},
            "speed_there": {"value": ["pace", "phi_arrive"]},
        },
    ), (near, level, across)


def summarised(name, table):
    found = sweep.summarise(machine(name)[0], table, OUTPUTS, accuracy=1e-11)
    assert (found["status"] == 0).all()
    return found.iloc[0]


def first_passage(values, level, rising):
    off = (values - level) * (1.0 if rising else -1.0)
    k = np.flatnonzero((off[:-1] < 0.0) & (off[1:] >= 0.0))[0]
    return PHI[k] - off[k] * (PHI[k + 1] - PHI[k]) / (off[k + 1] - off[k])


@pytest.mark.parametrize("name", LOOPERS)
def test_tip_and_timing_are_what_a_dense_grid_shows(name):
    (built, (near, level, across)), table = machine(name), pd.DataFrame([design(name)])
    found = summarised(name, table)
    curves = sweep.evaluate(built, table, ["clearance", "pace", across], phi=PHI)
    step = PHI[1]
    # what a parabola through samples leaves between them: second order in the step, curves here are of size 10
    assert found.min_clearance == pytest.approx(curves["clearance"].min(), abs=10.0 * step**2)
    assert found.max_pace == pytest.approx(curves["pace"].max(), abs=100.0 * step**2)
    arrive = first_passage(curves["clearance"].to_numpy(), near, rising=False)
    assert found.phi_arrive == pytest.approx(arrive, abs=50.0 * step**2)
    assert found.phi_plane == pytest.approx(
        first_passage(curves[across].to_numpy(), level, rising=True), abs=50 * step**2
    )
    there = sweep.evaluate(built, table, ["pace", "clearance"], phi=[found.phi_arrive]).iloc[0]
    assert there["clearance"] == pytest.approx(near, rel=1e-12)
    assert found.speed_there == pytest.approx(there["pace"], rel=1e-12)


@pytest.mark.parametrize("name", mostly_long(LOOPERS, ("slotted", "rssr, swivel")))
def test_slopes_of_tip_and_timing_are_those_of_differences(name):
    (built, _), given = machine(name), design(name)
    at = [given.get(p.name, p.default) for p in built.parameters]
    rows = pd.DataFrame(sensitivities(built, np.array(at, float), OUTPUTS)).set_index(["output", "parameter"])
    steps = {f"looper.{LOOPERS[name][2]}": 1e-4, "looper.x_at": 1e-3, "looper.offset": 1e-4}
    for parameter, h in steps.items():
        value = at[built.parameter_names.index(parameter)]
        ends = [summarised(name, pd.DataFrame([given | {parameter: value + k * h}])) for k in (-2.0, -1.0, 1.0, 2.0)]
        for output in OUTPUTS:
            low, below, above, high = (float(end[output]) for end in ends)
            slope = (low - 8.0 * below + 8.0 * above - high) / (12.0 * h)
            # places of extrema are known to 1e-10 or so, over h; values and passages to rounding
            got = rows.loc[(output, parameter), "growing"]
            assert got == pytest.approx(slope, rel=1e-5, abs=1e-5), (output, parameter)


@pytest.mark.parametrize("name", LOOPERS)
def test_tip_and_timing_are_limits_and_objective_of_a_search(name):
    """The slowest arrival for a clearance and a residence that the start has: the search keeps both and gains."""
    (built, _), given = machine(name), design(name)
    start = summarised(name, pd.DataFrame([given]))
    at = {p.name: given.get(p.name, p.default) for p in built.parameters}
    free = ("looper.offset", "looper.x_at", "looper.y_at")
    place = np.array([at[x] for x in free])
    limits = (
        Limit("min_clearance", 0.98 * start.min_clearance, None),
        Limit("stay", start.stay - 0.05, start.stay + 0.05),
    )
    fixed = {key: value for key, value in at.items() if key not in free}
    wide = np.array([0.1, 0.1, 0.1])
    problem = Problem(
        built, free, place - wide, place + wide, fixed, "speed_there", limits, None, Accuracy(target=1e-9)
    )
    best = minimise(problem, problem.rows(place[None, :]), OptimiseSettings(starts=1))[0]
    assert best.status == 0 and best.violation <= 1e-9
    found = summarised(name, pd.DataFrame([dict(zip(built.parameter_names, best.design, strict=True))]))
    assert found.speed_there < start.speed_there
    assert found.min_clearance >= limits[0].minimum * (1.0 - 1e-8)
    assert limits[1].minimum - 1e-8 <= found.stay <= limits[1].maximum + 1e-8
