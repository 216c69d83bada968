"""The list of local maxima that the search of the crank-rocker refines, against a plain loop over the samples."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as some

from kernels.arithmetic.intrinsics import lowest_bit
from kernels.families.rssr import sampling_tables
from kernels.families.rssr.block import BLOCK, ROWS
from kernels.families.rssr.sampling import (
    CAPACITY,
    FEWEST,
    GRID_SIZE,
    MARKS,
    MOST_PEAKS,
    START,
    Samples,
    list_marked,
    list_peaks,
    mark_peaks,
    new_list,
)
from kernels.jit import kernel
from kernels.types import TWO_PI as TURN

TABLE = sampling_tables()
SHARE = 0.6


@kernel
def _lowest(bits):
    return lowest_bit(bits)


@kernel
def _listed_of_one(at, table, size, n, m):
    return list_peaks(at, 0, table, n, SHARE, size, m, 0)


@kernel
def _listed_of_block(at, table, size, lengths, m):
    mark_peaks(BLOCK, size, SHARE)
    count = 0
    for k in range(BLOCK):
        count = list_marked(int(size[MARKS + k]), at, k, table, size, Samples(k, BLOCK, FEWEST, 0), m, count)
        lengths[k] = count


def expected(samples):
    """Numbers of the samples that are local maxima of at least 60 %, the turn closed; none if there are too many."""
    floor = SHARE * max(samples)
    n = len(samples)
    found = [
        i
        for i in range(n)
        if samples[i] >= floor and samples[i] > samples[i - 1] and samples[i] >= samples[(i + 1) % n]
    ]
    return found if len(found) <= MOST_PEAKS else []


def listed(m, begin, end, n):
    return [round(x * n / TURN) for x in m[START + begin : START + end]]


def closed(samples):
    return np.array([samples[-1], *samples, samples[0]], np.float64)


def few_peaks(n, r):
    """Samples that are low but for a few, so that not all have too many local maxima."""
    samples = r.uniform(0.0, 0.5, n)
    samples[r.integers(0, n, r.integers(1, 12))] = r.uniform(0.55, 1.0)
    return samples


@settings(deadline=None)  # the first call compiles
@given(some.integers(1, 2**63 - 1))
def test_the_lowest_bit_is_that_of_plain_integers(bits):
    assert _lowest(bits) == (bits & -bits).bit_length() - 1


def test_the_lowest_bit_of_no_bits_is_a_number_beyond_them():
    assert _lowest(0) == 64


@pytest.mark.parametrize("n", [32, 64, 128, 1024])
def test_peaks_of_one_design_are_those_of_a_plain_loop(n):
    r = np.random.default_rng(n)
    at, m = np.ones(ROWS * BLOCK), np.full(new_list().size, np.nan)
    lengths = set()
    for _ in range(300):
        samples = few_peaks(n, r)
        found = expected(samples)
        count = _listed_of_one(at, TABLE, closed(samples), n, m)
        assert listed(m, 0, count, n) == found
        lengths.add(count)
    assert {0, 1, 2, 3, MOST_PEAKS} <= lengths  # too many, few, and as many as there may be


def test_peaks_of_a_block_are_those_of_a_plain_loop():
    r = np.random.default_rng(1)
    at, lengths, grid, m = np.ones(ROWS * BLOCK), np.zeros(BLOCK, np.int64), np.empty(GRID_SIZE), new_list()
    for _ in range(50):
        samples = np.column_stack([few_peaks(FEWEST, r) for _ in range(BLOCK)])
        rows = grid.reshape(-1, BLOCK)
        rows[1 : FEWEST + 1], rows[0], rows[FEWEST + 1] = samples, samples[-1], samples[0]
        _listed_of_block(at, TABLE, grid, lengths, m)
        begin = 0
        for k in range(BLOCK):
            assert listed(m, begin, lengths[k], FEWEST) == expected(samples[:, k])
            begin = lengths[k]


def test_a_block_of_designs_with_as_many_peaks_as_there_can_be_fits_the_list():
    samples = np.tile([0.0, 1.0], FEWEST // 2)
    at, lengths, grid, m = np.ones(ROWS * BLOCK), np.zeros(BLOCK, np.int64), np.empty(GRID_SIZE), new_list()
    rows = grid.reshape(-1, BLOCK)
    rows[1 : FEWEST + 1], rows[0], rows[FEWEST + 1] = samples[:, None], samples[-1], samples[0]
    _listed_of_block(at, TABLE, grid, lengths, m)
    assert lengths[-1] == BLOCK * MOST_PEAKS
    # What is written beyond the last maximum stays within its row: a group of 64 samples has 32 at most.
    assert lengths[-1] + 32 + 2 <= CAPACITY
