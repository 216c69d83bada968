"""The study needle208: its size; accepted optimum and reference against what the kernels say of their dimensions."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

import sweep
from sweep.chunks.cascade import levels
from sweep.study import load_study
from tests.reference.needle_drive import share_within
from tests.support.needle208_record import record

FOLDER = Path(__file__).parents[2] / "studies" / "needle208"
EXPECTED = json.loads((FOLDER / "expected.json").read_text())


def outputs_of(design, more=()):
    names = list(dict.fromkeys([*EXPECTED["optimum"]["outputs"], *more]))
    table = {name: [value] for name, value in design.items()}
    row = sweep.summarise(["rssr", "guide"], table, names, accuracy=1e-10).iloc[0]
    assert row.status == 0
    return row


def test_full_study_sweeps_ten_million_designs_and_asks_for_the_documented_requirements():
    study = load_study(FOLDER)
    assert study.space.count >= 10**7
    limits = {limit.output: limit for limit in study.limits}
    assert limits["max_abs_dev"].maximum <= 0.05
    assert study.tolerance is not None and study.tolerance.robust == pytest.approx(0.95)
    assert (study.tolerance.lengths, study.tolerance.angles) == pytest.approx((0.02, np.radians(0.05)))
    links = {limit.output: limit.minimum for limit in study.parameter_limits}
    assert all(links[name] == pytest.approx(8.0) for name in ("a2", "b2", "c2", "e2"))
    for name in ("max_pressure_angle1", "max_pressure_angle2"):
        assert limits[name].maximum == pytest.approx(np.radians(45.0))
    assert limits["stroke"].minimum <= 24.5 <= limits["stroke"].maximum
    assert study.speed == pytest.approx(7000.0 * 2.0 * np.pi / 60.0)


def test_stage_1_is_judged_before_anything_is_fitted():
    stops = [level.route.outputs if level.route else ("fit",) for level in levels(load_study(FOLDER))]
    assert set(stops[0]) == {"rotatable1", "max_pressure_angle1"}
    assert stops[1:3] == [("swing1",), ("fit",)]


STUDIES = {
    "optimum": lambda: load_study(FOLDER),
    "better": lambda: load_study(FOLDER),
    "record": record,
    "record_8mm": lambda: record(8.0),
}


@pytest.mark.parametrize("found", STUDIES)
def test_accepted_optimum_has_the_accepted_figures_and_keeps_every_limit(found):
    study, design = STUDIES[found](), EXPECTED[found]["design"]
    row = outputs_of(design, [limit.output for limit in study.output_limits])
    for name, value in EXPECTED[found]["outputs"].items():
        assert row[name] == pytest.approx(value, rel=EXPECTED["relative_tolerance"])
    # Active limits are met to the optimiser's feasibility tolerance.
    for limit in study.parameter_limits:
        # A length at its bound comes out of its fraction of the bounds, one rounding beside.
        assert limit.maximum is not None and design[limit.output] <= limit.maximum * (1.0 + 1e-12)
        assert limit.minimum is None or design[limit.output] >= limit.minimum * (1.0 - 1e-12)
    for name, (low, high) in study.space.bounds.items():
        if name.endswith("1"):
            assert low - 1e-12 <= design[name] <= high + 1e-12
    for limit in study.output_limits:
        value = abs(row[limit.output]) if limit.output in ("swing1", "stroke") else row[limit.output]
        assert limit.maximum is None or value <= limit.maximum + 1e-8 * abs(limit.maximum)
        assert limit.minimum is None or value >= limit.minimum - 1e-8 * abs(limit.minimum)


def test_reference_is_the_textbook_design_and_has_the_accepted_figures():
    design = load_study(FOLDER).reference
    row = outputs_of(design)
    for name, value in EXPECTED["reference"]["outputs"].items():
        assert row[name] == pytest.approx(value, rel=EXPECTED["relative_tolerance"])
    # Brodell and Soni: swing 50 degrees, transmission angle at least 50 degrees, equal times; dimensions to 1e-4 mm.
    swing, mu = np.radians(50.0), np.radians(50.0)
    b = np.sqrt((1.0 - np.cos(swing)) / (2.0 * np.cos(mu) ** 2))
    c = np.sqrt((1.0 - b**2) / (1.0 - b**2 * np.cos(mu) ** 2))
    a = np.sqrt(b**2 + c**2 - 1.0)
    for name, ratio in (("a1", a), ("b1", b), ("c1", c)):
        assert design[name] == pytest.approx(ratio * design["e1"], abs=6e-5)
    # Chebyshev's lambda linkage 1 : 2 : 2.5 : 2.5 with the tracer at twice the coupler.
    for name, ratio in (("b2", 2.5), ("c2", 2.5), ("e2", 2.0), ("xi2", 5.0)):
        assert design[name] == pytest.approx(ratio * design["a2"], abs=2e-4)


def limits_of_what_is_made() -> dict[str, tuple[float, float]]:
    study = load_study(FOLDER)
    return {
        x.output: (-np.inf if x.minimum is None else x.minimum, np.inf if x.maximum is None else x.maximum)
        for x in study.output_limits
        if not x.output.startswith("rotatable")
    }


def share(design, count, limits=None):
    return share_within(design, limits or limits_of_what_is_made(), 0.02, np.radians(0.05), count, seed=29)


def test_accepted_share_of_what_is_made_keeps_every_limit():
    # 4000 mechanisms: 95 % is good to 0.35 %, three of which are allowed.
    assert share(EXPECTED["optimum"]["design"], 4000) == pytest.approx(EXPECTED["optimum"]["share"], abs=0.011)
    assert share(EXPECTED["better"]["design"], 4000) == pytest.approx(EXPECTED["better"]["share"], abs=0.011)
    assert EXPECTED["better"]["outputs"]["max_abs_d2s"] < 0.995 * EXPECTED["optimum"]["outputs"]["max_abs_d2s"]
    within = {"max_abs_dev": (0.0, 0.05)}
    assert share(EXPECTED["optimum"]["design"], 4000, within) > 0.95
    # What is best on paper is not what is best when made.
    assert share(EXPECTED["record"]["design"], 2000) < 0.05
    assert 0.5 < share(EXPECTED["record"]["design"], 2000, within) < 0.65


@pytest.mark.long
def test_accepted_share_holds_for_a_hundred_thousand_mechanisms():
    found = share(EXPECTED["optimum"]["design"], 100_000)
    # 0.07 % is the standard error of the share of so many.
    assert found == pytest.approx(EXPECTED["optimum"]["share"], abs=0.003) and found >= 0.95 - 0.0015


def test_optimum_beats_the_marks_of_the_source():
    best, old = EXPECTED["optimum"]["outputs"], EXPECTED["reference"]["outputs"]
    assert best["max_abs_d2s"] <= 0.85 * old["max_abs_d2s"]
    # The deviation counts as it is made: within the requirement for 95 % of the optimum, for 8 % of the reference.
    names = load_study(FOLDER).family.parameter_names
    known = {"branch1": 1.0, "branch2": 1.0, "kappa2": 1.0, "shift2": 0.0, "turn2": 0.0} | load_study(FOLDER).reference
    reference = {name: float(known[name]) for name in names}
    assert share(reference, 2000, {"max_abs_dev": (0.0, 0.05)}) < 0.1
    # Rest to rest over S within |a| <= A takes at least 2 sqrt(S/A), twice per turn: A >= 4 S/pi^2.
    assert best["max_abs_d2s"] > 4.0 * best["stroke"] / np.pi**2
