"""What follows from a family alone is found once; designs are handed on without a copy and come back unchanged."""

from dataclasses import replace

import numpy as np
import pytest

from sweep.effects import applicable
from sweep.evaluation.summaries import design_outputs
from sweep.families import family
from sweep.families.base import Accuracy, of_family
from sweep.reductions.steps import steps_of
from tests.support.rssr_designs import random_designs

RSSR = family("rssr")
OUTPUTS = ["margin", "swing", "max_pressure_angle", "max_abs_d2psi", "size", "least_link", "link_ratio"]


def test_a_function_of_a_family_is_called_once_for_each():
    asked = []

    @of_family
    def name(of):
        asked.append(of)
        return of.name

    other = replace(RSSR, name="other")
    assert [name(RSSR), name(RSSR), name(other), name(other)] == ["rssr", "rssr", "other", "other"]
    assert len(asked) == 2 and asked[0] is RSSR and asked[1] is other


def test_a_family_changed_by_replacement_inherits_nothing_that_was_found():
    without = replace(RSSR, steps=(), capabilities=())
    assert steps_of(RSSR) is steps_of(RSSR) and applicable(RSSR) is applicable(RSSR)
    assert {step.name for step in steps_of(without)}.isdisjoint(step.name for step in RSSR.steps)
    assert applicable(RSSR) and not applicable(without)


@pytest.mark.parametrize("accuracy", [Accuracy(target=1e-8), Accuracy(samples=90)], ids=["true", "sampled"])
def test_designs_come_back_unchanged_and_their_layout_changes_no_bit(accuracy):
    designs = random_designs(200, 5)
    given = designs.copy()
    found = design_outputs(RSSR, designs, OUTPUTS, accuracy)
    assert np.array_equal(designs, given)
    by_columns = design_outputs(RSSR, np.asfortranarray(designs), OUTPUTS, accuracy)
    assert found.keys() == by_columns.keys()
    for name, column in found.items():
        np.testing.assert_array_equal(column, by_columns[name], err_msg=name)
