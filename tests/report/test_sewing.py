"""The sentence that says whether a machine sews: rooms of its moments by speed, given by hand."""

from __future__ import annotations

import json
import math
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

import sweep
from sweep.report.sewing import sewing_sentence, sewn, window_sentence
from sweep.study.load import load_study

SPEEDS = np.array([500.0, 3000.0, 7000.0])


@pytest.mark.parametrize(
    ("a", "c", "sentence"),
    [
        (
            [0.5, 0.3, 0.04], [0.2, 0.2, 0.2],
            "It sews at 500 to 7000 rpm: moment A has least to spare, 0.04\u00a0mm at 7000\u00a0rpm.",
        ),
        (
            [0.1, -0.1, -0.25], [0.2, 0.2, 0.2],
            "It does not sew at 3000 and 7000 rpm: moment A misses by 0.25\u00a0mm at 7000\u00a0rpm.",
        ),
        (
            [0.1, 0.1, 0.1], [-0.02, 0.2, 0.2],
            "It does not sew at 500 rpm: moment C misses by 0.02\u00a0mm at 500\u00a0rpm.",
        ),
        (
            [-1e-13, 0.1, 0.1], [0.2, 0.2, 0.2],
            "It sews at 500 to 7000 rpm: moment A has nothing to spare at 500\u00a0rpm.",
        ),
        ([0.1, 0.1, 0.1], [np.nan, np.nan, np.nan], "It does not sew: moment C does not happen."),
    ],
)  # fmt: skip
def test_moment_with_least_to_spare_is_named(a, c, sentence):
    assert sewing_sentence({"a": np.array(a), "c": np.array(c)}, SPEEDS) == sentence


@pytest.mark.parametrize(
    ("low", "high", "sentence"),
    [
        (
            1.5,
            2.5,
            "All fields permit a rise of at least 1.5\u00a0mm for loose, at most 2.5\u00a0mm for thick.",
        ),
        (2.0, 1.8, "No rise suits all fields: at least 2\u00a0mm for loose, at most 1.8\u00a0mm for thick."),
    ],
)
def test_fields_that_bind_are_named(low, high, sentence):
    assert window_sentence(("loose", low), ("thick", high)) == sentence


def test_shares_by_speed_have_their_intervals_and_both_ends_of_the_window():
    folder = Path(sweep.__file__).parents[1] / "studies" / "overlock208"
    study, count = load_study(folder), 64
    accepted = json.loads((folder / "expected.json").read_text())["optimum"]
    # Four times as rough as the study has it, so that some of what is made miss the least rise at the least speed.
    tolerance = replace(study.tolerance, lengths=4.0 * study.tolerance.lengths, samples=count)
    optimum = dict(study.space.fixed) | accepted["design"]
    found = sewn(SimpleNamespace(study=replace(study, tolerance=tolerance), optimum=optimum))
    stated = [found.speeds[at] for at, _, _ in found.rows]
    assert found.count == count and stated == pytest.approx([500.0, 3000.0, 7000.0, 8500.0], rel=1e-15)
    # The least rise falls from 1.5 mm at 500 rpm to 1 mm at 8500 rpm; an uneven shaft passes at its slowest as well.
    slowest = sweep.summarise(study.family, optimum, ["shaft_slowest"], accuracy=1e-8)["shaft_slowest"][0]
    share = slowest / (7000.0 * 2.0 * math.pi / 60.0)
    slow, fast = (
        accepted["outputs"]["a_rise"] - (1.5 - 0.5 * (share * rpm - 500.0) / 8000.0) for rpm in (500.0, 8500.0)
    )
    assert 0.99 < share < 0.996
    assert found.rows[0][-1] == f"least (slow and loose), {slow:.3g}\u00a0mm"
    assert found.rows[-1][-1] == f"least (fast and thick), {fast:.3g}\u00a0mm"
    assert 0.5 < found.ends["above"][0] < 1.0 and found.ends["above"][-1] == 1.0
    assert (found.shares <= np.minimum(*found.ends.values())).all()
    # Wilson's interval: shares p with |p - seen| <= z sqrt(p (1 - p)/n), z = 1.96
    z = 1.959963984540054
    for seen, low, high in zip(found.shares, found.low, found.high, strict=True):
        for p in {low, high} - {0.0, 1.0}:
            assert abs(p - seen) == pytest.approx(z * math.sqrt(p * (1.0 - p) / count), abs=1e-9)
        assert low <= seen <= high
