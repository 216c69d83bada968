"""Fetching ahead changes nothing: whatever rows are named, the table is as it was and nothing beyond it is touched."""

from __future__ import annotations

import numpy as np
import pytest

from kernels.arithmetic.intrinsics import prefetch_rows
from kernels.jit import kernel


@kernel
def sum_after_fetching(table, begin, end):
    prefetch_rows(table, begin, end)
    total = 0.0
    for i in range(table.shape[0]):
        for j in range(table.shape[1]):
            total += table[i, j]
    return total


@pytest.mark.parametrize(("begin", "end"), [(0, 7), (3, 900), (7, 71), (40, 104), (5, 5)])
@pytest.mark.parametrize("columns", [1, 8, 19])
def test_rows_fetched_ahead_keep_their_numbers_also_where_the_table_ends(begin, end, columns):
    table = np.arange(7.0 * columns).reshape(7, columns)
    before = table.copy()
    assert sum_after_fetching(table, begin, end) == before.sum()
    np.testing.assert_array_equal(table, before)


def test_rows_of_an_empty_table_are_none():
    assert sum_after_fetching(np.empty((0, 19)), 0, 64) == 0.0
