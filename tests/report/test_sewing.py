"""The sentence that says whether a machine sews: rooms of its moments by speed, given by hand."""

from __future__ import annotations

import numpy as np
import pytest

from sweep.report.sewing import sewing_sentence, window_sentence

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
