"""What the comparison of enclosures compares: every arithmetic encloses the same numbers of the same designs."""

from __future__ import annotations

import numpy as np
import pytest

from sweep.proof.question import question_of
from sweep.study.load import load_study
from tests.bench import libflint
from tests.bench.boxes import WANTED, mechanisms, taylor
from tests.bench.enclosures import COMPILED, IN_PYTHON, NAMES, STUDIES, parts_needed, spread
from tests.support.selection import mostly_long

SIDE, BOXES = 1 / 1024, 6  # of the ranges
ARITHMETICS = COMPILED | IN_PYTHON


@pytest.fixture(scope="module", params=NAMES)
def drawn(request):
    """The formulas of a study, boxes about mechanisms, and the least and largest values of designs in them."""
    question = question_of(load_study(STUDIES / request.param))
    formula, boxes = mechanisms(question, BOXES)
    boxes = boxes.sized((question.high - question.low) * SIDE)
    return formula, boxes, spread(formula, boxes)


@pytest.mark.parametrize("name", mostly_long(ARITHMETICS, list(ARITHMETICS)[::4]))
def test_every_arithmetic_encloses_the_values_of_designs_in_its_boxes(drawn, name):
    formula, boxes, (least, most) = drawn
    low, high = ARITHMETICS[name](formula, boxes)
    known = ~np.isnan(low)
    assert known.any(axis=0).all() and low.shape == (BOXES, len(WANTED))
    # what the designs' own values have lost to rounding
    rounding = 1e-10 * (1.0 + np.abs(least[known]) + np.abs(most[known]))
    assert (low[known] <= least[known] + rounding).all()
    assert (high[known] >= most[known] - rounding).all()


def test_balls_from_compiled_code_are_those_of_python(drawn):
    formula, boxes, _ = drawn
    point = boxes.at(np.zeros(boxes.centre.shape[1]))  # no width: what is left is the rounding at 53 bits
    ours, theirs = libflint.first_order(formula, point), IN_PYTHON["balls alone"](formula, point)
    for end, other in zip(ours, theirs, strict=True):
        np.testing.assert_allclose(end, other, rtol=1e-9, atol=1e-9)


def test_fewer_parts_of_a_box_are_needed_for_a_lower_aim(drawn):
    formula, boxes, (least, most) = drawn
    box, reach = boxes.taken([0]), most[0, 0] - least[0, 0]
    close, far = (parts_needed(taylor, formula, box, least[0, 0] - share * reach) for share in (0.001, 10.0))
    assert far == 1.0 and close > far
    assert parts_needed(taylor, formula, box, most[0, 0]) == np.inf  # above what designs of the box have
