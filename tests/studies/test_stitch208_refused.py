"""The accepted optimum of stitch208 is no stitch: refused under both senses, in words, for stated reasons."""

from __future__ import annotations

import json
import math
from pathlib import Path

import pytest

import sweep
from sweep.quantities.limits import Limit
from tests.support.refusals import refusals

RECORD = json.loads((Path(__file__).parent / "earlier" / "stitch208" / "expected.json").read_text())
DESIGN = {name: value for name, value in RECORD["optimum"]["design"].items() if not name.endswith("_tip")}
# Out of the scarf towards the tip as it passes; the guided point stands in place of the scarf.
SCARF = [0.78733824, 0.33394908, 0.51824367]
PLACE = {"axis": [-0.3904773097583, 0.9206125518175, 0.0], "zero": [0.0, 0.0, 1.0]}
LIMITS = (
    Limit("count_a", 1.0, 1.0), Limit("a_rise", 1.5, 3.0), Limit("a_clearance", 0.0, 0.1), Limit("a_gauge", 3.0),
    Limit("a_overtravel", 1.5), Limit("a_directness", 0.5), Limit("a_back_height", -0.2, 0.2),
)  # fmt: skip


def passage(sense):
    members = {"needle": ["rssr", "guide"], "looper": {"family": "slotted", "place": PLACE}}
    needle = {"on": "needle.point", "line": "line", "sense": -1, "scarf": SCARF, "diameter": 0.0, "top": -5.0}
    tools = {
        "thin": needle | {"scarf_end": -3.0, "eye": 2.0, "point": 6.0},
        "blade": {"on": "looper", "tip": [30.0, 0.0, 0.0], "back": [20.0, 0.0, 0.0]},
    }
    machine = sweep.machine(members, {"a": {"take": ["thin", "blade"], "sense": sense}}, tools=tools)
    names = ["phi_a", "a_reach", "a_above_eye", *(limit.output for limit in LIMITS)]
    return sweep.summarise(machine, DESIGN, names, accuracy=1e-9).iloc[0]


def test_passing_down_the_tip_comes_too_early_and_turns_back_at_once():
    found = passage(1)
    assert math.degrees(found["phi_a"]) == pytest.approx(185.95, abs=0.005)
    assert found["a_clearance"] == pytest.approx(0.0615, abs=5e-5)
    words = refusals(LIMITS, found)
    assert "a_rise = 0.05538, at least 1.5 and at most 3 is asked" in words
    assert "a_overtravel = 0.3666, at least 1.5 is asked" in words


def test_passing_up_the_tip_has_no_gauge_and_is_carried_by_the_needle():
    found = passage(-1)
    assert math.degrees(found["phi_a"]) == pytest.approx(217.49, abs=0.005)
    assert (found["a_rise"], found["a_clearance"]) == pytest.approx((2.22, 0.0685), abs=2e-3)
    assert found["a_reach"] == pytest.approx(0.37, abs=5e-3)
    words = refusals(LIMITS, found)
    assert [line.split(" ")[0] for line in words] == ["a_gauge", "a_directness", "a_back_height"]
    assert "a_gauge = -0.3268, at least 3 is asked" in words
    assert "a_directness = 0.3635, at least 0.5 is asked" in words
