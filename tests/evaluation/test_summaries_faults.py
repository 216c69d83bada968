"""What ``summarise`` refuses, and how its answer is laid out."""

from __future__ import annotations

import numpy as np
import pandas as pd
import pytest

import sweep
from kernels import status as st
from sweep.errors import InputError
from sweep.evaluation.summaries import design_outputs, output, output_names, routes
from sweep.families import family
from sweep.families.base import Accuracy
from tests.support.turn_designs import NEEDLE, RSSR, crank_rockers, needle_drives

TABLE = {"a": [1.0], "b": [3.0], "c": [2.0], "e": [3.5], "f": [0.1], "g": [0.2], "alpha": [0.3]}


@pytest.mark.parametrize(
    ("name", "nearest"),
    [
        ("max_abs_d2phi", "max_abs_d2psi"),
        ("swng", "swing"),
        ("strok", None),
        ("max_pressure_angle1", "max_pressure_angle"),
        ("range_Psi", "range_psi"),
        ("transmission_angle", "least_transmission_angle"),
        ("min_transmission_angle", "least_transmission_angle"),
        ("stroke", "swing"),
        ("quick_return_ratio", "stroke_ratio"),
        ("max_torque", "max_abs_drive_torque"),
        ("coefficient_of_fluctuation", "unevenness"),
    ],
)
def test_unknown_output_is_refused_with_the_nearest_name(name, nearest):
    with pytest.raises(InputError, match=name) as caught:
        sweep.summarise("rssr", TABLE, [name])
    assert "design outputs of rssr" in str(caught.value)
    if nearest is not None:
        assert f"did you mean '{nearest}'" in str(caught.value)


@pytest.mark.parametrize(
    ("settings", "word"),
    [
        ({"samples": 100, "accuracy": 1e-6}, "not both"),
        ({"samples": 0}, "samples"),
        ({"samples": 10.5}, "samples"),
        ({"samples": 10**9}, "samples"),
        ({"accuracy": 0.0}, "accuracy"),
        ({"accuracy": 2.0}, "accuracy"),
        ({"accuracy": float("nan")}, "accuracy"),
        ({"window": (0.5, 0.2)}, "window"),
        ({"window": (-0.1, 0.2)}, "window"),
        ({"window": (0.0, 1.2)}, "window"),
    ],
)
def test_bad_settings_are_refused(settings, word):
    with pytest.raises(InputError, match=word):
        sweep.summarise("rssr", TABLE, ["margin"], **settings)


def test_bad_values_name_their_row_and_column():
    with pytest.raises(InputError, match="column b, row 0"):
        sweep.summarise("rssr", TABLE | {"b": [-3.0]}, ["margin"])


def test_columns_come_in_order_with_errors_and_the_tables_index():
    table = pd.DataFrame(TABLE, index=["mine"])
    wanted = ["max_abs_d2psi", "rotatable", "swing", "max_abs_d2psi", "status"]
    frame = sweep.summarise("rssr", table, wanted)
    names = ["max_abs_d2psi", "rotatable", "swing"]
    assert list(frame.columns) == [*names, *(f"err_{name}" for name in names), "status"]
    assert list(frame.index) == ["mine"]
    assert frame["rotatable"].dtype == np.bool_
    assert frame["status"].dtype == np.uint8
    assert list(sweep.summarise("rssr", table, "margin", samples=64).columns) == ["margin", "status"]


@pytest.mark.parametrize("accuracy", [Accuracy(target=1e-6), Accuracy(samples=90)])
@pytest.mark.parametrize(("mechanism", "make"), [(RSSR, crank_rockers), (NEEDLE, needle_drives)])
def test_nan_never_stands_without_a_status(mechanism, make, accuracy):
    designs = make(300, 51)
    amplitude = "swing" if mechanism is RSSR else "stroke"
    names = ["rotatable", "margin", "max_pressure_angle", amplitude, "phi0", f"max_abs_d2{mechanism.position}"]
    found = design_outputs(mechanism, designs, names, accuracy)
    ok = found["status"] == st.OK
    assert 10 < ok.sum() < 290
    for name, values in found.items():
        assert np.isfinite(np.asarray(values, float)[ok]).all(), name
    assert np.isnan(found[names[-1]][found["status"] == st.NOT_ROTATABLE]).all()


def test_order_and_company_change_no_bit():
    designs = needle_drives(200, 52)
    names = ["margin", "stroke", "max_abs_d2s"]
    together = design_outputs(NEEDLE, designs, names, Accuracy(target=1e-8))
    order = np.random.default_rng(1).permutation(200)
    shuffled = design_outputs(NEEDLE, designs[order], names, Accuracy(target=1e-8))
    halves = [design_outputs(NEEDLE, part, names, Accuracy(target=1e-8)) for part in (designs[:77], designs[77:])]
    for name, values in together.items():
        np.testing.assert_array_equal(values[order], shuffled[name])
        np.testing.assert_array_equal(values, np.concatenate([half[name] for half in halves]))


@pytest.mark.parametrize("accuracy", [Accuracy(target=1e-6), Accuracy(samples=90)])
def test_no_designs_give_no_rows(accuracy):
    found = design_outputs(
        NEEDLE, np.empty((0, len(NEEDLE.parameters))), ["margin", "stroke", "max_abs_dev"], accuracy, (0.0, 0.5)
    )
    assert all(values.shape == (0,) for values in found.values())


def test_samples_approach_the_refined_values_from_below():
    designs = crank_rockers(200, 53)
    refined = design_outputs(RSSR, designs, ["max_abs_d2psi"], Accuracy(target=1e-10))
    ok = refined["status"] == st.OK
    gaps = []
    for samples in (64, 256, 1024):
        sampled = design_outputs(RSSR, designs, ["max_abs_d2psi"], Accuracy(samples=samples))
        gap = (1.0 - sampled["max_abs_d2psi"] / refined["max_abs_d2psi"])[ok]
        assert (gap >= -1e-9).all()
        gaps.append(np.median(gap))
    # Second order: four times as many samples, a sixteenth of the error.
    assert gaps[0] / gaps[1] == pytest.approx(16.0, rel=0.7)
    assert gaps[1] / gaps[2] == pytest.approx(16.0, rel=0.7)


@pytest.mark.parametrize("name", ["rssr", "rssp", "guide", "geared_dwell", ("rssr", "guide"), ("rssr", "rssr")])
def test_every_listed_output_has_a_definition_and_a_route(name):
    mechanism = family(name)
    names = output_names(mechanism)
    assert len(set(names)) == len(names)
    for one in names:
        definition = output(mechanism, one)
        assert definition.name == one
        assert definition.text
        assert definition.unit
    found = routes(mechanism, names, Accuracy(target=1e-8))
    assert sorted(n for route in found for n in route.outputs) == sorted(names)
    kinds = [route.order for route in found]
    assert kinds == sorted(kinds)
    assert all(route.ns_per_design > 0.0 for route in found)


def test_routes_can_be_run_one_by_one():
    designs = needle_drives(100, 54)
    names = ["rotatable", "stroke", "max_abs_dev", "max_pressure_angle1", "max_abs_d2s"]
    accuracy = Accuracy(target=1e-8)
    whole = design_outputs(NEEDLE, designs, names, accuracy, (0.0, 0.6))
    for route in routes(NEEDLE, names, accuracy):
        part = design_outputs(NEEDLE, designs, route.outputs, accuracy, (0.0, 0.6))
        good = whole["status"] == st.OK
        for name in route.outputs:
            np.testing.assert_array_equal(part[name][good], whole[name][good])
