"""The table of costs: complete, without stale rows, and without influence on any value."""

from __future__ import annotations

import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import sweep.costs
from sweep.chunks.cascade import levels
from sweep.chunks.chunk import compute_chunk
from sweep.chunks.plan import make_plan
from sweep.effects import NAMES as EFFECTS
from sweep.effects import effect
from sweep.engine.estimate import estimate
from sweep.evaluation.summaries import design_outputs
from sweep.families import NAMES, family
from sweep.families.base import Accuracy, Family
from sweep.quantities.resolve import resolve
from sweep.reductions.margins import margin_suffixes, own_step
from sweep.reductions.steps import PANELS_NS, beyond_motion, group_ns, own_steps, pose_ns, steps_of
from sweep.study import load_study
from sweep.study.study import OutputSettings
from tests.bench.costs import PAGE, REASONS, page
from tests.support.frictional import frictional

ROOT = Path(__file__).resolve().parents[2]
STUDIES = sorted(path.parent for path in (ROOT / "studies").glob("*/study.toml"))
ACCURACIES = (Accuracy(samples=720), Accuracy(target=1e-8), Accuracy(target=1e-8, certify=True))


def test_table_has_a_row_for_everything_that_is_asked_for_and_no_other():
    rows = {section: set(found) for section, found in sweep.costs.table().items()}
    bare = [family(name) for name in NAMES]
    steps = {f"{f.name}: {step.name}" for f in bare for step in f.steps}
    entries = [effect(name) for name in EFFECTS]
    text = "".join(path.read_text() for path in (ROOT / "sweep").rglob("*.py"))
    assert rows.pop("poses") == set(NAMES)
    assert rows.pop("steps") == steps
    assert rows.pop("samples") < steps
    assert rows.pop("margins") == {
        f.name for f in bare for suffix in margin_suffixes(f) if own_step(f, suffix, ACCURACIES[1]) is None
    }
    assert rows.pop("effects") == {entry.name for entry in entries if entry.outputs}
    assert rows.pop("effects_design") == {entry.name for entry in entries if entry.design_result is not None}
    assert rows.pop("work") == set(re.findall(r'nanoseconds\("work", "([^"]+)"\)', text))
    assert not rows
    assert all(ns >= 0.0 for found in sweep.costs.table().values() for ns in found.values())


def test_page_shows_the_table_and_says_why_a_pose_is_dear():
    poses = sweep.costs.table()["poses"]
    assert PAGE.read_text() == page(poses)
    assert {name for name, ns in poses.items() if ns > 3.0 * poses["rssr"]} == set(REASONS)


def test_what_is_not_measured_yet_has_a_cost(monkeypatch):
    monkeypatch.setattr(sweep.costs, "table", dict)
    for kind, ns in sweep.costs.UNMEASURED.items():
        assert sweep.costs.nanoseconds(kind, "not measured yet") == ns
    study = load_study(ROOT / "studies" / "needle208", smoke=True)
    assert np.isfinite(estimate(study, 1).seconds)


def register() -> list[Family]:
    chains = [family(names) for names in (["rssr", "guide"], ["rssr", "rssr", "rssr"], ["geared_dwell", "guide"])]
    return [*map(family, NAMES), *chains]


@pytest.mark.parametrize("mechanism", register(), ids=lambda f: f.name)
def test_one_own_step_at_most_serves_an_output_at_an_accuracy(mechanism):
    """Otherwise a measured time could decide which of two steps computes a value."""
    names = {o.name for step in steps_of(mechanism) for o in step.provides}
    names |= {f"{name}1" for name in names}
    for name in names:
        for accuracy in ACCURACIES:
            assert sum(step.applies(accuracy) for step, _, _ in own_steps(mechanism, name)) <= 1, (name, accuracy)


def slower(table: dict[str, dict[str, float]], factor: float, every: int) -> dict[str, dict[str, float]]:
    """The table with every n-th row multiplied."""
    return {
        section: {row: ns * (factor if k % every == 0 else 1.0) for k, (row, ns) in enumerate(rows.items())}
        for section, rows in table.items()
    }


@pytest.mark.parametrize(("factor", "every"), [(10.0, 2), (10.0, 1), (0.01, 3)])
@pytest.mark.parametrize("where", ["studies/geared-dwell", "studies/needle208", "tests/studies/earlier/stitch208"])
def test_rows_and_identity_of_a_dataset_do_not_depend_on_measured_times(where, factor, every, monkeypatch):
    def sweep_now():
        study = replace(load_study(ROOT / where, smoke=True), output=OutputSettings("all"))
        stop = min(study.space.count, 1500)
        done = compute_chunk(study, 0, stop)
        order = [(level.route.name, level.route.outputs) if level.route else "fit" for level in levels(study)]
        return done, order, make_plan(study, 512).identity, estimate(study, 1).seconds

    table = sweep.costs.table()
    before, order, identity, seconds = sweep_now()
    monkeypatch.setattr(sweep.costs, "table", lambda: slower(table, factor, every))
    after, order_after, identity_after, seconds_after = sweep_now()
    assert seconds_after != seconds, "the other figures must have been read"
    assert order_after == order and identity_after == identity
    assert after.counts_by_status == before.counts_by_status and after.missed_by_limit == before.missed_by_limit
    assert before.columns["design"].size > 100 and len(before.counts_by_status) > 1
    for column, values in before.columns.items():
        assert values.tobytes() == after.columns[column].tobytes(), column


@pytest.mark.parametrize(
    ("of", "name"), [("friction", "max_abs_drive_torque_friction"), ("slider_friction", "max_abs_shaft_torque_a")]
)
def test_an_extremum_with_kinks_is_priced_as_its_search_on_panels(of, name):
    """The poses that a search looks at, counted, against those in its price.

    A factor of three: the constant is the mean of outputs that take 1700 to 11000 poses.
    """
    full, _, designs = frictional(of, 20)
    poses = [0]

    def counting(designs, angles, wanted):
        found = full.poses(designs, angles, wanted)
        poses[0] += found["status"].size
        return found

    target = Accuracy(target=1e-8)
    design_outputs(replace(full, poses=counting, precise_poses=None), designs, [name], target)
    price = group_ns(full, "reductions", [name], target) - PANELS_NS
    of_a_pose = pose_ns(full) + beyond_motion(full, resolve(full, name).of).ns
    assert 1.0 / 3.0 < poses[0] / len(designs) / (price / of_a_pose) < 3.0


@pytest.mark.parametrize("path", STUDIES, ids=lambda path: path.name)
def test_the_order_of_work_puts_no_dear_route_before_a_cheap_one_that_a_limit_tests(path):
    """Order is fixed by kind of work, not by time; here it is held against the measured times.

    A factor of eight: within a kind of work the order is that of the sources, not of the time, and two measurements of
    a time differ by a fifth.
    """
    study = load_study(path)
    tested = {limit.output for limit in study.tested_limits}
    before = 0.0
    for level in levels(study):
        if level.route is not None and tested.intersection(level.route.outputs):
            assert before < 8.0 * level.ns_per_design, level.route.name
        before = max(before, level.ns_per_design)
