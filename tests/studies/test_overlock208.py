"""The accepted head of overlock208 keeps its limits, makes a stitch, has its thread, and gives what is on record."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import sweep
from sweep.families.thread_balance import ThreadBalance
from sweep.quantities.limits import refusals
from sweep.study.load import load_study
from sweep.synthesis.thread_law import smoothest_law

FOLDER = Path(sweep.__file__).parents[1] / "studies" / "overlock208"
RECORD = json.loads((FOLDER / "expected.json").read_text())["optimum"]
THREADS = {"top": "pull", "bottom": "pull_low", "over": "pull_high"}


@pytest.fixture(scope="module")
def study():
    return load_study(FOLDER)


def test_recorded_head_keeps_every_limit_and_has_its_outputs(study):
    names = [*RECORD["outputs"], *(limit.output for limit in study.limits)]
    found = sweep.summarise(study.bare, RECORD["design"], list(dict.fromkeys(names)), accuracy=1e-9).iloc[0]
    assert found["status"] == 0
    for name, value in RECORD["outputs"].items():
        # Settled to some 1e-9 of their size, and read at events whose condition is some 1e3.
        assert found[name] == pytest.approx(value, rel=1e-6, abs=1e-9), name
    # the optimiser keeps limits to 1e-9 of their size
    loose = [
        replace(
            limit,
            minimum=None if limit.minimum is None else limit.minimum - 1e-8 * max(1.0, abs(limit.minimum)),
            maximum=None if limit.maximum is None else limit.maximum + 1e-8 * max(1.0, abs(limit.maximum)),
        )
        for limit in study.limits
    ]
    assert refusals(loose, found) == []


def test_recorded_head_has_all_moments_in_its_cyclogram(study):
    rows = sweep.cyclogram(study.bare, RECORD["design"])
    events = rows[rows["kind"] == "event"].set_index("name")["start"]
    degrees = np.degrees(events)
    assert 205.0 < degrees["a"] < 230.0 and 270.0 < degrees["b"] <= 320.0 + 1e-6 and 45.0 < degrees["c"] < 90.0
    assert degrees["leaves"] < degrees["feeds"] and degrees["rests"] < degrees["pierces"]
    # Each loop is let go after the next thread was taken, and before the needle is lowest.
    assert degrees["c"] < degrees["drop"] < degrees["cast"] < 180.0


def test_take_ups_are_the_smoothest_that_leave_a_tenth_of_a_millimetre(study):
    found = sweep.thread.diagram(study.bare, RECORD["design"], samples=360)
    for thread in (r for r in study.bare.relations if isinstance(r, ThreadBalance)):
        allowed = thread.allowed(found["phi"].to_numpy()) - 0.2
        law = smoothest_law(found["phi"], found[f"{thread.name}_demand"] + 0.1, allowed)
        own = {k: RECORD["design"][f"{THREADS[thread.name]}.{k}"] for k in law.coefficients}
        # the coefficients stand with three decimals
        assert own == pytest.approx(law.coefficients, abs=2e-3)
        assert found[f"{thread.name}_surplus"].min() > 0.09
