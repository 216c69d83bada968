"""Slopes of a thread's extremes that lie at kinks, against central differences of what `summarise` gives."""

from __future__ import annotations

import numpy as np
import pandas as pd
import pytest

import sweep
from sweep.optimise.manufacture.tolerance import sensitivities
from tests.evaluation.thread.test_balance import HOLE, STOP
from tests.evaluation.thread.test_events import DESIGN, machine

DRIVE = {"a": 10.0, "b": 40.0, "c": 30.0, "e": 38.0, "xi": 12.0, "eta": 5.0, "lam": 0.3, "h": 0.0}
BLADE = [[-73.8, 11.0, -1.6], "blade", [-56.5, 11.9, 6.7]]
# Where the extreme lies, and dimensions that move it: the slope of the tension has other signs on both sides.
CASES = {
    "becomes slack": ("min_upper_tension", {"stock": 257.5, "stiffness": 0.1}, 0.0),
    "leaves the measured speeds": ("max_upper_tension", {}, 700.0),
    "comes to the slowest measured speed": ("min_upper_tension", {}, 700.0),
}


def worst(made, table, output, names):
    """Return by how much slopes are off differences of the output, in parts of the largest slope."""
    design = np.array([float(table.get(p.name, p.default or 0.0)) for p in made.parameters])
    slopes = pd.DataFrame(sensitivities(made, design, [output])).set_index("parameter").loc[list(names)]
    step = 1e-4
    moved = np.repeat(design[None], 2 * len(names), axis=0)
    for k, name in enumerate(names):
        moved[2 * k : 2 * k + 2, made.parameter_names.index(name)] += [step, -step]
    found = sweep.summarise(made, dict(zip(made.parameter_names, moved.T, strict=True)), [output], accuracy=1e-11)
    differences = (found[output].to_numpy()[::2] - found[output].to_numpy()[1::2]) / (2.0 * step)
    off = np.abs(slopes[["growing", "shrinking"]].to_numpy() - differences[:, None])
    return off.max() / np.abs(slopes["growing"]).max()


@pytest.mark.parametrize("case", CASES)
def test_slopes_of_a_tension_at_its_kinks_are_those_of_central_differences(case):
    """Differences over 1e-4 of 10 mm, or rad, leave 1e-6 of the slope out; the extremes' rounding is 1e-11/1e-4."""
    output, changes, speed = CASES[case]
    thread = {"thread": [STOP, "drive.point", HOLE], "tension": 0.2, "radius": 2.4} | changes
    table = {f"drive.{name}": value for name, value in DRIVE.items()} | {"upper_speed": speed}
    made = sweep.machine({"drive": "guide"}, {"upper": thread})
    names = ["drive.a", "drive.b", "drive.xi", "drive.eta", "drive.offset", "drive.y_tilt", "drive.z_tilt"]
    assert worst(made, table, output, names) < 1e-5


@pytest.mark.parametrize("output", ["min_upper_rate", "max_upper_rate"])
def test_slopes_of_the_rate_over_a_blade_hold_where_the_thread_comes_to_its_end(output):
    made = machine(thread=BLADE)
    names = ["looper.a", "looper.alpha", "looper.offset", "looper.x_tilt", "looper.y_tilt", "looper.z_tilt"]
    assert worst(made, DESIGN, output, names) < 1e-6
