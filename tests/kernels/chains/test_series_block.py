"""The fused search takes designs in blocks: what it finds does not depend on how, to the last bit."""

from __future__ import annotations

import math

import numpy as np
import pytest

from kernels import chains as chain_kernels
from kernels import status as st
from kernels.arithmetic.intrinsics import power_below
from kernels.chains.form import BLOCK
from kernels.families import guide, rssr
from kernels.jit import kernel
from sweep.quantities.kinds import Request
from sweep.reductions import extrema, fused
from tests.support.turn_designs import NEEDLE, needle_drives

CHAIN = chain_kernels.chained((rssr.FORM, guide.FORM))


@kernel
def powers(x, out):
    for i in range(x.size):
        out[i] = power_below(x[i])


def found(designs, along=False):
    """Largest |s''| of each design: status, value, place, their errors."""
    n = len(designs)
    opening, distance = np.empty(n, np.uint8), np.empty(n)
    rssr.opening(designs, opening, distance)
    status, values, made_of = np.empty((1, n), np.uint8), np.empty((6, 1, n)), np.tile([1.0, 0.0, 0.0], (n, 1))
    search = chain_kernels.find_extrema(CHAIN, (2,), along)
    modes = np.array([0])
    search(designs, opening, distance, chain_kernels.sampling_tables(), made_of, modes, 1e-8, -1.0, status, values)
    return status[0], values[:, 0]


def test_the_power_of_two_below_is_that_of_frexp_and_has_no_call():
    r = np.random.default_rng(1)
    x = np.concatenate(
        [r.choice([-1.0, 1.0], 2000) * 2.0 ** r.uniform(-1021, 1023, 2000), 2.0 ** np.arange(-1022, 1024)]
    )
    out = np.empty_like(x)
    powers(x, out)
    np.testing.assert_array_equal(out, [math.ldexp(0.5, math.frexp(y)[1]) for y in x])
    odd, of_odd = np.array([0.0, 5e-324, -(2.0**-1023), math.inf, -math.inf, math.nan]), np.empty(6)
    powers(odd, of_odd)
    np.testing.assert_array_equal(of_odd, [0.0, 0.0, 0.0, math.inf, math.inf, math.inf])
    np.testing.assert_array_equal(of_odd, [power_below(y) for y in odd])


@pytest.mark.parametrize("first", [0, 1, BLOCK // 2, BLOCK - 1])
def test_no_bit_depends_on_where_in_a_block_a_design_stands(first):
    # Of all kinds: some do not turn, some need more than the first samples, so places in the block differ from rows.
    designs = needle_drives(12 * BLOCK, 3)
    status, values = found(designs)
    assert set(np.unique(status)) >= {st.OK, st.NOT_ROTATABLE}
    assert len(np.unique(values[5][status == st.OK])) > 3  # spacings of the samples
    moved_status, moved = found(np.ascontiguousarray(designs[first:]))
    np.testing.assert_array_equal(moved_status, status[first:])
    np.testing.assert_array_equal(moved, values[:, first:])


def test_derivatives_along_the_line_have_the_bits_of_those_in_any_direction():
    designs = needle_drives(12 * BLOCK, 4)
    for general, along in zip(found(designs), found(designs, along=True), strict=True):
        np.testing.assert_array_equal(general, along)


@pytest.mark.parametrize("target", [1e-3, 1e-8, 1e-13])  # at the finest most are confirmed by precise poses
def test_velocity_and_acceleration_share_samples_and_have_the_bits_of_each_alone(target):
    designs, both = needle_drives(12 * BLOCK, 5), (Request("d2s", 0), Request("ds", 0))
    curve = fused.curve_of(NEEDLE, both[0], False)
    assert [one.order for one in fused.together(curve, both)] == [1, 2]
    assert fused.together(curve, both[:1]) == (curve,)
    assert fused.together(curve, (both[0], both[1]._replace(mode=1))) == (curve,)
    placed = fused.curve_of(NEEDLE, both[0]._replace(place=True), False)
    assert fused.together(placed, [one._replace(place=True) for one in both]) == (placed,)
    shared, status = extrema.true_extrema(NEEDLE, designs, both, target)
    assert set(np.unique(status)) >= {st.OK, st.NOT_ROTATABLE}
    for request in both:
        alone, own = extrema.true_extrema(NEEDLE, designs, [request], target)
        np.testing.assert_array_equal(own, status)
        np.testing.assert_array_equal(alone[request], shared[request])
