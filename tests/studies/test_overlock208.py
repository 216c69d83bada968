"""The accepted head of overlock208 keeps its limits, makes a stitch, and gives the outputs that are on record."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

import sweep
from sweep.quantities.limits import refusals
from sweep.study.load import load_study

FOLDER = Path(sweep.__file__).parents[1] / "studies" / "overlock208"
RECORD = json.loads((FOLDER / "expected.json").read_text())["optimum"]


def test_recorded_head_keeps_every_limit_and_has_its_outputs():
    study = load_study(FOLDER)
    names = [*RECORD["outputs"], *(limit.output for limit in study.limits)]
    found = sweep.summarise(study.family, RECORD["design"], list(dict.fromkeys(names)), accuracy=1e-9).iloc[0]
    assert found["status"] == 0
    for name, value in RECORD["outputs"].items():
        # Settled to some 1e-9 of their size, and read at events whose condition is some 1e3.
        assert found[name] == pytest.approx(value, rel=1e-6, abs=1e-9), name
    assert refusals(study.limits, found) == []


def test_recorded_head_has_all_moments_in_its_cyclogram():
    study = load_study(FOLDER)
    rows = sweep.cyclogram(study.family, RECORD["design"])
    events = rows[rows["kind"] == "event"].set_index("name")["start"]
    degrees = np.degrees(events)
    assert 205.0 < degrees["a"] < 230.0 and 270.0 < degrees["b"] < 320.0 and 45.0 < degrees["c"] < 90.0
    assert degrees["leaves"] < degrees["feeds"] and degrees["rests"] < degrees["pierces"]
